"""`python -m kerrcaustics`, and `kerrcaustics` itself: the command line."""

from kerrcaustics.interrupts import on_interrupt


def main() -> None:
    """Run the command line; Ctrl-C ends it with one line even while it is loading."""
    on_interrupt()
    from kerrcaustics.cli import main as run

    run()


if __name__ == "__main__":
    main()
