from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sample_drawings import CARD, loops

from handout.sinks.dxf import outlines_dxf, to_dxf
from handout.sinks.layers import layers
from handout.values import Array, Drawing, Stroke

_TOLD = {"words": ["Dear", "Größe,", "café"], "lines": [0, 2]}


def read(data: bytes) -> Any:
    """What a reader of DXF makes of a file, in which it must find nothing to mend."""
    import ezdxf  # not above: it takes .3 s of CPU, in every process of xdist

    document = ezdxf.read(io.StringIO(data.decode("ascii").replace("\r\n", "\n")))
    audit = document.audit()
    assert [entry.message for entry in (*audit.errors, *audit.fixes)] == []
    return document


def points(line: Any) -> Array:
    return np.array([place[:2] for place in line.get_points()])


def names(document: Any) -> list[str]:
    from ezdxf.lldxf.encoding import decode_dxf_unicode

    return [decode_dxf_unicode(layer.dxf.name) for layer in document.layers if layer.dxf.name not in ("0", "Defpoints")]


def test_a_reader_finds_every_stroke_in_mm_y_up() -> None:
    drawing = loops()
    document = read(to_dxf(drawing))
    lines = list(document.modelspace())
    assert document.dxfversion == "AC1015" and document.header["$INSUNITS"] == 4
    assert document.header["$LIMMAX"] == (90, 40) and {line.dxftype() for line in lines} == {"LWPOLYLINE"}
    assert len(lines) == len(drawing.strokes) and not any(line.closed for line in lines)
    for stroke, line in zip(drawing.strokes, lines, strict=True):
        found = points(line) * [1, -1] + [0, 40]
        chords = np.diff(found, axis=0)
        share = ((stroke.xy[:, None] - found[:-1]) * chords).sum(axis=2) / (chords**2).sum(axis=1)
        off = stroke.xy[:, None] - found[:-1] - np.clip(share, 0, 1)[..., None] * chords
        assert np.hypot(off[..., 0], off[..., 1]).min(axis=1).max() < 0.0101
    assert np.ptp(points(lines[1]), axis=0) == pytest.approx([0.05, 0])  # a dot


def test_layers_by_ink_line_and_word() -> None:
    drawing = replace(loops(), about=_TOLD)
    assert names(read(to_dxf(drawing))) == ["Page 1"]
    assert names(read(to_dxf(drawing, by="word"))) == ["001 Dear", "002 Größe,".replace(",", ""), "003 café"]
    assert list(layers(drawing, "line")) == ["line 1: Dear Größe,", "line 2: café"]
    assert names(read(to_dxf(drawing, by="line"))) == ["line 1 Dear Größe", "line 2 café"]
    assert list(layers(loops(), "word")) == ["001", "002", "003"] and list(layers(loops(), "line")) == ["Page 1"]


def test_colours_are_the_nearest_of_the_palette() -> None:
    shades = ("#fe0101", "#1a1a2e", "#000080", "#2060ff")
    t, xy = np.array([0.0, 1.0]), np.array([[1.0, 1.0], [2.0, 3.0]])
    strokes = tuple(Stroke(t + 2 * i, xy, colour=shade) for i, shade in enumerate(shades))
    document = read(to_dxf(Drawing(strokes, CARD)))
    assert names(document) == list(shades)
    assert [document.layers.get(shade).dxf.color for shade in shades] == [10, 7, 174, 150]
    one_layer = read(to_dxf(Drawing(tuple(replace(s, word=0) for s in strokes), CARD, {"words": ["all"]}), by="word"))
    assert [line.dxf.get("color") for line in one_layer.modelspace()] == [None, 7, 174, 150]


def test_any_names_of_layers_are_names_in_dxf() -> None:
    given = [
        "Ink",
        "ink",
        "a|b",
        "0",
        "\U0001f58b",
        "\ud800\x07",
        "  ",
        "",
        "\u2028{x}\r\n",
        "Zoë",
        "n" * 300,
        "n" * 301,
    ]
    t = np.array([0.0, 1.0])
    strokes = [Stroke(t + 2 * i, np.array([[0.0, 0], [i, 1]]), layer=name) for i, name in enumerate(given)]
    document = read(to_dxf(Drawing(tuple(strokes), CARD)))
    assert len(set(names(document))) == len(given) == len(list(document.modelspace()))
    assert names(document)[:4] == ["Ink", "ink (2)", "a b", "0 (2)"] and "Zoë" in names(document)


def test_outlines_are_closed_and_an_empty_page_is_a_file() -> None:
    square = np.array([[1.0, 1.0], [5.0, 1.0], [5.0, 5.0], [1.0, 5.0], [1.0, 1.0]])
    document = read(outlines_dxf(loops(), [("#ff0000", [square, square + 10])]))
    assert [line.closed for line in document.modelspace()] == [True, True] and names(document) == ["ink #ff0000"]
    assert points(document.modelspace()[0]).tolist() == [[1, 39], [5, 39], [5, 35], [1, 35]]
    assert list(read(to_dxf(Drawing((), CARD))).modelspace()) == []
