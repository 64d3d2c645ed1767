"""Asemic glyphs: letters of no alphabet, found by a genetic algorithm.

Some targets are thrown around a middle; the order in which the pen visits them is bred: long ways are good, and so are
those down and to the right, as a hand likes to go.

Source: seed 003, §4.2 (tournament selection and partially mapped crossover); specification D12.
"""

from __future__ import annotations

import numpy as np

from handout.values import Array, Indices

_POPULATION, _GENERATIONS = 48, 40
_TOURNAMENT = 3
_MUTATION = 0.25  # share of children of which two targets change places
_ELITE = 2
_DOWN, _RIGHT = 0.5, 0.35  # reward of a way down and to the right, in lengths
_LEAST_TURN = 0.35  # of an even share of the circle between neighbouring targets


def glyph(count: int, rng: np.random.Generator) -> Array:
    """Targets (count, 2) of one glyph, in the order of writing, about 1 high, y down, the middle at 0.

    Raises
    ------
    ValueError
        Fewer than 2 or more than 9 targets.
    """
    if not 2 <= count <= 9:
        raise ValueError(f"{count} targets are outside 2 to 9")
    places = scattered(count, rng)
    return places[ordered(places, rng)]


def scattered(count: int, rng: np.random.Generator) -> Array:
    """Targets (count, 2) in polar coordinates around 0: angles apart from each other, radii as they come."""
    share = 2 * np.pi / count
    angle = share * (np.arange(count) + (1 - _LEAST_TURN) * rng.uniform(-0.5, 0.5, count)) + rng.uniform(0, 2 * np.pi)
    radius = 0.5 * np.sqrt(rng.uniform(0.25, 1.0, count))
    places: Array = radius[:, None] * np.column_stack([0.75 * np.cos(angle), np.sin(angle)])
    return places


def fitness(orders: Indices, places: Array) -> Array:
    """(k,) of orders (k, m): lengths of the ways between successive targets, and rewards of their directions."""
    way = np.diff(places[orders], axis=1)
    length = np.linalg.norm(way, axis=2)
    return np.asarray((length + _DOWN * np.maximum(way[..., 1], 0) + _RIGHT * np.maximum(way[..., 0], 0)).sum(axis=1))


def ordered(places: Array, rng: np.random.Generator) -> Indices:
    """(m,) the order of greatest fitness that is found."""
    m = len(places)
    orders = np.array([rng.permutation(m) for _ in range(_POPULATION)])
    for _ in range(_GENERATIONS):
        worth = fitness(orders, places)
        best = orders[np.argsort(-worth, kind="stable")[:_ELITE]]
        parents = orders[_chosen(worth, 2 * (_POPULATION - _ELITE), rng)]
        children = [_child(a, b, rng) for a, b in zip(parents[::2], parents[1::2], strict=True)]
        orders = np.concatenate([best, np.array(children)])
    return np.asarray(orders[fitness(orders, places).argmax()])


def _chosen(worth: Array, count: int, rng: np.random.Generator) -> Indices:
    """Winners of tournaments."""
    rivals = rng.integers(len(worth), size=(count, _TOURNAMENT))
    return np.asarray(rivals[np.arange(count), worth[rivals].argmax(axis=1)])


def _child(a: Indices, b: Indices, rng: np.random.Generator) -> Indices:
    low, high = np.sort(rng.integers(0, len(a) + 1, 2)).tolist()
    child = crossed(a, b, low, high)
    if rng.random() < _MUTATION:
        i, j = rng.integers(len(a), size=2).tolist()
        child[[i, j]] = child[[j, i]]
    return child


def crossed(a: Indices, b: Indices, low: int, high: int) -> Indices:
    """Partially mapped crossover of two permutations: the part [low, high) of `a`, and `b` elsewhere.

    Where `b` has what the part has already, it is mapped through the part until it has not.
    """
    child = b.copy()
    child[low:high] = a[low:high]
    given = {int(one): int(other) for one, other in zip(a[low:high], b[low:high], strict=True)}
    for at in (*range(low), *range(high, len(b))):
        value = int(b[at])
        while value in given:
            value = given[value]
        child[at] = value
    return child
