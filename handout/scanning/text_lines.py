"""The lines of writing on a page: where each runs and bends, its x-height, its slant, and which ink belongs to it.

Lines are looked for where strokes have their left edge, not where there is much ink: left edges lie between baseline
and x-height, whereas ink is spread by ascenders and descenders.  Each line has a slope of its own: on a page written
without rules they may turn by degrees from the first line to the last.

Source: own method, after the recipe for line extraction in docs/bibliography.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2, ndimage
from handout.peaks import peaks
from handout.scanning.baselines import (
    LEAST_EDGES,
    LineBaseline,
    find_stroke_extremes,
    mode,
    on_baselines,
    slant_of_lines,
)
from handout.values import Array

_SLOPES = np.arange(-0.10, 0.1001, 0.004)  # tried for a whole page: ±6°
_BIN = 0.1  # mm of a profile
_PITCH = (3.0, 28.0)  # mm from line to line, least and greatest: as in `checks`
_USUAL = 75.0  # percentile of a profile's rows that its lines are capped at; 65 and 80 do the same on 20 pages
_NEARLY = 0.6  # of the best; of 45 pages (Copiste, csafe, cvl) one, with a printed heading, needs less than 0.75
_UNEVEN = 1.0  # cost, in peaks, of a gap that is e times the pitch
_FREE = 0.06  # how far a line's slope may lie from the page's
_OPEN = 6.5  # times the spread of left edges in a line: the widest pitch that writing of this size is usually given
_MIDDLE, _BAND = 0.5, 0.55  # x-heights: where the body of a line lies, and half its height
_UPPER = 0.9  # a speck above a line is nearer to it than one as far below: ascenders, dots and accents
_SHARED = 0.25  # a component with so much of its ink in a second body belongs to both lines


@dataclass(frozen=True, eq=False)
class TextLines:
    """The lines of a page from top to bottom.

    x_height : mm, over the outside of the ink.
    slant : dx/dy of the letters, upwards: 0 upright, positive leaning to the right.
    pitch : mm from a line to the next.
    """

    lines: tuple[LineBaseline, ...]
    x_height: float
    slant: float
    pitch: float

    def nearest(self, xy: Array) -> NDArray[np.intp]:
        """(n,) int: the line whose x-height band has its middle nearest to each of the places (n, 2), mm."""
        if not self.lines:
            return np.full(len(xy), -1, dtype=np.intp)
        off = [np.abs(line.baseline(xy[:, 0]) - 0.5 * self.x_height - xy[:, 1]) for line in self.lines]
        return np.asarray(np.argmin(np.stack(off), axis=0))


def find_text_lines(mask: NDArray[np.bool_], dpi: float, count: int | None = None) -> TextLines:
    """The lines on a page.

    mask : (h, w) bool, ink.
    dpi : pixels per inch.
    count : how many lines there are, if the transcript says so.

    Returns TextLines without lines, and all 0, for a page on which no line can be told.

    Source: own method; docs/bibliography.md.
    """
    extremes = find_stroke_extremes(mask, dpi)
    if len(extremes.left) < LEAST_EDGES:
        return TextLines((), 0.0, 0.0, 0.0)
    # the slope that makes the profile of left edges sharpest
    u = extremes.left[:, 0] - extremes.left[:, 0].mean()
    profiles = (_capped(_profile(extremes.left[:, 1] - s * u, 0.35)[0]) for s in _SLOPES)
    sharpness = [float(np.square(np.diff(profile)).sum()) for profile in profiles]
    slope = float(_SLOPES[int(np.argmax(sharpness))])
    centre = float(extremes.left[:, 0].mean())
    levels = extremes.left[:, 1] - slope * (extremes.left[:, 0] - centre)
    # levels of the middles of the lines, and their pitch, where it is not known how many they are
    profile, _ = _profile(levels, 0.42)
    pitch = min(_period(profile), _period(_capped(profile)))
    smooth, first = _profile(levels, 0.13 * pitch)
    high = float(np.percentile(smooth, 95))
    places = peaks(smooth, prominence=0.05 * high, apart=max(1, int(np.ceil(0.55 * pitch / _BIN))))
    places = places[smooth[places] >= 0.07 * high]
    middles = [first + (float(place) + 0.5) * _BIN for place in places]
    if count and len(middles) != count:
        middles, pitch = _place_lines(levels, count)
    traces = _traces(extremes.left, levels, slope, centre, middles, pitch)
    widest = _widest(extremes.left, traces, centre)
    lines = on_baselines(extremes, traces, centre, min(pitch, widest))
    if not count:
        lines = _keep_longer(lines, pitch)
    if not lines:
        return TextLines((), 0.0, 0.0, 0.0)
    if len(lines) > 1:
        x = float(np.median([line.middle for line in lines]))
        pitch = float(np.median(np.diff([float(line.baseline(x)) for line in lines])))
    close = min(pitch, widest)
    x_height = _x_height(lines, extremes.top[extremes.over > 0.25 * close], close)
    return TextLines(tuple(lines), x_height, slant_of_lines(mask, dpi, lines, x_height), pitch)


def _profile(levels: Array, sigma: float) -> tuple[Array, float]:
    """Edges per `_BIN` of height, smoothed by `sigma` mm, with empty rows around; and the level of the first bin."""
    first = float(levels.min()) - 6.0
    at = ((levels - first) / _BIN).astype(np.intp)
    counts = np.bincount(at, minlength=int(at.max()) + int(6.0 / _BIN)).astype(np.float64)
    return np.asarray(ndimage.gaussian_filter1d(counts, sigma / _BIN, mode="constant")), first


def _capped(profile: Array) -> Array:
    """A profile in which no line counts for more than most do: print has many edges, and some lines are short."""
    return np.minimum(profile, float(np.percentile(profile[profile > 0.01 * profile.max()], _USUAL)))


def _period(profile: Array) -> float:
    """Distance at which the profile repeats, mm: the least of those that are nearly as good as the best."""
    centred = profile - profile.mean()
    power = np.abs(np.fft.rfft(centred, 2 * len(centred))) ** 2
    sums = np.fft.irfft(power)[: len(centred)]
    # the mean, not the sum: a longer lag has fewer terms
    autocorrelation = sums / sums[0] * len(sums) / np.arange(len(sums), 0, -1)
    part = autocorrelation[: min(int(_PITCH[1] / _BIN), len(autocorrelation) * 2 // 3) + 1]
    lags = peaks(part, prominence=0.0)
    lags = lags[lags >= _PITCH[0] / _BIN]
    if not len(lags):
        return float(min(9.0, len(profile) * _BIN))
    best = float(part[lags].max())  # not above 0 where there are no lines, as on a page that lies on its side
    return float(lags[part[lags] >= min(_NEARLY * best, best)][0]) * _BIN


def _place_lines(levels: Array, count: int) -> tuple[list[float], float]:
    """Levels of exactly `count` lines, and their pitch.

    For each of several pitches the chain of peaks of the profile that holds most, gaps unlike the pitch costing.

    Source: own method; docs/bibliography.md.
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


def _chain(profile: Array, count: int, pitch: float) -> tuple[float, list[int]]:
    """The best `count` places of a profile, .55 to 2 of the pitch apart, and what they hold."""
    gaps = np.arange(max(1, int(0.55 * pitch)), int(2.0 * pitch) + 2)
    cost = _UNEVEN * np.log(gaps / pitch) ** 2
    score = profile.copy()
    previous = np.zeros((count, len(profile)), dtype=np.intp)
    for k in range(1, count):
        padded = np.concatenate([np.full(gaps[-1], -np.inf), score])
        # before[i, j]: the best chain that ends gaps[j] above place i
        before = np.stack([padded[gaps[-1] - gap : gaps[-1] - gap + len(profile)] for gap in gaps], axis=1) - cost
        choice = np.argmax(before, axis=1)
        previous[k] = gaps[choice]
        score = profile + before[np.arange(len(profile)), choice]
    places = [int(np.argmax(score))]
    gain = float(score[places[0]])
    for k in range(count - 1, 0, -1):
        places.append(places[-1] - int(previous[k, places[-1]]))
    return gain, places[::-1]


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
            edge_points = edges[inside] - (centre, 0.0)
            traces.append(_trace(edge_points, middle, slope, near + np.linspace(-free, free, 25), near, spread, pitch))
        slopes = np.array([edge_points for _, edge_points in traces])
        around = np.array([np.median(slopes[max(0, i - 2) : i + 3]) for i in range(len(slopes))])
        free = 0.03
    return traces


def _trace(
    edges: Array, middle: float, slope: float, slopes: Array, usual_slope: float, spread: float, pitch: float
) -> tuple[float, float]:
    """The band that holds most left edges (n, 2): its level at x = 0 and its slope, one of `slopes`."""
    u, y = edges.T
    core = np.abs(y - middle - slope * u) < 0.3 * pitch
    if not core.any():
        return middle, usual_slope
    u_mean, half = float(np.median(u[core])), round(0.7 * pitch / _BIN)
    if np.ptp(np.percentile(u[core], [5, 95])) < 2 * pitch:
        slopes = np.array([usual_slope])  # too short to tell
    best, trace = -1.0, (middle, usual_slope)
    for trial in slopes:
        residual = (y - middle - slope * u_mean - trial * (u - u_mean)) / _BIN
        at = np.rint(residual[np.abs(residual) < half]).astype(np.intp) + half
        counts = np.bincount(at, minlength=2 * half + 1).astype(np.float64)
        counts = ndimage.gaussian_filter1d(counts, 0.13 * pitch / _BIN)
        counts *= np.exp(-0.5 * ((trial - usual_slope) / spread) ** 2)
        within = counts[half // 2 : -(half // 2)]
        peak = int(np.argmax(within))
        if within[peak] > best:
            best = float(within[peak])
            trace = (middle + slope * u_mean + (peak + half // 2 - half) * _BIN - trial * u_mean, float(trial))
    return trace


def _widest(edges: Array, traces: list[tuple[float, float]], centre: float) -> float:
    """The widest pitch, mm, that writing of this size is usually given.

    Lines that are spaced out do not tell how large their letters are; how left edges (n, 2) lie around them does.
    """
    distances = np.stack([edges[:, 1] - level - slope * (edges[:, 0] - centre) for level, slope in traces])
    nearest = distances[np.abs(distances).argmin(axis=0), np.arange(len(edges))]
    low, high = np.percentile(nearest, [25, 75])
    return _OPEN * float(high - low)


def _keep_longer(lines: list[LineBaseline], pitch: float) -> list[LineBaseline]:
    """Of two lines in one place the longer."""
    separate: list[LineBaseline] = []
    for line in lines:
        x = max(line.left, separate[-1].left) if separate else 0.0
        if separate and float(line.baseline(x) - separate[-1].baseline(x)) < 0.45 * pitch:
            if line.right - line.left > separate[-1].right - separate[-1].left:
                separate[-1] = line
        else:
            separate.append(line)
    return separate


def _x_height(lines: list[LineBaseline], tops: Array, pitch: float) -> float:
    """The height above the baseline at which strokes usually have their top, mm: the median around the mode."""
    heights = []
    for line in lines:
        tops_on_line = tops[(tops[:, 0] > line.left) & (tops[:, 0] < line.right)]
        heights.append(line.baseline(tops_on_line[:, 0]) - tops_on_line[:, 1])
    heights_above = np.concatenate(heights)
    heights_above = heights_above[(heights_above > 0.12 * pitch) & (heights_above < 0.7 * pitch)]
    if len(heights_above) < LEAST_EDGES:
        return 0.3 * pitch
    height = mode(heights_above, 0.03 * pitch)
    for _ in range(2):
        height = float(np.median(heights_above[(heights_above > 0.6 * height) & (heights_above < 1.6 * height)]))
    return height


class PixelBaseline(Protocol):
    """Where a line of writing lies.  x_height : of its small letters, pixels."""

    @property
    def x_height(self) -> float: ...

    def base(self, x: Array, /) -> Array:
        """y of the baseline at x, pixels."""
        ...


def line_owners(mask: NDArray[np.bool_], lines: Sequence[PixelBaseline]) -> NDArray[np.int16]:
    """(h, w) int16: the number of the line that every pixel of ink belongs to, −1 for paper.

    A component belongs to the line in whose body it lies.  One that lies in the bodies of several is shared among them
    along its strokes: every pixel goes to the body that is nearest on the way through the ink.

    mask : (h, w) bool, where there is ink.
    lines : at least one.
    """
    count, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    y, x = np.nonzero(mask)
    component = label[y, x]
    height_over = np.stack([(line.base(x.astype(np.float64)) - y) / line.x_height - _MIDDLE for line in lines])
    in_body = np.abs(height_over) < _BAND
    body_pixels = np.stack([np.bincount(component[pixels], minlength=count) for pixels in in_body])
    distance = np.where(height_over > 0, height_over * _UPPER, -height_over)
    total_distance = np.stack([np.bincount(component, row, minlength=count) for row in distance])
    most_pixels = body_pixels.max(axis=0)
    owner = np.where(most_pixels > 0, body_pixels.argmax(axis=0), total_distance.argmin(axis=0)).astype(np.int16)
    line_of = np.where(mask, owner[label], np.int16(-1))
    for number in np.flatnonzero((body_pixels > _SHARED * np.maximum(most_pixels, 1)).sum(axis=0) > 1):
        left, top, wide, high, _ = stats[number]
        corner = (slice(top, top + high), slice(left, left + wide))
        mask_of = label[corner] == number
        sharing = np.flatnonzero(body_pixels[:, number] > _SHARED * most_pixels[number])
        line_of[corner][mask_of] = _share_components(mask_of, (left, top), lines, sharing)[mask_of]
    return line_of


def _share_components(
    piece: NDArray[np.bool_], corner: tuple[int, int], lines: Sequence[PixelBaseline], among: NDArray[np.intp]
) -> NDArray[np.int16]:
    """(h, w) the line of every pixel of a component that lies in the bodies of several lines."""
    from skimage.segmentation import watershed

    y, x = np.nonzero(piece)
    seeds = np.zeros(piece.shape, dtype=np.int32)
    for number in among:
        line = lines[number]
        over = (line.base(x + float(corner[0])) - y - corner[1]) / line.x_height - _MIDDLE
        core = np.abs(over) < _BAND
        seeds[y[core], x[core]] = number + 1
    # on a level floor the flood from the bodies meets half way along the strokes
    flooded = watershed(np.zeros(piece.shape, np.uint8), seeds, mask=piece)  # type: ignore[no-untyped-call]
    return np.asarray(flooded - 1, dtype=np.int16)
