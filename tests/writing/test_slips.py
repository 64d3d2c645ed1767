"""Slips of the pen: which words go wrong and how, and that all else stays as it is."""

from itertools import groupby

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.hand.library import load
from handout.hand.protocol import Repertoire
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout.writing.slips import StrikeThrough, StruckLetters, slip
from handout.writing.text import normalise, paragraphs_of, spelt
from tests.writing.lines_of_glyphs import drawn_units

HAND = load("house-joined")
TEXT = "Dear Ada, thank you for the lovely letter which arrived on Monday morning and made everybody laugh. " * 3


def paragraphs(text):
    repertoire = Repertoire("any", frozenset(normalise(text)), frozenset())
    return paragraphs_of(text, repertoire) if text.strip() else [[]]


def slipped(text, rate=100.0, seed=1):
    return list(slip(paragraphs(text), rate, np.random.default_rng(seed)))


def word(piece):
    return "".join(map(spelt, piece))


def struck(paragraphs):
    return [piece for pieces in paragraphs for piece in pieces if isinstance(piece, StruckLetters)]


def without(pieces):
    kept = list(pieces)
    while any(isinstance(piece, StruckLetters) for piece in kept):
        at = next(i for i, piece in enumerate(kept) if isinstance(piece, StruckLetters))
        assert kept[at + 1] == 1
        del kept[at : at + 2]
    return kept


WORDS = st.text("abceqthisABZ0123'’-.,äß", min_size=1, max_size=9)


@settings(max_examples=60, deadline=None)
@given(st.lists(WORDS, min_size=1, max_size=12), st.integers(0, 99))
def test_only_words_go_wrong_and_what_was_meant_is_written_after(words, seed):
    given_ = paragraphs(" ".join(words))
    made = list(slip(given_, 100.0, np.random.default_rng(seed)))
    assert [without(pieces) for pieces in made] == given_
    for pieces in made:
        for wrong, right in [(a, pieces[i + 2]) for i, a in enumerate(pieces) if isinstance(a, StruckLetters)]:
            assert word(right) == wrong.intended and len(wrong) >= 2
            core = wrong.intended.strip("'’-.,")
            assert core.isalpha() and core[1:].islower() and len(core) > 1
            assert all(letter.base.isalpha() for letter in wrong) and not core.startswith(word(wrong))


@pytest.mark.parametrize("text", ["221B 42 NW1 USA I A x7 l0ve B2B", "D-10115 co-op 3rd", "x y z", ""])
def test_numbers_capitals_and_compounds_never_go_wrong(text):
    assert not any(struck(slipped(text, seed=seed)) for seed in range(30))


@pytest.mark.slow
def test_as_many_as_are_asked_for():
    text = "people sometimes write something wrongly without noticing " * 500
    assert not struck(slipped(text, 0.0))
    found = len(struck(slipped(text, 5.0)))
    assert abs(found - 0.05 * 3500) < 4 * np.sqrt(0.05 * 0.95 * 3500)
    assert word(struck(slipped(text, 5.0))[0]) == word(struck(slipped(text, 5.0))[0])
    assert [*map(word, struck(slipped(text, 5.0)))] != [*map(word, struck(slipped(text, 5.0, seed=2)))]


def test_every_kind_happens_and_most_are_noticed_early():
    wrong = {w for seed in range(600) for w in map(word, struck(slipped("we remember summers", seed=seed)))}
    assert {"er", "rm", "remm"} <= wrong  # swapped, left out, too soon
    assert "we" in wrong and {"su", "sum"} <= wrong  # the word before again, the next too soon
    often = [w for seed in range(600) for w in map(word, struck(slipped("x remember", seed=seed)))]
    early = np.mean([len(w) < 6 for w in often])
    assert 0.4 < early < 0.9 and max(map(len, often)) == 8


@pytest.mark.parametrize("rate", [-1.0, 101.0, float("nan")])
def test_a_rate_out_of_bounds_is_refused(rate):
    with pytest.raises(InputError, match="0 to 100"):
        compose("abc", HAND, Layout(page("A5")), np.random.default_rng(1), slips=rate)


def test_the_other_words_are_written_as_they_would_be_without():
    plain, wrong = paragraphs(TEXT), slipped(TEXT, 20.0)
    units, more = drawn_units(HAND, plain[0], 3), drawn_units(HAND, wrong[0], 3)
    kept = [u for u, piece in zip(more, [p for p in wrong[0] if not isinstance(p, int)], strict=True)
            if not isinstance(piece, StruckLetters)]  # fmt: skip
    assert len(more) > len(kept) == len(units)
    for a, b in zip(units, kept, strict=True):
        assert a.gap == b.gap
        assert all(
            (s == t).all()
            for g, h in zip(a.word.glyphs, b.word.glyphs, strict=True)
            for s, t in zip(g.strokes, h.strokes, strict=True)
        )


def written(slips, seed=1, **layout):
    return compose(TEXT, HAND, Layout(page("A5"), **layout), np.random.default_rng(seed), slips=slips)


def test_without_slips_nothing_changes():
    rng = np.random.default_rng(1)
    (same,), (other,) = compose(TEXT, HAND, Layout(page("A5")), rng), written(0.0)
    assert same.about == other.about and "slips" not in same.about
    for a, b in zip(same.lines, other.lines, strict=True):
        assert all(
            (s == t).all()
            for p, q in zip(a.placed, b.placed, strict=True)
            for s, t in zip(p.strokes, q.strokes, strict=True)
        )


def test_what_was_struck_is_told_and_struck_through_inside_the_margins():
    layout = {"margin": (20.0, 20.0, 20.0, 20.0), "x_height": 2.5}
    (sheet,) = written(25.0, seed=4, **layout)
    told = sheet.about["slips"]
    assert len(told) > 5 and {one["page"] for one in told} == {1}
    for one in told:
        assert f"~~{one['written']}~~" in sheet.lines[one["line"] - 1].text
    marks = 0
    for line in sheet.lines:
        for _, group in groupby(line.placed, key=lambda p: p.word):
            *letters, last = group
            assert all(p.glyph.letter for p in letters)
            if last.glyph.letter:
                continue
            marks += 1
            ink = np.vstack([s for p in letters for s in p.strokes])
            line_of = np.vstack(last.strokes)
            assert line_of[:, 0].min() < ink[:, 0].min() + 1.0 and line_of[:, 0].max() > ink[:, 0].max() - 1.0
            assert line_of[:, 0].min() >= 18.7 and line_of[:, 0].max() <= 128.3
            off = (line.height_at(line_of[:, 0]) - line_of[:, 1]) / 2.5
            assert -0.3 < off.mean() < 1.1
    assert marks == len(told)


def test_a_word_is_struck_out_before_the_next_is_begun():
    (sheet,) = written(25.0, seed=2)
    drawing = trace(sheet, HAND, np.random.default_rng(1))
    words = [stroke.word for stroke in drawing.strokes]
    assert words == sorted(words)
    last = {p.word for line in sheet.lines for p in line.placed if not p.glyph.letter}
    quicker = []
    for number in last:
        *letters, line = [stroke for stroke in drawing.strokes if stroke.word == number]
        assert np.ptp(line.xy[:, 0]) > 0.8 * max(np.ptp(stroke.xy[:, 0]) for stroke in letters)
        letters_speed = sum(stroke.length for stroke in letters) / sum(np.ptp(stroke.t) for stroke in letters)
        quicker.append(line.length / np.ptp(line.t) > letters_speed)
    # a line is drawn quicker than letters are, but where it goes to and fro
    assert np.mean(quicker) > 0.9


def test_words_are_struck_in_several_ways_most_in_the_usual_one():
    ways = []
    for seed in range(40):
        striking = StrikeThrough(np.random.default_rng(seed))
        for _ in range(5):
            strokes = striking.strokes(0.0, 5.0)
            turns = [(np.diff(np.sign(np.diff(s[:, 0]))) != 0).sum() for s in strokes]
            waves = [(np.diff(np.sign(np.diff(s[:, 1]))) != 0).sum() for s in strokes]
            ways.append((len(strokes), int(max(turns)), bool(max(waves) > 6)))
            assert all(s[:, 0].min() < 0.4 and s[:, 0].max() > 4.6 for s in strokes[:1])
    assert {(1, 0), (2, 0), (1, 2)} <= {way[:2] for way in ways} and any(way[2] for way in ways)


def test_short_words_are_not_struck_with_a_wave():
    for seed in range(60):
        for stroke in StrikeThrough(np.random.default_rng(seed)).strokes(0.0, 1.5):
            assert (np.diff(np.sign(np.diff(stroke[:, 1]))) != 0).sum() < 6
