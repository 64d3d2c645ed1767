"""What setting knows of a hand: how far its ink goes, and that pages of other sizes make no difference."""

import gc
from dataclasses import replace
from weakref import ref

import numpy as np
import pytest

from handout.hand.scanned import ScannedHand
from handout.values import LineGraph
from handout.writing.bending import unbent
from handout.writing.variation import Chances
from handout.writing.word_layout import layout_model
from tests.writing.lines_of_glyphs import bent, gaps, heights, set_line


def test_reach_is_the_ink_on_both_sides(small_hand, small_manner):
    page = small_hand.pages[0]
    for number, glyph in enumerate(small_hand.glyphs):
        x = small_hand.outline(number)[:, 0] - small_manner.forms.centre[number, 0]
        radius = page.graph.radius[glyph.vertices] / page.pitch
        left, right = small_manner.reach(np.array([number]), [unbent()])[0]
        form = small_manner.forms[number]
        # what of a connector turns back towards the line is left out, as the beginning of the next letter
        assert (x - radius).min() - 1e-9 <= left <= (form.xy[:, 0] - form.radius).min()
        assert (x + radius).max() + 1e-9 >= right >= (form.xy[:, 0] + form.radius).max()


def at_twice_the_size(page):
    """The same page as if it had been scanned at half the resolution from a sheet of twice the size."""
    graph = page.graph
    larger = LineGraph(graph.xy * 2, graph.radius * 2, graph.density, graph.uv, graph.edges)
    return replace(page, graph=larger, dpi=page.dpi / 2, pitch=page.pitch * 2, x_height=page.x_height * 2)


@pytest.fixture(scope="module")
def two_pages(small_hand):
    count = len(small_hand.glyphs)
    moved = [
        replace(
            glyph,
            page=1,
            before=glyph.before + count if glyph.before >= 0 else -1,
            after=glyph.after + count if glyph.after >= 0 else -1,
        )
        for glyph in small_hand.glyphs
    ]
    pages = (small_hand.pages[0], at_twice_the_size(small_hand.pages[0]))
    return layout_model(ScannedHand("two", "Two pages", pages, (*small_hand.glyphs, *moved)))


def test_pages_of_two_sizes_are_one_hand(small_hand, two_pages):
    count = len(small_hand.glyphs)
    for number in range(count):
        one, other = two_pages.forms[number], two_pages.forms[number + count]
        assert np.allclose(one.xy, other.xy) and np.allclose(one.radius, other.radius)
        assert np.array_equal(one.edges, other.edges) and len(one.exits) == len(other.exits)
    assert np.allclose(two_pages.spread.size[:count], two_pages.spread.size[count:])
    assert (two_pages.neighbours.after[:count] < count).all()


def test_the_page_a_glyph_is_from_makes_no_difference(small_hand, two_pages):
    count, rng = len(small_hand.glyphs), np.random.default_rng(2)
    numbers = rng.permutation(count)[:24]
    mixed = numbers + count * (np.arange(24) % 2)
    new_word = np.arange(24) % 4 == 0
    lines = []
    for glyphs in (numbers, mixed):
        dx = gaps(two_pages, glyphs, new_word, rng, variation=0)
        x, y = np.concatenate([[0], np.cumsum(dx)]), two_pages.heights.height[glyphs]
        lines.append(set_line(two_pages, glyphs, x, y, new_word, bent(two_pages, glyphs, rng, variation=0)))
        assert heights(two_pages, glyphs, new_word, rng, variation=0) == pytest.approx(y, abs=0.3)
    for one, other in zip(*lines, strict=True):
        assert np.allclose(one.xy, other.xy) and np.allclose(one.radius, other.radius)
        assert np.array_equal(one.edges, other.edges)


def test_a_page_of_lent_letters_teaches_no_gaps_between_words(two_pages, small_hand):
    """It has no transcript: its letters lie far apart, as nobody's words do."""
    hand, count = two_pages.forms.hand, len(small_hand.glyphs)
    pages = (hand.pages[0], replace(hand.pages[1], transcript=""))
    model = layout_model(ScannedHand("lent", "With lent letters", pages, hand.glyphs))
    assert len(two_pages.neighbours.pairs(parted=True)) == 2 * len(model.neighbours.pairs(parted=True))
    assert (model.neighbours.pairs(parted=True) < count).all()


@pytest.mark.slow
def test_bends_that_are_kept_do_not_keep_a_hand(small_manner):
    own = replace(small_manner)
    own.bends(np.arange(3), Chances.draw(np.random.default_rng(1), 3))
    gone = ref(own)
    del own
    gc.collect()
    assert gone() is None  # a hand that is read again would stay in memory as often, with its pages
