"""Times along paths of which only the shape is known."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.motion.recovery.pen_paths import PenPath
from handout.motion.timing import STROKE, curvature, sample_paths, time_in_air, time_paths, timed_strokes

ZIGZAG = np.array([[0.0, 0.0], [0.4, 1.0], [0.8, 0.0], [1.2, 1.0], [1.6, 0.0], [2.0, 1.0]])


def loops(turns=6, samples=600):
    """A chain of loops, as e after e."""
    angle = np.linspace(0, 2 * np.pi * turns, samples)
    return np.column_stack([0.11 * angle - 0.35 * np.sin(angle), 0.5 * np.cos(angle)])


def profile(xy):
    """t, speed and curvature at even times."""
    found = time_paths(sample_paths([xy]))
    t = np.arange(0.0, found.t[-1], 0.002)
    along = np.interp(t, found.t, found.along)
    way = sample_paths([xy])
    bend = np.interp(along, np.arange(len(way.xy)) * way.step[0], np.abs(curvature(way)))
    return t, np.gradient(along, t), bend


places = st.tuples(st.floats(-5, 5), st.floats(-5, 5))


@settings(deadline=None, max_examples=40)
@given(st.lists(st.lists(places, min_size=2, max_size=12).map(np.array), min_size=1, max_size=4))
def test_every_path_is_followed_to_its_end_and_never_backwards(paths):
    paths = [np.concatenate([xy, xy[-1:] + 0.5]) for xy in paths]
    way = sample_paths(paths)
    found = time_paths(way)
    for n, xy in enumerate(paths):
        own = slice(way.first[n], way.first[n + 1])
        assert way.xy[own][[0, -1]] == pytest.approx(xy[[0, -1]], abs=1e-9)
        t, along = (values[found.first[n] : found.first[n + 1]] for values in (found.t, found.along))
        assert t[0] == along[0] == 0
        assert (np.diff(t) > 0).all() and (np.diff(along) >= 0).all()
        assert along[-1] == pytest.approx(np.hypot(*np.diff(xy, axis=0).T).sum(), rel=1e-6)


@settings(deadline=None, max_examples=10)
@given(st.permutations(range(3)))
def test_paths_know_nothing_of_one_another(order):
    paths = [ZIGZAG, loops(2), np.array([[3.0, 0.0], [3.0, 0.2]])]
    together = time_paths(sample_paths([paths[n] for n in order]))
    for place, n in enumerate(order):
        own = slice(together.first[place], together.first[place + 1])
        alone = time_paths(sample_paths([paths[n]]))
        assert together.t[own] == pytest.approx(alone.t, abs=1e-9)
        assert together.along[own] == pytest.approx(alone.along, abs=1e-9)


def test_between_two_corners_speed_rises_and_falls_once_and_nearly_stops_in_them():
    from scipy.signal import find_peaks  # not above: it takes .8 s of CPU, in every process of xdist

    t, speed, bend = profile(ZIGZAG)
    high, _ = find_peaks(speed, prominence=0.05 * speed.max())
    low, _ = find_peaks(-speed, prominence=0.05 * speed.max())
    corners, _ = find_peaks(bend, prominence=1.0)
    assert len(high) == 5 and len(low) == len(corners) == 4
    assert np.abs(t[low] - t[corners]).max() < 0.1 * STROKE
    assert (speed[low] < 0.25 * speed[high].min()).all()


def test_speed_follows_curvature_as_peoples_does():
    from scipy.signal import find_peaks

    t, speed, _ = profile(loops())
    way = sample_paths([loops()])
    found = time_paths(way)
    run = np.arange(len(way.xy)) * way.step[0]
    place = np.interp(np.interp(t, found.t, found.along), run, way.xy @ np.array([1, 1j]))
    velocity = np.gradient(place, t)
    bend = np.abs((np.conj(velocity) * np.gradient(velocity, t)).imag) / np.abs(velocity) ** 3
    inner = (t > 0.1 * t[-1]) & (t < 0.9 * t[-1]) & (bend > 0.3)
    exponent = np.polyfit(np.log(bend[inner]), np.log(speed[inner]), 1)[0]
    assert -0.45 < exponent < -0.2
    high, _ = find_peaks(speed, prominence=0.05 * speed.max())
    assert np.median(np.diff(t[high])) == pytest.approx(STROKE, rel=0.4)


def test_what_is_twice_as_large_takes_longer_but_not_twice_as_long():
    one, two = (time_paths(sample_paths([size * loops(3)])).t[-1] for size in (1.0, 2.0))
    assert 1.05 * one < two < 1.5 * one


def test_pauses_grow_with_the_way_and_are_longer_between_words_and_lines():
    assert time_in_air(0.5, line=False, word=False) < time_in_air(2.0, line=False, word=False)
    letter, word, line = (time_in_air(2.0, line=n > 1, word=n > 0) for n in range(3))
    assert letter < 0.5 * word < word < line
    assert (
        time_in_air(2.0, line=False, word=True, deviation=1.0)
        > word
        > time_in_air(2.0, line=False, word=True, deviation=-1)
    )


def inked(xy, word=0):
    count = len(xy)
    return PenPath(np.asarray(xy), np.linspace(0.3, 0.5, count), np.ones(count), word, np.zeros(count, dtype=np.intp))


PATHS = [inked(2.5 * loops(3) + 20), inked([[30.0, 17.0]]), inked(2.5 * ZIGZAG + 40, word=1)]


def timed(seed=1, **knobs):
    return list(timed_strokes(PATHS, [0, 0, 1], 2.5, np.random.default_rng(seed), **knobs))


def test_strokes_lie_on_their_paths_with_the_widths_there():
    first, dot, _ = timed()
    near = np.hypot(*(first.xy[:, None] - PATHS[0].xy[None]).transpose(2, 0, 1))
    assert near.min(axis=1).max() < 0.05
    assert first.xy[[0, -1]] == pytest.approx(PATHS[0].xy[[0, -1]])
    assert first.width[0] == pytest.approx(0.3, abs=0.02) and first.width[-1] == pytest.approx(0.5, abs=0.02)
    assert len(dot.t) == 2 and dot.t[1] > dot.t[0]
    assert [stroke.word for stroke in timed()] == [0, 0, 1]


def test_strokes_follow_one_another_and_only_chance_differs():
    still = timed(jitter=0.0)
    assert all(a.t[-1] < b.t[0] for a, b in pairwise(still))
    assert still[-1].t[-1] == pytest.approx(timed(2, jitter=0.0)[-1].t[-1])
    assert timed(1)[-1].t[-1] != timed(2)[-1].t[-1]
    assert timed(jitter=0.0, speed=2.0)[-1].t[-1] == pytest.approx(still[-1].t[-1] / 2)
