"""The line that the pen left: from a mask to a LineGraph with radius and density at every vertex.

Source: seed 000, §5.1.2; handwriting specification §5 (smoothing along the path, then back to the middle of the ink).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.scanning.density import Density
from handout.scanning.fitting import fitted, half_widths, lengthened
from handout.scanning.mask import Mask
from handout.scanning.page import Scan
from handout.scanning.skeleton import fill_holes, skeleton_graph
from handout.scanning.strands import apart
from handout.values import Array, Indices, LineGraph

_PULL, _TIMES, _LAST = 0.1, 20, 5  # of the smoothing, before and after centring: more draws loops in
_ROUNDS, _STEP = 3, 0.5  # of the way back to the middle, pixels
_FINE = 0.5  # pixels between samples across the line
# a disc of radius 1 in 19 points of equal area, for the mean over it
_RINGS = np.array(
    [(0.0, 0.0)]
    + [(0.5 * np.cos(a), 0.5 * np.sin(a)) for a in np.arange(6) * np.pi / 3]
    + [(0.85 * np.cos(a), 0.85 * np.sin(a)) for a in np.arange(12) * np.pi / 6]
)


def find_lines_of_ink(scan: Scan, mask: Mask, density: Density) -> LineGraph:
    """The line graph of a page.

    Returns
    -------
    LineGraph: `xy` and `radius` in mm on the page, `uv` in pixels of the scan (0 is the middle of the first pixel).
    """
    import cv2

    ink = fill_holes(mask.ink, scan.dpi)
    away = cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inside = np.asarray(away, dtype=np.float32)
    xy, edges = skeleton_graph(ink, inside)
    half = mask.stroke / 2
    import os
    mode = os.environ.get("MODE", "afl")
    if "a" in mode:
        xy, edges = apart(xy, edges, sampled(inside, xy) - 0.25, half)
    before, after = _along(edges, len(xy))
    xy = smoothed(xy, before, after, 5 if "f" in mode else 20)
    weight = np.where(ink, np.maximum(density.values, 0.02), 0).astype(np.float32)
    if "f" in mode:
        xy, halves = fitted(xy, edges, weight, ink.astype(np.float32), half)
    else:
        free = (before >= 0) & ~_at_junction(xy, edges, inside)
        xy = smoothed(_centred(xy, free, before, after, weight, inside), before, after, _LAST)
    if "l" in mode:
        xy, edges = lengthened(xy, edges, inside, halves)
    radius = np.maximum(sampled(inside, xy) - 0.5, 0.5)
    thick = _mean_within(density.values, xy, radius)
    # a pixel's middle lies half a pixel from its corner, and the page begins at the corner
    place = (xy + 0.5) * scan.pixel
    return LineGraph(place, radius * scan.pixel, np.clip(thick, 0, 2), xy, edges)


def _at_junction(xy: Array, edges: Indices, inside: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Vertices (n,) so near a junction that the ink across them is partly another stroke's."""
    from scipy.spatial import cKDTree

    junctions = xy[np.bincount(edges.ravel(), minlength=len(xy)) > 2]
    if not len(junctions):
        return np.zeros(len(xy), dtype=bool)
    away, _ = cKDTree(junctions).query(xy, distance_upper_bound=30.0)
    return np.asarray(away < sampled(inside, xy) + 1.0)


def smoothed(xy: Array, before: Indices, after: Indices, times: int = _TIMES) -> Array:
    """Vertices drawn towards the middle of their neighbours, ends and junctions pinned."""
    xy = xy.copy()
    inner = before >= 0
    b, a = before[inner], after[inner]
    for _ in range(times):
        xy[inner] += _PULL * (xy[b] + xy[a] - 2 * xy[inner])
    return xy


def sampled(image: NDArray[np.float32], xy: Array) -> Array:
    """Values (…,) of an image at places (…, 2) in pixels, bilinear."""
    import cv2

    flat = xy.reshape(-1, 2).astype(np.float32)
    values = np.empty(len(flat), dtype=np.float32)
    for start in range(0, len(flat), 30_000):  # remap takes no side above 32767
        part = flat[start : start + 30_000]
        found = cv2.remap(
            image, part[:, None, 0].copy(), part[:, None, 1].copy(), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        values[start : start + 30_000] = found[:, 0]
    return values.reshape(xy.shape[:-1]).astype(np.float64)


def _along(edges: Indices, count: int) -> tuple[Indices, Indices]:
    """The two neighbours of every vertex that has just two; −1 for the others."""
    both = np.concatenate([edges, edges[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    degree = np.bincount(both[:, 0], minlength=count)
    first = np.searchsorted(both[:, 0], np.arange(count))
    before, after = np.full(count, -1, dtype=np.intp), np.full(count, -1, dtype=np.intp)
    two = degree == 2
    before[two], after[two] = both[first[two], 1], both[first[two] + 1, 1]
    return before, after


def _centred(
    xy: Array,
    free: NDArray[np.bool_],
    before: Indices,
    after: Indices,
    weight: NDArray[np.float32],
    inside: NDArray[np.float32],
) -> Array:
    """The vertices that are `free` moved across the line to the middle of its ink, at most half a pixel a round."""
    xy = xy.copy()
    inner = np.flatnonzero(free)
    if not len(inner):
        return xy
    reach = sampled(inside, xy[inner]) + 1.5
    half = int(np.ceil(reach.max() / _FINE))
    steps = np.arange(-half, half + 1) * _FINE
    for _ in range(_ROUNDS):
        along = xy[after[inner]] - xy[before[inner]]
        along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        for part in np.array_split(np.arange(len(inner)), max(1, len(inner) * len(steps) // 2_000_000)):
            own = inner[part]
            found = sampled(weight, xy[own, None] + normal[part, None] * steps[:, None])
            found[np.abs(steps) > reach[part, None]] = 0
            found *= _unbroken(found > 0, half)
            total = np.maximum(found.sum(axis=1), 1e-9)
            off = np.clip(found @ steps / total, -_STEP, _STEP)
            xy[own] += off[:, None] * normal[part]
    return xy


def _unbroken(inky: NDArray[np.bool_], middle: int) -> NDArray[np.bool_]:
    """Where ink reaches without a gap from the middle column: a neighbouring line must not pull."""
    right = np.minimum.accumulate(inky[:, middle:], axis=1)
    left = np.minimum.accumulate(inky[:, middle::-1], axis=1)[:, ::-1]
    return np.concatenate([left[:, :-1], right], axis=1)


def _mean_within(values: NDArray[np.float32], xy: Array, radius: Array) -> Array:
    """Mean over the circle of each vertex."""
    return np.asarray(sampled(values, xy[:, None] + _RINGS * radius[:, None, None]).mean(axis=1))
