"""Strokes that are kept with a hand are those that were found."""

import numpy as np

from handout.hand.learnt import known_values, remember
from handout.motion.recovery.kept_strokes import part_by_glyph, strokes_as_numbers, strokes_of_numbers
from handout.motion.recovery.letter_line import LetterStrokes
from handout.motion.recovery.stroke_order import VERSION, StrokeOrderModel, learn_strokes, stroke_order_model

HANDS = ("house-quick",)
RING = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [2, 4], [4, 5]])  # a ring with a tail; 6 is a dot


def same(one, other):
    alike = len(one.strokes) == len(other.strokes) and all(map(np.array_equal, one.strokes, other.strokes))
    alike = alike and one.guessed == other.guessed
    return alike and one.delayed == other.delayed and (one.bars or one.delayed) == (other.bars or other.delayed)


def test_strokes_come_back_as_they_were():
    ways = ([5, 4, 2, 1, 0, 3, 2], [6], [0, 1, 2, 3, 0, 1], [5, 4, 2, 3], [3, 5])
    told = tuple(k == 1 for k in range(len(ways)))
    for guessed in (False, True):
        written = LetterStrokes(tuple(map(np.array, ways)), told, told[::-1], guessed)
        numbers = strokes_as_numbers(written, RING)
        assert same(strokes_of_numbers(numbers, RING, 7), written)
    assert strokes_of_numbers(numbers, RING, 6) is None  # of another line


def test_those_of_a_hand_are_kept_in_one_row_and_found_there(small_hand, tmp_path):
    found = stroke_order_model(small_hand, HANDS)
    row = learn_strokes(small_hand, HANDS)
    assert list(known_values(small_hand)).count(f"strokes by house-quick {VERSION}") == 1
    kept = part_by_glyph(row, len(small_hand.glyphs))
    assert kept.keys() == set(range(len(small_hand.glyphs)))
    from handout.hand import file

    file.save(small_hand, tmp_path / "small.hand")
    again = file.load(tmp_path / "small.hand")
    remember(again, {f"strokes by house-quick {VERSION}": row})
    model = StrokeOrderModel(again, HANDS)
    assert all(same(model.strokes_of(n)[0], found.strokes_of(n)[0]) for n in kept)
    assert not model._lines  # nothing was searched for


def test_a_row_that_is_no_hands_is_left_alone():
    row = np.array([1, 0, 3, 1, 4, 0, 0], dtype=float)
    assert part_by_glyph(row, 2) == {0: [1, 0, 3, 1, 4, 0], 1: [0]}
    for wrong, glyphs in (
        (row[:-2], 2),
        (row, 1),
        (np.array([9.0, 1e12, -4.0]), 1),
        (np.array([1e15, 0.0, 3.0, 1e15]), 1),
        (np.array([-1e9]), 0),
    ):
        assert part_by_glyph(wrong, glyphs) == {}
