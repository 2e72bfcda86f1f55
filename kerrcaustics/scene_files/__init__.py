"""Scene files: hole, camera on its way, view, sky, disk and light, written in TOML, and their pictures."""
