"""The decoder finds what trying everything finds, and does with lines what it says."""

from itertools import combinations_with_replacement

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.alphabet import JUNK, LETTERS, SPACE, THIRDS, state
from handout.tagging.decoder import BAR, TERMS, ColumnReading, decode, in_a_row, read_line
from handout.tagging.line_space import ABOVE, HEIGHT, STEP

STATES = len(LETTERS) * THIRDS
WIDTHS = dict.fromkeys(LETTERS, 8.0)


def noise_reading(rng: np.random.Generator, columns: int) -> ColumnReading:
    each = rng.normal(-2.0, 1.5, (columns, STATES))
    white = rng.normal(-1.0, 1.0, columns)
    summed = [np.concatenate([np.zeros((1, *v.shape[1:])), np.cumsum(v, axis=0)]) for v in (each, white)]
    return ColumnReading(summed[0], summed[1], summed[1], rng.normal(0.0, 0.5, columns + 1))


def segment_score(reading: ColumnReading, kind: str, letter: str, a: int, b: int) -> float:
    """By the definition, column by column; −inf where the segment is not allowed."""
    long, terms = b - a, TERMS
    space, gap = np.diff(reading.space), np.diff(reading.gap)
    if kind == "edge":
        return space[a:b].sum()
    if kind == "gap":
        return 0.0 if long == 0 else gap[a:b].sum() - terms.gap if long >= 2 else -np.inf
    if kind == "space":
        tight = 0.5 * ((5 - long) / 3) ** 2 if long < 5 else 0.0
        return space[a:b].sum() - tight if long >= 2 else -np.inf
    each = np.diff(reading.letters, axis=0)
    if kind == "junk":
        return each[a:b, state(JUNK)].sum() if long >= 4 else -np.inf
    if long == 0:
        return -(terms.missing if letter.isalnum() else terms.silent)
    usual = WIDTHS[letter] / STEP
    if not 2 <= long <= min(int(2.6 * usual) + 6, reading.columns):
        return -np.inf
    first, second = a + round(long / 3), a + round(2 * long / 3)
    thirds = [each[s:e, state(letter, k)].sum() for k, (s, e) in enumerate([(a, first), (first, second), (second, b)])]
    return sum(thirds) - 0.5 * (np.log(long / usual) / terms.sigma) ** 2


def best_by_trying(reading: ColumnReading, letters: str) -> float:
    kinds: list[tuple[str, str]] = [("edge", "")]
    for i, letter in enumerate(letters):
        if i and SPACE not in (letter, letters[i - 1]):
            kinds.append(("gap", ""))
        kinds.append(({SPACE: "space", JUNK: "junk"}.get(letter, "letter"), letter))
    kinds.append(("edge", ""))
    best = -np.inf
    for cuts in combinations_with_replacement(range(reading.columns + 1), len(kinds) - 1):
        ends = (0, *cuts, reading.columns)
        total = 0.0
        for (kind, letter), a, b in zip(kinds, ends[:-1], ends[1:], strict=True):
            total += segment_score(reading, kind, letter, a, b)
        total += sum(reading.border[ends[k + 1]] for k, (kind, _) in enumerate(kinds[:-1]) if kind != "gap")
        best = max(best, total)
    return best


@pytest.mark.slow
@pytest.mark.parametrize("letters", ["a", "ab", "a b", "a.", "a" + JUNK])
@pytest.mark.parametrize("seed", range(4))
def test_it_equals_brute_force(letters, seed):
    reading = noise_reading(np.random.default_rng(seed), 11)
    assert decode(reading, list(letters), WIDTHS).score == pytest.approx(best_by_trying(reading, letters))


@given(st.integers(0, 10_000), st.text(st.sampled_from("abnm ,"), min_size=1, max_size=7))
@settings(max_examples=40, deadline=None)
def test_letters_follow_each_other(seed, text):
    letters = list(" ".join(text.split()) or "a")
    reading = noise_reading(np.random.default_rng(seed), 60)
    found = decode(reading, letters, WIDTHS)
    assert len(found.left) == len(letters)
    assert (found.left[1:] >= found.right[:-1]).all()
    assert (found.right >= found.left).all() and found.left[0] >= 0 and found.right[-1] <= 60 * STEP
    assert np.isfinite(found.score) and found.score > -1e6


def posterior(columns: list[str]) -> np.ndarray:
    """(n, states) of columns that are beyond doubt: letters by name, thirds as in "a0"."""
    log = np.full((len(columns), STATES), np.log(1e-4))
    for row, name in enumerate(columns):
        log[row, state(name[0], int(name[1]) if len(name) > 1 else 1)] = np.log(0.97)
    return log.astype(np.float32)


def picture(columns: list[str]) -> np.ndarray:
    image = np.zeros((HEIGHT, len(columns) * STEP), np.uint8)
    for row, name in enumerate(columns):
        if name != SPACE:
            image[ABOVE - 3 : ABOVE, row * STEP : (row + 1) * STEP] = 255
    return image


def word(text: str, size: int = 4) -> list[str]:
    return [f"{letter}{third}" for letter in text for third in range(3) for _ in range(size)]


def reading_of(columns: list[str]) -> ColumnReading:
    return read_line(picture(columns), posterior(columns), np.zeros(STATES, np.float32))


SURE = dict.fromkeys(LETTERS, 24.0)


def test_a_clear_line_is_cut_where_its_letters_meet():
    columns = [SPACE] * 9 + word("on") + [SPACE] * 11 + word("it") + [SPACE] * 4
    found = decode(reading_of(columns), list("on it"), SURE)
    assert found.left.tolist() == [18, 42, 66, 88, 112]
    assert found.right.tolist() == [42, 66, 88, 112, 136]
    assert found.found.all()


def test_a_comma_set_off_by_a_gap_is_found():
    columns = [SPACE] * 5 + word("o") + [SPACE] * 6 + word(",", 2) + [SPACE] * 5
    found = decode(reading_of(columns), list("o,"), SURE | {",": 12.0})
    assert found.left[1] == pytest.approx(2 * 23, abs=2)


def test_a_mark_that_the_page_has_not_gets_no_room():
    columns = [SPACE] * 5 + word("on") + [SPACE] * 5
    found = decode(reading_of(columns), list("on."), SURE)
    assert found.found.tolist() == [True, True, False]
    assert found.right[1] == 2 * (5 + 24)


def test_what_was_struck_out_takes_any_width():
    for size in (3, 20):
        columns = [SPACE] * 5 + word("o") + [SPACE] * 6 + [JUNK] * 3 * size + [SPACE] * 6 + word("n") + [SPACE] * 5
        found = decode(reading_of(columns), ["o", SPACE, JUNK, SPACE, "n"], SURE)
        assert found.left[2] == 2 * 23 and found.right[2] == 2 * (23 + 3 * size)


def test_lines_in_a_row_break_only_between_words_if_they_can():
    first = [SPACE] * 6 + word("on") + [SPACE] * 6
    second = [SPACE] * 3 + word("it") + [SPACE] * 8 + word("is") + [SPACE] * 6
    row = in_a_row([reading_of(first), reading_of(second)])
    found = decode(row, list("on it is"), SURE)
    assert row.lines == (0, len(first) + BAR)
    starts = found.left / STEP - row.lines[1]
    assert starts[3] == 3 and found.right[1] / STEP == 30


def test_a_word_may_be_broken_where_there_is_no_other_way():
    first, second = [SPACE] * 6 + word("on"), word("it") + [SPACE] * 6
    row = in_a_row([reading_of(first), reading_of(second)])
    found = decode(row, list("onit"), SURE)
    assert found.right[1] / STEP == len(first) and found.left[2] / STEP == row.lines[1]
    assert found.score < decode(row, list("on it"), SURE).score


def test_costs_are_as_documented():
    assert TERMS.silent < TERMS.missing
