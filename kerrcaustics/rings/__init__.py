"""Photon rings: lensing bands next to the shadow edge, what they say of the hole, and their visibilities."""
