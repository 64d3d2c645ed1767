"""Letters that a scanned hand lacks: put together from its own, or lent."""

from dataclasses import replace

import numpy as np
import pytest

from handout.cli.sentences import tell_lent
from handout.completion.completed_hand import complete_hand, outlook
from handout.errors import InputError, MissingCharacters
from handout.hand.vetting import vet
from handout.pipeline.options import WritingOptions
from handout.pipeline.results import Tally
from handout.pipeline.texts import TextDocument, prepare


def spelt(borrowed):
    return {one.letter: (one.source, one.of_author, one.at) for one in borrowed}


def test_a_hand_that_lacks_nothing_stays_as_it_is(small_hand):
    text = "".join(letter for letter in small_hand.letters if letter.isalpha())
    same, borrowed = complete_hand(small_hand, text, fallback=True)
    assert same is small_hand and borrowed == []


def test_a_diaeresis_is_two_of_the_authors_dots(small_hand):
    lent, borrowed = complete_hand(small_hand, "e ë")
    assert spelt(borrowed) == {"ë": ("e with two of the author's own dots", True, (2,))}
    assert lent.glyphs[: len(small_hand.glyphs)] == small_hand.glyphs and len(lent.pages) == len(small_hand.pages) + 1
    for number in lent.numbers_of_letter("ë"):
        glyph = lent.glyphs[number]
        pieces = lent.pages[-1].graph.take(glyph.vertices)
        tops = [pieces.uv[pieces.components == k, 1].min() for k in range(pieces.components.max() + 1)]
        xy = lent.outline(number)
        assert len(tops) >= 3 and xy[:, 1].max() > 1.1 * lent.pages[-1].x_height / lent.pages[-1].pitch
        assert glyph.before < 0 or lent.glyphs[glyph.before].letter == ""


@pytest.mark.slow
def test_the_sheet_has_ink_where_its_letters_are(small_hand):
    lent, _ = complete_hand(small_hand, "ëZ7", fallback=True, seed=3)
    page = lent.pages[-1]
    u, v = np.rint(page.graph.uv).astype(int).T
    alpha = page.texture.rgba[v, u, 3]
    assert (alpha > 60).mean() > 0.97
    own = np.array([np.median(p.texture.rgba[p.texture.rgba[:, :, 3] > 200][:, :3], axis=0) for p in lent.pages])
    assert np.abs(own[0] - own[-1]).max() < 30  # the author's ink
    small = page.x_height / page.pitch
    for letter in "Z7":
        ends = np.array(
            [[f(lent.outline(int(i))[:, 1]) / small for f in (np.min, np.max)] for i in lent.numbers_of_letter(letter)]
        )
        assert np.abs(ends[:, 0]).max() < 0.3 and np.median(ends[:, 1]) > 1.4


def test_a_mark_of_the_authors_own_is_taken(small_hand):
    lent, _ = complete_hand(small_hand, "ë")
    # a hand with ë and without i: the diaeresis comes from ë
    glyphs = tuple(replace(g, letter="" if g.letter in "ij" else g.letter) for g in lent.glyphs)
    without = replace(lent, glyphs=glyphs)
    again, borrowed = complete_hand(without, "ä")
    assert spelt(borrowed)["ä"] == ("a with the author's own diaeresis", True, (0,))
    assert len(again.numbers_of_letter("ä"))


def test_what_cannot_be_had_is_an_error_with_its_places(small_hand):
    with pytest.raises(MissingCharacters) as caught:
        complete_hand(small_hand, "eé\nZ")
    said = str(caught.value)
    assert "'é' (line 1, character 2)" in said and "'Z' (line 2, character 1)" in said
    assert "--fallback to accept similar forms, which can supply all of them" in said and "it can write only" in said
    with pytest.raises(MissingCharacters) as caught:
        complete_hand(small_hand, "Z漢")
    assert "which can supply 'Z' of them" in str(caught.value)
    with pytest.raises(MissingCharacters) as caught:
        complete_hand(small_hand, "Z漢", fallback=True)
    assert "'漢'" in str(caught.value) and "'Z'" not in str(caught.value) and "--fallback" not in str(caught.value)


@pytest.mark.slow
def test_all_that_a_drawn_hand_has_can_be_lent(small_hand):
    text = "Zß 7&?! ç É ñ ê å ž x X (ł)"
    lent, borrowed = complete_hand(small_hand, text, fallback=True)
    found = spelt(borrowed)
    assert found["ł"][1] is False and found["ł"][2] == (text.index("ł"),) and found["ł"][0] == "l with a drawn slash"
    assert set("Z7&?!çñêåžX") <= set(lent.letters)
    assert all(not one.of_author for one in borrowed)
    again, _ = complete_hand(small_hand, text, fallback=True)
    assert np.array_equal(again.pages[-1].texture.rgba, lent.pages[-1].texture.rgba)


def test_marks_are_set_as_the_drawn_hands_set_them(small_hand):
    lent, borrowed = complete_hand(small_hand, "ı ė")
    assert {one.letter: (one.source, one.of_author) for one in borrowed} == {
        "ı": ("i without its dot", True),
        "ė": ("e with the author's own dot", True),
    }
    # a stroke crosses its stem, an ogonek hangs from the line, an apostrophe stands beside the top
    lent, borrowed = complete_hand(small_hand, "ł ą ď", fallback=True)
    tops = {x: [lent.outline(i)[:, :2] for i in lent.numbers_of_letter(x)] for x in "łąďlad"}
    assert all(xy[:, 1].min() < min(own[:, 1].min() for own in tops["a"]) - 0.05 for xy in tops["ą"])
    assert np.median([np.ptp(xy[:, 0]) for xy in tops["ď"]]) > np.median([np.ptp(xy[:, 0]) for xy in tops["d"]])
    assert {one.source for one in borrowed} == {
        f"{x} with a drawn {m}" for x, m in (one.split("/") for one in ["l/slash", "a/ogonek", "d/apostrophe"])
    }


def test_signs_with_a_stroke_are_lent_whole_and_letters_that_look_alike_take_the_authors_own(small_hand):
    lent, borrowed = complete_hand(small_hand, "≠ = ї ό", fallback=True)
    told = {one.letter: one.source for one in borrowed}
    assert "slash" not in told["≠"] and told["ї"].startswith("i with") and told["ό"].startswith("o with")
    high = {x: max(np.ptp(lent.outline(i)[:, 1]) for i in lent.numbers_of_letter(x)) for x in "≠="}
    assert high["≠"] > 1.4 * high["="]


def test_a_picture_is_left_out_and_listed(small_hand):
    with pytest.raises(MissingCharacters, match="--fallback to leave it out"):
        complete_hand(small_hand, "an 🦊 even")
    same, borrowed = complete_hand(small_hand, "an 🦊 even 🦊", fallback=True)
    assert spelt(borrowed) == {"🦊": ("left out", False, (3, 10))} and same is small_hand


def test_a_pen_is_no_hand(small_hand):
    pen = replace(small_hand, glyphs=())
    with pytest.raises(InputError, match="a pen to write with, not a hand"):
        complete_hand(pen, "a")
    nameless = replace(small_hand, glyphs=tuple(replace(glyph, letter="") for glyph in small_hand.glyphs))
    with pytest.raises(InputError, match="ink without letters"):
        complete_hand(nameless, "a", fallback=True)


def doubted(hand, letter):
    glyphs = tuple(replace(g, confidence=0.0) if g.letter == letter else g for g in hand.glyphs)
    return replace(hand, glyphs=glyphs)


def test_a_letter_of_which_all_are_doubtful_is_lent_beside_its_own(small_hand):
    hand = doubted(small_hand, "h")
    completed, borrowed = complete_hand(hand, "hen hen", fallback=True)
    assert spelt(borrowed) == {"h": ("made after the author's other letters, as its own are doubtful", False, (0, 4))}
    assert borrowed[0].doubted and completed.author is hand and completed.own_count == len(hand.glyphs)
    assert (
        set(hand.numbers_of_letter("h")) < set(completed.numbers_of_letter("h"))
        and (vet(completed).probability[completed.own_count :] == 1).all()
    )
    same, told = complete_hand(hand, "hen hen")  # lent only where that is accepted
    assert same is hand and spelt(told) == {"h": ("its own, all doubtful", True, (0, 4))} and told[0].doubted
    assert complete_hand(small_hand, "hen hen", fallback=True) == (small_hand, [])


def test_what_is_lent_for_doubtful_letters_is_told_with_the_places_where_it_is_written(small_hand):
    hand = doubted(small_hand, "h")
    options = WritingOptions(hand=hand, seed=3, fallback=True)
    _, sheets = TextDocument("hen hen", prepare(options)).set_pages()
    (about,) = (sheet.manuscript.about for sheet in sheets)
    (fact,) = about["borrowed"]
    assert fact["doubtful"] and not fact["own"] and fact["at"] == [0, 4] and "doubtful" in fact["from"]
    _, sheets = TextDocument("hen hen", prepare(WritingOptions(hand=hand, seed=3))).set_pages()
    (about,) = (sheet.manuscript.about for sheet in sheets)
    assert about["borrowed"][0]["own"] and about["borrowed"][0]["doubtful"] and about["borrowed"][0]["at"] == [0, 4]
    assert tell_lent(Tally(borrowed=about["borrowed"])).startswith(
        " All that the hand has are doubtful of: h, 2 times;"
    )
    assert {way.letter: way.how for way in outlook(hand, "hen")} == {"h": "doubted"}
