"""Adapts the reader of pictures to one author, from words of his whose texts are known.

The reader's last layer is fitted to his words, and held near what it was: letters that he writes like others of other
people are then read as what he means, and the next word is read as someone reads who knows his hand.  Which step sees
which letter follows from the texts, by the reader as it is so far.

Source: own method; the posteriors of steps given the text as in Graves, Fernández, Gomez and Schmidhuber 2006.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.libraries import optimize
from handout.networks import log_softmax, one_thread
from handout.reading import ctc
from handout.reading.pictures import Floats, Reader
from handout.values import Array


@dataclass(frozen=True)
class AdaptationSettings:
    """How much an author's words count; chosen on half pages of eight people, read after learning the other halves.

    penalty : of the squared change of the weights.
    rounds : of which step sees which letter, and the weights that follow.
    iterations : of the search for those.
    """

    penalty: float = 12.0
    rounds: int = 2
    iterations: int = 10


SETTINGS = AdaptationSettings()


@one_thread
def adapted(
    reader: Reader, seen: Sequence[Floats], texts: Sequence[str], settings: AdaptationSettings = SETTINGS
) -> Reader:
    """The reader as it reads words (`Reader.features` of each) by the author of some words with known texts."""
    if not texts:
        return reader
    labels = [reader.labels(text) for text in texts]
    begun = np.asarray(np.vstack(reader.columns[-1]), dtype=np.float64) / reader.temperature
    steps = np.vstack([np.column_stack([one, np.ones(len(one))]) for one in seen]).astype(np.float32)
    borders = np.cumsum([len(one) for one in seen])[:-1]
    weights = begun
    for _ in range(settings.rounds):
        given = np.split(log_softmax((steps @ weights.astype(np.float32)).astype(np.float64)), borders)
        # how much of each step belongs to each class (steps, classes); 0 where a text does not fit
        targets = []
        for logs, own, occupied in zip(given, labels, ctc.occupancies(given, labels), strict=True):
            target = np.zeros(logs.shape)
            np.add.at(target.T, np.array(own, dtype=np.intp), occupied.T)
            if occupied.any():
                target[:, ctc.BLANK] = np.maximum(1.0 - target.sum(axis=1), 0.0)
            targets.append(target)
        weights = begun + _change(begun, weights - begun, steps, np.vstack(targets).astype(np.float32), settings)
    return reader.with_last_layer(weights)


def _change(begun: Array, change: Array, steps: Floats, targets: Floats, settings: AdaptationSettings) -> Array:
    """What is added to the weights (channels + 1, classes) to make the targets likely: softmax regression."""
    share = targets.sum(axis=1, keepdims=True)

    def cost(flat: Array) -> tuple[float, Array]:
        more = flat.reshape(begun.shape)
        logs = steps @ (begun + more).astype(np.float32)
        logs -= logs.max(axis=1, keepdims=True)
        likely = np.exp(logs)
        total = likely.sum(axis=1, keepdims=True)
        logs -= np.log(total)
        likely *= share / total
        slope = steps.T @ (likely - targets) + settings.penalty * more
        return float(-np.vdot(targets, logs) + 0.5 * settings.penalty * np.vdot(more, more)), slope.ravel()

    options = {"maxiter": settings.iterations}
    found = optimize.minimize(cost, change.ravel(), jac=True, method="L-BFGS-B", options=options)
    return np.asarray(found.x.reshape(begun.shape), dtype=np.float64)
