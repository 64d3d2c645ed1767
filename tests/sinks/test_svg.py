from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_drawings import CARD, drawings, loops, word

from handout.errors import InputError
from handout.sinks.svg import to_svg
from handout.values import Array, Drawing, Stroke

GOLDEN = Path(__file__).parent.parent / "golden" / "loops.svg"
SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
CHROMIUM = shutil.which("chromium")
_NUMBER = re.compile(r"-?\d*\.?\d+")


def numbers(text: str) -> list[float]:
    return [float(n) for n in _NUMBER.findall(text)]


def paths(svg: bytes, kind: str = "stroke") -> list[ElementTree.Element]:
    root = ElementTree.fromstring(svg)
    return [p for p in root.iter(f"{SVG}path") if p.get("class") == kind]


def beziers(path: ElementTree.Element) -> Array:
    """(m, 4, 2) mm: control points of a stroke's path."""
    values = numbers(path.get("d", ""))
    pen, found = np.array(values[:2]), []
    for leg in np.array(values[2:]).reshape(-1, 3, 2):
        found.append(np.vstack([[pen], pen + leg]))
        pen = pen + leg[-1]
    return np.array(found)


def at(path: ElementTree.Element, t: Array) -> Array:
    """(n, 2) mm: where the replay has the pen at the times `t` (s, on the clock of the page)."""
    control = beziers(path)
    knots = float(path.get("data-t0", "")) + np.cumsum([0, *numbers(path.get("data-k", ""))]) / 1000
    i = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(control) - 1)
    u = np.clip((t - knots[i]) / (knots[i + 1] - knots[i]), 0, 1)[:, None]
    a, b, c, d = (control[i, j] for j in range(4))
    return np.asarray((1 - u) ** 3 * a + 3 * (1 - u) ** 2 * u * b + 3 * (1 - u) * u**2 * c + u**3 * d)


def differences(a: bytes, b: bytes, tolerance: float = 0.002) -> list[str]:
    """Where two SVGs differ: elements, attributes, text (but style and script), numbers beyond the tolerance."""
    found = []
    ours, theirs = (list(ElementTree.fromstring(svg).iter()) for svg in (a, b))
    if [e.tag for e in ours] != [e.tag for e in theirs]:
        return ["other elements"]
    for one, other in zip(ours, theirs, strict=True):
        pairs = {key: (one.get(key), other.get(key)) for key in {*one.keys(), *other.keys()}}
        if one.tag not in (f"{SVG}style", f"{SVG}script"):
            pairs["text"] = ((one.text or "").strip(), (other.text or "").strip())
        found += [f"{one.tag} {k}: {x} / {y}" for k, (x, y) in pairs.items() if not _alike(x, y, tolerance)]
    return found


def _alike(a: str | None, b: str | None, tolerance: float) -> bool:
    if a is None or b is None:
        return a == b
    words = [_NUMBER.sub("", text).split() for text in (a, b)]
    values = [numbers(text) for text in (a, b)]
    close = len(values[0]) == len(values[1]) and np.allclose(values[0], values[1], rtol=0, atol=tolerance)
    return words[0] == words[1] and bool(close)


def test_golden() -> None:
    # after a wanted change: write to_svg(loops()) to tests/golden/loops.svg and look at it in a browser
    assert differences(to_svg(loops()), GOLDEN.read_bytes()) == []


@pytest.mark.parametrize(
    "old, new",
    [
        (b'class="stroke" data-t0="0"', b'class="stroke" data-t0=".1"'),
        (b"c", b"C"),
        (b'd="M12', b'd="M12.1'),
        (b'stroke="#1a1a2e"', b'stroke="#1a1a2f"'),
        (b"</g>", b"<path/></g>"),
        (b' data-word="0"', b""),
    ],
)
def test_the_comparison_can_fail(old: bytes, new: bytes) -> None:
    golden = GOLDEN.read_bytes()
    place = golden.index(old, golden.index(b"<g id"))
    changed = golden[:place] + new + golden[place + len(old) :]
    assert differences(golden, changed)


def test_stays_within_a_hundredth_of_a_mm() -> None:
    drawing = loops(words=6)
    for stroke, path in zip(drawing.strokes, paths(to_svg(drawing)), strict=True):
        if len(stroke.t) > 1:
            # time is written in whole ms, so the pen may be half a ms off along the path
            along = 0.001 * stroke.speed.max()
            assert np.hypot(*(at(path, stroke.t) - stroke.xy).T).max() < 0.01 + along
            u = np.linspace(0, 1, 200)[:, None, None]
            a, b, c, d = beziers(path).transpose(1, 0, 2)
            curve = ((1 - u) ** 3 * a + 3 * (1 - u) ** 2 * u * b + 3 * (1 - u) * u**2 * c + u**3 * d).reshape(-1, 2)
            away = np.hypot(*(stroke.xy[:, None] - curve[None]).transpose(2, 0, 1)).min(axis=1)
            assert away.max() < 0.01


def test_is_close_to_the_motion_between_the_samples_too() -> None:
    t = np.arange(0, 4 / 3, 1 / 200)
    stroke = Stroke(t, word(t, 8, 14))
    fine = np.linspace(0, t[-1], 5000)
    path = paths(to_svg(Drawing((stroke,), CARD)))[0]
    off = np.hypot(*(at(path, fine) - word(fine, 8, 14)).T)
    assert off.max() < 0.01 + 0.001 * stroke.speed.max()


def test_is_compact() -> None:
    drawing = loops(words=6)
    samples = sum(len(s.t) for s in drawing.strokes)
    count = sum((p.get("d") or "").count("c") for p in paths(to_svg(drawing)))
    assert 0 < count < samples / 5


def test_every_stroke_has_its_times_and_its_word() -> None:
    drawing = loops()
    for stroke, path in zip(drawing.strokes, paths(to_svg(drawing)), strict=True):
        assert float(path.get("data-t0", "")) == pytest.approx(stroke.t[0], abs=5e-4)
        assert float(path.get("data-t1", "")) == pytest.approx(stroke.t[-1], abs=5e-4)
        assert sum(numbers(path.get("data-k", ""))) == pytest.approx(1000 * (stroke.t[-1] - stroke.t[0]), abs=0.6)
        assert path.get("data-word") == str(stroke.word)


def test_layers_and_colours_are_told() -> None:
    t, xy = np.array([0.0, 1.0]), np.array([[1.0, 1.0], [2.0, 3.0]])
    red = Stroke(t, xy, layer='"red" & <thin>', colour="#c01020")
    path, plain = paths(to_svg(Drawing((red, Stroke(t + 2, xy)), CARD)))
    assert (path.get("data-layer"), path.get("stroke")) == ('"red" & <thin>', "#c01020")
    assert plain.get("data-layer") is None and plain.get("stroke") is None
    with pytest.raises(ValueError, match="not a colour"):
        Stroke(t, xy, colour='red" onload="')


def test_inkscape_finds_layers_lines_and_words() -> None:
    drawing = replace(loops(), about={"words": ["Dear", '"Ada" & Zoë,', "jam"], "lines": [0, 2], "page_number": 2})
    root = ElementTree.fromstring(to_svg(drawing))

    def labels(parent: ElementTree.Element) -> list[str]:
        return [group.get(f"{{{INKSCAPE}}}label", "") for group in parent.findall(f"{SVG}g")]

    ink, travel = root.findall(f"{SVG}g")
    assert labels(root) == ["Page 2", "% travel of the lifted pen"] and labels(ink)[1:] == ["line 2: jam"]
    assert labels(ink[0]) == ["Dear", '"Ada" & Zoë,'] and len(ink[0][0]) == 3
    assert all(layer.get(f"{{{INKSCAPE}}}groupmode") == "layer" for layer in (ink, travel))
    by_word = ElementTree.fromstring(to_svg(drawing, by="word"))
    assert labels(by_word)[:-1] == ["001 Dear", '002 "Ada" & Zoë,', "003 jam"]
    assert len({group.get("id") for group in by_word.findall(f"{SVG}g")}) == 4


def test_inks_that_take_turns_have_a_layer_each_and_come_back_in_their_order() -> None:
    from handout.sources.svg import from_svg

    strokes = tuple(replace(s, colour=("#c01020", "#101010")[n % 2]) for n, s in enumerate(loops().strokes))
    svg = to_svg(replace(loops(), strokes=strokes))
    inks = [g for g in ElementTree.fromstring(svg).iter(f"{SVG}g") if g.get("class") == "ink"]
    assert [ink.get(f"{{{INKSCAPE}}}label") for ink in inks] == ["#c01020", "#101010"]
    back = from_svg(svg)
    assert back.timed and [s.colour for s in back.strokes] == [s.colour for s in strokes]
    assert np.allclose([s.t[0] for s in back.strokes], [s.t[0] for s in strokes], atol=1e-3)


def test_dots_are_visible() -> None:
    point = np.array([[5.0, 5.0]])
    tiny = Stroke(np.array([1.0, 1.1]), np.array([[9.0, 9.0], [9.0002, 9.0]]))
    svg = to_svg(Drawing((Stroke(np.array([0.0]), point), tiny), CARD))
    assert [p.get("d") for p in paths(svg)] == ["M5 5h.001", "M9 9h.001"]
    assert b'stroke-linecap="round"' in svg


@pytest.mark.parametrize("nib", [0.0, 2.0])
def test_a_changing_width_is_clipped_to_its_mark_and_read_back(nib: float) -> None:
    """Every clip polygon lies within the mark, and the mark's edges within the clip; widths and nib come back."""
    from handout.sources.svg import from_svg

    one = loops(1).strokes[0]
    width = np.linspace(0.6, 1.4, len(one.t))
    marked = replace(one, width=width, nib=nib, rotation=np.full(len(one.t), -0.7) if nib else None)
    svg = to_svg(Drawing((marked,), CARD))
    (path,) = paths(svg)
    assert path.get("clip-path") == "url(#mark-0)" and float(path.get("stroke-width", "")) > max(1.4, nib)
    corners = np.concatenate(
        [
            np.cumsum(np.array(numbers(piece)).reshape(-1, 2), axis=0)
            for clip in ElementTree.fromstring(svg).iter(f"{SVG}clipPath")
            for piece in clip[0].get("d", "").split("M")[1:]
        ]
    )
    away = np.linalg.norm(corners[:, None] - one.xy[None], axis=2).min(axis=1)
    assert 0.25 < away.max() < max(1.4, nib) / 2 + 0.15
    back = from_svg(svg).strokes[0]
    assert back.nib == nib and back.width is not None
    assert np.allclose(np.interp(back.t, one.t, width), back.width, atol=0.03)
    if nib:
        assert back.rotation is not None and np.allclose(back.rotation, -0.7)


def test_a_dot_is_as_wide_as_its_widest() -> None:
    dot = Stroke(np.array([0.0, 0.1, 0.2]), np.full((3, 2), 5.0), width=np.array([0.02, 0.8, 0.02]))
    (clip,) = ElementTree.fromstring(to_svg(Drawing((dot,), CARD))).iter(f"{SVG}clipPath")
    corners = np.cumsum(np.array(numbers(clip[0].get("d", ""))).reshape(-1, 2), axis=0)
    assert np.linalg.norm(corners - 5, axis=1) == pytest.approx(0.4, abs=0.002)


def test_an_even_width_is_the_strokes_or_the_pens() -> None:
    stroke = loops(1).strokes[0]
    own = replace(stroke, width=np.linspace(0.69, 0.71, len(stroke.t)))
    svg = to_svg(Drawing((stroke, replace(own, t=own.t + 9)), CARD), pen_width=0.35)
    assert [p.get("stroke-width") for p in paths(svg)] == [None, ".7"]
    ink = ElementTree.fromstring(svg).find(f"{SVG}g[@id='ink']")
    assert ink is not None and ink.get("stroke-width") == ".35"


def test_size_in_mm() -> None:
    root = ElementTree.fromstring(to_svg(loops()))
    assert (root.get("width"), root.get("height"), root.get("viewBox")) == ("90mm", "40mm", "0 0 90 40")


def test_travel_is_hidden_and_complete() -> None:
    drawing = loops()
    root = ElementTree.fromstring(to_svg(drawing))
    travel = root.find(f"{SVG}g[@id='travel']")
    assert travel is not None and travel.get("display") == "none"
    assert ".travel{display:none}" in (root.findtext(f"{SVG}style") or "")
    moves = [numbers(p.get("d", "")) for p in travel]
    ends = [(*a.xy[-1], *b.xy[0]) for a, b in zip(drawing.strokes, drawing.strokes[1:], strict=False)]
    assert np.allclose(moves, ends, atol=6e-4)


@pytest.mark.slow
@given(text=st.text() | st.sampled_from(["\x00\x07]]>", "<script>&amp;", "\ud800 \udfff", "--> ￾", "‮abc"]))
def test_is_xml_whatever_the_text(text: str) -> None:
    drawing = replace(loops(1), about={"text": text, "hand": text, "seed": 3, "odd " + text: [text]})
    root = ElementTree.fromstring(to_svg(drawing))
    stored = json.loads(root.findtext(f"{SVG}metadata") or "")
    assert stored["seed"] == 3 and stored["page"] == {"width": 90, "height": 40, "name": "card"}
    assert stored["duration"] == pytest.approx(drawing.duration, abs=1e-3)
    readable = text.encode("utf-8", "replace").decode()
    assert stored["hand"] == stored["about"]["text"] == readable


@pytest.mark.slow
@settings(max_examples=40)
@given(drawing=drawings)
def test_any_drawing(drawing: Drawing) -> None:
    svg = to_svg(drawing)
    assert svg == to_svg(drawing)
    assert len(paths(svg)) == len(drawing.strokes)
    assert b"nan" not in svg.split(b"<g")[1] and b"e+" not in svg.split(b"<g")[1]


def test_title_says_what_is_written() -> None:
    root = ElementTree.fromstring(to_svg(loops()))
    assert root.findtext(f"{SVG}title") == "Dear Ada, …"
    described = root.findtext(f"{SVG}desc") or ""
    assert "house-joined" in described and "seed 7" in described


@pytest.mark.parametrize("colour", ["red", "#12", '#000"/><script>', "#12345g", ""])
def test_refuses_other_colours(colour: str) -> None:
    with pytest.raises(InputError, match="colour"):
        to_svg(loops(), colour=colour)


@pytest.mark.parametrize("width", [0.0, -1.0, 51.0, float("nan")])
def test_refuses_other_widths(width: float) -> None:
    with pytest.raises(InputError, match="pen width"):
        to_svg(loops(), pen_width=width)


def _browse(args: list[str]) -> bytes:
    assert CHROMIUM is not None
    quiet = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--hide-scrollbars"]
    done = subprocess.run([CHROMIUM, *quiet, *args], capture_output=True, timeout=60, check=True)
    return done.stdout


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="the program chromium, which shows the SVG, is not installed")
def test_in_a_browser_it_plays_only_when_asked(tmp_path: Path) -> None:
    (tmp_path / "loops.svg").write_bytes(to_svg(loops()))
    address = (tmp_path / "loops.svg").as_uri()
    still = _browse(["--dump-dom", address])
    playing = _browse(["--dump-dom", address + "#play"])
    assert b'class="stroke later"' not in still and b'class="playing"' not in still
    assert b'class="stroke later"' in playing and b'class="playing"' in playing


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="the program chromium, which shows the SVG, is not installed")
def test_in_a_browser_travel_shows_only_when_asked(tmp_path: Path) -> None:
    from PIL import Image

    (tmp_path / "loops.svg").write_bytes(to_svg(loops()))
    frames = [
        f'<iframe src="loops.svg{part}" style="float:left;border:0;width:400px;height:200px">'
        for part in ("", "#travel")
    ]
    (tmp_path / "both.html").write_text("<body style='margin:0'>" + "</iframe>".join(frames), encoding="utf-8")
    shot = tmp_path / "shot.png"
    _browse([f"--screenshot={shot}", "--window-size=800,200", (tmp_path / "both.html").as_uri()])
    pixels = np.asarray(Image.open(shot).convert("RGB")).astype(int)
    for half in (pixels[:, :400], pixels[:, 400:]):
        assert (half.sum(axis=2) < 200).sum() > 200  # the writing itself
    red = pixels[..., 0] > pixels[..., 2] + 40
    assert red[:, :400].sum() == 0 and red[:, 400:].sum() > 50
