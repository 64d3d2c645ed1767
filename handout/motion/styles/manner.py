"""What can be seen of a manner of writing, as one row of numbers: of an example, and of what is drawn after it.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handout.motion.reconstruction.key_points import resample_path
from handout.motion.timing import arc_length
from handout.peaks import peaks
from handout.values import Array

MEASURES = ("loops", "turning", "sided", "corners", "tops", "feet", "joins", "lean", "rhythm")
BUILT = np.isin(MEASURES, ("joins", "lean", "rhythm"))  # those of where targets lie, not of how they are reached
# standard deviation of each among 40 words of house-joined; the widths' and the lean's are that of house-print
SPREADS = np.array([0.1, 0.73, 0.24, 0.13, 0.1, 0.1, 0.16, 0.08, 0.13])
_STEP = 0.06  # heights between the samples of a path
_REACH = 70  # samples: a loop is closed within so many
_LEAST_LOOP = 0.012  # square heights: a smaller one is a retraced line
_CORNER = 1.0  # rad within three samples
_CUSP = 2.4  # rad at one sample: turned back, to neither side
_UPPER = 0.15  # heights that a path goes down on both sides of an upper turn
_WIDE = 0.1  # heights below it, where its width is measured
_NO_TURN = 0.15  # heights: width of turns where there are none
_FEWEST = 4  # ways up and down that have a rhythm


def measure_manner(strokes: Sequence[Array], height: float) -> Array:
    """What can be seen of the manner of some strokes.

    strokes : (n, 2) float each, mm, y down, in the order of writing.
    height : mm, of a letter.

    Returns (9,) float, in the order of `MEASURES`: loops in a height of the path; its turning, rad a height; how much
    more of that is to the right than to the left, −1 to 1; share of it at corners; widths of upper and of lower turns a
    tenth of a height from them (how far the pen swings over), heights; strokes in a height of the path; tangent of the
    lean to the right of what goes down; standard deviation of the logarithm of the ways up and down.
    """
    loops, turned, right, sharp, long, movements = 0, 0.0, 0.0, 0.0, 0.0, 0
    widths: tuple[list[float], list[float]] = ([], [])
    ways, down = list[float](), np.zeros(2)
    for stroke in strokes:
        xy = np.asarray(stroke) / height
        if len(xy) < 2 or (length := float(arc_length(xy)[-1])) < 3 * _STEP:
            continue
        movements, long = movements + 1, long + length
        even = resample_path(xy, round(length / _STEP) + 1)
        loops += _count_loops(even)
        z = np.diff(even @ np.array([1.0, 1j]))
        turn = np.angle(z[1:] * z[:-1].conj())
        size = np.abs(turn)
        turned += float(size.sum())
        right += float(turn[size < _CUSP].sum())
        near = np.pad(size, 1)
        sharp += float(size[near[:-2] + size + near[2:] > _CORNER].sum())
        falling = z[z.imag > 0.5 * np.abs(z)]
        down += (falling.real * falling.imag).sum(), (falling.imag**2).sum()
        ends = [0, len(even) - 1]
        for side, found in zip((-1, 1), widths, strict=True):
            at = peaks(side * even[:, 1], prominence=_UPPER, apart=1)
            ends += at.tolist()
            off = side * (even[at, 1, None] - even[:, 1]) >= _WIDE
            behind = np.arange(len(even)) >= at[:, None]
            before, after = (off & ~behind)[:, ::-1], off & behind
            both = before.any(axis=1) & after.any(axis=1)
            left, right_of = len(even) - 1 - before[both].argmax(axis=1), after[both].argmax(axis=1)
            found += np.abs(even[right_of, 0] - even[left, 0]).tolist()
        ways += (_STEP * np.diff(sorted(ends))).tolist()
    long, some = max(long, _STEP), max(turned, _STEP)
    tops, feet = (float(np.mean(found)) if found else _NO_TURN for found in widths)
    rhythm = float(np.log(np.maximum(ways, _STEP)).std()) if len(ways) >= _FEWEST else 0.0
    lean = -float(down[0] / max(down[1], _STEP))
    return np.array(
        [loops / long, turned / long, right / some, sharp / some, tops, feet, movements / long, lean, rhythm]
    )


def _count_loops(path: Array) -> int:
    """Loops of a path (n, 2) of even steps, one after the other: it crosses itself around more than a sliver."""
    n = len(path) - 1
    z = path @ np.array([1.0, 1j])

    def side(p: Array, q: Array, r: Array) -> Array:
        return ((q - p).conj() * (r - p)).imag

    ahead = np.minimum(np.arange(n)[:, None] + np.arange(2, _REACH + 1), n)
    away_x, away_y = (column[ahead] - column[:n, None] for column in path.T)
    of = np.diff(path[:, 0])[:, None] * away_y - np.diff(path[:, 1])[:, None] * away_x
    begin, way = np.nonzero(of[:, :-1] * of[:, 1:] < 0)
    after = begin + way + 2
    a, b, c, d = z[begin], z[begin + 1], z[after], z[after + 1]
    swept = np.concatenate([[0.0], np.cumsum((z[:-1].conj() * z[1:]).imag)])
    area = 0.5 * np.abs(swept[after] - swept[begin + 1] + (c.conj() * b).imag)
    looped = (side(c, d, a) * side(c, d, b) < 0) & (area > _LEAST_LOOP)
    count, done = 0, -1
    pairs = zip(begin[looped].tolist(), after[looped].tolist(), strict=True)
    for start, end in sorted(pairs, key=lambda pair: pair[1]):
        if start >= done:
            count, done = count + 1, end
    return count


def manner_distance(a: Array, b: Array) -> float:
    """How far two manners are apart: root of the mean square of their differences, in `SPREADS`."""
    return float(np.sqrt(np.mean(((a - b) / SPREADS) ** 2)))
