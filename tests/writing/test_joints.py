"""Ligatures between glyphs: those of the author, and new ones only where he would have made one."""

import numpy as np
import pytest

from handout.writing.joining import matches
from handout.writing.joints import Joints


@pytest.fixture(scope="module")
def joints(small_manner):
    return Joints(small_manner.forms)


def word_ends(hand):
    """Glyphs of small letters that end a word, and no ligature leaves."""
    return [n for n, glyph in enumerate(hand.glyphs) if glyph.letter.islower() and glyph.after < 0]


def habits(joints, share):
    """Joints of the same forms, of an author who joins so many of his letters."""
    other = Joints(joints._forms)
    other.__dict__["_shares"] = {}, {"": share}, {"": share}
    return other


def test_what_the_author_joined_is_joined_as_he_did(joints, small_manner):
    forms = small_manner.forms
    first, second = next(
        (a, b) for a, b in small_manner.neighbours.pairs(parted=False).tolist() if matches(forms[a], forms[b])
    )
    pairs = joints.joints_between(first, second)
    assert [forms[first].exits.index(out) for out, _ in pairs] == [i for i, _ in matches(forms[first], forms[second])]


def test_neighbours_of_the_source_that_are_apart_stay_apart(joints, small_manner):
    forms = small_manner.forms
    apart = [(a, b) for a, b in small_manner.neighbours.pairs(parted=False).tolist() if not matches(forms[a], forms[b])]
    assert apart and all(joints.joints_between(a, b) == () for a, b in apart)


def test_a_letter_that_ended_a_word_is_joined_inside_another(joints, small_hand, small_manner):
    forms = small_manner.forms
    entered = next(n for n, glyph in enumerate(small_hand.glyphs) if glyph.letter == "n" and forms[n].entries)
    joining = habits(joints, 1.0)
    made = [(n, joining.joints_between(n, entered)) for n in word_ends(small_hand)]
    made = [(n, pairs) for n, pairs in made if pairs]
    assert made
    for number, ((out, into),) in made:
        body = forms[number]
        assert into in forms[entered].entries
        assert np.allclose(out.xy[0], body.xy[out.anchor], atol=1e-9)
        low, high = body.uv.min(axis=0), body.uv.max(axis=0)
        assert ((low <= out.uv) & (out.uv <= high)).all()  # inked with the glyph's own ink, beside nobody else's
        assert out.xy[-1, 0] > out.xy[0, 0]


def test_a_hand_that_lifts_the_pen_is_not_joined(joints, small_hand, small_manner):
    entered = next(
        n for n, glyph in enumerate(small_hand.glyphs) if glyph.letter == "n" and small_manner.forms[n].entries
    )
    lifting = habits(joints, 0.0)
    assert all(lifting.joints_between(n, entered) == () for n in word_ends(small_hand))


def test_signs_and_capitals_are_not_led_to(joints, small_hand):
    others = [n for n, glyph in enumerate(small_hand.glyphs) if not glyph.letter.islower()]
    ends = word_ends(small_hand)
    assert others and all(habits(joints, 1.0).joints_between(ends[0], n) == () for n in others)
