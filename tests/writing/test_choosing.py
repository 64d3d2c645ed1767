"""Choice of glyphs: exact, repeatable, varied, and clear about what a hand lacks."""

import re
from collections import Counter
from dataclasses import replace
from itertools import combinations, groupby, pairwise, product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.hand.places import PLACES
from handout.hand.vetting import vet
from handout.page_sizes import page
from handout.writing.choosing import GlyphChooser
from handout.writing.compose import each_page
from handout.writing.explaining import choices_sheet, explain, reasons
from handout.writing.glyph_index import WEIGHTS, GlyphIndex, _sampled, index_glyphs
from handout.writing.layout import Layout
from handout.writing.legibility import misreadings
from handout.writing.text import Letter


@pytest.fixture(scope="module")
def kept(small_hand):
    return index_glyphs(small_hand)


def words_of(text):
    """The words of a text as letters that are wanted."""
    at = iter(range(len(text)))
    return [[Letter(letter, (), next(at)) for letter in word] for word in text.split(" ")]


def chosen(kept, text, seed, variation=1.0):
    """The glyphs of each word."""
    chooser = GlyphChooser(kept, np.random.default_rng(seed), variation)
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


def test_words_of_the_source_come_over_whole(kept, small_page):
    glyphs, whole = kept.hand.glyphs, 0
    clear = vet(kept.hand).sure & (misreadings(kept.hand) < 0.3)  # others are written where they need not be
    doubtful = {glyph.at for glyph, sure in zip(glyphs, clear, strict=True) if not sure}
    for word in re.finditer(r"\w+", small_page.written):
        if not doubtful & {*range(*word.span())}:
            (numbers,) = chosen(kept, word.group(), 0, variation=0)
            assert all(kept.after[a] == b for a, b in pairwise(numbers.tolist())), word.group()
            whole += 1
    assert whole >= 8


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
    alike = []  # shares of letters that two seeds write with one glyph: of one text alone they are much by chance
    for one in (text, "the fine tin is in the net and then eat it", "seen fit line often test net ten tent"):
        made = [np.concatenate(chosen(kept, one, seed)) for seed in range(6)]
        alike += [(a == b).mean() for a, b in combinations(made, 2)]
    assert np.mean(alike) < 0.87
    ways = [len({tuple(word) for word in chosen(kept, text, seed)[k::3]}) for seed in range(4) for k in range(3)]
    assert np.mean(ways) > 2, "the same word is written in several ways, of four times"
    still = chosen(kept, text, 1, variation=0)
    words = words_of(text)
    varied = sum(total(kept, word, numbers) for word, numbers in zip(words, chosen(kept, text, 1), strict=True))
    assert sum(total(kept, word, numbers) for word, numbers in zip(words, still, strict=True)) < varied


def test_what_was_written_lately_is_dear_and_forgotten(kept):
    ages = [*np.arange(1.0, WEIGHTS.forgotten + 50, 10), np.inf]
    costs = kept.repetition(np.array(ages)).tolist()
    assert costs[0] == pytest.approx(WEIGHTS.again * (1 - 1 / WEIGHTS.forgotten))
    assert costs == sorted(costs, reverse=True) and costs[-1] == 0
    first, second = chosen(kept, "e e", 3)
    assert first[0] != second[0], "the second word knows the first"


@pytest.mark.parametrize("cost", [9.0, np.inf])
def test_what_read_wrongly_is_not_written_again(kept, cost):
    """The door of a reader: a glyph for one letter of the text is made dear."""
    chooser = GlyphChooser(kept, np.random.default_rng(2))
    plain = [chooser.word(word) for word in words_of("ten hen men")]
    number, at = int(plain[1].numbers[1]), plain[1].letters[1].at
    other = chooser.again(plain[1], {(at, number): cost})
    assert other.numbers[1] != number
    assert "".join(kept.letters[n] for n in other.numbers) == "hen"
    # nothing is written until it is kept, and then it counts as what was written
    assert np.array_equal(chooser.again(plain[1], {(at, number): cost}).numbers, other.numbers)
    chooser.keep(other)
    (last,) = words_of("e")
    follows = chooser.word(last)
    assert follows.again[0][np.isin(follows.candidates[0].numbers, other.numbers[1])] > 4
    assert follows.again[0][follows.candidates[0].numbers == number] == 0 or number in plain[0].numbers


def test_a_word_at_the_same_prices_is_chosen_as_it_was(kept):
    chooser = GlyphChooser(kept, np.random.default_rng(5))
    word = [chooser.word(word) for word in words_of("ten hen men")][-1]
    assert np.array_equal(chooser.again(word, {}).numbers, word.numbers)


def test_one_word_of_a_text_is_written_again_and_the_others_stay(small_hand):
    layout = Layout(page("100x80mm"), x_height=2.5)

    def inks(proofread=None):
        (sheet,) = each_page("the ten hen men", small_hand, layout, np.random.default_rng(3), proofread=proofread)
        return [placed.ink for line in sheet.manuscript.lines for placed in line.placed]

    def look(paragraph):
        k = next(k for k, unit in enumerate(paragraph.units) if "".join(unit.word.spelt) == "hen")
        number = int(paragraph.choices[k].numbers[1])
        attempt = paragraph.again(k, {(paragraph.choices[k].letters[1].at, number): np.inf})
        assert attempt.unit.word.glyphs[1].number != number
        paragraph.keep(attempt)

    look.words = []
    plain, again = inks(), inks(look)
    hen = slice(6, 9)
    assert again[7].number != plain[7].number
    for one, other in zip(plain[:6] + plain[9:], again[:6] + again[9:], strict=True):
        assert one.number == other.number
        # where it stood, but for what comes after the other word; as it was bent
        assert np.ptp(one.graph.xy, axis=0) == pytest.approx(np.ptp(other.graph.xy, axis=0), rel=5e-3)
        assert one.graph.xy[:, 1] == pytest.approx(other.graph.xy[:, 1], abs=0.1)
    rises = [[ink.graph.xy[:, 1].mean() for ink in made[hen]] for made in (plain, again)]
    assert np.mean(rises[0]) == pytest.approx(np.mean(rises[1]), abs=0.3 * 2.5)  # a third of the x-height
    ends = [made[5].graph.xy[:, 0].max() - made[6].graph.xy[:, 0].min() for made in (plain, again)]
    assert ends[1] == pytest.approx(ends[0], abs=1.0)


def test_what_a_hand_has_less_of_changes_the_words_that_used_it(kept, small_hand):
    """Chance belongs to each glyph: it does not fall otherwise where there are fewer."""
    text = "ten hen men the tin net eat then fine line seen often tent hat mat then ten in the mine an inn teen " * 2
    before = chosen(kept, text.strip(), 5)
    number = Counter(n for word in before for n in word.tolist()).most_common()[3][0]
    refused = kept.refused.copy()
    refused[number] = True
    after = chosen(replace(kept, refused=refused), text.strip(), 5)
    others = [not np.array_equal(a, b) for a, b in zip(before, after, strict=True) if number not in a]
    assert not any(number in word for word in after)
    assert sum(others) < 0.4 * len(others)


def test_what_is_written_behind_a_new_word_mostly_stays(kept):
    words = ("ten hen men the tin net eat then fine line seen often tent hat mat in mine an inn teen " * 3).split()
    before, after = (chosen(kept, " ".join(text), 5) for text in (words, [*words[:9], "meant", *words[9:]]))
    others = [not np.array_equal(a, b) for a, b in zip(before, after[:9] + after[10:], strict=True)]
    assert not any(others[:9]) and sum(others[9:]) < 0.4 * len(others[9:])
    assert not any(others[-20:])


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
        even_price=np.zeros(300),
        of=lambda letter, place=None: np.arange(300),
    )
    pool = GlyphIndex.all_candidates(rich, "e", PLACES[0])
    drawn = [_sampled(pool, 1, seed) for seed in range(60)]
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
