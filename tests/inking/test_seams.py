"""Seams: the cheapest of all, and where layers show one line only one of them is left."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scanned import ink, page_of, written

from handout.inking.layers import GlyphLayer, part_layers, seam
from handout.inking.source import InkSource
from handout.inking.texture import texture
from handout.inking.warping import warp
from handout.values import LineGraph


def cost_of(a, b, both, taken):
    a, b = (np.concatenate([of[..., :3] * of[..., 3:], of[..., 3:]], axis=2) for of in (a / 255, b / 255))
    apart, total = np.sqrt(((a - b) ** 2).sum(axis=2)), 0.0
    for y, x in zip(*np.nonzero(both), strict=True):
        for v, u in ((y, x + 1), (y + 1, x)):
            if v < both.shape[0] and u < both.shape[1] and both[v, u] and taken[y, x] != taken[v, u]:
                total += apart[y, x] + apart[v, u]
    return total


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_no_seam_is_cheaper(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, 256, (2, 3, 4, 4), dtype=np.uint8)
    both = rng.random((3, 4)) < 0.85
    to_a, to_b = np.zeros((2, 3, 4), dtype=bool)
    to_a[:, 0], to_b[:, -1] = both[:, 0], both[:, -1]
    taken = seam(a, b, both, to_a, to_b)
    assert not taken[to_a].any() and taken[to_b].all() and not taken[~both].any()
    free = np.argwhere(both & ~to_a & ~to_b)
    best = np.inf
    for choice in product([False, True], repeat=len(free)):
        other = to_b.copy()
        other[tuple(free.T)] = choice
        best = min(best, cost_of(a, b, both, other))
    assert cost_of(a, b, both, taken) == pytest.approx(best, abs=0.02)


def line(points, colour, ends=True):
    """A layer with a line 5 pixels wide through points (n, 2) on 60 × 40 pixels."""
    xy = np.asarray(points, dtype=float)
    step = np.gradient(xy, axis=0)
    twice = (step[:, 0] + 1j * step[:, 1]) ** 2
    twice /= np.abs(twice)
    place = np.stack(np.meshgrid(np.arange(60), np.arange(40)), axis=-1)
    away = np.linalg.norm(place[:, :, None] - xy, axis=-1)
    near = np.where(away.min(axis=2) <= 6, away.argmin(axis=2), -1).astype(np.int32)
    rgba = np.zeros((40, 60, 4), dtype=np.uint8)
    rgba[away.min(axis=2) <= 2.5] = colour
    loose = np.zeros(len(xy), dtype=bool)
    loose[[0, -1]] = ends
    return GlyphLayer(rgba, near, (0, 0), xy, np.full(len(xy), 2.5), twice, loose)


def test_of_two_versions_of_a_line_one_is_left():
    x = np.arange(5, 46)
    a = line(np.stack([x, np.full(41, 20)], axis=1), (128, 0, 0, 255))
    b = line(np.stack([x + 10, np.full(41, 20)], axis=1), (0, 0, 128, 255))
    c, d = part_layers([a, b])
    shown = (c.rgba[..., 3] > 0).astype(int) + (d.rgba[..., 3] > 0)
    assert np.array_equal(shown > 0, (a.rgba[..., 3] > 0) | (b.rgba[..., 3] > 0)) and shown.max() == 1
    assert (c.rgba[20, 5:15, 3] == 255).all() and (d.rgba[20, 46:55, 3] == 255).all(), "each keeps what it has alone"
    assert (np.diff(d.rgba[20, 5:56, 3].astype(int)) >= 0).all(), "one seam"


def test_the_seam_runs_where_the_layers_are_alike():
    x = np.arange(5, 46)
    a = line(np.stack([x, np.full(41, 20)], axis=1), (128, 0, 0, 255))
    b = line(np.stack([x + 10, np.full(41, 20)], axis=1), (0, 0, 128, 255))
    a.rgba[:, 33:36][a.rgba[:, 33:36, 3] > 0] = (0, 0, 128, 255)
    _, d = part_layers([a, b])
    assert 33 <= np.flatnonzero(d.rgba[20, :, 3])[0] <= 35


def test_lines_that_cross_are_both_left():
    a = line(np.stack([np.arange(5, 56), np.full(51, 20)], axis=1), (128, 0, 0, 255))
    b = line(np.stack([np.full(31, 30), np.arange(5, 36)], axis=1), (0, 0, 128, 255))
    c, d = part_layers([a, b])
    assert c is a and d is b


def test_what_a_piece_ends_in_is_left_to_the_line_that_goes_on():
    a = line(np.stack([np.arange(5, 56), np.full(51, 20)], axis=1), (128, 0, 0, 255))
    b = line(np.stack([np.arange(20, 41), np.full(21, 20)], axis=1), (0, 0, 128, 255))
    c, d = part_layers([a, b])
    assert c.rgba[20, 20, 3] == 255 and d.rgba[20, 20, 3] == 0
    assert (c.rgba[20, 5:56, 3] + d.rgba[20, 5:56, 3] == 255).all()


def test_where_one_layer_breaks_off_the_other_is_seen():
    points = np.stack([np.arange(5, 56), np.full(51, 20)], axis=1)
    a, b = line(points, (128, 0, 0, 255)), line(points, (0, 0, 128, 255))
    a.loose[[25, 26]] = True
    b.loose[[0, 12, 13, 50]] = True
    c, d = part_layers([a, b])
    assert (d.rgba[20, 30:32, 3] == 255).all() and not c.rgba[20, 30:32, 3].any()
    assert (c.rgba[20, 17:19, 3] == 255).all() and not d.rgba[20, 17:19, 3].any()
    assert (c.rgba[20, 5:56, 3] + d.rgba[20, 5:56, 3] == 255).all()


def test_a_ligature_written_by_two_strangers(small_hand):
    """The way of one letter to the next, drawn with the ink of both, is not twice as thick."""
    hand = small_hand
    number = next(n for n, glyph in enumerate(hand.glyphs) if len(glyph.ligatures) == 1)
    pair = [ink(hand, n) for n in (number, hand.glyphs[number].after)]
    # the second one's ink is a little off, as that of another instance would be
    other = pair[1].graph
    pair[1] = type(pair[1])(
        LineGraph(other.xy, other.radius, other.density, other.uv + np.array([0.0, 0.6]), other.edges),
        0,
        pair[1].number,
    )
    source = InkSource(hand.pages[0])
    page = page_of(hand)
    layers = warp(pair, {0: source}, 300.0, hand.pages[0].shape)
    first, second = part_layers(layers)
    gone = [(old.rgba[..., 3] > 0).sum() - (new.rgba[..., 3] > 0).sum()
            for old, new in zip(layers, (first, second), strict=True)]  # fmt: skip
    assert min(gone) > 0, "each gave something up"
    both = texture(written(pair, page), hand, 300.0).rgba[..., 3].sum()
    plain = texture(written([ink(hand, n) for n in (number, hand.glyphs[number].after)], page), hand, 300.0)
    assert both == pytest.approx(plain.rgba[..., 3].sum(), rel=0.06)
