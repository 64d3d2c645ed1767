"""The baseline of one line: from the middle of its small letters down to their feet, with its own bend.

Source: alignment specification, recipe 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.scanning.strokes import Marks
from handout.values import Array

LEAST = 25  # left edges of a line


@dataclass(frozen=True, eq=False)
class Rule:
    """The baseline of one line, mm on the page, y down.

    curve : (c0, c1, c2): y = c0 + c1 u + c2 u², u = x − middle.
    left, right : x of the first and the last ink of the line.
    """

    curve: tuple[float, float, float]
    left: float
    right: float

    @property
    def middle(self) -> float:
        """x of the middle, mm."""
        return (self.left + self.right) / 2

    def baseline(self, x: Array | float) -> Array:
        """y of the baseline, mm, at x, mm; beyond the ends it runs on straight."""
        u = np.asarray(x, dtype=np.float64) - self.middle
        held = np.clip(u, self.left - self.middle, self.right - self.middle)
        c0, c1, c2 = self.curve
        return np.asarray(c0 + held * (c1 + held * c2) + (u - held) * (c1 + 2 * c2 * held))

    def slope(self, x: Array | float) -> Array:
        """dy/dx of the baseline at x: positive where the line falls."""
        u = np.clip(np.asarray(x, dtype=np.float64), self.left, self.right) - self.middle
        return np.asarray(self.curve[1] + 2 * self.curve[2] * u)


def on_baselines(marks: Marks, traces: list[tuple[float, float]], centre: float, pitch: float) -> list[Rule]:
    """The lines whose middles run along `traces`, (level at x = `centre`, slope), moved down to their feet, mm."""
    u = marks.left[:, 0] - centre
    off = np.abs(np.stack([marks.left[:, 1] - level - slope * u for level, slope in traces]))
    nearest, close = np.argmin(off, axis=0), off.min(axis=0) < 0.25 * pitch
    lines = []
    for i, trace in enumerate(traces):
        x = marks.left[close & (nearest == i), 0]
        if len(x) >= LEAST // 2:
            lines.append(_on_baseline(trace, marks.foot, _together(x, 2.5 * pitch), centre, pitch))
    return sorted(lines, key=lambda line: line.curve[0])


def _on_baseline(trace: tuple[float, float], feet: Array, x: Array, centre: float, pitch: float) -> Rule:
    level, slope = trace
    left, right = float(x[0]), float(x[-1])
    middle = (left + right) / 2
    fall = feet[:, 1] - level - slope * (feet[:, 0] - centre)
    at = (feet[:, 0] > left - 0.5 * pitch) & (feet[:, 0] < right + 0.5 * pitch)
    at &= (fall > -0.1 * pitch) & (fall < 0.55 * pitch)
    foot = mode(fall[at], 0.04 * pitch) if at.any() else 0.2 * pitch
    near = at & (np.abs(fall - foot) < 0.3 * pitch)
    u, y = feet[near, 0] - middle, fall[near] - foot
    long, some = right - left > 8 * pitch and int(near.sum()) > LEAST, right - left > 2.5 * pitch
    c0, c1, c2 = robust(u, y, 2 if long else (1 if some else 0), 0.12 * pitch)
    return Rule((level + foot + slope * (middle - centre) + c0, slope + c1, c2), left, right)


def _together(x: Array, gap: float) -> Array:
    """Sorted, without the few that stand apart: strays from a neighbouring line that a short one would claim."""
    x = np.sort(x)
    groups = np.split(x, np.flatnonzero(np.diff(x) > gap) + 1)
    most = max(len(group) for group in groups)
    return np.concatenate([group for group in groups if len(group) > 0.12 * most])


def robust(u: Array, y: Array, degree: int, scale: float) -> tuple[float, float, float]:
    """Polynomial through the densest part of the points: Tukey's weights, the scale drawn in step by step."""
    curve = np.zeros(3)
    if len(u) <= degree + 2:
        return 0.0, 0.0, 0.0
    unit = max(float(np.abs(u).max()), 1.0)
    powers = np.stack([(u / unit) ** k for k in range(degree + 1)], axis=1)
    for width in (2.0, 1.5, 1.0, 0.8, 0.8, 0.8):
        rest = (y - powers @ curve[: degree + 1]) / (width * scale)
        weight = np.where(np.abs(rest) < 1, (1 - rest**2) ** 2, 0.0)
        if (weight > 0).sum() <= degree + 2:
            break
        root = np.sqrt(weight)[:, None]
        curve[: degree + 1] = np.linalg.lstsq(powers * root, y * root[:, 0], rcond=None)[0]
    return float(curve[0]), float(curve[1] / unit), float(curve[2] / unit**2)


def mode(values: Array, sigma: float) -> float:
    """The densest of the values (n,), by a Gaussian kernel of width `sigma`."""
    grid = np.linspace(values.min(), values.max(), 200)
    held = np.exp(-0.5 * ((grid[:, None] - values) / sigma) ** 2).sum(axis=1)
    return float(grid[int(np.argmax(held))])
