"""Scanned ink where it is written: what is only moved stays as it was, what is turned and bent stays whole."""

import gc
from dataclasses import replace
from weakref import ref

import numpy as np
import pytest
from scanned import ink, letters, owners, page_of, picture, whole, written
from scipy.spatial import cKDTree

from handout.errors import InputError
from handout.inking.papers import lay_ink
from handout.inking.source import source_of
from handout.inking.texture import texture
from handout.inking.warping import warp
from handout.values import Ink, Line, LineGraph, Page

DPI = 300.0


def covered(rgba):
    """Premultiplied, 0–1."""
    rgba = rgba / 255 if rgba.dtype == np.uint8 else rgba
    return np.concatenate([rgba[..., :3] * rgba[..., 3:], rgba[..., 3:]], axis=2)


def bytes_of(raster):
    return raster.rgba.astype(int)


def test_a_page_written_with_its_own_glyphs_is_the_page(small_hand):
    made, real = bytes_of(texture(whole(small_hand), small_hand, DPI)), picture(small_hand).astype(int)
    assert made.shape == real.shape
    off = np.abs(made - real).max(axis=2) > 0
    near = owners(small_hand)
    own = (near >= 0) & letters(small_hand)[near]
    assert own.sum() > 20_000
    assert off[own].sum() < 2e-3 * own.sum()
    assert (made[..., 3] <= real[..., 3]).all(), "no ink from nowhere"


def test_whole_pixels_further_the_ink_is_the_same(small_hand):
    pixel = small_hand.pages[0].pixel
    still = bytes_of(texture(whole(small_hand), small_hand, DPI))
    moved = bytes_of(texture(whole(small_hand, lambda xy: xy + np.array([11, -7]) * pixel), small_hand, DPI))
    assert np.array_equal(moved[:-7, 11:], still[7:, :-11])


def test_dots_and_marks_come_along_and_other_letters_do_not(small_hand):
    number = int(small_hand.numbers_of_letter("j")[0])
    glyph, page = small_hand.glyphs[number], small_hand.pages[0]
    made = bytes_of(texture(written([ink(small_hand, number)], page_of(small_hand)), small_hand, DPI))
    real = picture(small_hand).astype(int)
    graph, own = page.graph, np.zeros(len(page.graph), dtype=bool)
    own[glyph.vertices] = True
    for way in small_hand.glyphs[glyph.before].ligatures if glyph.before >= 0 else ():
        own[way.path] = True
    for way in glyph.ligatures:
        own[way.path] = True
    assert len(np.unique(graph.components[own])) > 1, "this j has a dot of its own"
    near = owners(small_hand)
    mine = (near >= 0) & own[near]
    assert (made == real).all(axis=2)[mine].mean() > 0.995
    assert (made[..., 3] > 0)[~mine].sum() < 0.15 * mine.sum(), "only what is at its own ends"


def test_lines_of_other_letters_stay_where_they_are(small_hand):
    graph, real = small_hand.pages[0].graph, picture(small_hand)
    near, beside, taken = owners(small_hand), 0, 0
    for number in (*small_hand.numbers_of_letter("e"), *small_hand.numbers_of_letter("n")):
        one = ink(small_hand, int(number))
        made = bytes_of(texture(written([one], page_of(small_hand)), small_hand, DPI))
        away, vertex = cKDTree(one.graph.uv).query(np.argwhere(real[..., 3] > 0)[:, ::-1])
        distance = np.full(near.shape, np.inf)
        distance[real[..., 3] > 0] = away - 300 / 25.4 * one.graph.radius[vertex]
        others = (near >= 0) & (cKDTree(one.graph.uv).query(graph.uv)[0] > 0.5)[near]
        strange = others & (distance > 2) & (distance < 5)
        beside, taken = beside + int(real[strange][:, 3].sum()), taken + int(made[strange][:, 3].sum())
    assert beside > 50 * 255, "there was ink within the margin"
    assert taken < 0.02 * beside


def test_a_quarter_turn_is_a_quarter_turn(small_hand):
    pixel, number = small_hand.pages[0].pixel, int(small_hand.numbers_of_letter("n")[0])
    own = ink(small_hand, number).graph
    low = np.floor(own.xy.min(axis=0) / pixel) * pixel - 20 * pixel
    side = 120 * pixel
    upright = texture(written([ink(small_hand, number, lambda xy: xy - low)], Page(side, side)), small_hand, DPI)
    turned = texture(
        written([ink(small_hand, number, lambda xy: np.stack([side - (xy - low)[:, 1], (xy - low)[:, 0]], axis=1))],
                Page(side, side)),
        small_hand, DPI,
    )  # fmt: skip
    assert upright.rgba[..., 3].sum() > 100 * 255
    assert np.abs(covered(turned.rgba) - covered(np.rot90(upright.rgba, -1))).max() < 2 / 255


@pytest.mark.parametrize("larger", [1.15, 0.8])
def test_turned_and_scaled_ink_is_whole(small_hand, larger):
    number = int(small_hand.numbers_of_letter("m")[0])
    middle = ink(small_hand, number).graph.xy.mean(axis=0)
    turn = larger * np.array([[np.cos(0.2), np.sin(0.2)], [-np.sin(0.2), np.cos(0.2)]])
    here = ink(small_hand, number, lambda xy: (xy - middle) @ turn + 10, larger)
    there = ink(small_hand, number, lambda xy: xy - middle + 10)
    new, old = (texture(written([one], Page(20, 20)), small_hand, 600).rgba / 255 for one in (here, there))
    assert new[..., 3].sum() == pytest.approx(larger**2 * old[..., 3].sum(), rel=0.03)
    weights = [np.average(rgba[..., :3].reshape(-1, 3), axis=0, weights=rgba[..., 3].ravel()) for rgba in (new, old)]
    assert weights[0] == pytest.approx(weights[1], abs=0.01)


def test_bent_ink_follows_its_line(small_hand):
    def bend(xy):
        return xy + np.stack([0.3 * np.sin(xy[:, 1]), 0.5 * np.sin(0.8 * xy[:, 0])], axis=1)

    raster = texture(whole(small_hand, bend), small_hand, 600)
    graph = small_hand.pages[0].graph
    own = letters(small_hand)
    x, y = np.rint(bend(graph.xy[own]) * 600 / 25.4 - 0.5).astype(int).T
    alpha = raster.rgba[..., 3] / 255
    was = picture(small_hand)[tuple(np.rint(graph.uv[own]).astype(int).T[::-1])][:, 3] / 255
    assert np.abs(alpha[y, x] - was).mean() < 0.06
    near = owners(small_hand)
    mine = (near >= 0) & own[near]
    assert alpha.sum() / 4 == pytest.approx(picture(small_hand)[mine, 3].sum() / 255, rel=0.1)


@pytest.mark.slow
def test_other_resolutions_are_averages(small_hand):
    manuscript = whole(small_hand)
    real = picture(small_hand).astype(np.float32) / 255
    near = owners(small_hand)
    real[(near < 0) | ~letters(small_hand)[near]] = 0
    real = covered(real)
    coarse = covered(texture(manuscript, small_hand, 100.0).rgba)
    h, w = (3 * (side // 3) for side in real.shape[:2])
    mean = real[:h, :w].reshape(h // 3, 3, w // 3, 3, 4).mean(axis=(1, 3))
    assert np.abs(coarse[: h // 3, : w // 3] - mean).mean() < 2e-3
    fine = covered(texture(manuscript, small_hand, 600.0).rgba)
    h, w = real.shape[:2]
    halved = fine[: 2 * h, : 2 * w].reshape(h, 2, w, 2, 4).mean(axis=(1, 3))
    assert np.abs(halved - real).mean() < 4e-3
    assert fine.max() <= real.max() + 1e-6, "no ringing"


@pytest.mark.slow
def test_nothing_but_ink_is_touched(small_hand):
    raster = texture(whole(small_hand), small_hand, 150.0)
    assert not raster.rgba[raster.rgba[..., 3] == 0].any()
    empty = texture(written([], Page(30, 20)), small_hand, 150.0)
    assert not texture(replace(written([], Page(10, 10)), lines=(Line("", (), 5.0),)), small_hand, 600.0).rgba.any()
    assert empty.rgba.shape == (118, 177, 4) and not empty.rgba.any()
    away = texture(whole(small_hand, lambda xy: xy + 500), small_hand, 150.0)
    assert not away.rgba.any()
    edge = texture(whole(small_hand, lambda xy: xy - [20, 12]), small_hand, DPI)
    still = texture(whole(small_hand), small_hand, DPI)
    pixel = 25.4 / DPI
    assert edge.rgba[..., 3].sum() < still.rgba[..., 3].sum() and edge.rgba[:60, :60, 3].any() and pixel > 0


@pytest.mark.slow
def test_a_page_that_is_made_again_is_the_same_and_only_what_changed_is_drawn(small_hand, monkeypatch):
    """At resolutions of screens, where a page is made anew while its text is typed."""
    from handout.inking import texture as module

    inks, drawn = [ink(small_hand, number) for number in range(12)], []
    monkeypatch.setattr(
        module,
        "warp",
        lambda new, *rest, **margin: drawn.extend(one.number for one in new) or warp(new, *rest, **margin),
    )
    module._kept.clear()
    page = page_of(small_hand)
    before = texture(written(inks[:9], page), small_hand, 100.0)
    again = texture(written([*inks[:4], ink(small_hand, 4, lambda xy: xy + 0.5), *inks[5:]], page), small_hand, 100.0)
    assert drawn == [*range(9), 4, 9, 10, 11]
    module._kept.clear()
    assert np.array_equal(texture(written(inks[:9], page), small_hand, 100.0).rgba, before.rgba)
    fresh = texture(written([*inks[:4], ink(small_hand, 4, lambda xy: xy + 0.5), *inks[5:]], page), small_hand, 100.0)
    assert np.array_equal(again.rgba, fresh.rgba) and not np.array_equal(again.rgba, before.rgba)
    source = ref(source_of(small_hand.pages[0]))
    source_of.cache_clear()
    gc.collect()
    assert source() is None  # a hand that is read again would keep the pictures of its pages as often


def test_a_lone_vertex_is_a_dot(small_hand):
    page = small_hand.pages[0]
    at = int(page.graph.radius.argmax())
    one = page.graph.take([at])
    raster = texture(written([Ink(one, 0, 0)], page_of(small_hand)), small_hand, DPI)
    x, y = np.rint(page.graph.uv[at]).astype(int)
    assert raster.rgba[y, x, 3] == picture(small_hand)[y, x, 3]
    empty = LineGraph(np.zeros((0, 2)), [], [], np.zeros((0, 2)), np.zeros((0, 2)))
    assert not texture(written([Ink(empty, 0, 0)], Page(10, 10)), small_hand, DPI).rgba.any()


def test_what_cannot_be(small_hand):
    with pytest.raises(InputError, match="20 to 4800"):
        texture(whole(small_hand), small_hand, 10)
    with pytest.raises(InputError, match="gigapixels"):
        texture(written([], Page(2000, 2000)), small_hand, 4800)
    wrong = replace(ink(small_hand, 0), source=3)
    with pytest.raises(InputError, match="page 3 of a hand of 1"):
        texture(written([wrong], Page(100, 100)), small_hand, DPI)


def test_laid_on_paper(small_hand):
    raster = texture(whole(small_hand), small_hand, DPI)
    white = lay_ink(raster)
    ground = np.full_like(white, 200)
    ground[::2] = 100
    seen = lay_ink(raster, ground)
    assert np.abs(seen - white / 255.0 * ground).max() <= 0.51
    assert np.array_equal(seen[raster.rgba[..., 3] == 0], ground[raster.rgba[..., 3] == 0])
    assert (ground[::2] == 100).all(), "the paper itself is left as it was"
