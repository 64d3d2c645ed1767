"""Ink that was cut away from a letter comes back to it, as both letters read and look."""

from dataclasses import replace

import numpy as np
import pytest

from handout.hand.boundaries import mend_boundaries


def with_stroke_given_away(hand, second, confirmed=False):
    """The hand where the first strokes of a glyph were given to the one before, and what that were."""
    glyphs = list(hand.glyphs)
    glyph, first = glyphs[second], glyphs[glyphs[second].before]
    uv = hand.pages[glyph.page].graph.uv[glyph.vertices]
    x = uv[:, 0] + 0.2 * uv[:, 1]
    given = glyph.vertices[x < np.quantile(x, 0.4)]
    glyphs[glyph.before] = replace(first, vertices=np.union1d(first.vertices, given), confirmed=confirmed)
    glyphs[second] = replace(glyph, vertices=np.setdiff1d(glyph.vertices, given))
    return replace(hand, glyphs=tuple(glyphs)), given


@pytest.mark.slow
def test_strokes_that_were_given_away_come_back(small_hand):
    joined = [n for n, glyph in enumerate(small_hand.glyphs) if glyph.before >= 0 and glyph.letter.isalpha()]
    joined = [n for n in joined if small_hand.glyphs[small_hand.glyphs[n].before].ligatures]
    back = []
    for second in joined:
        spoilt, given = with_stroke_given_away(small_hand, second)
        mended, _ = mend_boundaries(spoilt)
        back.append(np.isin(given, mended.glyphs[second].vertices).mean())
        inked = [np.concatenate([glyph.vertices for glyph in hand.glyphs]) for hand in (spoilt, mended)]
        assert len(np.unique(inked[1])) == len(inked[1])  # no ink is two letters'
        assert np.isin(inked[1], inked[0]).all()
    assert len(joined) > 20 and np.mean(np.array(back) > 0.3) > 0.7, back
    assert mend_boundaries(small_hand)[1] <= 1  # and next to nothing moves where nothing was given away


def test_what_a_person_confirmed_keeps_its_ink(small_hand):
    spoilt, given = with_stroke_given_away(small_hand, 21, confirmed=True)
    mended, _ = mend_boundaries(spoilt)
    first = spoilt.glyphs[21].before
    assert given.tolist() and np.array_equal(mended.glyphs[first].vertices, spoilt.glyphs[first].vertices)


def test_the_ligatures_of_what_moved_lead_from_letter_to_letter(small_hand):
    spoilt, _ = with_stroke_given_away(small_hand, 21)
    mended, _ = mend_boundaries(spoilt)
    for glyph in mended.glyphs:
        for way in glyph.ligatures:
            both = np.union1d(glyph.vertices, mended.glyphs[glyph.after].vertices)
            assert np.isin(way.path, both).all()
