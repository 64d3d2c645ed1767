import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scribbles import coverage, scan_of

from handout.scanning.density import find_density
from handout.scanning.inks import find_inks
from handout.scanning.line_graph import find_line_graph, fitted_to_ink, half_widths, sample_image
from handout.scanning.mask import find_mask
from handout.scanning.skeleton import separate_strokes, skeleton, without_spurs

LONG = np.linspace((5, 23), (55, 27), 200)  # ink enough for a page
NEAR = 0.06


def way(*corners):
    """A stroke through corners, in steps of about .02 mm."""
    corners = np.array(corners, dtype=float)
    far = np.r_[0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))]
    at = np.linspace(0, far[-1], int(far[-1] / 0.02) + 2)
    return np.stack([np.interp(at, far, corners[:, k]) for k in (0, 1)], axis=1)


def read(strokes, dpi=300.0, pen=0.5):
    scan = scan_of(coverage([LONG, *strokes], 60.0, 30.0, dpi, pen), dpi)
    inks = find_inks(scan)
    density = find_density(scan, inks)
    graph = find_line_graph(scan, find_mask(scan, inks, density), density)
    return graph.take(np.flatnonzero(graph.xy[:, 1] < 21))


def off(graph, strokes):
    """(n,) mm: how far each vertex is from the way of the pen, and (k,) how far that is from the graph; ends apart."""
    true = np.concatenate(strokes)
    tips = cKDTree([stroke[k] for stroke in strokes for k in (0, -1)])
    inner, middle = tips.query(graph.xy)[0] > 0.3, tips.query(true)[0] > 0.3
    drawn = np.concatenate([graph.xy, graph.xy[graph.edges].mean(axis=1)])
    return cKDTree(true).query(graph.xy[inner])[0], cKDTree(drawn).query(true[middle])[0]


@pytest.mark.slow
@pytest.mark.parametrize("dpi", [300.0, 600.0])
@pytest.mark.parametrize("wide", [3.0, 5.0])
def test_two_strokes_to_a_point_are_taken_apart(wide, dpi, monkeypatch):
    sharp = way((20 - wide / 2, 6), (20, 16), (20 + wide / 2, 6))
    found, met = off(read([sharp], dpi), [sharp])
    assert (found <= NEAR).mean() >= 0.95
    assert (met <= NEAR + 0.02).mean() >= 0.93
    monkeypatch.setattr("handout.scanning.line_graph.separate_strokes", lambda xy, edges, *_: (xy, edges))
    assert (met <= NEAR).mean() > (off(read([sharp], dpi), [sharp])[1] <= NEAR).mean()


@pytest.mark.slow
@pytest.mark.parametrize("angle", [25, 40, 60, 85])
def test_a_crossing_goes_straight_through(angle):
    centre = np.array([20, 11])
    lean = 6 * np.array([np.sin(np.radians(angle / 2)), np.cos(np.radians(angle / 2))])
    strokes = [way(centre - to, centre + to) for to in (lean, lean * (-1, 1))]
    graph = read(strokes)
    found, met = off(graph, strokes)
    assert (found <= NEAR).mean() >= 0.95
    assert (met <= NEAR + 0.02).mean() >= 0.95
    assert (graph.degree == 1).sum() == 4
    assert graph.components.max() == 0


def test_a_stroke_that_comes_back_on_its_own_stem():
    """The arch of an n: it leaves the stem slowly, half way up."""
    arch = way((20, 6), (20, 16), (20.3, 11), (21.5, 8), (23, 8), (23.5, 16))
    found, _ = off(read([arch]), [arch])
    assert (found <= 0.1).mean() >= 0.93
    assert np.median(found) < 0.04


@pytest.mark.parametrize("radius", [0.45, 0.6])
def test_a_tight_turn_lies_half_a_width_from_its_outer_edge(radius):
    t = np.linspace(0, np.pi, 100)
    turn = np.stack([20 + radius * np.cos(t), 8 - radius * np.sin(t)], axis=1)
    hairpin = np.concatenate([way((20 + radius, 18), turn[0]), turn, way(turn[-1], (20 - radius, 18))])
    _, met = off(read([hairpin]), [turn])
    assert met.max() < 0.09


def test_ends_reach_to_where_the_pen_was():
    stroke = way((10, 8), (30, 14))
    graph = read([stroke])
    ends = graph.xy[graph.degree == 1]
    ends = ends[np.argsort(ends[:, 0])]
    assert np.linalg.norm(ends - stroke[[0, -1]], axis=1).max() < 0.16  # round caps: at most half their radius beyond


def pieces(edges, count):
    joined = coo_matrix((np.ones(len(edges)), tuple(edges.T)), shape=(count, count))
    return connected_components(joined, directed=False)[0]


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 7), st.integers(3, 9))
def test_pieces_stay_whole(seed, strokes, width):
    rng = np.random.default_rng(seed)
    ink = np.zeros((120, 160), dtype=np.uint8)
    for _ in range(strokes):
        points = rng.integers((10, 10), (150, 110), (int(rng.integers(2, 5)), 2)).astype(np.int32)
        cv2.polylines(ink, [points], bool(rng.random() < 0.3), 1, width)
    inside = cv2.distanceTransform(ink, cv2.DIST_L2, 5)
    xy, edges = skeleton(ink > 0)
    before = pieces(edges, len(xy))
    taken, pairs = separate_strokes(xy, edges, sample_image(inside, xy), width / 2)
    assert pieces(pairs, len(taken)) == before
    assert not len(pairs) or len(np.unique(pairs)) == pairs.max() + 1
    assert (pairs[:, 0] != pairs[:, 1]).all()
    pruned, left = without_spurs(taken, pairs, inside)
    assert pieces(left, len(pruned)) == before
    moved, half = fitted_to_ink(pruned, left, ink.astype(np.float32), ink.astype(np.float32), width / 2)
    assert np.isfinite(moved).all()
    assert ((half > 0) & (half <= 0.7 * width + 1e-9)).all()


def test_width_is_that_of_the_branch_where_it_runs_alone():
    count = 60
    chain = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    own = np.full(count, 3.0)
    own[20:25] = 9.0  # a blot
    assert half_widths(own, chain, count, 2.5)[1:-1] == pytest.approx(3.0)
    assert half_widths(own[:5], chain[:4], 5, 2.5) == pytest.approx(2.5)  # too short to tell
