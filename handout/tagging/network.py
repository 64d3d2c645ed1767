"""A small network that reads the columns of a line: features to probabilities of thirds of letters, in numpy alone."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import LETTERS, THIRDS
from handout.errors import InputError
from handout.hand.archive import join_bytes
from handout.networks import Adam, Floats, dropout, log_softmax, one_thread
from handout.tagging.line_space import COUNT

_LAYERS = 3  # of weights, in the shipped files: two hidden layers


@dataclass(frozen=True)
class TaggerRecipe:
    """How networks are trained: the values with which five real pages were read best."""

    batch: int = 256  # columns
    input_dropout: float = 0.1  # share of the features
    dropout: float = 0.2  # share of the second hidden layer
    label_smoothing: float = 0.05  # share spread over all states
    final_rate: float = 0.1  # of the learning rate, at the end of the last epoch


_RECIPE = TaggerRecipe()


@dataclass(frozen=True, eq=False)
class LabelledColumns:
    """Columns of straightened lines and what they show: what a network learns from.

    features : (n, COUNT) uint8, as `line_space.describe` gives them.
    states : (n,) int, as `alphabet.state` numbers them.
    """

    features: NDArray[np.uint8]
    states: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.states)


def join_columns(parts: Sequence[LabelledColumns]) -> LabelledColumns:
    """All columns in one."""
    return LabelledColumns(np.concatenate([p.features for p in parts]), np.concatenate([p.states for p in parts]))


@dataclass(frozen=True, eq=False)
class RectifierNetwork:
    """Three layers with rectifiers between them.

    mean, spread : (COUNT,) of the features it was trained on.
    weights, biases : of the three layers, (inputs, outputs) and (outputs,); the outputs are the states of the alphabet.
    log_prior : (states,) how often each state occurred in training.
    widths : (letters,) usual width of each letter, x-heights.
    """

    mean: Floats
    spread: Floats
    weights: tuple[Floats, ...]
    biases: tuple[Floats, ...]
    log_prior: Floats
    widths: Floats

    @one_thread
    def log_posterior(self, features: NDArray[np.uint8]) -> Floats:
        """(n, states) float32 for features (n, COUNT)."""
        x: Floats = (features.astype(np.float32) - self.mean) / self.spread
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.asarray(np.maximum(x @ weight + bias, 0), dtype=np.float32)
        return log_softmax(np.asarray(x @ self.weights[-1] + self.biases[-1], dtype=np.float32))


def average_logs(each: Sequence[Floats]) -> Floats:
    """(n, states) log of the mean of several networks' probabilities, given their logarithms."""
    return np.asarray(np.logaddexp.reduce(each, axis=0) - np.float32(np.log(len(each))))


@one_thread
def train_network(
    network: RectifierNetwork,
    columns: LabelledColumns,
    *,
    epochs: int,
    rate: float,
    rng: np.random.Generator,
    importance: Floats | None = None,
    on_epoch: Callable[[int, float], None] = lambda epoch, loss: None,
) -> RectifierNetwork:
    """The network after more training: Adam, dropout, smoothed labels, a rate that falls to a tenth.

    importance : (n,) float32, optional: weight of every column.
    on_epoch : called after every epoch with its number and mean loss.
    """
    parameters = [np.array(p) for p in (*network.weights, *network.biases)]
    adam = Adam(parameters)
    n = len(columns)
    for epoch in range(epochs):
        order, loss = rng.permutation(n), 0.0
        for start in range(0, n, _RECIPE.batch):
            rows = order[start : start + _RECIPE.batch]
            x = (columns.features[rows].astype(np.float32) - network.mean) / network.spread
            share = importance[rows] if importance is not None else None
            gradients, cost = _gradients(parameters, x, columns.states[rows], share, rng)
            loss += cost
            adam.step(gradients, rate * (1 - (1 - _RECIPE.final_rate) * (epoch + start / n) / epochs))
        on_epoch(epoch, loss / n)
    return replace(network, weights=tuple(parameters[:_LAYERS]), biases=tuple(parameters[_LAYERS:]))


def _gradients(
    parameters: Sequence[Floats], x: Floats, states: NDArray[np.intp], share: Floats | None, rng: np.random.Generator
) -> tuple[list[Floats], float]:
    """Gradients of the mean loss of a batch, in the order of the parameters, and the loss summed."""
    w, b = parameters[:_LAYERS], parameters[_LAYERS:]
    x = x * (rng.random(x.shape, dtype=np.float32) > _RECIPE.input_dropout)
    first = np.maximum(x @ w[0] + b[0], 0)
    second = np.maximum(first @ w[1] + b[1], 0)
    mask = dropout(second.shape, _RECIPE.dropout, rng)
    dropped = second * mask
    log = log_softmax(dropped @ w[2] + b[2])
    rows = np.arange(len(states))
    off = np.exp(log)
    off[rows, states] -= 1 - _RECIPE.label_smoothing
    off -= np.float32(_RECIPE.label_smoothing / log.shape[1])
    off *= (share[:, None] if share is not None else np.float32(1)) / np.float32(len(states))
    back = (off @ w[2].T) * mask * (second > 0)
    front = (back @ w[1].T) * (first > 0)
    gradients = [x.T @ front, first.T @ back, dropped.T @ off, front.sum(0), back.sum(0), off.sum(0)]
    return gradients, -float(log[rows, states].sum())


def load(path: Path) -> RectifierNetwork:
    """Read a network.

    Raises InputError: not such a file, or one for another alphabet or other features.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            letters = str(file["letters"])
            whole = (join_bytes(file[f"weight{i}"]) * file["steps"][i] for i in range(_LAYERS))
            weights = tuple(layer.astype(np.float32) for layer in whole)
            biases = tuple(file[f"bias{i}"].astype(np.float32) for i in range(_LAYERS))
            mean, spread, *rest = (file[k].astype(np.float32) for k in ("mean", "spread", "log_prior", "widths"))
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} cannot be read as a network of the tagger: {error}.") from error
    if letters != LETTERS or weights[0].shape[0] != COUNT or weights[-1].shape[1] != len(LETTERS) * THIRDS:
        raise InputError(
            f"{path} was trained for other letters or features: train it anew with "
            "python -m handout_lab.training.letter_networks."
        )
    return RectifierNetwork(mean, spread, weights, biases, *rest)


@lru_cache(maxsize=1)
def load_networks() -> tuple[RectifierNetwork, ...]:
    """The networks that handout comes with."""
    return tuple(load(path) for path in sorted((Path(__file__).resolve().parent / "networks").glob("*.npz")))
