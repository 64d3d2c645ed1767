"""The languages plotters speak, one package each; see `handout.plotting.dialect` for what they have in common."""
