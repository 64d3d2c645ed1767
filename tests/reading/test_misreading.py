"""How probably a letter is misread: more where it was misread elsewhere, and where a reader sees another."""

from dataclasses import replace

import numpy as np
import pytest

from handout.reading import misreading
from handout_lab.training import misread_words


@pytest.mark.parametrize("readers", [1, 2])
def test_whatever_speaks_against_a_letter_makes_it_less_sure(readers):
    weights = misreading.load(readers)
    assert len(weights.seen) == readers and 0 < weights.again <= weights.told < 1
    low, high = np.array([0.02]), np.array([0.9])
    plain, seen = weights.before(low, low), np.full((readers, 1), 0.02)
    base = weights.misread(plain, seen)
    assert base < 0.02
    assert weights.misread(weights.before(high, low), seen) > base
    assert weights.misread(weights.before(low, high), seen) > base
    assert weights.misread(plain, np.full((readers, 1), 0.9)) > base
    assert weights.misread(weights.before(high, high), np.full((readers, 1), 0.9)) > weights.told


def test_no_share_is_taken_for_never_or_always():
    assert np.isfinite(misreading.odds(np.array([0.0, 1.0]))).all()
    assert misreading.odds(np.array([0.5])) == pytest.approx(0.0)


@pytest.mark.parametrize("readers", [1, 2])
def test_the_weights_are_those_of_the_table(readers):
    fitted, shipped = (
        misread_words.fit(misread_words.read_table(misread_words.TABLE), readers),
        misreading.load(readers),
    )
    for name in ("constant", "glyph", "letter", "seen", "told", "again"):
        assert getattr(fitted, name) == pytest.approx(getattr(shipped, name), abs=0.005), name


def test_letters_that_were_read_as_others_are_found():
    word = misread_words.LabelledWord("x", "under", "uuden", np.zeros((4, 5)))
    assert word.missed().tolist() == [False, True, False, False, True]
    assert replace(word, read="undeer").missed().sum() == 1
    assert not replace(word, read="under").missed().any()
    assert replace(word, read="uder").missed().tolist() == [False, True, False, False, False]


def test_a_row_is_read_as_it_was_written(tmp_path):
    word = misread_words.LabelledWord("x", "at", "ot", np.array([[0.1, 0.25], [0.2, 0.3], [0.001, 0.5], [1.0, 0.0]]))
    (tmp_path / "rows").write_text(word.row() + "\n")
    (again,) = misread_words.read_table(tmp_path / "rows")
    assert again.row() == word.row() and np.array_equal(again.shares, word.shares)
