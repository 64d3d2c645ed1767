"""Written lines on a page image: where they are, how they slope and bend, where their words begin and end.

A line is found where many strokes have their left edge, not where there is much ink: left edges lie between the
baseline and the x-height, whereas ink is spread by ascenders, descenders and crossings.

Source: seed 000 leaves finding the lines to the user; the method answers its §5.1.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.scanning.rule import mode, robust
from handout.score.runs import spans
from handout.values import Array

_SLOPES = np.arange(-0.08, 0.0801, 0.004)  # of a whole page
_PITCH = (45, 300)  # pixels, 3.8–25 mm
_LEAST = 25  # edges of a line


@dataclass(frozen=True)
class WrittenLine:
    """One line of writing, in pixels of the page.

    curve : (c0, c1, c2): the baseline is y = c0 + c1 u + c2 u², u = x − middle; y down.
    left, right : x of the first and the last ink near the baseline.
    words : (first, last) x of the ink of each word, along the baseline, the slant taken out.
    """

    curve: tuple[float, float, float]
    left: float
    right: float
    words: tuple[tuple[float, float], ...] = ()

    @property
    def middle(self) -> float:
        """x of the middle, pixels."""
        return (self.left + self.right) / 2

    @property
    def length(self) -> float:
        """Pixels from the first to the last ink."""
        return self.right - self.left

    @property
    def slope(self) -> float:
        """dy/dx of the baseline in the middle: positive where the line falls."""
        return self.curve[1]

    @property
    def bend(self) -> float:
        """How far the middle hangs below the straight line through both ends, pixels (negative: above)."""
        return -self.curve[2] * (self.length / 2) ** 2

    def baseline(self, x: Array | float) -> Array:
        """y of the baseline at x, pixels."""
        u = np.asarray(x, dtype=np.float64) - self.middle
        c0, c1, c2 = self.curve
        return np.asarray(c0 + u * (c1 + u * c2))


def find_lines(mask: NDArray[np.bool_]) -> tuple[list[WrittenLine], float]:
    """The lines of a page from top to bottom, without their words, and the height of a small letter.

    The height, pixels, is over the outside of the ink: the thickness of the line is part of it.

    Parameters
    ----------
    mask : (h, w) bool, True where there is ink, at about 300 dpi.

    Returns
    -------
    Empty list and 0 for a page on which no line can be told.
    """
    row, left, _ = spans(mask)
    if len(row) < _LEAST:
        return [], 0.0
    edges = np.stack([left, row], axis=1).astype(np.float64)
    slope = _page_slope(edges)
    centre = float(edges[:, 0].mean())
    levels = edges[:, 1] - slope * (edges[:, 0] - centre)
    middles, pitch = _middles(levels)
    traces = _traces(edges, levels, slope, centre, middles, pitch)
    low, high = bottoms(mask), bottoms(mask[::-1])
    high[:, 1] = mask.shape[0] - 1 - high[:, 1]
    found = []
    for trace, own in zip(traces, _owned(edges, centre, traces, pitch), strict=True):
        if len(own) >= _LEAST:
            found.append(_on_baseline(trace, low, own[:, 0], centre, pitch))
    found = _apart(sorted(found, key=lambda line: line.curve[0]), pitch)
    return found, _x_height(found, high, pitch)


def bottoms(mask: NDArray[np.bool_]) -> Array:
    """(n, 2) float, (x, y) pixels: the lowest points of strokes, runs of ink with no ink beneath."""
    row, begin, end = spans(mask)
    below = np.zeros((mask.shape[0] + 1, mask.shape[1] + 1), dtype=np.int32)
    np.cumsum(mask[1:], axis=1, out=below[: mask.shape[0] - 1, 1:])
    ink = below[row, np.minimum(end + 1, mask.shape[1])] - below[row, np.maximum(begin - 1, 0)]
    lowest = ink == 0
    return np.stack([(begin + end - 1)[lowest] / 2, row[lowest].astype(np.float64)], axis=1)


def _page_slope(edges: Array) -> float:
    """The slope that makes the profile of left edges sharpest."""
    u = edges[:, 0] - edges[:, 0].mean()
    sharpness = [float(np.square(np.diff(_profile(edges[:, 1] - s * u, 4.0))).sum()) for s in _SLOPES]
    return float(_SLOPES[int(np.argmax(sharpness))])


def _profile(levels: Array, sigma: float) -> Array:
    """Edges per pixel of height, from the least level on, smoothed."""
    from scipy.ndimage import gaussian_filter1d

    counts = np.bincount(np.rint(levels - levels.min()).astype(np.intp) + _PAD, minlength=2 * _PAD)
    counts = np.concatenate([counts, np.zeros(_PAD, dtype=counts.dtype)])
    return np.asarray(gaussian_filter1d(counts.astype(np.float64), sigma, mode="constant"))


_PAD = 60  # empty rows above and below a profile, so that the first and last lines are peaks too


def _middles(levels: Array) -> tuple[list[float], float]:
    """Levels of the middles of the lines, and their pitch, pixels."""
    from scipy.signal import find_peaks

    pitch = _period(_profile(levels, 5.0))
    smooth = _profile(levels, 0.13 * pitch)
    tall = float(np.percentile(smooth, 95))
    peaks, _ = find_peaks(smooth, distance=max(1, 0.55 * pitch), prominence=0.05 * tall, height=0.07 * tall)
    return [float(peak - _PAD + levels.min()) for peak in peaks], pitch


def _period(profile: Array) -> float:
    """Distance at which the profile repeats: the least of those that are nearly as good as the best."""
    from scipy.signal import find_peaks

    centred = profile - profile.mean()
    power = np.abs(np.fft.rfft(centred, 2 * len(centred))) ** 2
    again = np.fft.irfft(power)[: len(centred)]
    again = again / again[0] * len(again) / np.arange(len(again), 0, -1)  # as many terms at every lag
    part = again[: min(_PITCH[1], len(again) * 2 // 3) + 1]
    peaks, _ = find_peaks(part)
    peaks = peaks[peaks >= _PITCH[0]]
    if not len(peaks):
        return float(min(100, len(profile)))
    good = peaks[part[peaks] >= 0.75 * part[peaks].max()]
    return float(good[0])


def _traces(
    edges: Array, levels: Array, slope: float, centre: float, middles: list[float], pitch: float
) -> list[tuple[float, float]]:
    """(level at `centre`, slope) of the middle of every line.

    Twice: the second time a line keeps near the slope of its neighbours, so that a short line does not climb into
    the one above.
    """
    around = np.full(len(middles), slope)
    free = 0.06
    for spread in (np.inf, 0.008):
        traces = []
        for middle, near in zip(middles, around, strict=True):
            inside = np.abs(levels - middle) < 0.7 * pitch
            u, y = edges[inside, 0] - centre, edges[inside, 1]
            traces.append(_trace(u, y, middle, slope, near + np.linspace(-free, free, 25), near, spread, pitch))
        slopes = np.array([own for _, own in traces])
        around = np.array([np.median(slopes[max(0, i - 2) : i + 3]) for i in range(len(slopes))])
        free = 0.03
    return traces


def _trace(
    u: Array, y: Array, middle: float, slope: float, slopes: Array, near: float, spread: float, pitch: float
) -> tuple[float, float]:
    """The band that holds most left edges (u, y): its level at u = 0 and its slope, one of `slopes`."""
    from scipy.ndimage import gaussian_filter1d

    core = np.abs(y - middle - slope * u) < 0.3 * pitch
    if not core.any():
        return middle, near
    u_mean, half = float(np.median(u[core])), round(0.7 * pitch)
    if np.ptp(np.percentile(u[core], [5, 95])) < 2 * pitch:
        slopes = np.array([near])  # too short to tell
    best, answer = -1.0, (middle, near)
    for own in slopes:
        rest = y - middle - slope * u_mean - own * (u - u_mean)
        at = np.rint(rest[np.abs(rest) < half]).astype(np.intp) + half
        held = gaussian_filter1d(np.bincount(at, minlength=2 * half + 1).astype(np.float64), 0.13 * pitch)
        held *= np.exp(-0.5 * ((own - near) / spread) ** 2)
        middle_part = held[half // 2 : -(half // 2)]
        peak = int(np.argmax(middle_part))
        if middle_part[peak] > best:
            best = float(middle_part[peak])
            answer = (middle + slope * u_mean + peak + half // 2 - half - own * u_mean, float(own))
    return answer


def _owned(edges: Array, centre: float, traces: list[tuple[float, float]], pitch: float) -> list[Array]:
    """The left edges (n, 2) that lie on each line, and on no other more."""
    if not traces:
        return []
    u = edges[:, 0] - centre
    off = np.abs(np.stack([edges[:, 1] - level - slope * u for level, slope in traces]))
    nearest = np.argmin(off, axis=0)
    close = off.min(axis=0) < 0.25 * pitch
    return [edges[close & (nearest == i)] for i in range(len(traces))]


def _on_baseline(trace: tuple[float, float], low: Array, x: Array, centre: float, pitch: float) -> WrittenLine:
    """The line moved from its middle down to the feet of its letters, with its own bend."""
    level, slope = trace
    x = _together(x, 2.0 * pitch)
    left, right = float(x[0]), float(x[-1])
    u_middle = (left + right) / 2
    fall = low[:, 1] - level - slope * (low[:, 0] - centre)
    at = (low[:, 0] > left - 0.5 * pitch) & (low[:, 0] < right + 0.5 * pitch) & (fall > -0.1 * pitch)
    at &= fall < 0.55 * pitch
    foot = mode(fall[at], 0.04 * pitch) if at.any() else 0.2 * pitch
    level += foot + slope * (u_middle - centre)
    near = at & (np.abs(fall - foot) < 0.3 * pitch)
    u, y = low[near, 0] - u_middle, fall[near] - foot
    bend = right - left > 8 * pitch and near.sum() > _LEAST
    c0, c1, c2 = robust(u, y, 2 if bend else (1 if right - left > 2.5 * pitch else 0), 0.12 * pitch)
    return WrittenLine((level + c0, slope + c1, c2), left, right)


def _together(x: Array, gap: float) -> Array:
    """Sorted, without the few that stand apart: strays from a neighbouring line that a short one would claim."""
    groups = np.split(np.sort(x), np.flatnonzero(np.diff(np.sort(x)) > gap) + 1)
    most = max(len(group) for group in groups)
    return np.concatenate([group for group in groups if len(group) > 0.25 * most])


def _apart(lines: list[WrittenLine], pitch: float) -> list[WrittenLine]:
    """Of two lines in one place the longer."""
    kept: list[WrittenLine] = []
    for line in lines:
        x = max(line.left, kept[-1].left) if kept else 0.0
        if kept and float(line.baseline(x) - kept[-1].baseline(x)) < 0.4 * pitch:
            if line.length > kept[-1].length:
                kept[-1] = line
        else:
            kept.append(line)
    return kept


def _x_height(lines: list[WrittenLine], high: Array, pitch: float) -> float:
    """The height above the baseline at which most strokes have their top, pixels."""
    heights = [tops_over(line, high, pitch)[1] for line in lines]
    above = np.concatenate(heights) if heights else np.zeros(0)
    above = above[(above > 0.12 * pitch) & (above < 0.7 * pitch)]
    return mode(above, 0.03 * pitch) if len(above) >= _LEAST else 0.0


def tops_over(line: WrittenLine, points: Array, reach: float) -> tuple[Array, Array]:
    """x and height over the baseline (m,) of the points (n, 2) that lie on the line, at most `reach` from it."""
    inside = (points[:, 0] >= line.left - 2) & (points[:, 0] <= line.right + 2)
    x = points[inside, 0]
    height = line.baseline(x) - points[inside, 1]
    near = np.abs(height) < reach
    return x[near], height[near]
