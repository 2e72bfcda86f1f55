"""Scene files: hole, camera and its path, view, sky, disk and light, written in TOML, and their pictures."""
