"""Results: what each of them says about itself once, and the files, records and Datasets that come from that."""
