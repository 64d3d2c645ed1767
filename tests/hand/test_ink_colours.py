"""The colour of a hand's strokes is that of its pages' ink."""

import re
from dataclasses import replace

import numpy as np
import pytest

from handout.hand import file
from handout.hand.measures import in_other_ink, ink_colours
from handout.hand.scanned import Texture

BLUE, GREY, RED = (70, 80, 170), (96, 96, 99), (190, 50, 60)


def inked(page, colour, where=None):
    """The page with the ink of another colour, everywhere or where x is at least so many pixels."""
    rgba = page.texture.rgba.copy()
    part = rgba[:, max(0, (where or 0) - page.texture.corner[0]) :]
    part[..., :3] = colour
    # as dark in the middle of the line as that colour on white, and paler at its edges
    part[..., 3] = np.where(part[..., 3] > 60, 255, part[..., 3])
    return replace(page, texture=Texture(page.texture.corner, page.texture.shape, lambda: rgba))


def doubled(hand, first, second):
    """A hand of two pages, the same letters on both."""
    count = len(hand.glyphs)

    def moved(number):
        return number + count if number >= 0 else number

    again = [replace(g, page=1, before=moved(g.before), after=moved(g.after)) for g in hand.glyphs]
    return replace(hand, pages=(first, second), glyphs=(*hand.glyphs, *again))


def near(found, colour):
    return max(abs(int(found[i : i + 2], 16) - want) for i, want in zip((1, 3, 5), colour, strict=True)) <= 3


def test_the_ink_of_a_page_is_measured(small_hand):
    grey = replace(small_hand, pages=(inked(small_hand.pages[0], GREY),))
    (colour,) = ink_colours(grey).colours
    assert near(colour, GREY) and set(ink_colours(grey).of.tolist()) == {0}


def test_pages_of_two_inks_and_of_one(small_hand):
    page = small_hand.pages[0]
    both = ink_colours(doubled(small_hand, inked(page, BLUE), inked(page, GREY)))
    count = len(small_hand.glyphs)
    assert len(both.colours) == 2 and len(set(both.of[:count].tolist())) == len(set(both.of[count:].tolist())) == 1
    assert near(both.colours[both.of[0]], BLUE) and near(both.colours[both.of[count]], GREY)
    # two scans of one ink are never quite alike
    assert len(ink_colours(doubled(small_hand, inked(page, BLUE), inked(page, (76, 84, 166)))).colours) == 1


def test_two_inks_on_one_page(small_hand):
    page = small_hand.pages[0]
    middle = page.shape[1] // 2
    found = ink_colours(replace(small_hand, pages=(inked(inked(page, BLUE), RED, middle),)))
    assert len(found.colours) == 2
    for glyph, ink in zip(small_hand.glyphs, found.of.tolist(), strict=True):
        x = page.graph.uv[glyph.vertices, 0]
        if x.max() < middle - 5 or x.min() > middle + 5:
            assert near(found.colours[ink], BLUE if x.max() < middle else RED), glyph.letter


def test_letters_of_a_heading_are_not_written_while_others_stand(small_hand, tmp_path):
    import json

    from click.testing import CliRunner

    from handout.cli import cli
    from handout.writing.glyph_index import index_glyphs

    page, washed = small_hand.pages[0], ((92, 98, 145), (189, 95, 103))  # nearer to each other as light than as ink
    edge = 500
    hand = replace(small_hand, pages=(inked(inked(page, washed[0]), washed[1], edge),))
    other = in_other_ink(hand)
    right = [page.graph.uv[glyph.vertices, 0].min() > edge + 5 for glyph in hand.glyphs]
    assert 0 < other.mean() < 0.5 and other[right].all() and index_glyphs(hand).refused[other].all()
    assert not in_other_ink(doubled(small_hand, inked(page, BLUE), inked(page, RED))).any(), "a page of its own"
    lone = next(x for x in hand.letters if x.isalpha() and other[list(hand.numbers_of_letter(x))].all())
    file.save(hand, tmp_path / "two.hand")
    args = [
        "write",
        lone,
        "--hand",
        str(tmp_path / "two.hand"),
        "--page",
        "A6",
        "--json",
        "-o",
        str(tmp_path / "a.png"),
    ]
    assert json.loads(CliRunner().invoke(cli, args).stdout)["other_inks"] == [lone]
    told = CliRunner().invoke(cli, [arg for arg in args if arg != "--json"]).stderr
    assert f"In another ink, as the author wrote none in the usual one: {lone}; --pen" in told


def test_a_pen_without_letters_has_a_colour(small_hand):
    pen = replace(small_hand, glyphs=(), pages=(inked(small_hand.pages[0], RED),))
    assert near(ink_colours(pen).colours[0], RED)


def test_ink_of_a_file_has_its_colour(small_hand, tmp_path):
    file.save(replace(small_hand, pages=(inked(small_hand.pages[0], BLUE),)), tmp_path / "blue.hand")
    assert near(ink_colours(file.load(tmp_path / "blue.hand")).colours[0], BLUE)


@pytest.fixture
def grey_hand(small_hand, tmp_path):
    path = tmp_path / "grey.hand"
    file.save(replace(small_hand, pages=(inked(small_hand.pages[0], GREY),)), path)
    return str(path)


@pytest.mark.slow
def test_strokes_have_it_in_svg_and_pdf(grey_hand, tmp_path):
    from click.testing import CliRunner
    from PIL import Image

    from handout.cli import cli

    def strokes(*more):
        svg, pdf, png = (tmp_path / f"a.{suffix}" for suffix in ("svg", "pdf", "png"))
        common = ["--hand", grey_hand, "--seed", "1", "--page", "A6", "even line", *more]
        assert CliRunner().invoke(cli, ["write", "-o", str(svg), *common]).exit_code == 0
        args = ["plot", "--dry-run", str(pdf), "--dry-run", str(png), *common]
        assert CliRunner().invoke(cli, args).exit_code == 0
        return set(re.findall(r'class="stroke"[^>]* stroke="(#\w+)"', svg.read_text())), svg, pdf, png

    own, svg, pdf, png = strokes()
    assert len(own) == 1 and near(own.copy().pop(), GREY)
    assert re.search(f'<g id="ink" [^>]* stroke="{own.copy().pop()}"', svg.read_text())
    wanted = " ".join(f"{int(own.copy().pop()[i : i + 2], 16) / 255:.4g}" for i in (1, 3, 5))
    assert wanted in content(pdf)
    seen = np.asarray(Image.open(png).convert("RGB")).reshape(-1, 3).astype(int)
    dark = seen[seen.min(axis=1) < 150]
    assert len(dark) and np.abs(dark - dark.mean(axis=1, keepdims=True)).mean() < 6, "grey, not blue"
    given, svg, *_ = strokes("--ink", "#00ff00")
    assert not given and 'stroke="#00ff00"' in svg.read_text()


@pytest.mark.slow
def test_what_scanned_ink_does_not_follow_is_said(grey_hand, tmp_path):
    import json

    from click.testing import CliRunner

    from handout.cli import cli

    args = ["write", "--hand", grey_hand, "--page", "A6", "even", "--json", "--ink", "navy", "--pen-width", "1mm"]
    done = CliRunner().invoke(cli, [*args, "-o", str(tmp_path / "a.png")])
    notes = json.loads(done.stdout)["notes"]
    assert [note.split(":")[0] for note in notes] == ["--pen-width", "--ink"] and all(n in done.stderr for n in notes)
    done = CliRunner().invoke(cli, [*args, "-o", str(tmp_path / "a.svg")])
    assert len(json.loads(done.stdout)["notes"]) == 1, "strokes have the colour"
    table = tmp_path / "even.csv"
    table.write_text("name,street,place\neven,even,even\n", encoding="utf-8")
    out = ["--dry-run", str(tmp_path / "a.pdf"), "--ink", "navy", "--json"]
    done = CliRunner().invoke(cli, ["print", "--printer", "epson", "--hand", grey_hand, str(table), *out])
    assert [note.split(":")[0] for note in json.loads(done.stdout)["notes"]] == ["--ink"]


def content(pdf):
    import zlib

    data = pdf.read_bytes()
    start = data.index(b"stream\n", data.index(b"/FlateDecode")) + 7
    return zlib.decompress(data[start : data.index(b"\nendstream", start)]).decode()
