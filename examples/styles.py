"""Six letters in every handstyle that comes with the program, on one sheet: docs/pictures/styles.png.

python examples/styles.py styles.png
"""

import sys
from dataclasses import replace

import numpy as np

import handout
from handout.motion.optimal_control import follow
from handout.motion.styles.restyling import restyle
from handout.motion.styles.style import find
from handout.values import ActionPlan, Drawing, Page, Stroke

STYLES = ("calm", "fast-tag", "blackletter", "chancery", "scrawl")
FORMS = {"A": 0, "G": 0, "S": 1, "m": 0, "o": 3, "R": 0}  # which of its forms in the hand house-print
HEIGHT, CELL, ROW = 20.0, 31.0, 32.0  # mm: of a capital, and from letter to letter


def letter(name, form):
    """The strokes of a form of a built-in hand, as its own movement draws them."""
    hand = handout.load("house-print")
    forms = [glyph for glyph in hand.glyphs[name] if "alone" in glyph.places]
    strokes, clock = [], 0.0
    for points in forms[form].strokes:
        t, xy = follow(ActionPlan(points * [1, -1] * HEIGHT / 2, 0.09, hand.smooth))
        strokes.append(Stroke(clock + t, xy, word=0))
        clock += t[-1] + 0.2
    return Drawing(tuple(strokes), Page(60, 60))


def sheet():
    """A page with a row of letters for every style."""
    strokes, clock = [], 0.0
    for row, name in enumerate(STYLES):
        for column, (character, form) in enumerate(FORMS.items()):
            made = restyle(letter(character, form), find(name), np.random.default_rng(column), height=HEIGHT)
            left, _, right, _ = made.bounds
            corner = np.array([CELL * (column + 0.5) - (left + right) / 2, ROW * (row + 0.8)])
            strokes += [replace(s, t=s.t + clock, xy=s.xy + corner) for s in made.strokes]
            clock += made.duration + 0.5
    return Drawing(tuple(strokes), Page(CELL * len(FORMS), ROW * len(STYLES) + 2))


if __name__ == "__main__":
    handout.write_drawings([sheet()], sys.argv[1:] or ["styles.svg"], handout.Look(dpi=120))
