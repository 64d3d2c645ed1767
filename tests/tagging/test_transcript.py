"""A transcript becomes letters that know where in the text they stand."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.alphabet import INDEX, JUNK, LETTERS, SPACE, fold
from handout.errors import InputError
from handout.hand.places import graphemes
from handout.tagging.transcript import in_one_line, read_transcript


def test_the_alphabet_has_no_letter_twice():
    assert len(set(LETTERS)) == len(LETTERS) == len(INDEX)


@pytest.mark.parametrize(
    ("grapheme", "letter"),
    [
        ("é", "e"),
        ("e\u0301", "e"),
        ("Ü", "U"),
        ("”", '"'),
        ("’", "'"),
        ("—", "–"),
        ("ł", "l"),
        ("ß", "ß"),
        ("字", JUNK),
        ("Ё", "E"),
        ("ж", JUNK),
    ],
)
def test_look_alikes_are_one_letter(grapheme, letter):
    assert fold(grapheme) == letter


def test_letters_that_no_network_has_learnt_are_those_that_they_resemble():
    (line,) = read_transcript("Съешь ξύλα, 字")
    assert line.letters[:5] == tuple("Cbewb") and JUNK not in line.letters[:-1] and line.letters[-1] == JUNK
    assert line.text == "Съешь ξύλα, 字"


@given(st.text(st.characters(blacklist_categories=["Cs"]), max_size=40))
def test_every_grapheme_but_space_is_kept_in_its_place(text):
    units = graphemes(text)
    try:
        lines = read_transcript(text)
    except InputError:
        assert all(fold(unit) == SPACE for unit in units)
        return
    if "~~" in text:
        return
    every = [each for line in lines for each in zip(line.at, line.spelt, line.letters, strict=True)]
    got = [(at, spelt) for at, spelt, letter in every if letter != SPACE]
    assert got == [(i, unit) for i, unit in enumerate(units) if fold(unit) != SPACE]


@given(st.lists(st.text("ab ", max_size=8), min_size=1, max_size=5))
def test_lines_have_no_space_at_their_ends_nor_two_in_a_row(rows):
    text = "\n".join(rows)
    if not text.strip():
        return
    for line in [*read_transcript(text), in_one_line(read_transcript(text))]:
        assert line.letters[0] != SPACE != line.letters[-1]
        assert (SPACE, SPACE) not in set(pairwise(line.letters))


def test_what_was_struck_out_is_one_letter():
    (line,) = read_transcript("a ~~few ol~~ years")
    assert line.letters == ("a", SPACE, JUNK, SPACE, *"years")
    assert line.spelt[2] == "~~few ol~~"
    assert line.at == (0, 1, 2, 12, *range(13, 18))


def test_one_text_of_all_lines():
    whole = in_one_line(read_transcript("ab\n\ncd-\nef"))
    assert "".join(whole.letters) == "ab cd- ef"
    assert whole.at == (0, 1, 3, 4, 5, 6, 7, 8, 9)


@pytest.mark.parametrize("text", ["", " \n ", "\n\n"])
def test_an_empty_transcript_is_refused(text):
    with pytest.raises(InputError, match="empty"):
        read_transcript(text)
