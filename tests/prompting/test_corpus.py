"""The shipped sentences, and the splitting of texts into sentences."""

import re
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.prompting import corpus
from handout.prompting.sentence_choice import pangrams


def test_shipped_sentences_are_many_and_of_a_good_length():
    every = corpus.shipped_sentences()
    assert len(every) >= 800
    assert all(5 <= len(sentence.split()) <= 25 for sentence in every)
    assert all(sentence == " ".join(sentence.split()) == corpus.as_typed(sentence) for sentence in every)


@pytest.mark.parametrize(
    ("language", "alphabet"),
    [
        ("be", "абвгдеёжзійклмнопрстуўфхцчшыьэюя"),
        ("bg", "абвгдежзийклмнопрстуфхцчшщъьюя"),
        ("el", "αβγδεζηθικλμνξοπρσςτυφχψωάέήίόύώΐ"),
        ("ru", "абвгдеёжзийклмнопрстуфхцчшщъыьэюя"),
        ("sr-Cyrl-RS", "абвгдђежзијклљмнњопрстћуфхцчџш"),
        ("uk", "абвгґдеєжзиіїйклмнопрстуфхцчшщьюя"),
    ],
)
def test_each_language_has_sentences_with_all_its_letters(language, alphabet):
    every = corpus.shipped_sentences(language)
    assert len(set(every)) == len(every) >= 30
    assert all(sentence == " ".join(sentence.split()) == corpus.as_typed(sentence) for sentence in every)
    written = "".join(every)
    assert [each for each in alphabet + alphabet.upper().replace("\u0308\u0301", "") if each not in written] == []


def test_a_language_without_sentences_is_said():
    with pytest.raises(InputError, match="no sentences in 'fi' come with the program, only in be, bg"):
        corpus.shipped_sentences("fi")


def test_shipped_sentences_are_no_variations_of_each_other():
    words = [frozenset(re.findall(r"\w+", sentence.lower())) for sentence in corpus.shipped_sentences()]
    column = {word: i for i, word in enumerate(sorted(frozenset.union(*words)))}
    held = np.zeros((len(words), len(column)), dtype=np.float32)
    for row, own in zip(held, words, strict=True):
        row[[column[word] for word in own]] = 1
    shared = held @ held.T
    size = held.sum(axis=1)
    alike = shared / (size[:, None] + size - shared) - np.eye(len(words))
    assert alike.max() < 0.45
    starts = Counter(" ".join(sentence.split()[:3]) for sentence in corpus.shipped_sentences())
    assert starts.most_common(1)[0][1] <= 4


def test_shipped_sentences_have_all_of_ascii_and_rare_pairs():
    text = " ".join(corpus.shipped_sentences())
    assert set(corpus.PRINTABLE) <= set(text)
    assert len(pangrams(corpus.shipped_sentences())) >= 12
    pairs = set(re.findall("(?=([a-z]{2}))", text.lower()))
    assert 440 < len(pairs) < 550
    assert {"zz", "xh", "kn", "gn", "pt", "wk", "yx", "uu", "aa", "vv", "hm", "oj", "lj", "bj", "dj"} <= pairs
    letters = Counter(char for char in text.lower() if char in "etaoinshrdlu")
    assert letters["e"] == max(letters.values())
    assert min(letters.values()) > 0.02 * len(text)


def test_accents_are_optional():
    allowed = frozenset(corpus.PRINTABLE + " ")
    assert corpus.plain("Zoë, Bjørn & Ayşe at Łódź: naïve cœur, Straße.", allowed) == (
        "Zoe, Bjorn & Ayse at Lodz: naive coeur, Strasse."
    )
    assert corpus.plain("Zoë and Čapek", allowed | {"ë"}) == "Zoë and Capek"
    assert corpus.plain("It costs €5.", allowed) is None
    assert corpus.plain("It costs €5.", allowed | {"€"}) == "It costs €5."


def test_sentences_of_a_text():
    text = """CHAPTER ONE

    Mr. J. Smith met Dr. Okafor at 3.30 p.m. on the quay. "Are you
    sure?" he asked. "Yes!" (She was not.) See no. 5 on p. 12, please.

    He said no. Then he left... and, e.g. on Mondays, came back. 40 people
    saw it. He said no. Then nothing.
    """
    assert corpus.sentences(text) == [
        "CHAPTER ONE",
        "Mr. J. Smith met Dr. Okafor at 3.30 p.m. on the quay.",
        '"Are you sure?" he asked.',
        '"Yes!"',
        "(She was not.)",
        "See no. 5 on p. 12, please.",
        "He said no.",
        "Then he left... and, e.g. on Mondays, came back.",
        "40 people saw it.",
        "Then nothing.",
    ]


def test_a_list_of_sentences_stays_a_list():
    assert corpus.sentences("\n".join(corpus.shipped_sentences()[:40]) + "\n")[:3] == list(
        corpus.shipped_sentences()[:3]
    )
    assert corpus.sentences("what a line\nof a poem without stops\nis") == ["what a line of a poem without stops is"]


@settings(max_examples=40)
@given(st.text(max_size=300))
def test_any_text_can_be_split(text):
    found = corpus.sentences(text)
    assert len(set(found)) == len(found)
    joined = " ".join(text.split())
    assert all(sentence.strip() and " ".join(sentence.split()) in joined for sentence in found)


def test_very_long_sentences_are_left_out():
    assert corpus.sentences("word " * 41 + ". Short one.") == ["Short one."]


@pytest.mark.parametrize("content", [b"\xff\xfe\x00\xd8", b"1 2 3", b""])
def test_files_that_are_no_text(tmp_path, content):
    (tmp_path / "a.txt").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.txt"):
        corpus.read_text(tmp_path / "a.txt")
    with pytest.raises(InputError, match="Cannot read"):
        corpus.read_text(tmp_path / "none.txt")


def test_reading_types_as_a_keyboard_does(tmp_path):
    (tmp_path / "a.txt").write_text("“It’s” – so…", encoding="utf-8")
    assert corpus.read_text(tmp_path / "a.txt") == '"It\'s" - so...'
