"""Reads words that stand on paper or come from a pen, to doubt them: what a stranger would take them for.

Nothing here knows which words a language has: what is written is read letter by letter, right or wrong.

- `pictures`: words as pictures, in the frame of `word_space`; the network ships in `networks/`
- `pen_paths`: words as paths of a pen, of the `path_features` of its points
- `ctc`: texts from the posteriors of columns or points
"""
