"""Where ink failed, and where the pen was lifted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.motion.recovery.ink_gaps import (
    bridge_gaps,
    endpoints,
    gap_bridges,
    log_odds,
    prior_log_odds,
    severed_pairs,
)
from handout.values import LineGraph

HALF = 0.13


def broken(gap: float, taper: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A level line with a gap of some half widths in it, which it tapers towards: places, radii, edges."""
    x = np.concatenate([np.arange(20) * 0.09, 19 * 0.09 + gap * HALF + np.arange(20) * 0.09])
    radius = np.full(40, HALF)
    radius[15:25] *= taper
    edges = np.array([(v, v + 1) for v in range(39) if v != 19])
    return np.column_stack([x, np.zeros(40)]), radius, edges


@pytest.mark.parametrize(
    ("gap", "taper", "rate", "fails"),
    [
        (3.0, 0.5, 0.5, True),  # it fades on either side of a short gap
        (3.0, 1.0, 0.5, False),  # it ceases as wide as it was
        (9.0, 0.6, 0.5, False),
        (7.0, 0.6, 0.95, True),  # who joins nearly all letters joins these
        (7.0, 0.6, 0.05, False),
    ],
)
def test_a_gap_is_judged_by_its_width_the_taper_and_the_hand(gap, taper, rate, fails):
    xy, radius, edges = broken(gap, taper)
    owner = np.repeat([0, 1], 20)
    assert gap_bridges(xy, radius, edges, HALF, owner, rate).tolist() == ([[19, 20]] if fails else [])


@given(st.floats(0.1, 9.0), st.floats(0.1, 0.9), st.floats(0.5, 1.0))
@settings(deadline=None, max_examples=50)
def test_the_wider_the_gap_and_the_line_the_likelier_a_lift(gap, more, taper):
    def chance(width: float, thin: float) -> float:
        xy, radius, edges = broken(width, thin)
        _, left, right, _ = sorted(endpoints(xy, radius, edges, HALF), key=lambda one: one.place[0])
        return log_odds(left, right, HALF) + prior_log_odds()

    assert chance(gap + more, taper) < chance(gap, taper)
    assert chance(gap, taper + 0.1) < chance(gap, taper)


def test_a_hump_whose_ink_failed_at_its_stem_is_led_to_it():
    stem = np.column_stack([np.zeros(20), np.arange(20) * 0.09])
    hump = np.column_stack([0.4 + np.arange(15) * 0.09, np.full(15, 0.9)])
    xy, radius = np.concatenate([stem, hump]), np.full(35, HALF)
    radius[20:25] = 0.4 * HALF
    edges = np.array([(v, v + 1) for v in range(34) if v != 19])
    added = bridge_gaps(xy, radius, edges, HALF, set())[len(edges) :]
    assert added.tolist() == [[10, 20]]
    assert len(bridge_gaps(xy, radius, edges, HALF, {20})) == len(edges)  # there it goes on in another letter
    assert len(bridge_gaps(xy, radius, edges, HALF, set(), least=1.5)) == len(edges)  # a dot is no part of the line


def test_a_letter_goes_on_over_the_neighbour_that_cuts_it_in_two():
    # an upright line, whose middle is the neighbour's, which lies across it
    upright = np.column_stack([np.zeros(21), np.arange(21) * 0.1])
    across = np.column_stack([np.arange(1, 11) * 0.1, np.full(10, 1.0)])
    xy = np.concatenate([upright, across])
    edges = np.array([*((k, k + 1) for k in range(20)), (10, 21), *((k, k + 1) for k in range(21, 30))])
    graph = LineGraph(xy, np.full(31, 0.05), np.ones(31), xy, edges)
    assert severed_pairs(graph, np.delete(np.arange(21), 10)) in ([(9, 11)], [(11, 9)])
    # what is farther apart than a line is thick was not written in one go
    assert severed_pairs(graph, np.delete(np.arange(21), np.arange(6, 15))) == []
    assert severed_pairs(graph, np.arange(21)) == []
