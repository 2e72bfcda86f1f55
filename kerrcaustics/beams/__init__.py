"""Rays and beams: the star direction of each camera-sky direction, and the magnification."""
