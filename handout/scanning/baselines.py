"""The baseline of each line of writing, what it is fitted to (left edges, feet and tops of strokes), and their slant.

Source: own method, after the recipe for line extraction in docs/bibliography.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

LEAST_EDGES = 25  # left edges of a line
_SLANTS = np.arange(-0.5, 1.5001, 0.05)
_USUAL, _UNUSUAL = 0.2, 1.2  # slants of people
_ROWS = 0.1  # mm between rows of left edges: at 600 dpi every row would only cost time
_SLOPED = 4.0  # pitches: shorter lines slope as their neighbours do; two words of 3.3 led theirs into the line above
_UNDERLINE = 12.0  # mm: longer runs of ink are underlines


@dataclass(frozen=True, eq=False)
class LineBaseline:
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


def on_baselines(
    extremes: StrokeExtremes, traces: list[tuple[float, float]], centre: float, pitch: float
) -> list[LineBaseline]:
    """The lines whose middles run along `traces`, (level at x = `centre`, slope), moved down to their feet, mm."""
    u = extremes.left[:, 0] - centre
    distance = np.abs(np.stack([extremes.left[:, 1] - level - slope * u for level, slope in traces]))
    nearest, is_near = np.argmin(distance, axis=0), distance.min(axis=0) < 0.25 * pitch
    lines = []
    for i, trace in enumerate(traces):
        x = extremes.left[is_near & (nearest == i), 0]
        if len(x) >= LEAST_EDGES // 2:
            lines.append(_on_baseline(trace, extremes.foot, _drop_strays(x, 2.5 * pitch), centre, pitch))
    return sorted(lines, key=lambda line: line.curve[0])


def _on_baseline(trace: tuple[float, float], feet: Array, x: Array, centre: float, pitch: float) -> LineBaseline:
    level, slope = trace
    left, right = float(x[0]), float(x[-1])
    middle = (left + right) / 2
    depth = feet[:, 1] - level - slope * (feet[:, 0] - centre)
    candidate = (feet[:, 0] > left - 0.5 * pitch) & (feet[:, 0] < right + 0.5 * pitch)
    candidate &= (depth > -0.1 * pitch) & (depth < 0.55 * pitch)
    foot = mode(depth[candidate], 0.04 * pitch) if candidate.any() else 0.2 * pitch
    on_line = candidate & (np.abs(depth - foot) < 0.3 * pitch)
    u, y = feet[on_line, 0] - middle, depth[on_line] - foot
    long, medium = right - left > 8 * pitch and int(on_line.sum()) > LEAST_EDGES, right - left > _SLOPED * pitch
    c0, c1, c2 = robust(u, y, 2 if long else (1 if medium else 0), 0.12 * pitch)
    return LineBaseline((level + foot + slope * (middle - centre) + c0, slope + c1, c2), left, right)


def _drop_strays(x: Array, gap: float) -> Array:
    """Sorted places without the few that stand apart: a short line would claim these strays of its neighbour."""
    x = np.sort(x)
    groups = np.split(x, np.flatnonzero(np.diff(x) > gap) + 1)
    most = max(len(group) for group in groups)
    return np.concatenate([group for group in groups if len(group) > 0.12 * most])


def robust(u: Array, y: Array, degree: int, scale: float) -> tuple[float, float, float]:
    """Polynomial through the densest part of the points: Tukey's weights, the scale drawn in step by step."""
    curve = np.zeros(3)
    if len(u) <= degree + 2:
        return 0.0, 0.0, 0.0
    scale_of_u = max(float(np.abs(u).max()), 1.0)
    powers = np.stack([(u / scale_of_u) ** k for k in range(degree + 1)], axis=1)
    for width in (2.0, 1.5, 1.0, 0.8, 0.8, 0.8):
        residual = (y - powers @ curve[: degree + 1]) / (width * scale)
        weight = np.where(np.abs(residual) < 1, (1 - residual**2) ** 2, 0.0)
        if (weight > 0).sum() <= degree + 2:
            break
        root = np.sqrt(weight)[:, None]
        curve[: degree + 1] = np.linalg.lstsq(powers * root, y * root[:, 0], rcond=None)[0]
    return float(curve[0]), float(curve[1] / scale_of_u), float(curve[2] / scale_of_u**2)


def mode(values: Array, sigma: float) -> float:
    """The densest of the values (n,), by a Gaussian kernel of width `sigma`."""
    grid = np.linspace(values.min(), values.max(), 200)
    density = np.exp(-0.5 * ((grid[:, None] - values) / sigma) ** 2).sum(axis=1)
    return float(grid[int(np.argmax(density))])


@dataclass(frozen=True, eq=False)
class StrokeExtremes:
    """Places (n, 2), mm: where runs of ink begin, strokes have no ink right beneath, and none right above.

    over : (n,) mm: how far the next ink above each of `top` is.
    """

    left: Array
    foot: Array
    top: Array
    over: Array


def find_stroke_extremes(mask: NDArray[np.bool_], dpi: float) -> StrokeExtremes:
    """The marks of a mask (h, w)."""
    pixel = 25.4 / dpi
    row, begin, end = spans(mask)
    short = (end - begin) * pixel < _UNDERLINE
    every = max(1, int(_ROWS / pixel))
    sampled = short & (row % every == 0)
    left = np.stack([begin[sampled], row[sampled]], axis=1) * pixel
    foot = _ends(mask, row[short], begin[short], end[short], 1)
    top = _ends(mask, row[short], begin[short], end[short], -1)
    # how far it is from each top to the next ink above it, or to the edge (n,)
    number = np.arange(1, mask.shape[0] + 1, dtype=np.int32)[:, None]
    last = np.maximum.accumulate(np.where(mask, number, 0), axis=0)
    y, x = top[:, 1].astype(np.intp), top[:, 0].astype(np.intp)
    free = np.asarray(np.where(y > 0, y - last[np.maximum(y - 1, 0), x], y), dtype=np.float64)
    return StrokeExtremes(left, foot * pixel, top * pixel, free * pixel)


def spans(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Row, first column and the column after the last of every run of ink (h, w), row by row."""
    padded = np.zeros((mask.shape[0], mask.shape[1] + 2), dtype=np.int8)
    padded[:, 1:-1] = mask
    change = np.diff(padded, axis=1)
    row, begin = np.nonzero(change == 1)
    return row, begin, np.nonzero(change == -1)[1]


def _ends(
    mask: NDArray[np.bool_], row: NDArray[np.intp], begin: NDArray[np.intp], end: NDArray[np.intp], way: int
) -> Array:
    """Middles (n, 2), pixels, of the runs without ink in the next row: below for `way` 1, above for −1."""
    height, width = mask.shape
    counts = np.zeros((height + 2, width + 1), dtype=np.int32)
    np.cumsum(mask, axis=1, out=counts[1:-1, 1:])
    beside = counts[row + 1 + way, np.minimum(end + 1, width)] - counts[row + 1 + way, np.maximum(begin - 1, 0)]
    free = beside == 0
    # the run's own outer edge: the foot of a stroke is where its ink ends
    return np.stack([(begin + end)[free] / 2, row[free] + (1.0 if way > 0 else 0.0)], axis=1)


def slant_of_lines(mask: NDArray[np.bool_], dpi: float, lines: Sequence[LineBaseline], x_height: float) -> float:
    """dx/dy of the letters, upwards: the shear under which the columns of a line hold ink most unevenly.

    All lines vote together, each as much as the other, and for the whole letters and their ascenders alike: upstrokes
    that join letters slant more than stems, and in a short line may be more.

    Source: own method; docs/bibliography.md.
    """
    pixel = 25.4 / dpi
    coarse = max(x_height / 14, pixel)
    votes = np.zeros(len(_SLANTS))
    for line in lines:
        x, height = _measure_heights(mask, pixel, line, x_height)
        for part in (height > -np.inf, height > 0.8 * x_height):
            if part.sum() < 100:
                continue
            upright = [(x - s * height)[part] for s in _SLANTS]
            columns = [np.bincount(((at - at.min()) / coarse).astype(np.intp)).astype(np.float64) for at in upright]
            concentration = [float(np.square(counts).sum()) for counts in columns]
            votes += np.array(concentration) / max(concentration)
    if not votes.any():
        return 0.0
    votes *= np.exp(-0.5 * ((_SLANTS - _USUAL) / _UNUSUAL) ** 2)
    k = int(np.argmax(votes))
    return float(_SLANTS[k]) + 0.05 * _peak_offset(votes, k)


def _measure_heights(mask: NDArray[np.bool_], pixel: float, line: LineBaseline, x_height: float) -> tuple[Array, Array]:
    """x and height over the baseline, mm, of the ink of a line, from its feet to its ascenders."""
    x0, x1 = max(0, int(line.left / pixel)), min(mask.shape[1], int(line.right / pixel) + 1)
    ends = line.baseline(np.linspace(line.left, line.right, 3))
    y0 = max(0, int((ends.min() - 2.2 * x_height) / pixel))
    y1 = min(mask.shape[0], int((ends.max() + 0.3 * x_height) / pixel) + 1)
    y, x = np.nonzero(mask[y0:y1, x0:x1])
    place = np.asarray((x + x0 + 0.5) * pixel, dtype=np.float64)
    height = line.baseline(place) - (y + y0 + 0.5) * pixel
    on_line = (height > -0.2 * x_height) & (height < 2.0 * x_height)
    # pixels stand in columns: spread over their width, or an upright page would look the evenest
    jitter = (np.arange(len(place)) * 0.618034 % 1 - 0.5) * pixel
    return (place + jitter)[on_line], height[on_line]


def _peak_offset(values: Array, k: int) -> float:
    """Where the parabola through a peak and its neighbours is highest, in steps from the peak."""
    if not 0 < k < len(values) - 1:
        return 0.0
    a, b, c = values[k - 1 : k + 2]
    bow = a - 2 * b + c
    return float(np.clip(0.5 * (a - c) / bow, -0.5, 0.5)) if bow < 0 else 0.0
