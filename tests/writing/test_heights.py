"""Heights of letters: one banded solve, the source's own heights, and no line that wanders off."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.writing.forms import is_mark
from handout.writing.joining import matches, rises
from handout.writing.spacing import LEAST, smoothed
from handout.writing.variation import Chances
from tests.writing.lines_of_glyphs import heights


def dense(height, rise, deviation, hold):
    """The same by least squares over all terms."""
    n = len(height)
    rows = [np.eye(n)[k] / hold for k in range(n)]
    wanted = [h / hold for h in height]
    for k in range(n - 1):
        rows.append((np.eye(n)[k + 1] - np.eye(n)[k]) / deviation[k])
        wanted.append(rise[k] / deviation[k])
    return np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0]


@pytest.mark.slow
@given(st.integers(2, 40), st.integers(0, 2**31), st.sampled_from([0.05, 0.3, 1.0]))
def test_the_banded_solve_is_the_dense_one(count, seed, hold):
    rng = np.random.default_rng(seed)
    height, rise = rng.normal(0.2, 0.1, count), rng.normal(0, 0.05, count - 1)
    deviation = rng.uniform(LEAST, 0.1, count - 1)
    assert np.allclose(smoothed(height, rise, deviation, hold), dense(height, rise, deviation, hold), atol=1e-9)


def test_where_all_agree_nothing_moves():
    height = np.random.default_rng(2).normal(0.2, 0.1, 50)
    assert np.array_equal(smoothed(height, np.diff(height), np.full(49, LEAST)), height)


def test_the_source_stands_at_its_own_heights(small_manner, small_lines):
    for line in small_lines:
        found = heights(small_manner, line.numbers, line.new_word, np.random.default_rng(0), variation=0)
        assert np.allclose(found, line.centre[:, 1], atol=1e-12)
        # neighbours of the source have no doubt between them, so that they stand so whatever is drawn
        again = heights(small_manner, line.numbers, line.new_word, np.random.default_rng(0), variation=1)
        assert np.allclose(again, line.centre[:, 1], atol=1e-12)


def test_ligatures_of_the_source_tell_its_own_rise_without_a_doubt(small_manner):
    forms, centre, tried = small_manner.forms, small_manner.forms.centre, 0
    for a, b in small_manner.neighbours.pairs(parted=False).tolist():
        pairs = matches(forms[a], forms[b])
        if pairs:
            assert rises(forms[a], forms[b], pairs) == pytest.approx(centre[b, 1] - centre[a, 1], abs=1e-12)
            tried += 1
    assert tried > 5


def test_a_second_letter_that_joins_lower_is_lifted(small_manner):
    """The sign: an entry that lies deeper under its centre puts the centre higher."""
    forms = small_manner.forms
    a, b = next((a, b) for a, b in small_manner.neighbours.pairs(parted=False).tolist() if matches(forms[a], forms[b]))
    deeper = replace(
        forms[b], entries=tuple(replace(way, xy=way.xy - np.array([0.0, 0.1])) for way in forms[b].entries)
    )
    pairs = matches(forms[a], forms[b])
    assert rises(forms[a], deeper, pairs) == pytest.approx(rises(forms[a], forms[b], pairs) + 0.1)


def test_marks_stand_at_their_own_height(small_manner):
    flow, letters = small_manner.heights, [glyph.letter for glyph in small_manner.forms.hand.glyphs]
    assert [letter for letter, mark in zip(letters, flow.marks, strict=True) if mark] == [","]
    comma = letters.index(",")
    others = np.delete(np.arange(len(letters)), comma)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        numbers = rng.choice(others, 12, replace=False)
        with_mark = np.insert(numbers, 6, comma)
        new_word = np.arange(13) == 7
        found = heights(small_manner, with_mark, new_word, np.random.default_rng(seed))
        assert found[6] == flow.height[comma]
        # the letters beside it flow as if it were not there
        without = heights(
            small_manner, numbers, new_word[1:][np.arange(12)] | (np.arange(12) == 6), np.random.default_rng(seed)
        )
        assert np.allclose(np.delete(found, 6), without, atol=0.2)


@pytest.mark.parametrize(("letter", "mark"), [("a", False), ("7", False), (",", True), ("€", True), ("", False)])
def test_marks_are_not_letters_nor_digits(letter, mark):
    assert is_mark(letter) is mark


def test_lines_wander_no_further_than_the_author_s(small_manner, jumbles):
    """What is left of the heights when the letters' own are taken away; with the paper's weight it is far more."""
    flow = small_manner.heights
    source = np.std((flow.height - flow.predicted)[~flow.marks])

    def wander(used):
        left = []
        for seed in range(6):
            rng = np.random.default_rng(seed)
            numbers = rng.choice(np.flatnonzero(~flow.marks), 60)
            y = used.heights_of(numbers, np.arange(60) % 5 == 0, Chances.draw(rng, 60), 1.0)
            left.append(y - used.predicted[numbers])
        return np.std(left)

    assert wander(flow) < 1.6 * source
    assert wander(replace(flow, hold=1.0)) > 1.3 * wander(flow)


def test_shapes_tell_heights(small_manner):
    flow = small_manner.heights
    letters = ~flow.marks
    miss = np.sqrt(np.mean((flow.height - flow.predicted)[letters] ** 2))
    assert miss < 0.95 * np.std(flow.height[letters])
    assert (flow.deviation >= LEAST).all() and flow.ligature_deviation >= LEAST


def test_what_a_glyph_has_itself_is_left_out(small_manner):
    """One glyph a tenth higher is predicted to be where it was."""
    from handout.writing.spacing import _predicted_heights

    flow = small_manner.heights
    moved = copy(flow.forms)
    moved.centre = flow.forms.centre.copy()
    moved.centre[4, 1] += 0.1
    assert _predicted_heights(moved)[4] == pytest.approx(flow.predicted[4], abs=1e-3)
