"""Reads words that stand on paper, to doubt them: what a stranger would take them for.

Nothing here knows which words a language has: what is written is read letter by letter, right or wrong.

- `pictures`: words as pictures, in the frame of `word_space`; the network ships in `networks/`
- `ctc`: texts from the posteriors of columns
"""
