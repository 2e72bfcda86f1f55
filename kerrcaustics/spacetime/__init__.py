"""The Kerr metric, cameras, photon constants and the shadow, without rays."""
