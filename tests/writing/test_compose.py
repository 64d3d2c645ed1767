"""Text to manuscripts: choice, lines, pages, fitting."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import DoesNotFit, InputError
from handout.hand.library import load
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.drawn_words import are_joined
from handout.writing.layout import Layout
from handout.writing.text import Letter
from tests.writing.lines_of_glyphs import Forms

JOINED, QUICK, PRINT = (load(f"house-{name}") for name in ("joined", "quick", "print"))
LONG = "Dear Ada, thank you for the lovely letter, it arrived on Monday and made us all laugh. " * 4
WORDS = st.lists(st.text("abcdefghijklmnopqrstuvwxyzABCDEZ,.", min_size=1, max_size=9), min_size=1, max_size=40)


def pages(text, hand=JOINED, seed=1, layout=None, **options):
    return compose(text, hand, layout or Layout(page("A5")), np.random.default_rng(seed), **options)


def written(manuscripts):
    return " ".join(line.text for sheet in manuscripts for line in sheet.lines)


def ink(sheet):
    return np.vstack([s for line in sheet.lines for p in line.placed for s in p.strokes])


@pytest.mark.slow
@pytest.mark.parametrize("hand", [JOINED, QUICK, PRINT])
def test_every_letter_is_written_once_in_order(hand):
    sheets = pages(LONG, hand)
    assert written(sheets) == LONG.strip()
    at = [p.at for sheet in sheets for line in sheet.lines for p in line.placed]
    assert at == sorted(set(at))


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(WORDS, st.integers(0, 5))
def test_words_keep_their_order_and_stay_on_the_page(words, seed):
    layout = Layout(page("A6"), (8, 8, 8, 8))
    sheets = pages(" ".join(words), QUICK, seed, layout)
    assert written(sheets).split() == words or "".join(words) == written(sheets).replace(" ", "")
    for sheet in sheets:
        x, y = ink(sheet).T
        assert x.min() > 3 and x.max() < 102 and y.min() > 0 and y.max() < 148


@pytest.mark.slow
def test_same_seed_same_writing_other_seed_differs_in_every_word():
    def words(sheets):
        found = {}
        for line in sheets[0].lines:
            for p in line.placed:
                found.setdefault(p.word, []).append(np.concatenate([s.ravel() for s in p.strokes]))
        return [np.concatenate(parts) for parts in found.values()]

    first, again, other = words(pages(LONG)), words(pages(LONG)), words(pages(LONG, seed=2))
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not any(len(a) == len(b) and np.allclose(a, b) for a, b in zip(first, other, strict=True))


def test_jitter_zero_is_the_ideal_form():
    still = Layout(page("A5"), jitter=0.0)
    a, b = pages("minimum", seed=1, layout=still), pages("minimum", seed=2, layout=still)
    assert np.array_equal(ink(a[0]), ink(b[0]))


def test_the_same_form_is_not_used_twice_running():
    rng = np.random.default_rng(3)
    chooser = Forms(JOINED, rng)
    twins = 0
    for _ in range(100):
        a, b = chooser.word([Letter("l", (), 0), Letter("l", (), 1)])
        twins += a.form == b.form
    assert twins <= 2


def test_joined_letters_meet_in_kind():
    rng = np.random.default_rng(4)
    chooser = Forms(JOINED, rng)
    for word in ("over", "women", "because", "orange", "waving", "bread", "love"):
        glyphs = chooser.word([Letter(c, (), i) for i, c in enumerate(word)])
        for a, b in pairwise(glyphs):
            if are_joined(a, b) and b.entry != "free":
                assert a.exit == b.entry, (word, a.letter, b.letter)


def test_capitals_stand_alone_and_words_join():
    (sheet,) = pages("Bobo")
    flags = [p.joined for p in sheet.lines[0].placed]
    assert not flags[0] and not flags[1]
    assert any(p.joined for seed in range(5) for p in pages("nun", seed=seed)[0].lines[0].placed)


def test_a_capital_that_joins_is_joined_and_one_that_does_not_is_not():
    from dataclasses import replace

    rng = np.random.default_rng(0)
    k = JOINED.glyphs["K"][0]
    joining = replace(k, exit="low", places=frozenset({"start", "middle"}))
    hand = replace(JOINED, glyphs={**JOINED.glyphs, "K": (joining,)})
    word = [Letter(c, (), i) for i, c in enumerate("Ka")]
    assert any(are_joined(*Forms(hand, rng).word(word)) for _ in range(20))
    apart = replace(JOINED, glyphs={**JOINED.glyphs, "K": (k,)})
    for _ in range(20):
        a = Forms(apart, rng).word(word)[1]
        assert a.entry == "lifted"


def test_a_word_that_cannot_fit_is_broken_and_no_other():
    layout = Layout(page("60x200mm"), (5, 5, 5, 5))
    (sheet,) = pages("a Donaudampfschifffahrtsgesellschaftskapitän b", layout=layout)
    lines = [line.text for line in sheet.lines]
    assert "".join(lines).replace(" ", "") == "aDonaudampfschifffahrtsgesellschaftskapitänb"
    text = "several quite ordinary little words"
    assert " ".join(line.text for line in pages(text, layout=layout)[0].lines) == text


@pytest.mark.slow
def test_a_sign_that_stands_alone_stays_with_its_word():
    """French sets spaces inside « » and before ! and ?: none of them begins or ends a line where there is room."""
    text = "Nous irons au « Café du Nord » ce soir ! Et toi ? Viens ; nous dirons : « Salut » et « jamais » ! " * 3
    for width in (88, 104, 136):
        lines = pages(text, PRINT, layout=Layout(page(f"{width}x300mm"), x_height=3.0))[0].lines
        assert all(line.text[0] not in "!?:;»" and line.text[-1] != "«" for line in lines)
    narrow = [line.text for line in pages("oui !", PRINT, layout=Layout(page("49x99mm"), x_height=3.0))[0].lines]
    assert narrow == ["oui", "!"]


TIED = "Cher M.\u00a0Dupont, cela fait 10\u202f000\u202f€ et 3\u00a0$\\mu$ le 5\u2007mai. "


def test_no_line_ends_at_a_space_that_ties():
    def lines(text, width, x_height=3.0):
        layout = Layout(page(f"{width}x300mm"), x_height=x_height)
        return [line.text for line in pages(text, PRINT, layout=layout)[0].lines]

    parted = 0
    for width in (88, 97, 121, 136):
        free = "\n".join(lines(TIED.translate(dict.fromkeys(map(ord, "\u00a0\u2007\u202f"), " ")) * 2, width))
        tied = "\n".join(lines(TIED * 2, width))  # a text that begins as the last one did, and differs in its spaces
        assert [tied.count(part) for part in ("M. Dupont,", "10 000 €", "3 μ", "5 mai.")] == [2] * 4
        parted += tied != free
    assert parted
    assert lines("10\u00a0000", 54, 3.5) == ["10", "000"]  # no line has room for both
    assert lines("aaaa\u00a0 bbbb", 64, 3.5) == ["aaaa", "bbbb"]


def test_pages_follow_and_blank_lines_stay():
    sheets = pages(LONG * 5)
    assert len(sheets) > 1
    a, b = pages("one\ntwo")[0].lines, pages("one\n\ntwo")[0].lines
    assert b[1].baseline - b[0].baseline > 1.7 * (a[1].baseline - a[0].baseline)


@pytest.mark.slow
def test_too_much_text_says_by_how_much_and_fit_shrinks():
    with pytest.raises(DoesNotFit, match=r"lines or \d+ mm too many"):
        pages(LONG * 3, pages=1)
    (sheet,) = pages(LONG * 3, layout=Layout(page("A5"), fit=True))
    assert sheet.x_height < 2.5
    bunched = "a word and another word that go on " * 6  # its longest line is as wide as its room, but for rounding
    assert pages(bunched, seed=13, layout=Layout(page("A5"), fit=True))[0].x_height == 2.5
    assert written([sheet]) == (LONG * 3).strip()
    assert ink(sheet)[:, 1].max() < 210 - 15
    with pytest.raises(DoesNotFit, match="larger page or less text"):
        pages(LONG * 15, layout=Layout(page("A5"), fit=True))


def test_no_line_fits():
    with pytest.raises(DoesNotFit, match="x-height"):
        pages("a", layout=Layout(page("A6"), x_height=60))


def test_alignment():
    text = "short\nand a longer line"
    for align, side in (("left", 0), ("right", 1)):
        (sheet,) = pages(text, layout=Layout(page("A5"), align=align))
        edges = [
            (
                min(s[:, 0].min() for p in line.placed for s in p.strokes),
                max(s[:, 0].max() for p in line.placed for s in p.strokes),
            )
            for line in sheet.lines
        ]
        assert abs(edges[0][side] - edges[1][side]) < 2.5
        assert abs(edges[0][1 - side] - edges[1][1 - side]) > 10


@pytest.mark.parametrize(
    "wrong",
    [
        {"margin": (80, 80, 80, 80)},
        {"margin": (-1, 0, 0, 0)},
        {"x_height": 0.1},
        {"x_height": 500},
        {"line_spacing": 1},
        {"jitter": -1},
    ],
)
def test_absurd_layouts_are_refused(wrong):
    with pytest.raises(InputError):
        Layout(page("A5"), **wrong)


@pytest.mark.parametrize("name", ["A9", "10x10mm", "9999x20mm", "0x0mm", "x", ""])
def test_absurd_pages_are_refused(name):
    with pytest.raises(InputError):
        page(name)
