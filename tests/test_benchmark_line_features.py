import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.haines_2016 import EVEN_STEP, FEATURES, even_steps, line_features, walk_features
from handout.values import LineGraph

UNIT = 25.4 / 600
FAR = 512 * UNIT
BIG = 100 * UNIT  # steps so large that all walks can be written out


def bins_of(value):
    place = min(max(2 * value + 1, 0), 2)
    return {k: max(0.0, 1 - abs(place - k)) for k in range(3)}


def travel_bins(travelled, step):
    """Shares in the eight bins, and the density of the prior, as the specification says."""
    widths = [1.25**k for k in range(8)]
    ends = [FAR * sum(widths[: k + 1]) / sum(widths) for k in range(8)]
    begins = [0.0, *ends[:-1]]
    middles = [(a + b) / 2 for a, b in zip(begins, ends, strict=True)]
    own = next(k for k in range(8) if travelled <= ends[k])
    prior = step / (ends[own] - begins[own])
    shares = [0.0] * 8
    if travelled <= middles[0]:
        shares[0] = 1.0
    elif travelled >= middles[-1]:
        shares[-1] = 1.0
    else:
        k = max(i for i in range(8) if middles[i] <= travelled)
        part = (travelled - middles[k]) / (middles[k + 1] - middles[k])
        shares[k], shares[k + 1] = 1 - part, part
    return [share * prior for share in shares]


def walks(around, start, steps):
    """Every walk of at most so many steps, with its chance: (vertices, chance)."""
    found = []

    def go(way, chance):
        exits = [v for v in around[way[-1]] if len(way) < 2 or v != way[-2]]
        if len(way) > steps or not exits:
            found.append((way, chance))
            return
        for v in exits:
            go([*way, v], chance / len(exits))

    go([start], 1.0)
    return found


def by_hand(xy, density, edges, step):
    around = [[] for _ in xy]
    for a, b in edges:
        around[a].append(b)
        around[b].append(a)
    forward = max(1, int(np.ceil(12 * UNIT / step - 1e-9)))
    result = np.zeros((len(xy), 8, 3, 3, 3))
    for start in range(len(xy)):
        for way, chance in walks(around, start, int(FAR / step)):
            if len(way) == 1:
                continue
            ahead = xy[way[min(forward, len(way) - 1)]] - xy[start]
            size = np.hypot(*ahead)
            east = ahead / size if size > 1e-9 else np.array([1.0, 0.0])
            for k, v in enumerate(way[1:], 1):
                away = (xy[v] - xy[start]) / (k * step)
                x, y = away @ east, away @ np.array([-east[1], east[0]])
                each = [bins_of(density[v] - density[start]), bins_of(x), bins_of(y)]
                for t, share in enumerate(travel_bins(k * step, step)):
                    for i, j, m in itertools.product(range(3), repeat=3):
                        result[start, t, i, j, m] += chance * share * each[0][i] * each[1][j] * each[2][m]
        if result[start].sum() == 0:
            result[start, 0, 1, 1, 1] = 1
        result[start] /= result[start].sum()
    return result.reshape(len(xy), FEATURES)


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 5), st.integers(0, 10**6), st.sampled_from([BIG, 85 * UNIT]))
def test_diffusion_is_all_walks_written_out(count, seed, step):
    rng = np.random.default_rng(seed)
    pairs = list(itertools.combinations(range(count), 2))
    edges = [pair for pair in pairs if rng.random() < 0.45]
    xy, density = rng.normal(0, 5, (count, 2)), rng.random(count)
    found = walk_features(xy, density, np.array(edges, dtype=np.intp).reshape(-1, 2), step)
    assert np.abs(found - by_hand(xy, density, edges, step)).max() < 1e-9


def test_short_steps_of_a_fork_written_out():
    """Steps so short that the direction is known after three of them only."""
    xy = np.array([[0, 0], [1, 0.2], [2, 0], [3, 0.5], [2.5, 1], [4, 1], [3, 2], [5, 0]], dtype=float)
    edges = [(0, 1), (1, 2), (2, 3), (2, 4), (4, 6), (3, 5), (5, 7)]
    step, density = 5 * UNIT, np.linspace(0.2, 1, 8)
    found = walk_features(xy, density, np.array(edges), step)
    assert np.abs(found - by_hand(xy, density, edges, step)).max() < 1e-9


def chain(points):
    points = np.asarray(points, dtype=float)
    count = len(points)
    edges = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    return LineGraph(points, np.ones(count), np.ones(count), points, edges)


def test_a_walk_of_short_steps_turns_by_its_first_way():
    """Several steps until there is a direction: a straight line seen from its middle goes on straight."""
    graph = chain([(0.1 * k, 0.0) for k in range(500)])
    cells = walk_features(graph.xy, graph.density, graph.edges, 0.1)[250].reshape(8, 3, 3, 3)
    assert cells[:, 1, 2, 1].sum() == pytest.approx(1)  # density unchanged, x ahead, y none
    assert cells.sum(axis=(1, 2, 3)) == pytest.approx(np.full(8, 1 / 8), abs=0.03)


def curve(step, angle=0.0, shift=(0.0, 0.0)):
    t = np.arange(0, 40, step)
    points = np.stack([t, 3 * np.sin(t / 3)], axis=1)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return chain(points @ turn + np.asarray(shift))


def test_turning_and_moving_changes_nothing():
    one, two = line_features(curve(0.05)), line_features(curve(0.05, 1.1, (30.0, -8.0)))
    assert np.abs(one - two).max() < 1e-5


def test_resolution_changes_little():
    coarse, fine = line_features(curve(0.085)), line_features(curve(0.042))
    at = np.linspace(0.1, 0.9, 50)
    a, b = coarse[(at * len(coarse)).astype(int)], fine[(at * len(fine)).astype(int)]
    assert np.abs(a - b).sum(axis=1).max() < 0.08


def test_features_are_shares():
    found = line_features(curve(0.085))
    assert found.shape[1] == 216
    assert found.min() >= 0
    assert found.sum(axis=1) == pytest.approx(np.ones(len(found)), abs=1e-5)


def test_even_steps_keep_the_line():
    graph = curve(0.07)
    steps = even_steps(graph, EVEN_STEP)
    lengths = np.linalg.norm(steps.xy[steps.edges[:, 0]] - steps.xy[steps.edges[:, 1]], axis=1)
    assert lengths == pytest.approx(np.full(len(lengths), EVEN_STEP), rel=0.03)
    back = steps.xy[steps.low] * (1 - steps.part[:, None]) + steps.xy[steps.high] * steps.part[:, None]
    assert np.abs(back - graph.xy).max() < 0.05


def test_a_dot_and_nothing():
    empty = np.zeros((0, 2))
    assert walk_features(empty, np.zeros(0), np.zeros((0, 2), dtype=np.intp), 0.5).shape == (0, 216)
    lone = line_features(chain([(1.0, 2.0)]))
    assert lone.sum() == pytest.approx(1)
