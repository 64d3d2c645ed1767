"""Pages in a scanned hand become strokes along their ink, in the order of writing."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from handout.errors import InputError
from handout.motion.recovery.pen_paths import pen_paths
from handout.motion.timing import smooth_values
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.layout import Layout

TEXT = "an even minute, this hen jumped"


@pytest.fixture(scope="module")
def sheet(small_hand):
    layout = Layout(page("90x60mm"), (6.0, 6.0, 6.0, 6.0), x_height=2.2)
    (only,) = compose(TEXT, small_hand, layout, np.random.default_rng(3))
    return only


@pytest.fixture(scope="module")
def drawing(sheet, small_hand):
    return trace(sheet, small_hand, np.random.default_rng(1))


def inked(sheet):
    graphs = [placed.ink.graph for line in sheet.lines for placed in line.placed]
    ends = [(g.xy[g.edges[:, 0]], g.xy[g.edges[:, 1]]) for g in graphs]
    return np.concatenate([a + (b - a) * share for a, b in ends for share in (0.0, 0.33, 0.66)])


def test_strokes_lie_on_the_ink_and_all_ink_is_written(sheet, drawing):
    ink, xy = inked(sheet), np.concatenate([stroke.xy for stroke in drawing.strokes])
    assert (cKDTree(ink).query(xy)[0] <= 0.15).mean() >= 0.98
    assert (cKDTree(xy).query(ink)[0] <= 0.2).mean() >= 0.99


def test_words_come_in_their_order_and_the_clock_runs_on(drawing):
    words = [stroke.word for stroke in drawing.strokes]
    assert words == sorted(words) and set(words) == set(range(6))
    assert all(b.t[0] > a.t[-1] for a, b in pairwise(drawing.strokes))
    assert 0.8 < len(TEXT.replace(" ", "")) / drawing.duration < 2.5


def test_joined_letters_are_one_movement(sheet, small_hand):
    found = pen_paths(sheet.lines[0].placed, small_hand, delayed_after="word")
    assert max(len(set(path.of.tolist())) for path in found) >= 3
    late = [path.delayed for path in found]
    assert any(late)
    for word in {path.word for path in found}:
        own = [path.delayed for path in found if path.word == word]
        assert own == sorted(own)  # dots and bars last


def test_a_hand_that_dots_at_once_does(sheet, small_hand):
    found = pen_paths(sheet.lines[0].placed, small_hand)
    at_once = [path.delayed for path in found]
    waiting = [path.delayed for path in pen_paths(sheet.lines[0].placed, small_hand, delayed_after="word")]
    assert len(at_once) >= len(waiting) - 1 and sum(at_once) == sum(waiting)


def test_strokes_have_the_width_of_their_ink(sheet, drawing):
    radius = np.concatenate([placed.ink.graph.radius for line in sheet.lines for placed in line.placed])
    width = np.concatenate([stroke.width for stroke in drawing.strokes])
    assert np.median(width) == pytest.approx(2 * np.median(radius), rel=0.15)


def test_speed_follows_the_curve(drawing):
    longest = max(drawing.strokes, key=lambda stroke: stroke.length)
    speed = longest.speed
    assert speed[0] < 0.7 * speed.max() and speed[-1] < 0.7 * speed.max()
    first = np.gradient(longest.xy, axis=0)
    second = np.gradient(first, axis=0)
    bend = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.maximum(np.hypot(*first.T), 1e-9) ** 3
    inner = slice(10, -10)
    kept = (bend[inner] > np.quantile(bend[inner], 0.2)) & (bend[inner] < np.quantile(bend[inner], 0.9))
    slope = np.polyfit(np.log(bend[inner][kept]), np.log(speed[inner][kept]), 1)[0]
    assert -0.45 < slope < -0.1


def test_pace_and_sameness(sheet, small_hand, drawing):
    twice = trace(sheet, small_hand, np.random.default_rng(1), speed=2.0)
    assert twice.duration == pytest.approx(drawing.duration / 2)
    assert all((a.xy == b.xy).all() for a, b in zip(twice.strokes, drawing.strokes, strict=True))
    with pytest.raises(InputError, match="kinematics"):
        trace(sheet, small_hand, np.random.default_rng(9), "magic")


def test_what_strikes_a_word_out_is_written_after_it(small_hand):
    layout = Layout(page("90x60mm"), (6.0, 6.0, 6.0, 6.0), x_height=2.2)
    (slipped,) = compose("even minute hens", small_hand, layout, np.random.default_rng(2), slips=100.0)
    struck = [placed for line in slipped.lines for placed in line.placed if placed.strokes]
    assert struck
    found = pen_paths(slipped.lines[0].placed, small_hand)
    own = [path for path in found if path.word == struck[0].word]
    ends = [struck[0].strokes[0][0], struck[0].strokes[0][-1]]
    assert np.abs(own[-len(struck[0].strokes)].xy[[0, -1]] - ends).max() < 0.2


def test_smoothing_keeps_ends_and_straight_lines():
    way = np.column_stack([np.linspace(0, 5, 40), np.linspace(1, 3, 40)])
    assert smooth_values(way, 3.0) == pytest.approx(way)
    zigzag = way + np.where(np.arange(40) % 2, 0.05, -0.05)[:, None]
    made = smooth_values(zigzag, 3.0)
    assert np.abs(made - way)[6:-6].max() < 0.01
    assert made[[0, -1]] == pytest.approx(zigzag[[0, -1]])
