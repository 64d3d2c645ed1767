"""What the small networks that numpy trains and runs share: one thread, Adam, dropout, norm of gradients, softmax."""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence
from contextlib import ContextDecorator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

Floats = NDArray[np.float32]
_BETA_1, _BETA_2, _EPSILON = 0.9, 0.999, 1e-8  # of Adam: Kingma and Ba 2015, Algorithm 1


class _OneThread(ContextDecorator):
    """Around a block or a function: makes numpy and scipy multiply in one thread.

    Matrices this small take more time on several threads than on one (300 words in a scanned hand: a fifth more CPU
    on an idle machine, twice as much on a busy one), and sums in another order would make other letters.  The number
    of threads is the process's: the first that enters sets it, the last that leaves sets it back.
    """

    def __init__(self) -> None:
        self._lock, self._entered = threading.Lock(), 0
        self._limits: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if not self._entered:
                self._limits = _pools("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas")
            self._entered += 1

    def __exit__(self, *exc: object) -> None:
        with self._lock:
            self._entered -= 1
            if not self._entered:
                self._limits.restore_original_limits()


@lru_cache
def _pools(scipy: bool) -> ThreadpoolController:
    """The libraries that multiply; `scipy`: its own is among them, which makes another answer once it is loaded."""
    return ThreadpoolController()


one_thread = _OneThread()


class Adam:
    """Adam, changing the parameters in place.  Source: Kingma and Ba 2015, Algorithm 1."""

    def __init__(self, parameters: Sequence[Floats]) -> None:
        self._parameters = parameters
        self._mean = [np.zeros_like(p) for p in parameters]
        self._square = [np.zeros_like(p) for p in parameters]
        self._steps = 0

    def step(self, gradients: Sequence[Floats], rate: float) -> None:
        """One step against the gradients, which are overwritten."""
        self._steps += 1
        first = np.float32(rate / (1 - _BETA_1**self._steps))
        second = np.float32(1 / np.sqrt(1 - _BETA_2**self._steps))
        for parameter, mean, square, gradient in zip(
            self._parameters, self._mean, self._square, gradients, strict=True
        ):
            mean *= np.float32(_BETA_1)
            mean += np.float32(1 - _BETA_1) * gradient
            square *= np.float32(_BETA_2)
            gradient *= gradient
            square += np.float32(1 - _BETA_2) * gradient
            parameter -= first * mean / (second * np.sqrt(square) + np.float32(_EPSILON))


def clip_norm(gradients: Sequence[Floats], most: float) -> float:
    """Scale gradients in place so that their joint L2 norm is at most `most`; the norm that they had."""
    norm = float(np.sqrt(sum(float(np.vdot(g, g)) for g in gradients)))
    if norm > most:
        for gradient in gradients:
            gradient *= np.float32(most / norm)
    return norm


def dropout(shape: tuple[int, ...], share: float, rng: np.random.Generator) -> Floats:
    """A mask that drops that share of the units, and scales the others up.  Source: Srivastava et al. 2014."""
    kept = rng.random(shape, dtype=np.float32) > share
    return np.asarray(kept / np.float32(1 - share), dtype=np.float32)


def log_softmax(z: NDArray[Any]) -> NDArray[Any]:
    """Logarithms of the probabilities along the last axis, in the precision of `z`."""
    z = z - z.max(axis=-1, keepdims=True)
    return np.asarray(z - np.log(np.exp(z).sum(axis=-1, keepdims=True)))
