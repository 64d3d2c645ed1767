"""Another pen: the same line in the ink of a sample, whole and without one piece twice in a place."""

from dataclasses import replace

import numpy as np
import pytest
from scanned import ink, letters, owners, page_of, picture, whole, written

from handout.errors import InputError
from handout.hand.scanned import NOBODY, Texture
from handout.inking.pen_replacement import replace_pen, weld_graphs
from handout.inking.swatches import swatches
from handout.inking.texture import texture
from handout.values import Ink, LineGraph


def drawn(xy, closed=False):
    """A graph through places (n, 2), mm."""
    xy = np.asarray(xy, dtype=float)
    n = len(xy)
    edges = [(i, i + 1) for i in range(n - 1)] + ([(n - 1, 0)] if closed else [])
    return LineGraph(xy, np.full(n, 0.2), np.ones(n), xy * 10, np.array(edges).reshape(-1, 2))


@pytest.fixture(scope="module")
def red(small_hand):
    """The hand as though it had been written in pure red, with no letter known."""
    page = small_hand.pages[0]
    rgba = page.texture.rgba.copy()
    rgba[rgba[..., 3] > 0, :3] = (255, 0, 0)
    sheet = replace(
        page,
        graph=page.graph.take(letters(small_hand)),
        texture=Texture(page.texture.corner, page.texture.shape, lambda: rgba),
    )
    return replace(small_hand, name="red", pages=(sheet,), glyphs=())


@pytest.mark.slow
def test_the_line_is_whole_and_all_in_the_other_ink(small_hand, red):
    manuscript = replace_pen(whole(small_hand), red)
    inks = [placed.ink for line in manuscript.lines for placed in line.placed]
    assert all(one.number == NOBODY and one.source == 0 for one in inks)
    rgba = texture(manuscript, red, 300.0).rgba / 255
    shown = rgba[rgba[..., 3] > 0.1]
    assert np.allclose(shown[:, :3], (1, 0, 0), atol=0.02)
    own = letters(small_hand)
    x, y = np.rint(small_hand.pages[0].graph.uv[own]).astype(int).T
    assert (rgba[y, x, 3] > 0.25).mean() > 0.97
    near = owners(small_hand)
    was = picture(small_hand)[(near >= 0) & own[near], 3].sum() / 255
    assert rgba[..., 3].sum() == pytest.approx(was, rel=0.15), "as wide a line as before"


@pytest.mark.slow
def test_a_width_of_its_own(small_hand, red):
    usual = 2 * float(np.median(small_hand.pages[0].graph.radius))
    areas = [
        texture(replace_pen(whole(small_hand), red, width=k * usual), red, 300.0).rgba[..., 3].sum() for k in (1, 2)
    ]
    assert 1.5 < areas[1] / areas[0] < 2.3
    with pytest.raises(InputError, match=r"0\.05 to 10"):
        replace_pen(whole(small_hand), red, width=20)


def test_no_piece_is_used_twice_in_a_row(small_hand):
    pen = swatches(small_hand)[0]
    number = int(np.flatnonzero(pen.start > 3 * pen.length)[0])
    wanted = np.repeat(pen.features[[number]], 12, axis=0)
    chosen = pen.choose(wanted, np.zeros(12, dtype=bool))
    places = {(int(pen.track[i]), int(pen.start[i] // (pen.length / 2))) for i in chosen}
    assert np.allclose(pen.features[chosen[0]], wanted[0])
    assert len(places) >= 10


def test_pieces_lie_clear_of_other_lines(small_hand):
    pen, graph = swatches(small_hand)[0], small_hand.pages[0].graph
    junctions = graph.xy[graph.degree > 2]
    assert len(pen.start) > 100 and len(junctions)
    for number in range(0, len(pen.start), 37):
        track = pen.tracks[pen.track[number]]
        places = track.places(pen.start[number] + np.linspace(0, pen.length, 9))
        assert np.hypot(*(places[:, None] - junctions[None]).T).min() > 0.2


def test_dots_stay_dots(small_hand, red):
    dot = ink(small_hand, int(small_hand.numbers_of_letter("j")[0])).graph
    one = dot.take([int(np.argmax(dot.xy[:, 1]))])
    manuscript = replace_pen(written([Ink(one, 0, 0)], page_of(small_hand)), red)
    alpha = texture(manuscript, red, 600.0).rgba[..., 3] / 255
    y, x = np.nonzero(alpha > 0.25)
    centre = one.xy[0] * 600 / 25.4 - 0.5
    assert len(x) > 8 and np.hypot(x - centre[0], y - centre[1]).max() < 16


def test_too_little_to_take_a_pen_from(small_hand):
    page = small_hand.pages[0]
    few = replace(small_hand, pages=(replace(page, graph=page.graph.take(np.arange(3))),), glyphs=())
    with pytest.raises(InputError, match="too few clear pieces"):
        replace_pen(whole(small_hand), few)


def test_nothing_written(small_hand, red):
    assert replace_pen(written([], page_of(small_hand)), red).lines[0].placed == ()


def test_welding_keeps_a_common_line_once():
    x = np.arange(0, 3, 0.1)
    a = drawn(np.stack([x, 0 * x], axis=1))
    b = drawn(np.stack([x + 2.05, 0.02 + 0 * x], axis=1))
    one = weld_graphs([a, b])
    assert len(one.branches) == 1 and len(one) < len(a) + len(b) - 7
    assert float(one.lengths.sum()) == pytest.approx(4.95, abs=0.2)
    across = drawn(np.stack([0 * x + 1.5, x - 1.5], axis=1))
    assert len(weld_graphs([a, across])) == len(a) + len(across), "lines that cross are two"
    assert len(weld_graphs([a, a])) == len(a)
