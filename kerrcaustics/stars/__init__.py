"""What caustics do to the stars: images, tracks, counts."""
