"""From blocks that are done to a place on the drawing."""

import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.plotting import plan
from handout.plotting.jobs.places import START, DrawnPlace, Milestones, place, take_drawn
from handout.values import Drawing, Page, Stroke

PROFILES = [profiles.find(name, "plotter") for name in ("simulated", "grbl-z")]
DRAWING = page(words=5)


@pytest.mark.parametrize("profile", PROFILES, ids=lambda p: p.name)
@pytest.mark.parametrize("speed", [1.0, 0.4, "fast"])
def test_every_block_leads_to_its_place(profile, speed):
    made = plan(DRAWING, profile, speed=speed)
    reached = Milestones(made)
    assert len(reached.ink) == len(reached.stroke) == len(reached.time) == len(made.blocks) + 1
    assert reached.place(0) == START and reached.place(len(made.blocks)) == DrawnPlace(len(DRAWING.strokes))
    assert reached.ink[-1] == pytest.approx(made.pen_down) and (np.diff(reached.ink) >= 0).all()
    order = list(zip(reached.stroke.tolist(), reached.time.tolist(), strict=True))
    assert order == sorted(order)
    xy = np.array([[block.x, block.y] if hasattr(block, "x") else [np.nan] * 2 for block in made.blocks])
    ends = made.placement.to_page(xy)
    within = np.flatnonzero(np.isfinite(reached.time))
    assert len(within) > 500
    for done in within[:: max(1, len(within) // 60)]:
        stroke, time = reached.place(done)
        at = [np.interp(time, DRAWING.strokes[stroke].t, DRAWING.strokes[stroke].xy[:, axis]) for axis in (0, 1)]
        assert np.hypot(*(ends[done - 1] - at)) < 0.01
        before = take_drawn(DRAWING, DrawnPlace(stroke, time)).pen_down
        assert before == pytest.approx(reached.ink[done], rel=0.02)


def test_a_dot_is_drawn_when_the_pen_has_rested_on_it():
    dots = Drawing((Stroke([0.0, 0.2], [[20.0, 20.0]] * 2), Stroke([1.0], [[30.0, 20.0]])), Page(100, 100))
    made = plan(dots, PROFILES[0])
    told = [place(made, done).stroke for done in range(len(made.blocks) + 1)]
    named = [type(block).__name__[:-5] + str(getattr(block, "down", "")) for block in made.blocks]  # without "Block"
    assert named == ["PenFalse", "Move", "PenTrue", "", "PenFalse", "Move", "PenTrue", "PenFalse", "Move"]
    assert told == [0, 0, 0, 0, 1, 1, 1, 2, 2, 2]


def test_lifting_and_lowering_draw_nothing():
    made = plan(DRAWING, PROFILES[1])
    reached = Milestones(made)
    for at, (block, _) in enumerate(made.toolpath.instructions):
        if block is not None:
            assert reached.ink[at + 1] == reached.ink[at]
