"""Brush strokes in a photograph or a scan: where they lie, how they run, and what of the picture is their ink.

A page may hold several strokes, and frames and numbers beside them: what is much thinner than the strokes is none of
them.  Light may fall unevenly.  Strokes that cannot be straightened (cut by the picture's edge, crossing, as short as
they are wide) are left out, each with a sentence.

Source: seed 004, §3.1 (mask, spine); the light, the parting from frames and the ends of the spine: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.libraries import csgraph, cv2, ndimage, sparse
from handout.scanning.skeleton import skeleton
from handout.values import Array

_COARSE = 700  # pixels: longer side of the picture in which strokes are looked for
_FITTED = 120  # pixels: longer side of the picture that the light is fitted to
_ROUNDS = 8  # of fitting the light to what is paper
_CLEAR, _SOLID = 0.12, 0.8  # of the ink's depth: paper's own grain, and paint that covers; seen on scanned acrylic
_FEWEST = 14  # pixels: no narrower stroke shows how its brush paints
_CONTRAST = 0.15  # of the light: what the ink must at least take away
_CLOSED, _OPENED = 0.3, 0.33  # half widths: gaps between streaks, and what is too thin to be a stroke
_THINNER = 0.35  # of the widest stroke's half width: what is narrower is a number or a note
_FILLED = (
    0.3  # of a stroke's shape that is ink: less is writing; set by eye, so that the driest of twenty strokes passes
)
_THICK = 0.12  # half widths: what is thicker is no line of a frame but streaks of a stroke
_THIN = (0.05, 0.15)  # widths: how thick a rest of a frame is at most, and how long at least
# half widths: a blur that joins streaks; cover of the driest part; half widths: how much wider the blur makes a solid
# edge; seen on the driest of twenty strokes
_STREAKY, _SPARSE, _SPREAD = 0.2, 0.08, 0.25
_RIM = 2.0  # pixels: of a line's edge
_STANDS_OUT = 0.4  # of a line's darkness: what lies beside it is lighter, where it passes through streaks
_BY = 0.12  # widths: nothing of a stroke lies further from its shape
_BRANCH = 1.0  # widths beside the longest way through a stroke: more is a second stroke
_BLOB = 1.3  # widths: what is shorter has no direction
_FORKED = 0.55  # widths from either end, where a middle line runs into the corners
_CALM = 0.35  # widths: deviation of the Gaussian that smooths the spine

_Mask = NDArray[np.bool_]
_Pixels = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class PhotographedStroke:
    """One stroke of a photograph.

    light : (h, w, 3) float32: the light that its ink lets pass, 1 for paper, in a window of the picture.
    density : (h, w) float32, 0–1: how much of the paper is covered.
    spine : (n, 2) float, pixels of the window: along the stroke's middle, past both of its ends.
    width : pixels.
    corner : (x, y) of the window in the picture, pixels.
    """

    light: _Pixels
    density: _Pixels
    spine: Array
    width: float
    corner: tuple[int, int] = (0, 0)


@dataclass(frozen=True, eq=False)
class Photograph:
    """The strokes of a photograph, and sentences on those that were left out."""

    strokes: tuple[PhotographedStroke, ...]
    left_out: tuple[str, ...] = field(default=())


def find_strokes(rgb: NDArray[np.uint8], source: str) -> Photograph:
    """The brush strokes of a picture (h, w, 3), from the top downwards.

    Raises InputError: there is no stroke, or none that can be used.
    """
    light = _evenly_lit(rgb)
    scale = min(1.0, _COARSE / max(light.shape[:2]))
    size = (max(1, round(light.shape[1] * scale)), max(1, round(light.shape[0] * scale)))
    small = np.asarray(cv2.resize(light, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    dark = _dark(small)
    solid, ink, half = _bodies(dark, source, scale)
    lines = _lines(dark, solid, half)
    # the strokes with their dry parts, whose streaks are too thin for `_bodies`, but near each other
    unframed = np.where(_frames(dark, lines, 1.0, 2 * half), np.float32(0), dark)
    cover = cv2.GaussianBlur(unframed, (0, 0), _STREAKY * half)
    wide = np.asarray(cover > _SPARSE).astype(np.uint8)
    back = cv2.erode(wide, _disc(_SPREAD * half)).astype(bool) | solid
    bodies = np.asarray(cv2.morphologyEx(back.astype(np.uint8), cv2.MORPH_OPEN, _disc(_OPENED * half)), dtype=bool)
    count, labelled, stats, _ = cv2.connectedComponentsWithStats(bodies.astype(np.uint8))
    labels = np.asarray(labelled, dtype=np.int32)
    clear = _frames(_dark(light), lines, scale, 2 * half)
    order = sorted(range(1, count), key=lambda k: int(stats[k, cv2.CC_STAT_TOP]))
    strokes, reasons = list[PhotographedStroke](), list[str]()
    for label in order:
        core = (labels == label) & solid
        if not core.any() or _distance(core).max() < _THINNER * half or ink[core].mean() < _FILLED:
            continue
        x, y = int(stats[label, cv2.CC_STAT_LEFT] / scale), int(stats[label, cv2.CC_STAT_TOP] / scale)
        found = _stroke(light, clear, labels, label, dark)
        if isinstance(found, str):
            reasons.append(f"{source}: the stroke at ({x}, {y}) {found}.")
        else:
            strokes.append(found)
    if not strokes:
        raise InputError(reasons[0] if reasons else f"{source}: there is no stroke in it.")
    return Photograph(tuple(strokes), tuple(f"{reason[:-1]}: left out." for reason in reasons))


def _evenly_lit(rgb: NDArray[np.uint8]) -> _Pixels:
    """(h, w, 3): the picture in shares of its paper's light, which may change over the picture as a parabola does.

    The parabola is fitted to what lies near or above it, over and over, so that ink drops out.
    """
    height, width = rgb.shape[:2]
    scale = min(1.0, _FITTED / max(height, width))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    small = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA).reshape(-1, 3).astype(np.float64) / 255
    at = _parabola(np.linspace(-1, 1, size[1])[:, None], np.linspace(-1, 1, size[0])[None]).reshape(-1, 6)
    luma = small.mean(axis=1)
    paper = luma >= np.median(luma)
    for _ in range(_ROUNDS):
        fitted = at @ np.linalg.lstsq(at[paper], small[paper], rcond=None)[0]
        away = luma - fitted.mean(axis=1)
        spread = max(float(np.sqrt((away[paper] ** 2).mean())), 0.004)
        paper = away > -2.5 * spread
    solved = np.linalg.lstsq(at[paper], small[paper], rcond=None)[0].astype(np.float32)
    whole = _parabola(np.linspace(-1, 1, height)[:, None], np.linspace(-1, 1, width)[None]).astype(np.float32)
    paper_light = np.maximum(whole @ solved, np.float32(0.05))
    return np.asarray(np.minimum(rgb.astype(np.float32) / (255 * paper_light), 1), dtype=np.float32)


def _parabola(y: Array, x: Array) -> Array:
    return np.stack(np.broadcast_arrays(np.ones_like(x * y), x, y, x * x, x * y, y * y), axis=-1)


def _dark(light: _Pixels) -> _Pixels:
    """(h, w): how much light the ink takes away, at most of any colour."""
    return np.asarray(1 - light.min(axis=2))


def _distance(mask: _Mask) -> _Pixels:
    """Pixels to the nearest that is not of the mask."""
    return np.asarray(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)


def _disc(radius: float) -> NDArray[np.uint8]:
    side = 2 * max(1, round(radius)) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)), dtype=np.uint8)


def _bodies(dark: _Pixels, source: str, scale: float) -> tuple[_Mask, _Mask, float]:
    """The strokes of a coarse picture as smooth shapes, its ink, and half the width of the widest, pixels."""
    grey = np.asarray(np.clip(dark * 255, 0, 255), dtype=np.uint8)
    level, _ = cv2.threshold(grey, 0, 255, cv2.THRESH_OTSU)
    threshold = max(level / 255, _CONTRAST / 2)
    ink = dark > threshold
    if not ink.any() or float(np.median(dark[ink])) < _CONTRAST:
        raise InputError(
            f"{source}: there is no stroke in it: nothing is clearly darker than its paper; photograph one stroke of "
            "dark paint on plain light paper."
        )
    body = ink
    for _ in range(2):  # the width is known once gaps are closed, and they are closed by the width
        half = float(_distance(body).max())
        rim = int(_CLOSED * half) + 2
        padded = cv2.copyMakeBorder(ink.astype(np.uint8), rim, rim, rim, rim, cv2.BORDER_REPLICATE)
        body = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, _disc(_CLOSED * half))[rim:-rim, rim:-rim].astype(bool)
    half = float(_distance(body).max())
    if 2 * half / scale < _FEWEST:
        raise InputError(
            f"{source}: there is no stroke in it: its lines are only {2 * half / scale:.0f} pixels wide, and a brush "
            f"shows from {_FEWEST} pixels; photograph it closer."
        )
    opened = cv2.morphologyEx(body.astype(np.uint8), cv2.MORPH_OPEN, _disc(_OPENED * half))
    return np.asarray(opened, dtype=bool), ink, half


class _RuledLine(NamedTuple):
    """A thin line, nearly level, or nearly upright (then x and y are exchanged): y = at + slope · x, pixels."""

    upright: bool
    at: float
    slope: float
    first: int
    last: int
    wide: float


def _lines(dark: _Pixels, bodies: _Mask, half: float) -> list[_RuledLine]:
    """The lines of frames in a coarse picture."""
    near = cv2.dilate(bodies.astype(np.uint8), _disc(0.08 * half)).astype(bool)
    # thicker by two pixels, since a line that is not quite level steps from row to row
    marks = cv2.dilate(((dark > _CONTRAST / 2) & ~near).astype(np.uint8), np.ones((3, 3), np.uint8))
    thick = max(6, round(_THICK * half))
    thin = cv2.subtract(marks, cv2.morphologyEx(marks, cv2.MORPH_OPEN, np.ones((thick, thick), np.uint8)))
    lines = list[_RuledLine]()
    for upright in (False, True):
        ink, found = (np.ascontiguousarray(each.T) if upright else each for each in (dark, thin))
        runs = cv2.morphologyEx(found, cv2.MORPH_OPEN, np.ones((2, max(5, round(1.6 * half))), np.uint8))
        count, labels = cv2.connectedComponents(runs)
        for label in range(1, count):
            y, x = np.nonzero(labels == label)
            weight = np.bincount(x - x.min(), ink[y, x])
            middle = np.bincount(x - x.min(), ink[y, x] * y) / np.maximum(weight, 1e-6)
            at = np.flatnonzero(weight > _CONTRAST / 2)
            if len(at) > 2:
                slope, start = np.polyfit(at + x.min(), middle[at], 1)
                wide = float(np.median(weight[at])) / float(np.percentile(ink[y, x], 90))
                lines.append(_RuledLine(upright, float(start), float(slope), int(x.min()), int(x.max()), wide))
    return lines


def _frames(dark: _Pixels, lines: Sequence[_RuledLine], scale: float, reach: float) -> _Mask:
    """What of a picture `scale` times as coarse as `lines` is theirs, up to `reach` beyond where they stand out."""
    gone = np.zeros(dark.shape, dtype=bool)
    for line in lines:
        ink, mask = (dark.T, gone.T) if line.upright else (dark, gone)
        x = np.arange(max(0, int((line.first - reach) / scale)), min(ink.shape[1], int((line.last + reach) / scale)))
        y = (line.at + line.slope * ((x + 0.5) * scale - 0.5) + 0.5) / scale - 0.5
        half = line.wide / scale / 2 + _RIM
        across = np.arange(-int(2 * half) - 2, int(2 * half) + 3)
        rows = np.clip(np.rint(y).astype(int) + across[:, None], 0, len(ink) - 1)
        inner = np.abs(across) <= half
        around = ink[rows, x]
        ridge = around[~inner].mean(axis=0) < _STANDS_OUT * around[inner].max(axis=0)
        theirs = ridge | ((x >= line.first / scale) & (x <= line.last / scale))
        mask[rows[inner][:, theirs], x[theirs]] = True
    return gone


def _stroke(
    light: _Pixels, clear: _Mask, labels: NDArray[np.int32], label: int, dark: _Pixels
) -> PhotographedStroke | str:
    """The stroke of a component of a coarse picture, or what is wrong with it."""
    body, scale = labels == label, dark.shape[1] / light.shape[1]
    if body[0].any() or body[-1].any() or body[:, 0].any() or body[:, -1].any():
        return "is cut by the edge of the picture: leave some paper all around it"
    way = _longest_way(body)
    if isinstance(way, str):
        return way
    spine, width = _smooth_spine(way, body, dark)
    if len(spine) == 0:
        return "is as wide as it is long and shows no direction: paint a longer one"
    y, x = np.nonzero(body)
    reach = 0.8 * width
    low = np.floor(np.maximum([x.min() - reach, y.min() - reach], 0) / scale).astype(int)
    high = np.ceil(np.array([x.max() + reach, y.max() + reach]) / scale).astype(int) + 1
    window = np.s_[low[1] : high[1], low[0] : high[0]]
    others = ((labels > 0) & ~body).astype(np.uint8)
    near = np.asarray(cv2.dilate(body.astype(np.uint8), _disc(0.45 * width))) > cv2.dilate(others, _disc(0.1 * width))
    own = cv2.resize(near.astype(np.uint8), light.shape[1::-1], interpolation=cv2.INTER_LINEAR)[window] > 0
    part = light[window]
    # how far each pixel is from paper towards the colour of the stroke's solid ink, 0–1
    inked = (1 - part)[cv2.resize(body.astype(np.uint8), light.shape[1::-1])[window] > 0]
    axis = np.median(inked[inked.max(axis=1) >= np.percentile(inked.max(axis=1), 70)], axis=0)
    depth = (1 - part) @ (axis / max(float(axis @ axis), 1e-6))
    density = np.asarray(np.clip((depth - _CLEAR) / (_SOLID - _CLEAR), 0, 1), dtype=np.float32)
    beside = cv2.dilate(body.astype(np.uint8), _disc(_BY * width))
    by = np.asarray(cv2.resize(beside, light.shape[1::-1], interpolation=cv2.INTER_NEAREST)[window] > 0)
    density = np.where(own & ~clear[window], density, 0)
    # what lies apart from the stroke is not of it: level and upright rests of a frame, and numbers
    count, pieces, stats, _ = cv2.connectedComponentsWithStats((density > _CLEAR).astype(np.uint8))
    sides = np.sort(np.asarray(stats)[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]], axis=1) / (width / scale)
    gone = (sides[:, 0] < _THIN[0]) & (sides[:, 1] > _THIN[1]) | (np.bincount(pieces[by], minlength=count) == 0)
    gone[0] = False
    density[gone[pieces]] = 0
    line = (spine + 0.5) / scale - 0.5 - low
    return PhotographedStroke(
        part, np.asarray(density, dtype=np.float32), line, width / scale, (int(low[0]), int(low[1]))
    )


def _longest_way(body: _Mask) -> Array | str:
    """(n, 2) float: the longest of the shortest ways through a shape's middle line, or why there is none.

    Source: seed 004, §3.1; the two searches of a tree's diameter.
    """
    xy, edges = skeleton(body)
    if not len(edges):
        y, x = np.nonzero(body)
        return np.asarray(np.stack([x, y], axis=1).mean(axis=0, keepdims=True))
    length = np.linalg.norm(xy[edges[:, 0]] - xy[edges[:, 1]], axis=1)
    graph = sparse.coo_matrix((length, tuple(edges.T)), shape=(len(xy), len(xy)))
    away = csgraph.dijkstra(graph, directed=False, indices=0)
    start = int(np.where(np.isfinite(away), away, -1).argmax())
    away, before = csgraph.dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    here = int(np.where(np.isfinite(away), away, -1).argmax())
    way = [here]
    while here != start:
        here = int(before[here])
        way.append(here)
    width = 2 * float(np.median(_distance(body)[tuple(np.rint(xy[way]).astype(int).T[::-1])]))
    # how far the middle line leads away from the way through it
    apart = csgraph.dijkstra(graph, directed=False, indices=np.array(way), min_only=True)
    if float(apart[np.isfinite(apart)].max()) > _BRANCH * width:
        return "crosses itself or another: photograph strokes that lie apart"
    return np.asarray(xy[way])


def _smooth_spine(way: Array, body: _Mask, dark: _Pixels) -> tuple[Array, float]:
    """A smooth line along a shape and past its ends, one point a pixel, and the shape's width; no points for a blob."""
    y, x = np.nonzero(body)
    at = np.stack([x, y], axis=1).astype(np.float64)
    width = 2 * float(np.percentile(_distance(body)[body], 98))
    cut = round(_FORKED * width)
    line = _resample_line(way) if len(way) > 1 else way
    if len(line) > 2 * cut + 0.4 * width:
        line = line[cut:-cut]
        half = max(2, round(_CALM * width))
        ends = [2 * line[0] - line[half:0:-1], line, 2 * line[-1] - line[-2 : -half - 2 : -1]]
        line = ndimage.gaussian_filter1d(np.concatenate(ends), _CALM * width, axis=0, mode="nearest")
        line = line[len(ends[0]) : -len(ends[2]) or None]
    else:  # as short as this, its streaks tell its direction better than its shape
        # the streaks and the long edges of a stroke run across the mean gradient, whose angle is doubled
        soft = cv2.GaussianBlur(np.where(body, dark, 0), (0, 0), max(0.5, 0.02 * width))
        gradient = cv2.Sobel(soft, cv2.CV_32F, 1, 0) + 1j * cv2.Sobel(soft, cv2.CV_32F, 0, 1)
        angle = float(np.angle((gradient**2).sum())) / 2 + np.pi / 2
        line = at.mean(axis=0) + np.linspace(-0.1, 0.1, 5)[:, None] * width * np.array([np.cos(angle), np.sin(angle)])
    step = max(2, round(0.4 * width))
    line = _resample_line(line)
    out = [line[k] - line[m] for k, m in ((0, min(step, len(line) - 1)), (-1, max(-step - 1, -len(line))))]
    out = [v / max(float(np.hypot(*v)), 1e-9) for v in out]
    far = np.arange(1, round(1.6 * width))[:, None]
    line = np.concatenate([line[0] + far[::-1] * out[0], line, line[-1] + far * out[1]])
    rows = np.rint(line).astype(int)
    fits = np.all((rows >= 0) & (rows < body.shape[::-1]), axis=1)
    inside = body[tuple(rows[fits].T[::-1])]
    return (line if np.count_nonzero(inside) >= _BLOB * width else np.zeros((0, 2))), width


def _resample_line(line: Array, step: float = 1.0) -> Array:
    """The line with points `step` apart."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    keep = np.concatenate([[True], np.diff(along) > 1e-9])
    at = np.arange(0, along[-1] + 1e-9, step)
    return np.stack([np.interp(at, along[keep], line[keep, k]) for k in (0, 1)], axis=1)
