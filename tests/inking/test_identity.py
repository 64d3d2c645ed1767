"""Text that was in the source, written again without variation, is the source's own pixels."""

from itertools import pairwise

import numpy as np
import pytest
from scanned import owners, picture

from handout.inking.texture import shift, snap_to_pixels, texture
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.layout import Layout

DPI = 300.0


def written_word(hand, word, jitter):
    """Its inks, and the bytes of the page they make."""
    layout = Layout(page("90x50mm"), (6.0, 6.0, 6.0, 6.0), x_height=hand.x_height, align="left", jitter=jitter)
    manuscript = compose(word, hand, layout, np.random.default_rng(3))[0]
    inks = [placed.ink for line in manuscript.lines for placed in line.placed]
    return inks, texture(manuscript, hand, DPI).rgba.astype(int)


def only_moved(inks):
    moves = np.concatenate([shift(ink, DPI) for ink in snap_to_pixels(inks, DPI)])
    return np.ptp(moves, axis=0).max() < 1e-6


def changed(hand, near, inks, made):
    """(n,) bool: whether each pixel of a word's ink in the source is another where the word is written."""
    x, y = np.rint(np.median(np.concatenate([shift(ink, DPI) for ink in inks]), axis=0)).astype(int)
    own = np.zeros(len(hand.pages[0].graph), dtype=bool)
    own[np.concatenate([hand.glyphs[ink.number].vertices for ink in inks])] = True
    rows, columns = np.nonzero((near >= 0) & own[near])
    return (made[rows + y, columns + x] != picture(hand)[rows, columns]).any(axis=1)


@pytest.mark.slow
def test_words_of_the_source_come_back_pixel_for_pixel(small_page, small_hand):
    near, exact = owners(small_hand), 0
    for word in dict.fromkeys(small_page.written.replace(",", "").split()):
        inks, made = written_word(small_hand, word, 0.0)
        if any(small_hand.glyphs[a.number].after != b.number for a, b in pairwise(inks)) or not only_moved(inks):
            continue  # other glyphs than the word's own were chosen, or the author's line was far from level
        off = changed(small_hand, near, inks, made)
        assert len(off) > 500
        # one pixel may lie between the letter and another line of writing
        assert off.sum() <= 1, word
        exact += not off.any()
    assert exact >= 3


def test_with_variation_they_do_not(small_hand):
    inks, made = written_word(small_hand, "minute", 1.0)
    assert changed(small_hand, owners(small_hand), inks, made).mean() > 0.2


def test_a_word_settles_on_whole_pixels_all_of_it_or_none(small_hand):
    settled = 0
    for word in ("an", "line", "this", "of", "ten", "hens", "and", "it", "jumped", "off"):
        inks, _ = written_word(small_hand, word, 0.0)
        if snap_to_pixels(inks, DPI) == inks:
            continue  # the author's line was far from level there
        after = np.concatenate([shift(ink, DPI) for ink in snap_to_pixels(inks, DPI)])
        assert after == pytest.approx(np.rint(after[0]) + np.zeros_like(after), abs=1e-6), word
        before = np.concatenate([shift(ink, DPI) for ink in inks])
        assert np.abs(after - before).max() < 1.25
        assert snap_to_pixels(inks, 2 * DPI) == inks, "at another resolution there are no pixels to be kept"
        settled += 1
    assert settled >= 3
    bent, _ = written_word(small_hand, "even", 1.0)
    assert snap_to_pixels(bent, DPI) == bent
    assert snap_to_pixels([], DPI) == []
