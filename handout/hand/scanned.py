"""A hand read from paper: every letter that a person wrote on some pages, where it lies, and what it is joined to.

Places on a page are `uv`: pixels of the picture as it came, 0 the middle of the first one.  Line space is the frame of
one written line: the unit is the pitch of the page's lines, x runs along the line, y up from its baseline.

Source: seed 000, §5.1.3, §6.3.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.errors import InputError
from handout.hand.places import Place
from handout.hand.protocol import Repertoire
from handout.libraries import cv2
from handout.summary import as_png, one_line
from handout.values import POSE, Array, Indices, LineGraph, Moments, readonly, readonly_indices

NOBODY = -1  # instead of the number of a glyph
NO_PAGE = -1  # the page of a line that has no ink yet
_MOST_PIXELS = 400_000_000
_OVER = 4.0  # pixels beyond the picture that a vertex may lie: hands of earlier programs have such
_ON_LINES = (0.25, 0.4)  # shares of the distance of lines between which letters keep their own size; set by eye
DOUBTFUL = 0.5  # confidence under which a letter is worth a look


@dataclass(frozen=True, eq=False)
class Ligature:
    """The way of the pen from one letter to the next.

    path : (n,) int, n ≥ 2: vertices of the page's graph in order, from one letter to the next.
    start, end : (2,) float, line space: its first and its last vertex.
    """

    path: Indices
    start: Array
    end: Array

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", readonly_indices(self.path, None))
        if len(self.path) < 2:
            raise ValueError("a ligature leads from one vertex to another")
        object.__setattr__(self, "start", readonly(self.start, 2))
        object.__setattr__(self, "end", readonly(self.end, 2))


@dataclass(frozen=True, eq=False)
class ScannedGlyph:
    """One letter as it was written once.

    letter : the grapheme; "" for a piece of writing that nobody has named yet.
    place : in its word: "start", "middle", "end" or "alone".
    page, line, word : numbers from 0: page of the hand, written line of the page, word of the page's transcript.
    at : index of its grapheme in the page's transcript, −1 for one that was named by hand.
    vertices : (n,) int: its vertices in the page's graph, rising; with those of its halves of ligatures.  Those where
        a crossbar crosses the letter beside its own are of both.
    before, after : numbers of the glyphs beside it in its word, −1 for none.
    ligatures : the ways to the glyph `after`; several where more than one stroke leads there, none where the pen was
        lifted.
    confidence : 0–1, of the place of its ends.
    confirmed : whether a person confirmed or corrected it: it is the truth, and what is aligned anew learns from it.
    ways : how it was written, as a person said: its vertices along each stroke, in order; none where nobody did, or
        where its ink is no longer what it was then.
    kept_out : whether a person said that it is not to be written, true as it is.
    """

    letter: str
    place: Place
    page: int
    line: int
    word: int
    at: int
    vertices: Indices
    before: int = NOBODY
    after: int = NOBODY
    ligatures: tuple[Ligature, ...] = ()
    confidence: float = 1.0
    confirmed: bool = False
    ways: tuple[Indices, ...] = ()
    kept_out: bool = False

    __repr__ = one_line

    def __post_init__(self) -> None:
        vertices = readonly_indices(self.vertices, None)
        if not len(vertices) or (vertices[1:] <= vertices[:-1]).any():
            raise ValueError("a glyph has vertices, in rising order")
        object.__setattr__(self, "vertices", vertices)
        if self.ways:
            ways = tuple(readonly_indices(way, None) for way in self.ways)
            own = all(np.isin(way, vertices).all() for way in ways)
            object.__setattr__(self, "ways", ways if own else ())

    def with_neighbours(self, number: Mapping[int, int]) -> ScannedGlyph:
        """The glyph with other numbers for its neighbours; the same object if they do not change."""
        before, after = number[self.before], number[self.after]
        return self if (before, after) == (self.before, self.after) else replace(self, before=before, after=after)


@dataclass(frozen=True, eq=False)
class Texture:
    """Ink without its paper, looked at only when it is needed.

    corner : (x, y) of its first pixel in the picture of the page.
    shape : (height, width), pixels.
    load : gives (h, w, 4) uint8, straight alpha, 0 where there is no ink.
    blue_first : whether it gives blue before red, which files do; of a whole page that is put right only where needed.
    """

    corner: tuple[int, int]
    shape: tuple[int, int]
    load: Callable[[], NDArray[np.uint8]] = field(repr=False)
    blue_first: bool = False

    __repr__ = one_line

    @cached_property
    def pixels(self) -> NDArray[np.uint8]:
        """(h, w, 4) uint8, straight alpha, read-only, blue or red first as it was loaded."""
        pixels = self.load().view()
        if pixels.shape != (*self.shape, 4) or pixels.dtype != np.uint8:
            raise ValueError(f"expected {(*self.shape, 4)} of uint8, got {pixels.shape} of {pixels.dtype}")
        pixels.flags.writeable = False
        return pixels

    @property
    def alpha(self) -> NDArray[np.uint8]:
        """(h, w) uint8: how much the ink hides."""
        return self.pixels[:, :, 3]

    @cached_property
    def rgba(self) -> NDArray[np.uint8]:
        """(h, w, 4) uint8, straight alpha, read-only."""
        if not self.blue_first:
            return self.pixels
        pixels = self.part(slice(None), slice(None))
        pixels.flags.writeable = False
        return pixels

    def part(self, rows: slice, columns: slice) -> NDArray[np.uint8]:
        """(h, w, 4) uint8, straight alpha: some of its pixels."""
        if not self.blue_first:
            return self.pixels[rows, columns]
        return np.asarray(cv2.cvtColor(self.pixels[rows, columns], cv2.COLOR_BGRA2RGBA), dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class KeptScan:
    """The picture that a page was read from, around its writing; elsewhere its paper's colour.  Looked at when needed.

    shape : (height, width), pixels: those of the page.
    load : gives (h, w, 3) uint8, blue first.
    packed : gives the same as a lossy WebP, as a file keeps it.
    """

    shape: tuple[int, int]
    load: Callable[[], NDArray[np.uint8]] = field(repr=False)
    packed: Callable[[], bytes] = field(repr=False)

    __repr__ = one_line

    @cached_property
    def pixels(self) -> NDArray[np.uint8]:
        """(h, w, 3) uint8, blue first, read-only."""
        pixels = self.load().view()
        if pixels.shape != (*self.shape, 3) or pixels.dtype != np.uint8:
            raise ValueError(f"expected {(*self.shape, 3)} of uint8, got {pixels.shape} of {pixels.dtype}")
        pixels.flags.writeable = False
        return pixels

    def part(self, rows: slice, columns: slice) -> NDArray[np.uint8]:
        """(h, w, 3) uint8, red first: some of its pixels."""
        return np.ascontiguousarray(self.pixels[rows, columns, ::-1])


@dataclass(frozen=True, eq=False)
class ScannedPage:
    """A page of somebody's writing.

    source : where it was read from.
    transcript : what is written on it, as it was given.
    dpi : pixels per inch.
    shape : (height, width) of its picture, pixels.
    graph : the line of the pen; `xy` mm on the page, y down.
    baselines : (lines, 5) float: c₀, c₁, c₂, middle, reach, pixels: y = c₀ + c₁ d + c₂ d², d = x − middle; further
        than `reach` from the middle the line runs on straight.
    pitch : mm from a line to the next.
    x_height : mm.
    slant : dx/dy of the letters, upwards.
    pen : what the ink was taken for.
    texture : the ink.
    paper : (h, w, 3) uint8: the page without ink, much reduced.
    moments : of a page that was recorded: the vertices of its graph are in the order of writing.
    dismissed : (n,) int: vertices of the graph that are no letter's, as a person said.
    scan : the picture that it was read from, where that was kept.
    """

    source: str
    transcript: str
    dpi: float
    shape: tuple[int, int]
    graph: LineGraph
    baselines: Array
    pitch: float
    x_height: float
    slant: float
    pen: str
    texture: Texture
    paper: NDArray[np.uint8]
    moments: Moments | None = None
    dismissed: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    scan: KeptScan | None = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "dismissed", readonly_indices(self.dismissed, None))
        object.__setattr__(self, "baselines", readonly(self.baselines, None, 5))
        paper = np.array(self.paper, dtype=np.uint8)
        if paper.ndim != 3 or paper.shape[2] != 3 or not paper.size:
            raise ValueError(f"expected paper of (h, w, 3), got {paper.shape}")
        paper.flags.writeable = False
        object.__setattr__(self, "paper", paper)
        self._check_picture()
        uv = self.graph.uv
        if len(self.dismissed) and not 0 <= self.dismissed.min() <= self.dismissed.max() < len(uv):
            raise ValueError("a vertex that there is not is no letter's")
        if not ((uv >= -_OVER) & (uv <= np.array(self.shape[::-1]) + _OVER)).all():
            raise ValueError("a vertex lies outside its picture")
        for name in ("times", *POSE) if self.moments else ():
            if (channel := getattr(self.moments, name)) is not None and len(channel) != len(self.graph):
                raise ValueError(f"{len(channel)} moments of {len(self.graph)} vertices")

    def _check_picture(self) -> None:
        if not (self.dpi > 0 and self.pitch > 0 and self.x_height > 0):
            raise ValueError("resolution, pitch and x-height must be above 0")
        if min(self.shape) < 1 or self.shape[0] * self.shape[1] > _MOST_PIXELS:
            raise ValueError(f"a picture of {self.shape[1]} × {self.shape[0]} pixels is none that can be used")
        box = [(at, at + side) for at, side in zip(self.texture.corner[::-1], self.texture.shape, strict=True)]
        if any(low < 0 or high <= low or high > side for (low, high), side in zip(box, self.shape, strict=True)):
            raise ValueError("the ink lies outside the picture")
        if self.scan is not None and self.scan.shape != self.shape:
            raise ValueError("the scan is not as large as its page")

    @property
    def pixel(self) -> float:
        """Side of a pixel, mm."""
        return 25.4 / self.dpi

    @property
    def unit(self) -> float:
        """Pixels of one unit of line space."""
        return self.pitch / self.pixel

    def base(self, line: int | Indices, x: ArrayLike) -> Array:
        """y of a line's baseline at x, pixels; for one line, or a line for each x."""
        c0, c1, c2, middle, reach = self.baselines.T.take(line, axis=1)  # contiguous: a third of the time of rows
        away = np.asarray(x, dtype=np.float64) - middle
        held = np.minimum(np.maximum(away, -reach), reach)
        return np.asarray(c0 + held * (c1 + held * c2) + (away - held) * (c1 + 2 * c2 * held))

    def to_line(self, line: int | Indices, uv: ArrayLike) -> Array:
        """(n, 2): line space of places (n, 2) of the picture; `line` is one for all or (n,)."""
        x, y = np.asarray(uv, dtype=np.float64).reshape(-1, 2).T
        return np.column_stack([x, self.base(line, x) - y]) / self.unit

    def to_picture(self, line: int, xy: ArrayLike) -> Array:
        """(n, 2): places of the picture, pixels, of line space (n, 2)."""
        x, up = np.asarray(xy, dtype=np.float64).reshape(-1, 2).T * self.unit
        return np.column_stack([x, self.base(line, x) - up])

    def on_paper(self, strength: float = 1.0) -> NDArray[np.uint8]:
        """(h, w, 3): the page as it was, its ink as strong as `strength`, on its reduced paper."""
        height, width = self.shape
        picture = np.asarray(cv2.resize(self.paper, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.uint8)
        x, y = self.texture.corner
        h, w = self.texture.shape
        ink, under = self.texture.rgba, picture[y : y + h, x : x + w]
        part = ink[:, :, 3:].astype(np.float32) * np.float32(strength / 255)
        picture[y : y + h, x : x + w] = np.rint(under * (1 - part) + ink[:, :, :3] * part).astype(np.uint8)
        return picture

    def ligature(self, line: int, path: ArrayLike) -> Ligature:
        """The ligature along the vertices `path`."""
        numbers = readonly_indices(path, None)
        ends = self.to_line(line, self.graph.uv[numbers[[0, -1]]])
        return Ligature(numbers, ends[0], ends[1])


@dataclass(frozen=True, eq=False)
class ScannedHand:
    """How one person writes, as far as some pages show it.

    name, title : what it is called; for people.
    glyphs : a glyph's number is its place here.
    author : the hand without the letters that were added to it, whose pages and glyphs come first here; None: there
        are none.
    legible : 0–1: how much more than usual glyphs are chosen by how strangers read them (`legibility.prefer_legible`).
    """

    name: str
    title: str
    pages: tuple[ScannedPage, ...]
    glyphs: tuple[ScannedGlyph, ...]
    author: ScannedHand | None = None
    legible: float = 0.0

    __repr__, _repr_png_ = one_line, as_png

    def __post_init__(self) -> None:
        known = self.author.glyphs if self.author else ()  # which were looked at there
        for number in range(len(known) if self.glyphs[: len(known)] == known else 0, len(self.glyphs)):
            _check(number, self.glyphs[number], self.pages, self.glyphs)

    @property
    def own_count(self) -> int:
        """How many of its glyphs the author wrote as they are; those that were added come after them."""
        return len((self.author or self).glyphs)

    @cached_property
    def added(self) -> ScannedHand:
        """The letters that were added to it, alone."""
        return replace(self.take_glyphs(range(self.own_count, len(self.glyphs))), author=None)

    @cached_property
    def x_height(self) -> float:
        """Height of a small letter, mm: the middle of its pages'."""
        return float(np.median([page.x_height for page in self.pages]))

    @cached_property
    def pitch(self) -> float:
        """Distance of lines, x-heights."""
        return float(np.median([page.pitch / page.x_height for page in self.pages]))

    @cached_property
    def instances(self) -> Counter[tuple[str, Place]]:
        """How often there is each letter in each place to write; `prompting.sentence_choice.lacks` takes this."""
        return Counter((glyph.letter, glyph.place) for glyph in self.glyphs if glyph.letter and not glyph.kept_out)

    @cached_property
    def letters(self) -> Mapping[str, int]:
        """How often there is each letter to write, the commonest first."""
        counts = Counter(glyph.letter for glyph in self.glyphs if glyph.letter and not glyph.kept_out)
        return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))

    @cached_property
    def repertoire(self) -> Repertoire:
        """What it can write."""
        return Repertoire(self.name, frozenset(self.letters), frozenset())

    def x_height_on(self, spacing: float, usual: float) -> float:
        """See `protocol.AnyHand`: its own, within bounds."""
        least, most = _ON_LINES
        return min(max(self.x_height, least * spacing), most * spacing)

    def with_language(self, code: str) -> ScannedHand:
        return self

    def with_haste(self, haste: float) -> ScannedHand:
        if haste:
            raise InputError(
                f"haste: {self.name} is a scanned hand, which is as hurried as it was written; leave --haste out."
            )
        return self

    @cached_property
    def _numbers(self) -> Mapping[str, Indices]:
        numbers_of: dict[str, list[int]] = {}
        for number, glyph in enumerate(self.glyphs):
            if not glyph.kept_out:
                numbers_of.setdefault(glyph.letter, []).append(number)
        return {letter: readonly_indices(numbers, None) for letter, numbers in numbers_of.items()}

    def numbers_of_letter(self, letter: str) -> Indices:
        """(n,) int: numbers of the glyphs of a letter, in the order of writing, without those that are kept out."""
        return self._numbers.get(letter, readonly_indices(np.zeros(0), 0))

    def outline(self, number: int) -> Array:
        """(n, 2): the vertices of a glyph in line space."""
        glyph = self.glyphs[number]
        page = self.pages[glyph.page]
        return page.to_line(glyph.line, page.graph.uv[glyph.vertices])

    def place_vertices(self, numbers: Indices, vertices: Indices) -> Array:
        """(n, 2) line space: vertices (n,) of the pages of glyphs (n,), each on its glyph's line."""
        page, line = np.array([(glyph.page, glyph.line) for glyph in self.glyphs], dtype=np.intp).reshape(-1, 2).T
        place, page = np.empty((len(vertices), 2)), page[numbers]
        for k, here in stretches(page):
            scan = self.pages[k]
            place[here] = scan.to_line(line[numbers[here]], scan.graph.uv[vertices[here]])
        return place

    def body(self, number: int) -> Indices:
        """The vertices of a glyph without its ligatures; the ends of those are its own."""
        glyph = self.glyphs[number]
        ways = [way.path[1:] for way in glyph.ligatures]
        if glyph.before >= 0:
            ways += [way.path[:-1] for way in self.glyphs[glyph.before].ligatures]
        vertices = np.setdiff1d(glyph.vertices, np.concatenate(ways)) if ways else glyph.vertices
        return readonly_indices(vertices if len(vertices) else glyph.vertices, None)

    def centre(self, number: int) -> Array:
        """(2,) line space: the middle of a glyph's ink; see `centres`."""
        return np.asarray(self.centres[number])

    def take_glyphs(self, kept: Sequence[int]) -> ScannedHand:
        """A hand of some of the glyphs, by their numbers; where a neighbour is gone there is none."""
        number = {old: new for new, old in enumerate(kept)}

        def renumber_neighbours(glyph: ScannedGlyph) -> ScannedGlyph:
            before, after = (number.get(beside, NOBODY) for beside in (glyph.before, glyph.after))
            ways = () if after == NOBODY else glyph.ligatures
            return replace(glyph, before=before, after=after, ligatures=ways)

        return replace(self, glyphs=tuple(renumber_neighbours(self.glyphs[old]) for old in kept))

    @cached_property
    def centres(self) -> Array:
        """(n, 2) line space: the middle of each glyph's ink.

        Vertices weigh by density times radius squared; those below the baseline, and beyond the outer bounds of the
        glyphs beside it, are left out as long as any remain.

        Source: seed 000, §6.3.
        """
        if self.author is not None:
            return np.concatenate([self.author.centres, self.added.centres])
        size = np.array([len(glyph.vertices) for glyph in self.glyphs], dtype=np.intp)
        of, first = np.repeat(np.arange(len(size)), size), np.cumsum(size) - size
        vertices = np.concatenate([np.zeros(0, dtype=np.intp), *(glyph.vertices for glyph in self.glyphs)])
        place = self.place_vertices(of, vertices)
        weights = [page.graph.density * page.graph.radius**2 + 1e-12 for page in self.pages]
        weight = np.concatenate([np.zeros(0), *(weights[glyph.page][glyph.vertices] for glyph in self.glyphs)])
        beside = np.array([(glyph.before, glyph.after) for glyph in self.glyphs], dtype=np.intp).reshape(-1, 2)
        low = np.append(np.minimum.reduceat(place[:, 0], first), -np.inf)[beside[:, 0]]
        high = np.append(np.maximum.reduceat(place[:, 0], first), np.inf)[beside[:, 1]]
        in_core = (place[:, 1] >= 0) & (place[:, 0] >= low[of]) & (place[:, 0] <= high[of])
        in_core |= ~np.logical_or.reduceat(in_core, first)[of]
        weight = np.where(in_core, weight, 0.0)[:, None]
        return readonly(np.add.reduceat(weight * place, first) / np.add.reduceat(weight, first), len(size), 2)


def stretches(numbers: Indices) -> Iterator[tuple[int, slice]]:
    """Each stretch of equal numbers (n,), none negative: the number, and the places that it has."""
    first = np.flatnonzero(np.diff(numbers, prepend=-1)).tolist()
    for begin, end in pairwise([*first, len(numbers)]):
        yield int(numbers[begin]), slice(begin, end)


def _check(number: int, glyph: ScannedGlyph, pages: tuple[ScannedPage, ...], glyphs: tuple[ScannedGlyph, ...]) -> None:
    """Raise ValueError where a glyph names what is not there."""
    if not 0 <= glyph.page < len(pages):
        raise ValueError(f"glyph {number} is on page {glyph.page} of {len(pages)}")
    page = pages[glyph.page]
    if not 0 <= glyph.line < len(page.baselines):
        raise ValueError(f"glyph {number} is on line {glyph.line} of {len(page.baselines)}")
    ends = [(glyph.vertices[0], glyph.vertices[-1]), *((way.path.min(), way.path.max()) for way in glyph.ligatures)]
    if any(low < 0 or high >= len(page.graph) for low, high in ends):
        raise ValueError(f"glyph {number} names a vertex outside 0–{len(page.graph) - 1}")
    for beside, back in ((glyph.before, "after"), (glyph.after, "before")):
        if not -1 <= beside < len(glyphs) or beside == number:
            raise ValueError(f"glyph {number} is beside glyph {beside}, which there is not")
        if beside >= 0 and (getattr(glyphs[beside], back) != number or glyphs[beside].page != glyph.page):
            raise ValueError(f"glyph {number} is beside glyph {beside}, which is elsewhere")
    if glyph.ligatures and glyph.after < 0:
        raise ValueError(f"glyph {number} has ligatures but nothing after it")
