"""`python -m handout` does what the command `handout` does, which begins here."""

import sys


def main() -> None:
    """Run the command; Ctrl-C while that is still being loaded ends it as Ctrl-C does later, without a traceback."""
    try:
        from handout.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("Interrupted.\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
