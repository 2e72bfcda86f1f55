"""`python -m kerrcaustics` is the command line."""

from kerrcaustics.cli import main

if __name__ == "__main__":
    main()
