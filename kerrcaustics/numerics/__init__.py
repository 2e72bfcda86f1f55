"""Small numerical methods in NumPy, where SciPy would take longer to load than what calls it takes to run."""
