"""Figures of answers: intervals as in tables, wider where answers hang together; what counts and what does not."""

import numpy as np
import pytest

from handout.errors import InputError
from handout_lab.study import scoring
from handout_lab.study.answers import Answer
from handout_lab.study.design import Item, Key, Person, Snippet
from handout_lab.study.figure import figure
from handout_lab.study.scoring import Judgement


def judged(rights, kind="A", condition="made"):
    """Answers of people (rows) to snippets (columns): whether each is right."""
    return [
        Judgement(person, kind, n, condition, "me", "made" if n % 2 else "real",
                  ("made" if n % 2 else "real") if right else ("real" if n % 2 else "made"))
        for person, row in enumerate(rights, 1) for n, right in enumerate(row)
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("right", "of", "low", "high"),
    [(0, 10, 0.0, 0.3085), (5, 10, 0.1871, 0.8129), (10, 10, 0.6915, 1.0), (8, 20, 0.1912, 0.6395)],
)
def test_exact_intervals_are_those_of_the_tables(right, of, low, high):
    assert scoring.exact_interval(right, of) == pytest.approx((low, high), abs=2e-4)


def test_answers_that_hang_together_are_worth_less():
    rng = np.random.default_rng(1)
    alike = scoring.share_of(judged(np.repeat(rng.random((30, 1)) < 0.6, 10, axis=1)))  # all of a person's are the same
    apart = scoring.share_of(judged(rng.random((30, 10)) < 0.6))
    width = [interval[1] - interval[0] for interval in (alike.exact, alike.people, apart.people, apart.exact)]
    assert width[1] > 2.5 * width[0] and width[2] == pytest.approx(width[3], rel=0.35)
    words = scoring.share_of(judged(np.repeat(rng.random((1, 40)) < 0.6, 30, axis=0)))
    assert words.both[1] - words.both[0] > 2.5 * (words.people[1] - words.people[0])
    assert all(a <= b <= c for a, b, c in [(s.both[0], s.share, s.both[1]) for s in (alike, apart, words)])


def test_all_right_is_not_certain():
    share = scoring.share_of(judged(np.ones((4, 5), dtype=bool)))
    assert share.both == share.exact == pytest.approx((0.8316, 1.0), abs=1e-4) and share.p < 1e-4


def test_one_person_tells_nothing_of_others_and_one_word_of_other_words():
    one = scoring.share_of(judged([[True] * 6 + [False] * 4]))
    assert one.people == one.both == (0.0, 1.0) and one.exact == pytest.approx((0.2624, 0.8784), abs=1e-4)
    word = scoring.share_of(judged([[True], [True], [False], [True]]))
    assert word.both == (0.0, 1.0) != word.people


def test_skill_is_told_from_chance():
    rng = np.random.default_rng(2)
    alike = scoring.skill_of(judged(rng.random((200, 20)) < 0.6))
    differ = scoring.skill_of(judged(rng.random((200, 20)) < rng.choice([0.4, 0.8], (200, 1))))
    assert alike.spread < 0.04 and alike.p > 0.01
    few = [scoring.skill_of(judged(rng.random((100, 5)) < rng.choice([0.4, 0.8], (100, 1)))) for _ in range(20)]
    assert np.mean([each.spread for each in few]) == pytest.approx(0.2, abs=0.012)
    assert scoring.skill_of(judged([[True], [False]])).spread == 0
    assert differ.spread == pytest.approx(0.2, abs=0.03) and differ.p < 1e-6
    assert sum(differ.scores.values()) == 200 and sum(differ.expected.values()) == pytest.approx(200)
    assert len(differ.above) > 60 and 2 < differ.above_by_chance < 10


def test_confusions_tell_skill_from_bias():
    always_made = [Judgement(1, "A", n, "made", "me", truth, "made") for n, truth in enumerate(["real", "made"] * 20)]
    found = scoring.confusions_of(always_made, ("real", "made"))
    assert found.counts["real", "made"] == 20 and found.sensitivity == pytest.approx(0) and found.bias < -1.5
    good = scoring.confusions_of(judged(np.arange(40)[None] >= 4), ("real", "made"))
    assert good.sensitivity > 2 and abs(good.bias) < 0.01


def test_conditions_are_compared_within_people():
    hard, easy = judged(np.arange(10)[None].repeat(20, 0) % 2 < 1, "B"), judged(np.ones((20, 4)), "B", "control")
    (test,) = scoring.conditions_test([*hard, *easy], np.random.default_rng(1))
    assert (test.first, test.second) == ("made", "control") and test.p < 0.001
    assert scoring.difficulty_histogram([*hard, *easy]) == scoring.difficulty_histogram(hard)
    (same,) = scoring.conditions_test([*hard, *judged(np.arange(4)[None].repeat(20, 0) % 2 < 1, "B", "control")],
                                      np.random.default_rng(1))  # fmt: skip
    assert same.p > 0.5


def test_conditions_that_nobody_saw_both_of_are_compared_between_people():
    def parted(rate, seed):
        rng = np.random.default_rng(seed)
        ours = judged(rng.random((15, 10)) < 0.5)
        others = judged(np.repeat(rng.random((30, 1)) < rate, 10, axis=1), "A", "random")
        (test,) = scoring.conditions_test([*ours, *(each for each in others if each.person > 15)], rng)
        return test.p

    assert parted(0.95, 1) < 0.001
    assert sum(parted(0.5, seed) < 0.05 for seed in range(8)) <= 1  # though people are alike all through


KEY = Key(1, ("me",), tuple(Snippet(0, 0, k, f"words {k}", 0, "q" if k == 1 else "") for k in range(4)), (
    Person((Item(0, "real"), Item(1, "made")), (Item(2, "left"), Item(3, "right", "control"))),
    Person((Item(0, "made"), Item(1, "real")), (Item(2, "right"), Item(3, "left", "control"))),
    Person((Item(0, "made"), Item(1, "real")), ()),
))  # fmt: skip


def said(person, *given, consent="yes"):
    rows = [Answer("s", person, "P", "consent", consent), Answer("s", person, "P", "age", "20 to 39")]
    return rows + [Answer("s", person, kind, item, answer) for kind, item, answer in given]


def test_what_counts_is_said():
    rows = [
        *said(1, ("A", "1", "real"), ("A", "2", "real"), ("B", "1", "left"), ("B", "2", "right")),
        *said(2, ("A", "1", "made"), ("A", "2", ""), ("B", "1", "left"), ("B", "2", "right")),
        *said(3, ("A", "1", "made"), consent=""),
        Answer("s", 2, "A", "2", "real", "doubtful", "2 boxes"),
    ]
    taken = scoring.taken(KEY, rows)
    assert (len(taken.judged), taken.empty, taken.decided, taken.unwilling) == (8, 1, 1, (3,))
    found = scoring.scores(KEY, taken)
    assert (found["A"].share.right, found["A"].share.of, found["B"].share.of) == (3, 4, 2)
    assert {name: each.of for name, each in found["B"].conditions.items()} == {"control": 2, "made": 2}
    assert found["A"].groups["age"]["20 to 39"].of == 4
    assert found["A"].groups["made"]["a letter that the hand lacked"].right == 0
    assert scoring.taken(KEY, [row for row in rows if (row.person, row.questionnaire) != (2, "P")]).unwilling == (2, 3)
    assert scoring.taken(KEY, rows, least_controls=1).careless == (2,)
    with pytest.raises(InputError, match="No answer counts"):
        scoring.taken(KEY, rows, least_controls=2)
    with pytest.raises(InputError, match="was not asked A 3"):
        scoring.taken(KEY, said(1, ("A", "3", "real")))
    worst = scoring.difficulties(KEY, taken.judged)[0]
    assert (worst.text, worst.found_out) == ("words 1", 0) and worst.real.right == 1
    drawing = figure(found, {"A": scoring.difficulty_histogram(taken.judged)}, "<s>").decode()
    assert drawing.startswith("<svg") and "75.0%" in drawing and "&lt;s&gt;" in drawing
