"""A page segmented anew in the window around what a person painted, where its scan was kept.

Ink, line and texture of the window follow what `scanning.scribbles` makes of the scan; vertices whose ink is as it was
keep their places and their letters, so that a letter loses nothing but the ink that is none.  What is new goes to the
letter that is nearest along its line (`hand_editor`), until the words around it are aligned.

Source: seed 000, §5.2; own method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.hand.page_editor import (
    Cover,
    brush,
    drop_vertices,
    own_ink,
    usual_half,
    usual_ink,
    wide_enough,
    with_texture,
)
from handout.hand.scanned import ScannedPage
from handout.libraries import cv2, spatial
from handout.values import Array, Indices, LineGraph

if TYPE_CHECKING:
    from handout.scanning.scribbles import PageWindow

    Segment = Callable[[PageWindow, NDArray[np.bool_]], NDArray[np.bool_] | None]


@dataclass(frozen=True)
class WindowSettings:
    """Lengths in half widths of the page's strokes unless said otherwise; set by eye on real pages."""

    first: float = 5.0  # x-heights around the paint that are looked at
    margin: float = 2.0  # x-heights: where what changes comes so near a side of the window, that is moved once
    middle: float = 0.5  # of a brush: so much of it is surely ink, the rest as the scan has it
    room: float = 8.0  # around what changed, in which the line is found anew
    away: float = 0.8  # from a vertex that stays, within which a new one is the same
    halo: float = 0.34  # mm around ink, as `matting` takes it


_SETTINGS = WindowSettings()


@dataclass(frozen=True, eq=False)
class _Pen:
    """What a page's ink is like.  colour : (3,) red first; opacity : 0–1; half : half its usual width, pixels."""

    colour: Array
    opacity: float
    half: float

    def colour_on(self, paper: NDArray[np.uint8]) -> Array:
        """(3,) 0–255: its colour on some paper (n, 3), as a scan shows it."""
        white = np.median(paper, axis=0) if len(paper) else np.full(3, 255.0)
        return np.asarray(white + (self.colour - white) * self.opacity, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _ChangedWindow:
    """A part of a page.  before, after : (h, w) its ink."""

    pen: _Pen
    rows: slice
    columns: slice
    before: NDArray[np.bool_]
    after: NDArray[np.bool_]

    @property
    def corner(self) -> tuple[int, int]:
        """x, y of its first pixel."""
        return self.columns.start, self.rows.start

    @property
    def changed_mask(self) -> NDArray[np.bool_]:
        return np.asarray(self.before != self.after)

    def cut_to_changes(self, room: int) -> _ChangedWindow:
        """The part of it where something changed, with `room` pixels around."""
        y, x = np.nonzero(self.changed_mask)
        top, left = max(int(y.min()) - room, 0), max(int(x.min()) - room, 0)
        low, right = int(y.max()) + room + 1, int(x.max()) + room + 1
        here = slice(top, low), slice(left, right)
        before, after = self.before[here], self.after[here]
        (x0, y0), (height, width) = self.corner, before.shape
        return _ChangedWindow(
            self.pen, slice(y0 + top, y0 + top + height), slice(x0 + left, x0 + left + width), before, after
        )


def with_ink(
    page: ScannedPage, places: Sequence[tuple[float, float]], width: float
) -> tuple[ScannedPage, Indices] | None:
    """The page with the ink along a brush; None if the scan shows no new ink there."""
    from handout.scanning import scribbles

    hard = brush(page, places, max(1.0, width * _SETTINGS.middle))

    def segment_window(window: scribbles.PageWindow, scribble: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
        found = scribbles.with_ink(window, scribble)
        return found.ink if found.seen else None

    return _segment_around(page, hard, segment_window, np.zeros((0, 2)))


def without_ink(page: ScannedPage, cover: Cover, held: Indices) -> tuple[ScannedPage, Indices] | None:
    """The page without the ink that was painted over; None if there is none.

    held : (n,) vertices whose ink stays, unless it was painted over itself: those of letters that were confirmed.
    """
    from handout.scanning import scribbles

    return _segment_around(page, cover, scribbles.without_ink, page.graph.uv[held])


def _segment_around(
    page: ScannedPage, cover: Cover, segment: Segment, held: Array
) -> tuple[ScannedPage, Indices] | None:
    """The page with the window around a cover segmented anew, as wide as what changes there needs.

    held : (n, 2) pixels: middles of strokes that stay.
    """
    colour, opacity = usual_ink(page)
    rgb = (colour[::-1] if page.texture.blue_first else colour).astype(float)
    unit, pen = page.x_height / page.pixel, _Pen(rgb, opacity / 255, usual_half(page))
    reach, near = round(_SETTINGS.first * unit), round(_SETTINGS.margin * unit)
    (x, y), (height, width) = cover.corner, cover.values.shape
    sides = np.array([y - reach, x - reach, y + height + reach, x + width + reach])
    window = _window(page, pen, cover, sides, segment, held)
    if window is not None and (touched := _find_touched_sides(window, page.shape, near)).any():
        sides += np.where(touched, reach, 0) * np.array([-1, -1, 1, 1])
        window = _window(page, pen, cover, sides, segment, held)
    if window is None or not window.changed_mask.any():
        return None
    window = window.cut_to_changes(round(_SETTINGS.room * pen.half))
    changed, number = _with_lines(page, window)
    return _with_matte(changed, window), number


def _window(
    page: ScannedPage, pen: _Pen, cover: Cover, sides: Indices, segment: Segment, held: Array
) -> _ChangedWindow | None:
    """What becomes of a part of the page; `sides` are its top, left, bottom and right, as far as there is a page."""
    from handout.scanning.scribbles import PageWindow

    assert page.scan is not None
    top, left, low, right = np.clip(sides, 0, np.tile(page.shape, 2)).tolist()
    rows, columns = slice(top, low), slice(left, right)
    ink = own_ink(page, rows, columns)
    scribble = np.zeros(ink.shape, dtype=bool)
    here, values = cover.overlap((columns.start, rows.start), ink.shape)
    scribble[here] = values > 127
    rgb = page.scan.part(rows, columns)
    column, row = np.rint(held - (columns.start, rows.start)).astype(np.intp).T
    inside = (column >= 0) & (row >= 0) & (column < ink.shape[1]) & (row < ink.shape[0])
    stays = np.zeros(ink.shape, dtype=bool)
    stays[row[inside], column[inside]] = True
    stays = ink & _grow_mask(stays, pen.half)
    seen = PageWindow(rgb, ink, pen.colour_on(rgb[~ink]), pen.half, page.x_height / page.pixel, stays)
    after = segment(seen, scribble)
    return None if after is None else _ChangedWindow(pen, rows, columns, ink, after)


def _find_touched_sides(window: _ChangedWindow, shape: tuple[int, int], near: int) -> NDArray[np.bool_]:
    """(4,) whether what changed comes as near the top, left, bottom and right of a window, where the page goes on."""
    changed, (rows, columns) = window.changed_mask, (window.rows, window.columns)
    return np.array(
        [
            rows.start > 0 and changed[:near].any(),
            columns.start > 0 and changed[:, :near].any(),
            rows.stop < shape[0] and changed[-near:].any(),
            columns.stop < shape[1] and changed[:, -near:].any(),
        ]
    )


def _with_lines(page: ScannedPage, window: _ChangedWindow) -> tuple[ScannedPage, Indices]:
    """The page with the line of what changed: vertices that still lie on a line stay."""
    new = _line(page, window)
    zone = _grow_mask(window.changed_mask, window.pen.half)
    graph, away = page.graph, _SETTINGS.away * window.pen.half
    near = np.flatnonzero(_look_under(zone, graph.uv, window.corner)[1])
    nearest = spatial.cKDTree(new.uv).query(graph.uv[near])[0] if len(new) else np.full(len(near), np.inf)
    gone = np.zeros(len(graph), dtype=bool)
    gone[near] = ~_look_under(window.after, graph.uv[near], window.corner)[1] | (nearest > 2 * away)
    bare, number = drop_vertices(page, gone)
    if not len(new):
        return bare, number
    _, under = _look_under(zone, new.uv, window.corner)
    return replace(bare, graph=_splice_graphs(bare.graph, new, under, away)), number


def _splice_graphs(graph: LineGraph, new: LineGraph, fresh: NDArray[np.bool_], away: float) -> LineGraph:
    """A graph with the part of another that lies further than `away` pixels from it, `fresh` (n,) vertices alone."""
    margin = 4 * away
    low, high = new.uv.min(axis=0) - margin, new.uv.max(axis=0) + margin
    own = np.flatnonzero(((graph.uv >= low) & (graph.uv <= high)).all(axis=1))
    if len(own):
        far, nearest = spatial.cKDTree(graph.uv[own]).query(new.uv)
        nearest = own[nearest]
    else:
        far, nearest = np.full(len(new), np.inf), np.zeros(len(new), dtype=np.intp)
    added = fresh & (far > away)
    number = np.where(added, len(graph) + np.cumsum(added) - 1, np.where(far <= 3 * away, nearest, -1))
    edges = number[new.edges[added[new.edges].any(axis=1)]]
    edges = np.unique(np.sort(edges[(edges >= 0).all(axis=1) & (edges[:, 0] != edges[:, 1])], axis=1), axis=0)
    parts = [(getattr(graph, name), getattr(new, name)[added]) for name in ("xy", "radius", "density", "uv")]
    xy, radius, density, uv = (np.concatenate(part) for part in parts)
    return LineGraph(xy, radius, density, uv, np.concatenate([graph.edges, edges]))


def _line(page: ScannedPage, window: _ChangedWindow) -> LineGraph:
    """The line of a window's ink, places in pixels of the page's picture."""
    from handout.scanning.density import Density, Scale
    from handout.scanning.line_graph import find_line_graph
    from handout.scanning.mask import Mask
    from handout.scanning.scan import Scan

    assert page.scan is not None
    if not window.after.any():
        nothing = np.zeros((0, 2))
        return LineGraph(nothing, np.zeros(0), np.zeros(0), nothing, np.zeros((0, 2), dtype=np.intp))
    rgb = page.scan.part(window.rows, window.columns)
    usual = window.pen.colour_on(rgb[~(window.before | window.after)])
    paper = np.median(rgb[~window.after], axis=0) if (~window.after).any() else np.full(3, 255.0)
    axis = (usual - paper) / max(float((usual - paper) @ (usual - paper)), 1e-6)
    level = np.clip((rgb - paper) @ axis, 0, 2).astype(np.float32)
    density = Density(level, Scale(np.ones(800)), 0.5, 0.1)
    found = find_line_graph(Scan(rgb, page.dpi), Mask(window.after, page.pen, 2 * window.pen.half), density)
    uv = found.uv + np.array(window.corner)
    return LineGraph((uv + 0.5) * page.pixel, found.radius, found.density, uv, found.edges)


def _with_matte(page: ScannedPage, window: _ChangedWindow) -> ScannedPage:
    """The page with the ink of a window as the scan has it, where that changed."""
    from handout.scanning.matting import fill_smooth, least_opaque

    assert page.scan is not None
    halo = _SETTINGS.halo / page.pixel
    near = _grow_mask(window.after, halo)
    zone = _grow_mask(window.changed_mask, 2 * halo)
    rgb = page.scan.part(window.rows, window.columns)
    hole = near | _grow_mask(window.before, halo)
    paper = fill_smooth(rgb, hole.astype(np.uint8))
    usual = window.pen.colour_on(rgb[~hole])
    limit = np.minimum if usual.sum() > np.median(paper.reshape(-1, 3), axis=0).sum() else np.maximum
    inside = zone & near
    rgba = np.zeros((*zone.shape, 4), dtype=np.uint8)
    rgba[inside] = least_opaque(rgb[inside], limit(paper[inside], rgb[inside]))
    if page.texture.blue_first:
        rgba = rgba[:, :, [2, 1, 0, 3]]
    cover = Cover(window.corner, zone.astype(np.uint8))
    texture = wide_enough(page, cover)
    here, _ = cover.overlap(texture.corner, texture.shape)
    (x, y), (left, top) = texture.corner, window.corner
    own = (
        slice(here[0].start + y - top, here[0].stop + y - top),
        slice(here[1].start + x - left, here[1].stop + x - left),
    )
    pixels = texture.pixels.copy()
    pixels[here][zone[own]] = rgba[own][zone[own]]
    return replace(page, texture=with_texture(texture, pixels))


def _look_under(
    mask: NDArray[np.bool_], uv: Array, corner: tuple[int, int]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n,) whether places of the page lie in a window, and whether under its mask there."""
    column, row = (np.rint(uv).astype(np.intp) - corner).T
    inside = (column >= 0) & (row >= 0) & (column < mask.shape[1]) & (row < mask.shape[0])
    under = np.zeros(len(uv), dtype=bool)
    under[inside] = mask[row[inside], column[inside]]
    return inside, under


def _grow_mask(mask: NDArray[np.bool_], by: float) -> NDArray[np.bool_]:
    size = 2 * max(1, round(by)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.dilate(mask.astype(np.uint8), kernel) > 0)
