"""Curves on the camera sky along which a star moves that runs round a circle: tracks, and images of great circles."""
