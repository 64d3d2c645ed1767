"""How the pen went: from the line that it left to paths in the order of writing.

`network` makes branches between knots of a line graph, `walks` finds ways over all of them that cost a hand the least,
`models` and `likeness` compare those with how a letter is usually written, `letters` does that for the glyphs of a
scanned hand, `author` with how the same letter is written elsewhere in it, and `pages` joins them along the ligatures
of a written page.
"""
