"""Reads words that come from a pen, as paths and not as pictures: a stranger's reading, to measure and train by.

- `pen_paths`: words as paths of a pen, of the `path_features` of its points; the network is in `networks/`
"""
