"""The measure itself: it sees what is wrong, and only that."""

import numpy as np
import pytest
from cursive import page

from handout.plotting import observation
from handout.values import Drawing, Stroke


def changed(drawing, change):
    return Drawing(tuple(change(stroke) for stroke in drawing.strokes), drawing.page)


DRAWING = page(words=4)


def test_the_same_is_the_same():
    found = observation.compare_strokes(DRAWING, DRAWING)
    assert found.deviation < 1e-9 and found.rms < 0.01 and found.stretched == 1
    assert found.correlation > 0.999 and found.timed == pytest.approx(1)


def test_a_shift_of_the_paper_is_seen():
    found = observation.compare_strokes(DRAWING, changed(DRAWING, lambda s: Stroke(s.t, s.xy + np.array([0.3, 0.4]))))
    assert 0.45 < found.deviation <= 0.5001 and found.correlation > 0.95


def test_a_cut_off_loop_is_seen():
    def cut(stroke):
        keep = np.ones(len(stroke.t), dtype=bool)
        keep[len(keep) // 3 : len(keep) // 3 + 12] = len(keep) < 50
        return Stroke(stroke.t[keep], stroke.xy[keep])

    assert observation.compare_strokes(DRAWING, changed(DRAWING, cut)).deviation > 0.3


def test_a_slower_clock_is_a_stretch_and_spoils_only_the_time():
    found = observation.compare_strokes(DRAWING, changed(DRAWING, lambda s: Stroke(1.1 * s.t, s.xy)))
    assert found.stretched == pytest.approx(1.1) and found.correlation > 0.999 and found.timed < 0.8


def test_even_speed_has_lost_the_hand():
    def even(stroke):
        arc = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(stroke.xy, axis=0).T))])
        share = (arc + np.arange(len(arc)) * 1e-9) / max(arc[-1], 1e-6)
        return Stroke(stroke.t[0] + share * (stroke.t[-1] - stroke.t[0]), stroke.xy)

    found = observation.compare_strokes(DRAWING, changed(DRAWING, even))
    assert found.correlation < 0.5 and found.rms > 0.1 and found.stretched == pytest.approx(1, abs=1e-6)


def test_different_strokes_cannot_be_compared():
    with pytest.raises(ValueError):
        observation.compare_strokes(DRAWING, Drawing(DRAWING.strokes[:-1], DRAWING.page))
    dot = Drawing((Stroke([0.0], [[1.0, 1.0]]),), DRAWING.page)
    with pytest.raises(ValueError, match="moves"):
        observation.compare_strokes(dot, dot)
