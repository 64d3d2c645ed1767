"""Unicode text to letters."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError, MissingCharacters
from handout.hand.library import load
from handout.writing.drawn_forms import runs
from handout.writing.text import Letter, find_unseen, normalise, spell, spelt

HAND = load("house-joined").repertoire


def bases(text, **options):
    return [t.base if isinstance(t, Letter) else t for t in spell(normalise(text), HAND, **options)]


@pytest.mark.parametrize("text", ["Zoë", "ﬁne", "a\u0308b", "naïve façade", "Ærø", "señor"])
def test_composed_and_decomposed_are_the_same(text):
    assert bases(unicodedata.normalize("NFD", text)) == bases(unicodedata.normalize("NFC", text))


def test_an_accent_is_a_mark_on_its_letter():
    (letter,) = spell(normalise("é"), HAND)
    assert letter == Letter("e", ("\u0301",), 0)


def test_invisible_characters_are_not_written():
    assert bases("co\u00adop\u200berate\ufeff") == list("cooperate")


@pytest.mark.parametrize("newline", ["\r\n", "\r", "\u2028", "\x85", "\n"])
def test_every_newline_is_one(newline):
    assert bases(f"a{newline}b") == ["a", "\n", "b"]


def test_all_missing_characters_are_listed_with_their_places():
    with pytest.raises(MissingCharacters) as caught:
        spell(normalise("abc ժ\nդ and ժ"), HAND)
    message = str(caught.value)
    assert "'ժ' (line 1, character 5; line 2, character 7)" in message
    assert "'դ' (line 2, character 1)" in message
    assert message.endswith(": use another hand.")  # nothing is like them, so that --fallback would not help


def test_writing_from_right_to_left_is_refused_as_such():
    with pytest.raises(MissingCharacters, match="handout writes from left to right alone"):
        spell(normalise("abc שלום"), HAND)


def test_fallback_borrows_and_still_refuses_another_script():
    assert bases("Łódź ő", fallback=True) == ["L", "o", "d", "z", " ", "o"]
    with pytest.raises(MissingCharacters, match="use another hand"):
        bases("日本", fallback=True)


@pytest.mark.parametrize("text", ["", "   ", "\n\n", "\u200b"])
def test_nothing_to_write(text):
    with pytest.raises(InputError, match="nothing to write"):
        spell(normalise(text), HAND)


def test_places_are_counted_among_small_letters():
    places = runs([Letter(c, (), i) for i, c in enumerate("Don't")])
    assert [places[i] for i in (0, 1, 2, 4)] == ["start", "start", "end", "alone"]
    assert runs([Letter("I", (), 0)]) == ["alone"]


@given(st.text(max_size=60))
def test_any_text_is_spelt_or_refused_in_one_sentence(text):
    try:
        letters = spell(normalise(text), HAND, fallback=True)
    except (InputError, MissingCharacters) as error:
        assert len(str(error)) > 10
    else:
        assert all(isinstance(x, str) or x.base in HAND.letters for x in letters)


@pytest.mark.parametrize(
    ("typed", "written"),
    [
        ("Marjorie 🦊, hello", "Marjorie, hello"),
        ("(🦊 you) 🦊!", "(you)!"),
        ("🦊 a 🦊 🦊 b 🦊\nc", "a b\nc"),
        ("Yuki Tanaka 田中", "Yuki Tanaka"),
        ("Dear Yuki Tanaka (田中), hi", "Dear Yuki Tanaka, hi"),
        ("田中 様 Yuki Tanaka", "Yuki Tanaka"),
    ],
)
def test_what_is_left_out_takes_its_space_along(typed, written):
    tokens = spell(normalise(typed), HAND, fallback=True)
    assert "".join(token if isinstance(token, str) else spelt(token) for token in tokens) == written
    with pytest.raises(MissingCharacters, match=r"leave (it|them) out"):
        spell(normalise(typed), HAND)


@pytest.mark.parametrize("typed", ["Dear 田中, hi", "田中", "Yuki Tanaka\n田中", "Meet at 東京 Station"])
def test_a_name_that_nothing_else_names_is_not_left_out(typed):
    with pytest.raises(MissingCharacters):
        spell(normalise(typed), HAND, fallback=True)


def test_invisible_characters_are_dropped_and_told():
    text = "a\u200eb\u202e c\u00ad\u200b 👩\u200d👧 d\u200b"
    assert not any(char in normalise(text) for char in "\u200e\u202e\u00ad\u200b\u200d")
    assert [(each.letter, each.at) for each in find_unseen(text)] == [
        ("U+200E", (1,)), ("U+202E", (2,)), ("U+00AD", (4,)), ("U+200B", (4, 9)),
    ]  # fmt: skip
