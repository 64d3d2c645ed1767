"""Targets to timed strokes: everything about how a pen moves.

Where the time of a stroke is decided: `trace` gives every letter of a drawn hand to a motor engine, which spends an
interval on each point of its plan; ink of a scanned hand has only a path, whose pace `timing` works out.  `timing` also
has the time that the pen is in the air, for both.

- `trace`: a manuscript as a drawing with times; the one way from writing to motion.
- `optimal_control`, `sigma_lognormal`: the two motor engines (plan → t, xy).  An engine is added
  as a module with a function `follow`, and to `ENGINES`.
- `tracker`, `banded`, `covariance`: the linear-quadratic tracker of Gaussian targets that optimal control is.
- `sigma_lognormal_model`: pulses of lognormal speed along arcs, with their derivatives.
- `timing`: speed along paths, time between them.
- `recovery`: the order and direction in which scanned ink was written.
- `reconstruction`: plans of lognormal strokes from recorded traces or bare shapes.
- `pose`: how a pen is held, after a library of recordings.
- `styles`: drawings in other handstyles, and asemic tags.
"""

POSE_METHODS = ("optimal", "average", "closest")  # how a pose is put together of the strokes of a library
ENGINES = ("optimal-control", "sigma-lognormal")  # motor engines, each the name of its module, with hyphens
