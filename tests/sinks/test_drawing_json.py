from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from sample_drawings import CARD, drawings, loops, same

from handout.errors import InputError
from handout.sinks.drawing_json import to_json
from handout.sources.drawing_json import from_json
from handout.values import Drawing


@pytest.mark.slow
@settings(max_examples=60)
@given(drawing=drawings)
def test_round_trip_is_exact(drawing: Drawing) -> None:
    assert same(from_json(to_json(drawing)), drawing)


def test_round_trip_of_handwriting() -> None:
    drawing = loops(6, pressure=True)
    assert same(from_json(to_json(drawing)), drawing)
    assert to_json(drawing) == to_json(loops(6, pressure=True))


def test_form() -> None:
    table = json.loads(to_json(loops(1)))
    assert (table["format"], table["version"]) == ("handout-drawing", 1)
    assert table["page"] == {"width": 90.0, "height": 40.0, "name": "card"}
    assert table["about"]["seed"] == 7
    assert sorted(table["strokes"][0]) == ["t", "word", "x", "y"]
    assert len(table["strokes"]) == 3 and len(table["strokes"][1]["x"]) == 1


def test_about_may_hold_numpy_and_odd_text() -> None:
    about = {"seed": np.int64(3), "a": np.array([1.5, 2]), "t": (1, 2), "s": "\ud800x", "p": CARD, "big": 2**100}
    stored = from_json(to_json(Drawing((), CARD, about))).about
    assert stored == {"seed": 3, "a": [1.5, 2], "t": [1, 2], "s": "?x", "p": str(CARD), "big": 2**100}


GOOD = '{"format":"handout-drawing","version":1,"page":{"width":9,"height":9},"about":{},"strokes":[%s]}'


@pytest.mark.parametrize(
    "data, says",
    [
        ("", "not a drawing"),
        ("[1, 2", "not a drawing"),
        ("[" * 100_000, "not a drawing"),
        ("{}", "format"),
        (GOOD.replace('"version":1', '"version":2') % "", "version"),
        (GOOD.replace("9", "-9") % "", "-9"),
        (GOOD % '{"t":[0],"x":[1],"y":[1,2]}', "Stroke 1"),
        (GOOD % '{"t":[1,0],"x":[1,2],"y":[1,2]}', "increase"),
        (GOOD % '{"t":[],"x":[],"y":[]}', "at least one"),
        (GOOD % '{"t":[0],"x":["a"],"y":[1]}', "strokes"),
        (GOOD % '{"t":[0],"x":[1],"y":[1],"presure":[1]}', "presure"),
        (GOOD % '{"t":[0],"x":[1],"y":[1],"pressure":[1,2]}', "Stroke 1"),
        (GOOD % '{"t":[0],"x":[NaN],"y":[1]}', "not a drawing"),
    ],
)
def test_refuses(data: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        from_json(data.encode())


def test_refuses_what_is_not_utf8() -> None:
    with pytest.raises(InputError, match="not a drawing"):
        from_json(b'{"format": "\xff\xfe"}')
