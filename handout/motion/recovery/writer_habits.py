"""Habits of a writer: a letter is written much the same way each time.

A single instance of a letter is easily traced wrongly where its line has run together; most instances of it on the
writer's pages are not.  Some of them are traced in all candidate ways that cost little; those that are found again in
the others are the writer's own, and beside the forms of the built-in hands they tell how each instance was written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handout.motion.recovery.form_matching import form_distances
from handout.motion.recovery.letter_forms import SAMPLES, LetterForms, frame_of, resample_strokes
from handout.motion.recovery.letter_line import Candidate, LetterLine
from handout.values import Array, Indices

POOL = 6  # instances of a letter that tell how its writer writes it
CANDIDATES = 8  # ways of writing an instance that are weighed
MARGIN = 6.0  # a way that costs so much more than the cheapest is dropped, whatever the writer's habit
# An order is guessed where another, so much of the letter apart, costs that little more.  Set on recorded words of one
# writer; by `benchmarks.order_recovery`, of other writers' words that are told so about half are wrong.
DOUBT = 0.5
REORDERED = 0.1


@dataclass(frozen=True)
class WriterHabitSettings:
    """The model of habits; the share of words all right is measured by `benchmarks.order_recovery`."""

    sharp: float = 12.0  # how much less likely a form distance of 1 makes it that two instances were written alike
    weight: float = 2.0  # costs of a candidate for one unit less of log likelihood
    stray: float = 0.003  # share of instances that are written in ways of their own
    doubt: float = 1.0  # instances seen that follow no habit
    told: float = 4.0  # an instance of which a person said how it was written counts for so many; set by eye
    warm: float = 1.0  # costs that make a candidate less likely by e
    rounds: int = 3
    least: float = 0.05  # a candidate less likely tells nothing of the other instances


_SETTINGS = WriterHabitSettings()


@dataclass(frozen=True, eq=False)
class Instance:
    """One glyph of a hand, and the ways in which it may have been written.

    candidates : the cheapest first.
    parts : for each of them the places (n, 2) of its strokes in the body of the glyph, y up; none where it has none.
    body : (n, 2) float: places all over the body.
    told : whether a person said how it was written.
    """

    candidates: Sequence[Candidate]
    parts: Sequence[Sequence[Array]]
    body: Array
    told: bool = False


def instance_of(candidates: Sequence[Candidate], line: LetterLine, count: int, told: bool = False) -> Instance:
    """An instance of a letter, the first `count` vertices of whose line are its body, the others its joins."""
    parts = []
    for candidate in candidates:
        # a crossbar that comes in from the letter before is none of this one's
        within = [v for v in candidate.strokes if v[0] not in line.bar_entries] or candidate.strokes
        lines = [line.xy[stroke[stroke < count]] for stroke in within]
        parts.append([xy for xy in lines if len(xy) > 1])
    return Instance(candidates, parts, line.xy[:count], told)


@dataclass(frozen=True, eq=False)
class WriterHabit:
    """How a writer writes one letter.

    forms : the ways in which its instances may have been written, as forms.
    owner : (f,) int: which instance each is of.
    share : (f,) float: how likely that one was written so, times how much it counts.
    counts : (f,) float: how much that one counts.
    alike : number of an instance that the habit was learned from → (w, f) 0–1: how like its ways are to the forms.
    """

    forms: LetterForms
    owner: Indices
    share: Array
    counts: Array
    alike: Mapping[int, Array]

    def weigh(self, instance: Instance, number: int = -1) -> Array:
        """Costs of the ways of an instance; `number` is its number among those that the habit was learned from."""
        if len(instance.candidates) == 1 or not all(instance.parts):
            return costs_of(instance)
        others = self.owner != number
        alike = self.alike[number] if number in self.alike else _measure_likeness(instance, self.forms)
        count = self.counts[others][np.unique(self.owner[others], return_index=True)[1]].sum()
        return np.asarray(costs_of(instance) + _cost(alike @ (self.share * others), count))


def learn_habit(pool: Sequence[Instance]) -> WriterHabit | None:
    """What some instances of a letter tell of how their writer writes it; None where there are not two to compare.

    The instances explain one another: how likely each candidate of one is depends on how like it is to the likely
    candidates of the others (the mean field of a mixture in which every instance is drawn from those of the others).
    """
    readable = [instance for instance in pool if all(instance.parts)]
    if len(readable) < 2:
        return None
    forms, owner = (
        _as_forms(readable),
        np.repeat(np.arange(len(readable)), [len(instance.candidates) for instance in readable]),
    )
    alike = np.concatenate([_measure_likeness(instance, forms) for instance in readable]) * (owner[:, None] != owner)
    costs = np.concatenate([costs_of(instance) for instance in readable])
    counts = np.array([_SETTINGS.told if instance.told else 1.0 for instance in readable])
    share, rest = _shares(costs, owner), (counts.sum() - counts)[owner]
    for _ in range(_SETTINGS.rounds):
        share = _shares(costs + _cost(alike @ (counts[owner] * share), rest), owner)
    likely = np.flatnonzero(share >= _SETTINGS.least)
    counts = counts[owner[likely]]
    numbers = np.array([k for k, instance in enumerate(pool) if all(instance.parts)], dtype=np.intp)
    likeness = {k: alike[owner == i][:, likely] for i, k in enumerate(numbers.tolist())}
    return WriterHabit(forms.take(likely), numbers[owner[likely]], counts * share[likely], counts, likeness)


def measure_reordering(a: Sequence[Indices], b: Sequence[Indices]) -> float:
    """How far apart the orders of two ways of one line are: when both first pass each vertex, mean, 0–1 of the way."""
    at = []
    for strokes in (a, b):
        vertices, first = np.unique(np.concatenate(strokes), return_index=True)
        at.append(dict(zip(vertices.tolist(), (first / sum(map(len, strokes))).tolist(), strict=True)))
    return float(np.mean([abs(at[0][v] - at[1][v]) for v in at[0].keys() & at[1].keys()] or [1.0]))


def _as_forms(pool: Sequence[Instance]) -> LetterForms:
    """All ways of some instances as forms, each laid in the frame of its letter's body."""
    places_of, stroke_of = [], []
    for instance in pool:
        middle = instance.body.mean(axis=0)
        matrix = np.linalg.inv(frame_of(instance.body - middle)).T
        for parts in instance.parts:
            places, which = resample_strokes(parts, SAMPLES)
            places_of.append((places - middle) @ matrix)
            stroke_of.append(which)
    count = len(places_of)
    delayed, ends = np.zeros((count, SAMPLES), dtype=np.bool_), (np.zeros((0, 2)),) * count
    strokes = np.array([len(parts) for instance in pool for parts in instance.parts], dtype=np.intp)
    return LetterForms(np.array(places_of), np.array(stroke_of), delayed, strokes, ends, np.zeros(count), delayed[:, 0])


def _measure_likeness(instance: Instance, forms: LetterForms) -> Array:
    """(w, f) 0–1: how like each way of an instance is to some forms."""
    middle = instance.body.mean(axis=0)
    laid = forms.xy @ frame_of(instance.body - middle).T + middle
    # where the letter is cut off from its joins differs from instance to instance
    return np.asarray(np.exp(-_SETTINGS.sharp * form_distances(instance.parts, forms, laid, entered=True, left=True)))


def costs_of(instance: Instance) -> Array:
    """What each way of an instance costs more than the cheapest, whatever its writer's habit."""
    return np.array([candidate.cost for candidate in instance.candidates]) - instance.candidates[0].cost


def _cost(alike: Array, count: Array | float) -> Array:
    """Of ways that are so like those of `count` other instances, all together."""
    return np.asarray(-_SETTINGS.weight * np.log(alike / (count + _SETTINGS.doubt) + _SETTINGS.stray))


def _shares(costs: Array, owner: Indices) -> Array:
    """(f,): how likely each way is among those of its instance."""
    least = np.full(int(owner[-1]) + 1, np.inf)
    np.minimum.at(least, owner, costs)
    likely = np.exp((least[owner] - costs) / _SETTINGS.warm)
    return np.asarray(likely / np.bincount(owner, likely)[owner])
