"""Sixty formulas as sheets of schools and universities have them, in each drawn hand: none is lost, nothing touches."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from handout.hand.library import load
from handout.page_sizes import margins, page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout.writing.text import normalise, written_units

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = page("a4")
NEAR = 0.05  # x-heights: a pen's line is wider


def sheet(name):
    return (EXAMPLES / f"{name}.txt").read_text(encoding="utf-8")


def along(strokes):
    """Places along strokes, close to each other."""
    ways = []
    for stroke in strokes:
        at = np.linspace(0, len(stroke) - 1, 6 * len(stroke))
        ways.append(np.column_stack([np.interp(at, np.arange(len(stroke)), axis) for axis in stroke.T]))
    return np.vstack(ways)


def touching(line, x_height):
    """Pairs of glyphs of a line that touch though the pen does not go on from one to the other."""
    glyphs = [(each, along(each.strokes)) for each in line.placed]
    for i, (left, ink) in enumerate(glyphs):
        for j, (right, other) in enumerate(glyphs[i + 1 :], i + 1):
            apart = (ink.min(axis=0) > other.max(axis=0) + 1).any() or (other.min(axis=0) > ink.max(axis=0) + 1).any()
            joined = j == i + 1 and right.joined
            if not (apart or joined) and cdist(ink, other).min() < NEAR * x_height:
                yield left.glyph.letter, right.glyph.letter


def test_there_are_sixty():
    names = ("algebra", "calculus", "physics")
    assert (
        sum(len([line for line in sheet(name).splitlines() if "$" in line and not line[0].isalpha()]) for name in names)
        == 60
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["algebra", "calculus", "physics"])
@pytest.mark.parametrize("hand", ["house-print", "house-joined", "house-quick"])
def test_every_sign_is_written_and_none_touches_another(hand, name):
    layout = Layout(page=PAPER, margin=margins("15mm", PAPER), x_height=2.0, jitter=1.0)
    pages = compose(sheet(name), load(hand), layout, np.random.default_rng(3))
    lines = [line for each in pages for line in each.lines]
    written = {placed.at for line in lines for placed in line.placed if placed.glyph.letter}
    units = written_units(normalise(sheet(name)))[0]
    assert written == {at for at, unit in enumerate(units) if unit and not unit.isspace()}
    pairs = [pair for line in lines for pair in touching(line, 2.0)]
    # letters of one word may meet, and a bar through a letter does; a formula's signs do not
    assert len(pairs) <= 1, pairs
