"""Which letter every vertex of the line graph belongs to, after the columns have been aligned.

A column cut is wrong where a comma lies under the letter before it, where a g's tail swings under its neighbour, where
a bar or the last stroke of a word reaches out.  Here whole components, and whole branches within a component, follow
the letter they are joined to; a component is cut only where its line runs from one letter's column into the next.

Source: seed 000, §5.1.3 (labels, splits, links); whole components and branches: own method.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches, number_pieces
from handout.hand.diacritics import NOT_ABOVE, decompose_grapheme
from handout.hand.letter_classes import NEVER_DESCENDING, NOT_ASCENDING
from handout.hand.places import graphemes
from handout.hand.scanned import NOBODY
from handout.tagging.alignment import AlignedLine, Alignment
from handout.tagging.line_space import X_HEIGHT
from handout.values import Array, Indices, LineGraph

_LOW_MARKS, _HIGH_MARKS = frozenset(",.…"), frozenset("'\"’‘“”`^~*°")
_MARKS = _LOW_MARKS | _HIGH_MARKS | frozenset(":;")
_DOTTED = frozenset('ij!?:;%=÷"”“…¡¿') | _HIGH_MARKS


@dataclass(frozen=True)
class AssignmentSettings:
    """Lengths in x-heights; set by eye on real pages, `cut` so that ascenders keep their loops."""

    lowest: float = -0.45  # of letters without tails
    highest: float = 1.35  # of letters without stems
    near: float = 0.7  # x-heights from a mark's column to its ink
    high: float = 0.75  # over the baseline: marks above it
    low: float = 0.55  # over the baseline: marks below it
    dot: float = 0.3  # width of a dot, and how far it is from the other of a colon, across
    cut: float = 0.015  # a stroke is cut where that spares it more of running outside its letter's column, x-heights³
    length: float = 1.0  # of a piece of line that belongs to the letter of its column, joined to the rest of it or not
    anchor: float = 0.35  # x-heights: anchors are sought as near to this height as there is ink


_SETTINGS = AssignmentSettings()
# x-heights from the middle of what joins two letters to where the second begins to the networks, whose examples have
# letters begin close before their bodies, in a hand that joins all; in others as much less as they join fewer. Of the
# joined letters of four simulated pages 9 to 22 % had .3 x-heights of a neighbour's stroke, or lacked as much, where
# they were cut at that beginning, and 6 to 9 % do now; of two pages kept out 23 and 9 %, and 17 and 5. As much in every
# hand gave legs of printed letters away.
LEAD = 0.12
_NEVER = 1e6  # cost that no path takes


@dataclass(frozen=True, eq=False)
class Assignment:
    """The letters of a line graph.

    letter : (n,) int: index of each vertex's letter in `Alignment.letters`, −1 for none.
    joints : (k,) int: the edges that lead from one letter to another: there a ligature is cut.
    """

    letter: Indices
    joints: Indices

    def vertices(self, letter: int) -> Indices:
        """The vertices of one letter."""
        return np.flatnonzero(self.letter == letter)


def assign_letters(graph: LineGraph, alignment: Alignment, owner: NDArray[np.integer]) -> Assignment:
    """Give every vertex of a page to a letter.

    graph : LineGraph, of the page; its `uv` are pixels.
    owner : (n,) int: number of the line that each vertex belongs to (see `line_space.vertex_lines`), −1 for none.
    """
    letter = np.full(len(graph), NOBODY, dtype=np.intp)
    first = 0
    for line in alignment.lines:
        vertices = np.flatnonzero(np.asarray(owner) == line.number)
        of_line = _Line(graph, line, vertices).assign_vertices()
        letter[vertices] = np.where(of_line >= 0, of_line + first, NOBODY)
        first += len(line.letters)
    a, b = graph.edges.T
    joints = np.flatnonzero((letter[a] != letter[b]) & (letter[a] >= 0) & (letter[b] >= 0))
    return Assignment(letter, joints)


class _Line:
    """One line's vertices while they are shared out; all lengths in x-heights."""

    def __init__(self, graph: LineGraph, line: AlignedLine, vertices: Indices) -> None:
        self.names = [graphemes(letter.text)[0] if letter.text else "" for letter in line.letters]
        self.marked = np.array([n in ("i", "j") or not {*decompose_grapheme(n)[1]} <= NOT_ABOVE for n in self.names])
        self.present = np.array([letter.present for letter in line.letters], dtype=bool)
        place = line.frame.to_line(graph.uv[vertices]) / X_HEIGHT
        self.u, self.up = place.T
        unit = line.frame.scale / X_HEIGHT
        self.left = np.array([(letter.left - line.frame.left) * unit for letter in line.letters])
        self.right = np.array([(letter.right - line.frame.left) * unit for letter in line.letters])
        number = np.full(len(graph), -1, dtype=np.intp)
        number[vertices] = np.arange(len(vertices))
        edges = number[graph.edges]
        self.edges = edges[(edges >= 0).all(axis=1)]
        self.whole = number_pieces(self.edges, len(vertices))
        meeting = np.flatnonzero(self.left[1:] <= self.right[:-1])
        lead = LEAD * self._share_joined([letter.at for letter in line.letters])
        self.left[meeting + 1] -= lead
        self.right[meeting] -= lead
        self.column = self._columns()

    def _share_joined(self, at: Sequence[int]) -> float:
        """Share of neighbours in words, both of which have ink amid their columns, of which one piece of line does."""
        outside = np.maximum(self.left - self.u[:, None], self.u[:, None] - self.right)
        amid = np.zeros((int(self.whole.max(initial=0)) + 1, len(at)), dtype=bool)
        np.logical_or.at(amid, self.whole, outside < (self.left - self.right) / 3)
        word = np.array([name.isalpha() for name in self.names], dtype=bool) & np.asarray(amid.any(axis=0))
        beside = word[1:] & word[:-1] & (np.diff(at) == 1)
        joined = np.asarray((amid[:, 1:] & amid[:, :-1]).any(axis=0))
        return float(joined[beside].mean()) if beside.any() else 0.0

    def _columns(self) -> Indices:
        """(n,) the letter in whose column each vertex lies, or the nearest; few strokes are cut."""
        if not self.present.any() or not len(self.u):
            return np.full(len(self.u), NOBODY)
        before = self.left[None] - self.u[:, None]
        after = self.u[:, None] - self.right[None]
        # how far each vertex lies above or below what each letter reaches (n, letters); what is there is another's
        low = np.array([_SETTINGS.lowest if name in NEVER_DESCENDING else -np.inf for name in self.names])
        high = np.array([_SETTINGS.highest if name in NOT_ASCENDING else np.inf for name in self.names])
        beyond = np.maximum(np.maximum(self.up[:, None] - high, low - self.up[:, None]), 0)
        away = np.maximum(np.maximum(before, after), 0) + beyond
        away = np.where(self.present, away, np.inf)
        nearest = np.asarray(away.argmin(axis=1))
        paths = branches(self.edges, len(self.u))
        # where strokes meet, they settle together which letter that is; then each is cut knowing its ends
        votes_at: dict[int, list[int]] = {}
        for path, letters in zip(paths, self._cut_paths(paths, nearest, away), strict=True):
            for end in (0, -1):
                votes_at.setdefault(int(path[end]), []).append(int(letters[end]))
        settled = nearest.copy()
        for vertex, votes in votes_at.items():
            settled[vertex] = max(sorted(set(votes)), key=lambda vote: (votes.count(vote), vote == nearest[vertex]))
        pinned = np.where(np.arange(away.shape[1]) == settled[:, None], away, _NEVER)
        meetings = np.array(sorted(votes_at), dtype=np.intp)
        away[meetings] = pinned[meetings]
        for path, letters in zip(paths, self._cut_paths(paths, settled, away), strict=True):
            settled[path] = letters
        return settled

    def _cut_paths(self, paths: Sequence[Indices], nearest: Indices, away: Array) -> Iterator[Indices]:
        """The letter of every vertex of each path: cut seldom, and little outside the letters' columns."""
        for path in paths:
            letters = np.unique(nearest[path])
            if len(letters) == 1:
                yield nearest[path]
                continue
            run = np.hypot(np.diff(self.u[path]), np.diff(self.up[path])).mean()
            yield letters[_fewest_cuts(away[np.ix_(path, letters)] ** 2 * run)]

    def assign_vertices(self) -> Indices:
        """(n,) the letter of each vertex, −1 for none."""
        if not len(self.u) or not self.present.any():
            return np.full(len(self.u), NOBODY)
        anchors = self._anchors()
        letter = self._branches(anchors)
        loose = sorted(set(self.whole.tolist()) - {int(self.whole[v]) for v in anchors.values()})
        pieces = [self.whole == component for component in loose]
        two_parts = [(i, self.u[vertex]) for i, vertex in anchors.items() if self.names[i] in (":", ";")]
        takers = [self._free(piece, two_parts) for piece in pieces]
        for piece, taker in zip(pieces, self._share_dots(pieces, takers), strict=True):
            letter[piece] = taker
        return letter

    def _anchors(self) -> dict[int, int]:
        """Letter → the vertex that is surely its own.  Marks come last and take what no letter has."""
        anchors: dict[int, int] = {}
        used: set[int] = set()
        marks = [i for i, name in enumerate(self.names) if name in _MARKS and self.present[i]]
        for i in range(len(self.names)):
            vertex = self._middle(i) if self.present[i] and i not in marks else None
            if vertex is not None:
                anchors[i] = vertex
                used.add(int(self.whole[vertex]))
        for i in marks:
            # the free vertex nearest to the mark's column, at a height where such marks are
            free = ~np.isin(self.whole, list(used))
            distance = np.maximum(np.maximum(self.left[i] - self.u, self.u - self.right[i]), 0)
            fitting = free & (distance <= _SETTINGS.near)
            if self.names[i] in _LOW_MARKS:
                fitting &= self.up < _SETTINGS.low
            elif self.names[i] in _HIGH_MARKS:
                fitting &= self.up > _SETTINGS.high
            candidates = np.flatnonzero(fitting)
            vertex = int(candidates[distance[candidates].argmin()]) if len(candidates) else None
            if vertex is None:
                vertex = self._middle(i)
            if vertex is not None:
                anchors[i] = vertex
                used.add(int(self.whole[vertex]))
        return anchors

    def _middle(self, i: int) -> int | None:
        """The vertex in the middle of a letter's column that is nearest to the usual height."""
        third = (self.right[i] - self.left[i]) / 3
        in_column = self.column == i
        inner = in_column & (self.u >= self.left[i] + third) & (self.u <= self.right[i] - third)
        candidates = np.flatnonzero(inner if inner.any() else in_column)
        return int(candidates[np.abs(self.up[candidates] - _SETTINGS.anchor).argmin()]) if len(candidates) else None

    def _branches(self, anchors: dict[int, int]) -> Indices:
        """(n,) letters within components that have anchors: pieces follow what they are joined to."""
        a, b = self.edges.T
        inside = self.column[a] == self.column[b]
        for vertex, letter in ((v, i) for i, v in anchors.items()):
            # a mark's component may lie in another letter's column: it is the mark's all the same
            if self.column[vertex] != letter:
                component = self.whole == self.whole[vertex]
                self.column = np.where(component, letter, self.column)
                inside = self.column[a] == self.column[b]
        piece = number_pieces(self.edges[inside], len(self.u))
        holder = np.full(int(piece.max()) + 1, NOBODY)
        a, b = self.edges[inside].T
        steps = np.hypot(self.u[a] - self.u[b], self.up[a] - self.up[b])
        for number in np.flatnonzero(np.bincount(piece[a], steps, minlength=len(holder)) >= _SETTINGS.length):
            holder[number] = self.column[np.argmax(piece == number)]
        for letter, vertex in anchors.items():
            holder[piece[vertex]] = letter
        across = piece[self.edges[~inside]]
        _follow(holder, across)
        return holder[piece]

    def _share_dots(self, pieces: Sequence[NDArray[np.bool_]], takers: list[int]) -> list[int]:
        """The letters of loose pieces: an i, j or accented letter with none takes one from an i or j that has two."""
        dots = {
            k: float(self.u[piece].mean()) for k, piece in enumerate(pieces) if self.up[piece].mean() > _SETTINGS.high
        }
        for i in np.flatnonzero(self.marked & self.present).tolist():
            given = [takers[k] for k in dots]
            spare = [k for k in dots if self.names[takers[k]] in ("i", "j") and given.count(takers[k]) > 1]
            away = [max(self.left[i] - dots[k], dots[k] - self.right[i], 0.0) for k in spare]
            if i not in given and spare and min(away) <= _SETTINGS.near:
                takers[spare[int(np.argmin(away))]] = i
        return takers

    def _free(self, component: NDArray[np.bool_], two_parts: Sequence[tuple[int, float]]) -> int:
        """The letter that a component without any letter of its own belongs to: a dot, a bar, an accent, a speck.

        two_parts : colons and semicolons, and where the dot is that they have: one above or below it is theirs, too.
        """
        middle, height = float(self.u[component].mean()), float(self.up[component].mean())
        if np.ptp(self.u[component]) < _SETTINGS.dot and height <= _SETTINGS.high:
            for i, at in two_parts:
                if abs(at - middle) <= _SETTINGS.dot:
                    return i
        away = np.maximum(np.maximum(self.left - middle, middle - self.right), 0)
        away = np.where(self.present, away, np.inf)
        dotted = np.array([name in _DOTTED or not name.isascii() for name in self.names])
        if height > _SETTINGS.high and (dotted & (away <= _SETTINGS.near)).any():
            away = np.where(dotted, away, np.inf)
        elif height <= _SETTINGS.high and middle < self.left[self.present].min():
            return int(np.flatnonzero(self.present)[0])
        return int(away.argmin())


def _fewest_cuts(cost: Array) -> Indices:
    """(n,) which of the columns of `cost` (n, k) each row takes, a change from one to another costing `cut`."""
    total, came = cost[0], np.zeros(cost.shape, dtype=np.intp)
    for row in range(1, len(cost)):
        best = int(total.argmin())
        changes = total[best] + _SETTINGS.cut < total
        came[row] = np.where(changes, best, np.arange(cost.shape[1]))
        total = np.where(changes, total[best] + _SETTINGS.cut, total) + cost[row]
    chosen = np.empty(len(cost), dtype=np.intp)
    chosen[-1] = int(total.argmin())
    for row in range(len(cost) - 1, 0, -1):
        chosen[row - 1] = came[row, chosen[row]]
    return chosen


def _follow(holder: Indices, across: Indices) -> None:
    """Pieces without a letter take that of a neighbour, those with most neighbours of one letter first."""
    while True:
        open_ = (holder[across] == NOBODY) & (holder[across[:, ::-1]] != NOBODY)
        if not open_.any():
            return
        votes: dict[int, list[int]] = {}
        for side in (0, 1):
            for piece, other in zip(across[open_[:, side], side], across[open_[:, side], 1 - side], strict=True):
                votes.setdefault(int(piece), []).append(int(holder[other]))
        for piece, letters in votes.items():
            holder[piece] = max(set(letters), key=lambda letter: (letters.count(letter), -letter))


def by_letter(assignment: Assignment, count: int) -> Sequence[Indices]:
    """The vertices of each of `count` letters."""
    order = np.argsort(assignment.letter, kind="stable")
    bounds = np.searchsorted(assignment.letter[order], np.arange(count + 1))
    return [order[a:b] for a, b in pairwise(bounds)]
