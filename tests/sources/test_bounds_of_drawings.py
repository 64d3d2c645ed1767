"""No number of a drawing's file is without a bound: whatever stands there, it is drawn small enough, or refused."""

import re
import warnings

import numpy as np
import pytest
from test_pens_with_pose import CYN
from test_recorded_pens import ROWS, TAG, UNIPEN, svc

from handout.errors import InputError
from handout.motion.reconstruction import planned_page
from handout.sinks.drawing_json import to_json
from handout.sinks.inkml import to_inkml
from handout.sinks.plans import to_json as plans_to_json
from handout.sinks.svg import to_svg
from handout.sources import plans, read_drawing, recorded
from handout.values import Drawing, Page, Stroke

WILD = ("4e9", "-4000000000", "1e308", "-1e308", "1e999", "inf", "nan", "9" * 5000)
NUMBER = re.compile(r"(?<![\w.#])[-+]?\d+(?:\.\d+)?(?![\w.])")
TIMED = Drawing(
    (
        Stroke([0.0, 0.01, 0.02, 0.03], [[5, 5], [6, 7], [8, 7], [9, 5]], word=0, width=[0.4, 0.5, 0.5, 0.4]),
        Stroke([0.3, 0.31], [[5, 9], [6, 9]], pressure=[0.5, 0.6], tilt=[0.1, 0.2], azimuth=[1, 1], word=1),
        Stroke([0.5, 0.6], [[1, 9], [2, 9]], rotation=[0.5, 0.6], nib=1.5),
    ),
    Page(40, 30),
)
INKML = """<ink><traceFormat><channel name="X" units="mm"/><channel name="Y" units="mm"/><channel name="T" units="ms"/>
<channel name="F" max="10"/></traceFormat><trace>1 2 0 5, 2 3 10 6, 4 4 20 7</trace>
<trace timeOffset="50">5 5 30 1,'1'2'10'0,"1"1"10"0</trace></ink>"""
EVENTS = '[{"type": "pointerdown", "x": 1, "y": 2, "t": 0, "pressure": 0.5}, {"x": 3, "y": 4, "t": 9, "pressure": 0.5}]'
PLAIN = """<svg width="50mm" height="40mm" viewBox="0 0 50 40"><g transform="translate(3 4) rotate(5)">
<path stroke="red" d="M1 2h5a2 3 0 0 1 4 4"/><rect stroke="red" x="1" y="2" width="3" height="4" rx="1"/></g></svg>"""
FILES = {
    "own.json": to_json(TIMED).decode(),
    "own.inkml": to_inkml(TIMED).decode(),
    "own.svg": to_svg(TIMED).decode(),
    "other.inkml": INKML,
    "events.json": EVENTS,
    "plain.svg": PLAIN,
    "tag.gml": TAG.decode(),
    "tablet.svc": svc(ROWS).decode(),
    "words.unp": UNIPEN.decode(),
    "painter.cyn": CYN,
}


def wilder(text):
    """The text with each of its numbers replaced by each wild one."""
    places = [match.span() for match in NUMBER.finditer(text)]
    places = places[:: max(1, len(places) // 40)]
    return [text[:a] + wild + text[b:] for a, b in places for wild in WILD]


@pytest.mark.parametrize("name", FILES)
def test_drawings(tmp_path, name):
    file = tmp_path / name
    file.write_text(FILES[name])
    assert read_drawing(file).strokes
    for text in wilder(FILES[name]):
        file.write_text(text)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                drawing = read_drawing(file)
            except InputError as error:
                assert len(str(error)) < 400
                continue
        far = max(float(np.abs(stroke.xy).max()) for stroke in drawing.strokes)
        longest = max(float(stroke.t[-1] - stroke.t[0]) for stroke in drawing.strokes)
        samples = sum(len(stroke.t) for stroke in drawing.strokes)
        assert max(far, drawing.page.width, drawing.page.height) <= recorded.LARGEST, text
        assert samples <= recorded.MOST and (longest <= 1e5 or not drawing.timed), text


@pytest.mark.parametrize("kind", ["plans", "targets"])
def test_plans(kind):
    targets = """{"targets": [[10, 30], [14, 12], [20, 30]], "covariances": [[[4, 0], [0, 1]], [[4, 0], [0, 1]],
        [[4, 0], [0, 1]]], "pen_up": [1], "references": [{"targets": [[1, 3], [1, 1], [2, 3]],
        "frame": {"origin": [9, 5], "angle": "30deg", "scale": 1.5}}], "page": {"width": 50, "height": 40}}"""
    text = plans_to_json(planned_page.fit(TIMED)).decode() if kind == "plans" else targets
    read = plans.from_json if kind == "plans" else plans.read_targets
    read(text.encode())
    for changed in wilder(text):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                page = read(changed.encode()).page
            except InputError as error:
                assert len(str(error)) < 400
                continue
        assert max(page.width, page.height) <= recorded.LARGEST, changed


def test_what_is_too_large_is_said(tmp_path):
    (tmp_path / "far.inkml").write_text("<ink><trace>1 2, 4000000000 3</trace></ink>")
    with pytest.raises(InputError, match=r"Stroke 1 of this InkML runs to 4e\+09, 3 mm; no page is larger than 10000"):
        read_drawing(tmp_path / "far.inkml")
