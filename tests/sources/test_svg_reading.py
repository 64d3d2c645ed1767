"""SVG files as drawings: every shape where it belongs, bad files refused in a sentence, own files with their times."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import pathdata
from handout.errors import InputError
from handout.sinks.svg import to_svg
from handout.sources import read_drawing
from handout.sources.svg import document, from_svg
from handout.sources.svg.styles import hexadecimal
from handout.values import Drawing, Page, Stroke

PX = 25.4 / 96


def svg(body, head='width="100mm" height="50mm" viewBox="0 0 100 50"', style='fill="none" stroke="black"'):
    names = 'xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
    return from_svg(
        f'<svg {names} xmlns:xlink="http://www.w3.org/1999/xlink" {head}><g {style}>{body}</g></svg>'.encode()
    )


def loops(words):
    """Words that move as a hand does, a dot at the end."""
    t = np.arange(0, 1, 0.005)
    path = np.column_stack([8 * t - 1.5 * np.sin(20 * t), 1.5 * np.cos(20 * t)])
    pairs = [(3.0 * i, (10 + 12 * i, 20)) for i in range(words)]
    strokes = [Stroke(t + clock, path + place, word=i) for i, (clock, place) in enumerate(pairs)]
    strokes.append(Stroke([90.0, 90.05], [[5, 5], [5, 5]], layer="dots", colour="#c01020"))
    return Drawing(tuple(strokes), Page(105, 148, "A6"), {"seed": 4, "title": "loops"})


def only(drawing):
    """The corners of its only stroke: its points, without those that lie on a straight way."""
    (stroke,) = drawing.strokes
    if len(stroke.xy) < 3:
        return stroke.xy
    way = np.diff(stroke.xy, axis=0)
    turn = way[:-1, 0] * way[1:, 1] - way[:-1, 1] * way[1:, 0]
    back = (way[:-1] * way[1:]).sum(axis=1) < 0
    return stroke.xy[np.concatenate([[True], (np.abs(turn) > 1e-9) | back, [True]])]


def test_a_picture_of_it_keeps_corners_and_straight_lines():
    from handout.inking import curves

    drawing = svg(
        '<polygon points="10,20 20,3 40,3 50,20 40,37 20,37"/><rect x="5" y="1" width="90" height="48" rx="3"/>'
    )
    for curve, stroke in zip(curves.fit(drawing.strokes), drawing.strokes, strict=True):
        drawn = curve.places_at(np.linspace(stroke.t[0], stroke.t[-1], 4000))
        start, way = stroke.xy[:-1], np.diff(stroke.xy, axis=0)
        share = np.clip(((drawn[:, None] - start) * way).sum(axis=2) / (way**2).sum(axis=1), 0, 1)
        off = drawn[:, None] - start - share[..., None] * way
        assert np.hypot(off[..., 0], off[..., 1]).min(axis=1).max() < 0.08


def test_shapes_lie_where_they_should():
    line = only(svg('<line x1="1" y1="2" x2="30" y2="4"/>'))
    assert line == pytest.approx(np.array([[1, 2], [30, 4]]))
    square = only(svg('<polygon points="1,1 5,1 5,5"/>'))
    assert square == pytest.approx(np.array([[1, 1], [5, 1], [5, 5], [1, 1]]))
    circle = only(svg('<circle cx="20" cy="20" r="10"/>'))
    assert np.hypot(*(circle - 20).T) == pytest.approx(10, abs=0.02)
    rounded = only(svg('<rect x="10" y="10" width="30" height="20" rx="5"/>'))
    assert rounded.min(axis=0) == pytest.approx([10, 10]) and rounded.max(axis=0) == pytest.approx([40, 30])
    assert np.hypot(*(rounded - [10, 10]).T).min() == pytest.approx(5 * (2**0.5 - 1), abs=0.03)
    ellipse = only(svg('<ellipse rx="8" ry="3" transform="translate(20 20) rotate(90)"/>'))
    assert np.ptp(ellipse, axis=0) == pytest.approx([6, 16], abs=0.05)


@pytest.mark.parametrize(
    ("data", "end", "length"),
    [
        ("M1 1h4v3z", (1, 1), 12),
        ("m1 1 2 0 0 2", (3, 3), 4),
        ("M10 10a5 5 0 0 1 10 0", (20, 10), 5 * np.pi),
        ("M10 10a5 5 0 1110 0", (20, 10), 5 * np.pi),
        ("M0 10A10 10 0 1 0 10 0", (10, 0), 15 * np.pi),
        ("M0 0Q5 0 5 5T10 10", (10, 10), None),
        ("M0 0C0 5 5 5 5 0S10-5 10 0", (10, 0), None),
        ("M0 0c0 0 0 0 3 4", (3, 4), 5),
        ("M.5.5-1e0.5", (-1, 0.5), 1.5),
    ],
)
def test_path_data(data, end, length):
    (stroke,) = svg(f'<path d="{data}"/>').strokes
    assert stroke.xy[-1] == pytest.approx(end, abs=1e-9)
    if length:
        assert stroke.length == pytest.approx(length, rel=2e-3)


@settings(deadline=None, max_examples=40)
@given(st.lists(st.floats(0, 50), min_size=8, max_size=8))
def test_curves_stay_within_the_tolerance(numbers):
    a, b, c, d = np.array(numbers).reshape(4, 2)
    xy = only(svg(f'<path d="M{a[0]} {a[1]}C{b[0]} {b[1]} {c[0]} {c[1]} {d[0]} {d[1]}"/>'))
    u = np.linspace(0, 1, 300)[:, None]
    curve = (1 - u) ** 3 * a + 3 * (1 - u) ** 2 * u * b + 3 * (1 - u) * u**2 * c + u**3 * d
    if len(xy) < 2:
        return
    way, start = np.diff(xy, axis=0), xy[:-1]
    share = ((curve[:, None] - start) * way).sum(axis=2) / np.maximum((way**2).sum(axis=1), 1e-12)
    off = curve[:, None] - start - np.clip(share, 0, 1)[..., None] * way
    assert np.hypot(off[..., 0], off[..., 1]).min(axis=1).max() < 0.021


def test_units_and_viewports():
    assert svg('<path d="M0 0h1"/>', 'width="4in" height="72pt"').page.width == pytest.approx(101.6)
    assert only(svg('<path d="M0 0h1"/>', 'width="200" height="100"'))[-1, 0] == pytest.approx(PX)
    assert only(svg('<path d="M0 0h1in"/>'.replace("1in", "1"), 'viewBox="0 0 96 96"'))[-1, 0] == pytest.approx(PX)
    # a square box in the middle of an oblong page
    middle = only(svg('<path d="M0 0h10"/>', 'width="100mm" height="50mm" viewBox="0 0 10 10"'))
    assert middle == pytest.approx(np.array([[25, 0], [75, 0]]))
    inner = svg('<svg x="10" y="5" width="20" height="10" viewBox="0 0 2 1"><path d="M1 0v1"/></svg>')
    assert only(inner) == pytest.approx(np.array([[20, 5], [20, 15]]))


def test_use_and_symbols():
    drawing = svg(
        '<defs><path id="p" d="M0 0h2"/><symbol id="s" viewBox="0 0 1 1"><path d="M0 0l1 1"/></symbol></defs>'
        '<use href="#p" x="5" y="5"/><use xlink:href="#p" transform="rotate(90)"/>'
        '<use href="#s" x="10" y="10"/>'
    )
    assert len(drawing.strokes) == 3
    assert drawing.strokes[0].xy[[0, -1]] == pytest.approx(np.array([[5, 5], [7, 5]]))
    assert drawing.strokes[1].xy[-1] == pytest.approx([0, 2])


def test_layers_colours_and_what_is_hidden():
    drawing = svg(
        "<style>/* } */ .b { stroke: #00f } @media print { path { stroke: none } } g .x{stroke:none}</style>"
        '<g inkscape:groupmode="layer" inkscape:label="frame"><path d="M0 0h1" style="stroke:rgb(255,0,0)"/></g>'
        '<path class="b x" d="M0 1h1"/><path display="none" d="M0 2h1"/><path style="visibility:hidden" d="M0 3h1"/>'
        '<path stroke-width="0" d="M0 4h1"/><g opacity="0"><path d="M0 5h1"/></g><path stroke="url(#g)" d="M0 6h1"/>'
    )
    assert [(s.layer, s.colour) for s in drawing.strokes] == [("frame", "#ff0000"), ("", "#0000ff"), ("", "")]
    assert not drawing.timed
    assert hexadecimal("tomato") == "#ff6347" and hexadecimal("none of these") == ""


def test_what_is_left_out_is_named():
    drawing = svg(
        '<text>hello</text><image href="x.png"/><path d="M0 0h1v1z" fill="red" stroke="none"/>'
        '<path d="M0 0h1" stroke-dasharray="2 1" clip-path="url(#c)"/>'
    )
    said = " ".join(drawing.about["left_out"])
    assert all(word in said for word in ("1 x text", "1 x picture", "1 x filled outline", "dashes", "clip"))


def test_a_dot_is_a_stroke_of_one_sample():
    assert len(svg('<path d="M3 3z"/>').strokes[0].t) == 1


BAD = {
    "not SVG": (b"<html/>", "root element is <html>"),
    "no XML": (b"%PDF-1.4", "not SVG"),
    "nothing": (b"<svg/>", "no line to draw"),
    "outlines": (b"<svg><path d='M0 0h9v9z'/></svg>", "1 filled outline without a stroke"),
    "words": (b"<svg><text>hi</text></svg>", "only 1 x text"),
    "nan": (b"<svg><path id='p' stroke='red' d='M0 0Lnan 3'/></svg>", "id='p'"),
    "no number": (b"<svg><circle stroke='red' r='wide'/></svg>", "<circle>: r"),
    "not finite": (b"<svg><path stroke='red' d='M0 0h1e300' transform='scale(1e200)'/></svg>", "infinitely far"),
    "far away": (b"<svg><path stroke='red' d='M0 0h1e30'/></svg>", "no page is larger"),
    "broken transform": (b"<svg><path stroke='red' transform='rotate(a)' d='M0 0h1'/></svg>", "transform"),
    "loop": (b"<svg><g id='a'><use href='#a'/></g></svg>", "without end"),
    "deep": (b"<svg>" + b"<g>" * 5000, "nested more than 64"),
    "entities": (b"<!DOCTYPE svg [<!ENTITY a 'b'>]><svg/>", "entities"),
    "huge page": (b"<svg width='900in' height='9'><path stroke='red' d='M0 0h1'/></svg>", "A page of"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_in_a_sentence(name):
    data, word = BAD[name]
    with pytest.raises(InputError) as refused:
        from_svg(data)
    assert word in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.slow
def test_a_bomb_of_uses_and_too_many_points_are_noticed_before_they_take_room(monkeypatch):
    levels = "".join(f'<g id="a{i}">' + f'<use href="#a{i + 1}"/>' * 10 + "</g>" for i in range(9))
    bomb = f'<svg>{levels}<path id="a9" d="M0 0h1" stroke="red"/></svg>'.encode()
    # as they are it takes seconds
    monkeypatch.setattr(document, "_MOST_USED", 2000)
    monkeypatch.setattr("handout.sources.svg._MOST_POINTS", 10_000)
    monkeypatch.setattr(pathdata, "_MOST", 10_000)
    with pytest.raises(InputError, match="2000 elements are drawn by <use>"):
        from_svg(bomb)
    many = b'<svg><polyline stroke="red" points="' + b"1 2," * 10_002 + b'"/></svg>'
    with pytest.raises(InputError, match="more than 10000 points"):
        from_svg(many)
    with pytest.raises(InputError, match="more than 10000 commands"):
        from_svg(b'<svg><path stroke="red" d="M0 0' + b"h1" * 10_001 + b'"/></svg>')


def test_a_document_type_that_declares_nothing_is_fine():
    head = b'<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">'
    assert len(from_svg(head + b'<svg><path stroke="red" d="M0 0h9"/></svg>').strokes) == 1


def test_own_previews_come_back_with_their_times(tmp_path):
    drawing = loops(6)
    (tmp_path / "own.svg").write_bytes(to_svg(drawing))
    back = read_drawing(tmp_path / "own.svg")
    assert back.timed and back.page == drawing.page and back.about == drawing.about
    kept = [[(stroke.word, stroke.layer, stroke.colour) for stroke in d.strokes] for d in (drawing, back)]
    assert kept[0] == kept[1]
    for a, b in zip(drawing.strokes, back.strokes, strict=True):
        places = np.column_stack([np.interp(a.t, b.t, b.xy[:, axis]) for axis in (0, 1)])
        assert np.abs(places - a.xy).max() < 0.1  # at 30 mm/s, times to the millisecond


def test_an_own_preview_that_was_changed_is_a_drawing_without_times():
    data = to_svg(loops(2)).replace(b'data-k="', b'data-k="5 ', 1)
    back = from_svg(data)
    assert not back.timed and len(back.strokes) == len(loops(2).strokes)


def test_readers_by_suffix(tmp_path):
    from handout.sinks.drawing_json import to_json

    (tmp_path / "a.json").write_bytes(to_json(svg('<path d="M0 0h1"/>')))
    assert not read_drawing(tmp_path / "a.json").timed
    with pytest.raises(InputError, match=r"\.inkml, \.json, \.svc, \.svg"):
        read_drawing(tmp_path / "a.dxf")
    with pytest.raises(InputError, match="No such file"):
        read_drawing(tmp_path / "b.svg")
