"""Measures a written page as with a ruler: slant, lines, gaps and sizes, and how much each of them varies.

The figures of a page are compared with the range of real pages: people vary in all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.values import Array
from handout_lab.score.hinge import legs
from handout_lab.score.written_lines import DPI, WrittenLine, ends_of_strokes, find_lines, find_words, ink, tops_over

_STRAIGHT = np.cos(np.radians(20.0))  # between the two legs of a piece of edge: sharper pieces are not straight
_STEM = np.radians(25.0)  # from the page's slant: edges that lean further are not those of stems
_FEW = 3  # strokes: a word with fewer gives no height and no foot
_MAD = 1.4826  # standard deviations in a median absolute deviation


@dataclass(frozen=True)
class PageStatistics:
    """Unit "x": the height of a small letter on this page.  Spreads are standard deviations.

    lines, words : how many were found.
    x_height : height of a small letter over the outside of its line, mm.
    tall : x, height above the baseline that one stroke in ten exceeds: ascenders and capitals.
    slant : rad, of stems, positive to the right of upright.
    slant_spread : rad, between words.
    size_spread : x, height of small letters between words.
    top_spread : x, heights of small letters within words.
    foot_spread : x, feet of letters within words, about the foot of the word.
    baseline_spread : x, feet of words about the baseline of their line, its slope and bend taken out.
    line_bend : x, root mean square distance of the middles of lines from the straight lines through their ends.
    line_slope : rad, mean; positive where lines fall.
    slope_spread : rad, between lines.
    word_gap : x, mean distance between the ink of neighbouring words at the height of small letters.
    word_gap_cv : standard deviation of that over its mean.
    left_edge : x, spread of the lines' beginnings about a straight margin (robust: indents do not count).
    margin_drift : rad, slant of that margin; positive where later lines begin further right.
    pitch : mm, mean distance of lines.
    pitch_cv : standard deviation of that over its mean.
    line_width : mm, twice the area of the ink over the length of its edge.
    width_cv : standard deviation over mean of the width along the middle of the strokes.
    tone_spread : of the darkness along the middle of the strokes; 1 is the difference of paper and ink.
    """

    lines: int
    words: int
    x_height: float
    tall: float
    slant: float
    slant_spread: float
    size_spread: float
    top_spread: float
    foot_spread: float
    baseline_spread: float
    line_bend: float
    line_slope: float
    slope_spread: float
    word_gap: float
    word_gap_cv: float
    left_edge: float
    margin_drift: float
    pitch: float
    pitch_cv: float
    line_width: float
    width_cv: float
    tone_spread: float


def page_statistics(grey: NDArray[np.uint8], dpi: float = DPI) -> PageStatistics:
    """Measure a page.

    Parameters
    ----------
    grey : (h, w) uint8, dark ink on light paper, lines running across.
    dpi : of the image; the method is made for 300.

    Raises
    ------
    InputError
        No written line can be told on the page.
    """
    mask = ink(grey)
    page = find_lines(mask)
    x, slant = page.x_height, page.slant
    lines = find_words(mask, page.lines, x, slant) if x > 0 else []
    if not lines:
        raise InputError(
            "No written line can be told on the page: it needs at least a line of dark ink on light paper."
        )
    points, lean = _edges(mask, x)
    low, high = ends_of_strokes(mask)
    mm = 25.4 / dpi
    return PageStatistics(
        lines=len(lines),
        words=sum(len(line.words) for line in lines),
        x_height=x * mm,
        slant=slant,
        slant_spread=_slant_spread(lines, points, lean, slant, x),
        **_heights(lines, high, slant, x),
        **_feet(lines, low, x),
        **_shape(lines, x),
        **_gaps(lines, x),
        **_margin(lines, x, mm),
        **_line(grey, mask, mm),
    )


def line_figures(
    grey: NDArray[np.uint8], mask: NDArray[np.bool_], line: WrittenLine, x_height: float, slant: float
) -> dict[str, float]:
    """Measures of a single line, named as in `PageStatistics`, without those that the layout decides.

    Parameters
    ----------
    grey, mask : (h, w) the line's picture and its own ink.
    line : with its words, pixels of that picture.
    x_height : pixels; slant : rad; of the page.
    """
    points, lean = _edges(mask, x_height)
    low, high = ends_of_strokes(mask)
    return {
        "slant_spread": _slant_spread([line], points, lean, slant, x_height),
        **_heights([line], high, slant, x_height),
        **_feet([line], low, x_height),
        **_gaps([line], x_height),
        **_line(grey, mask, 25.4 / DPI),
    }


def _edges(mask: NDArray[np.bool_], x_height: float) -> tuple[Array, Array]:
    """Straight pieces of edge: middles (n, 2), pixels, and lean (n,), rad to the right of upright."""
    here, ahead, behind = legs(mask, max(4, round(0.2 * x_height)))
    first, second = (ahead - here).astype(np.float64), (here - behind).astype(np.float64)
    length = np.hypot(*first.T) * np.hypot(*second.T)
    straight = (first * second).sum(axis=1) > _STRAIGHT * np.maximum(length, 1e-9)
    whole = (first + second)[straight]
    lean = np.arctan2(whole[:, 0], -whole[:, 1])
    return here[straight].astype(np.float64), (lean + np.pi / 2) % np.pi - np.pi / 2


def _slant_spread(lines: Sequence[WrittenLine], points: Array, lean: Array, slant: float, x: float) -> float:
    """Standard deviation between words of the mean lean of their stems."""
    stem = np.abs(lean - slant) < _STEM
    points, lean = points[stem], lean[stem]
    means = []
    for line in lines:
        height = line.base(points[:, 0]) - points[:, 1]
        near = (height > -0.3 * x) & (height < 1.8 * x)
        foot, slope = points[near, 0] - height[near] * np.tan(slant), lean[near]
        for a, b in line.words:
            inside = (foot >= a) & (foot <= b)
            if b - a > 1.5 * x and inside.sum() > 3 * x:
                means.append(float(slope[inside].mean()))
    return _sd(means)


def _heights(lines: Sequence[WrittenLine], high: Array, slant: float, x: float) -> dict[str, float]:
    words, within, tall = [], [], []
    for line in lines:
        at, height = tops_over(line, high, 3.2 * x)
        at = at - height * np.tan(slant)
        tall.append(height[height > 0.6 * x])
        small = (height > 0.65 * x) & (height < 1.45 * x)
        for a, b in line.words:
            tops = height[small & (at >= a) & (at <= b)] / x
            if len(tops) >= _FEW:
                words.append(float(np.median(tops)))
                within.append(tops - np.median(tops))
    return {
        "tall": float(np.percentile(np.concatenate(tall) / x, 90)) if tall and len(np.concatenate(tall)) else 0.0,
        "size_spread": _sd(words),
        "top_spread": _pooled(within),
    }


def _feet(lines: Sequence[WrittenLine], low: Array, x: float) -> dict[str, float]:
    words, within = [], []
    for line in lines:
        at, height = tops_over(line, low, 0.4 * x)
        for a, b in line.words:
            feet = height[(at >= a - 0.2 * x) & (at <= b)] / x
            if len(feet) >= _FEW:
                words.append(float(np.median(feet)))
                within.append(feet - np.median(feet))
    return {"foot_spread": _pooled(within), "baseline_spread": _sd(words)}


def _shape(lines: Sequence[WrittenLine], x: float) -> dict[str, float]:
    """Slopes and bends of the lines that are long enough to measure."""
    longest = max(line.length for line in lines)
    full = [line for line in lines if line.length > 0.6 * longest]
    slopes = [float(np.arctan(line.slope)) for line in full]
    bends = np.array([line.bend / x for line in full])
    return {
        "line_bend": float(np.sqrt(np.mean(bends**2))),
        "line_slope": float(np.mean(slopes)),
        "slope_spread": _sd(slopes),
    }


def _gaps(lines: Sequence[WrittenLine], x: float) -> dict[str, float]:
    gaps = [(b[0] - a[1]) / x for line in lines for a, b in zip(line.words, line.words[1:], strict=False)]
    gaps = [gap for gap in gaps if gap < 8]  # a wider one is a column, or a word that was not found
    mean = float(np.mean(gaps)) if gaps else 0.0
    return {"word_gap": mean, "word_gap_cv": _sd(gaps) / mean if mean else 0.0}


def _margin(lines: Sequence[WrittenLine], x: float, mm: float) -> dict[str, float]:
    """Left edge and distances of the lines."""
    left = np.array([line.words[0][0] for line in lines])
    at = float(np.median(left)) + 5 * x
    level = np.array([float(line.base(at)) for line in lines])
    drift, off = 0.0, left - np.median(left)
    if len(lines) > 2:
        i, j = np.triu_indices(len(lines), 1)
        drift = float(np.median((left[j] - left[i]) / (level[j] - level[i])))
        off = left - drift * level
    steps = np.diff(level)
    steps = steps[steps < 1.6 * np.median(steps)] if len(steps) else steps  # a larger one is a blank line
    pitch = float(steps.mean()) if len(steps) else 0.0
    return {
        "left_edge": _MAD * float(np.median(np.abs(off - np.median(off)))) / x,
        "margin_drift": float(np.arctan(drift)),
        "pitch": pitch * mm,
        "pitch_cv": _sd(steps) / pitch if pitch else 0.0,
    }


def _line(grey: NDArray[np.uint8], mask: NDArray[np.bool_], mm: float) -> dict[str, float]:
    """Width and darkness of the line itself."""
    import cv2

    outlines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    edge = sum(cv2.arcLength(contour, True) for contour in outlines)
    away = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    ridge = mask & (away >= cv2.dilate(away, np.ones((3, 3), np.uint8))) & (away >= 1)
    width, dark = away[ridge].astype(np.float64), 255.0 - grey[ridge]
    paper = 255.0 - float(np.median(grey[~mask]))
    contrast = float(np.median(dark)) - paper
    return {
        "line_width": 2 * float(mask.sum()) / max(edge, 1.0) * mm,
        "width_cv": float(width.std() / width.mean()) if len(width) else 0.0,
        "tone_spread": float(dark.std() / contrast) if contrast > 0 else 0.0,
    }


def _sd(values: Sequence[float] | Array) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else 0.0


def _pooled(parts: list[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else 0.0
