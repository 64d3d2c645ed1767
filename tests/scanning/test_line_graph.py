import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scribbles import coverage, scan_of

from handout.scanning.density import find_density
from handout.scanning.inks import find_inks
from handout.scanning.line_graph import find_line_graph
from handout.scanning.mask import find_mask
from handout.values import LineGraph, Tag

DPI = 300.0


def graph_of(strokes, width=60.0, height=30.0, pen=0.5, dpi=DPI):
    scan = scan_of(coverage(strokes, width, height, dpi, pen), dpi)
    inks = find_inks(scan)
    density = find_density(scan, inks)
    return find_line_graph(scan, find_mask(scan, inks, density), density)


def bare(edges, count):
    xy = np.random.default_rng(0).random((count, 2))
    return LineGraph(xy, np.ones(count), np.ones(count), xy, np.reshape(edges, (-1, 2)))


def line(x0, y0, x1, y1):
    return np.linspace((x0, y0), (x1, y1), 200)


def circle(x, y, r, turns=1.0):
    t = np.linspace(0, 2 * np.pi * turns, 400)
    return np.stack([x + r * np.cos(t), y + r * np.sin(t)], axis=1)


LONG = line(5, 23, 55, 27)  # ink enough for a page


def test_a_stroke_is_one_path():
    graph = graph_of([LONG])
    assert len(graph.branches) == 1
    assert np.bincount(graph.degree).tolist() == [0, 2, len(graph) - 2]
    assert graph.lengths.sum() == pytest.approx(50.16, abs=0.6)
    assert np.abs(graph.xy[:, 1] - 23 - 0.08 * (graph.xy[:, 0] - 5)).max() < 0.075
    assert np.median(graph.radius) == pytest.approx(0.25, abs=0.04)
    assert 0.7 < np.median(graph.density) <= 1.2
    assert graph.uv == pytest.approx(graph.xy * DPI / 25.4 - 0.5)


def test_a_ring_closes():
    graph = graph_of([LONG, circle(15, 10, 5)])
    rings = [path for path in graph.branches if path[0] == path[-1]]
    assert len(rings) == 1
    away = np.hypot(*(graph.xy[rings[0]] - (15, 10)).T)
    assert np.abs(away - 5).max() < 0.05
    assert graph.components.max() == 1


def test_a_crossing_is_one_junction_of_four():
    graph = graph_of([LONG, line(10, 5, 10, 20), line(4, 12, 16, 12.5)])
    assert sorted(graph.degree[graph.degree > 2].tolist()) == [4]
    assert (graph.degree == 1).sum() == 6


def test_a_dot_stays():
    graph = graph_of([LONG, line(20, 10, 20.05, 10)])
    lone = np.flatnonzero(graph.components != graph.components[np.argmax(graph.xy[:, 1])])
    assert 1 <= len(lone) <= 3
    assert graph.xy[lone].mean(axis=0) == pytest.approx([20.0, 10.0], abs=0.15)


def test_rough_edges_leave_no_spurs():
    ink = coverage([LONG, line(5, 8, 55, 18)], 60.0, 30.0, DPI, 0.9)
    ink = np.clip(ink * np.random.default_rng(1).normal(1, 0.25, ink.shape), 0, 1).astype(np.float32)
    scan = scan_of(ink)
    inks = find_inks(scan)
    density = find_density(scan, inks)
    graph = find_line_graph(scan, find_mask(scan, inks, density), density)
    assert (graph.degree > 2).sum() == 0
    assert len(graph.branches) == 2


@pytest.mark.slow
@pytest.mark.parametrize("pen", [0.35, 0.6])
def test_the_path_is_that_of_the_pen(pen):
    t = np.linspace(5, 55, 4000)
    wave = np.stack([t, 12 + 5 * np.sin(t)], axis=1)
    graph = graph_of([wave], pen=pen)
    off = np.sqrt(((graph.xy[:, None] - wave[None, ::2]) ** 2).sum(axis=2).min(axis=1))
    assert np.sqrt((off**2).mean()) < 0.04  # under half a pixel


@pytest.mark.slow
def test_the_graph_does_not_depend_on_the_resolution():
    one, two = graph_of([LONG, circle(15, 10, 5)]), graph_of([LONG, circle(15, 10, 5)], dpi=600.0)
    assert one.lengths.sum() == pytest.approx(two.lengths.sum(), rel=0.01)
    assert np.median(one.radius) == pytest.approx(np.median(two.radius), abs=0.03)


def test_arrays_are_read_only_and_checked():
    graph = bare([[0, 1]], 3)
    assert not any(getattr(graph, name).flags.writeable for name in ("xy", "radius", "density", "uv", "edges"))
    with pytest.raises(ValueError, match="outside"):
        bare([[0, 3]], 3)
    with pytest.raises(ValueError, match="whole"):
        bare([[0, 0.5]], 3)


def test_take_keeps_edges_and_tags_within():
    graph = bare([[0, 1], [1, 2], [2, 3]], 4)
    tags = (Tag("label", 2, "a"), Tag("link", 1, to=3), Tag("link", 0, to=3))
    part = LineGraph(graph.xy, graph.radius, graph.density, graph.uv, graph.edges, tags).take([1, 2, 3])
    assert part.edges.tolist() == [[0, 1], [1, 2]]
    assert part.tags == (Tag("label", 1, "a"), Tag("link", 0, to=2))
    assert np.array_equal(part.xy, graph.xy[1:])


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 14), st.integers(0, 10**6))
def test_branches_cover_every_edge_once(count, seed):
    rng = np.random.default_rng(seed)
    pairs = {
        tuple(sorted(rng.choice(count, 2, replace=False).tolist())) for _ in range(int(rng.integers(0, 2 * count)))
    }
    graph = bare(sorted(pairs), count)
    walked = [tuple(sorted(step)) for path in graph.branches for step in itertools.pairwise(path)]
    assert sorted(walked) == sorted(pairs)
    for path in graph.branches:
        assert (graph.degree[path[1:-1]] == 2).all()
        assert len(path) == 1 or path[0] == path[-1] or (graph.degree[path[[0, -1]]] != 2).all()
    alone = [path[0] for path in graph.branches if len(path) == 1]
    assert alone == np.flatnonzero(graph.degree == 0).tolist()
