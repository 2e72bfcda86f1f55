"""Interfaces to astronomy: physical units, FITS files and HEALPix maps."""
