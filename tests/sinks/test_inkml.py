from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from sample_drawings import CARD, drawings, loops, same

from handout.errors import InputError
from handout.sinks.inkml import to_inkml
from handout.sources.inkml import from_inkml
from handout.values import Drawing, Stroke

PAGE = '<traceGroup><annotation type="page">{}</annotation><trace>1 2, 3 4</trace></traceGroup>'
INK = "{http://www.w3.org/2003/InkML}"


def ink(body: str) -> bytes:
    return f'<ink xmlns="http://www.w3.org/2003/InkML">{body}</ink>'.encode()


@pytest.mark.slow
@settings(max_examples=60)
@given(drawing=drawings)
def test_round_trip(drawing: Drawing) -> None:
    once = from_inkml(to_inkml(drawing))
    assert same(once, drawing, tolerance=1e-6)
    assert same(from_inkml(to_inkml(once)), once, tolerance=1e-9)


def test_round_trip_of_handwriting() -> None:
    drawing = loops(6, pressure=True)
    assert same(from_inkml(to_inkml(drawing)), drawing, tolerance=5.1e-7)
    assert to_inkml(drawing) == to_inkml(loops(6, pressure=True))


def test_a_damaged_sample_is_noticed() -> None:
    drawing = loops()
    xy = drawing.strokes[0].xy + np.array([0.0, 2e-6])
    moved = replace(drawing, strokes=(replace(drawing.strokes[0], xy=xy), *drawing.strokes[1:]))
    assert not same(from_inkml(to_inkml(moved)), drawing, tolerance=1e-6)


def test_times_closer_than_the_last_decimal_still_increase() -> None:
    stroke = Stroke(np.array([1.0, 1.0 + 1e-9, 1.0 + 3e-9]), np.zeros((3, 2)))
    assert same(from_inkml(to_inkml(Drawing((stroke,), CARD))), Drawing((stroke,), CARD))


def test_channels_only_as_present() -> None:
    root = ElementTree.fromstring(to_inkml(loops(2, pressure=True)))
    formats = [[c.get("name") for c in form] for form in root.iter(f"{INK}traceFormat")]
    assert formats == [["X", "Y", "T", "F"], ["X", "Y", "T"]]
    words = [a.text for a in root.iter(f"{INK}annotation") if a.get("type") == "word"]
    assert words == ["0", "0", "1", "1"]


def test_damaged_annotations() -> None:
    data = to_inkml(loops()).replace(b'"width":90', b'"width":-9')
    with pytest.raises(InputError, match="annotations"):
        from_inkml(data)


def test_of_others_x_and_y_alone() -> None:
    drawing = from_inkml(b"<ink><trace>10 0, 9 14, 8 28</trace><trace>20 5, 21 6</trace></ink>")
    assert drawing.strokes[0].xy.tolist() == [[10, 0], [9, 14], [8, 28]]
    assert np.allclose(np.diff(drawing.strokes[0].t), 0.01)
    assert drawing.strokes[1].t[0] > drawing.strokes[0].t[-1]
    assert drawing.about["timing"].startswith("assumed")
    assert drawing.page.width >= 21 and drawing.page.height >= 28
    assert drawing.strokes[0].pressure is None and drawing.strokes[0].word == -1


def test_of_others_channels_in_another_order_and_other_units() -> None:
    body = """<definitions><context xml:id="c1"><inkSource xml:id="s1"><traceFormat>
      <channel name="T" type="integer" units="ms"/><channel name="F" type="integer" max="1024"/>
      <channel name="Y" type="decimal" units="cm"/><channel name="X" type="decimal" units="in"/>
      <channel name="OTx" units="deg"/><channel name="OTy" units="deg"/>
    </traceFormat></inkSource></context></definitions>
    <trace contextRef="#c1">5000 512 1 2 0 30, 5010 1024 1.5 3 45 0</trace>"""
    stroke = from_inkml(ink(body)).strokes[0]
    assert np.allclose(stroke.xy, [[50.8, 10], [76.2, 15]])
    assert np.allclose(stroke.t, [0, 0.01])
    assert stroke.pressure is not None and np.allclose(stroke.pressure, [0.5, 1])
    assert stroke.tilt is not None and np.allclose(stroke.tilt, [np.pi / 6, np.pi / 4])
    assert stroke.azimuth is not None and np.allclose(stroke.azimuth, [np.pi / 2, 0])


def test_of_others_resolution_counts_before_unit() -> None:
    body = """<definitions><inkSource xml:id="s"><traceFormat><channel name="X" units="cm"/><channel name="Y"/>
      </traceFormat><channelProperties><channelProperty channel="X" name="resolution" value="100" units="1/cm"/>
      <channelProperty channel="Y" name="resolution" value="1000" units="1/in"/></channelProperties></inkSource>
      <context xml:id="c" inkSourceRef="#s"/></definitions><trace contextRef="#c">250 2000</trace>"""
    assert np.allclose(from_inkml(ink(body)).strokes[0].xy, [[25, 50.8]])


def test_of_others_unit_is_for_bare_numbers() -> None:
    assert from_inkml(ink("<trace>100 200</trace>"), unit=0.01).strokes[0].xy.tolist() == [[1, 2]]
    form = '<traceFormat><channel name="X" units="mm"/><channel name="Y"/></traceFormat>'
    assert from_inkml(ink(form + "<trace>3 200</trace>"), unit=0.01).strokes[0].xy.tolist() == [[3, 2]]


def test_of_others_differences() -> None:
    # first values, then velocities, then accelerations, and again values; without spaces where none is needed
    text = """1125 18432,'23'43,"7"-8,3-5,7 -3,!1300 !18500,*18600"""
    xy = from_inkml(ink(f"<trace>{text}</trace>"), unit=0.01).strokes[0].xy * 100
    expected = [(1125, 18432), (1148, 18475), (1178, 18510), (1211, 18540), (1251, 18567), (1300, 18500), (1300, 18600)]
    assert np.allclose(xy, expected)


def test_of_others_lifted_pen_is_left_out_and_groups_nest() -> None:
    body = """<traceFormat><channel name="Y"/><channel name="X"/></traceFormat>
      <traceGroup><annotation type="word">4</annotation><traceGroup><trace>1 2</trace></traceGroup>
      <trace type="penUp">5 6, 7 8</trace></traceGroup><trace>3 4</trace><trace> </trace>"""
    drawing = from_inkml(ink(body))
    assert [(s.xy.tolist(), s.word) for s in drawing.strokes] == [([[2, 1]], 4), ([[4, 3]], -1)]


def test_of_others_a_clock_that_stands_still_or_starts_anew() -> None:
    form = '<traceFormat><channel name="X"/><channel name="Y"/><channel name="T" units="s"/></traceFormat>'
    body = form + "<trace>0 0 9, 1 1 9.5, 2 2 9.5, 3 3 10</trace><trace>5 5 0, 6 6 1</trace>"
    first, second = from_inkml(ink(body)).strokes
    assert first.t.tolist() == [0, 0.5, 1] and first.xy[:, 0].tolist() == [0, 1, 3]
    assert second.t[0] > 1 and np.allclose(np.diff(second.t), 1)
    still = from_inkml(ink(form + "<trace>0 0 9, 1 1 9, 2 2 9, 3 3 9</trace>"))
    assert len(still.strokes[0].t) == 4 and "timing" in still.about


def test_of_others_writing_left_of_the_page_is_moved_onto_it() -> None:
    drawing = from_inkml(ink("<trace>-30 10, 20 -40</trace>"))
    assert drawing.bounds is not None
    assert min(drawing.bounds) >= 0
    assert drawing.bounds[2] <= drawing.page.width and drawing.bounds[3] <= drawing.page.height
    assert np.allclose(np.diff(drawing.strokes[0].xy, axis=0), [[50, -50]])


@pytest.mark.parametrize(
    "data, says",
    [
        (b"", "not InkML"),
        (b"<ink><trace>1 2</ink>", "not InkML"),
        (b"<svg/>", "<svg>"),
        (b"<ink/>", "no movement of a pen"),
        (ink("<trace type='penUp'>1 2, 3 4</trace>"), "no movement of a pen"),
        (ink(PAGE.format(1) + PAGE.format(2)), "2 pages"),
        (ink("<trace>1 2, 3</trace>"), "Trace 1, sample 2"),
        (ink("<trace>1 2</trace><trace>1 zwei</trace>"), "Trace 2, sample 1"),
        (ink("<trace>1 nan</trace>"), "finite"),
        (ink("<trace>1 1e999</trace>"), "finite"),
        (ink("<trace>1 ?</trace>"), "unknown"),
        (ink('<traceFormat><channel name="X"/><channel name="F"/></traceFormat><trace>1 2</trace>'), "X and Y"),
    ],
)
def test_refuses(data: bytes, says: str) -> None:
    with pytest.raises(InputError) as caught:
        from_inkml(data)
    message = str(caught.value)
    assert says in message and "\n" not in message and message.endswith(".")


def test_circular_references_end() -> None:
    body = """<definitions><context xml:id="a" contextRef="#b"/><context xml:id="b" contextRef="#a"/></definitions>
      <trace contextRef="#a">1 2</trace>"""
    assert from_inkml(ink(body)).strokes[0].xy.tolist() == [[1, 2]]
