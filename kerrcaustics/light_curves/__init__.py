"""Sources on any orbit: their images followed along it, and their light."""
