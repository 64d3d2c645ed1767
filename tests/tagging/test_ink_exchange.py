"""Ink that was given to the wrong neighbour comes back; what no letter had stays nobody's."""

from dataclasses import replace

import numpy as np
import pytest

from handout.hand.ligatures import find_again
from handout.motion.recovery.crossbars import WordCrossbars
from handout.reading import pictures
from handout.tagging.ink_exchange import NOBODY, SETTINGS, InkExchange, exchange_ink


@pytest.fixture(scope="module")
def shared(small_hand):
    letter = np.full(len(small_hand.pages[0].graph), NOBODY)
    for number, glyph in enumerate(small_hand.glyphs):
        letter[glyph.vertices] = number
    names = [glyph.letter for glyph in small_hand.glyphs]
    return small_hand.pages[0], letter, names, np.array([glyph.line for glyph in small_hand.glyphs])


@pytest.mark.parametrize("known", [True, False])
def test_a_stem_that_its_neighbour_took_comes_back(shared, small_hand, known):
    sheet, letter, names, lines = shared
    giver = next(
        i
        for i in small_hand.numbers_of_letter("n").tolist()
        if min(small_hand.glyphs[i].before, small_hand.glyphs[i].after) >= 0
    )
    held = frozenset({small_hand.glyphs[giver].after}) if known else frozenset()
    settled = InkExchange(sheet, letter, names, lines, pictures.load(), held)
    settled.settle()
    taken = settled.letter.copy()
    own = np.flatnonzero(taken == giver)
    x = sheet.graph.uv[own, 0]
    lost = own[x < np.median(x)]
    taken[lost] = small_hand.glyphs[giver].before
    exchange = InkExchange(sheet, taken, names, lines, pictures.load(), held)
    assert exchange.settle() > 0
    assert (exchange.letter[lost] == giver).mean() > 0.5


def test_most_stems_come_back_to_letters_that_do_not_touch_them(shared, small_hand):
    sheet, letter, names, lines = shared
    back = []
    for dotted in small_hand.numbers_of_letter("i").tolist():
        if small_hand.glyphs[dotted].before < 0:
            continue
        own = np.flatnonzero(letter == dotted)
        height = small_hand.outline(dotted)[:, 1] * sheet.pitch / sheet.x_height
        stem = own[height < 1.2]
        assert 0 < len(stem) < len(own)
        taken = letter.copy()
        taken[stem] = small_hand.glyphs[dotted].before
        exchange = InkExchange(sheet, taken, names, lines, pictures.load())
        exchange.settle()
        back.append((exchange.letter[stem] == dotted).mean() > 0.5)
    assert len(back) > 1 and np.mean(back) > 0.5


def test_nothing_is_lost_and_each_letter_keeps_its_share(shared):
    sheet, letter, names, lines = shared
    held = frozenset(range(0, len(names), 3))
    exchange = InkExchange(sheet, letter, names, lines, pictures.load(), held)
    exchange.settle()
    assert all(np.array_equal(exchange.letter == i, letter == i) for i in held)
    assert np.array_equal(exchange.letter == NOBODY, letter == NOBODY)
    kept = np.bincount(exchange.letter[exchange.letter >= 0], minlength=len(names))
    assert (kept > 0).all()
    again = InkExchange(sheet, letter, names, lines, pictures.load(), held)
    again.settle()
    assert np.array_equal(again.letter, exchange.letter)


def test_a_page_settles(shared):
    sheet, letter, names, lines = shared
    for _ in range(4):  # what siblings look like changes with each exchange
        exchange = InkExchange(sheet, letter, names, lines, pictures.load())
        letter = exchange.letter if exchange.settle() else letter
        if letter is not exchange.letter:
            break
    assert letter is not exchange.letter


def test_a_page_of_few_letters_is_left_alone(shared, small_page):
    from handout.tagging.alignment import Alignment

    sheet, letter, _, _ = shared
    assert len(letter) and SETTINGS.least > 44
    assert exchange_ink(sheet, Alignment(()), letter)[0] is letter


def test_the_end_of_a_crossbar_comes_back_and_where_it_crosses_ink_is_both_letters(shared, small_hand):
    sheet, letter, names, lines = shared
    ways = {n: [way.path for way in glyph.ligatures] for n, glyph in enumerate(small_hand.glyphs)}
    found = WordCrossbars(small_hand, ways)
    bars = [bar for n in range(len(names)) for bar in found[n] if bar.glyph == n]
    bar = next(b for b in bars if b.loose[1] and small_hand.glyphs[b.glyph].after == b.glyph + 1)
    own, other, end = bar.glyph, bar.glyph + 1, bar.vertices[len(bar.vertices) // 8 :]
    # the end of the bar is the next letter's; so is, then, the stem that the bar crosses
    taken = letter.copy()
    taken[end] = other
    crossed = np.where(np.isin(letter, own) & ~np.isin(np.arange(len(letter)), bar.vertices), other, taken)
    for before, crosses in ((taken, False), (crossed, True)):
        exchange = InkExchange(sheet, before, names, lines, pictures.load())
        exchange.give_crossbars([(own, bar)])
        both = exchange.crossings[own]
        assert (len(both) > 0) == crosses and (exchange.letter[both] == other).all()
        assert (exchange.letter[np.setdiff1d(end, both)] == own).all()
        assert np.array_equal(exchange.letter != before, np.isin(np.arange(len(letter)), np.setdiff1d(end, both)))
    held = InkExchange(sheet, taken, names, lines, pictures.load(), frozenset({own}))
    held.give_crossbars([(own, bar)])
    assert np.array_equal(held.letter, taken)


def test_nothing_leads_to_a_letter_from_where_a_bar_crosses_it(small_hand):
    glyphs = list(small_hand.glyphs)
    number = next(n for n, glyph in enumerate(glyphs) if len(glyph.ligatures) == 1)
    assert len(find_again(glyphs, small_hand.pages, {number})[number].ligatures) == 1
    both = np.union1d(glyphs[number].vertices, glyphs[number].ligatures[0].path)
    glyphs[number] = replace(glyphs[number], vertices=both)
    assert not find_again(glyphs, small_hand.pages, {number})[number].ligatures
