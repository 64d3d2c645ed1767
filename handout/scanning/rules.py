"""The lines of a page: where each runs and bends, how tall its small letters are, how they slant.

Lines are looked for where strokes have their left edge, not where there is much ink: left edges lie between baseline
and x-height, whereas ink is spread by ascenders and descenders.  Each line has a slope of its own: on a page written
without rules they may turn by degrees from the first line to the last.

Source: alignment specification, recipe 2 and 4; handwriting specification §8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.scanning.strokes import Marks, find_marks, slant_of
from handout.values import Array

_SLOPES = np.arange(-0.10, 0.1001, 0.004)  # of a whole page
_BIN = 0.1  # mm of a profile
_PITCH = (3.0, 28.0)  # mm
_LEAST = 25  # left edges of a line
_UNEVEN = 1.0  # what a gap e times the pitch costs, in peaks
_FREE = 0.06  # how far a line's slope may lie from the page's


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


@dataclass(frozen=True, eq=False)
class Rules:
    """The lines of a page from top to bottom.

    x_height : mm, over the outside of the ink.
    slant : dx/dy of the letters, upwards: 0 upright, positive leaning to the right.
    pitch : mm from a line to the next.
    """

    lines: tuple[Rule, ...]
    x_height: float
    slant: float
    pitch: float

    def nearest(self, xy: Array) -> NDArray[np.intp]:
        """(n,) int: for places (n, 2), mm, the line in the middle of whose small letters they are nearest to."""
        if not self.lines:
            return np.full(len(xy), -1, dtype=np.intp)
        off = [np.abs(line.baseline(xy[:, 0]) - 0.5 * self.x_height - xy[:, 1]) for line in self.lines]
        return np.asarray(np.argmin(np.stack(off), axis=0))

    def line_space(self, xy: Array, line: int) -> Array:
        """(n, 2) float: places in line space: x along the line, y up from its baseline, one `pitch` long each."""
        rule = self.lines[line]
        return np.stack([xy[:, 0] - rule.left, rule.baseline(xy[:, 0]) - xy[:, 1]], axis=1) / self.pitch


def find_rules(mask: NDArray[np.bool_], dpi: float, count: int | None = None) -> Rules:
    """The lines on a page.

    Parameters
    ----------
    mask : (h, w) bool, ink.
    dpi : pixels per inch.
    count : how many lines there are, if the transcript says so.

    Returns
    -------
    Rules without lines, and all 0, for a page on which no line can be told.

    Source: alignment specification, recipe 2.
    """
    marks = find_marks(mask, dpi)
    if len(marks.left) < _LEAST:
        return Rules((), 0.0, 0.0, 0.0)
    slope = _page_slope(marks.left)
    centre = float(marks.left[:, 0].mean())
    levels = marks.left[:, 1] - slope * (marks.left[:, 0] - centre)
    middles, pitch = _peaks(levels)
    if count and len(middles) != count:
        middles, pitch = _counted(levels, count)
    traces = _traces(marks.left, levels, slope, centre, middles, pitch)
    lines = _on_baselines(marks, traces, centre, pitch)
    if not count:
        lines = _apart(lines, pitch)
    if not lines:
        return Rules((), 0.0, 0.0, 0.0)
    if len(lines) > 1:
        x = float(np.median([line.middle for line in lines]))
        pitch = float(np.median(np.diff([float(line.baseline(x)) for line in lines])))
    x_height = _x_height(lines, marks.top, pitch)
    return Rules(tuple(lines), x_height, slant_of(mask, dpi, lines, x_height), pitch)


def _page_slope(edges: Array) -> float:
    """The slope that makes the profile of left edges sharpest."""
    u = edges[:, 0] - edges[:, 0].mean()
    sharpness = [float(np.square(np.diff(_profile(edges[:, 1] - s * u, 0.35)[0])).sum()) for s in _SLOPES]
    return float(_SLOPES[int(np.argmax(sharpness))])


def _profile(levels: Array, sigma: float) -> tuple[Array, float]:
    """Edges per `_BIN` of height, smoothed by `sigma` mm, with empty rows around; and the level of the first bin."""
    from scipy.ndimage import gaussian_filter1d

    first = float(levels.min()) - 6.0
    at = ((levels - first) / _BIN).astype(np.intp)
    counts = np.bincount(at, minlength=int(at.max()) + int(6.0 / _BIN)).astype(np.float64)
    return np.asarray(gaussian_filter1d(counts, sigma / _BIN, mode="constant")), first


def _peaks(levels: Array) -> tuple[list[float], float]:
    """Levels of the middles of the lines, and their pitch, where it is not known how many they are."""
    from scipy.signal import find_peaks

    pitch = _period(_profile(levels, 0.42)[0])
    smooth, first = _profile(levels, 0.13 * pitch)
    tall = float(np.percentile(smooth, 95))
    peaks, _ = find_peaks(smooth, distance=max(1, 0.55 * pitch / _BIN), prominence=0.05 * tall, height=0.07 * tall)
    return [first + (float(peak) + 0.5) * _BIN for peak in peaks], pitch


def _period(profile: Array) -> float:
    """Distance at which the profile repeats, mm: the least of those that are nearly as good as the best."""
    from scipy.signal import find_peaks

    centred = profile - profile.mean()
    power = np.abs(np.fft.rfft(centred, 2 * len(centred))) ** 2
    again = np.fft.irfft(power)[: len(centred)]
    again = again / again[0] * len(again) / np.arange(len(again), 0, -1)  # as many terms at every lag
    part = again[: min(int(_PITCH[1] / _BIN), len(again) * 2 // 3) + 1]
    peaks, _ = find_peaks(part)
    peaks = peaks[peaks >= _PITCH[0] / _BIN]
    if not len(peaks):
        return float(min(9.0, len(profile) * _BIN))
    return float(peaks[part[peaks] >= 0.75 * part[peaks].max()][0]) * _BIN


def _counted(levels: Array, count: int) -> tuple[list[float], float]:
    """Levels of exactly `count` lines, and their pitch.

    For each of several pitches the chain of peaks of the profile that holds most, gaps unlike the pitch costing.

    Source: alignment specification, recipe 2.
    """
    sharp, _ = _profile(levels, 0.25)
    inky = np.flatnonzero(sharp > 0.08 * sharp.max())
    extent = (inky[-1] - inky[0]) * _BIN
    if count == 1:
        smooth, first = _profile(levels, 0.8)
        return [first + (int(np.argmax(smooth)) + 0.5) * _BIN], max(_PITCH[0], min(9.0, 1.5 * extent))
    best: tuple[float, list[float], float] = (-np.inf, [], 0.0)
    for pitch in np.linspace(extent / (count + 0.8), extent / max(count - 1.3, 0.8), 25):
        smooth, first = _profile(levels, 0.12 * pitch)
        gain, at = _chain(smooth / sharp.max(), count, pitch / _BIN)
        if gain > best[0]:
            best = (gain, [first + (a + 0.5) * _BIN for a in at], float(pitch))
    return best[1], best[2]


def _chain(held: Array, count: int, pitch: float) -> tuple[float, list[int]]:
    """The best `count` places of a profile, .55 to 2 of the pitch apart, and what they hold."""
    gaps = np.arange(max(1, int(0.55 * pitch)), int(2.0 * pitch) + 2)
    price = _UNEVEN * np.log(gaps / pitch) ** 2
    total = held.copy()
    back = np.zeros((count, len(held)), dtype=np.intp)
    for k in range(1, count):
        padded = np.concatenate([np.full(gaps[-1], -np.inf), total])
        # before[i, j]: the best chain that ends gaps[j] above place i
        before = np.stack([padded[gaps[-1] - gap : gaps[-1] - gap + len(held)] for gap in gaps], axis=1) - price
        choice = np.argmax(before, axis=1)
        back[k] = gaps[choice]
        total = held + before[np.arange(len(held)), choice]
    at = [int(np.argmax(total))]
    gain = float(total[at[0]])
    for k in range(count - 1, 0, -1):
        at.append(at[-1] - int(back[k, at[-1]]))
    return gain, at[::-1]


def _traces(
    edges: Array, levels: Array, slope: float, centre: float, middles: list[float], pitch: float
) -> list[tuple[float, float]]:
    """(level at `centre`, slope) of the middle of every line.

    Three times: after the first a line keeps near the slope of its neighbours, so that a short line does not climb
    into the one above.
    """
    around = np.full(len(middles), slope)
    free, traces = _FREE, [(middle, slope) for middle in middles]
    for spread in (np.inf, 0.008, 0.008):
        traces = []
        for middle, near in zip(middles, around, strict=True):
            inside = np.abs(levels - middle) < 0.7 * pitch
            own = edges[inside] - (centre, 0.0)
            traces.append(_trace(own, middle, slope, near + np.linspace(-free, free, 25), near, spread, pitch))
        slopes = np.array([own for _, own in traces])
        around = np.array([np.median(slopes[max(0, i - 2) : i + 3]) for i in range(len(slopes))])
        free = 0.03
    return traces


def _trace(
    edges: Array, middle: float, slope: float, slopes: Array, near: float, spread: float, pitch: float
) -> tuple[float, float]:
    """The band that holds most left edges (n, 2): its level at x = 0 and its slope, one of `slopes`."""
    from scipy.ndimage import gaussian_filter1d

    u, y = edges.T
    core = np.abs(y - middle - slope * u) < 0.3 * pitch
    if not core.any():
        return middle, near
    u_mean, half = float(np.median(u[core])), round(0.7 * pitch / _BIN)
    if np.ptp(np.percentile(u[core], [5, 95])) < 2 * pitch:
        slopes = np.array([near])  # too short to tell
    best, answer = -1.0, (middle, near)
    for own in slopes:
        rest = (y - middle - slope * u_mean - own * (u - u_mean)) / _BIN
        at = np.rint(rest[np.abs(rest) < half]).astype(np.intp) + half
        held = np.bincount(at, minlength=2 * half + 1).astype(np.float64)
        held = gaussian_filter1d(held, 0.13 * pitch / _BIN) * np.exp(-0.5 * ((own - near) / spread) ** 2)
        within = held[half // 2 : -(half // 2)]
        peak = int(np.argmax(within))
        if within[peak] > best:
            best = float(within[peak])
            answer = (middle + slope * u_mean + (peak + half // 2 - half) * _BIN - own * u_mean, float(own))
    return answer


def _on_baselines(marks: Marks, traces: list[tuple[float, float]], centre: float, pitch: float) -> list[Rule]:
    """The lines moved from the middles of their small letters down to their feet, each with its own bend."""
    u = marks.left[:, 0] - centre
    off = np.abs(np.stack([marks.left[:, 1] - level - slope * u for level, slope in traces]))
    nearest, close = np.argmin(off, axis=0), off.min(axis=0) < 0.25 * pitch
    lines = []
    for i, trace in enumerate(traces):
        x = marks.left[close & (nearest == i), 0]
        if len(x) >= _LEAST // 2:
            lines.append(_on_baseline(trace, marks.foot, _together(x, 2.5 * pitch), centre, pitch))
    return sorted(lines, key=lambda line: line.curve[0])


def _on_baseline(trace: tuple[float, float], feet: Array, x: Array, centre: float, pitch: float) -> Rule:
    level, slope = trace
    left, right = float(x[0]), float(x[-1])
    middle = (left + right) / 2
    fall = feet[:, 1] - level - slope * (feet[:, 0] - centre)
    at = (feet[:, 0] > left - 0.5 * pitch) & (feet[:, 0] < right + 0.5 * pitch)
    at &= (fall > -0.1 * pitch) & (fall < 0.55 * pitch)
    foot = _mode(fall[at], 0.04 * pitch) if at.any() else 0.2 * pitch
    near = at & (np.abs(fall - foot) < 0.3 * pitch)
    u, y = feet[near, 0] - middle, fall[near] - foot
    long, some = right - left > 8 * pitch and int(near.sum()) > _LEAST, right - left > 2.5 * pitch
    c0, c1, c2 = _robust(u, y, 2 if long else (1 if some else 0), 0.12 * pitch)
    return Rule((level + foot + slope * (middle - centre) + c0, slope + c1, c2), left, right)


def _together(x: Array, gap: float) -> Array:
    """Sorted, without the few that stand apart: strays from a neighbouring line that a short one would claim."""
    x = np.sort(x)
    groups = np.split(x, np.flatnonzero(np.diff(x) > gap) + 1)
    most = max(len(group) for group in groups)
    return np.concatenate([group for group in groups if len(group) > 0.12 * most])


def _robust(u: Array, y: Array, degree: int, scale: float) -> tuple[float, float, float]:
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


def _mode(values: Array, sigma: float) -> float:
    """The densest value, by a Gaussian kernel."""
    grid = np.linspace(values.min(), values.max(), 200)
    held = np.exp(-0.5 * ((grid[:, None] - values) / sigma) ** 2).sum(axis=1)
    return float(grid[int(np.argmax(held))])


def _apart(lines: list[Rule], pitch: float) -> list[Rule]:
    """Of two lines in one place the longer."""
    kept: list[Rule] = []
    for line in lines:
        x = max(line.left, kept[-1].left) if kept else 0.0
        if kept and float(line.baseline(x) - kept[-1].baseline(x)) < 0.45 * pitch:
            if line.right - line.left > kept[-1].right - kept[-1].left:
                kept[-1] = line
        else:
            kept.append(line)
    return kept


def _x_height(lines: list[Rule], tops: Array, pitch: float) -> float:
    """The height above the baseline at which most strokes have their top, mm."""
    heights = []
    for line in lines:
        own = tops[(tops[:, 0] > line.left) & (tops[:, 0] < line.right)]
        heights.append(line.baseline(own[:, 0]) - own[:, 1])
    above = np.concatenate(heights)
    above = above[(above > 0.12 * pitch) & (above < 0.7 * pitch)]
    return _mode(above, 0.03 * pitch) if len(above) >= _LEAST else 0.3 * pitch
