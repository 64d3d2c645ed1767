"""Is the ink on the paper the ink that was meant?  What is missing, what is there twice, and how far off it lies.

Every stroke that was drawn is laid along the intended stroke of which it is a piece: its ends tell from where to where,
its way in between must follow.  A stroke that is broken off and gone on with is several pieces; what no piece covers is
missing, what two cover is doubled.  Lines that cross or retrace others hide nothing: pieces are followed along the
line, not looked for around it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handout.values import Array, Drawing, Stroke

_FINE = 0.02  # mm between points of what was meant
_COARSE = 0.1  # mm between points of what was drawn: its single steps are no part of its length
_LENGTH, _AND = 0.06, 0.4  # share, and mm, by which a piece may be longer or shorter than what it covers
_DRIFT = 0.012  # share of its length by which a piece may run ahead in its middle
_TIE = 0.03  # mm; of two lines that fit as well, the one with less on it was drawn


@dataclass(frozen=True)
class InkComparison:
    """Ink on paper against what was meant.

    missing : mm of intended ink that is not there, in gaps longer than `SLACK`; gap : mm, the longest gap.
    doubled : mm that are there more than once.
    deviation : mm, greatest distance of ink that belongs to an intended stroke from that stroke.
    stray : mm of ink that belongs to none; a mere dot of it counts as 0.1 mm.
    dots : intended dots that are not there.
    """

    missing: float
    gap: float
    doubled: float
    deviation: float
    stray: float
    dots: int


SLACK = 0.1  # mm


class _Piece(NamedTuple):
    """From where to where on an intended stroke a drawn one goes, mm, and how far it leaves it."""

    stroke: int
    begin: float
    end: float
    off: float


def compare(intended: Drawing, drawn: Iterable[Stroke]) -> InkComparison:
    """Compare all ink on a sheet, whichever run it came from, with what was meant."""
    from scipy.spatial import cKDTree

    lines = [_evenly(stroke.xy, _FINE) for stroke in intended.strokes]
    tree = cKDTree(np.concatenate(lines))
    starts = np.cumsum([0, *(len(line) for line in lines)])
    pieces: list[list[_Piece]] = [[] for _ in lines]
    stray = 0.0
    for stroke in drawn:
        path = _thinned(stroke.xy)
        if (piece := _laid(path, lines, tree, starts, pieces)) is not None:
            pieces[piece.stroke].append(piece)
            continue
        stray += max(_length(path), _COARSE)
        for part in _beside(path, tree):  # what is right of it before and behind it goes astray
            if (piece := _laid(part, lines, tree, starts, pieces)) is not None:
                pieces[piece.stroke].append(piece)
                stray -= _length(part)
    return _summed(lines, pieces, stray)


def _beside(path: Array, tree: object) -> list[Array]:
    """The parts of a path that lie by what was meant."""
    off = tree.query(path)[0]  # type: ignore[attr-defined]
    runs = np.split(np.arange(len(path)), np.flatnonzero(np.diff(off <= SLACK)) + 1)
    return [path[run] for run in runs if len(run) > 1 and off[run[0]] <= SLACK]


def _summed(lines: Sequence[Array], pieces: Sequence[Sequence[_Piece]], stray: float) -> InkComparison:
    missing = gap = doubled = deviation = 0.0
    dots = 0
    for line, covering in zip(lines, pieces, strict=True):
        whole = (len(line) - 1) * _step(line)
        deviation = max([deviation, *(piece.off for piece in covering)])
        if not covering and whole < SLACK:
            dots += 1
        reached = 0.0
        for piece in sorted(covering, key=lambda piece: piece.begin):
            hole = piece.begin - reached
            missing, gap = missing + (hole if hole > SLACK else 0.0), max(gap, hole)
            doubled += max(min(reached, piece.end) - piece.begin, 0.0)
            reached = max(reached, piece.end)
        hole = whole - reached
        missing, gap = missing + (hole if hole > SLACK else 0.0), max(gap, hole)
    return InkComparison(missing, gap, doubled, deviation, stray, dots)


def _laid(
    path: Array, lines: Sequence[Array], tree: object, starts: Array, pieces: Sequence[Sequence[_Piece]]
) -> _Piece | None:
    """The piece of an intended stroke that a path is; of those that fit alike one that is not drawn yet."""
    begins, ends = (_places(point, lines, tree, starts) for point in (path[0], path[-1]))
    length = _length(path)
    fitting: list[_Piece] = []
    for stroke, begin in begins:
        for other, end in ends:
            apart = (end - begin) * _step(lines[stroke])
            if other == stroke and abs(apart - length) <= _LENGTH * length + _AND and apart > -_AND:
                off = _off(path, lines[stroke], begin, end, length)
                at = begin * _step(lines[stroke])
                fitting.append(_Piece(stroke, at, max(at + apart, at), off))
    fitting = [piece for piece in fitting if piece.off <= 5 * SLACK]
    if not fitting:
        return None
    best = min(piece.off for piece in fitting)
    alike = [piece for piece in fitting if piece.off <= best + _TIE]
    return min(alike, key=lambda piece: (_covered(piece, pieces[piece.stroke]), piece.off))


def _covered(piece: _Piece, others: Sequence[_Piece]) -> float:
    """How much of a piece others cover already, to a tenth of a millimetre."""
    return round(sum(max(min(piece.end, o.end) - max(piece.begin, o.begin), 0.0) for o in others), 1)


def _places(point: Array, lines: Sequence[Array], tree: object, starts: Array) -> list[tuple[int, int]]:
    """Where intended strokes come by a point: the stroke and the nearest index on it, for each time it comes by."""
    near = np.sort(np.array(tree.query_ball_point(point, 3 * SLACK), dtype=np.intp))  # type: ignore[attr-defined]
    places = []
    stroke_of = np.searchsorted(starts, near, side="right") - 1
    apart = np.flatnonzero((np.diff(near) > 1) | (np.diff(stroke_of) > 0)) + 1
    for group in np.split(np.arange(len(near)), apart) if len(near) else []:
        stroke = int(stroke_of[group[0]])
        index = near[group] - starts[stroke]
        off = np.hypot(*(lines[stroke][index] - point).T)
        # it may come by, turn and come by again without ever being far: every nearest place counts
        low = np.flatnonzero((off <= np.append(np.inf, off[:-1])) & (off < np.append(off[1:], np.inf)))
        places += [(stroke, int(index[at])) for at in low if off[at] <= off.min() + SLACK]
    return places


def _off(path: Array, line: Array, begin: int, end: int, length: float) -> float:
    """Greatest distance of a path from the stretch of a line that it covers, looked for where it should be by then."""
    share = _arc(path) / length if length > 0 else np.zeros(len(path))
    reach = int((SLACK + _AND + _DRIFT * length) / _FINE)
    index = np.rint(begin + share * (end - begin)).astype(np.intp)[:, None] + np.arange(-reach, reach + 1)
    points = line[np.clip(index, min(begin, end), max(begin, end))]
    off = points - path[:, None]
    return float(np.sqrt((off * off).sum(axis=2).min(axis=1)).max())


def _evenly(xy: Array, step: float) -> Array:
    """Points along a path at equal distances, about `step`, both ends included."""
    arc = _arc(xy)
    keep = np.append(True, np.diff(arc) > 0)
    at = np.linspace(0.0, arc[-1], max(int(np.ceil(arc[-1] / step)), 1) + 1) if arc[-1] > 0 else np.zeros(1)
    return np.stack([np.interp(at, arc[keep], xy[keep, axis]) for axis in (0, 1)], axis=1)


def _step(line: Array) -> float:
    """mm between the points of an even path (along it: chords are shorter by nothing that counts)."""
    return float(np.hypot(*np.diff(line, axis=0).T).mean()) if len(line) > 1 else 0.0


def _thinned(xy: Array) -> Array:
    """The points of a path that are at least `_COARSE` from the one kept before, and both ends."""
    indices = [0]
    x, y = xy[0]
    for at, (px, py) in enumerate(xy.tolist()):
        if (px - x) ** 2 + (py - y) ** 2 >= _COARSE**2:
            indices.append(at)
            x, y = px, py
    if len(xy) > 1 and indices[-1] != len(xy) - 1:
        indices.append(len(xy) - 1)
    return xy[indices]


def _arc(xy: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])


def _length(xy: Array) -> float:
    return float(_arc(xy)[-1])
