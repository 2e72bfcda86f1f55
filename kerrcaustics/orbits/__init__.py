"""Motions of bodies about the hole."""
