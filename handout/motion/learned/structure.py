"""Invents virtual targets after examples: where the pen goes, and when it is lifted.

A recurrent mixture density network gives, for every way in turn, the distribution of the next one: along x and y, in
the usual way of the movement, whether in the air, and whether it is the last.

Source: seed 002, §4.3; Graves 2013, §4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from handout.motion.learned import mixture, recurrent, sequences, training
from handout.motion.learned.recurrent import Runner
from handout.motion.learned.sequences import MovementSequence
from handout.motion.learned.training import SIZES, NetworkRecipe, Windows
from handout.networks import Floats
from handout.progress import Tell, silent
from handout.values import Array

_LIFTED, _LAST = -2, -1  # of the outputs, behind those of the mixture
_DROPOUT = 0.0  # with any, what is invented after one tag is a straight row of its mean ways
_LONGER = 1.5  # times its longest example: what is invented ends there at the latest
_FLOOR = 1e-2  # usual ways: least spread of the ways


@dataclass(frozen=True, eq=False)
class StructureModel:
    """A network, and the spread (2,) of ways in usual ways; `longest` : ways of its longest example."""

    parameters: tuple[Floats, ...]
    spread: Floats
    longest: int

    @cached_property
    def runner(self) -> Runner:
        """The network, ready for use."""
        return Runner(self.parameters)

    def batch(self, windows: Windows) -> tuple[Floats, Callable[[Floats], tuple[float, Floats]]]:
        """See `training.Criterion`: of each way −log density, and the surprise of the pen's lift and of the end."""
        way = np.diff(windows.targets, axis=1) / self.spread
        told = _input_rows(way[:, :-2], windows.up[:, :-2], windows.there[:, :-2])
        here = windows.there[:, 1:-1].T
        weight = here / max(float(here.sum()), 1.0)
        y, lifted, last = np.swapaxes(way[:, 1:-1], 0, 1), windows.up[:, 1:-1].T, 1 - windows.there[:, 2:].T

        def measure(raw: Floats) -> tuple[float, Floats]:
            cost, slopes = mixture.loss(raw[..., :_LIFTED], y, np.ones(here.shape, dtype=bool), weight)
            wide = raw[..., _LIFTED:].astype(np.float64)
            truth = np.stack([lifted, last], axis=-1)
            # log(1 + e^x) − x·truth, without overflow
            cost += float((weight[..., None] * (np.logaddexp(0.0, wide) - wide * truth)).sum())
            off = (weight[..., None] * (0.5 * np.tanh(0.5 * wide) + 0.5 - truth)).astype(np.float32)
            return cost, np.concatenate([slopes, off], axis=-1)

        return np.swapaxes(told, 0, 1).astype(np.float32), measure

    def invent(
        self,
        rng: np.random.Generator,
        temperature: float = 1.0,
        example: MovementSequence | None = None,
        least: int = 2,
    ) -> MovementSequence:
        """New virtual targets, without dynamics, in usual ways, y down.

        temperature : above 0; see `mixture.draw`; of lifts and the end, too.
        example : whose structure primes what is invented.
        least : ways; the end is not taken before.
        """
        self.runner.state = tuple(np.zeros_like(part) for part in self.runner.state)
        raw = self.runner.step(np.array([0.0, 0.0, 1.0], np.float32))
        if example is not None:
            way = np.diff(sequences.cut_off(example).targets, axis=0) / (example.unit * self.spread)
            cut = sequences.cut_off(example)
            for row in _input_rows(way, cut.up.astype(np.float64), cut.ways_there.astype(np.float64)):
                raw = self.runner.step(row.astype(np.float32))
        ways, up = [], []
        most = self.longest if example is None else longest([example])
        for _ in range(max(round(_LONGER * most), least)):
            numbers = raw.tolist()
            normals = rng.standard_normal(2).tolist()
            step = mixture.draw(numbers[:_LIFTED], temperature, float(rng.random()), (normals[0], normals[1]))
            chances = (0.5 * math.tanh(0.5 * (numbers[k] / temperature)) + 0.5 for k in (_LIFTED, _LAST))
            lifted, last = (float(rng.random()) < chance for chance in chances)
            ways.append(step)
            up.append(lifted)
            if last and len(ways) >= least:
                break
            raw = self.runner.step(np.array([*step, float(lifted)], np.float32))
        # a last way in the air leads nowhere
        in_air = np.array(up)
        kept = int(np.flatnonzero(~in_air)[-1]) + 1 if (~in_air).any() else 0
        targets = np.concatenate([np.zeros((1, 2)), np.cumsum((np.array(ways) * self.spread)[:kept], axis=0)])
        return MovementSequence(targets, in_air[:kept], np.zeros(kept), np.zeros(kept))


def longest(examples: Sequence[MovementSequence]) -> int:
    """Ways of the longest of examples that are strung together."""
    bounds = [np.flatnonzero(np.concatenate([[True], ~example.ways_there, [True]])) for example in examples]
    return int(max(np.diff(each).max() for each in bounds)) - 1


def _input_rows(way: Array, up: Array, there: Array) -> Array:
    """Inputs (…, 3) of the way before: nothing, as if in the air, where there is none."""
    return np.concatenate([way * there[..., None], np.where(there > 0, up, 1.0)[..., None]], axis=-1)


def learn(
    examples: Sequence[MovementSequence],
    rng: np.random.Generator,
    recipe: NetworkRecipe | None = None,
    tell: Tell = silent,
) -> StructureModel:
    """A model of the structure of some examples; one is enough.

    recipe : None: `training.recipe_for` them.

    Raises ValueError: fewer than two ways in all.
    """
    recipe = recipe or training.recipe_for(examples)
    seen = training.windows(examples, recipe.length)
    here = seen.there[:, 1:-1] > 0
    ways = np.diff(seen.targets, axis=1)[:, 1:-1][here]
    spread = np.maximum(np.sqrt((ways**2).mean(axis=0)), _FLOOR).astype(np.float32)
    size = SIZES[recipe.size]
    weights = recurrent.initial_weights(3, size.hidden, 6 * size.gaussians + 2, rng)
    model = StructureModel(tuple(weights), spread, longest(examples))
    training.train(weights, seen, model, recipe, rng, _DROPOUT, tell)
    return model
