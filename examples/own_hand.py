"""Reads a hand from a scanned page and its text, and writes a letter in it: what two commands do, in five lines."""

import handout

mine = handout.read("me", ["examples/page.jpg"], ["examples/page.txt"]).hand
writing, sheet = handout.WritingOptions(hand=mine, seed=4), handout.SheetOptions("A6")
letter = handout.write("the jam is finished", ["letter.svg", "letter.png"], writing, sheet)
print("Wrote", *letter.files)
