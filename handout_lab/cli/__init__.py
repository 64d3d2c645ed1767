"""The verbs `study` and `score` on the command line; found by their entry points."""
