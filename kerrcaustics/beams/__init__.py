"""Rays and beams: which star direction a camera-sky direction sees, and how magnified."""
