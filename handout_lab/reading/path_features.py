"""What a reader sees of a pen's path: points an even way apart, each with direction, bend, height and its surroundings.

A path is a word's pen-down pieces in the order of writing.  Points are in x-heights: x along the line, y up from the
baseline, the slant taken out.  Moves in the air become a few points, so that a reader sees how far the pen jumped.
What stands over or under a place by another piece (dots, bars) is among the features of that place, since a delayed
stroke may come long after its letter.

Source: Jaeger, Manke, Reichert and Waibel 2001 (direction, curvature, delayed strokes as a feature of the letter);
the surroundings in bands of height are an own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class PathSettings:
    """How a path is sampled and described; lengths in x-heights.

    step : from point to point.
    fewest : points of the shortest piece, so that the reader has a step of its own for a full stop.
    in_air : points of a move without contact.
    reach : farthest jump, way back or distance that is told apart from farther ones.
    near : within that far along the line a piece stands over a point.
    bands : bounds of the heights in which ink of other pieces is looked for.
    earlier : way along the path before ink counts as earlier ink, not as where the pen just was.
    steepest : tangent of the greatest slant that is taken out.
    """

    step: float = 0.1
    fewest: int = 4
    in_air: int = 4
    reach: float = 3.0
    near: float = 0.22
    bands: tuple[float, ...] = (-2.5, -0.35, 0.35, 0.8, 1.2, 1.65, 3.5)
    earlier: float = 0.7
    steepest: float = 1.2


SETTINGS = PathSettings()
COUNT = 11 + len(SETTINGS.bands) - 1  # features of a point


@dataclass(frozen=True, eq=False)
class SampledPath:
    """Points of a path: places (n, 2) in x-heights, whether the pen is down, piece, and the sample each comes from.

    source : (n,) float, where the point lies among all samples of all pieces, one after the other.
    """

    xy: Array
    down: NDArray[np.bool_]
    piece: NDArray[np.intp]
    source: Array
    lengths: Array


def slant_of(strokes: Sequence[Array]) -> float:
    """Tangent of the slant of strokes, y up: of what falls, weighted by how steeply.  0 where nothing falls."""
    moves = np.concatenate([np.zeros((0, 2)), *(np.diff(xy, axis=0) for xy in strokes)])
    falling = moves[moves[:, 1] < -np.abs(moves[:, 0])]
    weight = float((falling[:, 1] ** 2).sum())
    slant = float((falling[:, 0] * falling[:, 1]).sum()) / weight if weight else 0.0
    return float(np.clip(slant, -SETTINGS.steepest, SETTINGS.steepest))


def sampled(strokes: Sequence[Array]) -> SampledPath:
    """Pieces (n, 2), x-heights and upright, as points an even way apart, with points for the moves between them."""
    places, down, piece, source, lengths = [], [], [], [], []
    first = 0
    for number, xy in enumerate(strokes):
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
        count = max(SETTINGS.fewest, round(float(way[-1]) / SETTINGS.step) + 1)
        at = np.linspace(0.0, float(way[-1]), count)
        if number:
            share = np.linspace(0.0, 1.0, SETTINGS.in_air + 2)[1:-1, None]
            places.append((1 - share) * strokes[number - 1][-1] + share * xy[0])
            down.append(np.zeros(SETTINGS.in_air, dtype=bool))
            piece.append(np.full(SETTINGS.in_air, number))
            source.append(np.full(SETTINGS.in_air, float(first)))
        places.append(np.column_stack([np.interp(at, way, xy[:, 0]), np.interp(at, way, xy[:, 1])]))
        down.append(np.ones(count, dtype=bool))
        piece.append(np.full(count, number))
        source.append(first + np.interp(at, way, np.arange(len(xy), dtype=np.float64)))
        lengths.append(float(way[-1]))
        first += len(xy)
    return SampledPath(
        np.concatenate(places),
        np.concatenate(down),
        np.concatenate(piece).astype(np.intp),
        np.concatenate(source),
        np.array(lengths),
    )


def features(path: SampledPath) -> Floats:
    """(n, COUNT) float32: what a reader sees of each point.

    cos and sin of the direction, cos and sin of the turn, height, way back from the rightmost ink so far, pen down,
    length of the piece, of the jump, distance to earlier ink, share of the way along the piece; then the bands.
    """
    xy, down = path.xy, path.down
    n = len(xy)
    direction = _directions(xy)
    turn = direction * np.conj(np.concatenate([direction[:1], direction[:-1]]))
    rightmost = np.maximum.accumulate(np.where(down, xy[:, 0], -np.inf))
    back = np.clip(rightmost - xy[:, 0], 0.0, SETTINGS.reach)
    length = np.minimum(path.lengths[path.piece], SETTINGS.reach)
    hop = np.zeros(n)
    air = np.flatnonzero(~down)
    starts = air[:: SETTINGS.in_air]
    if len(starts):
        jump = np.hypot(*(xy[starts + SETTINGS.in_air] - xy[starts - 1]).T)
        hop[air] = np.repeat(np.minimum(jump, SETTINGS.reach), SETTINGS.in_air)
    earlier, bands = _surroundings(path)
    columns = [direction.real, direction.imag, turn.real, turn.imag, xy[:, 1], back, down, length, hop, earlier]
    columns.append(np.minimum(np.abs(xy[:, 0] - xy[np.searchsorted(path.piece, path.piece), 0]), SETTINGS.reach))
    return np.column_stack([*columns, bands]).astype(np.float32)


def _directions(xy: Array) -> NDArray[np.complex128]:
    """(n,) unit complex: the way the pen moves at each point; 1 where it stands."""
    ahead = np.minimum(np.arange(len(xy)) + 1, len(xy) - 1)
    behind = np.maximum(np.arange(len(xy)) - 1, 0)
    move = xy[ahead] - xy[behind]
    size = np.hypot(*move.T)
    return np.where(size > 1e-9, (move[:, 0] + 1j * move[:, 1]) / np.maximum(size, 1e-9), 1.0 + 0.0j)


def _surroundings(path: SampledPath) -> tuple[Array, Array]:
    """Distance of each point to earlier ink, (n,), and for each band of heights whether other pieces have ink there.

    Both are looked up at every second point: neighbours hardly differ, and the work grows with the square.
    """
    n = len(path.xy)
    some = np.arange(0, n, 2)
    xy, piece, down = path.xy[some], path.piece[some], path.down[some]
    dx = xy[:, None, 0] - xy[None, :, 0]
    dy = xy[:, None, 1] - xy[None, :, 1]
    lag = np.arange(len(some))
    before = (lag[:, None] - lag[None, :]) * 2 * SETTINGS.step > SETTINGS.earlier
    distance = np.where(before & down[None, :], dx * dx + dy * dy, SETTINGS.reach**2)
    earlier = np.minimum(np.sqrt(distance.min(axis=1)), 1.0)
    over = (np.abs(dx) < SETTINGS.near) & (piece[:, None] != piece[None, :]) & down[None, :]
    band = np.searchsorted(SETTINGS.bands, xy[:, 1]) - 1
    inside = np.eye(len(SETTINGS.bands) + 1)[np.clip(band, -1, len(SETTINGS.bands) - 1)][:, : len(SETTINGS.bands) - 1]
    bands = np.minimum(over.astype(np.float32) @ inside.astype(np.float32), 2.0) / 2
    at = np.arange(n) // 2
    return earlier[at], bands[at]
