"""Values in a notebook: one line each, and pictures of what can be seen."""

import dataclasses
import importlib
import io
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import handout
from handout import profiles
from handout.colour.table import ColourTable
from handout.summary import one_line
from handout.values import Drawing, Page, Raster, Stroke


@pytest.fixture(scope="module")
def written():
    hand, rng = handout.load("house-joined"), np.random.default_rng(1)
    (page,) = handout.compose("Dear Ada", hand, handout.Layout(handout.page("A6")), rng)
    return hand, page, handout.trace(page, hand, rng)


def parts(value, depth=4):
    """A value and what it is made of."""
    yield value
    if depth and dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            part = getattr(value, field.name)
            for one in list(part)[:3] if isinstance(part, tuple) else [part]:
                if dataclasses.is_dataclass(one):
                    yield from parts(one, depth - 1)


def test_every_value_is_one_line(written, small_hand):
    hand, page, drawing = written
    plan = handout.plan(drawing, profiles.find("grbl-servo", "plotter"))
    table = ColourTable(np.zeros((9, 9, 9, 3)), np.zeros((9, 9, 9, 3)))
    seen = {}
    for whole in (hand, page, drawing, small_hand, plan, table, handout.ink(drawing, 50)):
        for value in parts(whole):
            said = seen[type(value).__name__] = repr(value)
            assert "\n" not in said and len(said) < 500 and said.startswith(type(value).__name__)
    assert seen["Hand"].startswith("Hand(name='house-joined', title='Everyday joined-up hand', glyphs=<")
    sizes = f"strokes=<{len(drawing.strokes)}>, page={seen['Page']}, about=<{len(drawing.about)}>"
    assert seen["Drawing"] == f"Drawing({sizes})"
    assert "nodes=<9 × 9 × 9 × 3>" in seen["ColourTable"] and "delayed=" in seen["Glyph"]
    assert {"Manuscript", "Line", "Stroke", "LineGraph", "Raster", "ScannedHand", "ScannedPage", "Plan"} <= set(seen)


@pytest.mark.parametrize(
    "room", ["values", "hand.scanned", "colour.table", "colour.chart", "motion.reconstruction.plan"]
)
def test_whatever_holds_arrays_says_so_in_one_line(room):
    module = importlib.import_module(f"handout.{room}")
    known = [
        one for one in vars(module).values() if dataclasses.is_dataclass(one) and one.__module__ == module.__name__
    ]
    arrays = [one for one in known if not one.__dataclass_params__.eq]
    assert arrays and all(one.__repr__ is one_line for one in arrays)


def test_a_drawing_shows_its_strokes_under_names_of_its_own(written):
    drawing = written[2]
    said, root = drawing._repr_svg_(), ElementTree.fromstring(drawing._repr_svg_())
    assert root.get("viewBox") == "0 0 105 148" and "<script" not in said and "<style" not in said
    assert said.count('class="stroke"') == len(drawing.strokes) and drawing._repr_png_() is None
    one = drawing.strokes[0]
    wide = [dataclasses.replace(one, width=np.linspace(0.3, most, len(one.t))) for most in (1.0, 2.0)]
    shown = [Drawing((stroke,), drawing.page)._repr_svg_() for stroke in wide]
    names = [set(re.findall(r'id="([^"]+)"', one)) for one in shown]
    assert names[0] and not names[0] & names[1]
    for one, known in zip(shown, names, strict=True):
        assert set(re.findall(r"url\(#([^)]+)\)", one)) <= known


def test_a_hand_shows_a_line(written):
    hand = written[0]
    assert hand._repr_svg_().count('class="stroke"') > 20 and hand._repr_svg_() == hand._repr_svg_()
    some = {letter: hand.glyphs[letter] for letter in "abc"}
    assert dataclasses.replace(hand, glyphs=some)._repr_svg_().count('class="stroke"') >= 1


def test_scanned_ink_and_pixels_are_pictures(small_hand):
    page = Image.open(io.BytesIO(small_hand._repr_png_()))
    assert page.width <= 1000 and np.asarray(page.convert("L")).std() > 5
    rgba = np.zeros((20, 2000, 4), np.float32)
    rgba[5:15, :, 3] = 1.0
    picture = Image.open(io.BytesIO(Raster(rgba, 300)._repr_png_()))
    assert (
        picture.size == (1000, 10)
        and np.asarray(picture)[:, 0, 0].tolist() == [255] * 2 + [128] + [0] * 4 + [128] + [255] * 2
    )
    inked = Drawing((), Page(50, 50), ink=lambda dpi: Raster(rgba, dpi), inked=(0, 0, 10, 10))
    assert inked._repr_svg_() is None and inked._repr_png_().startswith(b"\x89PNG")


def test_an_empty_drawing_is_an_empty_page():
    empty = Drawing((), Page(50, 40))
    assert 'viewBox="0 0 50 40"' in empty._repr_svg_() and repr(empty).startswith("Drawing(strokes=()")
    assert repr(Stroke([0.0], [[1.0, 2.0]])) == "Stroke(t=<1>, xy=<1 × 2>)"
