import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.sigma_lognormal_model import REACH, onsets, pulses

asymmetries = st.floats(1e-3, 0.6)
durations = st.floats(1e-3, 2)
angles = st.floats(-2.6, 2.6)


def single(duration=0.3, asymmetry=0.1, theta=0.0, onset=0.0):
    return pulses([duration], [asymmetry], [theta], [onset])


def times(pulse, n, reach=8.0):
    """n times that follow the pulse closely, however skewed it is."""
    return pulse.t0[0] + np.exp(pulse.mu[0] + np.linspace(-reach, reach, n) * pulse.sigma[0])


def chain(seed, k):
    """k overlapping pulses and their chords."""
    rng = np.random.default_rng(seed)
    duration = rng.uniform(0.2, 0.5, k)
    bent = rng.uniform(-1.5, 1.5, k)
    begun = onsets(rng.uniform(0.3, 0.9, k), duration)
    return pulses(duration, rng.uniform(0.02, 0.2, k), bent, begun), rng.normal(size=k) + 1j * rng.normal(size=k)


@settings(max_examples=50, deadline=None)
@given(duration=durations, asymmetry=asymmetries)
def test_the_speed_has_area_one(duration, asymmetry):
    pulse = single(duration, asymmetry)
    logarithm = pulse.mu + np.linspace(-8, 8, 2001) * pulse.sigma
    late = np.exp(logarithm)
    speed = lognormal.rate(pulse, pulse.t0 + late)[0]
    assert np.trapezoid(speed * late, logarithm) == pytest.approx(1, abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(duration=durations, asymmetry=asymmetries, onset=st.floats(-2, 2))
def test_parameters_mean_what_they_say(duration, asymmetry, onset):
    pulse = single(duration, asymmetry, onset=onset)
    within = lognormal.progress(pulse, np.array([onset, onset + duration]))[0]
    assert np.allclose(within, [0.00135, 0.99865], atol=1e-4)
    mode, median = np.exp(pulse.mu - pulse.sigma**2), np.exp(pulse.mu)
    assert 1 - mode / median == pytest.approx(asymmetry, rel=1e-6)
    t = times(pulse, 4001, 3.0)
    at = int(lognormal.rate(pulse, t)[0].argmax())
    assert t[at] == pytest.approx(pulse.t0[0] + mode[0], abs=t[at + 1] - t[at])


def test_progress_is_the_integral_of_the_speed():
    pulse = single()
    t = times(pulse, 4001)
    done = lognormal.progress(pulse, t)[0]
    summed = np.concatenate(
        [[0], np.cumsum(np.diff(t) * 0.5 * (lognormal.rate(pulse, t)[0, 1:] + lognormal.rate(pulse, t)[0, :-1]))]
    )
    assert np.abs(done - summed).max() < 1e-6
    assert (lognormal.rate(pulse, pulse.t0 - [0, 1])[0] == 0).all()
    assert (lognormal.progress(pulse, pulse.t0 - [0, 1])[0] == 0).all()


@settings(max_examples=50, deadline=None)
@given(theta=angles.filter(lambda a: abs(a) > 1e-3))
def test_a_pulse_turns_by_twice_theta(theta):
    """By the formula, and by the directions in which the path sets out and arrives."""
    ends = lognormal.turn_of_share(np.array([0.0, 1.0]), theta)
    assert ends[1] - ends[0] == pytest.approx(2 * theta)
    places = lognormal.arc(np.array([0, 1e-7, 1 - 1e-7, 1]), np.array(theta))
    out, arriving = places[1] - places[0], places[3] - places[2]
    assert np.angle(out * np.exp(1j * theta)) == pytest.approx(0, abs=1e-5)
    assert np.angle(arriving * np.exp(-1j * theta)) == pytest.approx(0, abs=1e-5)


@settings(max_examples=50, deadline=None)
@given(theta=angles)
def test_the_arc_is_longer_than_its_chord_by_theta_over_its_sine(theta):
    places = lognormal.arc(np.linspace(0, 1, 4001), np.array(theta))
    assert np.abs(np.diff(places)).sum() == pytest.approx(lognormal.arc_over_chord(theta), rel=1e-6)
    bend = np.abs(places - places[len(places) // 2]).max()
    assert bend <= np.abs(np.diff(places)).sum()


@pytest.mark.parametrize("theta", [0.0, 1e-12, -1e-9, 1e-6, -0.3, 1.6, -2.6, 3.1])
def test_an_arc_ends_at_the_end_of_its_chord(theta):
    assert np.abs(lognormal.arc(np.array([0.0, 1.0]), np.array(theta)) - [0, 1]).max() < 1e-12


def test_a_bent_pulse_arrives_where_it_aims():
    """The printed signs of the paper would lead this one to (0.16, 3.16) or (3, −1)."""
    pulse = single(theta=0.6)
    end = lognormal.position(pulse, np.array([3 + 1j]), [10.0])[0]
    assert end == pytest.approx(3 + 1j)


def test_positive_angles_turn_from_x_towards_y():
    assert lognormal.arc(np.array([0.5]), np.array(0.8))[0].imag < 0  # it bulges away first, then turns left


def test_velocity_is_the_derivative_of_the_position():
    these, chords = chain(0, 8)
    t = np.linspace(0, these.time(2.0).max(), 40001)
    there = lognormal.position(these, chords, t)
    found = (there[2:] - there[:-2]) / (t[2] - t[0])
    speed = lognormal.velocity(these, chords, t)[1:-1]
    assert np.abs(found - speed).max() < 1e-4 * np.abs(speed).max()


def test_position_ends_at_the_sum_of_the_chords():
    these, chords = chain(1, 59)
    assert np.abs(lognormal.position(these, chords, [1e6])[0] - chords.sum()) < 1e-9


@pytest.mark.parametrize("k", [1, 2, 59])
def test_the_windowed_path_is_the_position(k):
    these, chords = chain(2, k)
    start, end = these.time(-REACH).min(), these.time(REACH).max()
    windowed = lognormal.path(these, chords, start, (end - start) / 1800, 1801)
    dense = lognormal.position(these, chords, np.linspace(start, end, 1801))
    extent = max(np.ptp(dense.real), np.ptp(dense.imag))
    assert np.abs(windowed - dense).max() <= 2e-4 * extent
    assert abs(windowed[0]) < 1e-12
    assert np.abs(windowed[-1] - chords.sum()) < 1e-9


def test_a_path_begun_late_and_cut_short_is_a_piece_of_the_whole():
    these, chords = chain(3, 12)
    start, end = these.time(-REACH).min(), these.time(REACH).max()
    step = (end - start) / 1000
    whole = lognormal.path(these, chords, start, step, 1001)
    piece = lognormal.path(these, chords, start + 300 * step, step, 400)
    assert np.allclose(piece, whole[300:700], atol=1e-12)


def test_onsets_follow_the_duration_of_the_pulse_before():
    assert np.allclose(onsets([9, 0.5, 0.25], [0.4, 0.8, 0.1]), [0, 0.2, 0.4])


def test_parameters_are_kept_within_what_can_be_evaluated():
    pulse = pulses([0.3, 0.3], [0.0, 0.9], [-9.0, 9.0], [0.0, 0.0])
    assert np.allclose(pulse.theta, [-2.6, 2.6])
    assert np.allclose(1 - np.exp(-(pulse.sigma**2)), [1e-3, 0.6])


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan, np.inf])
def test_refuses_a_duration_that_is_none(duration):
    with pytest.raises(ValueError, match="positive and finite"):
        single(duration)
