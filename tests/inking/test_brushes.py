"""Brushes: strokes found in photographs, rows of segments that no other beats, cuts, mesh, files, and pens."""

import json
from itertools import product

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.brush import two_pass
from brushes import paper, stroke
from handout.chains import viterbi
from handout.errors import InputError
from handout.inking import pens
from handout.inking.brush import brushes, canvas, painting
from handout.inking.brush.photographs import find_strokes
from handout.inking.brush.ribbon import SEGMENTS, straighten_stroke
from handout.inking.brush.synthesis import WITHIN, SegmentChooser, count_since_same
from handout.inking.curves import fit
from handout.inking.pen import Pen, usual
from handout.values import Drawing, Page, Stroke


def saved(path, picture):
    cv2.imwrite(str(path), picture[..., ::-1])
    return path


@pytest.fixture(scope="module")
def brush():
    """Three strokes: two wet ones, and a dry one."""
    sheet = paper(900, 900)
    for k, dry in enumerate((0.0, 0.2, 0.8)):
        stroke(sheet, (120, 150 + 280 * k), (720, 170 + 280 * k), 120, dry=dry, seed=k)
    found = find_strokes(sheet, "sheet")
    return brushes.Brush(tuple(straighten_stroke(each, 80)[0] for each in found.strokes))


def test_a_page_of_strokes_with_frames_numbers_and_uneven_light():
    sheet = paper(900, 900, uneven=0.35)
    light = sheet.copy()
    stroke(sheet, (150, 200), (650, 260), 110, seed=1)
    stroke(sheet, (150, 600), (650, 640), 100, dry=0.7, seed=2)
    sheet = (sheet / 245.0 * light).clip(0, 255).astype(np.uint8)
    cv2.rectangle(sheet, (20, 20), (860, 430), (60, 60, 60), 3)
    cv2.putText(sheet, "07", (780, 410), cv2.FONT_HERSHEY_SIMPLEX, 1.2, (70, 70, 70), 3)
    photograph = find_strokes(sheet, "page")
    assert len(photograph.strokes) == 2 and photograph.left_out == ()
    for found, length, width in zip(photograph.strokes, (504, 502), (110, 100), strict=True):
        ribbon, spine, half = straighten_stroke(found)
        assert 2 * half == pytest.approx(width, rel=0.12)
        assert np.linalg.norm(np.diff(spine, axis=0), axis=1).sum() == pytest.approx(length, rel=0.15)
        assert len(ribbon) == pytest.approx(SEGMENTS * length / width, rel=0.25)
    dry = straighten_stroke(photograph.strokes[1])[0]
    assert dry.cover[: len(dry) // 3].mean() > dry.cover[-len(dry) // 3 :].mean() + 0.1


def test_a_ribbon_is_the_stroke_again(brush):
    sheet = paper(400, 800)
    stroke(sheet, (100, 200), (700, 200), 120, seed=5)
    ribbon = straighten_stroke(find_strokes(sheet, "one").strokes[0])[0]
    middle = ribbon.premultiplied_ink[len(ribbon.rgba) // 2 - 5 : len(ribbon.rgba) // 2 + 5, 100:-100]
    assert middle[..., 3].min() > 0.99
    assert np.abs(middle[..., :3] * 255 - sheet[200, 300]).max() < 30
    assert np.abs(ribbon.bend).max() < 0.1


def crossing():
    sheet = paper()
    stroke(sheet, (100, 80), (600, 330), 60)
    return stroke(sheet, (100, 330), (600, 80), 60, seed=1)


@pytest.mark.parametrize(
    "sheet, words",
    [
        (paper(), "nothing is clearly darker"),
        (crossing(), "crosses itself or another"),
        (stroke(paper(), (-50, 200), (500, 200), 90), "cut by the edge"),
        (cv2.rectangle(paper(), (60, 60), (640, 340), (40, 40, 40), 3), "only . pixels wide|no stroke"),
        (cv2.rectangle(paper(), (0, 0), (699, 399), (40, 40, 40), 50), "cut by the edge"),
        (cv2.circle(paper(), (350, 200), 90, (40, 40, 40), -1), "as wide as it is long"),
    ],
    ids=["empty", "crossing", "cut", "thin frame", "broad frame", "blot"],
)
def test_what_is_no_stroke_is_refused_with_a_reason(sheet, words):
    with pytest.raises(InputError, match=words):
        find_strokes(np.ascontiguousarray(sheet), "photo.png")


def test_a_cut_stroke_is_left_out_beside_a_whole_one():
    sheet = stroke(paper(700, 700), (120, 200), (520, 220), 90)
    stroke(sheet, (-50, 500), (400, 500), 90, seed=3)
    photograph = find_strokes(sheet, "two.jpg")
    assert len(photograph.strokes) == 1
    assert len(photograph.left_out) == 1 and "cut by the edge" in photograph.left_out[0]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 5), st.integers(2, 4))
def test_no_row_of_segments_is_cheaper(brush, seed, places, kept):
    """Of a few segments every row is tried."""
    rng = np.random.default_rng(seed)
    library = brush.library
    some = rng.choice(len(library.place), kept, replace=False)
    costs = np.full((places, len(library.place)), 1e6)
    costs[:, some] = rng.uniform(0, 10, (places, kept))
    row = np.array(viterbi(list(costs), [library.borders] * (places - 1)))
    best = min(library.energy(np.array(each), costs) for each in product(some, repeat=places))
    assert library.energy(row, costs) == pytest.approx(best, rel=1e-9)
    assert best <= library.energy(two_pass(costs, library.borders), costs) + 1e-6


def test_segments_that_follow_each_other_cost_nothing_between(brush):
    borders, ribbon = brush.library.borders, brush.library.ribbon
    on = np.flatnonzero(np.diff(ribbon) == 0)
    assert (borders[on, on + 1] == 0).all()
    borders = borders.copy()
    borders[on, on + 1] = 1
    assert borders.min() > 0


def test_what_comes_again_costs_no_more_than_it_must(brush):
    library, rng = brush.library, np.random.default_rng(3)
    for _ in range(5):
        costs = rng.uniform(0, 3, (40, len(library.place)))
        exact = library.energy(np.array(viterbi(list(costs), [library.borders] * 39)), costs)
        row = library.row(costs)
        assert exact <= min(library.energy(each, costs) for each in (row, two_pass(costs, library.borders))) + 1e-6
        assert (count_since_same(library.segment_numbers[row]) > WITHIN).all()


def test_a_long_stroke_repeats_nothing_soon(brush):
    chooser = SegmentChooser(brush.library, np.random.default_rng(4))
    rows = [chooser.row(np.zeros(120)) for _ in range(5)]
    again = [count_since_same(brush.library.segment_numbers[row]) <= WITHIN for row in rows]
    assert np.concatenate(again).mean() <= 0.01


def test_strokes_of_one_length_differ(brush):
    chooser = SegmentChooser(brush.library, np.random.default_rng(4))
    first, second = chooser.row(np.zeros(40)), chooser.row(np.zeros(40))
    assert (first != second).mean() > 0.3


def test_a_cut_is_seen_less_than_an_edge(brush):
    rng = np.random.default_rng(2)
    sized = brush.fit_width(120)
    row = rng.permutation(len(brush.library.place))[:30]
    step = sized.columns
    hard, soft = sized.hard(row), sized.quilt_segments(row)
    at = sized.joints(row) * step
    jump = [float(((ink[:, at] - ink[:, at - 1]) ** 2).sum()) for ink in (hard, soft)]
    assert jump[1] < 0.35 * jump[0]


def away_from(points, shape):
    """Distance of every pixel of a sheet from a line."""
    sheet = np.full(shape, 255, dtype=np.uint8)
    cv2.polylines(sheet, [np.rint(points).astype(np.int32)], False, 0)
    return cv2.distanceTransform(sheet, cv2.DIST_L2, 5)


def laid(line, shape):
    sheet = np.zeros((*shape, 4), dtype=np.uint8)
    painting.lay(sheet, np.ones((50, (len(line) - 1) * 5, 4), np.float32), line, np.full(len(line), 20.0))
    return sheet[..., 3]


@pytest.mark.parametrize("turn", [0.0, 0.5, 1.5, 2.5, 3.0])
def test_a_bend_leaves_no_hole(turn):
    """A solid ribbon covers every place within half its width of a line with a corner."""
    corner = np.array([300.0, 200.0])
    out = np.array([np.cos(turn), np.sin(turn)])
    line = painting.spread_places(np.array([[100.0, 200.0], corner, corner + 180 * out]), 76)
    alpha = laid(line, (420, 520))
    assert (alpha[away_from(line[5:-5], alpha.shape) < 18] == 255).mean() > 0.999
    assert not alpha[away_from(line, alpha.shape) > 27].any()


@pytest.mark.parametrize("radius", [12, 25, 60])
def test_loops_leave_no_hole_and_stay_within_their_outline(radius):
    turn = np.linspace(0, 3 * np.pi, 90)
    path = np.stack([200 + radius * np.cos(turn), 200 + radius * np.sin(turn)], axis=1)
    line = painting.spread_places(path, round(3 * np.pi * radius / 5))
    alpha = laid(line, (400, 400))
    assert (alpha[away_from(line[5:-5], alpha.shape) < 18] == 255).mean() > 0.995
    assert not alpha[away_from(line, alpha.shape) > 27].any()


def drawing(*paths):
    strokes = tuple(Stroke(np.linspace(k, k + 0.5, len(path)), np.array(path, float)) for k, path in enumerate(paths))
    return Drawing(strokes, Page(40, 20))


def test_dots_and_short_strokes_are_there(brush, tmp_path):
    path = tmp_path / "own.brush"
    path.write_bytes(brushes.to_bytes(brush))
    page = drawing([[10, 10]], [[20, 10], [20.3, 10]], [[30, 10], [30.0, 10.9]])
    image = pens.image(page, 300, Pen(1.0, brush.colour, str(path)), np.random.default_rng(1))
    dark = 1 - image.mean(axis=2) / 255
    for x in (10, 20, 30):
        area = dark[:, round((x - 2) * 300 / 25.4) : round((x + 2) * 300 / 25.4)].sum() * (25.4 / 300) ** 2
        assert 0.35 < area < 2.2  # mm², of a line 1 mm wide


def test_segments_are_an_eighth_of_the_width_long():
    line = Stroke(np.arange(3.0), np.array([[5, 5], [15, 6], [30, 12.0]]), width=np.full(3, 1.6))
    places, widths = canvas.way(line, fit([line])[0], 0.5)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1) == pytest.approx(1.6 / SEGMENTS, rel=0.02)
    assert widths == pytest.approx(1.6)


def test_another_ink(brush, tmp_path):
    path = tmp_path / "own.brush"
    path.write_bytes(brushes.to_bytes(brush))
    red = pens.image(drawing([[5, 10], [35, 10]]), 200, Pen(2.0, "#c01010", str(path)), np.random.default_rng(1))
    solid = red.reshape(-1, 3)[red.reshape(-1, 3)[:, 1] < 60]
    assert len(solid) > 1000 and np.abs(np.median(solid, axis=0) - [0xC0, 0x10, 0x10]).max() < 25


def test_a_file_is_the_brush_again(brush, tmp_path):
    path = tmp_path / "own.brush"
    path.write_bytes(brushes.to_bytes(brush))
    again = brushes.find(str(path))
    assert all((a.rgba == b.rgba)[a.rgba[..., 3] > 0].all() for a, b in zip(again.ribbons, brush.ribbons, strict=True))
    assert np.abs(again.ribbons[0].bend - brush.ribbons[0].bend).max() < 1e-3
    assert brushes.to_bytes(again) == brushes.to_bytes(brush)
    assert usual(str(path)).model == str(path)


def test_damaged_files_are_refused(brush, tmp_path):
    path = tmp_path / "own.brush"
    data = brushes.to_bytes(brush)
    for bad in (b"", b"PK", data[: len(data) // 2], data.replace(b"brush.json", b"brush.jsox")):
        path.write_bytes(bad)
        with pytest.raises(InputError, match=r"own\.brush"):
            brushes.load(path)
    with pytest.raises(InputError, match="no such brush"):
        brushes.find(str(tmp_path / "none.brush"))


def test_json_of_a_file_is_read_with_care(brush, tmp_path):
    from handout.hand.archive import Archive, pack

    data = brushes.to_bytes(brush)
    (tmp_path / "own.brush").write_bytes(data)
    with Archive(tmp_path / "own.brush") as archive:
        parts = {name: archive.read_part(name) for name in archive.names}
    facts = json.loads(parts["brush.json"])
    for key, value, words in (("format", 9, "format 9"), ("ribbons", [], "0 strokes"), ("width", 0.001, "width")):
        spoilt = pack({**parts, "brush.json": json.dumps({**facts, key: value}).encode()})
        (tmp_path / "bad.brush").write_bytes(spoilt)
        with pytest.raises(InputError, match=words):
            brushes.load(tmp_path / "bad.brush")


def test_a_stroke_has_its_own_colour_and_is_pressed_as_it_was(brush):
    """The harder a stroke is pressed, the wetter it is; a light one leaves more paper."""
    line = np.array([[5.0, 5.0], [35.0, 5.0]])
    red = Stroke(np.arange(2.0), line, width=np.full(2, 4.0), colour="#c02020")
    green = Stroke(np.arange(2.0) + 3, line + np.array([0, 8]), width=np.full(2, 4.0), colour="#208020")
    drawing = Drawing((red, green), Page(40, 20))
    sheet = np.ones((160 * 320, 3), np.float32)
    for at, light in canvas.pass_brush(
        drawing, 8 * 25.4, brush, Pen(4.0, brush.colour, "sumi"), np.random.default_rng(1)
    ):
        sheet[at] = light
    rows = sheet.reshape(160, 320, 3)
    upper, lower = (rows[a:b, 80:240].reshape(-1, 3).mean(axis=0) for a, b in ((24, 56), (88, 120)))
    assert upper[0] > upper[1] + 0.1 and lower[1] > lower[0] + 0.1
    covers = []
    for pressed in (-0.5, 0.4):
        chooser = SegmentChooser(brush.library, np.random.default_rng(4))
        covers.append(np.mean([brush.library.cover[chooser.row(np.zeros(40), pressed)].mean() for _ in range(12)]))
    assert covers[1] > covers[0] + 0.02
