"""Sheets for letters of which a hand has few sure ones."""

from handout.prompting import corpus, prompt_pages
from handout.prompting.sentence_choice import LEAST, frequencies_again, letters_again


def test_letters_count_as_much_as_they_lack():
    lacking = letters_again({"a": LEAST, "b": 2, "c": 0}, "abcd d")
    assert lacking == {"b": 1 - 2 / LEAST, "c": 1.0, "d": 1.0}


def test_sentences_hold_the_letters_that_lack(small_hand):
    sure = {letter: 0 if letter in "jp" else LEAST for letter in "abcdefghijklmnopqrstuvwxyz"}
    sentences = corpus.usable(corpus.shipped_sentences(), frozenset(corpus.PRINTABLE + " "))
    wanted, characters = frequencies_again(small_hand, sure, sentences, "abcdefghijklmnopqrstuvwxyz")
    assert characters == "jp" and set(wanted.letters) == {"j", "p"}
    assert all(set(pair) & set("jp") for pair in wanted.pairs)
    made = prompt_pages.prompt(sentences, wanted, characters, pages=1, lines=4, width=50)
    text = " ".join(line for page in made.pages for line in page)
    usual = " ".join(sentences)
    assert sum(text.count(x) for x in "jp") / len(text) > 2 * sum(usual.count(x) for x in "jp") / len(usual)
