"""Makes what ships: trains the networks that read letters and writes the scanned hands.  Nothing that runs imports it.

- `letter_networks`: the networks of `tagging`: ``python -m handout_lab.training.letter_networks -o FILE.npz``
- `word_pictures`, `picture_reader`: the reader of pictures in `reading`; training it needs the extra "train"
- `brushes`: the brushes: ``python -m handout_lab.training.brushes STROKE.png …``
- `scanned_hands`: the scanned hands, written by the simulated author

To reship a network, write it to ``handout/tagging/networks`` (every .npz there is used, and their readings averaged),
then run the tests of `tagging` and ``python -m benchmarks.tagging``.
"""
