"""Waves: the field of a monochromatic source at the viewer, finite at caustics."""
