"""Scene files: hole, camera on its way, view, sky, disk and light, said in TOML and made pictures of."""
