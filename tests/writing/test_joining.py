"""Ligatures of letters that were no neighbours."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.writing.forms import Connector
from handout.writing.joining import at, blend, matches, meets, smooth


def way(xy, radius=0.02, height=0.0):
    xy = np.array(xy, dtype=float)
    uv = np.column_stack([np.arange(len(xy)), np.arange(len(xy))]) * 1.5
    return Connector(xy, np.full(len(xy), radius), np.linspace(0, 1, len(xy)), uv, 0, len(xy), len(xy), height)


def arc(rise, count, turn=0.0):
    t = np.linspace(0, 1, count)
    return np.column_stack([0.3 * t, rise * t + turn * np.sin(np.pi * t)])


heights = st.lists(st.floats(-1, 1), max_size=4)


@pytest.mark.slow
@given(heights, heights)
def test_matches_are_each_other_s_closest(out, into):
    first = SimpleNamespace(exits=tuple(way(arc(0, 4), height=h) for h in out))
    second = SimpleNamespace(entries=tuple(way(arc(0, 4), height=h) for h in into))
    found = matches(first, second)
    for i, j in found:
        assert all(abs(out[i] - into[j]) <= abs(out[i] - h) for h in into)
        assert all(abs(out[i] - into[j]) <= abs(h - into[j]) for h in out)
    assert len({i for i, _ in found}) == len({j for _, j in found}) == len(found)
    assert bool(found) == bool(out and into)


def test_several_ligatures_at_once():
    first = SimpleNamespace(exits=(way(arc(0, 4), height=0.0), way(arc(0, 4), height=0.3)))
    second = SimpleNamespace(entries=(way(arc(0, 4), height=0.05), way(arc(0, 4), height=0.28)))
    assert matches(first, second) == ((0, 0), (1, 1))


@pytest.mark.parametrize("counts", [(40, 40), (25, 60), (60, 25)])
def test_a_blend_is_pinned_and_keeps_both_directions(counts):
    out, into = way(arc(0.2, counts[0], 0.1), 0.02), way(arc(-0.1, counts[1], -0.05), 0.03)
    ours, theirs = out.xy, into.xy + np.array([0.05, 0.07])
    t, xy, radius = blend(out, into, ours, theirs, 1.0)
    assert len(t) == max(counts)
    assert np.array_equal(xy[0], ours[0]) and np.array_equal(xy[-1], theirs[-1])
    assert radius[0] == out.radius[0] and radius[-1] == into.radius[-1] and (np.diff(radius) >= 0).all()

    def direction(step):
        return step / np.linalg.norm(step)

    assert direction(xy[1] - xy[0]) @ direction(ours[1] - ours[0]) > 0.99
    assert direction(xy[-1] - xy[-2]) @ direction(theirs[-1] - theirs[-2]) > 0.99


def test_the_paper_s_weight_would_break_the_stroke(monkeypatch):
    """Why the weight is smooth at both ends: sin(½πt) turns at once towards the other way."""
    import handout.writing.joining as joining

    out, into = way(arc(0, 200)), way(arc(0, 200))
    turns = {}
    for name, weight in (("smooth", smooth), ("sine", lambda t: np.sin(0.5 * np.pi * t))):
        monkeypatch.setattr(joining, "smooth", weight)
        _, xy, _ = joining.blend(out, into, out.xy, into.xy + np.array([0, 0.1]), 1.0)
        step = xy[1] - xy[0]
        turns[name] = abs(np.arctan2(step[1], step[0]))
    assert turns["smooth"] < 0.02 < 0.3 < turns["sine"]


def test_ways_that_are_no_one_movement_are_not_mixed():
    """A mean of a way that dips and one that rises has a hump that neither letter has."""
    t = np.linspace(0, 1, 60)
    dips, rises = (way(np.column_stack([t, height * np.sin(2 * np.pi * t) + 0.1 * t])) for height in (-0.6, 0.6))
    turns = {}
    for unit in (10.0, 1.0):
        _, xy, _ = blend(dips, rises, dips.xy, rises.xy, unit)
        assert np.array_equal(xy[0], dips.xy[0]) and np.array_equal(xy[-1], rises.xy[-1])
        heading = np.unwrap(np.arctan2(*np.diff(xy, axis=0).T[::-1]))
        turns[unit] = np.abs(np.diff(heading)).sum()
    assert turns[1.0] < turns[10.0]


@settings(max_examples=40, deadline=None)
@given(st.floats(-2, 2), st.floats(-0.5, 0.5))
def test_where_ways_meet_is_where_they_lie_on_each_other(shift, rise):
    out = way(arc(0.2, 30, 0.1))
    found, deviation = meets(out, way(out.xy - np.array([shift, rise])))
    assert found == pytest.approx(shift, abs=1e-9) and deviation == pytest.approx(0, abs=1e-9)


def test_one_way_blended_with_itself_is_itself():
    one = way(arc(0.3, 31, 0.1))
    t, xy, radius = blend(one, one, one.xy, one.xy, 1.0)
    assert np.allclose(xy, one.xy, atol=1e-14) and np.allclose(radius, one.radius)
    assert np.allclose(at(one, one.uv, t), one.uv, atol=1e-12)


def test_each_side_keeps_its_own_ink():
    out, into = way(arc(0, 20)), way(arc(0, 50))
    t, _, _ = blend(out, into, out.xy, into.xy, 1.0)
    assert np.array_equal(at(out, out.uv, t)[[0, -1]], out.uv[[0, -1]])
    assert np.array_equal(at(into, into.uv, t)[[0, -1]], into.uv[[0, -1]])
    assert (np.diff(at(out, out.uv, t)[:, 0]) > 0).all() and np.allclose(at(into, into.density, t), into.density)
