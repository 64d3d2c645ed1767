"""What a user may give as scans and texts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from handout.errors import InputError
from handout.scanning.checks import likely_dpi
from handout.scanning.written_page import find_ink, prepare
from handout.tagging import page_sources
from handout.tagging.glyph_extraction import Missing
from handout.tagging.page_sources import chosen_pages, common_scale, gather_sources, tagged_pages
from handout.tagging.segmentation import by_segments_once


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def three():
    """A file of three pages."""
    pages = [Image.new("L", (80, 60), level) for level in (10, 20, 30)]
    pages[0].save("three.tif", save_all=True, append_images=pages[1:], dpi=(300, 300))
    return Path("three.tif")


def gathered(names, texts=(), dpi=None):
    sources = gather_sources(names, [(f"{i}.txt", text) for i, text in enumerate(texts)], dpi)
    return sources, [note for source in sources for note in source.notes]


def test_a_file_of_several_pages_stands_for_all_of_them(three):
    assert chosen_pages(["three.tif"]) == [(three, 1), (three, 2), (three, 3)]
    assert chosen_pages(["three.tif:2-3", "three.tif:1"]) == [(three, 2), (three, 3), (three, 1)]
    Image.new("L", (80, 60)).save("a:1.png")
    assert chosen_pages(["a:1.png"]) == [(Path("a:1.png"), None)], "a name may look like that"


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (["three.tif:4"], r"three\.tif:4: there is no such page; three\.tif holds pages 1–3"),
        (["three.tif:0"], "no such page"),
        (["three.tif:3-2"], r"backwards; write three\.tif:2-3"),
        (["three.tif", "three.tif:2"], r"three\.tif:2 is given twice"),
        (["./three.tif:1", "three.tif:1"], "is given twice"),
    ],
)
def test_pages_that_cannot_be_meant(three, names, says):
    with pytest.raises(InputError, match=says):
        chosen_pages(names)


def test_a_picture_under_another_name_is_the_same_picture(small_scan):
    Path("copy.png").write_bytes(small_scan.scan.read_bytes())
    with pytest.raises(
        InputError, match=r"copy\.png shows the very same picture as .*page\.png: leave one of them out"
    ):
        gathered([str(small_scan.scan), "copy.png"], ["text", "text"])


@pytest.mark.slow
def test_every_page_needs_its_text(small_scan, three):
    scan = str(small_scan.scan)
    with pytest.raises(InputError, match=r"page\.png: what is written on it\? Give its text with --text; only"):
        gathered([scan])
    with pytest.raises(InputError, match="2 texts for 1 page: give one --text for each page"):
        gathered([scan], ["a", "b"])
    scan_and_more = [scan, "three.tif"]
    with pytest.raises(InputError, match=r"three\.tif:1: what is written.*1 text for 4 pages"):
        gathered(scan_and_more, ["a"])


@pytest.mark.slow
def test_the_resolution_of_the_file_may_be_overruled_and_that_is_said(small_scan):
    (source,), said = gathered([str(small_scan.scan)], ["a"], 310)
    assert source.prepared.scan.dpi == 310 and "says 300" in said[0] and "310 is believed" in said[0]
    assert gathered([str(small_scan.scan)], ["a"], 300)[1] == []


def test_a_photograph_is_spoken_of(small_scan):
    tags = Image.Exif()
    tags[271] = "Maker"
    tags.get_ifd(0x8769)[33434] = 0.01
    Image.open(small_scan.scan).save("photo.jpg", exif=tags, dpi=(300, 300), quality=95)
    assert "photo.jpg is a photograph: not all edges of the sheet are seen" in gathered(["photo.jpg"], ["a"])[1][0]


@pytest.mark.slow
def test_a_picture_that_does_not_say_its_resolution_gets_that_of_its_letters(small_scan):
    Image.open(small_scan.scan).convert("RGB").save("silent.png")
    (source,), _ = gathered(["silent.png"], ["a"])
    inked = page_sources._at_likely_size(find_ink(source.prepared), source.prepared, None, None)
    known = find_ink(prepare(small_scan.scan))
    assert inked.text_lines.x_height == pytest.approx(2.6, abs=0.2)
    assert len(inked.text_lines.lines) == len(known.text_lines.lines)
    assert "silent.png: nothing says its resolution" in inked.notes[0] and "give --dpi" in inked.notes[0]


@pytest.mark.parametrize(
    ("shape", "x_height", "dpi"),
    [
        ((3508, 2480), None, 300),  # A4
        ((2480, 3508), 30, 300),
        ((3508, 2480), 60, 600),  # twice as high on A4: A6
        ((3300, 2550), 28, 300),  # Letter
        ((3300, 1000), 20.5, 200),  # no sheet is so narrow: by the letters
        ((800, 600), None, 100),  # the least that can be
    ],
)
def test_the_likely_resolution_of_a_sheet(shape, x_height, dpi):
    assert likely_dpi(shape, x_height) == pytest.approx(dpi, rel=0.02)


@pytest.fixture(scope="module")
def two(small_scan, tmp_path_factory):
    """The small page and one in much paler ink, as sources."""
    pale = tmp_path_factory.mktemp("pale") / "pale.png"
    rgb = np.asarray(Image.open(small_scan.scan).convert("RGB")).astype(float)
    Image.fromarray((255 - 0.6 * (255 - rgb)).astype(np.uint8)).save(pale, dpi=(300, 300))
    return gathered([str(small_scan.scan), str(pale)], [small_scan.written] * 2)[0]


@pytest.mark.slow
def test_pages_of_a_hand_share_their_scale_of_ink(two, monkeypatch):
    scale, used = common_scale(two), []
    assert common_scale(two[:1]) is None
    assert scale.counts.sum() == pytest.approx(2)
    real = page_sources.find_ink

    def noted(*given, scale, **more):
        used.append(scale)
        return real(*given, scale=scale, **more)

    monkeypatch.setattr(page_sources, "find_ink", noted)
    said = []
    made = list(tagged_pages(two, 0, None, said.append, method=by_segments_once))
    assert [np.array_equal(one.counts, scale.counts) for one in used] == [True, True]
    assert [one.page.source for one in made] == ["page.png", "pale.png"] and "Page 2 of 2" in "".join(said)


@pytest.mark.slow
def test_a_page_scanned_upside_down_is_turned_and_that_is_said(two, small_page):
    said, source = [], replace(two[0], prepared=two[0].prepared.turn_quarters(2))
    (made,) = tagged_pages([source], 0, None, said.append, method=by_segments_once)
    assert "the page lies upside down: turned upright" in "".join(said)
    assert [glyph.letter for glyph in made.glyphs] == [glyph.letter for glyph in small_page.made.glyphs]


def test_a_text_most_of_which_is_not_there_is_refused(small_page):
    lost = replace(small_page.made, missing=(Missing(0, "a", 0),) * 40)
    with pytest.raises(
        InputError, match=r"page\.png: 40 of the 84 characters of its text are not on the page.*3 lines"
    ):
        page_sources._refuse_lost(lost, "3 lines")
    page_sources._refuse_lost(small_page.made, "3 lines")
