"""Hands from recorded pens: pages of them, letters that labels name, and the way of the pen that is kept."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.hand import file
from handout.hand.library import load
from handout.hand.places import graphemes
from handout.motion.recovery.pen_paths import pen_paths
from handout.motion.trace import letters_of_samples, trace
from handout.sources.unipen import from_unipen
from handout.tagging.page_sources import tagged_pages
from handout.tagging.page_tagging import hand_of_pages
from handout.tagging.recorded_pages import (
    RecordedPage,
    labelled_pieces,
    laid_out,
    page_source,
    pieces_x_height,
    recorded_pages,
    turns,
    x_height_of_strokes,
)
from handout.values import Drawing, Moments, Page, Stroke
from handout.writing.compose import compose
from handout.writing.layout import Layout

TEXT = "quiet bells till it fits\nthe lily is hid"


def quiet(_: str) -> None:
    pass


def wave(waves, height=2.5, x=20.0, y=20.0):
    """A pen going up and down."""
    t = np.linspace(0, waves, 40 * waves + 1)
    return Stroke(t, np.column_stack([x + 3 * t, y + height / 2 * np.cos(2 * np.pi * t)]))


def held(stroke):
    """The stroke by a pen whose tilt and turns follow its place on the page."""
    x, y = stroke.xy.T
    return replace(stroke, tilt=0.3 + 0.004 * x, azimuth=3.0 + 0.01 * x, rotation=0.02 * y)


@pytest.fixture(scope="module")
def told():
    """A page of a drawn hand, as a recording whose letters are known."""
    hand, rng = load("house-joined"), np.random.default_rng(1)
    (sheet,) = compose(TEXT, hand, Layout(Page(110, 45), (8, 8, 8, 8)), rng, pages=1)
    drawing = trace(sheet, hand, rng)
    return RecordedPage(
        "pen",
        replace(drawing, strokes=tuple(map(held, drawing.strokes))),
        TEXT,
        letters_of_samples(sheet, hand),
        2,
        2.5,
    )


@pytest.fixture(scope="module")
def read(told):
    (page,) = recorded_pages([told], quiet)
    (made,) = tagged_pages([page_source(page)], 0, None, quiet)
    return made, hand_of_pages("pen", [made])


def test_every_letter_is_found_where_its_samples_are(told, read):
    made, hand = read
    assert "".join(glyph.letter for glyph in hand.glyphs) == TEXT.replace(" ", "").replace("\n", "")
    assert not made.missing and {glyph.line for glyph in hand.glyphs} == {0, 1}
    assert [len(graphemes(TEXT)[glyph.at]) for glyph in hand.glyphs] == [1] * len(hand.glyphs)
    for glyph in hand.glyphs[:5]:
        own = np.concatenate(
            [stroke.xy[of == glyph.at] for stroke, of in zip(told.drawing.strokes, told.letters, strict=True)]
        )
        there = made.page.graph.xy[glyph.vertices]
        assert np.ptp(there, axis=0) == pytest.approx(np.ptp(own, axis=0), abs=0.3)


def test_the_line_is_the_way_of_the_pen(told, read):
    page = read[1].pages[0]
    assert page.moments is not None and (np.diff(page.moments.times) > 0).all()
    assert page.graph.degree.max() <= 2  # nothing meets where strokes cross
    assert len(np.unique(page.graph.components)) == len(told.drawing.strokes)
    assert page.graph.lengths.sum() == pytest.approx(told.drawing.pen_down, rel=0.01)


@pytest.mark.slow
def test_the_file_keeps_when_the_pen_was_where(read, tmp_path):
    hand = read[1]
    file.save(hand, tmp_path / "pen.hand")
    (page,), (kept,) = hand.pages, file.load(tmp_path / "pen.hand").pages
    assert kept.moments.times == pytest.approx(page.moments.times, abs=1e-5)
    assert kept.moments.pressure == pytest.approx(page.moments.pressure, abs=1e-3)
    for name in ("tilt", "azimuth", "rotation"):
        assert getattr(kept.moments, name) == pytest.approx(getattr(page.moments, name), abs=1e-4)
        assert np.ptp(getattr(kept.moments, name)) > 0.1
    timeless = replace(page, moments=Moments())
    file.save(replace(hand, pages=(timeless,)), tmp_path / "order.hand")
    (kept,) = file.load(tmp_path / "order.hand").pages
    assert kept.moments is not None and kept.moments.times is None and kept.moments.pressure is None


def test_what_is_written_in_it_is_traced_as_the_pen_went(told, read):
    hand = read[1]
    rng = np.random.default_rng(2)
    sheet = compose("till", hand, Layout(Page(60, 30), (8, 8, 8, 8)), rng)[0]
    found = pen_paths(sheet.lines[0].placed, hand)
    # the recorded hand joins all four and goes back for dot and bar
    assert [path.delayed for path in found] == [False, True, True]
    assert found[0].xy[-1, 0] > found[0].xy[0, 0] + 1.5 * 2.5  # narrow letters, written 2.5 mm high
    drawing = trace(sheet, hand, rng)
    pace = [np.median(np.concatenate([s.speed for s in d.strokes if s.length > 2])) for d in (drawing, told.drawing)]
    assert pace[0] == pytest.approx(pace[1], rel=0.35)
    assert all(set(stroke.pose) == {"pressure", "tilt", "azimuth", "rotation"} for stroke in drawing.strokes)
    assert all((stroke.tilt > 0.3).all() and (stroke.tilt < 0.75).all() for stroke in drawing.strokes)
    assert all((stroke.azimuth > 3.0).all() and (stroke.azimuth < 4.2).all() for stroke in drawing.strokes)


UNIPEN = """\
.COORD X Y T
.X_POINTS_PER_MM 10
.Y_POINTS_PER_MM 10
.POINTS_PER_SECOND 100
{labels}
"""


def unipen(strokes, labels):
    """A UNIPEN file of strokes in mm, y down, with lines of labels."""
    head, clock = UNIPEN.format(labels="\n".join(f".SEGMENT {label}" for label in labels)), 0
    for stroke in strokes:
        rows = [f"{round(10 * x)} {round(-10 * y)} {clock + 10 * n}" for n, (x, y) in enumerate(stroke.xy)]
        head += ".PEN_DOWN\n" + "\n".join(rows) + "\n"
        clock += 10 * len(rows) + 200
    return from_unipen(head.encode())


def test_texts_that_were_written_over_one_another_get_lines_of_their_own():
    speck = Stroke([0.0], [[0.0, 0.0]])
    strokes = [wave(12), wave(9, y=21.0), speck, wave(4, x=70.0, y=24.0)]
    drawing = unipen(strokes, ['TEXT 0 OK "one"', 'TEXT 1 OK "two"', 'TEXT 2 OK "gone"', 'TEXT 3 OK "three  "'])
    pieces = labelled_pieces("a.dat", drawing)
    assert [piece.label for piece in pieces] == ["one", "two", "three"]
    (page,) = laid_out("a.dat", pieces, 2.5, 250.0, 40.0, 26.0)
    assert page.text == "one\ntwo\nthree" and page.lines == 3 and page.letters == ()
    low = [stroke.xy[:, 1].max() for stroke in page.drawing.strokes]
    assert np.diff(low) == pytest.approx(low[1] - low[0], abs=0.11) and low[1] - low[0] > 8
    (page,) = laid_out("a.dat", pieces, 2.5, 250.0, 100.0, 26.0)
    assert page.text == "one two three" and page.lines == 1


def test_letters_stand_as_high_as_letters_do():
    strokes = [wave(1, y=40.0)] * 8 + [wave(1, height=5.0, y=70.0)] * 2
    drawing = unipen(strokes, [f'CHARACTER {i} OK "{"nnnnnnnngg"[i]}"' for i in range(10)])
    pieces = labelled_pieces("a.dat", drawing)
    assert pieces_x_height(pieces) == pytest.approx(2.5, rel=0.2)
    (page,) = laid_out("a.dat", pieces, 2.5, 250.0, 300.0, 26.0)
    low = [stroke.xy[:, 1].max() for stroke in page.drawing.strokes]
    assert low[-1] - low[0] > 1.5  # a g hangs below the line
    assert [set(of.tolist()) for of in page.letters] == [{2 * i} for i in range(10)]


def test_labels_of_letters_count_where_they_spell_the_word():
    both = ['WORD 0-2 OK "in"', 'CHARACTER 0,2 OK "i"', 'CHARACTER 1 OK "n"']
    (piece,) = labelled_pieces("a.dat", unipen([wave(3)] * 3, both))
    assert piece.letters == (0, 1, 0)
    (piece,) = labelled_pieces("a.dat", unipen([wave(3)] * 3, [*both[:2], 'CHARACTER 1 OK "m"']))
    assert piece.letters == ()


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-50, 50), min_size=2, max_size=40))
def test_turns_are_the_extremes(y):
    if np.ptp(y) == 0:
        return
    stroke = Stroke(np.arange(len(y)), np.column_stack([np.arange(len(y)), y]))
    for found in turns([stroke]):
        # what lies before the first turn is not looked at closely
        assert np.ptp(found) > 0.91 * np.ptp(y) and set(found.tolist()) <= set(y)
        assert (np.abs(np.diff(found)) > 0.079 * np.ptp(y)).all()
        ways = np.sign(np.diff(found))  # the product of two of the smallest numbers is 0
        assert (ways[1:] == -ways[:-1]).all()


def test_the_size_of_writing_is_that_of_its_ups_and_downs():
    assert x_height_of_strokes([wave(12)]) == pytest.approx(2.5, rel=0.01)
    assert x_height_of_strokes([wave(2)]) == 0


def test_writing_of_no_persons_size_is_made_usual_and_that_is_said():
    said = []
    tiny = Drawing((wave(12, height=0.3),), Page(100, 100))
    (page,) = recorded_pages([RecordedPage("s.svc", tiny, "m")], said.append)
    assert page.x_height == pytest.approx(2.6) and x_height_of_strokes(page.drawing.strokes) == pytest.approx(
        2.6, rel=0.01
    )
    assert len(said) == 1 and "0.3 mm" in said[0]
    timeless = replace(tiny, strokes=(wave(12),), timed=False)
    (page,) = recorded_pages([RecordedPage("s.svg", timeless, "m")], said.append)
    assert "does not say when" in said[1] and not page.drawing.timed


@pytest.mark.parametrize(
    ("strokes", "text", "says"),
    [
        ((), "a", "never moves"),
        ((Stroke([0.0], [[1.0, 1.0]]),), "a", "never moves"),
        ((wave(2),), "a", "too little writing"),
        ((wave(12),), "", "--text"),
        ((wave(12), wave(12, x=900.0)), "a", "a page has at most 600"),
    ],
)
def test_what_cannot_be_used_is_said(strokes, text, says):
    with pytest.raises(InputError, match=says) as caught:
        recorded_pages([RecordedPage("p.inkml", Drawing(strokes, Page(100, 100)), text)], quiet)
    assert str(caught.value).endswith(".") and "\n" not in str(caught.value)


def test_a_resting_pen_and_a_dot_are_followed():
    rest = Stroke([0, 1, 2, 3], [[20, 20], [25, 20], [25, 20], [25, 26]], pressure=[0.1, 0.2, 0.8, 0.3])
    page = RecordedPage(
        "p", Drawing((wave(12), rest, Stroke([50.0], [[60.0, 20.0]])), Page(100, 60)), "m", x_height=2.5
    )
    _, way, dot = page_source(page).movements
    steps = np.hypot(*np.diff(way.xy, axis=0).T)
    assert steps.mean() == pytest.approx(25.4 / 300, rel=0.02) and steps.max() < 1.3 * 25.4 / 300
    assert (way.t[0], way.t[-1]) == (0, 3) and (np.diff(way.t) > 0).all()
    assert len(dot.t) == 1 and dot.t[0] == 50
