"""Scanned hands: line space, centres, bodies, and what may not be put together."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.hand.report import contact_sheet, cutout, overlay
from handout.hand.scanned import Texture


def test_counts_and_numbers(small_hand):
    hand = small_hand
    assert sum(hand.letters.values()) == len(hand.glyphs) == sum(hand.instances.values())
    assert [hand.glyphs[i].letter for i in hand.numbers_of_letter("e")] == ["e"] * hand.letters["e"]
    assert (
        list(hand.numbers_of_letter("e")) == sorted(hand.numbers_of_letter("e"))
        and len(hand.numbers_of_letter("Q")) == 0
    )
    assert list(hand.letters.values()) == sorted(hand.letters.values(), reverse=True)
    assert hand.instances["a", "start"] == 2  # an, and


def test_line_space_has_the_pitch_as_its_unit(small_hand):
    page = small_hand.pages[0]
    assert len(page.baselines) == 3
    x = 300.0
    heights = [float(page.base(line, x)) for line in range(3)]
    assert np.diff(heights) == pytest.approx(page.unit, rel=0.08)
    feet = page.to_line(1, [[x, heights[1]], [x + page.unit, float(page.base(1, x + page.unit)) - page.unit / 2]])
    assert feet[:, 1] == pytest.approx([0, 0.5])
    assert feet[1, 0] - feet[0, 0] == pytest.approx(1)
    # small letters stand on the line and are an x-height tall
    small = [small_hand.outline(number)[:, 1] for letter in "aenouv" for number in small_hand.numbers_of_letter(letter)]
    assert abs(np.median([y.min() for y in small])) < 0.05
    assert np.median([y.max() for y in small]) == pytest.approx(page.x_height / page.pitch, abs=0.05)


@settings(max_examples=40, deadline=None)
@given(st.floats(-3000, 3000), st.floats(-3000, 3000), st.integers(0, 2))
def test_line_space_and_back(small_hand, x, y, line):
    page = small_hand.pages[0]
    assert np.allclose(page.to_picture(line, page.to_line(line, [x, y])), [[x, y]], atol=1e-6)


def test_the_centre_weighs_ink_above_the_line_and_between_the_neighbours(small_hand):
    hand = small_hand
    for number in (*hand.numbers_of_letter("j"), *hand.numbers_of_letter("p"), *hand.numbers_of_letter("n")):
        glyph = hand.glyphs[number]
        graph = hand.pages[0].graph
        total, mass = np.zeros(2), 0.0
        low = hand.outline(glyph.before)[:, 0].min() if glyph.before >= 0 else -np.inf
        high = hand.outline(glyph.after)[:, 0].max() if glyph.after >= 0 else np.inf
        for vertex, (x, y) in zip(glyph.vertices, hand.outline(number), strict=True):
            if y >= 0 and low <= x <= high:
                weight = graph.density[vertex] * graph.radius[vertex] ** 2
                total += weight * np.array([x, y])
                mass += weight
        assert hand.centre(number) == pytest.approx(total / mass, abs=1e-6)


@pytest.mark.slow
def test_a_body_is_a_glyph_without_its_ligatures(small_hand):
    hand = small_hand
    joined = [i for i, glyph in enumerate(hand.glyphs) if glyph.ligatures]
    assert joined
    for i in joined:
        glyph, following = hand.glyphs[i], hand.glyphs[hand.glyphs[i].after]
        for way in glyph.ligatures:
            ends = set(way.path[[0, -1]].tolist())
            assert way.path[0] in glyph.vertices and way.path[-1] in following.vertices
            inner = set(way.path.tolist()) - ends
            assert not inner & set(hand.body(i).tolist()) and not inner & set(hand.body(glyph.after).tolist())
            page = hand.pages[0]
            assert way.start == pytest.approx(page.to_line(glyph.line, page.graph.uv[way.path[0]])[0])
            edges = {frozenset(edge) for edge in page.graph.edges.tolist()}
            assert all(frozenset(step) in edges for step in pairwise(way.path.tolist()))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"page": 1}, "page 1 of 1"),
        ({"line": 3}, "line 3 of 3"),
        ({"vertices": np.array([10**7])}, "vertex outside"),
        ({"before": 10**6}, "which there is not"),
        ({"after": 20}, "which is elsewhere"),
    ],
)
def test_what_is_not_there_cannot_be_named(small_hand, change, says):
    wrong = replace(small_hand.glyphs[0], **({"ligatures": ()} | change))
    with pytest.raises(ValueError, match=says):
        replace(small_hand, glyphs=(wrong, *small_hand.glyphs[1:]))


def test_arrays_are_read_only(small_hand):
    page, glyph = small_hand.pages[0], small_hand.glyphs[0]
    for array in (page.baselines, page.paper, page.texture.rgba, glyph.vertices, small_hand.body(0)):
        with pytest.raises(ValueError):
            array[0] = 0
    with pytest.raises(ValueError, match="of uint8"):
        _ = Texture((0, 0), (3, 3), lambda: np.zeros((2, 2, 4), np.uint8)).rgba


def test_pictures_show_the_ink(small_hand, small_scan):
    from PIL import Image

    page = small_hand.pages[0]
    scan = np.asarray(Image.open(small_scan.scan).convert("RGB"))
    off = np.abs(page.on_paper().astype(int) - scan).mean()
    assert off < 3, "ink on reduced paper is the scan again"
    assert overlay(small_hand, 0).shape == scan.shape
    number = int(small_hand.numbers_of_letter("j")[0])
    ink, (x, y) = cutout(small_hand, number)
    low, high = (f(page.graph.uv[small_hand.glyphs[number].vertices], axis=0) for f in (np.min, np.max))
    assert (np.array([x, y]) <= low).all() and (np.array([x, y]) + ink.shape[1::-1] >= high).all()
    assert (ink[:, :, 3] > 128).sum() > len(small_hand.glyphs[number].vertices)
    sheet = contact_sheet(small_hand)
    assert sheet.shape[1] == 1600 and sheet.min() < 120
