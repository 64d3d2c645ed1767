"""Traces as they are compared: evenly resampled along their length, and how near one comes to another."""

from __future__ import annotations

import numpy as np

from handout.values import Array


def arc_length(xy: Array) -> Array:
    """(n,) float: length along a path (n, 2) up to each of its points."""
    step = np.diff(xy, axis=0)
    return np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))])


def resampled(xy: Array, count: int) -> Array:
    """(count, 2): points at equal distances along a path (n, 2); repeated points are dropped."""
    arc = arc_length(xy)
    keep = np.append(True, np.diff(arc) > 0)
    arc, xy = arc[keep], xy[keep]
    at = np.linspace(0.0, arc[-1], count)
    return np.column_stack([np.interp(at, arc, xy[:, 0]), np.interp(at, arc, xy[:, 1])])


def extent(xy: Array) -> float:
    """The larger side of the bounding box of points (n, 2)."""
    return float(np.ptp(xy, axis=0).max())


def snr(wanted: Array, had: Array, *, about_mean: bool = True) -> float:
    """Signal to noise, dB: the wanted values (n, 2), about their mean or 0, against the difference (n, 2)."""
    noise = float(((wanted - had) ** 2).sum())
    signal = float(((wanted - (wanted.mean(axis=0) if about_mean else 0.0)) ** 2).sum())
    return float(10 * np.log10(max(signal, 1e-300) / max(noise, 1e-12 * signal, 1e-300)))
