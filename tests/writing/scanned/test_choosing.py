"""Choice of glyphs: exact, repeatable, varied, and clear about what a hand lacks."""

from itertools import combinations, groupby, pairwise, product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import MissingCharacters
from handout.hand.places import PLACES
from handout.writing.choice import viterbi
from handout.writing.scanned.candidates import TargetLetter, _all_candidates, _sampled, candidates_of
from handout.writing.scanned.choice_costs import WEIGHTS, UsageHistory
from handout.writing.scanned.choosing import choose
from handout.writing.scanned.explaining import choices_sheet, explain, reasons
from handout.writing.scanned.glyph_index import index_glyphs


@pytest.fixture(scope="module")
def kept(small_hand):
    return index_glyphs(small_hand)


def asked(text):
    """A text as letters that are wanted."""
    found, at = [], 0
    for word, letters in enumerate(text.split(" ")):
        for i, letter in enumerate(letters):
            place = (
                "alone" if len(letters) == 1 else "start" if i == 0 else "end" if i == len(letters) - 1 else "middle"
            )
            found.append(TargetLetter(letter, place, word, at))
            at += 1
        at += 1
    return found


def total(kept, wanted, numbers):
    """What a whole choice costs without chance, letter by letter."""
    pools = candidates_of(kept, wanted)
    own = sum(float(p.cost[p.numbers == n][0]) for p, n in zip(pools, numbers, strict=True))
    pairs = zip(wanted, wanted[1:], numbers, numbers[1:], strict=False)
    one = [kept.transitions.cost(np.array([a]), np.array([b]), v.word != w.word)[0, 0] for v, w, a, b in pairs]
    return own + sum(one) + float(kept.transitions.cut(np.array(numbers[-1:]))[0])


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 4), min_size=1, max_size=5), st.integers(0, 2**32 - 1))
def test_the_cheapest_sequence_is_the_cheapest_of_all(sizes, seed):
    rng = np.random.default_rng(seed)
    unary = [rng.normal(size=k) for k in sizes]
    steps = [rng.normal(size=pair) for pair in pairwise(sizes)]

    def cost(path):
        between = sum(step[a, b] for step, a, b in zip(steps, path, path[1:], strict=False))
        return between + sum(own[k] for own, k in zip(unary, path, strict=True))

    path = viterbi(unary, steps)
    assert cost(path) == pytest.approx(min(cost(p) for p in product(*map(range, sizes))))


@pytest.mark.slow
@pytest.mark.parametrize("text", ["th", "an", "mite", "it me"])
def test_without_variation_nothing_is_cheaper(kept, text):
    wanted = asked(text)
    pools = candidates_of(kept, wanted)
    least = min(total(kept, wanted, numbers) for numbers in product(*(p.numbers.tolist() for p in pools)))
    chosen = choose(kept, wanted, np.random.default_rng(0), variation=0)
    assert total(kept, wanted, chosen) == pytest.approx(least)
    assert list(chosen) == list(choose(kept, wanted, np.random.default_rng(1), variation=0))


def test_a_word_of_the_source_comes_over_whole(kept):
    numbers = choose(kept, asked("minute"), np.random.default_rng(0), variation=0)
    assert all(kept.after[a] == b for a, b in pairwise(numbers.tolist()))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.text("aehimnotu", min_size=1, max_size=6), min_size=1, max_size=6), st.integers(0, 99))
def test_every_letter_is_what_was_wanted_and_a_seed_tells_all(kept, words, seed):
    wanted = asked(" ".join(words))
    numbers = choose(kept, wanted, np.random.default_rng(seed))
    assert [kept.letters[n] for n in numbers] == [one.letter for one in wanted]
    assert np.array_equal(numbers, choose(kept, wanted, np.random.default_rng(seed)))
    # no glyph twice in a word that could do without
    for _, word in groupby(zip(wanted, numbers, strict=True), lambda pair: pair[0].word):
        for letter, same in groupby(sorted((one.letter, int(n)) for one, n in word), lambda pair: pair[0]):
            own = [n for _, n in same]
            assert len(set(own)) == len(own) or len(kept.of(letter)) <= 2 * len(own)


def test_texts_and_words_differ(kept):
    wanted = asked("ten hen then " * 4)[:-1]
    made = [choose(kept, wanted, np.random.default_rng(seed)) for seed in range(6)]
    assert np.mean([(a == b).mean() for a, b in combinations(made, 2)]) < 0.7
    first = made[1]
    words = {tuple(first[i : i + 3]) for i in range(0, len(first), 10)}
    assert len(words) > 1
    still = choose(kept, wanted, np.random.default_rng(1), variation=0)
    assert total(kept, wanted, still) < total(kept, wanted, first)


def test_what_was_written_lately_is_dear_and_forgotten(kept):
    used = UsageHistory(len(kept))
    number = kept.of("e")[:1]
    used.write(number)
    assert used.cost(number, 0)[0] == pytest.approx(WEIGHTS.again * (1 - 1 / WEIGHTS.forgotten))
    costs = [used.cost(number, ahead)[0] for ahead in range(0, int(WEIGHTS.forgotten) + 50, 10)]
    assert costs == sorted(costs, reverse=True) and costs[-1] == 0
    # the second part of a text knows the first
    wanted = asked("e")
    number = choose(kept, wanted, np.random.default_rng(3), history=used)
    assert number[0] != kept.of("e")[0] and used.cost(number, 0)[0] > 0.9 * WEIGHTS.again


def test_what_is_missing_is_listed_with_its_places(kept):
    with pytest.raises(MissingCharacters, match=r"'X' \(characters 4, 6 of the text\), 'ß' \(character 8") as error:
        choose(kept, asked("an XaXaß"), np.random.default_rng(0))
    assert "small" in str(error.value)
    assert choose(kept, [], np.random.default_rng(0)).tolist() == []


def test_a_capital_is_borrowed(kept):
    wanted = asked("Men")
    numbers = choose(kept, wanted, np.random.default_rng(0))
    assert kept.letters[numbers[0]] == "m"
    small, capital = (candidates_of(kept, asked(text))[0].cost.min() for text in ("men", "Men"))
    assert capital == pytest.approx(small + 1)


def test_few_exact_glyphs_let_others_in_at_a_cost(kept):
    (pool,) = candidates_of(kept, [TargetLetter("e", "alone", 0, 0)])
    assert len(kept.of("e", "alone")) == 0 and (pool.cost >= 0.5).all()
    assert set(pool.numbers) == set(kept.of("e"))


def test_of_many_good_glyphs_others_are_offered_each_time(kept):
    """A hand of several pages would otherwise write with the best of each letter alone."""
    letters = tuple("e" for _ in range(300))
    doubt = np.where(np.arange(300) < 200, 0.1, 3.0)
    one = np.zeros(300, dtype=int)
    rich = SimpleNamespace(
        intrinsic_cost=doubt, places=one, of=lambda letter, place=None: np.arange(300), letters=letters
    )
    pool = _all_candidates(rich, "e", PLACES[0])
    rng = np.random.default_rng(0)
    drawn = [_sampled(pool, rng) for _ in range(60)]
    assert all((np.diff(part.numbers) > 0).all() and part.numbers.max() < 200 for part in drawn)
    assert len(set(np.concatenate([part.numbers for part in drawn]).tolist())) == 200
    wanted = asked("eee")
    assert all(np.array_equal(a.numbers, b.numbers) for a, b in pairwise(candidates_of(kept, wanted)[1:]))


@pytest.mark.parametrize("variation", [0.0, 1.0])
def test_an_explanation_tells_of_the_choice(kept, small_hand, variation):
    wanted = asked("the hen")
    told = explain(kept, wanted, np.random.default_rng(4), variation=variation)
    chosen = choose(kept, wanted, np.random.default_rng(4), variation=variation)
    assert [one.numbers[one.choice] for one in told] == chosen.tolist()
    for one in told:
        assert one.order[0] == one.choice or one.total[one.choice] == pytest.approx(one.total.min())
    lines = reasons(kept, told)
    assert len(lines) == 6 and lines[0].startswith("t start: glyph")
    sheet = choices_sheet(small_hand, told)
    assert sheet.dtype == np.uint8 and sheet.shape[2] == 3 and (sheet < 128).any(axis=2).sum() > 500
