from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pikepdf
import pytest
from sample_drawings import CARD, loops

from handout.errors import InputError
from handout.sinks.pdf import to_pdf
from handout.values import Drawing, Page, Stroke


def opened(data: bytes) -> pikepdf.Pdf:
    return pikepdf.open(io.BytesIO(data))


def operators(page: pikepdf.Page) -> list[tuple[str, list[float]]]:
    return [
        (str(instruction.operator), [float(value) for value in instruction.operands])
        for instruction in pikepdf.parse_content_stream(page)
    ]


def test_pages_in_their_true_size() -> None:
    a4 = replace(loops(), page=Page(210, 297, "A4"))
    with opened(to_pdf([loops(), a4])) as pdf:
        sizes = [[float(v) for v in page.mediabox] for page in pdf.pages]
        assert pdf.check_pdf_syntax() == []
    assert np.allclose(sizes, [[0, 0, 90 * 72 / 25.4, 40 * 72 / 25.4], [0, 0, 595.2756, 841.8898]], atol=1e-3)


def test_strokes_and_nothing_else() -> None:
    drawing = loops()
    with opened(to_pdf([drawing])) as pdf:
        page = pdf.pages[0]
        assert "/Font" not in page.Resources and len(page.Resources.keys()) == 0
        found = operators(page)
    names = [name for name, _ in found]
    assert set(names) <= {"cm", "J", "j", "RG", "w", "m", "c", "l", "S"}
    assert names.count("S") == names.count("m") == len(drawing.strokes)
    assert dict(found)["J"] == [1] and dict(found)["j"] == [1]
    begins = [values for name, values in found if name == "m"]
    assert np.allclose(begins, [s.xy[0] for s in drawing.strokes], atol=6e-4)
    assert np.allclose(dict(found)["cm"], [72 / 25.4, 0, 0, -72 / 25.4, 0, 40 * 72 / 25.4], atol=1e-4)


def test_curves_pass_through_their_ends() -> None:
    stroke = loops().strokes[0]
    with opened(to_pdf([Drawing((stroke,), CARD)])) as pdf:
        found = operators(pdf.pages[0])
    ends = np.array([values[4:] for name, values in found if name == "c"])
    assert np.allclose(ends[-1], stroke.xy[-1], atol=6e-4)
    away = np.hypot(*(ends[:, None] - stroke.xy[None]).transpose(2, 0, 1)).min(axis=1)
    assert away.max() < 1e-3


def test_a_changing_width_is_filled() -> None:
    stroke = loops(1).strokes[0]
    varied = replace(stroke, width=np.linspace(0.3, 1.5, len(stroke.t)))
    with opened(to_pdf([Drawing((varied,), CARD)])) as pdf:
        content = pdf.pages[0].Contents.read_bytes()
    assert content.count(b" f\n") > 10 and b" S\n" not in content and b" rg" in content


def test_widths_and_colour() -> None:
    stroke = loops().strokes[0]
    wide = replace(stroke, t=stroke.t + 9, width=np.full(len(stroke.t), 0.9))
    with opened(to_pdf([Drawing((stroke, wide), CARD)], pen_width=0.35, colour="#ff8000")) as pdf:
        found = operators(pdf.pages[0])
    assert [values for name, values in found if name == "w"] == [[0.35], [0.9]]
    assert np.allclose(dict(found)["RG"], [1, 128 / 255, 0], atol=1e-4)


def test_dots_have_some_length() -> None:
    with opened(to_pdf([Drawing((Stroke(np.array([0.0]), np.array([[5.0, 6.0]])),), CARD)])) as pdf:
        found = operators(pdf.pages[0])
    assert ("m", [5.0, 6.0]) in found and ("l", [5.001, 6.0]) in found


def test_same_bytes_and_no_date() -> None:
    data = to_pdf([loops(), loops(2)])
    assert data == to_pdf([loops(), loops(2)])
    assert data != to_pdf([loops(2), loops()])
    assert b"Date" not in data


@pytest.mark.parametrize("text", ["Grüße, 你好 🙂", "\x00()<>\\ %", "\ud800", ""])
def test_metadata(text: str) -> None:
    drawing = replace(loops(), about={"seed": 7, "hand": "house-joined", "title": text})
    with opened(to_pdf([drawing])) as pdf:
        info = {key: str(value) for key, value in pdf.docinfo.items()}
    assert info["/Keywords"] == '{"seed":7,"hand":"house-joined"}'
    assert "seed 7" in info["/Subject"] and info["/Creator"].startswith("handout")
    expected = text.replace("\x00", "�").replace("\ud800", "�") or "Handwriting"
    assert info["/Title"] == expected


def test_empty_page_and_no_page() -> None:
    with opened(to_pdf([Drawing((), CARD)])) as pdf:
        assert len(pdf.pages) == 1
    with pytest.raises(InputError, match="no page"):
        to_pdf([])
