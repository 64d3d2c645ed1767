"""`python -m handout` does what the command `handout` does."""

from handout.cli import main

main()
