"""`handout brush`, and brushes as pens of the other verbs."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest


@pytest.fixture()
def photograph(tmp_path):
    """A stroke with a frame around it."""
    rng = np.random.default_rng(1)
    sheet = np.full((420, 800, 3), 240, np.uint8)
    y, x = np.mgrid[:420, :800]
    stops = rng.uniform(500, 680, 20)[np.clip((y - 150) // 5, 0, 19)]
    sheet[(y >= 150) & (y < 250) & (x >= 120) & (x < stops)] = (30, 30, 36)
    cv2.rectangle(sheet, (20, 20), (770, 390), (90, 90, 90), 2)
    cv2.imwrite(str(tmp_path / "stroke.png"), sheet)
    return tmp_path / "stroke.png"


def ink(path):
    return 255 - cv2.imread(str(path), 0).astype(int)


@pytest.mark.slow
def test_learned_shown_and_written_with(call, photograph):
    out, err = call("brush", "learn", photograph, photograph, "-o", "own.brush", "--width", "0.9mm", "--json")
    facts = json.loads(out)
    assert facts["strokes"] == 2 and facts["width_mm"] == 0.9 and "2 strokes" in err
    assert all(4.5 < length < 6.5 for length in facts["lengths_in_widths"])
    call("brush", "show", "own.brush", "-o", "sheet.png")
    assert (ink("sheet.png") > 128).mean() > 0.03
    page = ("--page", "60x20mm", "--seed", 2, "--dpi", 150)
    call("write", "hi ë", *page, "--pen", "own.brush", "-o", "a.png")
    call("write", "hi ë", *page, "--pen", "own.brush", "-o", "b.png")
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()
    out, _ = call("write", "hi ë", *page, "--pen", "own.brush", "-o", "line.svg", "-o", "painted.png", "--json")
    assert json.loads(out)["notes"] == [
        "--pen: .svg files show the brush as a plain line; PNG files and prints are painted."
    ]
    call("write", "hi ë", *page, "--pen", "plain", "--pen-width", "0.9mm", "-o", "plain.png")
    assert (ink("a.png") > 128).sum() == pytest.approx((ink("plain.png") > 128).sum(), rel=0.35)


@pytest.mark.slow
def test_every_verb_takes_a_shipped_brush(call):
    common = ("--pen", "marker", "--dpi", 100, "--seed", 1, "-q")
    call("asemic", "--letters", 2, *common, "-o", "tag.png")
    path = '<path d="M5 10 C 15 0 30 20 45 8" fill="none" stroke="black"/>'
    size = 'width="50mm" height="20mm" viewBox="0 0 50 20"'
    Path("line.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{path}</svg>')
    call("restyle", "line.svg", *common, "-o", "styled.png")
    Path("rows.csv").write_text("name,street,postal code,city,country\nA. Bee,High Street 1,10115,Berlin,DE\n")
    call("print", "rows.csv", "--printer", "pdf", *common, "--dry-run", "envelope.png")
    for name in ("tag.png", "styled.png", next(str(p) for p in Path().glob("envelope*.png"))):
        assert (ink(name) > 100).sum() > 100, name


@pytest.mark.slow
@pytest.mark.parametrize("pen", ["fountain", "sumi"])
def test_a_scanned_hand_is_written_with_any_pen(call, pen):
    common = ("--hand", "house-joined-ballpoint", "--page", "60x20mm", "--seed", 1, "--dpi", 150, "-q")
    call("write", "jam tin", *common, "-o", "own.png")
    call("write", "jam tin", *common, "--pen", pen, "--pen-width", "0.4mm", "-o", "pen.png")
    own, other = ink("own.png") > 60, ink("pen.png") > 60
    near = cv2.dilate(own.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    assert other.sum() > 0.4 * own.sum() and near[other].mean() > 0.95
    assert Path("own.png").read_bytes() != Path("pen.png").read_bytes()


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("brush", "learn", "none.png", "-o", "a.brush"), "none.png"),
        (("brush", "learn", "blank.png", "-o", "a.brush"), "there is no stroke"),
        (("brush", "learn", "blank.png", "-o", "a.png"), "kept as .brush"),
        (("brush", "learn", "blank.png", "-o", "plain.brush"), "name of a pen"),
        (("brush", "show", "none.brush", "-o", "a.png"), "no such brush"),
        (("brush", "show", "marker", "-o", "a.svg"), "a.png"),
        (("write", "hi", "--pen", "none.brush", "-o", "a.png"), "no such brush"),
        (("write", "hi", "--pen", "quill", "-o", "a.png"), "dry-brush"),
    ],
)
def test_bad_input(call, arguments, words):
    cv2.imwrite("blank.png", np.full((200, 300, 3), 240, np.uint8))
    assert words in call(*arguments, code=2)[1]
    assert not list(Path().glob("*.brush")) and not Path("a.png").exists()
