"""How the pen went: from the line that it left to paths in the order of writing.

`network` makes branches between knots of a line graph, `walks` finds ways over all of them that cost a hand the least (its
`prices`),
`models` and `likeness` compare those with how a letter is usually written, `letters` does that for the glyphs of a
scanned hand, whose long bars `spanning` has found on the line of the whole word, and `author` tells how the same letter
is written elsewhere in it; `ductus` and `guide` know how people write letters.  `pages` joins them along the ligatures
of a written page; `weaving` does where the pen went to and fro between two letters, and `failing` tells where ink has
failed and where the pen was lifted.
"""
