"""How one author writes a letter: much the same way each time.

A single instance of a letter is easily followed wrongly where its line has run together; most instances of it on the
author's pages are not.  Some of them are followed in all ways that cost little; the ways that are found again in the
others of them are the author's own, and beside the forms of the built-in hands they tell how each instance was written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handout.motion.recovery.likeness import unlikeness
from handout.motion.recovery.lines import Line, Way
from handout.motion.recovery.models import SAMPLES, Models, along, frame
from handout.values import Array, Indices

POOL = 6  # instances of a letter that tell how its author writes it
WAYS = 5  # of writing an instance that are weighed
MARGIN = 4.5  # one that costs so much more than the cheapest is not made good by the author's habit
_SHARP = 12.0  # of unlikeness 1: how much less likely it makes it that two instances were written the same way
_WEIGHT = 2.0  # costs of a way for one unit less of log likelihood
_STRAY = 0.003  # share of instances that are written in ways of their own
_DOUBT = 1.0  # instances seen that follow no habit
_WARM = 1.0  # costs that make a way less likely by e
_ROUNDS = 3
_EXACT = 0.03  # of the logarithm of a size, and of a slant: differences that do not matter
_LEAST = 0.05  # a way less likely tells nothing of the others


@dataclass(frozen=True, eq=False)
class Instance:
    """One glyph of a hand, and the ways in which it may have been written.

    ways : the cheapest first.
    parts : for each of them the places (n, 2) of its strokes in the body of the glyph, y up; none where it has none.
    body : (n, 2) float: places all over the body.
    """

    ways: Sequence[Way]
    parts: Sequence[Sequence[Array]]
    body: Array


def instance(ways: Sequence[Way], line: Line, count: int) -> Instance:
    """An instance of a letter, the first `count` vertices of whose line are its body, the others its joins."""
    parts = []
    for way in ways:
        # a bar that comes in from the letter before is nothing of this one
        within = [v for v in way.strokes if v[0] not in line.through] or way.strokes
        own = [line.xy[stroke[stroke < count]] for stroke in within]
        parts.append([xy for xy in own if len(xy) > 1])
    return Instance(ways, parts, line.xy[:count])


def usual(sizes: Array, most: int) -> Indices:
    """(k,) int: which instances of a letter, of which sizes (n, k) are known, are most as the others are."""
    away = np.abs(sizes - np.median(sizes, axis=0))
    away /= np.median(away, axis=0) + _EXACT
    return np.sort(np.argsort(away.sum(axis=1), kind="stable")[:most])


@dataclass(frozen=True, eq=False)
class Habit:
    """How an author writes one letter.

    models : the ways in which its instances may have been written, as forms.
    owner : (f,) int: which instance each is of.
    share : (f,) float: how likely that one was written so.
    alike : number of an instance that the habit was learned from → (w, f) 0–1: how like its ways are to the forms.
    """

    models: Models
    owner: Indices
    share: Array
    alike: Mapping[int, Array]

    def choose(self, one: Instance, own: int = -1) -> Way:
        """How an instance was written; `own` is its number among those that the habit was learned from."""
        if len(one.ways) == 1 or not all(one.parts):
            return one.ways[0]
        others = self.owner != own
        alike = self.alike[own] if own in self.alike else _alike(one, self.models)
        count = len(np.unique(self.owner[others]))
        return one.ways[int((_costs(one) + _cost(alike @ (self.share * others), count)).argmin())]


def habit(pool: Sequence[Instance]) -> Habit | None:
    """What some instances of a letter tell of how their author writes it; None where there are not two to compare.

    The instances explain one another: how likely each way of one is depends on how like it is to the likely ways of the
    others (the mean field of a mixture in which every instance is drawn from the ways of the others).
    """
    known = [one for one in pool if all(one.parts)]
    if len(known) < 2:
        return None
    models, owner = _models(known), np.repeat(np.arange(len(known)), [len(one.ways) for one in known])
    alike = np.concatenate([_alike(one, models) for one in known]) * (owner[:, None] != owner)
    costs = np.concatenate([_costs(one) for one in known])
    share = _shares(costs, owner)
    for _ in range(_ROUNDS):
        share = _shares(costs + _cost(alike @ share, len(known) - 1), owner)
    kept = np.flatnonzero(share >= _LEAST)
    numbers = np.array([k for k, one in enumerate(pool) if all(one.parts)], dtype=np.intp)
    own = {k: alike[owner == i][:, kept] for i, k in enumerate(numbers.tolist())}
    return Habit(models.take(kept), numbers[owner[kept]], share[kept], own)


def _models(pool: Sequence[Instance]) -> Models:
    """All ways of some instances as forms, each laid in the frame of its letter's body."""
    found, of = [], []
    for one in pool:
        middle = one.body.mean(axis=0)
        matrix = np.linalg.inv(frame(one.body - middle)).T
        for parts in one.parts:
            places, which = along(parts, SAMPLES)
            found.append((places - middle) @ matrix)
            of.append(which)
    count = len(found)
    late, ends = np.zeros((count, SAMPLES), dtype=np.bool_), (np.zeros((0, 2)),) * count
    strokes = np.array([len(parts) for one in pool for parts in one.parts], dtype=np.intp)
    return Models(np.array(found), np.array(of), late, strokes, ends, np.zeros(count), late[:, 0])


def _alike(one: Instance, forms: Models) -> Array:
    """(w, f) 0–1: how like each way of an instance is to some forms."""
    middle = one.body.mean(axis=0)
    laid = forms.xy @ frame(one.body - middle).T + middle
    # where the letter is cut off from its joins differs from instance to instance
    return np.asarray(np.exp(-_SHARP * unlikeness(one.parts, forms, laid, entered=True, left=True)))


def _costs(one: Instance) -> Array:
    return np.array([way.cost for way in one.ways]) - one.ways[0].cost


def _cost(alike: Array, count: int) -> Array:
    """Of ways that are so like those of `count` other instances, all together."""
    return np.asarray(-_WEIGHT * np.log(alike / (count + _DOUBT) + _STRAY))


def _shares(costs: Array, owner: Indices) -> Array:
    """(f,): how likely each way is among those of its instance."""
    least = np.full(int(owner[-1]) + 1, np.inf)
    np.minimum.at(least, owner, costs)
    likely = np.exp((least[owner] - costs) / _WARM)
    return np.asarray(likely / np.bincount(owner, likely)[owner])
