"""Stars behind caustics: images, tracks, counts."""
