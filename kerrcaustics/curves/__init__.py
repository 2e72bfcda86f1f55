"""Critical curves on the camera sky, and their images, the caustics on the celestial sphere."""
