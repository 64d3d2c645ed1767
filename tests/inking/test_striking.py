"""What strikes words out in a scanned hand: ink of the author's own."""

from itertools import pairwise

import numpy as np
import pytest

from handout.errors import InputError
from handout.inking.pen_replacement import add_strokes, ink_drawing
from handout.page_sizes import page
from handout.values import Glyph, Line, Manuscript, Placed
from handout.writing.compose import compose
from handout.writing.layout import Layout


@pytest.mark.slow
def test_words_are_struck_in_the_authors_ink(small_hand):
    layout = Layout(page("120x40mm"), (5.0, 5.0, 5.0, 5.0), x_height=small_hand.x_height)
    (sheet,) = compose("ten even hens jumped of", small_hand, layout, np.random.default_rng(2), slips=100.0, pages=1)
    marks = [p for line in sheet.lines for p in line.placed if p.strokes]
    assert len(marks) == len(sheet.about["slips"]) > 1 and all(p.ink is None for p in marks)
    drawing = ink_drawing(sheet, small_hand)
    rgba = drawing.ink(200.0).rgba / 255
    same = ink_drawing(sheet, small_hand).ink(200.0).rgba / 255
    assert (rgba == same).all()
    xy = np.concatenate([np.linspace(a, b, 9) for p in marks for s in p.strokes for a, b in pairwise(s)])
    column, row = np.rint(xy / 25.4 * 200 - 0.5).astype(int).T
    near = np.max([rgba[row + dy, column + dx, 3] for dy in (-2, 0, 2) for dx in (-2, 0, 2)], axis=0)
    assert np.mean(near > 0.4) > 0.9
    letters = Manuscript(
        tuple(Line(x.text, tuple(p for p in x.placed if not p.strokes), x.baseline) for x in sheet.lines),
        sheet.page, sheet.x_height,
    )  # fmt: skip
    bare = ink_drawing(letters, small_hand).ink(200.0).rgba / 255
    added = (rgba[..., 3] > 0.5) & (bare[..., 3] < 0.05)
    struck = sum(np.linalg.norm(np.diff(s, axis=0), axis=1).sum() for p in marks for s in p.strokes) / 25.4 * 200
    assert added.sum() > 0.4 * struck  # the rest lies over letters
    # of the colour of the letters, within what one pen does
    assert np.abs(np.median(rgba[added], axis=0) - np.median(bare[bare[..., 3] > 0.5], axis=0))[:3].max() < 0.1
    box = drawing.bounds
    assert box[0] <= xy[:, 0].min() and box[2] >= xy[:, 0].max()


def test_a_page_without_strokes_stays_as_it_is(small_hand):
    (sheet,) = compose("hens", small_hand, Layout(page("A6"), x_height=2.5), np.random.default_rng(2))
    assert add_strokes(sheet, sheet, small_hand) is sheet


def test_a_page_with_too_little_clear_line_says_so(small_hand):
    from dataclasses import replace

    bare = replace(small_hand.pages[0], graph=small_hand.pages[0].graph.take(small_hand.glyphs[0].vertices[:9]))
    hand = replace(small_hand, pages=(bare,), glyphs=())
    mark = Placed(Glyph("", (), (True,), 0.0), (np.array([[5.0, 5.0], [9.0, 5.0], [12.0, 5.2]]),), False, 0, 0)
    sheet = Manuscript((Line("", (mark,), 10.0),), page("A6"), 2.5)
    with pytest.raises(InputError, match="too few clear pieces"):
        add_strokes(sheet, sheet, hand)
