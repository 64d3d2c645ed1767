"""Long short-term memory in numpy: layers of it and a linear one, run over batches to train and step by step to use.

A network is a list of float32 arrays: of each layer (inputs + hidden + 1, 4 hidden), the rows for its inputs, for its
own last output and for the bias, the columns for the input, forget, candidate and output gates; at last the linear
layer (hidden + 1, outputs).

Source: Hochreiter and Schmidhuber 1997; Gers, Schmidhuber and Cummins 2000 (forget gates); seed 002, §3.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from handout.networks import Floats, dropout

Parameters = Sequence[Floats]
_REMEMBER = 1.0  # bias of the forget gates before training: Jozefowicz, Zaremba and Sutskever 2015


def initial_weights(inputs: int, hidden: Sequence[int], outputs: int, rng: np.random.Generator) -> list[Floats]:
    """Random weights: uniform within 1 / √hidden, biases 0 but for those of the forget gates."""
    parameters = []
    for before, units in pairwise((inputs, *hidden)):
        reach = 1 / np.sqrt(units)
        layer = rng.uniform(-reach, reach, (before + units + 1, 4 * units)).astype(np.float32)
        layer[-1] = 0.0
        layer[-1, units : 2 * units] = _REMEMBER
        parameters.append(layer)
    reach = 1 / np.sqrt(hidden[-1])
    last = rng.uniform(-reach, reach, (hidden[-1] + 1, outputs)).astype(np.float32)
    last[-1] = 0.0
    return [*parameters, last]


def sizes(parameters: Parameters) -> tuple[int, ...]:
    """Hidden units of each layer."""
    return tuple(layer.shape[1] // 4 for layer in parameters[:-1])


@dataclass(frozen=True, eq=False)
class _Pass:
    """What a layer did, for its gradient: all (steps, batch, …).

    x : inputs; gates : (…, 4 hidden) after their functions; cell, squashed, out : the state, its tanh, the output;
    mask : of dropout, on the output.
    """

    x: Floats
    gates: Floats
    cell: Floats
    squashed: Floats
    out: Floats
    mask: Floats | None


def _layer(layer: Floats, x: Floats, share: float, rng: np.random.Generator | None) -> _Pass:
    steps, batch, before = x.shape
    units = layer.shape[1] // 4
    own = layer[before : before + units]
    gates = x @ layer[:before] + layer[-1]
    cell, squashed, out = (np.empty((steps, batch, units), np.float32) for _ in range(3))
    h, c = np.zeros((batch, units), np.float32), np.zeros((batch, units), np.float32)
    for t in range(steps):
        z = gates[t]
        z += h @ own
        # gates of their sums, in place: the logistic function, tanh of the candidates
        z[..., : 2 * units] *= 0.5
        z[..., 3 * units :] *= 0.5
        np.tanh(z, out=z)
        for part in (z[..., : 2 * units], z[..., 3 * units :]):
            part *= 0.5
            part += 0.5
        c = z[:, units : 2 * units] * c + z[:, :units] * z[:, 2 * units : 3 * units]
        cell[t] = c
        np.tanh(c, out=squashed[t])
        h = z[:, 3 * units :] * squashed[t]
        out[t] = h
    mask = dropout(out.shape, share, rng) if rng is not None and share > 0 else None
    return _Pass(x, gates, cell, squashed, out, mask)


def forward(
    parameters: Parameters, x: Floats, share: float = 0.0, rng: np.random.Generator | None = None
) -> tuple[Floats, list[_Pass]]:
    """Outputs (steps, batch, outputs) for inputs (steps, batch, inputs), from a state of zeros; what `backward` needs.

    share : of the outputs of every layer that `rng` drops.
    """
    passes = []
    for layer in parameters[:-1]:
        passes.append(_layer(layer, x, share, rng))
        x = passes[-1].out if passes[-1].mask is None else passes[-1].out * passes[-1].mask
    return np.asarray(x @ parameters[-1][:-1] + parameters[-1][-1], dtype=np.float32), passes


def backward(parameters: Parameters, passes: Sequence[_Pass], slopes: Floats) -> list[Floats]:
    """Gradients of the parameters, from those (steps, batch, outputs) of the outputs."""
    last, top = parameters[-1], passes[-1]
    seen = top.out if top.mask is None else top.out * top.mask
    flat = slopes.reshape(-1, slopes.shape[2])
    gradients = [np.concatenate([seen.reshape(len(flat), -1).T @ flat, flat.sum(axis=0)[None]])]
    down = slopes @ last[:-1].T
    for layer, done in zip(reversed(parameters[:-1]), reversed(passes), strict=True):
        gradient, down = _layer_gradient(layer, done, down if done.mask is None else down * done.mask)
        gradients.append(gradient)
    return gradients[::-1]


def _layer_gradient(layer: Floats, done: _Pass, down: Floats) -> tuple[Floats, Floats]:
    """Gradient of a layer's weights, and of its inputs, from that of its outputs."""
    steps, batch, units = done.out.shape
    before = done.x.shape[2]
    own = layer[before : before + units].T.copy()
    into = np.empty_like(done.gates)
    dh, dc = np.zeros((batch, units), np.float32), np.zeros((batch, units), np.float32)
    for t in range(steps - 1, -1, -1):
        i, f, g, o = np.split(done.gates[t], 4, axis=1)
        dh = dh + down[t]
        dc = dc + dh * o * (1 - done.squashed[t] ** 2)
        earlier = done.cell[t - 1] if t else np.float32(0)
        z = into[t]
        z[:, :units] = dc * g * i * (1 - i)
        z[:, units : 2 * units] = dc * earlier * f * (1 - f)
        z[:, 2 * units : 3 * units] = dc * i * (1 - g * g)
        z[:, 3 * units :] = dh * done.squashed[t] * o * (1 - o)
        dc = dc * f
        dh = z @ own
    flat = into.reshape(-1, 4 * units)
    earlier_out = np.concatenate([np.zeros((1, batch, units), np.float32), done.out[:-1]]).reshape(-1, units)
    of_x, of_own = done.x.reshape(-1, before).T @ flat, earlier_out.T @ flat
    gradient = np.concatenate([of_x, of_own, flat.sum(axis=0)[None]])
    return gradient, np.asarray(into @ layer[:before].T)


class Runner:
    """A network that is used: one sequence, step by step, from a state of zeros or one that was kept."""

    def __init__(self, parameters: Parameters) -> None:
        self._units = sizes(parameters)
        self._layers = []
        for layer, units in zip(parameters[:-1], self._units, strict=True):
            halved = layer.copy()  # the logistic function is a tanh of half the sum
            halved[:, : 2 * units] *= 0.5
            halved[:, 3 * units :] *= 0.5
            self._layers.append(np.ascontiguousarray(halved))
        self._last = parameters[-1]
        self._inputs = parameters[0].shape[0] - self._units[0] - 1
        befores = (self._inputs, *self._units[:-1])
        self._into = [np.zeros(n + u + 1, np.float32) for n, u in zip(befores, self._units, strict=True)]
        self._cell = [np.zeros(u, np.float32) for u in self._units]
        self._top = np.zeros(self._units[-1] + 1, np.float32)
        for row in (*self._into, self._top):
            row[-1] = 1.0  # the bias

    @property
    def state(self) -> tuple[Floats, ...]:
        """What it remembers; can be given back."""
        outs = (row[-1 - u : -1] for row, u in zip(self._into, self._units, strict=True))
        return tuple(part.copy() for part in (*outs, *self._cell))

    @state.setter
    def state(self, kept: Sequence[Floats]) -> None:
        for row, units, out in zip(self._into, self._units, kept, strict=False):
            row[-1 - units : -1] = out
        for cell, value in zip(self._cell, kept[len(self._units) :], strict=True):
            cell[:] = value

    def step(self, x: Floats) -> Floats:
        """(outputs,) for inputs (inputs,)."""
        for row, layer, cell, units in zip(self._into, self._layers, self._cell, self._units, strict=True):
            row[: len(x)] = x
            z = row @ layer
            np.tanh(z, z)
            gate = z * np.float32(0.5)
            gate += np.float32(0.5)
            cell *= gate[units : 2 * units]
            cell += gate[:units] * z[2 * units : 3 * units]
            x = np.tanh(cell)
            x *= gate[3 * units :]
            row[-1 - units : -1] = x
        self._top[:-1] = x
        return np.asarray(self._top @ self._last)
