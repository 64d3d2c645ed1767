"""How a word is struck out: a line or two, to and fro without lifting, or a wave.

Lengths are in x-heights; the word's baseline is y = 0, y up.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handout.values import Array

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


class Striking:
    """Strikes out the words of one text, mostly in one way, which is the writer's.

    Parameters
    ----------
    rng : numpy.random.Generator
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._ways: tuple[Callable[[float, float], list[Array]], ...] = (
            self._line,
            self._lines,
            self._to_and_fro,
            self._wave,
        )
        self._usual = self._ways[self._any()]

    def strokes(self, left: float, right: float) -> list[Array]:
        """Points (n, 2) of the strokes through a word whose ink goes from `left` to `right`, in order."""
        way = self._usual if self._rng.random() < _HABIT else self._ways[self._any()]
        return way(left, right)

    def _any(self) -> int:
        return int(self._rng.choice(4, p=[0.4, 0.25, 0.2, 0.15]))

    def _line(self, left: float, right: float, height: float = _MIDDLE) -> list[Array]:
        a, b = self._ends(left, right)
        x = np.linspace(a, b, max(3, round((b - a) / _STEP) + 1))
        u = (x - a) / (b - a)
        bow = self._rng.normal(0.0, _BOW) * 4 * u * (1 - u)
        trembling = self._rng.normal(0.0, 0.012, len(x))
        return [np.column_stack([x, self._height(height) + self._slope(a, b) * (x - (a + b) / 2) + bow + trembling])]

    def _lines(self, left: float, right: float) -> list[Array]:
        half = 0.5 * self._rng.uniform(*_APART)
        return [self._line(left, right, _MIDDLE + side * half)[0] for side in (1, -1)]

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
