"""Trains recurrent networks on windows of movements, each a little varied every time it is seen.

Long sequences are cut into windows that overlap by half, and the state is 0 at the beginning of each (truncated
back-propagation through time).  The windows are varied at the level of plans, where a variation remains a movement.

Source: seed 002, §3.3 (augmentation) and §3.4 (training).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from handout.motion.learned import recurrent
from handout.motion.learned.sequences import LEAST_DT, MOST_DT, MovementSequence
from handout.motion.reconstruction.key_points import extent
from handout.motion.sigma_lognormal_model import MOST_BENT
from handout.networks import Adam, Floats, clip_norm, one_thread
from handout.progress import Tell, silent
from handout.values import Array, Indices


@dataclass(frozen=True)
class PlanVariation:
    """How much plans are varied: standard deviations; seed 002 gives no sizes, these were set by eye on tags.

    target : of targets, in extents of their movement; dt : of Δt; theta : of θ, rad.
    """

    target: float = 0.01
    dt: float = 0.02
    theta: float = 0.03


@dataclass(frozen=True)
class Size:
    """Hidden units of each layer, Gaussians of the mixture, and the share of units that dropout leaves out.

    On a page each of joined and tagged writing, kept-out strokes were likeliest with a dropout of .5 (of 0, .3, .5).
    """

    hidden: tuple[int, ...] = (64, 64)
    gaussians: int = 5
    dropout: float = 0.5


SIZES = {"small": Size(), "berio_2017": Size((400, 400), 20, 0.1)}  # the latter is that of seed 002


@dataclass(frozen=True)
class NetworkRecipe:
    """How a network is trained.

    size : one of `SIZES`.
    length : ways of a window; seed 002 found 15 enough for one style, and needed longer ones where an example is to
        prime one style of several.
    batch, steps : windows of a step of the optimiser, and how many steps there are.
    rate, final : of Adam at first; it falls as a cosine to that share.
    clip : greatest norm of the gradient.
    dropout : None: that of the size.
    variation : more than a hand's own, since it keeps a network from learning one page by heart.
    """

    size: str = "small"
    length: int = 15
    batch: int = 32
    steps: int = 400
    rate: float = 4e-3
    final: float = 0.02
    clip: float = 1.0
    dropout: float | None = None
    variation: PlanVariation = PlanVariation(0.03, 0.1, 0.2)


ONE_STYLE, SEVERAL_STYLES = (
    NetworkRecipe(),
    NetworkRecipe(length=64, batch=16, dropout=0.1, variation=PlanVariation(0.015, 0.05, 0.1)),
)


_MANY = 1000  # strokes: with more, as on a page, less has to be varied and there is more to be learned


def recipe_for(examples: Sequence[MovementSequence]) -> NetworkRecipe:
    """The recipe for examples of one style."""
    if sum(int((~sequence.up).sum()) for sequence in examples) < _MANY:
        return ONE_STYLE
    return replace(ONE_STYLE, steps=2 * ONE_STYLE.steps, variation=PlanVariation(0.015, 0.06, 0.12))


def vary(sequence: MovementSequence, variation: PlanVariation, rng: np.random.Generator) -> MovementSequence:
    """The same movements, made a little differently: targets, Δt and θ are perturbed.

    Targets of a movement are perturbed in shares of its own extent, so that a dot stays a dot.

    Source: seed 002, §3.3.
    """
    reach = np.concatenate([np.full(p.stop - p.start, extent(sequence.targets[p])) for p in sequence.parts])
    targets = sequence.targets + variation.target * reach[:, None] * rng.standard_normal(sequence.targets.shape)
    least, most = np.minimum(sequence.dt, LEAST_DT), np.maximum(sequence.dt, MOST_DT)  # recorded ones may be beyond
    dt = np.clip(sequence.dt + variation.dt * rng.standard_normal(len(sequence.dt)), least, most)
    theta = np.clip(sequence.theta + variation.theta * rng.standard_normal(len(dt)), -MOST_BENT, MOST_BENT)
    return replace(
        sequence, targets=targets, dt=np.where(sequence.starts | sequence.up, 0.0, dt), theta=theta * ~sequence.up
    )


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of sequences, padded to one length n; those of one sequence are in its own unit.

    targets : (w, n + 3, 2), of ways −1 to n; up, there : (w, n + 2) float, as `sequences.features` takes them.
    dt, theta : (w, n + 1), of ways −1 to n − 1.  first, paper : (w, n) which ways begin a movement, lie on the paper.
    reach : (w, n + 3), extent of the movement that each target belongs to.
    """

    targets: Array
    up: Array
    there: Array
    dt: Array
    theta: Array
    first: Array
    paper: Array
    reach: Array

    def take_rows(self, rows: Indices) -> Windows:
        """The windows of some rows."""
        return Windows(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def vary_plans(self, variation: PlanVariation, rng: np.random.Generator) -> Windows:
        """Perturb all windows as `vary` would."""
        shift = variation.target * self.reach[..., None] * rng.standard_normal(self.targets.shape)
        # the target before the first way and the one after the last may be copies, whose ways are not there
        dt, theta = (
            known + (known != 0) * spread * rng.standard_normal(known.shape)
            for known, spread in ((self.dt, variation.dt), (self.theta, variation.theta))
        )
        return replace(self, targets=self.targets + shift, dt=dt, theta=theta)


def windows(sequences: Sequence[MovementSequence], length: int) -> Windows:
    """Windows of so many ways, overlapping by half, of all sequences.

    Raises ValueError: none has two ways on the paper.
    """
    rows: list[tuple[Array, ...]] = []
    if not any((~sequence.up).sum() > 1 for sequence in sequences):
        raise ValueError("there are fewer than two strokes to learn from")
    for sequence in (sequence for sequence in sequences if len(sequence.up)):
        n, unit = len(sequence.up), sequence.unit
        reach = np.concatenate([np.full(p.stop - p.start, extent(sequence.targets[p])) for p in sequence.parts]) / unit
        starts = range(0, max(n - length // 2, 1), max(length // 2, 1))
        rows += [_window(sequence, reach, unit, start, length) for start in starts]
    return Windows(*(np.stack(column) for column in zip(*rows, strict=True)))


def _window(sequence: MovementSequence, reach: Array, unit: float, start: int, length: int) -> tuple[Array, ...]:
    n = len(sequence.up)
    way = np.arange(start - 1, start + length + 1)
    inside = (way >= 0) & (way < n)
    own = inside & (way < start + length)  # a way beyond the window is seen, as the next one, but not learned
    at = np.clip(np.arange(start - 1, start + length + 2), 0, n)
    near = np.clip(way, 0, n - 1)
    up = np.where(inside, sequence.up[near], True).astype(np.float64)
    dt, theta = np.where(inside, sequence.dt[near], 0.0)[:-1], np.where(inside, sequence.theta[near], 0.0)[:-1]
    paper = (own & ~sequence.up[near])[1:-1].astype(np.float64)
    first = (sequence.starts[near])[1:-1].astype(np.float64)
    there = (inside & sequence.ways_there[near]).astype(np.float64)
    return sequence.targets[at] / unit, up, there, dt, theta, first, paper, reach[at]


class Criterion(Protocol):
    """What a network is trained for."""

    def batch(self, windows: Windows) -> tuple[Floats, Callable[[Floats], tuple[float, Floats]]]:
        """Inputs (n, w, columns) of windows; and what gives loss and gradient of the outputs (n, w, outputs)."""


@one_thread
def train(
    parameters: Sequence[Floats],
    seen: Windows,
    criterion: Criterion,
    recipe: NetworkRecipe,
    rng: np.random.Generator,
    share: float,
    tell: Tell = silent,
) -> None:
    """Train the parameters, in place, on windows that are varied every time; `share` of units is left out."""
    adam = Adam(parameters)
    count, left = len(seen.dt), np.zeros(0, dtype=np.intp)
    for step in range(recipe.steps):
        if len(left) < recipe.batch:
            left = np.concatenate([left, *(rng.permutation(count) for _ in range(-(-recipe.batch // count)))])
        rows, left = left[: recipe.batch], left[recipe.batch :]
        inputs, measure = criterion.batch(seen.take_rows(rows).vary_plans(recipe.variation, rng))
        outputs, passes = recurrent.forward(parameters, inputs, share, rng)
        _, slopes = measure(outputs)
        gradients = recurrent.backward(parameters, passes, slopes)
        clip_norm(gradients, recipe.clip)
        fall = 0.5 * (1 + math.cos(math.pi * step / recipe.steps))
        adam.step(gradients, recipe.rate * (recipe.final + (1 - recipe.final) * fall))
        if step % 50 == 0:
            tell(step / recipe.steps, "learning the movement")
