"""What was learned of a manner of moving: its dynamics, its structure, and the examples that prime them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from handout.errors import InputError
from handout.motion.learned import dynamics, sequences, structure
from handout.motion.learned.dynamics import DynamicsModel, State
from handout.motion.learned.sequences import INPUTS, Inputs, MovementSequence
from handout.motion.learned.structure import StructureModel
from handout.motion.learned.training import SEVERAL_STYLES, SIZES, NetworkRecipe, recipe_for
from handout.motion.reconstruction import LognormalPlan, from_shape
from handout.motion.reconstruction.key_points import extent
from handout.motion.reconstruction.shape_fit import DURATION
from handout.motion.styles.targets import letter_height
from handout.progress import Tell, narrow_reports, silent
from handout.units import count
from handout.values import Array, Drawing

MOST_STROKES = 5000  # of all examples: two or three minutes to take apart
_DOT = 0.06  # of the height of a letter: a stroke of no more extent is a dot, as for styles of rules
# heights: longer strokes are taken apart as finely as one of this extent. As wide as a word, joined words lost letters
# before any style: a reader of paths read 27 of 40 that were taken apart, 33 with 2, 37 with 1 or with .8, 37 before
_UNIT = 1.0
_LONGEST_PRIMER = 96  # ways of an example that primes: more than a network remembers
_FITTED = 0.6  # of the work on examples, measured on twenty tags
_FASTEST, _SLOWEST = 0.05, 2.0  # s, duration of a stroke
PRIMERS = 5  # examples that are kept


class LearnedMovement:
    """Models and primers of a style.

    primers : by name, examples of which one primes the models; the first is the usual one.
    """

    def __init__(
        self, dynamics: DynamicsModel, structure: StructureModel | None, primers: Mapping[str, MovementSequence]
    ) -> None:
        self.dynamics, self.structure, self.primers = dynamics, structure, dict(primers)
        self._states = dict[MovementSequence, State]()

    def state(self, primer: MovementSequence | None) -> State | None:
        """What the dynamics remember of a primer."""
        if primer is not None and primer not in self._states:
            self._states[primer] = self.dynamics.state_after(primer)
        return None if primer is None else self._states[primer]


def taken_apart(drawing: Drawing, height: float, tell: Tell = silent) -> list[LognormalPlan]:
    """A steady plan for every stroke of a drawing whose letters have that height, mm; small ones are dots."""
    dot, plans = _DOT * height, []
    for number, stroke in enumerate(drawing.strokes):
        tell(number / len(drawing.strokes), "taking strokes apart")
        small = extent(stroke.xy) <= dot
        plans.append(plan_dot(stroke.xy) if small else from_shape(stroke.xy, steady=True, unit=_UNIT * height))
    return plans


def plan_dot(xy: Array) -> LognormalPlan:
    """The plan of a dot."""
    none = np.zeros(0)
    return LognormalPlan(xy.mean(axis=0)[None], none, none, none, none, 0.0, 0.05)


@dataclass(frozen=True)
class Lesson:
    """What is learned, and how.

    size : one of `SIZES`; inputs : one of `INPUTS`; structure : whether targets are learned, too; recipe : None: that
    for one style, or for several where there are several names.
    """

    size: str = "small"
    inputs: Inputs = "ahead"
    structure: bool = True
    recipe: NetworkRecipe | None = None


@dataclass(frozen=True, eq=False)
class LearnedModel:
    """What `learn` made of examples.

    duration : s, of a stroke, as fast as the examples were recorded; strokes : how many there were.
    """

    movement: LearnedMovement
    duration: float
    strokes: int
    notes: list[str] = field(default_factory=list)


def learn(
    examples: Mapping[str, Sequence[Drawing]],
    rng: np.random.Generator,
    lesson: Lesson = Lesson(),
    tell: Tell = silent,
) -> LearnedModel:
    """Learn the manner of some drawings.

    examples : by the name of the manner, drawings in it; with one name each drawing may become a primer, with several
        the first of each does.

    Raises InputError: fewer than two strokes that move, or more than are taken apart.
    """
    if lesson.size not in SIZES or lesson.inputs not in INPUTS:
        raise InputError(f"size and inputs must be of {', '.join(SIZES)} and of {', '.join(INPUTS)}.")
    total = sum(len(drawing.strokes) for drawings in examples.values() for drawing in drawings)
    if not all(drawing.strokes for drawings in examples.values() for drawing in drawings):
        raise InputError("An example has no strokes: there is nothing to learn from it.")
    if total > MOST_STROKES:
        raise InputError(f"There are {total} strokes; at most {MOST_STROKES} are learned from: give fewer.")
    several, paces, done = len(examples) > 1, list[float](), 0
    sequences_of: dict[str, list[MovementSequence]] = {}
    for name, drawings in examples.items():
        for drawing in drawings:
            part = narrow_reports(tell, _FITTED * done / total, _FITTED * (done + len(drawing.strokes)) / total)
            plans = taken_apart(drawing, letter_height(drawing), part)
            done += len(drawing.strokes)
            paces += _paces(drawing, plans)
            sequences_of.setdefault(name, []).append(sequences.of_plans(plans))
    strokes = sum(int((~s.up).sum()) for each in sequences_of.values() for s in each)
    if strokes < 2:
        raise InputError(
            f"{count(strokes, 'movement')} from one target to another is too little to learn from: give a drawing with "
            "at least one turn."
        )
    strung = [sequences.join_sequences(each) for each in sequences_of.values()]
    recipe = replace(SEVERAL_STYLES if several else recipe_for(strung), size=lesson.size)
    recipe = lesson.recipe or recipe
    moves = dynamics.learn(
        strung, rng, recipe, lesson.inputs, narrow_reports(tell, _FITTED, 0.8 if lesson.structure else 1.0)
    )
    forms = structure.learn(strung, rng, recipe, narrow_reports(tell, 0.8, 1.0)) if lesson.structure else None
    pace = float(np.clip(np.median(paces), _FASTEST, _SLOWEST)) if paces else DURATION
    return LearnedModel(LearnedMovement(moves, forms, _choose_primers(sequences_of)), pace, strokes)


def _choose_primers(sequences_of: Mapping[str, Sequence[MovementSequence]]) -> dict[str, MovementSequence]:
    if len(sequences_of) == 1:
        ((name, each),) = sequences_of.items()
        named = {f"{name}-{k}" if k else name: s for k, s in enumerate(each[:PRIMERS])}
    else:
        named = {name: sequences.join_sequences(each) for name, each in sequences_of.items()}
    return {name: _shorten_primer(s) for name, s in named.items() if (~s.up).any()}


def _paces(drawing: Drawing, plans: Sequence[LognormalPlan]) -> list[float]:
    """s: how long a stroke of each plan lasts if the plan is to take as long as was recorded."""
    if not drawing.timed or "timing" in drawing.about:
        return []
    pairs = zip(drawing.strokes, plans, strict=True)
    return [DURATION * float(s.t[-1] - s.t[0]) / (p.end - p.start) for s, p in pairs if p.strokes and len(s.t) > 2]


def _shorten_primer(sequence: MovementSequence) -> MovementSequence:
    """The beginning of a sequence, as much as primes."""
    n = _LONGEST_PRIMER
    return MovementSequence(sequence.targets[: n + 1], sequence.up[:n], sequence.dt[:n], sequence.theta[:n])


def primer_of(drawing: Drawing) -> MovementSequence:
    """An example that primes. Raises InputError: no stroke of it moves."""
    sequence = sequences.of_plans(taken_apart(drawing, letter_height(drawing))) if drawing.strokes else None
    if sequence is None or not (~sequence.up).any():
        raise InputError("There is no movement in it that could prime a style.")
    return _shorten_primer(sequence)
