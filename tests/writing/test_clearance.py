"""The room between letters, in words of many seeds: signs keep off, bars strike nothing through, dots stay clear."""

from types import SimpleNamespace

import numpy as np
import pytest

from handout.hand.library import load
from handout.values import Glyph
from handout.writing.drawn_words import bound_bars, clear_dots, is_bar
from handout.writing.text import paragraphs_of
from tests.writing.lines_of_glyphs import drawn_units

HANDS = ("house-joined", "house-quick", "house-print")
SEEDS = 20
SIGNED = ("lovelace+news@example.org", "a=b", "R&D", "50%", "3+4", "x~y", "e<f>g", "#7", "d@t", "5×8", "©2026")
DOTTED = (
    "will",
    "wait",
    "until",
    "join",
    "killed",
    "bird",
    "with",
    "built",
    "fib",
    "skit",
    "fjord",
    "dij",
    "ijk",
    "élan",
)
BARRED = ("boot.", "but", "it.", "to", "left", "that's", "not", "lot", "(it)", "at,", "part", "off", "soft", "root")


def words(name, texts, seeds):
    hand = load(name)
    for seed in range(seeds):
        (pieces,) = paragraphs_of(" ".join(texts), hand.repertoire)
        for text, unit in zip(texts, drawn_units(hand, pieces, seed), strict=True):
            placed = unit.word.glyphs
            glyphs, strokes = [each.glyph for each in placed], [each.strokes for each in placed]
            yield text, SimpleNamespace(glyphs=glyphs, strokes=strokes, spelt=unit.word.spelt)


def evenly(stroke):
    at = np.linspace(0, len(stroke) - 1, 10 * len(stroke))
    return np.column_stack([np.interp(at, np.arange(len(stroke)), axis) for axis in stroke.T])


def apart(one, other):
    """Least distance of two sets of strokes, x-heights."""
    a, b = (np.vstack([evenly(s) for s in strokes]) for strokes in (one, other))
    return float(np.sqrt(((a[:, None] - b) ** 2).sum(axis=2)).min())


@pytest.mark.slow
@pytest.mark.parametrize("name", HANDS)
def test_signs_keep_clear_of_their_neighbours(name):
    found = []
    for text, word in words(name, SIGNED, 8):
        for i in range(len(word.glyphs) - 1):
            letters = word.glyphs[i].letter + word.glyphs[i + 1].letter
            if not letters.isalnum() and not set(letters) & set(".,'"):
                found.append((apart(word.strokes[i], word.strokes[i + 1]), text, letters))
    nearest = sorted(found)
    # without a rule for signs: 0.00 to 0.03, and 21, 12 and 1 % of the pairs are nearer than 0.15
    assert nearest[0][0] > 0.08 and nearest[1][0] > 0.1, nearest[:2]  # letters vary: of 920 pairs one is nearer
    assert np.mean([distance < 0.2 for distance, _, _ in found]) < 0.05


def struck(word, meant="htf"):
    """How many other letters the bars of t and f strike through, but those that they were drawn to run into."""
    count = 0
    for i, glyph in enumerate(word.glyphs):
        if glyph.letter not in "tf":
            continue
        for bar in filter(is_bar, word.strokes[i]):
            xy = evenly(bar)
            for j, other in enumerate(word.glyphs):
                if j != i and not (abs(i - j) == 1 and other.letter in meant):
                    ink = np.vstack([evenly(s) for s in word.strokes[j] if not is_bar(s)] or [np.full((1, 2), 99.0)])
                    count += bool(np.sqrt(((xy[:, None] - ink) ** 2).sum(axis=2)).min() < 0.03)
    return count


def flown(word):
    """How far bars reach beyond the letters of their word: 1 is a third of the word, or an x-height if that is more."""
    body = np.vstack([s for strokes in word.strokes for s in strokes if not is_bar(s)])
    bars = [s for i, g in enumerate(word.glyphs) if g.letter in "tf" for s in word.strokes[i] if is_bar(s)]
    if not bars:
        return 0.0
    xy = np.vstack(bars)
    beyond = max(float(xy[:, 0].max() - body[:, 0].max()), float(body[:, 0].min() - xy[:, 0].min()))
    return beyond / max(1.0, 0.33 * float(np.ptp(body[:, 0])))


@pytest.mark.slow
@pytest.mark.parametrize("name", HANDS)
def test_bars_strike_no_letter_through_and_do_not_fly_off(name):
    measured = [(struck(word), flown(word)) for _, word in words(name, BARRED, SEEDS)]
    strikes, flights = np.array(measured, dtype=float).T
    # without bounds 1.4, 6 and 0.6 %
    assert strikes.mean() < 0.02
    assert flights.max() < 1.05  # the bound holds before the word grows and leans
    assert flights.max() > 0.2 or name == "house-print"  # but bars do fly


@pytest.mark.slow
@pytest.mark.parametrize("name", HANDS)
def test_dots_and_accents_stay_clear_of_the_letters_beside_them(name):
    found = []
    for text, word in words(name, DOTTED, SEEDS):
        for i, glyph in enumerate(word.glyphs):
            if word.spelt[i] not in "ijé":
                continue
            dots = [stroke for stroke, late in zip(word.strokes[i], glyph.delayed, strict=True) if late]
            assert dots
            others = [s for j, strokes in enumerate(word.strokes) if 0 < abs(i - j) <= 2 for s in strokes]
            found += [(apart([dot], others), text) for dot in dots]
    # with a rule for the next letter's ascender alone 1, 13 and 9 % are nearer than 0.2, which is a line and a bit
    assert np.mean([distance < 0.2 for distance, _ in found]) < 0.01
    assert min(found)[0] > 0.13, min(found)


def test_a_dot_moves_only_where_it_must():
    stem = np.array([[0.0, 1.0], [0.0, 0.0]])
    tall = np.array([[0.0, 2.2], [0.0, 0.0]])
    dot = np.array([[0.0, 1.5], [0.03, 1.5]])
    i = Glyph("i", (stem, dot), (False, True), 0.4)
    ell = Glyph("l", (tall,), (False,), 0.4)
    for away, moves in ((0.5, False), (0.2, True)):
        strokes = [[stem, dot], [tall + np.array([away, 0.0])]]
        clear_dots((i, ell), strokes)
        assert (strokes[0][1] is not dot) == moves and strokes[0][0] is stem
        assert apart([strokes[0][1]], strokes[1]) > 0.25


def test_a_stem_that_was_slurred_until_it_lies_is_no_lack_of_one():
    lying = np.array([[0.0, 0.5], [2.0, 0.52]])
    strokes = [[lying]]
    bound_bars((Glyph("t", (lying,), (False,), 0.4),), strokes)
    assert len(strokes[0]) == 1 and is_bar(strokes[0][0])
