"""Pictures: plots of critical curves and caustics, and the style they share."""
