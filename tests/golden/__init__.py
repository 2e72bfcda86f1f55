"""Answers of the program, recorded, so that two versions of it can be compared: see `python -m tests.golden -h`."""
