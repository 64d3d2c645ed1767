"""Glyphs with known faults: ink of simulated pages given to the wrong letters on purpose.

The faults are those that reading makes: a letter takes a part of its neighbour or loses one to it, a part of it is
nobody's, it takes a dot, a comma or a piece of any letter near it, or two letters change places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.values import Array, Indices, LineGraph

NOBODY = -1  # the letter of ink that belongs to none


@dataclass(frozen=True)
class SpoilingSettings:
    """Lengths in x-heights; set by eye, so that faults look like those of real pages."""

    share: float = 0.12  # of the letters
    kinds: tuple[float, ...] = (0.3, 0.15, 0.2, 0.12, 0.13, 0.1)  # chances of the faults, in the order of `_FAULTS`
    taken: tuple[float, float] = (0.25, 1.2)  # length of a neighbour's line
    lost: tuple[float, float] = (0.2, 0.7)  # share of a letter's line
    near: float = 1.8  # from the middle of a letter to the pieces that it may take whole
    small: float = 1.2  # length of such a piece
    around: tuple[float, float] = (0.35, 0.9)  # of a place on a letter, within which it takes everything
    least: float = 0.3  # of foreign or lacking line that makes a letter wrong
    part: float = 0.12  # of its own line, where that is more
    gone: float = 0.5  # of its own line that is lacking, where that is less: marks are small


SETTINGS = SpoilingSettings()


class Spoiler:
    """Spoils letters of a page whose owners are known.

    Parameters
    ----------
    graph : of the page.
    owner : (n,) int: the letter of each vertex, −1 for none, and for ligatures, which are neither letter's.
    x_height : mm.
    """

    def __init__(self, graph: LineGraph, owner: Indices, x_height: float) -> None:
        self._owner, self.place, self.piece = owner, graph.xy / x_height, graph.components
        a, b = graph.edges.T
        step = np.hypot(*(self.place[a] - self.place[b]).T) / 2
        self.length = np.bincount(a, step, minlength=len(owner)) + np.bincount(b, step, minlength=len(owner))

    def spoilt(self, letters: Indices, rng: np.random.Generator) -> Indices:
        """(n,): the letters of the vertices, some of them changed on purpose."""
        letters = letters.copy()
        each = np.unique(letters[letters != NOBODY])
        for letter in rng.permutation(each)[: round(SETTINGS.share * len(each))].tolist():
            own = np.flatnonzero(letters == letter)
            beside = letter + int(rng.choice([-1, 1]))
            neighbours = np.flatnonzero(letters == beside) if beside >= 0 else own[:0]
            fault = _FAULTS[int(rng.choice(len(_FAULTS), p=SETTINGS.kinds))]
            if len(own) and (len(neighbours) or fault in _ALONE):
                fault(_Case(self, letters, letter, beside, own, neighbours, rng))
        return letters

    def wrong(self, letters: Indices, names: Indices) -> Array:
        """(k,) bool: whether letters `names` (k,) have foreign ink or lack some; `letters` (n,) are the vertices'."""
        count = int(max(self._owner.max(), letters.max(), names.max())) + 2
        alike = letters == self._owner
        taken = np.where(alike | (self._owner == NOBODY), NOBODY, letters)
        lost = np.where(alike, NOBODY, self._owner)
        whole, foreign, lacking = (
            np.bincount(of + 1, self.length, minlength=count) for of in (self._owner, taken, lost)
        )
        bound = np.maximum(SETTINGS.least, SETTINGS.part * whole)
        bad = (foreign > bound) | (lacking > np.minimum(bound, SETTINGS.gone * whole + 1e-9))
        return np.asarray(bad[names + 1])

    def first(self, vertices: Indices, angle: float, length: float) -> Indices:
        """As many of some vertices as make `length`, those first that lie furthest against a direction."""
        order = np.argsort(self.place[vertices] @ np.array([np.cos(angle), np.sin(angle)]))
        return vertices[order[np.cumsum(self.length[vertices][order]) <= length]]


@dataclass(frozen=True, eq=False)
class _Case:
    """A letter that is to be spoilt, and a neighbour; `own` and `other` are their vertices, `letters` is changed."""

    spoiler: Spoiler
    letters: Indices
    letter: int
    beside: int
    own: Indices
    other: Indices
    rng: np.random.Generator

    def length(self, vertices: Indices) -> float:
        return float(self.spoiler.length[vertices].sum())

    def angle(self, towards: bool) -> float:
        """The direction in which the vertices lie that are taken last."""
        rightwards = (self.beside > self.letter) == towards
        return (0.0 if rightwards else np.pi) + float(self.rng.normal(0, _TURN))


_TURN = 0.4  # standard deviation, rad, of the line along which two neighbours are parted


def _takes(case: _Case) -> None:
    length = min(case.rng.uniform(*SETTINGS.taken), 0.8 * case.length(case.other))
    case.letters[case.spoiler.first(case.other, case.angle(True), length)] = case.letter


def _gives(case: _Case) -> None:
    length = case.rng.uniform(*SETTINGS.lost) * case.length(case.own)
    case.letters[case.spoiler.first(case.own, case.angle(False), length)] = case.beside


def _loses(case: _Case) -> None:
    length = case.rng.uniform(*SETTINGS.lost) * case.length(case.own)
    case.letters[case.spoiler.first(case.own, case.rng.uniform(0, 2 * np.pi), length)] = NOBODY


def _takes_piece(case: _Case) -> None:
    place, piece = case.spoiler.place, case.spoiler.piece
    away = np.hypot(*(place - place[case.own].mean(axis=0)).T)
    pieces = np.unique(piece[(away < SETTINGS.near) & (case.letters != case.letter) & (case.letters != NOBODY)])
    small = pieces[np.bincount(piece, case.spoiler.length)[pieces] < SETTINGS.small]
    if len(small):
        case.letters[piece == case.rng.choice(small)] = case.letter


def _takes_around(case: _Case) -> None:
    away = np.hypot(*(case.spoiler.place - case.spoiler.place[case.rng.choice(case.own)]).T)
    case.letters[(away < case.rng.uniform(*SETTINGS.around)) & (case.letters != NOBODY)] = case.letter


def _swaps(case: _Case) -> None:
    case.letters[case.own], case.letters[case.other] = case.beside, case.letter


_FAULTS = (_takes, _gives, _loses, _takes_piece, _takes_around, _swaps)
_ALONE = (_loses, _takes_piece, _takes_around)  # faults that need no neighbour
