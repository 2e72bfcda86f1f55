"""The report: one page of the studies that were run, for whoever must judge how far to trust the numbers."""
