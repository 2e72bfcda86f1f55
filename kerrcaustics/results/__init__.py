"""Results: one declaration of each, and the files, records and Datasets that follow from it."""
