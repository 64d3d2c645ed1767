"""Predicts the dynamics of movements from their virtual targets, after examples: the manner in which a hand moves.

A recurrent mixture density network gives, for every way in turn, the distribution of Δt and θ, given all targets up to
there (and one ahead) and the dynamics so far; they are drawn from it by chance.

Source: seed 002, §3.4 and §4.1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from handout.motion.learned import mixture, recurrent, sequences, training
from handout.motion.learned.recurrent import Runner
from handout.motion.learned.sequences import Inputs, MovementSequence
from handout.motion.learned.training import SIZES, NetworkRecipe, Windows
from handout.networks import Floats
from handout.progress import Tell, silent
from handout.values import Array

_STILL = 1e-3  # a spread below which a column is taken not to vary
State = tuple[Floats, ...]


@dataclass(frozen=True, eq=False)
class DynamicsModel:
    """A network and the scales of what it is told and tells.

    parameters : as in `recurrent`.
    inputs : what it is told of a way.
    mean, spread : (columns,) of its inputs; told_mean, told_spread : (2,) of Δt and θ.
    """

    parameters: tuple[Floats, ...]
    inputs: Inputs
    mean: Floats
    spread: Floats
    told_mean: Floats
    told_spread: Floats

    @property
    def gaussians(self) -> int:
        """Of the mixture."""
        return mixture.count(self.parameters[-1].shape[1])

    @cached_property
    def runner(self) -> Runner:
        """The network, ready for use."""
        return Runner(self.parameters)

    def batch(self, windows: Windows) -> tuple[Floats, Callable[[Floats], tuple[float, Floats]]]:
        """See `training.Criterion`: the mean of −log density of the dynamics of the ways on the paper."""
        told, y, dt_known = self._inputs(windows)
        weight = windows.paper.T / max(float(windows.paper.sum()), 1.0)
        return told, lambda raw: mixture.loss(raw, y, dt_known, weight)

    def _inputs(self, windows: Windows) -> tuple[Floats, Array, sequences.Bools]:
        """Inputs (n, w, columns), standardised dynamics (n, w, 2), and where Δt means something (n, w)."""
        unit = np.ones(len(windows.dt))
        told = sequences.features(windows.targets, windows.up, windows.there, self.inputs, unit)
        y = (np.stack([windows.dt, windows.theta], axis=-1) - self.told_mean) / self.told_spread
        told = (told - self.mean) / self.spread
        columns = sequences.history(self.inputs)
        if columns is not None:
            told[..., columns] = np.where(windows.up[:, :-2, None] > 0, 0.0, y[:, :-1])
            # the first stroke of a movement has no Δt: what follows it is told the mean
            told[..., columns[0]] *= windows.dt[:, :-1] != 0
        order = np.swapaxes(told, 0, 1).astype(np.float32), np.swapaxes(y[:, 1:], 0, 1)
        return *order, windows.first.T == 0

    def log_densities(self, sequence: MovementSequence) -> Array:
        """(k,) nat of the dynamics of each way on the paper, as they are (Δt as a share, θ in rad)."""
        windows = training.windows([sequence], len(sequence.up))
        told, y, dt_known = self._inputs(windows)
        raw, _ = recurrent.forward(self.parameters, told)
        scale = np.log(self.told_spread.astype(np.float64))
        found = mixture.log_density(raw, y, dt_known) - np.where(dt_known, scale.sum(), scale[1])
        return np.asarray(found[:, 0][windows.paper[0] > 0])

    def state_after(self, example: MovementSequence) -> State:
        """What the network remembers after an example: its style primes what follows.  Source: seed 002, §4.1."""
        example = sequences.cut_off(example)
        self._run_network(example, lambda i, _: (float(example.dt[i]), float(example.theta[i])), None)
        return self.runner.state

    def predict(
        self,
        sequence: MovementSequence,
        rng: np.random.Generator,
        temperature: float = 1.0,
        state: State | None = None,
    ) -> MovementSequence:
        """The same targets with dynamics by chance.

        temperature : above 0; see `mixture.draw`.
        state : what the network remembers; None: nothing.
        """
        chances, normals = rng.random(len(sequence.up)).tolist(), rng.standard_normal((len(sequence.up), 2)).tolist()
        mean, spread = self.told_mean.tolist(), self.told_spread.tolist()

        def draw_dynamics(i: int, raw: list[float]) -> tuple[float, float]:
            first, second = mixture.draw(raw, temperature, chances[i], normals[i])
            return sequences.bound_dynamics(mean[0] + spread[0] * first, mean[1] + spread[1] * second)

        told = self._run_network(sequence, draw_dynamics, state)
        return replace(sequence, dt=np.where(sequence.starts, 0.0, told[:, 0]), theta=told[:, 1])

    def predict_means(self, sequence: MovementSequence) -> Array:
        """(m − 1, 2): means of Δt and θ of every way, each given what the dynamics before it really were."""
        found = np.zeros((len(sequence.up), 2))

        def take_known(i: int, raw: list[float]) -> tuple[float, float]:
            k = self.gaussians
            share = np.exp(np.array(raw[:k]) - max(raw[:k]))
            found[i] = (np.array(raw[k : 3 * k]).reshape(2, k) @ (share / share.sum())).tolist()
            return float(sequence.dt[i]), float(sequence.theta[i])

        self._run_network(sequence, take_known, None)
        return found * self.told_spread + self.told_mean

    def _run_network(
        self,
        sequence: MovementSequence,
        choose: Callable[[int, list[float]], tuple[float, float]],
        state: State | None,
    ) -> Array:
        """(m − 1, 2): the dynamics that `choose` takes of the network's numbers for each way; 0 in the air."""
        told = sequences.features(*sequences.frame_sequence(sequence), self.inputs, np.array(sequence.unit))
        rows = ((told - self.mean) / self.spread).astype(np.float32)
        columns, runner = sequences.history(self.inputs), self.runner
        runner.state = state if state is not None else tuple(np.zeros_like(part) for part in runner.state)
        mean, spread = self.told_mean.tolist(), self.told_spread.tolist()
        up, starts, found = sequence.up.tolist(), sequence.starts.tolist(), np.zeros((len(rows), 2))
        before = (0.0, 0.0)
        for i, row in enumerate(rows):
            if columns is not None:
                row[columns[0]], row[columns[1]] = before
            raw = runner.step(row)
            if up[i]:
                before = (0.0, 0.0)
                continue
            dt, theta = choose(i, raw.tolist())
            found[i] = dt, theta
            before = (0.0 if starts[i] else (dt - mean[0]) / spread[0], (theta - mean[1]) / spread[1])
        return found


def learn(
    examples: Sequence[MovementSequence],
    rng: np.random.Generator,
    recipe: NetworkRecipe | None = None,
    inputs: Inputs = "ahead",
    tell: Tell = silent,
) -> DynamicsModel:
    """A model of the dynamics of some examples; one is enough.

    recipe : None: `training.recipe_for` them.

    Raises ValueError: fewer than two ways on the paper in all.
    """
    recipe = recipe or training.recipe_for(examples)
    seen = training.windows(examples, recipe.length)
    size, on_paper = SIZES[recipe.size], seen.paper > 0
    told = sequences.features(seen.targets, seen.up, seen.there, inputs, np.ones(len(seen.dt)))[seen.there[:, 1:-1] > 0]
    columns = sequences.list_standardised(inputs)
    mean, spread = np.zeros(told.shape[1], np.float32), np.ones(told.shape[1], np.float32)
    mean[columns], spread[columns] = told[:, columns].mean(axis=0), np.maximum(told[:, columns].std(axis=0), _STILL)
    past = sequences.history(inputs)
    if past is not None:  # those are given standardised
        mean[list(past)], spread[list(past)] = 0.0, 1.0
    dt, theta = seen.dt[:, 1:][on_paper & (seen.first == 0)], seen.theta[:, 1:][on_paper]
    told_mean = np.array([dt.mean() if len(dt) else 0.5, theta.mean()], np.float32)
    # two strokes may have the same Δt: the variation that they are seen with is the least spread
    least = (recipe.variation.dt, recipe.variation.theta)
    told_spread = np.maximum([dt.std() if len(dt) else 0.0, theta.std()], least).astype(np.float32)
    weights = recurrent.initial_weights(told.shape[1], size.hidden, 6 * size.gaussians, rng)
    model = DynamicsModel(tuple(weights), inputs, mean, spread, told_mean, told_spread)
    training.train(weights, seen, model, recipe, rng, size.dropout if recipe.dropout is None else recipe.dropout, tell)
    return model
