"""Hands from recorded pens and single-line fonts, as a user makes and uses them."""

import json
from pathlib import Path

import numpy as np
import pytest

from handout.hand import file


def unipen(letters):
    """A UNIPEN file of single letters, each drawn as a wave, with their labels."""
    rows = [".COORD X Y", ".X_POINTS_PER_MM 10", ".Y_POINTS_PER_MM 10"]
    rows += [f'.SEGMENT CHARACTER {number} OK "{letter}"' for number, letter in enumerate(letters)]
    t = np.linspace(0, 1, 40)
    for letter in letters:
        waves = "nmu".index(letter) + 2
        xy = np.rint(np.column_stack([400 + 60 * t, 300 - 13 * np.cos(2 * np.pi * waves * t)])).astype(int)
        rows += [".PEN_DOWN", *(f"{x} {y}" for x, y in xy.tolist()), ".PEN_UP"]
    return "\n".join(rows) + "\n"


FONT = """<svg xmlns="http://www.w3.org/2000/svg"><defs><font id="f" horiz-adv-x="700"><font-face units-per-em="1000"
x-height="500"/>{}</font></defs></svg>"""


def test_a_hand_of_labelled_letters_is_written_and_plotted_with(call):
    Path("pen.dat").write_text(unipen("nmu" * 4))
    out, err = call("hand", "read", "me", "--ink", "pen.dat", "-o", "me.hand", "--json")
    facts = json.loads(out)
    assert facts["glyphs"] == 12 and facts["found"][0]["missing"] == []
    assert "does not say when the pen was where" in err
    call(
        "write", "mum nun", "--hand", "me.hand", "-o", "a.inkml", "-o", "a.png", "--page", "60x40mm", "--margin", "5mm"
    )
    assert Path("a.inkml").read_text().count("<trace>") == 6 and Path("a.png").stat().st_size > 1000


def test_a_hand_of_a_font(call):
    glyphs = {"n": "M0 0L0 500L300 500L300 0", "u": "M0 500L0 0L300 0L300 500", "l": "M0 0L0 900"}
    glyphs |= {
        "m": "M0 0L0 500L500 500L500 0M250 500L250 0",
        "v": "M0 500L150 0L300 500",
        "x": "M0 500L300 0M0 0L300 500",
    }
    body = "".join(f'<glyph unicode="{letter}" d="{path}"/>' for letter, path in glyphs.items())
    Path("font.svg").write_text(FONT.format(body))
    _, err = call("hand", "read", "me", "--ink", "font.svg", "-o", "me.hand")
    hand = file.load(Path("me.hand"))
    assert set(hand.letters) == set(glyphs) and min(hand.letters.values()) >= 5
    assert hand.x_height == pytest.approx(2.5, rel=0.25) and "0 doubtful" in err


def test_what_cannot_be_read_is_said(call):
    Path("pen.dat").write_text(unipen("nmu"))
    Path("text.txt").write_text("n m u")
    Path("plain.inkml").write_text("<ink><trace>" + ", ".join(f"{n} {n % 5}" for n in range(60)) + "</trace></ink>")
    Path("two.gml").write_text("<gml><stroke><pt><x>0</x><y>0</y></pt><pt><x>1</x><y>1</y></pt></stroke></gml>")
    Path("filled.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0L9 0L9 9Z"/></svg>')
    rows = "0 0 0 1 0 0 0\n" * 1_000_002
    Path("many.svc").write_text(f"1000002\n{rows}")
    for arguments, says in [
        ((), "give --scan or --ink"),
        (("--scan", "a.png", "--ink", "pen.dat"), "give --scan or --ink"),
        (("--ink", "pen.dat", "--ink", "pen.dat", "--text", "text.txt"), "1 --text for 2 --ink"),
        (("--ink", "pen.dat"), "too little writing"),
        (("--ink", "plain.inkml"), "Give its text with --text"),
        (("--ink", "two.gml", "--text", "text.txt"), "2 points"),
        (("--ink", "filled.svg", "--text", "text.txt"), "1 filled outline"),
        (("--ink", "many.svc", "--text", "text.txt"), "1000002 samples"),
        (("--ink", "none.svc", "--text", "text.txt"), "Cannot read none.svc"),
    ]:
        _, err = call("hand", "read", "me", *arguments, "-o", "me.hand", code=2)
        assert says in err and not Path("me.hand").exists()
