"""Handstyles: drawings restyled, and asemic tags.

- `style`: a style's TOML file read into validated structs; a style is added as a file in the folder `styles/`.
- `targets`: the targets of a line that is only drawn, and the height of its letters.
- `broken_script`: curves broken into straight strokes, as the broken scripts have them.
- `movement`: how a style moves through targets, the width of its mark, and what a pen recorded.
- `restyling`: a drawing in a style; `asemic`: tags of glyphs of no alphabet.
"""
