"""Lines swell as the pen is pressed, tilted and turned."""

import numpy as np
import pytest

from handout.inking.footprints import edge, mark_drawing
from handout.inking.pen import PENS, usual
from handout.inking.pens import ink
from handout.values import Drawing, Page, Stroke


def line(way, n=40, **pen):
    along = np.linspace(0, 10, n)[:, None] * [np.cos(way), np.sin(way)]
    channels = {name: np.full(n, value) if np.isscalar(value) else value for name, value in pen.items()}
    return Stroke(np.arange(n) * 0.01, 15 + along, **channels)


def drawn(stroke, model):
    return mark_drawing(Drawing((stroke,), Page(40, 40)), usual(model)).strokes[0]


@pytest.mark.parametrize("model", [name for name in PENS if name != "chisel"])
def test_pressure_swells(model):
    width = drawn(line(0.0, pressure=np.linspace(0.1, 0.9, 40)), model).width
    assert (np.diff(width) > 0).all()


def test_a_brush_pen_lies_along_its_lean():
    along, across = (
        drawn(line(way, pressure=0.55, tilt=0.8, azimuth=0.3), "brushpen").width.mean() for way in (0.3, 1.87)
    )
    upright = drawn(line(0.0, pressure=0.55), "brushpen").width.mean()
    assert along < 0.9 * upright and across > 1.1 * upright


def test_a_chisel_has_an_edge():
    stroke = drawn(line(0.0, pressure=0.5, rotation=1.0), "chisel")
    assert stroke.nib == usual("chisel").width and stroke.rotation[0] == 1.0
    np.testing.assert_allclose(edge(line(0.0, azimuth=0.5)), 0.5 + np.pi / 2)
    np.testing.assert_allclose(edge(line(0.0)), -np.radians(40))


def test_a_chisels_dots_are_diamonds_that_stay_apart():
    """A dash along the edge would be a hairline; the two dots of ë are nearer than the edge is long."""
    width = usual("chisel").width
    dash = np.array([[0.0, 0.0], [0.3, -0.25]])
    dots = [Stroke(np.array([t, t + 0.1]), at + dash) for t, at in ((0.0, (5, 5)), (1.0, (6.2, 5)), (2.0, (20, 5)))]
    dots.append(Stroke(np.array([3.0]), np.array([[30.0, 5.0]])))
    made = mark_drawing(Drawing(tuple(dots), Page(40, 10)), usual("chisel")).strokes
    assert [round(s.nib / width, 2) for s in made] == [round(0.65 * 1.2 / width, 2)] * 2 + [1.0, 1.0]
    for stroke in made:
        way = stroke.xy[-1] - stroke.xy[0]
        edge = np.array([np.cos(stroke.rotation[0]), np.sin(stroke.rotation[0])])
        assert abs(way @ edge) < 1e-9 and np.hypot(*way) == pytest.approx(0.7 * stroke.nib) and way[1] > 0


def test_a_fountain_pen_is_thin_along_its_edge():
    thin, broad = (drawn(line(way, pressure=0.55, rotation=0.4), "fountain").width.mean() for way in (0.4, 1.97))
    assert thin == pytest.approx(0.7 * broad, rel=0.01)


def test_strokes_of_their_own_width_keep_it():
    stroke = line(0.0, pressure=0.9, width=0.7)
    assert drawn(stroke, "brushpen").width.tolist() == stroke.width.tolist()


@pytest.mark.parametrize(("model", "pen"), [("brushpen", {"pressure": 0.9}), ("chisel", {"rotation": 1.57})])
def test_pixels_show_the_footprint(model, pen):
    amounts = []
    for more in (pen, {"pressure": 0.15, "rotation": 0.0}):
        page = Drawing((line(0.0, **more),), Page(40, 40))
        amounts.append(float((ink(page, 150, usual(model), np.random.default_rng(0)).rgba[..., 3] > 76).sum()))
    assert amounts[0] > 1.8 * amounts[1]
