"""A simulated page made into glyphs, against the truth about who every pixel belongs to."""

from dataclasses import replace

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand.vetting import vet
from handout.scanning.scan import Scan
from handout.scanning.text_lines import find_text_lines
from handout.scanning.written_page import read_page
from handout.tagging import page_tagging
from handout.tagging.alignment import align
from handout.tagging.glyph_extraction import scanned_page
from handout.tagging.page_tagging import hand_of_pages, tag_page, with_transcript_lines
from handout.tagging.segmentation import by_segments_once
from handout.writing.glyph_index import index_glyphs


def test_letters_lie_where_they_were_written(small_page):
    graph, truth = small_page.made.page.graph, small_page.simulated.truth
    at = np.rint(graph.uv).astype(int)
    labels = truth.labels[at[:, 1], at[:, 0]].astype(int) - 1
    shares = {g.at: np.mean(labels[g.vertices] == g.at) for g in small_page.made.glyphs}
    assert {glyph.at: glyph.letter for glyph in small_page.made.glyphs} == {x.at: x.text for x in truth.letters}
    assert np.mean([share > 0.5 for share in shares.values()]) > 0.9
    assert np.mean(list(shares.values())) > 0.8


def test_words_places_and_neighbours(small_page):
    glyphs = small_page.made.glyphs
    words = small_page.written.split()
    for number, text in enumerate(words):
        own = [i for i, glyph in enumerate(glyphs) if glyph.word == number]
        assert "".join(glyphs[i].letter for i in own) == text
        assert [glyphs[i].before for i in own] == [-1, *own[:-1]]
        assert [glyphs[i].after for i in own] == [*own[1:], -1]
        bare = text.rstrip(",")
        places = ["alone"] if len(bare) == 1 else ["start", *["middle"] * (len(bare) - 2), "end"]
        assert [glyphs[i].place for i in own] == places + ["alone"] * (len(text) - len(bare))
    assert [glyph.line for glyph in glyphs] == sorted(glyph.line for glyph in glyphs)


def test_joined_letters_have_ligatures(small_page):
    truth = small_page.simulated.truth
    joined = {(split.before, split.after) for split in truth.splits} if hasattr(truth.splits[0], "before") else None
    glyphs = small_page.made.glyphs
    found = [i for i, glyph in enumerate(glyphs) if glyph.ligatures]
    assert len(found) > 0.5 * sum(glyph.after >= 0 for glyph in glyphs)
    if joined is not None:
        assert np.mean([(glyphs[i].at, glyphs[glyphs[i].after].at) in joined for i in found]) > 0.9
    for i in found:
        for way in glyphs[i].ligatures:
            assert way.start[0] < way.end[0] + 0.15  # a letter that leans on the next begins under its end
            assert np.linalg.norm(way.end - way.start) < 1.0


def test_the_edge_of_the_sheet_is_nobodys(small_page):
    """The scanner sees it as a dark line, which the assignment alone gives to the last letters of lines."""
    page = small_page.made.page
    for glyph in small_page.made.glyphs:
        place = page.to_line(glyph.line, page.graph.uv[glyph.vertices])
        assert np.ptp(place[:, 0]) < 1.2 and place[:, 1].min() > -1 and place[:, 1].max() < 1.2


@pytest.mark.slow
def test_what_is_not_there_is_listed(small_page, monkeypatch):
    def without(page, transcript, **options):
        found = align(page, transcript, **options)
        line = found.lines[0]
        gone = replace(line.letters[3], present=False)
        letters = (*line.letters[:3], gone, *line.letters[4:])
        return replace(found, lines=(replace(line, letters=letters), *found.lines[1:]), poor=(2,))

    monkeypatch.setattr(page_tagging, "align", without)
    rng = np.random.default_rng(1)
    made = tag_page(small_page.read, small_page.written, rng=rng, method=by_segments_once)
    (gone,) = made.missing
    assert (gone.at, gone.letter, gone.line) == (4, "v", 0)
    assert "v (line 1)" in made.notes[-1] and "line 3" in made.notes[-2]
    e, following = made.glyphs[2], made.glyphs[3]
    assert (e.letter, e.after, e.place) == ("e", -1, "start") and (following.before, following.place) == (-1, "middle")
    assert all(glyph.confidence <= 0.25 for glyph in made.glyphs if glyph.line == 2)
    assert made.poor == (2,)


@pytest.mark.slow
def test_a_transcript_of_the_wrong_case_is_said_and_its_letters_are_not_written(small_page):
    wrong = small_page.written.replace("minute hens", "minute henS", 1)
    assert wrong != small_page.written and small_page.made.cases == ()
    made = tag_page(small_page.read, wrong, rng=np.random.default_rng(1), method=by_segments_once)
    assert [made.glyphs[i].letter for i in made.cases] == ["S"]
    assert any("not of the case that the transcript has: S in “henS” (line 2)" in note for note in made.notes)
    assert vet(hand_of_pages("small", [made])).refused[list(made.cases)].all()
    # a large s inside words is the same fault, seen from the other side
    glyphs, tall = (
        list(small_page.made.glyphs),
        next(i for i, g in enumerate(small_page.made.glyphs) if g.letter == "l"),
    )
    glyphs[tall] = replace(glyphs[tall], letter="s")
    index = index_glyphs(hand_of_pages("small", [replace(small_page.made, glyphs=tuple(glyphs))]))
    assert tall not in index.all_candidates("s", "middle").numbers and len(index.all_candidates("s", "middle").numbers)


def test_struck_out_words_are_no_letters(small_page):
    text = small_page.written.replace("minute", "~~minute~~")
    made = tag_page(small_page.read, text, rng=np.random.default_rng(1), method=by_segments_once)
    assert "".join(glyph.letter for glyph in made.glyphs) == small_page.written.replace("minute", "").replace(
        " ", ""
    ).replace("\n", "")
    assert not made.missing


@pytest.mark.slow
def test_lines_are_counted_by_the_text_only_where_that_fits(small_page):
    page, rng = small_page.read, np.random.default_rng(1)
    assert with_transcript_lines(page, small_page.written, rng) is page
    in_one = small_page.written.replace("\n", " ")
    assert with_transcript_lines(page, in_one, rng) is page
    wrong = replace(page, text_lines=find_text_lines(page.mask.ink, page.scan.dpi, 2))
    assert len(with_transcript_lines(wrong, small_page.written, rng).text_lines.lines) == 3


@pytest.mark.slow
def test_places_are_those_of_the_file_where_a_border_was_cut_off(small_page):
    scan = small_page.read.scan
    wide = Scan(np.pad(scan.rgb, ((40, 30), (70, 20), (0, 0))), scan.dpi, "wide")
    read = read_page(wide)
    page, bare = scanned_page(read, small_page.written), small_page.made.page
    assert read.scan.origin[0] > 30 and read.scan.origin[1] > 20
    assert page.baselines[:, 0] - bare.baselines[:, 0] == pytest.approx(40, abs=3)
    x, y = page.texture.corner
    dark = page.texture.rgba[:, :, 3] > 200
    ink = wide.rgb[y : y + dark.shape[0], x : x + dark.shape[1]].mean(axis=2)
    assert ink[dark].mean() < 150 < ink[~dark].mean()


def test_pages_are_numbered_on(small_page):
    hand = hand_of_pages("two", [small_page.made, small_page.made])
    half = len(hand.glyphs) // 2
    assert [glyph.page for glyph in hand.glyphs] == [0] * half + [1] * half
    for one, two in zip(hand.glyphs[:half], hand.glyphs[half:], strict=True):
        assert two.after == (one.after + half if one.after >= 0 else -1)
    with pytest.raises(InputError, match="no letter"):
        hand_of_pages("none", [replace(small_page.made, glyphs=())])


def test_letters_that_hold_ink_of_another_line_are_named(small_hand):
    number = next(i for i, glyph in enumerate(small_hand.glyphs) if glyph.letter)
    glyph = small_hand.glyphs[number]
    (note,) = page_tagging._odd_notes(small_hand.pages[0], small_hand.glyphs, ((), (number,), (), ()))
    assert f"ink of the line above or below: {glyph.letter} in “" in note and f"(line {glyph.line + 1})" in note
    assert page_tagging._odd_notes(small_hand.pages[0], small_hand.glyphs, ((), (), (), ())) == []
