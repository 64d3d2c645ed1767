"""The line of one letter and its strokes; what tells dots and accents from the rest, and loops from their reverse."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from handout.hand.letter_classes import BOWLED, LOOPED_ABOVE, LOOPED_BELOW
from handout.motion.recovery import letter_forms
from handout.motion.recovery.network import BranchNetwork
from handout.values import Array, Indices

POINTED = frozenset(".:…")  # marks that are points, and nothing else
DOT = 0.35  # x-heights: a piece up to this long is a dot
_DASH = 0.9  # x-heights: so is one up to this long that lies over all the rest
_UNDER = 0.1  # x-heights by which such a piece may begin lower than the rest ends
_ONE_FOOT = frozenset("ituw")
_ON_LINE, _LOW_END = 0.4, 0.8  # x-heights over the baseline: ends of feet are lower, and of what leads on
_BELOW = -0.05  # x-heights over the baseline: where loops of tails are
_LEAST = 6.0  # square half widths: what encloses less is a line gone over twice


@dataclass(frozen=True, eq=False)
class LetterLine:
    """The line of one letter: its body, and where it is joined the ligatures to its neighbours.

    xy : (n, 2), y up; radius, density : (n,); edges : (m, 2), as in `values.LineGraph`.
    x_height : in the unit of `xy`.
    entries, exits : vertices at loose ends where the pen comes from the letter before, and goes to the next.
    bar_entries : vertices at loose ends where a crossbar comes in from the letter before.
    joined_hand : whether it is of a hand that joins letters, if not all.
    baseline : y of it, None where that is not known.
    own_bars, foreign_bars : vertices along the crossbars that are known from the whole word: the letter's own, and
        those of others.
    usual : radius and density of the line where the pen passes once; default: the medians of this line.
    bar_overlaps : for each of both vertices before and after it that it shares with other strokes.
    """

    xy: Array
    radius: Array
    density: Array
    edges: Indices
    x_height: float
    entries: tuple[int, ...] = ()
    exits: tuple[int, ...] = ()
    bar_entries: tuple[int, ...] = ()
    joined_hand: bool = False
    baseline: float | None = None
    own_bars: tuple[Indices, ...] = ()
    foreign_bars: tuple[Indices, ...] = ()
    bar_overlaps: tuple[tuple[Indices, Indices], ...] = ()
    usual: tuple[float, float] | None = None

    @property
    def joints(self) -> set[int]:
        """Vertices where it is cut off from what else the pen wrote."""
        return {*self.entries, *self.exits, *self.bar_entries}


@dataclass(frozen=True, eq=False)
class LetterStrokes:
    """How a letter was written.

    strokes : vertices of its line in order, for each pen-down movement.
    delayed : for each, whether it is written after the word.
    bars : for each, whether it is a crossbar, or else what forms of the letter delay, whenever this one was written.
    guessed : whether the ink, the letter and its writer's habit make another order about as likely.
    """

    strokes: tuple[Indices, ...]
    delayed: tuple[bool, ...]
    bars: tuple[bool, ...] = ()
    guessed: bool = False


@dataclass(frozen=True, eq=False)
class Candidate:
    """A way in which a letter may have been written.

    strokes : as in `LetterStrokes`.
    cost : what it costs a hand, and how unlike the forms of the letter it is.
    flags : gives `LetterStrokes.delayed` and `LetterStrokes.bars`; worked out for the chosen candidate only.
    """

    strokes: tuple[Indices, ...]
    cost: float
    flags: Callable[[], tuple[tuple[bool, ...], tuple[bool, ...]]]

    @cached_property
    def letter_strokes(self) -> LetterStrokes:
        """The letter written so."""
        return LetterStrokes(self.strokes, *self.flags())


def trace_as_told(candidates: Sequence[Candidate], said: Sequence[Indices]) -> Candidate:
    """A letter written along strokes that a person gave, vertices of its line; when each is written a candidate tells.

    That is the cheapest: of each stroke that of its own which has most of it.
    """
    known = candidates[0]

    def flags() -> tuple[tuple[bool, ...], tuple[bool, ...]]:
        delayed, bars = known.flags()
        like = [int(np.argmax([np.isin(stroke, own).sum() for own in known.strokes])) for stroke in said]
        return tuple(delayed[i] for i in like), tuple((bars or delayed)[i] for i in like)

    return Candidate(tuple(said), known.cost, flags)


def has_dots(letter: str) -> bool:
    """Whether pieces apart from a letter's line are dots or accents."""
    return letter in ("i", "j") or len(unicodedata.normalize("NFD", letter)) > 1


def find_points(net: BranchNetwork) -> tuple[Indices, ...]:
    """The points of a mark that has nothing else, from above or from left to right; none if it has."""
    if any(len(ends) > 1 for ends in net.ends_at.values()):
        return ()
    middle = np.array([net.xy[path].mean(axis=0) for path in net.branches])
    across = np.ptp(middle, axis=0)
    order = np.argsort(-middle[:, 1] if across[1] > across[0] else middle[:, 0])
    return tuple(_rightwards(net, net.branches[b]) for b in order.tolist())


def find_dots(net: BranchNetwork, x_height: float, baseline: float | None, joints: set[int]) -> dict[int, Indices]:
    """Branch → vertices, from left to right, of pieces that are dots or accents.

    Where there is nothing else, only what is known to be over the x-height is one.
    """
    length = net.length * net.half_width / x_height
    low, high = (np.array([extreme(net.xy[path, 1]) for path in net.branches]) for extreme in (np.min, np.max))
    # branches that meet no other
    apart = [len(path) == 1 or (net.is_loose(2 * b) and net.is_loose(2 * b + 1)) for b, path in enumerate(net.branches)]
    short = np.array([alone and joints.isdisjoint(p.tolist()) for alone, p in zip(apart, net.branches, strict=True)])
    short &= length < _DASH
    top = high[~short].max(initial=-np.inf) if not short.all() else np.inf
    dots = np.flatnonzero(short & ((length < DOT) | (low > top - _UNDER * x_height))).tolist()
    if len(dots) == len(net.branches):
        least = np.inf if baseline is None else baseline + x_height
        dots = [b for b in dots if low[b] > least]
    return {b: _rightwards(net, net.branches[b]) for b in dots}


def _rightwards(net: BranchNetwork, path: Indices) -> Indices:
    """A path from its left to its right end."""
    return path if net.xy[path[0], 0] <= net.xy[path[-1], 0] else path[::-1]


def find_lead_in(net: BranchNetwork, line: LetterLine, letter: str) -> int | None:
    """The loose end on the line, left of all other low ones, at which a letter begins that no other leads to.

    A t, i, u or w has but one foot, which bends to the right.
    """
    if line.entries or letter not in _ONE_FOOT or line.baseline is None:
        return None
    loose = [(*net.position(end).tolist(), end) for end in range(len(net.node)) if net.is_loose(end)]
    low = sorted(end for end in loose if end[1] < line.baseline + _LOW_END * line.x_height)
    if len(low) + bool(line.exits) < 2 or not low or low[0][1] > line.baseline + _ON_LINE * line.x_height:
        return None
    return int(low[0][2])


def loop_direction_errors(
    net: BranchNetwork, strokes: Sequence[Sequence[int]], letter: str, baseline: float | None, x_height: float
) -> int:
    """Count the loops of a traversal that run the wrong way round.

    A loop of l or d goes up on its right and comes down on its left, and so do the bowls of a and o; the tail of g or y
    goes down on its right and comes up on its left.  The two lines of a narrow loop part so smoothly that how they go
    on does not tell which is which.

    strokes : for each the ends by which the pen leaves one node after the other.
    baseline : y of it, None where that is not known.
    x_height : in the unit of the network.
    """
    if baseline is None and letter not in (BOWLED | LOOPED_ABOVE) - LOOPED_BELOW:
        return 0
    tail = -np.inf
    if letter in LOOPED_BELOW and baseline is not None:
        tail = baseline + _BELOW * x_height
    stem = -np.inf if letter in BOWLED else _stem_height(net, letter, baseline, x_height)
    least = _LEAST * net.half_width**2
    errors, nodes = 0, net.node.tolist()
    for stroke in strokes:
        step_of: dict[int, int] = {}
        for step, node in enumerate([*(nodes[end] for end in stroke), nodes[stroke[-1] ^ 1]]):
            if node in step_of:
                errors += _is_reversed([net.extent(end) for end in stroke[step_of[node] : step]], least, tail, stem)
            step_of[node] = step
    return errors


def _stem_height(net: BranchNetwork, letter: str, baseline: float | None, x_height: float) -> float:
    """y over which the middle of a loop is that of a stem."""
    weights = letter_forms.WEIGHTS
    if baseline is not None:
        return baseline + weights.loop_above * x_height
    if letter not in LOOPED_ABOVE:
        return np.inf
    heights = np.concatenate([net.xy[path, 1] for path in net.branches])
    low, high = float(heights.min()), float(heights.max())
    return low + weights.loop_high * (high - low)


def _is_reversed(branches: Sequence[tuple[float, float, float]], least: float, tail: float, above: float) -> bool:
    """Whether a loop over some branches, measured, is the wrong way round.

    least : area; a loop of less is a line gone over twice.
    tail : y under which it is that of a tail; above : y over which it is that of a stem or bowl.
    """
    middle = (min(low for low, _, _ in branches) + max(high for _, high, _ in branches)) / 2
    if middle >= tail and not middle > above:
        return False
    area = sum(twice for _, _, twice in branches) / 2
    if abs(area) < least:
        return False
    return area > 0 if middle < tail else area < 0
