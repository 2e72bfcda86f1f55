"""Arcs that bound images, and the areas within them."""
