"""The stage set: the Kerr metric, cameras, photon constants, the shadow. No rays yet."""
