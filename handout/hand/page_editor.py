"""A page of a hand while it is being corrected: ink painted or taken away, lines cut and joined.

Each function takes a page and gives the new one with where its vertices have gone, (n,) int, −1 for those that are no
more.  Ink that is painted has a line, along the brush, so that it can be a letter's; its colour and opacity are the
page's usual ones where the scan had none.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedPage, Texture
from handout.libraries import csgraph, cv2, sparse, spatial
from handout.values import Array, Indices, LineGraph


@dataclass(frozen=True)
class PaintSettings:
    """Lengths in pixels unless said otherwise; set by eye on real pages."""

    step: float = 1.5  # between the vertices of painted ink: about as far as those of a page
    touch: float = 1.5  # beyond both half widths, within which an end of painted ink joins a line
    soft: int = 16  # parts of a pixel in which brushes are placed
    level: float = 20.0  # degrees by which a stroke may deviate from a rule and still be of it
    even: float = 0.5  # share of the length of a corrected rule that another row of the page must have to be its like
    bin: float = 1.0  # mm along a rule within which one stroke is enough
    rim: int = 4  # around the page, in which ink may lie that runs off it
    nearest: int = 24  # vertices that a place may mean
    gap: float = 2.0  # times as far counts a straight way where there is no line
    own: tuple[float, float] = (1.5, 0.35)  # half widths to a stroke's middle, share of its opacity at a stroke's edge
    around: int = 4  # vertices on either side, between which a stroke's direction is taken


_SETTINGS = PaintSettings()


class PaintError(Exception):
    """A page cannot be painted so; its text says why."""


@dataclass(frozen=True, eq=False)
class Cover:
    """What lies under a brush, or inside a polygon: a part of a page's picture, and 0–255 in each of its pixels.

    corner : (x, y) of its first pixel; it may lie off the page, and reach beyond it.
    """

    corner: tuple[int, int]
    values: NDArray[np.uint8]

    def overlap(self, corner: tuple[int, int], shape: tuple[int, int]) -> tuple[tuple[slice, slice], NDArray[np.uint8]]:
        """Which rows and columns of a picture (h, w) that begins at `corner` it covers, and its values there."""
        (x, y), (height, width) = corner, shape
        left, top = self.corner
        rows = slice(min(max(top - y, 0), height), min(max(top - y + len(self.values), 0), height))
        columns = slice(min(max(left - x, 0), width), min(max(left - x + self.values.shape[1], 0), width))
        down, across = y - top, x - left
        return (rows, columns), self.values[
            rows.start + down : rows.stop + down, columns.start + across : columns.stop + across
        ]

    def covers_places(self, uv: Array) -> NDArray[np.bool_]:
        """(n,) whether it covers places (n, 2) of the page."""
        height, width = self.values.shape
        column, row = (np.rint(uv).astype(np.intp) - self.corner).T
        inside = np.flatnonzero((column >= 0) & (row >= 0) & (column < width) & (row < height))
        covered = np.zeros(len(uv), dtype=bool)
        covered[inside] = self.values[row[inside], column[inside]] > 0
        return covered


def brush(page: ScannedPage, places: Sequence[tuple[float, float]], width: float) -> Cover:
    """The cover of a brush `width` pixels wide along places of a page's picture."""
    thick = max(1, round(width))
    cover, way = _room(page, places, thick)
    soft = np.rint(way * _SETTINGS.soft).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(cover.values, [soft], False, 255, thick, cv2.LINE_AA, shift=int(np.log2(_SETTINGS.soft)))
    return cover


def fill_polygon(page: ScannedPage, places: Sequence[tuple[float, float]]) -> Cover:
    """The cover of a polygon of a page's picture."""
    cover, way = _room(page, places, 1)
    cv2.fillPoly(cover.values, [np.rint(way).astype(np.int32).reshape(-1, 1, 2)], 255)
    return cover


def _room(page: ScannedPage, places: Sequence[tuple[float, float]], over: int) -> tuple[Cover, Array]:
    """An empty cover of places on a page, and as much more on each side, with the places in it."""
    way = np.array(places, dtype=np.float64)
    least, most = -_SETTINGS.rim, np.array(page.shape[::-1]) + _SETTINGS.rim
    low = np.clip(np.floor(way.min(axis=0)) - over, least, most - 1).astype(int)
    high = np.clip(np.ceil(way.max(axis=0)) + over + 1, low + 1, most).astype(int)
    return Cover((int(low[0]), int(low[1])), np.zeros((high - low)[::-1], dtype=np.uint8)), way - low


def as_paper(page: ScannedPage, cover: Cover) -> tuple[ScannedPage, Indices]:
    """The page without the ink under `cover`. Raises PaintError: there is none."""
    gone = cover.covers_places(page.graph.uv)
    part, values = cover.overlap(page.texture.corner, page.texture.shape)
    if not gone.any() and not (page.texture.alpha[part][values > 0] > 0).any():
        raise PaintError("there is no ink")
    pixels = page.texture.pixels.copy()
    pixels[part][values > 0] = 0
    return drop_vertices(replace(page, texture=with_texture(page.texture, pixels)), gone)


def as_ink(page: ScannedPage, places: Sequence[tuple[float, float]], width: float) -> tuple[ScannedPage, Indices]:
    """The page with ink along `places`, `width` pixels wide."""
    way = np.array(places, dtype=np.float64)
    if len(way) < 2:
        way = np.array([way[0], way[0] + 0.5])
    far = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))]
    count = max(2, int(np.ceil(far[-1] / _SETTINGS.step)) + 1)
    uv = np.column_stack([np.interp(np.linspace(0, far[-1], count), far, way[:, k]) for k in (0, 1)])
    # the texture with ink under a cover, its box wide enough for that
    cover = brush(page, places, width)
    texture = wide_enough(page, cover)
    part, values = cover.overlap(texture.corner, texture.shape)
    colour, opacity = usual_ink(page)
    under = texture.pixels[part].copy()
    alpha = (values * (opacity / 255)).astype(np.uint8)
    under[(alpha > under[:, :, 3]) & (under[:, :, 3] == 0), :3] = colour
    under[:, :, 3] = np.maximum(under[:, :, 3], alpha)
    pixels = texture.pixels.copy()
    pixels[part] = under
    return _with_line(replace(page, texture=with_texture(texture, pixels)), uv, width / 2)


def without_rule(
    page: ScannedPage, a: tuple[float, float], b: tuple[float, float], width: float
) -> tuple[ScannedPage, Indices, int]:
    """The page without a printed rule from `a` to `b` that was taken for ink, and without its likes on other rows.

    Strokes that cross it stay.  The third value is how many rules went.

    Raises PaintError: no stroke runs along there.
    """
    from handout.branching import branches

    start, along = np.array(a), np.array(b) - np.array(a)
    length = float(np.linalg.norm(along))
    if length < width:
        raise PaintError("a rule is longer than it is wide")
    along /= length
    uv = page.graph.uv
    away = (uv - start) @ np.array([-along[1], along[0]])
    place = (uv - start) @ along
    # (n, 2) unit: the direction of the line at every vertex, between those some edges away on both sides
    directions = np.zeros((len(page.graph), 2))
    for path in branches(page.graph.edges, len(page.graph)):
        at = np.arange(len(path))
        ahead, behind = (np.clip(at + by, 0, len(path) - 1) for by in (_SETTINGS.around, -_SETTINGS.around))
        directions[path] = page.graph.uv[path[ahead]] - page.graph.uv[path[behind]]
    directions /= np.maximum(np.linalg.norm(directions, axis=1), 1e-9)[:, None]
    level = np.abs(directions @ along) > np.cos(np.radians(_SETTINGS.level))
    on = level & (np.abs(away) <= width / 2) & (place >= -width) & (place <= length + width)
    least = _count_bins(place[on], page.pixel)
    if not least:
        raise PaintError("no stroke runs along there")
    rows = np.rint(away / width).astype(int)
    likes = {0}
    for row in set(rows[level].tolist()) - {0}:
        if _count_bins(place[level & (rows == row)], page.pixel) >= _SETTINGS.even * least:
            likes.add(row)
    gone = on | (level & np.isin(rows, sorted(likes - {0})))
    cover = line_alone(page.graph, gone, page.shape, page.pixel)
    x, y = page.texture.corner
    height, wide = page.texture.shape
    pixels = page.texture.pixels.copy()
    pixels[cover[y : y + height, x : x + wide]] = 0
    page = replace(page, texture=with_texture(page.texture, pixels))
    changed, number = drop_vertices(page, gone)
    return changed, number, len(likes)


def own_ink(page: ScannedPage, rows: slice, columns: slice) -> NDArray[np.bool_]:
    """(h, w) where a part of a page has ink that has a line: as far as its opacity is that of its own stroke."""
    shape = (rows.stop - rows.start, columns.stop - columns.start)
    alpha = np.zeros(shape, dtype=np.uint8)
    here, values = Cover((columns.start, rows.start), alpha).overlap(page.texture.corner, page.texture.shape)
    values[:] = page.texture.alpha[here]
    size = 2 * max(1, round(_SETTINGS.own[0] * usual_half(page))) + 1
    middle = cv2.dilate(alpha, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
    ink = (alpha > 0) & (alpha >= _SETTINGS.own[1] * middle)
    _, labels = cv2.connectedComponents(ink.astype(np.uint8), connectivity=8)
    column, row = np.rint(page.graph.uv - (columns.start, rows.start)).astype(np.intp).T
    inside = (column >= 0) & (row >= 0) & (column < shape[1]) & (row < shape[0])
    lined = np.zeros(int(labels.max()) + 1, dtype=bool)
    lined[labels[row[inside], column[inside]]] = True
    lined[0] = False
    return np.asarray(lined[labels])


def usual_half(page: ScannedPage) -> float:
    """Half the usual width of a page's strokes, pixels."""
    return max(1.0, float(np.median(page.graph.radius)) / page.pixel) if len(page.graph) else 1.0


def line_alone(graph: LineGraph, some: NDArray[np.bool_], shape: tuple[int, int], pixel: float) -> NDArray[np.bool_]:
    """(h, w): mask of the slightly thickened line of some vertices (n,), without the lines of others.

    shape : (height, width) of the picture, pixels; pixel : mm, its side.
    """
    alone = np.zeros(shape, dtype=bool)
    if not some.any():
        return alone
    # circles are drawn one by one: only those near are
    room = float(graph.radius.max()) / pixel + _SETTINGS.touch + 2
    low = np.maximum(np.floor(graph.uv[some].min(axis=0) - room), 0).astype(int)
    high = np.ceil(graph.uv[some].max(axis=0) + room).astype(int) + 1
    near = ((graph.uv >= low - room) & (graph.uv <= high + room)).all(axis=1)
    part = alone[low[1] : high[1], low[0] : high[0]]
    own, others = (_discs(graph, which & near, low, part.shape, pixel) for which in (some, ~some))
    part[:] = own & ~others
    return alone


def on_baseline(page: ScannedPage, line: int, a: tuple[float, float], b: tuple[float, float]) -> ScannedPage:
    """The page with the baseline of a line through two places, bent as it was."""
    baselines = page.baselines.copy()
    x, y = np.array([a, b], dtype=np.float64).T
    off = y - page.base(line, x)
    slope = (off[1] - off[0]) / (x[1] - x[0])
    baselines[line, 0] += off[0] + slope * (baselines[line, 3] - x[0])
    baselines[line, 1] += slope
    return replace(page, baselines=baselines)


def cut_edges(page: ScannedPage, edges: NDArray[np.bool_]) -> ScannedPage:
    """The page with some edges (m,) of its graph taken away."""
    return replace(page, graph=replace(page.graph, edges=page.graph.edges[~edges]))


def join_vertices(page: ScannedPage, one: int, other: int) -> ScannedPage:
    """The page with an edge between two vertices."""
    return replace(page, graph=replace(page.graph, edges=np.vstack([page.graph.edges, [sorted((one, other))]])))


def vertices_along(graph: LineGraph, vertices: Indices, places: Array) -> Indices:
    """(k,), rising: those of some vertices (n,) that a pen led along places (m, 2), pixels, has passed.

    Each place means a vertex near it; of all rows of such vertices that is taken whose vertices are nearest to the
    places, and as far apart along the line as those are.  Where a line meets or crosses itself, that keeps to the part
    which was meant.

    Source: P. Newson and J. Krumm, Hidden Markov map matching through noise and sparseness, ACM GIS 2009, with
    distances themselves as costs.
    """
    uv, (a, b) = graph.uv[vertices], graph.edges_between(vertices).T
    length = np.linalg.norm(uv[a] - uv[b], axis=1) + 1e-6
    joined = sparse.coo_matrix((length, (a, b)), shape=(len(uv), len(uv)))
    way, before = csgraph.shortest_path(joined, directed=False, return_predecessors=True)
    # over a gap in the ink the pen goes straight
    straight = _SETTINGS.gap * np.linalg.norm(uv[:, None] - uv, axis=2)
    over = way > straight
    way = np.where(over, straight, way)
    far, near = spatial.cKDTree(uv).query(places, range(1, min(_SETTINGS.nearest, len(uv)) + 1))
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    total, backs = far[0], []
    for step, one, other, away in zip(steps, near, near[1:], far[1:], strict=False):
        costs = total[:, None] + np.abs(way[np.ix_(one, other)] - step)
        backs.append(costs.argmin(axis=0))
        total = costs.min(axis=0) + away
    at = int(total.argmin())
    row = [int(near[-1, at])]
    for one, back in zip(near[-2::-1], backs[::-1], strict=True):
        at = int(back[at])
        row.append(int(one[at]))
    path = [row.pop()]
    while row:
        one, passed = row.pop(), list[int]()
        while one != path[-1]:
            passed.append(one)
            one = path[-1] if over[path[-1], passed[0]] else int(before[path[-1], one])
        path += passed[::-1]
    return np.asarray(vertices[path], dtype=np.intp)


def drop_vertices(page: ScannedPage, gone: NDArray[np.bool_]) -> tuple[ScannedPage, Indices]:
    graph, kept = page.graph, np.flatnonzero(~gone)
    number = np.full(len(graph), -1, dtype=np.intp)
    number[kept] = np.arange(len(kept))
    edges = number[graph.edges]
    left = LineGraph(
        graph.xy[kept], graph.radius[kept], graph.density[kept], graph.uv[kept], edges[(edges >= 0).all(axis=1)]
    )
    dismissed = number[page.dismissed]
    return replace(page, graph=left, dismissed=dismissed[dismissed >= 0]), number


def _with_line(page: ScannedPage, uv: Array, radius: float) -> tuple[ScannedPage, Indices]:
    graph, count = page.graph, len(page.graph)
    edges = [graph.edges, np.column_stack([np.arange(len(uv) - 1), np.arange(1, len(uv))]) + count]
    for end in (0, len(uv) - 1):
        away = np.linalg.norm(graph.uv - uv[end], axis=1) - graph.radius / page.pixel
        if len(away) and away.min() <= radius + _SETTINGS.touch:
            edges.append(np.array([[int(away.argmin()), count + end]]))
    drawn = LineGraph(
        np.vstack([graph.xy, (uv + 0.5) * page.pixel]),
        np.r_[graph.radius, np.full(len(uv), radius * page.pixel)],
        np.r_[graph.density, np.ones(len(uv))],
        np.vstack([graph.uv, uv]),
        np.vstack(edges),
    )
    return replace(page, graph=drawn), np.arange(count)


def with_texture(texture: Texture, pixels: NDArray[np.uint8]) -> Texture:
    """The texture with other pixels (h, w, 4)."""
    return Texture(texture.corner, texture.shape, lambda: pixels, texture.blue_first)


def wide_enough(page: ScannedPage, cover: Cover) -> Texture:
    """The texture of a page, its box made to hold what of the page lies under a cover."""
    texture, (rows, columns) = page.texture, cover.overlap((0, 0), page.shape)[0]
    (x, y), (height, width) = texture.corner, texture.shape
    left, top = min(x, columns.start), min(y, rows.start)
    right, bottom = max(x + width, columns.stop), max(y + height, rows.stop)
    if (left, top, right, bottom) == (x, y, x + width, y + height):
        return texture
    pixels = np.zeros((bottom - top, right - left, 4), dtype=np.uint8)
    pixels[y - top : y - top + height, x - left : x - left + width] = texture.pixels
    return Texture((left, top), pixels.shape[:2], lambda: pixels, texture.blue_first)


def usual_ink(page: ScannedPage) -> tuple[NDArray[np.uint8], float]:
    """Colour (3,), as the pixels of the texture have it, and opacity, 0–255, of the middle of strokes; else black."""
    x, y = page.texture.corner
    height, width = page.texture.shape
    column, row = np.rint(page.graph.uv - (x, y)).astype(np.intp).T
    inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    middle = page.texture.pixels[row[inside], column[inside]]
    middle = middle[middle[:, 3] > 0]
    if not len(middle):
        return np.zeros(3, dtype=np.uint8), 255.0
    return np.median(middle[:, :3], axis=0).astype(np.uint8), float(np.median(middle[:, 3]))


def _discs(
    graph: LineGraph, some: NDArray[np.bool_], corner: Indices, shape: tuple[int, ...], pixel: float
) -> NDArray[np.bool_]:
    """(h, w) where the line of some vertices (n,) lies, a little wider than it was found, from (x, y) on."""
    cover = np.zeros(shape, dtype=np.uint8)
    radius = graph.radius[some] / pixel + _SETTINGS.touch
    for (u, v), r in zip((np.rint(graph.uv[some]).astype(int) - corner).tolist(), radius.tolist(), strict=True):
        cv2.circle(cover, (u, v), max(1, round(r)), 1, -1)
    return cover.astype(bool)


def _count_bins(place: Array, pixel: float) -> int:
    """How many bins along a rule have a stroke."""
    return len(np.unique(np.floor(place * pixel / _SETTINGS.bin)))
