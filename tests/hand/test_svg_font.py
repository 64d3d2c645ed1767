"""Single-line SVG fonts as hands: where points go, what is refused, and what the movement makes of them."""

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand.library import find
from handout.hand.svg_font import aims, read_svg_font
from handout.motion.optimal_control import follow
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.values import ActionPlan
from handout.writing.compose import compose
from handout.writing.layout import Layout

# a few letters drawn for this test, 500 units to the height of a small one
LETTERS = {
    "n": (520, "M60 500 L60 0 M60 340 C120 460 200 500 270 500 C370 500 400 430 400 330 L400 0"),
    "o": (540, "M260 500 C120 500 60 380 60 250 C60 120 120 0 260 0 C400 0 460 120 460 250 C460 380 400 500 260 500"),
    "l": (200, "M80 1000 V0"),
    "v": (460, "M40 500 L220 0 L400 500"),
    "x": (460, "M40 500 L400 0 M400 500 L40 0"),
    "i": (200, "M80 500 L80 0 M80 700 L80 715"),
    "é": (500, "M60 260 H430 C430 420 350 500 250 500 C120 500 60 380 60 250 C60 120 130 0 260 0 C340 0 400 40 430 90 "
         "M200 600 L300 720"),
}  # fmt: skip


def font(letters=LETTERS, face='units-per-em="1000" ascent="1000" descent="-300" font-family="Drawn"', extra=""):
    glyphs = "".join(f'<glyph unicode="{c}" horiz-adv-x="{w}" d="{d}"/>' for c, (w, d) in letters.items())
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://x/svg11.dtd">\n'
        f'<svg xmlns="http://www.w3.org/2000/svg"><defs><font id="drawn" horiz-adv-x="400"><font-face {face}/>'
        f'<missing-glyph d="M0 0h9"/><glyph unicode=" " horiz-adv-x="300"/><glyph unicode="ffi" d="M0 0h9"/>{extra}'
        f'{glyphs}<hkern u1="v" u2="o" k="40"/></font></defs></svg>'
    )


@pytest.fixture
def file(tmp_path):
    def write(text):
        (tmp_path / "drawn.svg").write_text(text, encoding="utf-8")
        return tmp_path / "drawn.svg"

    return write


def test_letters_have_the_height_and_advance_of_the_font(file):
    hand = read_svg_font(file(font()))
    assert set(hand.glyphs) == set(LETTERS) and hand.name == "drawn" and hand.title == "Drawn"
    (n,) = hand.glyphs["n"]
    assert n.width == pytest.approx(520 / 500) and len(n.strokes) == 2 and (n.entry, n.exit) == ("lifted", "lifted")
    tops = {c: max(s[:, 1].max() for s in hand.glyphs[c][0].strokes) for c in "xnl"}
    assert tops == pytest.approx({"x": 1.0, "n": 1.0, "l": 2.0}, abs=0.01)
    assert hand.word_space == pytest.approx(300 / 500)
    assert hand.slant == 0


def test_a_corner_is_one_point_and_a_straight_stem_evenly_spaced():
    vee = aims(np.array([[0.0, 1.0], [0.4, 0.0], [0.8, 1.0]]))
    assert [0.4, 0.0] in vee.tolist()
    stem = aims(np.array([[0.0, 2.0], [0.0, 0.0]]))
    assert stem.tolist() == [[0, 2], [0, 0]] or np.ptp(np.diff(stem[:, 1])) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("letter", LETTERS)
def test_the_movement_makes_the_letter_again(file, letter):
    from handout import pathdata

    hand = read_svg_font(file(font()))
    for points, path in zip(hand.glyphs[letter][0].strokes, pathdata.cubics(LETTERS[letter][1]), strict=True):
        meant = pathdata.flatten_path(path / 500, 0.002)[0]
        dense = np.column_stack([np.interp(np.linspace(0, 1, 400), np.linspace(0, 1, len(meant)), c) for c in meant.T])
        xy = follow(ActionPlan(points, hand.interval, hand.smooth), baked_at=hand.drawn_at)[1]
        gap = np.hypot(*(xy[:, None] - dense).transpose(2, 0, 1)).min(axis=1)
        assert gap.max() < 0.09  # x-heights


def test_a_text_is_written_with_it(file):
    hand = find(str(file(font())))
    rng = np.random.default_rng(2)
    (written,) = compose("violin no", hand, Layout(page("A6")), rng)
    drawing = trace(written, hand, rng)
    assert len(drawing.strokes) == 1 + 2 + 1 + 1 + 2 + 2 + 2 + 1 and drawing.timed
    heights = [np.ptp(s.xy[:, 1]) for s in drawing.strokes]
    assert max(heights) == pytest.approx(2 * hand.x_height, rel=0.3)


def test_a_font_of_capitals_alone_is_scaled_by_them(file):
    hand = read_svg_font(file(font({"H": (700, "M80 700 V0 M480 700 V0 M80 350 H480"), "L": (500, "M80 700 V0 H400")})))
    assert hand.glyphs["H"][0].strokes[0][:, 1].max() == pytest.approx(1 / 0.68, abs=0.01)


OUTLINE = {c: (500, f"M{i} 0 H400 V500 H{i} Z M100 100 H300 V400 H100 Z") for i, c in enumerate("abcdefgh")}
BAD = {
    "a drawing": ('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0h9" stroke="red"/></svg>', "no <font>"),
    "no SVG": ("name = 'x'", "not an SVG font"),
    "no glyphs": (font({}), "no glyph of a letter"),
    "outlines": (font(OUTLINE), "font of outlines (8 of 8 letters"),
    "no units": (font({"-": (300, "M0 0 H200")}, face='font-family="x"'), "cannot be scaled"),
    "far": (font({"x": (300, "M0 0 L400 500 L4e9 3")}), "glyph of 'x' reaches"),
    "bad path": (font({"x": (300, "M0 0 Lnan 3")}), "glyph of 'x'"),
    "entities": ('<!DOCTYPE svg [<!ENTITY a "b">]><svg/>', "entities"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_fonts_are_refused_in_a_sentence(file, name):
    text, word = BAD[name]
    with pytest.raises(InputError) as refused:
        read_svg_font(file(text))
    assert word in str(refused.value) and "drawn.svg" in str(refused.value)


def test_a_missing_font_is_named(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        find(str(tmp_path / "none.svg"))
