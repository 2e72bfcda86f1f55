"""The studies: each a folder with a main.py; see README.md."""
