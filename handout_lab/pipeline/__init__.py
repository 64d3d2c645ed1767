"""The work of the verbs `study` and `score`, as `handout.pipeline` has that of the others."""
