"""The sky seen through the hole: views of the camera sky, skies to look at, pictures of them."""
