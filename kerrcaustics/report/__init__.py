"""Records of studies, and the report: one page of them that shows how far to trust the package."""
