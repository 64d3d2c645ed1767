"""Slips of the pen: now and then a word is begun wrongly, which is noticed, struck out and put right.

What goes wrong is what goes wrong in copying and composing: two letters change places, one is left out or comes too
soon, the word before is written once more, the word after is begun in place of this one.  A word is struck out with a
line or two, to and fro without lifting, or with a wave; lengths there are in x-heights, the baseline is y = 0, y up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from handout.errors import InputError
from handout.values import Array
from handout.writing.text import FormulaLetters, Letter, Piece, spelt

USUAL = 2.0  # slips in 100 words, where no number is asked for; careful copies of a page have one in 300
_GOES_ON = 0.45  # that a wrong letter is followed by one more before it is noticed
_OFTEN = (0.26, 0.28, 0.2, 0.1, 0.16)  # letters swapped, left out, too soon; the word before again, the next too soon
_LEAST = 2  # letters: less is put right within the letter
_MOST_REPEATED = 6  # letters: a longer word is not written twice unawares

_Word = Sequence[Letter]


class StruckLetters(tuple[Letter, ...]):
    """Letters that are struck out again; `intended` is the word that follows in their place."""

    intended: str

    def __new__(cls, letters: _Word, intended: str) -> StruckLetters:
        """Of what is written before it is noticed, and what was to be written."""
        struck = super().__new__(cls, letters)
        struck.intended = intended
        return struck


def check_rate(rate: float) -> float:
    """The rate as it is.

    Raises InputError: outside 0 to 100 in 100 words.
    """
    if not 0 <= rate <= 100:
        raise InputError(f"slips: {rate:g} in 100 words is outside 0 to 100.")
    return rate


def slip(paragraphs: Iterable[Sequence[Piece]], rate: float, rng: np.random.Generator) -> Iterator[list[Piece]]:
    """A text with slips, paragraph after paragraph: before some words a `StruckLetters` one and a space.

    paragraphs : as `text.paragraphs_of` gives them.
    rate : slips in 100 words, 0 to 100.  Words of one letter, in capitals only, with a digit or anything else within
        them that is no letter, and parts of words with a hyphen, are never wrong.
    rng : of the slips only.

    Raises InputError: a rate out of its bounds.
    """
    share = check_rate(rate) / 100
    return (list(_make_slips(pieces, share, rng)) for pieces in paragraphs)


def _make_slips(pieces: Sequence[Piece], share: float, rng: np.random.Generator) -> Iterator[Piece]:
    for number, piece in enumerate(pieces):
        if not isinstance(piece, int) and rng.random() < share:
            wrong = _wrong(pieces, number, rng)
            if wrong:
                yield StruckLetters(wrong, _spelt(piece))
                yield 1
        yield piece


def _wrong(pieces: Sequence[Piece], number: int, rng: np.random.Generator) -> list[Letter]:
    """What is written in place of a word before it is noticed; nothing where it cannot go wrong."""
    word = _core(pieces, number)
    if not word:
        return []
    ways: list[Callable[[], list[Letter]]] = [
        lambda: _swap_letters(word, rng),
        lambda: _left_out(word, rng),
        lambda: _too_soon(word, rng),
        lambda: _instead(word, _core(pieces, number - 2), _MOST_REPEATED),
        lambda: _notice_slip(word, _core(pieces, number + 2), _LEAST - 1, rng),
    ]
    for way in rng.permutation(len(ways)):
        wrong = ways[int(way)]()
        if len(wrong) >= _LEAST:
            return wrong
    return []


def _core(pieces: Sequence[Piece], number: int) -> list[Letter]:
    """A word without the marks before and after it; empty if it may not go wrong."""
    if not 0 <= number < len(pieces):
        return []
    piece = pieces[number]
    beside = [pieces[i] for i in (number - 1, number + 1) if 0 <= i < len(pieces)]
    if isinstance(piece, int | FormulaLetters) or not all(isinstance(other, int) for other in beside):
        return []
    alpha = [letter.base.isalpha() for letter in piece]
    if not any(alpha) or any(letter.base.isnumeric() for letter in piece):
        return []
    word = list(piece[alpha.index(True) : len(alpha) - alpha[::-1].index(True)])
    lower_case = [letter.base.islower() for letter in word[1:]]
    return word if lower_case and all(lower_case) else []


def _swap_letters(word: _Word, rng: np.random.Generator) -> list[Letter]:
    i = int(rng.integers(_first_movable(word), max(len(word) - 1, 1)))
    return _notice_slip(word, [*word[:i], *word[i + 1 : i + 2], word[i], *word[i + 2 :]], i, rng)


def _left_out(word: _Word, rng: np.random.Generator) -> list[Letter]:
    i = int(rng.integers(1, max(len(word) - 1, 2)))
    return _notice_slip(word, [*word[:i], *word[i + 1 :]], i, rng)


def _too_soon(word: _Word, rng: np.random.Generator) -> list[Letter]:
    """The letter after takes the place of one, too."""
    i = int(rng.integers(_first_movable(word), max(len(word) - 1, 1)))
    return _notice_slip(word, [*word[:i], *word[i + 1 : i + 2], *word[i + 1 :]], i, rng)


def _instead(word: _Word, other: _Word, most: int) -> list[Letter]:
    """Another whole word, unless the word begins with it, as the writer would just finish it."""
    return list(other) if len(other) <= most and not _spelt(word).startswith(_spelt(other)) else []


def _first_movable(word: _Word) -> int:
    """The first letter that may change places: a capital stays."""
    return min(int(not word[0].base.islower()), max(len(word) - 2, 0))


def _notice_slip(word: _Word, wrong: _Word, at: int, rng: np.random.Generator) -> list[Letter]:
    """As much of a wrong word as is written before its letter `at`, or one that differs, is seen to be wrong."""
    written = max(at + 1, _LEAST)
    while written < len(wrong) and (_spelt(wrong[:written]) == _spelt(word[:written]) or rng.random() < _GOES_ON):
        written += 1
    # what is only shorter than the word would be finished, not struck out
    return [] if _spelt(wrong[:written]) == _spelt(word[:written]) else list(wrong[:written])


def _spelt(word: _Word) -> str:
    return "".join(map(spelt, word))


_STEP = 0.9  # from one point of a line to the next: it is drawn in one go, quicker than letters
_MIDDLE, _MIDDLE_SD = 0.5, 0.09  # height at which words are struck
_BEYOND = (-0.05, 0.45)  # how far a line begins before the word and goes on after it
_RISE, _RISE_SD = 0.05, 0.045  # tangent
_MOST_RISE = 0.3  # a long word is not left by its line: from its middle to its end
_APART = (0.26, 0.5)  # between two lines
_SWING, _WAVE = (0.24, 0.38), (0.8, 1.2)  # of a wave: amplitude and length
_WAVED = 2.5  # a wave over less looks like one letter more
_BOW = 0.07
_HABIT = 0.7  # how often a writer does it in the usual way


class StrikeThrough:
    """Strikes out the words of one text, mostly in one way, which is the writer's."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._ways: tuple[Callable[[float, float], list[Array]], ...] = (
            self._line,
            self._lines,
            self._to_and_fro,
            self._wave,
        )
        self._usual = self._ways[self._pick_any()]

    def strokes(self, left: float, right: float) -> list[Array]:
        """Points (n, 2) of the strokes through a word whose ink goes from `left` to `right`, in order."""
        way = self._usual if self._rng.random() < _HABIT else self._ways[self._pick_any()]
        return way(left, right)

    def _pick_any(self) -> int:
        return int(self._rng.choice(4, p=[0.4, 0.25, 0.2, 0.15]))

    def _line(self, left: float, right: float, height: float = _MIDDLE) -> list[Array]:
        a, b = self._ends(left, right)
        x = np.linspace(a, b, max(3, round((b - a) / _STEP) + 1))
        u = (x - a) / (b - a)
        bow = self._rng.normal(0.0, _BOW) * 4 * u * (1 - u)
        trembling = self._rng.normal(0.0, 0.012, len(x))
        return [np.column_stack([x, self._height(height) + self._slope(a, b) * (x - (a + b) / 2) + bow + trembling])]

    def _lines(self, left: float, right: float) -> list[Array]:
        half_gap = 0.5 * self._rng.uniform(*_APART)
        return [self._line(left, right, _MIDDLE + side * half_gap)[0] for side in (1, -1)]

    def _to_and_fro(self, left: float, right: float) -> list[Array]:
        """There, back and there again in one movement, each pass lower than the one before."""
        passes = [self._line(left, right, height)[0] for height in (0.74, 0.4, 0.1)]
        slant = 0.12 * (passes[0][:, 0] - left) / max(right - left, 0.5)
        passes[0][:, 1] += slant
        return [np.concatenate([passes[0], passes[1][::-1][1:], passes[2][1:]])]

    def _wave(self, left: float, right: float) -> list[Array]:
        if right - left < _WAVED:
            return self._lines(left, right)
        a, b = self._ends(left, right)
        quarters = max(4, 2 * round(2 * (b - a) / self._rng.uniform(*_WAVE)))
        x = np.linspace(a, b, quarters + 1)
        swing = self._rng.uniform(*_SWING) * self._rng.normal(1.0, 0.15, len(x))
        y = (
            self._height(_MIDDLE)
            + self._slope(a, b) * (x - (a + b) / 2)
            + swing * np.sin(np.arange(len(x)) * np.pi / 2)
        )
        return [np.column_stack([x + self._rng.normal(0.0, 0.03, len(x)), y])]

    def _ends(self, left: float, right: float) -> tuple[float, float]:
        before, after = self._rng.uniform(*_BEYOND, 2)
        return left - before, max(right + after, left - before + 0.5)

    def _height(self, about: float) -> float:
        return float(self._rng.normal(about, _MIDDLE_SD))

    def _slope(self, a: float, b: float) -> float:
        most = 2 * _MOST_RISE / (b - a)
        return float(np.clip(self._rng.normal(_RISE, _RISE_SD), -most, most))
