"""Disks in the equatorial plane: where they are seen, what they shine with, how they are lit."""
