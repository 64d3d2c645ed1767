"""Movements as sequences of virtual targets with their dynamics, and what a network is told of each of their ways.

A way leads from one target to the next, on the paper or, between movements, in the air.  Of a way on the paper the
dynamics are Δt, how late its stroke begins after the one before as a share of that one's duration, and θ, half of how
far it turns; Δt of the first stroke of a movement means nothing, in the air neither does.

Source: seed 002, §3.4 (inputs); the local frame and the look-ahead are this project's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.sigma_lognormal_model import MOST_BENT
from handout.values import Array

Bools = NDArray[np.bool_]
Inputs = Literal["ahead", "local", "berio_2017", "berio_2017_no_history"]
INPUTS: tuple[Inputs, ...] = get_args(Inputs)
LEAST_DT, MOST_DT = 0.15, 1.5  # of a generated stroke: half the least of a first guess; the most of a reconstruction
_SHORT = 0.02  # of the usual way: shorter ones have no direction
# inputs whose columns are numbers to standardise; the others are 0 or 1, or on the circle
_MEASURED: dict[Inputs, tuple[int, ...]] = {
    "ahead": (2, 4, 5, 8),
    "local": (2, 4, 5),
    "berio_2017": (0, 1, 3, 4),
    "berio_2017_no_history": (0, 1),
}
_COLUMNS: dict[Inputs, int] = {"ahead": 10, "local": 6, "berio_2017": 5, "berio_2017_no_history": 3}
_HISTORY: dict[Inputs, tuple[int, int] | None] = {
    "ahead": (4, 5),
    "local": (4, 5),
    "berio_2017": (3, 4),
    "berio_2017_no_history": None,
}


@dataclass(frozen=True, eq=False)
class MovementSequence:
    """Virtual targets in the order of writing, and the ways between them.

    targets : (m, 2) float, mm, y down.
    up : (m − 1,) bool: which ways are in the air.
    dt, theta : (m − 1,) float: share, and rad; 0 where they mean nothing.
    """

    targets: Array
    up: Bools
    dt: Array
    theta: Array

    @property
    def starts(self) -> Bools:
        """(m − 1,): which ways begin a movement on the paper."""
        return np.asarray(~self.up & np.concatenate([[True], self.up[:-1]]))

    @property
    def ways_there(self) -> Bools:
        """(m − 1,): which ways are real; a way in the air of no length only parts examples that are strung together."""
        return np.asarray(~self.up | np.diff(self.targets, axis=0).any(axis=1))

    @property
    def unit(self) -> float:
        """mm: the geometric mean of its ways on the paper."""
        return usual_way(self.targets, self.up)

    @property
    def parts(self) -> list[slice]:
        """The targets of each movement on the paper; a lone one is a dot."""
        cuts = [0, *(np.flatnonzero(self.up) + 1).tolist(), len(self.targets)]
        return [slice(a, b) for a, b in pairwise(cuts)]


def usual_way(targets: Array, up: Bools) -> float:
    """mm: the geometric mean of the ways on the paper; 1 where there are none."""
    way = np.linalg.norm(np.diff(targets, axis=0), axis=1)[~up]
    way = way[way > 0]
    return float(np.exp(np.log(way).mean())) if len(way) else 1.0


def of_plans(plans: Sequence[LognormalPlan]) -> MovementSequence:
    """The sequence of some plans, one after the other. Raises ValueError: no plans."""
    if not plans:
        raise ValueError("a sequence needs at least one plan")
    targets = np.concatenate([plan.targets for plan in plans])
    ups = [np.append(np.zeros(plan.strokes, dtype=bool), True) for plan in plans]
    dts, thetas = ([np.append(getattr(plan, name), 0.0) for plan in plans] for name in ("dt", "theta"))
    return MovementSequence(targets, *(np.concatenate(each)[:-1] for each in (ups, dts, thetas)))


def of_targets(parts: Sequence[Array]) -> MovementSequence:
    """A sequence of targets (m, 2) of some movements, whose dynamics are not known."""
    up = np.concatenate([np.append(np.zeros(len(part) - 1, dtype=bool), True) for part in parts])[:-1]
    return MovementSequence(np.concatenate(list(parts)), up, np.zeros(len(up)), np.zeros(len(up)))


def join_sequences(sequences: Sequence[MovementSequence]) -> MovementSequence:
    """One after the other, each in units of its own, begun where the one before ended: examples of one style."""
    scaled: list[MovementSequence] = []
    for s in sequences:
        begin = scaled[-1].targets[-1] if scaled else np.zeros(2)
        scaled.append(replace(s, targets=(s.targets - s.targets[0]) / s.unit + begin))
    up = np.concatenate([np.append(s.up, True) for s in scaled])[:-1]
    dt, theta = (np.concatenate([np.append(getattr(s, n), 0.0) for s in scaled])[:-1] for n in ("dt", "theta"))
    return MovementSequence(np.concatenate([s.targets for s in scaled]), up, dt, theta)


def columns(inputs: Inputs) -> int:
    """How many numbers the network is told of a way."""
    return _COLUMNS[inputs]


def list_standardised(inputs: Inputs) -> list[int]:
    """Those of the columns that are standardised."""
    return list(_MEASURED[inputs])


def history(inputs: Inputs) -> tuple[int, int] | None:
    """The columns of Δt and θ of the way before, if the network is told them."""
    return _HISTORY[inputs]


def features(targets: Array, up: Array, there: Array, inputs: Inputs, unit: Array) -> Array:
    """What a network is told of ways, but for the dynamics of the way before, whose columns are 0.

    targets : (…, n + 3, 2): from the target before the first way to the one after the next way of the last.
    up, there : (…, n + 2): which of the ways between them are in the air, and which there are.
    unit : (…,) of length.

    Returns (…, n, columns) float: of "ahead" cosine and sine of the turn from the way before, logarithm of the length,
    whether in the air, Δt and θ of the way before, and of the next way the turn, the length, whether it is in the air
    or nothing; of "local" the first six; of "berio_2017" the way along x and y, whether in the air, Δt, θ.
    """
    way = np.diff(targets, axis=-2) / unit[..., None, None]
    if inputs in ("berio_2017", "berio_2017_no_history"):
        told = np.concatenate([way, up[..., None]], axis=-1)[..., 1:-1, :]
        empty = np.zeros((*told.shape[:-1], 2 if inputs == "berio_2017" else 0))
        return np.concatenate([told, empty], axis=-1)
    z = way[..., 0] + 1j * way[..., 1]
    size = np.abs(z)
    length = np.log(np.maximum(size, _SHORT)) * there
    turn = z[..., 1:] * np.conj(z[..., :-1])
    known = there[..., 1:] * there[..., :-1] * (np.abs(turn) > _SHORT**2)
    turn = np.where(known > 0, turn / np.maximum(np.abs(turn), _SHORT**2), 0.0)
    here = [turn.real[..., :-1], turn.imag[..., :-1], length[..., 1:-1], up[..., 1:-1]]
    none = np.zeros_like(here[0])
    if inputs == "local":
        return np.stack([*here, none, none], axis=-1)
    lifted = np.where(there[..., 2:] > 0, up[..., 2:], 1.0)
    ahead = [turn.real[..., 1:], turn.imag[..., 1:], length[..., 2:], lifted]
    return np.stack([*here, none, none, *ahead], axis=-1)


def frame_sequence(sequence: MovementSequence) -> tuple[Array, Array, Array]:
    """Pad targets, up and there of a sequence for `features`, which takes them so."""
    targets = np.concatenate([sequence.targets[:1], sequence.targets, sequence.targets[-1:]])
    up = np.concatenate([[1.0], sequence.up.astype(np.float64), [1.0]])
    return targets, up, np.concatenate([[0.0], sequence.ways_there.astype(np.float64), [0.0]])


def cut_off(sequence: MovementSequence) -> MovementSequence:
    """The sequence as an example that another follows."""
    targets = np.concatenate([sequence.targets, sequence.targets[-1:]])
    up, dt, theta = np.append(sequence.up, True), np.append(sequence.dt, 0.0), np.append(sequence.theta, 0.0)
    return MovementSequence(targets, up, dt, theta)


def bound_dynamics(dt: float, theta: float) -> tuple[float, float]:
    """Clip Δt and θ to what a stroke can have."""
    return min(max(dt, LEAST_DT), MOST_DT), min(max(theta, -MOST_BENT), MOST_BENT)
