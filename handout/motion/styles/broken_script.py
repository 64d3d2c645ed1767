"""Breaks curves into straight strokes of a few directions, as the broken scripts do.

Every sample of a path is assigned the allowed direction nearest to its own; a price on every change keeps the strokes
few.  Each stroke then lies on the line through the middle of its samples, and neighbouring lines cross at the corners.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from handout.values import Array, Indices

_LONGEST = 2.5  # a stroke is at most so many times as long as its part of the path
_PARALLEL = 0.2  # sine of the angle between two directions below which they count as parallel
_UPRIGHT = 0.05  # share by which the progress of an upright stroke counts for more
_PRICE = 0.35  # of a change of direction, in lengths of the shortest stroke
_STRAIGHT = 0.96  # chord over length from which a piece was meant as one straight stroke
_LEVEL = 0.4  # sine of the slope below which such a stroke is a crossbar, which stays as it is


def break_path(path: Array, bends: Indices, directions: Array, least: float) -> Array:
    """Corners (m, 2) of the broken path.

    path : (n, 2) float, mm, evenly sampled.
    bends : indices of its corners, which the broken path has too.
    directions : (k, 2) float: unit vectors; a stroke may run either way along each.
    least : mm, about the length of the shortest stroke.
    """
    either = np.concatenate([directions, -directions])
    cuts = np.unique([0, *bends.tolist(), len(path) - 1])
    corners = [path[:1]]
    for low, high in pairwise(cuts.tolist()):
        corners.append(path[low] + np.cumsum(_legs(path[low : high + 1], either, least), axis=0))
    every = np.concatenate(corners)
    away = np.linalg.norm(np.diff(every, axis=0), axis=1) > 0.3 * least
    return np.asarray(every[np.concatenate([[True], away])] if away.any() else every[[0, -1]])


def _legs(piece: Array, either: Array, least: float) -> Array:
    """(k, 2) mm: steps along the straight strokes that replace a piece of the path between two corners."""
    whole = piece[-1] - piece[0]
    size = float(np.linalg.norm(whole))
    step = np.diff(piece, axis=0)
    length = float(np.linalg.norm(step, axis=1).sum())
    if length < least or (size > _STRAIGHT * length and abs(whole[1]) < _LEVEL * size):
        return np.asarray(whole[None])
    run = _directions(step @ either.T * (1 + _UPRIGHT * np.abs(either[:, 1]) ** 4), least)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(run)) + 1, [len(run)]])
    legs = _cross_lines(piece, starts, either[run[starts[:-1]]])
    if legs is not None:
        return legs
    if length > 3 * least and len(starts) > 2:  # too winding to be solved as one
        half = int(starts[len(starts) // 2])
        return np.concatenate([_legs(piece[: half + 1], either, least), _legs(piece[half:], either, least)])
    return _split_step(whole, either) if size > least else np.asarray(whole[None])


def _cross_lines(piece: Array, starts: Indices, along: Array) -> Array | None:
    """Steps along strokes whose lines run through the middle of their samples, or through the ends of the piece.

    None if a stroke would run backwards or become too long.
    """
    if len(along) < 2:
        return None
    normal = along[:, ::-1] * [-1.0, 1.0]
    amid = np.array([piece[a : b + 1].mean(axis=0) for a, b in pairwise(starts.tolist())])
    amid[0], amid[-1] = piece[0], piece[-1]
    place = np.einsum("ij,ij->i", normal, amid)
    corners = [piece[0]]
    for k in range(len(along) - 1):
        pair = normal[k : k + 2]
        if abs(np.linalg.det(pair)) < _PARALLEL:
            return None
        corners.append(np.linalg.solve(pair, place[k : k + 2]))
    legs = np.diff([*corners, piece[-1]], axis=0)
    progress = np.einsum("ij,ij->i", along, piece[starts[1:]] - piece[starts[:-1]])
    products = np.einsum("ij,ij->i", along, legs)
    return np.asarray(legs) if ((products > 0.2 * progress) & (products < _LONGEST * progress)).all() else None


def _split_step(whole: Array, either: Array) -> Array:
    """A step (2,) split into two of neighbouring directions, the more upright one at the lower end."""
    turned = np.angle((either @ np.array([1.0, 1j])) / (whole @ np.array([1.0, 1j])))
    left, right = np.where(turned >= 0, turned, np.inf).argmin(), np.where(turned < 0, turned, -np.inf).argmax()
    pair = either[[left, right]]
    legs = np.linalg.solve(pair.T, whole)[:, None] * pair
    upright = int(np.abs(pair[:, 1]).argmax())
    last = upright if whole[1] > 0 else 1 - upright
    return np.asarray(legs[[1 - last, last]])


def _directions(progress: Array, least: float) -> Indices:
    """(n,) direction of each sample: the sequence with the most progress after paying for its changes (Viterbi)."""
    n, k = progress.shape
    price = _PRICE * least
    best = progress[0].copy()
    came = np.empty((n, k), dtype=np.intp)
    stay = np.arange(k)
    for t in range(1, n):
        top = int(best.argmax())
        change = best[top] - price > best
        came[t] = np.where(change, top, stay)
        best = np.where(change, best[top] - price, best) + progress[t]
    run = np.empty(n, dtype=np.intp)
    run[-1] = best.argmax()
    for t in range(n - 1, 0, -1):
        run[t - 1] = came[t, run[t]]
    return run


def add_feet(corners: Array, foot: float, direction: Array) -> Array:
    """Add a slanting foot to a broken path where it begins or ends with an upright.

    foot : mm, length of the step; the upright is shortened by as much as the step is high.
    direction : (2,) unit vector of the step, downwards on the page.
    """
    first, last = corners[1] - corners[0], corners[-1] - corners[-2]
    parts = [corners.copy()]
    if _upright(first) and np.linalg.norm(first) > 2 * foot:
        parts[0][0] += np.sign(first[1]) * np.array([0.0, foot * abs(direction[1])])
        parts.insert(0, (parts[0][0] - np.sign(first[1]) * foot * direction)[None])
    if _upright(last) and np.linalg.norm(last) > 2 * foot:
        parts[-1][-1] -= np.sign(last[1]) * np.array([0.0, foot * abs(direction[1])])
        parts.append((parts[-1][-1] + np.sign(last[1]) * foot * direction)[None])
    return np.concatenate(parts)


def _upright(leg: Array) -> bool:
    return bool(abs(leg[1]) > 1.5 * abs(leg[0]))
