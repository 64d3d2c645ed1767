"""What is drawn about words: underlines, bullets, rules, the lines of tables, flourishes.

Strokes are points that the pen passes at even times, in x-heights over a baseline y = 0, y up, as
`writing.slips.StrikeThrough` draws; how far they swing, slope and miss is set by eye.

Source: own method.
"""

from __future__ import annotations

import math

import numpy as np

from handout.letters.document import Underline
from handout.values import Array

_STEP = 0.9  # from one point of a line to the next: drawn in one go, quicker than letters
_FIRST_UNDER, _UNDER_SD = -0.47, 0.06  # of an underline, and how that varies
_APART = (0.2, 0.32)  # between two underlines
_BEYOND = (-0.15, 0.4)  # how far an underline begins before its words, and goes on after them
_SLOPE_SD, _MOST_RISE = 0.02, 0.17  # tangent; x-heights from the middle of a line to its end
_TREMBLE, _BOW = 0.022, 0.075
_WAVE, _SWING = (0.85, 1.25), (0.09, 0.15)  # of a wavy underline: length and amplitude
_LONG_TREMBLE = 0.035  # of lines across a page: no ruler is laid
_RULE_RISE = 0.006  # tangent of a line across a page, standard deviation


class Ornaments:
    """Draws the ornaments of one letter; a writer underlines now a little lower, now a little further.

    jitter : scale of all variation.
    """

    def __init__(self, rng: np.random.Generator, jitter: float) -> None:
        self._rng, self._jitter = rng, min(jitter, 2.0)

    def underline(self, kind: Underline, left: float, right: float) -> list[Array]:
        """Strokes (n, 2) under words whose ink goes from `left` to `right`."""
        y = _FIRST_UNDER + self._draw_offset(_UNDER_SD)
        if kind == "wavy":
            return [self._wave(left, right, y - _SWING[1])]
        first = self._line(left, right, y)
        if kind != "double":
            return [first]
        return [first, self._line(left, right, y - self._rng.uniform(*_APART))]

    def bullet(self, kind: str) -> list[Array]:
        """Strokes of the mark before an item, about x = 0: a dash, a dot or a small ring."""
        height, size = 0.52 + self._draw_offset(0.05), math.exp(self._draw_offset(0.14))
        if kind == "dash":
            half, slope = 0.36 * size, self._draw_offset(0.07)
            x = np.linspace(-half, half, 3)
            return [np.column_stack([x, height + slope * x + self._draw_offset(0.03) * (1 - (x / half) ** 2)])]
        radius, turns = (0.13, 1.9) if kind == "dot" else (0.24, 1.12)
        begin, squash = self._rng.uniform(0.2, 1.4), 1 + self._draw_offset(0.12)
        angle = begin + np.linspace(0, 2 * math.pi * turns, 12 if kind == "dot" else 10)
        # a dot is rubbed in towards its middle, a ring is closed roughly
        shrink = np.linspace(1.0, 0.2 if kind == "dot" else 1 + self._draw_offset(0.08), len(angle))
        ring = size * radius * shrink[:, None] * np.column_stack([np.cos(angle) * squash, np.sin(angle)])
        return [ring + np.array([self._draw_offset(0.06), height])]

    def rule(self, left: float, right: float, kind: str) -> list[Array]:
        """Strokes of a line from `left` to `right`, or of a flourish between them."""
        if kind == "flourish":
            return [self._flourish(left, right)]
        return [self.rule_line(np.array([left, 0.3]), np.array([right, 0.3]))]

    def rule_line(self, start: Array, end: Array) -> Array:
        """A long line between two places (2,), drawn without a ruler: neither quite straight nor quite there."""
        along = end - start
        length = float(np.hypot(*along))
        across = np.array([-along[1], along[0]]) / max(length, 1e-9)
        u = np.linspace(0, 1, max(4, round(length / (2.2 * _STEP)) + 1))
        away = self._draw_offset(_RULE_RISE) * length * (u - 0.5) + self._draw_offset(0.004 * length + 0.04) * 4 * u * (
            1 - u
        )
        away = away + self._smooth(len(u)) * _LONG_TREMBLE
        miss = self._draw_offset(0.18), self._draw_offset(0.18)
        begin, over = start - along / max(length, 1e-9) * miss[0], end + along / max(length, 1e-9) * miss[1]
        return np.asarray(begin + u[:, None] * (over - begin) + away[:, None] * across)

    def _smooth(self, count: int) -> Array:
        """(count,): a wander that turns slowly."""
        noise = self._rng.normal(0.0, self._jitter, count + 4)
        return np.convolve(noise, np.ones(5) / math.sqrt(5), mode="valid")

    def _flourish(self, left: float, right: float) -> Array:
        """Loops that grow towards the middle, and a tail on either side."""
        loops = max(3, round((right - left) / 1.7))
        t = np.linspace(0, loops, 8 * loops + 1)
        u = t / loops
        swell = np.sin(np.pi * u) ** 1.5 * math.exp(self._draw_offset(0.1))
        angle = 2 * math.pi * t
        lean = self._draw_offset(0.1)
        x = left + (right - left) * u - 0.62 * swell * np.sin(angle)
        y = 0.45 + 0.62 * swell * (np.cos(angle) - 0.4) + 0.05 * self._smooth(len(t))
        return np.column_stack([x + lean * y, y])

    def _line(self, left: float, right: float, y: float) -> Array:
        a, b = self._ends(left, right)
        x = np.linspace(a, b, max(3, round((b - a) / _STEP) + 1))
        u = (x - a) / (b - a)
        away = self._draw_offset(_BOW) * 4 * u * (1 - u) + _TREMBLE * self._smooth(len(x))
        return np.column_stack([x, y + self._slope(a, b) * (x - (a + b) / 2) + away])

    def _wave(self, left: float, right: float, y: float) -> Array:
        a, b = self._ends(left, right)
        quarters = max(8, 4 * round((b - a) / self._rng.uniform(*_WAVE)))
        x = np.linspace(a, b, quarters + 1)
        swing = self._rng.uniform(*_SWING) * np.maximum(1 + 0.3 * self._rng.normal(0.0, self._jitter, len(x)), 0.2)
        heights = y + self._slope(a, b) * (x - (a + b) / 2) + swing * np.sin(np.arange(len(x)) * np.pi / 2)
        # quarters are of no even length, and a wave slackens as it goes on
        return np.column_stack([x + 0.14 * (b - a) / quarters * self._rng.normal(0.0, self._jitter, len(x)), heights])

    def _ends(self, left: float, right: float) -> tuple[float, float]:
        before, after = self._rng.uniform(*_BEYOND, 2)
        return left - 0.5 * before, max(right + 0.6 * after, left + 0.5)

    def _slope(self, a: float, b: float) -> float:
        most = 2 * _MOST_RISE / (b - a)
        return float(np.clip(self._draw_offset(_SLOPE_SD), -most, most))

    def _draw_offset(self, deviation: float) -> float:
        return float(self._rng.normal(0.0, deviation * self._jitter))
