"""What the ink tells of how often the pen passed: twice where it is wide, and where a ring was closed."""

from dataclasses import replace

import numpy as np
import pytest
from inked import RADIUS, arc, line, strokes

from handout.motion.recovery.letter_tracing import trace_letter
from handout.motion.recovery.network import build_network, ring_seams

USUAL = (RADIUS, 1.0)


def inked(one, wide, where=None):
    """A line whose ink is wider, all of it or at some vertices."""
    factor = np.where(np.ones(len(one.xy), dtype=bool) if where is None else where, wide, 1.0)
    return replace(one, radius=one.radius * factor, density=one.density * factor, usual=USUAL)


@pytest.mark.parametrize(("wide", "times"), [(1.0, 1), (1.35, 2)])
def test_a_stem_whose_ink_is_wide_was_passed_twice(wide, times):
    stem = line([[(0.0, 0.0), (0.0, 2.0)]])
    (only,) = strokes(stem, trace_letter(inked(stem, wide), "l"))
    assert np.abs(np.diff(only[:, 1])).sum() == pytest.approx(2.0 * times)


def test_little_ink_tells_nothing():
    short = inked(line([[(0.0, 0.0), (0.0, 0.2)]]), 2.0)
    net = build_network(short.xy, short.radius, short.density, short.edges, usual=USUAL)
    assert net.length[0] < 3 and net.retrace_odds.tolist() == [0.0]


@pytest.mark.parametrize(("seam", "wide"), [(60, 1.4), (135, 1.4), (200, 2.2)])  # nobody expects one so low
def test_a_ring_begins_and_ends_where_its_ink_is_wide(seam, wide):
    ring = arc((0.5, 0.5), 0.5, 0, 360, 49)
    one = line([[*ring[:-1], ring[0]]])
    angle = np.degrees(np.arctan2(*(one.xy - 0.5).T[::-1])) % 360
    one = inked(one, wide, np.abs(angle - seam) < 20)
    net = build_network(one.xy, one.radius, one.density, one.edges, usual=USUAL)
    assert {abs(angle[v] - seam) < 35 for v in ring_seams(net, [0])} == {True}
    (only,) = strokes(one, trace_letter(one, "o"))
    begun = np.degrees(np.arctan2(*(only[0] - 0.5)[::-1])) % 360
    assert abs(begun - seam) < 35


def test_a_little_wide_ink_at_the_foot_of_a_ring_is_no_seam():
    ring = arc((0.5, 0.5), 0.5, 0, 360, 49)
    one = line([[*ring[:-1], ring[0]]])
    angle = np.degrees(np.arctan2(*(one.xy - 0.5).T[::-1])) % 360
    one = inked(one, 1.4, np.abs(angle - 225) < 20)
    net = build_network(one.xy, one.radius, one.density, one.edges, usual=USUAL)
    assert not ring_seams(net, [0])
    (only,) = strokes(one, trace_letter(one, "o"))
    assert only[0, 1] > 0.5


def test_a_ring_of_even_ink_has_no_seam():
    ring = arc((0.5, 0.5), 0.5, 0, 360, 49)
    one = line([[*ring[:-1], ring[0]]])
    assert not ring_seams(build_network(one.xy, one.radius, one.density, one.edges), [0])
