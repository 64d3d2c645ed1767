"""A person's hand: drawn (`values.Hand`) or read from paper (`scanned.ScannedHand`); stored, corrected, measured.

- `library`: hands by name or path; `house/` holds those that come with the program, as files
- `drawn`: TOML files of points, and haste; `svg_font`: single-line fonts
- `scanned`: the nouns of a hand that was read; `file` its .hand file, an `archive`
- `corrections`: what people correct, and `hand_editor`, which does it; `ligatures`: ways from letter to letter
- `measures`: what a scanned hand measures, one definition each; `letter_classes`: ascenders, descenders and the like
- `places`: graphemes, and where a letter stands in its word; `diacritics`: letters with marks
- `report`: a scanned hand in numbers and pictures

A letter form is added in the TOML file of a hand (docs/drawing-a-hand.md), a mark of a language in `diacritics`.
"""
