"""Movements of a joined hand that go on over their own ink."""

from typing import Any

import numpy as np
import pytest

from handout.motion.recovery.placed_strokes import PlacedGlyph, WordInk
from handout.values import LineGraph


def line(*places: tuple[float, float]) -> PlacedGlyph:
    """A glyph whose line goes through some places, mm."""
    xy = np.array(places, dtype=np.float64)
    edges = np.column_stack([np.arange(len(xy) - 1), np.arange(1, len(xy))])
    graph = LineGraph(xy, np.full(len(xy), 0.2), np.ones(len(xy)), xy, edges)
    nobody: Any = None
    return PlacedGlyph(nobody, graph, 0, [])


def part(glyph: PlacedGlyph, *vertices: int) -> tuple[PlacedGlyph, np.ndarray]:
    return glyph, np.array(vertices, dtype=np.intp)


def places(way: list[tuple[PlacedGlyph, np.ndarray]]) -> list[list[float]]:
    return [place for glyph, own in way for place in glyph.graph.xy[own].tolist()]


def test_the_way_back_over_a_stem():
    stem, hump = line((0, 3), (0, 2), (0, 1), (0, 0)), line((0, 1), (1, 2), (2, 0))
    ink = WordInk([stem, hump], 0.5)
    way = ink.path_between(part(stem, 0, 1, 2, 3), part(hump, 1, 2), 5.0)
    assert way is not None
    assert places(way) == [[0, 1]]  # which both have, once
    assert ink.path_between(part(stem, 0, 1, 2, 3), part(hump, 1, 2), 2.0) is None


def test_where_one_ceases_the_next_begins():
    first, second = line((0, 0), (1, 0)), line((1, 0), (2, 0))
    assert WordInk([first, second], 0.5).path_between(part(first, 0, 1), part(second, 0, 1), 0.0) == []


@pytest.mark.parametrize(("gap", "bridged"), [(0.05, True), (1.0, False)])
def test_ink_that_fails_is_bridged_only_so_far(gap, bridged):
    first, second = line((0, 0), (1, 0)), line((1 + gap, 0), (4 + gap, 0))
    assert (
        WordInk([first, second], 0.5).path_between(part(first, 0, 1), part(second, 0, 1), 9.0) is not None
    ) == bridged
