"""Scene files: a hole, a camera on its way, a view, a sky, a disk and their light, said in TOML and made pictures of."""
