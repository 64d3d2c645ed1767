"""The choice of sentences against a slow one, and what a prompt guarantees."""

import time
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import DoesNotFit, InputError
from handout.prompting import corpus, prompt_pages, sentence_choice
from handout.prompting.sentence_choice import Closing, SentenceChooser, pangrams

words = st.text("abcde.", min_size=1, max_size=6)
sentence = st.lists(words, min_size=1, max_size=12).map(" ".join)
ASCII = frozenset(corpus.PRINTABLE + " ")
TARGET = sentence_choice.frequencies(corpus.usable(corpus.shipped_sentences(), ASCII))


def units(text):
    """Letters and pairs of a text, counted one by one."""
    single, double = Counter(), Counter()
    for word in text.split(" "):
        for i in range(len(word)):
            single[word[i]] += 1
            if i + 1 < len(word):
                double[word[i : i + 2]] += 1
    return single, double


def slow_gain(text, target, taken):
    done, done_pairs = units(" ".join(taken))
    total = 0.0
    for char in text.replace(" ", ""):
        total += 32 * target.letters.get(char, 0.0) / (1 + done[char] ** 2)
    for pair, n in units(text)[1].items():
        total += n * target.pairs.get(pair, 0.0) / (1 + done_pairs[pair] ** 2)
    n = len(text.split())
    return total / n * ((1 + 2 * n / 10) / 3 if n < 10 else 1.0)


def slow_cost(text, target, taken):
    done, done_pairs = units(" ".join(taken))
    total = 0.0
    for char, n in units(text)[0].items():
        total += n * (1 + done[char] ** 2) / target.letters[char]
    for pair, n in units(text)[1].items():
        total += n * (1 + done_pairs[pair] ** 2) / target.pairs[pair] / 32
    return total


@pytest.mark.slow
class PrintedCost(SentenceChooser):
    """Sentences by the cost as it is printed in seed 000, §4.1 (Haines, Mac Aodha, Brostow 2016), negated.

    ``Σ (1 + F²) / Pr + ω Σ (1 + F²) / Pr``, ω = 1/32: a letter that is wanted often costs little and every letter costs
    something, so the least total belongs to the shortest sentence.
    """

    def scores(self):
        letters = self.letters.counts @ ((1 + self._letters_taken**2) / self.letters.frequency)
        pairs = self.pairs.counts @ ((1 + self._pairs_taken**2) / self.pairs.frequency)
        return np.where(self.free, -(letters + pairs / 32), -np.inf)


@given(st.lists(sentence, min_size=1, max_size=8, unique=True), st.lists(sentence, max_size=3))
@settings(max_examples=60, deadline=None)
def test_gain_and_order_are_those_of_a_slow_search(texts, other):
    target = sentence_choice.frequencies([*texts[: len(texts) // 2 + 1], *other])
    chooser, taken = SentenceChooser(texts, target), []
    for _ in texts:
        left = [text for text in texts if text not in taken]
        slow = [slow_gain(text, target, taken) for text in left]
        scores = chooser.scores()
        np.testing.assert_allclose(scores[chooser.free], slow, rtol=1e-9, atol=1e-12)
        best = chooser.best()[0]
        assert scores[best] == pytest.approx(max(slow))
        taken.append(chooser.take(int(best)))
    assert sorted(taken) == sorted(texts) and not len(chooser.best())


@given(st.lists(sentence, min_size=2, max_size=6, unique=True))
@settings(max_examples=30, deadline=None)
def test_the_printed_cost_is_that_of_a_slow_search(texts):
    target = sentence_choice.frequencies(texts)
    chooser = PrintedCost(texts, target)
    chooser.take(0)
    slow = [-slow_cost(text, target, texts[:1]) for text in texts[1:]]
    np.testing.assert_allclose(chooser.scores()[1:], slow, rtol=1e-9)


def test_frequencies_are_relative_to_the_commonest():
    found = sentence_choice.frequencies(["aab ab", "b c"])
    assert found.letters == {"a": 1.0, "b": 1.0, "c": 1 / 3}
    assert found.pairs == {"aa": 0.5, "ab": 1.0}


def text_of(prompt):
    return "".join("".join(page) for page in prompt.pages)


def test_a_prompt_has_every_character_and_a_pangram_first():
    prompt = prompt_pages.prompt(corpus.shipped_sentences(), TARGET)
    assert [len(page) for page in prompt.pages] == [23] * 4
    assert max(len(line) for page in prompt.pages for line in page) <= 51
    assert set(corpus.PRINTABLE) <= set(text_of(prompt)) <= ASCII
    assert pangrams(prompt.sentences[:1]) == [0]
    assert " ".join(prompt.sentences) == " ".join(line for page in prompt.pages for line in page)
    assert len(set(prompt.sentences)) == len(prompt.sentences)
    assert 700 <= prompt.words <= 850
    assert prompt == prompt_pages.prompt(corpus.shipped_sentences(), TARGET)


def test_a_prompt_covers_better_than_sentences_by_chance_or_by_the_printed_cost(monkeypatch):
    chosen = prompt_pages.prompt(corpus.shipped_sentences(), TARGET, "", pages=2)
    with monkeypatch.context() as patch:
        patch.setattr(prompt_pages, "SentenceChooser", PrintedCost)
        printed = prompt_pages.prompt(corpus.shipped_sentences(), TARGET, "", pages=2)
    rng = np.random.default_rng(1)
    shuffled = " ".join(np.array(corpus.usable(corpus.shipped_sentences(), ASCII))[rng.permutation(800)])
    chance = shuffled[: len(" ".join(chosen.sentences))]

    def kinds(text):
        return len(set(units(text)[1]) & set(TARGET.pairs))

    ours = kinds(" ".join(chosen.sentences))
    assert ours > 1.05 * kinds(" ".join(printed.sentences))
    assert ours > 1.05 * kinds(chance)


def test_accented_and_other_characters_come_when_asked_for():
    prompt = prompt_pages.prompt(corpus.shipped_sentences(), TARGET, corpus.PRINTABLE + "öß€ßŵ", pages=1, lines=30)
    assert set("öß€ŵ") <= set(text_of(prompt))
    assert not set(text_of(prompt)) - ASCII - set("öß€ŵ")
    assert prompt.pages[-1][-1].endswith("ŵŵ")


def test_a_corpus_of_ones_own():
    own = ["The cat sat on the mat.", "A dog ran off with it.", "Zoë cried."]
    prompt = prompt_pages.prompt(own, sentence_choice.frequencies(own), "act", pages=1, lines=3, width=40)
    assert set(prompt.sentences) <= {"The cat sat on the mat.", "A dog ran off with it.", "Zoe cried."}
    assert len(prompt.sentences) == 3
    whole = prompt_pages.prompt(own, sentence_choice.frequencies(own), pages=1, lines=23)
    assert pangrams(whole.sentences[:1]) == [0]  # the corpus has none
    assert set(corpus.PRINTABLE) <= set(text_of(whole))


@pytest.mark.slow
def test_what_does_not_fit_is_refused():
    with pytest.raises(DoesNotFit, match="characters asked for do not fit on a page of 2 lines of 51"):
        prompt_pages.prompt(corpus.shipped_sentences(), TARGET, pages=1, lines=2)
    crowded = prompt_pages.prompt(corpus.shipped_sentences(), TARGET, pages=1, lines=5)
    assert set(corpus.PRINTABLE) <= set(text_of(crowded)) and len(crowded.pages[0]) == 5
    with pytest.raises(InputError, match="No sentence"):
        prompt_pages.prompt(["Привет всем", "one"], TARGET)
    with pytest.raises(InputError, match="leave no room"):
        prompt_pages.prompt(corpus.shipped_sentences(), TARGET, lines=0)


@given(st.sets(st.sampled_from("abcdefgh"), max_size=8), st.lists(st.text("abcdef ", max_size=9), max_size=6))
def test_closing_holds_all_that_is_missing(missing, texts):
    found = Closing(texts).sentences(missing, texts[:1])
    assert missing <= set(" ".join(found))
    assert texts[:1] == [] or texts[0] not in found or set(texts[0]) <= missing | {" "}


@given(st.lists(st.text("abc ", min_size=1, max_size=30).filter(str.strip), max_size=12))
def test_a_page_filled_step_by_step_is_wrapped_as_a_whole(texts):
    page = prompt_pages._FilledPage(100, 12)
    for text in texts:
        page.add(" ".join(text.split()))
    assert page.lines == prompt_pages.wrap(" ".join(" ".join(text.split()) for text in texts), 12)
    used = sum(map(len, page.lines[-1:]))
    assert page.characters_left == (100 - max(len(page.lines), 1) + 1) * 12 - (used + 1 if page.lines else 0)


@pytest.mark.slow
def test_five_thousand_sentences_take_little_time():
    rng = np.random.default_rng(2)
    vocabulary = np.array(" ".join(corpus.usable(corpus.shipped_sentences(), ASCII)).split())
    many = [" ".join(rng.choice(vocabulary, 14).tolist()) + "." for _ in range(5000)]
    start = time.process_time()
    prompt = prompt_pages.prompt(many, TARGET)
    assert time.process_time() - start < 4.0  # half of that here, on a machine at rest
    assert 88 <= sum(map(len, prompt.pages)) <= 92
