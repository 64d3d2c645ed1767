"""Trains the networks and makes the hands that handout ships; nothing that runs imports this room.

- `letter_networks`: the networks of `tagging`, which read letters: ``python -m handout.training.letter_networks``

To reship a network, write it to ``handout/tagging/networks`` (every .npz there is used, and their readings averaged),
run the tests of `tagging` and ``python -m benchmarks.tagging``.
"""
