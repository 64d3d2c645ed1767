"""The line that the pen left: from a mask to a `LineGraph` with radius and density at every vertex.

The middle of the line is fitted to the ink across it and to its own smoothness, through crossings and to its ends.
Where a line runs alone its middle is that of its ink.  Where it has run into another stroke, or into itself in a tight
turn, only one of its edges is its own: the middle lies half a width from that edge.  Where neither edge is its own,
the line goes on as it came.

Source: seed 000, §5.1.2; the fit: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches
from handout.libraries import cv2, sparse
from handout.scanning.density import Density
from handout.scanning.mask import Mask
from handout.scanning.scan import Scan
from handout.scanning.skeleton import fill_holes, separate_strokes, skeleton, without_spurs
from handout.values import Array, Indices, LineGraph

_COARSE = 0.25  # pixels: what whole pixels add to the distance from the edge
# a disc of radius 1 in 19 points of equal area, for the mean over it
_RINGS = np.array(
    [(0.0, 0.0)]
    + [(0.5 * np.cos(a), 0.5 * np.sin(a)) for a in np.arange(6) * np.pi / 3]
    + [(0.85 * np.cos(a), 0.85 * np.sin(a)) for a in np.arange(12) * np.pi / 6]
)


@dataclass(frozen=True)
class LineFitSettings:
    """How the middle of a line is fitted to its ink; compared on simulated pages by benchmarks/reading.py."""

    alone: float = 1.3  # times the usual width: wider ink is not one line's
    edge: float = 2.2  # half widths: an edge farther off is not this line's
    level: float = 0.5  # half widths: where both edges are about as far, the line lies between them
    rounds: int = 4  # of the fit
    sample: float = 0.5  # pixels between samples across the line
    step: float = 2.0  # pixels that a vertex moves in a round, at most
    stiff: float = 0.45  # half widths: shorter waves of the line are smoothed away
    hold: float = 0.05  # weight of the place before; the middle of two edges has 1
    one_edge: float = 0.7  # weight of a middle that is known from one edge
    straight: float = -0.7  # greatest cosine between two paths that go on as one line through a junction
    pull: float = 0.1  # of the smoothing before the fit, which only the normals need
    even_rounds: int = 5  # of that
    end: float = 0.5  # half widths by which ink reaches beyond the pen's way at a free end


_FIT = LineFitSettings()


def find_line_graph(scan: Scan, mask: Mask, density: Density) -> LineGraph:
    """The line graph of a page.

    Its `xy` and `radius` are in mm on the page, `uv` in pixels of the scan (0 is the middle of the first pixel).
    """
    ink = fill_holes(mask.ink, scan.dpi)
    away = cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inside = np.asarray(away, dtype=np.float32)
    xy, edges = skeleton(ink)
    half = mask.stroke / 2
    # a spur may be the end of two strokes that have run into one another: it goes when they have been taken apart
    xy, edges = without_spurs(*separate_strokes(xy, edges, sample_image(inside, xy) - _COARSE, half), inside)
    weight = np.where(ink, np.maximum(density.values, 0.02), 0).astype(np.float32)
    xy, half_width = fitted_to_ink(even_vertices(xy, edges), edges, weight, ink.astype(np.float32), half)
    # what lies beyond the picture is not known: smoothing must not move a line that runs off its edge out there
    xy, edges = lengthen_ends(clip_places(xy, ink.shape), edges, inside, half_width)
    xy = clip_places(xy, ink.shape)
    radius = np.maximum(sample_image(inside, xy) - 0.5, 0.5)
    thick = mean_within(density.values, xy, radius)
    # a pixel's middle lies half a pixel from its corner, and the page begins at the corner
    place = (xy + 0.5) * scan.pixel
    return LineGraph(place, radius * scan.pixel, np.clip(thick, 0, 2), xy, edges)


def mean_within(values: NDArray[np.float32], xy: Array, radius: Array) -> Array:
    """(n,) float: mean of `values` over the circle of each vertex, of places and radii in pixels."""
    return np.asarray(sample_image(values, xy[:, None] + _RINGS * radius[:, None, None]).mean(axis=1))


def half_widths(measured: Array, edges: Indices, count: int, usual: float) -> Array:
    """(n,): half the width of the line of each vertex, measured on the parts of its branch where it runs alone."""
    half = np.full(count, usual)
    degree = np.bincount(edges.ravel(), minlength=count)
    for path in branches(edges, count):
        alone = degree[path] == 2
        for at in (0, -1):
            if degree[path[at]] > 2:
                clear = int(3 * usual) + 1
                alone[slice(0, clear) if at == 0 else slice(-clear, None)] = False
        if alone.sum() >= 4 * usual:
            half[path[degree[path] <= 2]] = np.clip(np.median(measured[path][alone]), 0.5 * usual, 1.4 * usual)
    return half


def fitted_to_ink(
    xy: Array, edges: Indices, weight: NDArray[np.float32], ink: NDArray[np.float32], usual: float
) -> tuple[Array, Array]:
    """Places (n, 2), pixels, of the vertices of a graph, fitted to ink, and half the width (n,) of their lines.

    weight : (h, w) float32: how much ink a pixel has, 0 outside the mask.
    ink : (h, w) float32: 1 in the mask, 0 outside.
    usual : half the usual width of a line, pixels.
    """
    count = len(xy)
    bends = _bends(xy, edges, usual)
    before, after = _find_neighbours(edges, count)
    inner = np.flatnonzero(before >= 0)
    half = np.full(count, usual)
    for round_ in range(_FIT.rounds):
        way = xy[after[inner]] - xy[before[inner]]
        way /= np.maximum(np.linalg.norm(way, axis=1), 1e-9)[:, None]
        normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
        right, left, centre = _measure_across(xy[inner], normal, usual, weight, ink)
        if not round_:
            measured = np.full(count, usual)
            measured[inner] = (right + left) / 2
            half = half_widths(measured, edges, count, usual)
        offset, weight_of_offset = _middle(right, left, centre, half[inner])
        xy = _solve_places(xy, inner, normal, offset, weight_of_offset, bends, _FIT.stiff * usual)
    return xy, half


def even_vertices(xy: Array, edges: Indices) -> Array:
    """Vertices drawn towards the middle of their neighbours: without the steps of whole pixels."""
    xy = xy.copy()
    before, after = _find_neighbours(edges, len(xy))
    inner = before >= 0
    for _ in range(_FIT.even_rounds):
        xy[inner] += _FIT.pull * (xy[before[inner]] + xy[after[inner]] - 2 * xy[inner])
    return xy


def _find_neighbours(edges: Indices, count: int) -> tuple[Indices, Indices]:
    """The two neighbours of every vertex that has just two; −1 for the others."""
    both = np.concatenate([edges, edges[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    degree = np.bincount(both[:, 0], minlength=count)
    first = np.searchsorted(both[:, 0], np.arange(count))
    before, after = np.full(count, -1, dtype=np.intp), np.full(count, -1, dtype=np.intp)
    two = degree == 2
    before[two], after[two] = both[first[two], 1], both[first[two] + 1, 1]
    return before, after


def sample_image(image: NDArray[np.float32], xy: Array) -> Array:
    """Values (…,) of an image at places (…, 2) in pixels, bilinear."""
    flat = xy.reshape(-1, 2).astype(np.float32)
    values = np.empty(len(flat), dtype=np.float32)
    for start in range(0, len(flat), 30_000):  # remap takes no side above 32767
        part = flat[start : start + 30_000]
        remapped = cv2.remap(
            image, part[:, None, 0].copy(), part[:, None, 1].copy(), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        values[start : start + 30_000] = remapped[:, 0]
    return values.reshape(xy.shape[:-1]).astype(np.float64)


def _bends(xy: Array, edges: Indices, usual: float) -> Indices:
    """(k, 3): vertices that follow each other on a line, through junctions too where two paths go straight on."""
    before, after = _find_neighbours(edges, len(xy))
    inner = np.flatnonzero(before >= 0)
    within = np.stack([before[inner], inner, after[inner]], axis=1)
    ends: dict[int, list[Indices]] = {}
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    for path in branches(edges, len(xy)):
        for way in (path, path[::-1]):
            if len(way) > 1 and degree[way[0]] > 2:
                ends.setdefault(int(way[0]), []).append(way)
    through = [triple for ways in ends.values() for triple in _pair_paths(xy, ways, usual)]
    return np.concatenate([within, np.array(through, dtype=np.intp).reshape(-1, 3)])


def _pair_paths(xy: Array, ways: list[Indices], usual: float) -> list[tuple[int, int, int]]:
    """The pairs of paths from one junction that go on as one line, straightest first."""
    far_ends = [way[min(len(way) - 1, int(4 * usual) + 1)] for way in ways]
    near_ends = [way[min((len(way) - 1) // 2, int(1.5 * usual) + 1)] for way in ways]
    directions = xy[far_ends] - xy[near_ends]
    directions /= np.maximum(np.linalg.norm(directions, axis=1), 1e-9)[:, None]
    cosine = directions @ directions.T
    pairs = sorted((float(cosine[i, j]), i, j) for i in range(len(ways)) for j in range(i))
    pairs_through: list[tuple[int, int, int]] = []
    paired: set[int] = set()
    for value, i, j in pairs:
        if value < _FIT.straight and not paired & {i, j}:
            paired |= {i, j}
            pairs_through.append((int(ways[i][1]), int(ways[i][0]), int(ways[j][1])))
    return pairs_through


def _measure_across(
    xy: Array, normal: Array, usual: float, weight: NDArray[np.float32], ink: NDArray[np.float32]
) -> tuple[Array, Array, Array]:
    """(n,) how far ink reaches on either side, and (n,) where its middle lies; pixels."""
    reach = int(np.ceil((3.5 * usual + 1) / _FIT.sample))
    steps = np.arange(-reach, reach + 1) * _FIT.sample
    right, left, centre = np.zeros((3, len(xy)))
    for part in np.array_split(np.arange(len(xy)), max(1, len(xy) * len(steps) // 2_000_000)):
        places = xy[part, None] + normal[part, None] * steps[:, None]
        inky = sample_image(ink, places)
        # where ink reaches without a gap from the middle column, so that a neighbouring line does not pull
        ahead = np.minimum.accumulate(inky[:, reach:] > 0, axis=1)
        behind = np.minimum.accumulate(inky[:, reach::-1] > 0, axis=1)[:, ::-1]
        inky *= np.concatenate([behind[:, :-1], ahead], axis=1)
        weights = sample_image(weight, places) * (inky > 0)
        middle = inky[:, reach] / 2
        right[part] = (inky[:, reach + 1 :].sum(axis=1) + middle) * _FIT.sample
        left[part] = (inky[:, :reach].sum(axis=1) + middle) * _FIT.sample
        centre[part] = weights @ steps / np.maximum(weights.sum(axis=1), 1e-9)
    return right, left, centre


def _middle(right: Array, left: Array, centre: Array, half: Array) -> tuple[Array, Array]:
    """(n,) how far across the line its middle lies, pixels, and (n,) the weight of that."""
    width = right + left
    alone = (width < 2 * _FIT.alone * half) & (width > 0)
    nearer = np.minimum(right, left)
    bound = ~alone & (nearer < _FIT.edge * half) & (width > 0)
    level = np.abs(right - left) < _FIT.level * half
    edge = np.where(level, (right - left) / 2, np.where(right < left, right - half, half - left))
    # the ink's weight and its edges are both uncertain, by grain within the line and along it
    between = (centre + (right - left) / 2) / 2
    offset = np.where(alone, between, np.where(bound, edge, 0.0))
    return np.clip(offset, -_FIT.step, _FIT.step), np.where(alone, 1.0, np.where(bound, _FIT.one_edge, 0.0))


def _solve_places(
    xy: Array, inner: Indices, normal: Array, offset: Array, sure: Array, bends: Indices, stiff: float
) -> Array:
    """The places that are nearest to the middles found and bend least: one sparse linear system."""
    from scipy.sparse.linalg import splu

    n = len(xy)
    rows = np.repeat(np.arange(len(bends)), 3)
    second = sparse.coo_matrix((np.tile([1.0, -2.0, 1.0], len(bends)), (rows, bends.ravel())), shape=(len(bends), n))
    bend = (stiff**4 * (second.T @ second)).tocoo()
    x, y = normal.T
    anchors = np.full(n, _FIT.hold)
    parts = [
        (np.concatenate([anchors, anchors]), np.arange(2 * n), np.arange(2 * n)),
        (bend.data, bend.row, bend.col),
        (bend.data, bend.row + n, bend.col + n),
        (sure * x * x, inner, inner),
        (sure * y * y, inner + n, inner + n),
        (sure * x * y, inner, inner + n),
        (sure * x * y, inner + n, inner),
    ]
    data, row, col = (np.concatenate(column) for column in zip(*parts, strict=True))
    matrix = sparse.coo_matrix((data, (row, col)), shape=(2 * n, 2 * n)).tocsc()
    goal = _FIT.hold * xy.T.ravel()
    targets = (xy[inner] * normal).sum(axis=1) + offset
    np.add.at(goal, inner, sure * x * targets)
    np.add.at(goal, inner + n, sure * y * targets)
    return np.asarray(splu(matrix).solve(goal)).reshape(2, n).T


def clip_places(xy: Array, shape: tuple[int, int]) -> Array:
    """Places (n, 2), pixels, those outside a picture (h, w) moved to its edge."""
    height, width = shape
    return np.asarray(np.clip(xy, -0.5, (width - 0.5, height - 0.5)))


def lengthen_ends(xy: Array, edges: Indices, inside: NDArray[np.float32], half: Array) -> tuple[Array, Indices]:
    """The graph with its free ends drawn on, straight, to where the pen was when its ink began or ended.

    A line that runs out of the picture ends at the picture's edge.
    """
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    places, pairs, count = [xy], [edges], len(xy)
    for path in branches(edges, len(xy)):
        for way in (path, path[::-1]):
            if len(way) < 3 or degree[way[0]] != 1:
                continue
            r = float(half[way[0]])
            back = way[min(len(way) - 1, max(2, int(2 * r)))]
            to = xy[way[0]] - xy[back]
            to /= max(float(np.hypot(*to)), 1e-9)
            steps = np.arange(0, 3 * r, 0.25)
            ahead = xy[way[0]] + steps[:, None] * to
            off = (ahead != clip_places(ahead, inside.shape)).any(axis=1)  # the picture, where there still is ink
            out = off | (sample_image(inside, ahead) < 0.5)
            far = float(steps[out.argmax()]) - (0.0 if off[out.argmax()] else _FIT.end * r) if out.any() else 0.0
            if far < 0.25:
                continue
            parts = max(1, round(far))
            new = xy[way[0]] + np.linspace(0, far, parts + 1)[1:, None] * to
            row = np.concatenate([[way[0]], np.arange(count, count + parts)])
            places.append(new)
            pairs.append(np.stack([row[:-1], row[1:]], axis=1))
            count += parts
    return np.concatenate(places), np.concatenate(pairs)
