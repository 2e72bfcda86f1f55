"""Disks in the equatorial plane: their images, their emission, and their light in pictures."""
