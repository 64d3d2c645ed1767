"""Choice of glyphs: exact, repeatable, varied, and clear about what a hand lacks."""

from itertools import combinations, groupby, pairwise, product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.hand.places import PLACES
from handout.page_sizes import page
from handout.writing.choosing import Chooser, Prices
from handout.writing.compose import compose
from handout.writing.explaining import choices_sheet, explain, reasons
from handout.writing.glyph_index import WEIGHTS, GlyphIndex, _sampled, index_glyphs
from handout.writing.layout import Layout
from handout.writing.text import Letter


@pytest.fixture(scope="module")
def kept(small_hand):
    return index_glyphs(small_hand)


def words_of(text):
    """The words of a text as letters that are wanted."""
    at = iter(range(len(text)))
    return [[Letter(letter, (), next(at)) for letter in word] for word in text.split(" ")]


def chosen(kept, text, seed, variation=1.0, prices=None):
    """The glyphs of each word."""
    chooser = Chooser(kept, np.random.default_rng(seed), variation, prices)
    return [chooser.word(word).numbers for word in words_of(text)]


def total(kept, word, numbers):
    """What a whole choice of a word costs without chance, letter by letter."""
    pools = kept.candidates(word, None)
    own = sum(float(p.cost[p.numbers == n][0]) for p, n in zip(pools, numbers, strict=True))
    pairs = [kept.steps(np.array([a]), np.array([b]), varied=False)[0, 0] for a, b in pairwise(numbers)]
    return own + sum(pairs) + float(kept.ending(np.array(numbers[-1:]))[0])


@pytest.mark.slow
@pytest.mark.parametrize("text", ["th", "an", "mite"])
def test_without_variation_nothing_is_cheaper(kept, text):
    (word,) = words_of(text)
    pools = kept.candidates(word, None)
    least = min(total(kept, word, numbers) for numbers in product(*(p.numbers.tolist() for p in pools)))
    (numbers,) = chosen(kept, text, 0, variation=0)
    assert total(kept, word, numbers) == pytest.approx(least)
    assert list(numbers) == list(chosen(kept, text, 1, variation=0)[0])


def test_a_word_of_the_source_comes_over_whole(kept):
    (numbers,) = chosen(kept, "minute", 0, variation=0)
    assert all(kept.after[a] == b for a, b in pairwise(numbers.tolist()))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.text("aehimnotu", min_size=1, max_size=6), min_size=1, max_size=6), st.integers(0, 99))
def test_every_letter_is_what_was_wanted_and_a_seed_tells_all(kept, words, seed):
    numbers = chosen(kept, " ".join(words), seed)
    assert ["".join(kept.letters[n] for n in word) for word in numbers] == words
    assert all(map(np.array_equal, numbers, chosen(kept, " ".join(words), seed)))
    # no glyph twice in a word that could do without
    for word in numbers:
        for letter, same in groupby(sorted((kept.letters[n], int(n)) for n in word), lambda pair: pair[0]):
            own = [n for _, n in same]
            assert len(set(own)) == len(own) or len(kept.of(letter)) <= 2 * len(own)


def test_texts_and_words_differ(kept):
    text = "ten hen then " * 3 + "ten hen then"
    made = [np.concatenate(chosen(kept, text, seed)) for seed in range(6)]
    assert np.mean([(a == b).mean() for a, b in combinations(made, 2)]) < 0.8
    assert len({tuple(word) for word in chosen(kept, text, 1)[::3]}) > 1
    still = chosen(kept, text, 1, variation=0)
    words = words_of(text)
    varied = sum(total(kept, word, numbers) for word, numbers in zip(words, chosen(kept, text, 1), strict=True))
    assert sum(total(kept, word, numbers) for word, numbers in zip(words, still, strict=True)) < varied


def test_what_was_written_lately_is_dear_and_forgotten(kept):
    ages, once = np.arange(1.0, WEIGHTS.forgotten + 50, 10), np.zeros(1)
    costs = [float(kept.repetition(np.array([age]), once)[0]) for age in ages]
    assert costs[0] == pytest.approx(WEIGHTS.again * (1 - 1 / WEIGHTS.forgotten))
    assert costs == sorted(costs, reverse=True) and costs[-1] == 0
    first, second = chosen(kept, "e e", 3)
    assert first[0] != second[0], "the second word knows the first"


@pytest.mark.parametrize("cost", [9.0, np.inf])
def test_what_read_wrongly_is_not_written_again_and_other_words_stay(kept, cost):
    """The door of a reader: a glyph for one letter of the text is made dear, or all others are."""
    text = "ten hen men"
    plain = chosen(kept, text, 2)
    number, at = int(plain[1][1]), words_of(text)[1][1].at
    one = chosen(kept, text, 2, prices=Prices(glyphs={(at, number): cost}))
    assert one[1][1] != number
    assert np.array_equal(one[0], plain[0])
    places = [letter.at for letter in words_of(text)[2]]
    held = dict(zip(places, plain[2].tolist(), strict=True))
    other = chosen(kept, text, 2, prices=Prices({(at, number): cost}, held))
    assert np.array_equal(other[1], one[1]) and np.array_equal(other[2], plain[2])


def test_a_text_is_composed_again_with_one_glyph_less(small_hand):
    layout = Layout(page("100x80mm"), x_height=2.5)

    def inks(prices=None):
        (sheet,) = compose("the ten hens", small_hand, layout, np.random.default_rng(3), prices=prices)
        return [placed.ink for line in sheet.lines for placed in line.placed]

    plain = inks()
    again = inks(Prices(glyphs={(9, plain[7].number): np.inf}))
    assert again[7].number != plain[7].number
    assert [ink.number for ink in again[:6]] == [ink.number for ink in plain[:6]]
    # bent alike, too: each glyph of the words before has as much ink, as wide
    for one, other in zip(plain[:6], again[:6], strict=True):
        assert np.ptp(one.graph.xy[:, 0]) == pytest.approx(np.ptp(other.graph.xy[:, 0]), rel=0.05)


def test_few_exact_glyphs_let_others_in_at_a_cost(kept):
    pool = kept.all_candidates("e", "alone")
    assert len(kept.of("e", "alone")) == 0 and (pool.cost >= 0.5).all()
    assert set(pool.numbers) == set(kept.of("e"))


def test_of_many_good_glyphs_others_are_offered_each_time(kept):
    """A hand of several pages would otherwise write with the best of each letter alone."""
    doubt = np.where(np.arange(300) < 200, 0.1, 3.0)
    rich = SimpleNamespace(
        intrinsic_cost=doubt,
        refused=np.zeros(300, dtype=bool),
        places=np.zeros(300, dtype=int),
        of=lambda letter, place=None: np.arange(300),
    )
    pool = GlyphIndex.all_candidates(rich, "e", PLACES[0])
    rng = np.random.default_rng(0)
    drawn = [_sampled(pool, rng) for _ in range(60)]
    assert all((np.diff(part.numbers) > 0).all() and part.numbers.max() < 200 for part in drawn)
    assert len(set(np.concatenate([part.numbers for part in drawn]).tolist())) == 200
    (word,) = words_of("eeee")
    assert all(np.array_equal(a.numbers, b.numbers) for a, b in pairwise(kept.candidates(word, None)[1:3]))


@pytest.mark.parametrize("variation", [0.0, 1.0])
def test_an_explanation_tells_of_the_choice(kept, small_hand, variation):
    places = explain(small_hand, "the hen", np.random.default_rng(4), variation)
    numbers = np.concatenate(chosen(kept, "the hen", 4, variation))
    assert [place.numbers[place.choice] for place in places] == numbers.tolist()
    for place in places:
        assert place.order[0] == place.choice or place.total[place.choice] == pytest.approx(place.total.min())
    lines = reasons(small_hand, places)
    assert len(lines) == 6 and lines[0].startswith("t start: glyph")
    sheet = choices_sheet(small_hand, places)
    assert sheet.dtype == np.uint8 and sheet.shape[2] == 3 and (sheet < 128).any(axis=2).sum() > 500
