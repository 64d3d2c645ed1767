"""Painting with a brush: its segments are quilted to one straight ribbon, which is laid along a path.

Where two segments meet that did not in their photograph, the cut between them runs where they differ least.  The
ribbon is laid as a mesh of quadrilaterals, of which the later covers the earlier: in a bend tighter than the brush is
wide the inner edge is held back, and where a stroke crosses itself its later part lies over the earlier.

Source: seed 004, §3.3 and §3.4; the mesh and its parts: own method.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from handout.chains import viterbi
from handout.inking.brush.ribbon import SEGMENTS, SPAN
from handout.inking.brush.synthesis import Library
from handout.libraries import cv2, ndimage
from handout.values import Array, Indices

_CUT_ROWS, _CUT_COLUMNS = 32, 12  # pixels, at most, among which a cut is looked for
_TURN = 2.0  # rad that a part of a stroke may turn: it cannot cross itself
_CORNER, _CORNER_REACH = 1.1, 5  # rad within so many segments, weighted to the middle: sharper than a bend
_ROUND = 1.0  # half widths: radius of the end of a part that another goes on from
_INNER = 0.9  # of the radius of a bend: how far in the ribbon reaches
_ASIDE = 2  # columns of them, from one row to the next
_OVERLAP = 2  # segments on either side of a border that the cut may go
_LEAST = 2  # columns of a segment, however thin the line

# what laying takes of the finest streaks is given to a ribbon before; squares of differences of neighbouring pixels in
# eight strokes laid where they were photographed are then .94 of the photograph's, without it .56
_SHARP = np.array([-0.24, 1.48, -0.24], dtype=np.float32)

_SMALLER = 1.3  # times: what is shrunk more than so would alias

_Pixels = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Sized:
    """The segments of a library at one size: `columns` pixels each."""

    library: Library
    columns: int

    @classmethod
    def fitting(cls, library: Library, width: float) -> Sized:
        """For a line so many pixels wide."""
        finest = max(ribbon.columns for ribbon in library.ribbons)
        return cls(library, int(np.clip(np.ceil(width / SEGMENTS), _LEAST, finest)))

    @cached_property
    def ribbons(self) -> tuple[_Pixels, ...]:
        """(rows, columns, 4) premultiplied, with `_OVERLAP` segments of nothing before and after each."""
        rows, inks = round(self.columns * SEGMENTS * SPAN), list[_Pixels]()
        for ribbon in self.library.ribbons:
            way = cv2.INTER_AREA if ribbon.columns > _SMALLER * self.columns else cv2.INTER_CUBIC
            ink = cv2.resize(ribbon.premultiplied_ink, (len(ribbon) * self.columns, rows), interpolation=way)
            inks.append(np.pad(ink, ((0, 0), (_OVERLAP * self.columns,) * 2, (0, 0))))
        return tuple(inks)

    def hard(self, row: Indices) -> _Pixels:
        """(rows, m · columns, 4): the segments side by side."""
        step, library = self.columns, self.library
        ribbons, first = library.ribbon[row].tolist(), ((library.place[row] + _OVERLAP) * step).tolist()
        return np.concatenate(
            [self.ribbons[k][:, at : at + step] for k, at in zip(ribbons, first, strict=True)], axis=1
        )

    def joints(self, row: Indices) -> Indices:
        """Places of a row whose segment did not follow the one before in its photograph."""
        ribbon, place = self.library.ribbon[row], self.library.place[row]
        return np.flatnonzero((np.diff(place) != 1) | (np.diff(ribbon) != 0)) + 1

    def quilt_segments(self, row: Indices) -> _Pixels:
        """(rows, m · columns, 4): the segments with cuts between them that are seen least. Source: seed 004, §3.4."""
        step, library = self.columns, self.library
        whole = self.hard(row)
        joints = self.joints(row).tolist()
        room = np.diff([0, *joints, len(row)]).tolist()
        for joint, left, right in zip(joints, room[:-1], room[1:], strict=True):
            a, b = (int(library.ribbon[row[k]]) for k in (joint - 1, joint))
            end = (int(library.place[row[joint - 1]]) + _OVERLAP + 1) * step
            start = (int(library.place[row[joint]]) + _OVERLAP) * step
            half = min(_OVERLAP * step, left * step // 2, right * step // 2)
            before = self.ribbons[a][:, end - half : end + half]
            after = self.ribbons[b][:, start - half : start + half]
            whole[:, joint * step - half : joint * step + half] = _join_pieces(before, after)
        return whole


def _join_pieces(a: _Pixels, b: _Pixels) -> _Pixels:
    """Two overlapping pieces of ink as one, `a` at its left edge and `b` at its right.

    The cut parts ink from paper; where both are ink, the one shades into the other.
    """
    rows, columns = a.shape[:2]
    size = (min(columns, _CUT_COLUMNS), min(rows, _CUT_ROWS))
    apart = ((a - b) ** 2).sum(axis=2)
    cut = viterbi(list(cv2.resize(apart, size, interpolation=cv2.INTER_AREA)), [_cut_costs(size[0])] * (size[1] - 1))
    after = (np.arange(size[0]) >= np.array(cut)[:, None]).astype(np.float32)
    share = np.clip(cv2.resize(after, (columns, rows), interpolation=cv2.INTER_LINEAR) * 2 - 0.5, 0, 1)[..., None]
    solid = np.minimum(a[..., 3:], b[..., 3:])
    share += (np.linspace(0, 1, columns, dtype=np.float32)[None, :, None] - share) * solid
    return np.asarray(a * (1 - share) + b * share)


@cache
def _cut_costs(columns: int) -> Array:
    """(columns, columns): a cut goes aside by a few columns from one row to the next."""
    at = np.arange(columns)
    return np.where(np.abs(at[:, None] - at) <= _ASIDE, 0.0, np.inf)


def lay(canvas: NDArray[np.uint8], ribbon: _Pixels, line: Array, half: Array) -> None:
    """Lay a ribbon along a line on a canvas, over what is there.

    Where the line turns sharply the one part ends and the next begins round, each over the other's end.

    canvas : (h, w, 4) uint8, premultiplied.
    ribbon : (rows, columns, 4) float32, premultiplied.
    line : (m + 1, 2) float, pixels: places along the line that the columns are spread over evenly.
    half : (m + 1,) float, pixels: half the width of the stroke there.
    """
    filtered = cv2.sepFilter2D(ribbon, -1, _SHARP, _SHARP, borderType=cv2.BORDER_REPLICATE)
    sharp = np.asarray(filtered, dtype=np.float32)
    np.clip(sharp, 0, 1, out=sharp)
    for colour in range(3):
        np.minimum(sharp[..., colour], sharp[..., 3], out=sharp[..., colour])
    turn = _turns(line)
    cuts = _cuts(turn)
    for first, last in zip([0, *cuts], [*cuts, len(line) - 1], strict=True):
        part = _LinePart(line, half, first, last)
        _lay_part(canvas, sharp, _sides(part.line, part.half * SPAN), part)


def _turns(line: Array) -> Array:
    """(n,) rad: by how much a line turns at each of its places."""
    z = np.diff(line, axis=0) @ np.array([1, 1j])
    return np.concatenate([[0.0], np.angle(z[1:] * z[:-1].conj()), [0.0]])


def _cuts(turn: Array) -> list[int]:
    """Places at which a line is cut: in its sharp turns, and before it could come back over itself."""
    half = _CORNER_REACH // 2 + 1
    sharp = np.abs(ndimage.correlate1d(turn, 1 - np.abs(np.arange(1 - half, half)) / half, mode="constant"))
    apex = (sharp > _CORNER) & (sharp == ndimage.maximum_filter1d(sharp, _CORNER_REACH))
    cuts, total, last = list[int](), 0.0, 0
    for at in range(1, len(turn) - 1):
        total += abs(float(turn[at]))
        if (apex[at] and at - last >= _CORNER_REACH) or total > _TURN:
            cuts.append(at)
            total, last = 0.0, at
    return cuts


class _LinePart:
    """The places first to last of a line, and round past those of its ends that are cuts.

    line, half : as of `lay`; offset : number of the first place.
    """

    def __init__(self, line: Array, half: Array, first: int, last: int) -> None:
        self.line, self.half, self.offset = line[first : last + 1], half[first : last + 1], first
        self.first, self.last, self.end = first, last, len(line) - 1
        for cut, at, way in ((first > 0, 0, (0, 1)), (last < self.end, -1, (-1, -2))):
            if cut:
                out = self.line[way[0]] - self.line[way[1]]
                step = max(float(np.hypot(*out)), 1e-6)
                more = int(min(np.ceil(self.half[at] / step), 4 * SEGMENTS))
                ahead = self.line[at] + np.arange(1, more + 1)[:, None] * out
                wide = np.full(more, self.half[at])
                if at == 0:
                    self.line, self.half = np.concatenate([ahead[::-1], self.line]), np.concatenate([wide, self.half])
                    self.offset -= more
                else:
                    self.line, self.half = np.concatenate([self.line, ahead]), np.concatenate([self.half, wide])

    def contains(self, u: _Pixels, v: _Pixels) -> NDArray[np.bool_]:
        """Which of some places, along the whole line and −1 to 1 across it, are the part's."""
        inside = np.abs(v) <= 1
        for cut, end, beyond in (
            (self.first > 0, self.first, self.first - u), (self.last < self.end, self.last, u - self.last)
        ):  # fmt: skip
            if not cut:
                inside &= beyond <= 0
                continue
            at = end - self.offset
            step = float(np.linalg.norm(self.line[at] - self.line[at - 1 if at else 1]))
            half = float(self.half[at])
            inside &= (beyond <= 0) | ((beyond * step) ** 2 + (v * (SPAN * half)) ** 2 <= (_ROUND * half) ** 2)
        return inside


def _sides(line: Array, reach: Array) -> Array:
    """(n, 2, 2): the left and the right edge of the mesh, cut off on the inner side of a tight bend."""
    way = np.diff(line, axis=0)
    step = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)
    z = way @ np.array([1, 1j]) / step
    turn = _turns(line)
    middle = np.concatenate([z[:1], z[:-1] * np.exp(0.5j * turn[1:-1]), z[-1:]]) * 1j
    normal = np.stack([middle.real, middle.imag], axis=1)
    step = (np.append(step, step[-1]) + np.insert(step, 0, step[0])) / 2
    inner = np.minimum(reach, np.maximum(_INNER * step / np.maximum(np.abs(turn), 1e-6), 0.5))
    left, right = np.where(turn < 0, inner, reach), np.where(turn > 0, inner, reach)
    return np.stack([line - normal * left[:, None], line + normal * right[:, None]], axis=1)


def _lay_part(canvas: NDArray[np.uint8], ribbon: _Pixels, sides: Array, part: _LinePart) -> None:
    """Lay the quadrilaterals of a part, which does not cross itself, over what is there."""
    low = np.maximum(np.floor(sides.min(axis=(0, 1))).astype(int) - 1, 0)
    high = np.minimum(np.ceil(sides.max(axis=(0, 1))).astype(int) + 2, canvas.shape[1::-1])
    if (high <= low).any():
        return
    own = sides - low
    number = np.zeros((int(high[1] - low[1]), int(high[0] - low[0])), dtype=np.int32)
    quads = np.stack([own[:-1, 0], own[1:, 0], own[1:, 1], own[:-1, 1]], axis=1)
    for k, quad in enumerate(np.rint(quads * 16).astype(np.int32), 1):
        cv2.fillConvexPoly(number, quad, k, lineType=cv2.LINE_8, shift=4)
    at = np.flatnonzero(number)
    quad = number.reshape(-1)[at] - 1
    u, v = _places(at, quad, number.shape[1], part.line - low, own, SPAN * part.half)
    u += np.float32(part.offset)
    inside = part.contains(u, v)
    at, u, v = at[inside], u[inside], v[inside]
    if not len(at):
        return
    columns = np.float32(ribbon.shape[1] / part.end)
    x, y = u * columns - np.float32(0.5), (v + 1) * np.float32(len(ribbon) / 2) - np.float32(0.5)
    side = 1 << 14  # cv2.remap takes no rows of more than 32,767
    at_x, at_y = (np.resize(values, -(-len(at) // side) * side).reshape(-1, side) for values in (x, y))
    ink = cv2.remap(ribbon, at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(-1, 4)[: len(at)]
    row, column = np.divmod(at, number.shape[1])
    pixels = canvas.reshape(-1, 4)
    there = (row + low[1]) * canvas.shape[1] + column + low[0]
    under = pixels[there].astype(np.float32)
    under *= 1 - ink[:, 3:]
    under += ink * np.float32(255) + np.float32(0.5)
    pixels[there] = under


def _places(
    at: Indices, quad: NDArray[np.int32], width: int, line: Array, sides: Array, reach: Array
) -> tuple[_Pixels, _Pixels]:
    """Where pixels (n,), numbered in rows of `width`, lie: along the line, and across it in shares of `reach` (m,).

    How far along its quadrilateral a pixel lies follows from its distances from both ends of it, so that neighbours
    agree on the edge that they share.
    """
    forms = []
    for end in (np.s_[:-1], np.s_[1:]):
        a, way = sides[end, 0], sides[end, 1] - sides[end, 0]
        way = way / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
        forms += [way[:, 1], -way[:, 0], way[:, 0] * a[:, 1] - way[:, 1] * a[:, 0]]
    along, wider = np.diff(line, axis=0), np.diff(reach)
    table = np.stack([*forms, *line[:-1].T, *along.T, reach[:-1], wider], axis=1).astype(np.float32)[quad].T
    y, x = (values.astype(np.float32) for values in np.divmod(at, width))
    before, after = (table[k] * x + table[k + 1] * y + table[k + 2] for k in (0, 3))
    apart = before - after
    u = np.clip(before / np.where(np.abs(apart) < 1e-6, np.float32(1e-6), apart), np.float32(-0.5), np.float32(1.5))
    x -= table[6] + u * table[8]
    y -= table[7] + u * table[9]
    v = np.sqrt(x * x + y * y) / (table[10] + u * table[11])
    v *= np.sign(table[8] * y - table[9] * x)
    return u + quad.astype(np.float32), v


def spread_places(line: Array, pieces: int) -> Array:
    """(pieces + 1, 2): places at even distances along a line (n, 2)."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0, along[-1], pieces + 1)
    return np.stack([np.interp(at, along, line[:, k]) for k in (0, 1)], axis=1)


def bends(line: Array) -> Array:
    """(m,): by how much a line turns in each of its pieces, rad a width, of places (m + 1, 2) an eighth apart."""
    turn = _turns(line)
    return np.asarray((turn[1:] + turn[:-1]) / 2 * SEGMENTS)
