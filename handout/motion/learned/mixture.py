"""Mixtures of Gaussians in the plane whose parameters a network gives: how likely a value is, and values by chance.

Of 6 K raw numbers the first K are the logarithms of the shares but for a constant, then come the means (2 K, those of
the first coordinate first), the logarithms of the standard deviations (2 K), and K numbers whose tanh are the
correlations.

Source: Bishop 1994; Graves 2013, §4.1; seed 002, §3.4, eq. 12–14 (misprinted: the density is that of the value).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.networks import Floats, log_softmax
from handout.values import Array

_LEAST, _MOST = -7.0, 7.0  # logarithm of a standard deviation
_CORRELATED = 0.999  # the greatest correlation
_HALF_LOG = 0.5 * math.log(2 * math.pi)


def count(raw: int) -> int:
    """How many Gaussians so many raw numbers are."""
    return raw // 6


@dataclass(frozen=True, eq=False)
class _Parts:
    """log_share (…, K); mean, log_spread (…, 2, K); correlation (…, K)."""

    log_share: Array
    mean: Array
    log_spread: Array
    correlation: Array


def _parts(raw: Floats) -> _Parts:
    k = count(raw.shape[-1])
    wide = raw.astype(np.float64)
    shape = (*raw.shape[:-1], 2, k)
    spread = np.clip(wide[..., 3 * k : 5 * k], _LEAST, _MOST).reshape(shape)
    return _Parts(
        log_softmax(wide[..., :k]),
        wide[..., k : 3 * k].reshape(shape),
        spread,
        _CORRELATED * np.tanh(wide[..., 5 * k : 6 * k]),
    )


@dataclass(frozen=True, eq=False)
class _Density:
    """log_density (…,); share (…, K) of each Gaussian in it; z (…, 2, K) the value in standard deviations."""

    log_density: Array
    share: Array
    z: Array


def _density(parts: _Parts, y: Array, first_known: NDArray[np.bool_]) -> _Density:
    z = (y[..., :, None] - parts.mean) / np.exp(parts.log_spread)
    rest = 1 - parts.correlation**2
    square = z[..., 0, :] ** 2 + z[..., 1, :] ** 2 - 2 * parts.correlation * z[..., 0, :] * z[..., 1, :]
    both = -0.5 * square / rest - parts.log_spread.sum(axis=-2) - 0.5 * np.log(rest) - 2 * _HALF_LOG
    second = -0.5 * z[..., 1, :] ** 2 - parts.log_spread[..., 1, :] - _HALF_LOG
    each = parts.log_share + np.where(first_known[..., None], both, second)
    total = np.logaddexp.reduce(each, axis=-1)
    return _Density(total, np.exp(each - total[..., None]), z)


def log_density(raw: Floats, y: Array, first_known: NDArray[np.bool_]) -> Array:
    """(…,) nat, of values y (…, 2) under raw (…, 6 K); where `first_known` (…,) is false, of the second coordinate."""
    return _density(_parts(raw), y, first_known).log_density


def loss(raw: Floats, y: Array, first_known: NDArray[np.bool_], weight: Array) -> tuple[float, Floats]:
    """The weighted sum of −log density, nat, and its gradient (…, 6 K); arguments as in `log_density`, weight (…,)."""
    parts = _parts(raw)
    seen = _density(parts, y, first_known)
    z0, z1, r = seen.z[..., 0, :], seen.z[..., 1, :], parts.correlation
    rest = 1 - r**2
    known = first_known[..., None]
    toward = np.stack([np.where(known, (z0 - r * z1) / rest, 0.0), np.where(known, (z1 - r * z0) / rest, z1)], axis=-2)
    square = z0**2 + z1**2 - 2 * r * z0 * z1
    of_r = np.where(known, (r + z0 * z1 - r * square / rest) / rest, 0.0)
    of_spread = toward * seen.z - np.stack([known * np.ones_like(z0), np.ones_like(z0)], axis=-2)
    inside = np.abs(parts.log_spread) < _MOST
    slopes = np.concatenate(
        [
            np.exp(parts.log_share) - seen.share,
            *_rows(-seen.share[..., None, :] * toward / np.exp(parts.log_spread)),
            *_rows(-seen.share[..., None, :] * of_spread * inside),
            -seen.share * of_r * (_CORRELATED - r**2 / _CORRELATED),
        ],
        axis=-1,
    )
    return -float((weight * seen.log_density).sum()), (weight[..., None] * slopes).astype(np.float32)


def _rows(values: Array) -> tuple[Array, Array]:
    return values[..., 0, :], values[..., 1, :]


def draw(raw: list[float], temperature: float, chance: float, normals: tuple[float, float]) -> tuple[float, float]:
    """A value by chance: shares to the power 1 / temperature, standard deviations times its root.

    raw : the 6 K numbers of one step.
    temperature : above 0; 1 is the distribution as it was learned, at small ones the likeliest Gaussian's mean.
    chance : in 0–1, which of the Gaussians; normals : two standard normal numbers, where in it.

    Source: seed 002, §4.1 (variation by the seed); the temperature after Graves 2013, §5.4.
    """
    k = count(len(raw))
    high = max(raw[:k])
    shares = [math.exp((value - high) / temperature) for value in raw[:k]]
    left, at = chance * sum(shares), 0
    while at < k - 1 and left > shares[at]:
        left -= shares[at]
        at += 1
    ease = math.sqrt(temperature)
    r = _CORRELATED * math.tanh(raw[5 * k + at])
    spreads = [ease * math.exp(min(max(raw[3 * k + at + j * k], _LEAST), _MOST)) for j in (0, 1)]
    first, second = normals
    along = r * first + math.sqrt(1 - r * r) * second
    return raw[k + at] + spreads[0] * first, raw[2 * k + at] + spreads[1] * along
