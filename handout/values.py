"""The nouns that every room shares: few, frozen, arrays read-only.

Page coordinates are mm, origin at the top left, y down.  Letter space is the frame in which letters are drawn:
x-height 1, baseline y = 0, y up, x to the right, upright (the slant is added when writing).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.summary import as_png, as_svg, one_line

Array = NDArray[np.float64]
POSE = ("pressure", "tilt", "azimuth", "rotation")  # what a pen may record of how it is held, sample by sample
TURNS = ("azimuth", "rotation")  # of them, those that come round
NIB_THICKNESS = 0.09  # of a flat nib, in lengths of its edge: the width of a line drawn along it
_COLOUR = re.compile("#[0-9a-f]{6}")


def readonly(values: ArrayLike, *shape: int | None) -> Array:
    """A read-only float64 copy of `values`, of the given shape (None: any length).

    Raises ValueError: wrong shape or a value that is not finite.
    """
    array = np.array(values, dtype=np.float64)
    fits = array.ndim == len(shape)
    for want, have in zip(shape, array.shape, strict=False):  # a generator would take a fifth of the time of this
        fits = fits and want in (None, have)
    if not fits:
        raise ValueError(f"expected an array of shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("expected finite numbers")
    array.flags.writeable = False
    return array


Indices = NDArray[np.intp]


def readonly_indices(values: ArrayLike, *shape: int | None) -> Indices:
    """A read-only copy of `values` as whole numbers, of the given shape (None: any length).

    Raises ValueError: wrong shape, or numbers that are not whole.
    """
    numbers = np.asarray(values)
    array = numbers.astype(np.intp)
    fits = array.ndim == len(shape) and all(want in (None, have) for want, have in zip(shape, array.shape, strict=True))
    if not fits:
        raise ValueError(f"expected an array of shape {shape}, got {array.shape}")
    if numbers.dtype.kind != "i" and not np.array_equal(numbers, array):
        raise ValueError("expected whole numbers")
    array.flags.writeable = False
    return array


_VARIES = 0.08  # of the width of a mark: what varies less is an even line


@dataclass(frozen=True)
class Page:
    """A sheet: width and height in mm, and the name it is sold under."""

    width: float
    height: float
    name: str = ""


@dataclass(frozen=True, eq=False)
class Stroke:
    """One pen-down movement.

    t : (n,) float, s, strictly increasing, on the clock of the page.
    xy : (n, 2) float, mm, page coordinates (y down).
    pressure : (n,) float in 0–1, optional.
    tilt, azimuth, rotation : (n,) float, rad, optional; tilt is measured from the vertical, azimuth and rotation from
        the page's x axis towards y.
    width : (n,) float, mm, width of the mark, optional.
    word : index of the written word on its page, counted from 0; −1 if unknown.
    layer : name of the layer it belongs to, "" for none: what is drawn with one pen, before or after the other layers.
    colour : of the pen it is meant for, ``"#rrggbb"``, "" for any.
    nib : mm, length of the edge of a flat nib, which lies along `rotation`; 0 for a round point.
    """

    t: Array
    xy: Array
    pressure: Array | None = None
    tilt: Array | None = None
    azimuth: Array | None = None
    rotation: Array | None = None
    width: Array | None = None
    word: int = -1
    layer: str = ""
    colour: str = ""
    nib: float = 0.0

    __repr__ = one_line

    def __post_init__(self) -> None:
        if self.colour and not _COLOUR.fullmatch(self.colour):
            raise ValueError(f"{self.colour!r} is not a colour such as #1a1a2e")
        t = readonly(self.t, None)
        if len(t) == 0:
            raise ValueError("a stroke needs at least one sample")
        if len(t) > 1 and not (np.diff(t) > 0).all():
            raise ValueError("the times of a stroke must increase")
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "xy", readonly(self.xy, len(t), 2))
        for name in ("pressure", "tilt", "azimuth", "rotation", "width"):
            channel = getattr(self, name)
            if channel is not None:
                object.__setattr__(self, name, readonly(channel, len(t)))
        if not 0 <= self.nib < float("inf") or (self.nib > 0 and self.rotation is None):
            raise ValueError("a flat nib has an edge of some length, and the rotation that it lies along")

    @property
    def pose(self) -> dict[str, Any]:
        """Those of the channels of `POSE` that were recorded, by their names."""
        return {name: values for name in POSE if (values := getattr(self, name)) is not None}

    @cached_property
    def is_even(self) -> bool:
        """Whether a line of even width does for its mark."""
        if self.nib > 0 or self.width is None:
            return self.nib <= 0
        return float(np.ptp(self.width)) <= _VARIES * max(float(self.width.mean()), 1e-9)

    @cached_property
    def length(self) -> float:
        """Length of the path, mm."""
        return float(np.linalg.norm(np.diff(self.xy, axis=0), axis=1).sum())

    @cached_property
    def speed(self) -> Array:
        """(n,) float, mm/s: central differences; zeros for a single sample."""
        if len(self.t) < 2:
            return np.zeros(len(self.t))
        velocity = np.gradient(self.xy, self.t, axis=0)
        return np.asarray(np.hypot(velocity[:, 0], velocity[:, 1]))


@dataclass(frozen=True, eq=False)
class Drawing:
    """Strokes in the order of writing on one page; what previews, plotters and InkML take.

    The time between one stroke's last sample and the next stroke's first is spent with the pen up.
    Writing that reuses scanned ink has `ink`, which gives its pixels at a number of dots per inch, and `inked`, where
    it lies: (x least, y least, x greatest, y greatest), mm; such a page need not have strokes.
    `timed` says whether the times of the strokes mean anything; they do not in drawings that are only lines.
    `beneath` lays what previews show under the ink, such as a letterhead, on the pixels of a sheet (h, w, 3) uint8, of
    a number of dots per inch; it is neither printed nor plotted.
    `about` holds what is stored with every output: seed, hand, text, the program's version …
    """

    strokes: tuple[Stroke, ...]
    page: Page
    about: Mapping[str, Any] = field(default_factory=dict)
    ink: Callable[[float], Raster] | None = field(default=None, repr=False)
    inked: tuple[float, float, float, float] | None = None
    timed: bool = True
    beneath: Callable[[NDArray[np.uint8], float], NDArray[np.uint8]] | None = field(default=None, repr=False)

    __repr__, _repr_svg_, _repr_png_ = one_line, as_svg, as_png

    @property
    def duration(self) -> float:
        """Time of the last sample, s (0 for an empty drawing)."""
        return float(self.strokes[-1].t[-1]) if self.strokes else 0.0

    @cached_property
    def pen_down(self) -> float:
        """Length written with the pen down, mm."""
        return float(sum(stroke.length for stroke in self.strokes))

    @cached_property
    def pen_up(self) -> float:
        """Length of the straight moves between strokes, mm."""
        ends = [(a.xy[-1], b.xy[0]) for a, b in zip(self.strokes, self.strokes[1:], strict=False)]
        return float(sum(np.linalg.norm(b - a) for a, b in ends))

    @cached_property
    def bounds(self) -> tuple[float, float, float, float] | None:
        """(x least, y least, x greatest, y greatest) in mm of strokes and ink, or None for an empty drawing."""
        places = [stroke.xy for stroke in self.strokes]
        if self.inked is not None:
            places.append(np.reshape(self.inked, (2, 2)))
        if not places:
            return None
        xy = np.concatenate(places)
        return (*xy.min(axis=0).tolist(), *xy.max(axis=0).tolist())


@dataclass(frozen=True, eq=False)
class Raster:
    """Pixels on a page.

    rgba : (h, w, 4) uint8, straight alpha, device RGB; floats, in 0–1, are rounded to it.
    dpi : pixels per inch.
    origin : (x, y) of the top left corner on the page, mm.
    rows : the first row with ink and the one behind the last, where that is known: the others need not be looked at.
    """

    rgba: NDArray[np.uint8]
    dpi: float
    origin: tuple[float, float] = (0.0, 0.0)
    rows: tuple[int, int] | None = None

    __repr__, _repr_png_ = one_line, as_png

    def __post_init__(self) -> None:
        rgba = np.asarray(self.rgba)
        if rgba.ndim != 3 or rgba.shape[2] != 4:
            raise ValueError(f"expected (h, w, 4), got {rgba.shape}")
        if rgba.dtype != np.uint8:
            rgba = np.rint(np.clip(rgba, 0, 1) * 255).astype(np.uint8)
            rgba[rgba[..., 3] == 0] = 0
        rgba = rgba.view()
        rgba.flags.writeable = False
        object.__setattr__(self, "rgba", rgba)

    @property
    def inked(self) -> NDArray[np.uint32]:
        """(h, w): 0 where there is no ink."""
        return np.ascontiguousarray(self.rgba).view(np.uint32)[..., 0]


@dataclass(frozen=True, eq=False)
class ActionPlan:
    """What the hand intends for one pen-down component; both motion engines take it.

    points : (m, 2) float, mm: where the pen should pass, in order, evenly spaced in motor time.
    interval : s, motor time from one point to the next.
    smooth : smoothing time divided by `interval` (0.2 careful … 0.4 hasty); see motion.optimal_control.
    spread : (m, 2, 2) float, mm², optional: covariance of each target, for motor noise and for looseness.
    """

    points: Array
    interval: float
    smooth: float
    spread: Array | None = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points, None, 2))
        if self.spread is not None:
            object.__setattr__(self, "spread", readonly(self.spread, len(self.points), 2, 2))
        if not (self.interval > 0 and self.smooth > 0):
            raise ValueError("interval and smooth must be positive")


@dataclass(frozen=True, eq=False)
class Glyph:
    """One form of a letter in letter space (x-height 1, baseline y = 0, y up).

    letter : the grapheme it writes.
    strokes : tuple of (n, 2) float: points on the curve, in order; a stroke of one point is a dot.
    delayed : for each stroke, whether it is written after the word (i-dots, t-bars, accents).
    width : how far the next letter is set off.
    entry : how the pen comes in: "low" (joined from the baseline), "high" (joined from a high exit such as
        that of o), "lifted" (starts afresh), or "free" (may follow either; the first point decides nothing).
    exit : how the pen leaves: "low", "high", or "lifted" (does not join).
    places : places in the word where the form is used: "start", "middle", "end", "alone".
    after, before : the letters next to which the form is used ("" : any).
    rank : how particular the form is to its neighbours; where several fit, the most particular are used.
    favour : how much it is preferred to others that fit as well.
    reluctance : cost of lifting the pen before it where it could have been joined.
    form : number of the drawn form among the forms of its letter; forms derived from one drawing share it.
    """

    letter: str
    strokes: tuple[Array, ...]
    delayed: tuple[bool, ...]
    width: float
    entry: str = "lifted"
    exit: str = "lifted"
    places: frozenset[str] = frozenset({"start", "middle", "end", "alone"})
    after: str = ""
    before: str = ""
    rank: int = 0
    favour: float = 0.0
    reluctance: float = 0.0
    form: int = 0

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "strokes", tuple(readonly(s, None, 2) for s in self.strokes))

    @property
    def last_main(self) -> int:
        """Index of the last stroke that is written with the word, before its delayed strokes."""
        return (self.delayed.index(True) if True in self.delayed else len(self.strokes)) - 1

    def part_strokes(self, strokes: Sequence[Array]) -> tuple[list[Array], list[Array]]:
        """The strokes of this glyph, wherever they lie: those written with the word, and the delayed ones."""
        pairs = list(zip(strokes, self.delayed, strict=True))
        return [s for s, delayed in pairs if not delayed], [s for s, delayed in pairs if delayed]


@dataclass(frozen=True, eq=False)
class Placed:
    """A glyph with its place on a page.

    strokes : tuple of (n, 2) float, mm, page coordinates: the glyph's points as this instance has them.
    joined : whether its first stroke continues the last stroke of the glyph before.
    word : index of its word on the page.
    at : index of its grapheme in the text.
    ink : what it is written with, where it was scanned; such a glyph has no strokes.

    What strikes a word out is placed after the word's last letter, as a glyph of no letter; it has strokes always.
    """

    glyph: Glyph
    strokes: tuple[Array, ...]
    joined: bool
    word: int
    at: int
    ink: Ink | None = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "strokes", tuple(readonly(s, None, 2) for s in self.strokes))


@dataclass(frozen=True, eq=False)
class Line:
    """A written line: its text, its glyphs, and the height of its baseline at the left margin, mm.

    rise : (slope, sag, middle, half): how the line leaves the level, see `height_at`.
    """

    text: str
    placed: tuple[Placed, ...]
    baseline: float
    rise: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    __repr__ = one_line

    def height_at(self, x: Array) -> Array:
        """(n,) mm from the top of the page: where the line's words stand at places `x` (n,) mm."""
        slope, sag, middle, half_width = self.rise
        u = x - middle
        return np.asarray(self.baseline - (slope * u + sag * ((u / half_width) ** 2 - 0.33)))


@dataclass(frozen=True, eq=False)
class Manuscript:
    """A page of text written in a hand: glyphs chosen and placed, still without ink and without time.

    x_height : mm.
    about : seed, hand and options, stored with every output.
    """

    lines: tuple[Line, ...]
    page: Page
    x_height: float
    about: Mapping[str, Any] = field(default_factory=dict)

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class Moments:
    """What a recorded pen says of the vertices of a LineGraph, which are numbered in the order of writing.

    times : (n,) float, s, on the clock of the recording; None where it had none.
    pressure : (n,) float, 0–1; None where it was not measured.
    tilt, azimuth, rotation : (n,) float, rad, as those of `Stroke`; None where they were not measured.
    """

    times: Array | None = None
    pressure: Array | None = None
    tilt: Array | None = None
    azimuth: Array | None = None
    rotation: Array | None = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name in ("times", *POSE):
            if (values := getattr(self, name)) is not None:
                object.__setattr__(self, name, readonly(values, None))


@dataclass(frozen=True)
class Tag:
    """What is known of one place of a LineGraph.

    kind : "label" (the vertex belongs to the letter `text`), "split" (letter and ligature part at the vertex) or
        "link" (the line of the vertex and the line of vertex `to` are one letter).
    at : index of the vertex.
    """

    kind: str
    at: int
    text: str = ""
    to: int = -1


@dataclass(frozen=True, eq=False)
class LineGraph:
    """The line that a pen left, as a graph: a vertex about every pixel, a junction where the line meets itself.

    xy : (n, 2) float: places, in the frame of whoever holds the graph (mm on a page, y down; letter space).
    radius : (n,) float, half the width of the line, in the unit of `xy`.
    density : (n,) float, 0–2: how much ink there is; 1 is the usual ink of the page.
    uv : (n, 2) float, pixels of the scan: where the vertex lies in the picture, 0 the middle of the first pixel.
    edges : (m, 2) int, pairs of vertices, each pair once.
    tags : see Tag.
    """

    xy: Array
    radius: Array
    density: Array
    uv: Array
    edges: Indices
    tags: tuple[Tag, ...] = ()

    __repr__ = one_line

    def __post_init__(self) -> None:
        xy = readonly(self.xy, None, 2)
        object.__setattr__(self, "xy", xy)
        object.__setattr__(self, "radius", readonly(self.radius, len(xy)))
        object.__setattr__(self, "density", readonly(self.density, len(xy)))
        object.__setattr__(self, "uv", readonly(self.uv, len(xy), 2))
        edges = readonly_indices(self.edges, None, 2)
        if edges.size and (edges.min() < 0 or edges.max() >= len(xy)):
            raise ValueError(f"an edge names a vertex outside 0–{len(xy) - 1}")
        object.__setattr__(self, "edges", edges)

    def __len__(self) -> int:
        return len(self.xy)

    @cached_property
    def degree(self) -> Indices:
        """(n,) int: edges at every vertex: 0 a dot, 1 an end, 2 on the way, 3 and more a junction."""
        return np.bincount(self.edges.ravel(), minlength=len(self))

    @cached_property
    def leaving(self) -> tuple[Indices, Indices]:
        """(m,) the edges by the vertex that they begin at, and (n + 1,) where those of each vertex begin there."""
        order = np.argsort(self.edges[:, 0], kind="stable")
        return order, np.searchsorted(self.edges[order, 0], np.arange(len(self) + 1))

    def edges_between(self, vertices: Indices) -> Indices:
        """(k, 2) int: the edges between some vertices (n,), rising, by their places there; in the graph's order."""
        order, first = self.leaving
        count = first[vertices + 1] - first[vertices]
        at = np.repeat(first[vertices] - (np.cumsum(count) - count), count) + np.arange(count.sum())
        pairs = self.edges[np.sort(order[at])]
        place = np.searchsorted(vertices, pairs)
        there = vertices[np.minimum(place, len(vertices) - 1)] == pairs
        return np.asarray(place[there.all(axis=1)])

    @cached_property
    def neighbour_lists(self) -> tuple[Indices, Indices]:
        """(2 m,) the vertices that edges lead to, and (n + 1,) where those beside each vertex begin there."""
        a, b = self.edges.T
        begin = np.concatenate([a, b])
        order = np.argsort(begin, kind="stable")
        return np.concatenate([b, a])[order], np.concatenate([[0], np.cumsum(np.bincount(begin, minlength=len(self)))])

    @cached_property
    def lengths(self) -> Array:
        """(m,) float: length of every edge, in the unit of `xy`."""
        return np.asarray(np.linalg.norm(self.xy[self.edges[:, 0]] - self.xy[self.edges[:, 1]], axis=1))

    @cached_property
    def components(self) -> Indices:
        """(n,) int: number of the connected piece of every vertex, from 0."""
        from handout.branching import number_pieces

        return number_pieces(self.edges, len(self))

    @cached_property
    def branches(self) -> tuple[Indices, ...]:
        """Paths between junctions and ends: vertices in order, both ends included.

        A closed loop without a junction begins and ends with the same vertex; a dot is a path of one vertex.
        """
        from handout.branching import branches

        return branches(self.edges, len(self))

    def take(self, keep: ArrayLike) -> LineGraph:
        """The part of the graph on the vertices `keep` ((n,) bool or indices): edges and tags within it."""
        where = np.zeros(len(self), dtype=bool)
        where[np.asarray(keep)] = True
        kept = np.flatnonzero(where)
        number = {-1: -1, **{vertex: at for at, vertex in enumerate(kept.tolist())}} if self.tags else {}
        tags = tuple(
            Tag(tag.kind, number[tag.at], tag.text, number[max(tag.to, -1)])
            for tag in self.tags
            if tag.at in number and max(tag.to, -1) in number
        )
        edges = self.edges_between(kept)
        return LineGraph(self.xy[kept], self.radius[kept], self.density[kept], self.uv[kept], edges, tags)


@dataclass(frozen=True, eq=False)
class Ink:
    """One scanned glyph as it is written anew: its line, moved and bent, and where its texture is.

    graph : `xy` and `radius` in mm on the page that is written, `uv` in pixels of the picture it was scanned in; the
        glyph's body and, where it is joined, its own version of the whole ligature on either side.
    source : number of the hand's page whose picture `uv` is about.
    number : number of the glyph in its hand.
    """

    graph: LineGraph
    source: int
    number: int

    __repr__ = one_line
