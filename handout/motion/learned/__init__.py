"""The manner of a movement, learned from examples: one is enough.

- `sequences`: movements as virtual targets with their dynamics, and what a network is told of them.
- `recurrent`, `mixture`: long short-term memory, and the mixture of Gaussians that it gives, in numpy.
- `training`: windows of movements, varied each time they are seen; sizes and recipes.
- `dynamics`: Δt and θ of every stroke, predicted from virtual targets.
- `structure`: virtual targets, invented.
- `model`: both with the examples that prime them; how they move through drawings is in `motion.styles`.
"""
