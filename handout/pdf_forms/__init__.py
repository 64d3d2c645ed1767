"""PDF forms that are filled in by hand: their fields, the answers, where these are written, and the pages with them.

- `fields`: what a form asks for, and where on its pages.
- `answers`: which column of a table answers which field, and what of it cannot be written.
- `entries`: an answer in its field: its size, its line among those that are printed there, its cells, its cross.
- `filled`: the form's own pages with the writing on top.
"""
