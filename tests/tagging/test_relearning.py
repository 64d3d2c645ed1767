"""Corrections teach: what is confirmed stays, what nobody named stays unless the page speaks against it."""

from functools import partial

import numpy as np
import pytest

from handout.hand.corrections import Confirm, Outline, Remove, Unlink
from handout.hand.scanned import NOBODY
from handout.tagging import relearning, segmentation
from handout.tagging.alignment import DOUBTFUL
from handout.tagging.relearning import correct, realign_page
from handout.tagging.segmentation import Adaptation, by_segments
from tests.hand.test_corrections import at, box, word


@pytest.fixture
def quick(monkeypatch):
    """Aligned without learning from the page, which takes most of the time."""
    monkeypatch.setattr(relearning, "by_segments", partial(by_segments, adapting=False))


def test_what_was_not_corrected_stays(small_hand, quick):
    again = realign_page(small_hand, 0, rng=np.random.default_rng(0))
    assert [g.letter for g in again.glyphs] == [g.letter for g in small_hand.glyphs]
    for one, two in zip(small_hand.glyphs, again.glyphs, strict=True):
        assert np.array_equal(one.vertices, two.vertices) and (one.before, one.after) == (two.before, two.after)
    assert relearning.changes(small_hand, again) == ()


def test_a_confirmed_letter_mends_its_neighbour(small_hand, quick):
    """Half of a v was given to the e before it: outlining the e gives the v its ink back, and that is said."""
    e, v, _ = word(small_hand, "eve")
    whole = small_hand.pages[0].graph.uv[small_hand.glyphs[e].vertices]
    outline = Outline(page=0, within=box(small_hand, [v]), text="v")
    taken = correct(small_hand, Outline(page=0, within=box(small_hand, [e, v]), text="e"), learning=False)
    (lost,) = (change for change in taken.changes if change.how == "lost")
    assert (lost.letter, lost.word, lost.line) == ("v", "even", 0)
    mended = correct(taken.hand, outline)
    (number,) = (i for i, g in enumerate(mended.hand.glyphs) if g.at == small_hand.glyphs[v].at)
    glyph = mended.hand.glyphs[number]
    assert glyph.letter == "v" and glyph.confirmed and glyph.confidence > DOUBTFUL
    before = mended.hand.glyphs[glyph.before]
    assert before.letter == "e" and before.after == number
    own = mended.hand.pages[0].graph.uv[before.vertices]
    assert abs(own[:, 0].max() - whole[:, 0].max()) < 0.35 * np.ptp(whole[:, 0])


def test_what_is_no_letter_is_given_to_none(small_hand, quick):
    v = word(small_hand, "even")[1]
    gone = correct(small_hand, [Remove(page=0, at=at(small_hand, v)), Unlink(page=0, at=at(small_hand, v + 1))])
    owner = np.full(len(gone.hand.pages[0].graph), NOBODY)
    for number, glyph in enumerate(gone.hand.glyphs):
        owner[glyph.vertices] = number
    assert (owner[gone.hand.pages[0].dismissed] == NOBODY).all()
    second = next(g for g in gone.hand.glyphs if g.at == small_hand.glyphs[v + 1].at)
    assert not second.ligatures, "what was cut stays cut"


@pytest.mark.slow
def test_a_page_is_learned_from(small_hand, monkeypatch):
    little = Adaptation(copies=1, rehearsed=2, epochs=1)
    monkeypatch.setattr(segmentation, "_ADAPTATION", little)
    made = [Confirm(page=0, at=at(small_hand, number)) for number in (0, 12, 30)]
    one, two = (correct(small_hand, made) for _ in range(2))
    assert one.changes == two.changes and len(one.changes) <= 2
    assert [g.vertices.tolist() for g in one.hand.glyphs] == [g.vertices.tolist() for g in two.hand.glyphs]
    assert sum(g.confirmed for g in one.hand.glyphs) == 3
