"""What runs of studies leave behind, and the report: one page of them, for whoever must judge how far to trust it."""
