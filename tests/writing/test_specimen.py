"""The specimen sheet."""

import numpy as np
import pytest

from handout.hand.library import load, names
from handout.writing.specimen import forms, specimen


@pytest.mark.parametrize("name", names())
def test_every_form_of_every_character_is_on_the_sheet(name):
    hand = load(name)
    sheet = specimen(hand, "The quick fox.", np.random.default_rng(1), width=420.0, x_height=7.5)
    shown = [(p.glyph.letter, p.glyph.form) for line in sheet.lines[:-1] for p in line.placed]
    wanted = {(letter, g.form) for letter, glyphs in hand.glyphs.items() for g in glyphs}
    assert set(shown) == wanted and len(shown) == len(wanted)
    assert sheet.lines[-1].text == "The quick fox."
    numbers = [p.word for line in sheet.lines for p in line.placed]
    assert set(numbers) == set(range(len(wanted) + 3)), "files keep a word for each number up to the last"
    ink = np.vstack([s for line in sheet.lines for p in line.placed for s in p.strokes])
    assert ink.min() > 0 and ink[:, 0].max() < sheet.page.width and ink[:, 1].max() < sheet.page.height


def test_the_joined_form_is_shown():
    hand = load("house-joined")
    shown = {glyphs[0].letter: glyphs for glyphs in map(forms, hand.glyphs.values())}
    assert all(glyph.exit != "lifted" for glyph in shown["a"])
