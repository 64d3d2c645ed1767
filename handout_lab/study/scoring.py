"""Answers and key to figures: shares told right with their intervals, people's skill, difficulty, confusions.

Three intervals of 95 % go with each share, and which is right depends on what is asked of it:

- `exact` (Clopper and Pearson 1934) takes all answers as independent.  They are not where people differ in skill, or
  snippets in difficulty, and then it is too narrow: it held the truth in 82–92 of 100 simulated studies.
- `people` allows for the answers of one person being alike: it holds for other people who see these snippets.
- `both` allows for the answers to one snippet being alike, too: it holds for other people and other words in these
  hands, which is what a study is asked for, and the one to report; it held the truth in 96–98 of 100.

The last two are Korn and Graubard's (1998): Clopper and Pearson's for as many independent answers as would be as sure
as the clustered ones are; the variance of clusters is that of sums of residuals, in two ways by Cameron, Gelbach and
Miller (2011).

Source: figure 14 of seed 000, table 1 of seed 001.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.values import Array, Indices
from handout_lab.study import design
from handout_lab.study.answers import DOUBTFUL, Answer
from handout_lab.study.design import CONTROL, ENVELOPES, MADE, OURS, PAIRS, REAL, SINGLES, Key
from handout_lab.study.sheets import COVER

LEVEL = 0.95  # of intervals
GUESSING = 0.5  # the share of who tells nothing: all questions have two answers
_PERMUTATIONS = 9999  # of the test of conditions: the least p is 0.0001
_RARE = 0.05  # of those who guess, who would score as well as is called above chance
_BINS = 10  # of the histogram of difficulty


@dataclass(frozen=True)
class Judgement:
    """One answer, and what is true."""

    person: int
    questionnaire: str
    snippet: int
    condition: str
    hand: str
    truth: str
    answer: str

    @property
    def right(self) -> bool:
        """Whether it is."""
        return self.answer == self.truth


Interval = tuple[float, float]


@dataclass(frozen=True)
class Share:
    """How many of some answers are right.

    exact, people, both : intervals; see above.  p : of guessing, two-sided, for other people and words, as `both`.
    """

    right: int
    of: int
    exact: Interval
    people: Interval
    both: Interval
    p: float

    @property
    def share(self) -> float:
        """0–1."""
        return self.right / self.of if self.of else float("nan")


def exact_interval(right: float, of: float, level: float = LEVEL) -> Interval:
    """Clopper and Pearson's interval of a share; numbers need not be whole."""
    from scipy.stats import beta

    tail = (1 - level) / 2
    low = float(beta.ppf(tail, right, of - right + 1)) if right > 0 else 0.0
    high = float(beta.ppf(1 - tail, right + 1, of - right)) if right < of else 1.0
    return low, high


def share_of(judged: Sequence[Judgement]) -> Share:
    """The share of answers that are right."""
    right = np.array([one.right for one in judged], dtype=np.float64)
    people, snippets = (np.unique([key(one) for one in judged], return_inverse=True)[1] for key in _CLUSTERS)
    own = _clustered(right, people)
    two_way = max(own, _clustered(right, snippets), own + _clustered(right, snippets) - _clustered(right, None))
    counts = [len(np.unique(labels)) for labels in (people, snippets)]
    return Share(
        int(right.sum()),
        len(right),
        exact_interval(float(right.sum()), len(right)),
        _effective(right, own, counts[0]),
        _effective(right, two_way, min(counts)),
        _p(right, two_way, min(counts)),
    )


_CLUSTERS: tuple[Callable[[Judgement], int], ...] = (lambda one: one.person, lambda one: one.snippet)


def _clustered(right: Array, labels: NDArray[np.intp] | None) -> float:
    """Variance of the mean where answers of one label are alike."""
    residuals = right - right.mean()
    sums = residuals if labels is None else np.bincount(labels, residuals)
    count = len(sums)
    return float((sums**2).sum() / len(right) ** 2 * count / max(1, count - 1))


def _effective(right: Array, variance: float, clusters: int) -> Interval:
    """The exact interval for as many answers as, independent, would be as sure."""
    from scipy.stats import t

    if clusters < 2:  # one tells nothing of others, which is where the formula goes as its degrees of freedom run out
        return 0.0, 1.0
    n, share = len(right), float(right.mean())
    effective = float(n)
    if variance > 0:
        tail = (1 + LEVEL) / 2
        wider = float(t.ppf(tail, n - 1) / t.ppf(tail, clusters - 1))
        effective = min(n, share * (1 - share) / variance * wider**2)
    return exact_interval(share * effective, effective)


def _p(right: Array, variance: float, clusters: int) -> float:
    """How likely guessing would be as far from half, where answers of one cluster are alike."""
    from scipy.stats import binomtest, t

    exact = float(binomtest(int(right.sum()), len(right), GUESSING).pvalue)
    if variance <= 0 or clusters < 2:
        return exact
    return max(exact, float(2 * t.sf(abs(right.mean() - GUESSING) / np.sqrt(variance), clusters - 1)))


@dataclass(frozen=True)
class Skill:
    """How much people differ.

    scores : right answers → how many people have so many, of those who answered all rows; rows : that is.
    expected : the same if everybody guessed; spread : standard deviation of people's true shares, guesses left out.
    p : how likely people who are all alike would differ as much.
    above : who did better than 19 of 20 that guess; above_by_chance : how many would if all guessed.
    """

    rows: int
    scores: Mapping[int, int]
    expected: Mapping[int, float]
    spread: float
    p: float
    above: tuple[int, ...]
    above_by_chance: float


def skill_of(judged: Sequence[Judgement]) -> Skill:
    """How much people differ in a questionnaire."""
    from scipy.stats import binom

    of = Counter(one.person for one in judged)
    right = Counter(one.person for one in judged if one.right)
    rows = max(of.values())
    full = [person for person in of if of[person] == rows]
    least = int(binom.isf(_RARE, rows, GUESSING)) + 1
    scores = Counter(right[person] for person in full)
    spread, p = _spread(np.array([right[person] for person in of]), np.array(list(of.values())))
    return Skill(
        rows,
        {k: scores[k] for k in range(rows + 1)},
        {k: float(len(full) * binom.pmf(k, rows, GUESSING)) for k in range(rows + 1)},
        spread,
        p,
        tuple(sorted(person for person in full if right[person] >= least)),
        float(len(full) * binom.sf(least - 1, rows, GUESSING)),
    )


def _spread(right: Indices, of: Indices) -> tuple[float, float]:
    """Standard deviation of people's true shares, and how likely people who are all alike would differ as much."""
    from scipy.stats import chi2

    share, shares = float(right.sum() / of.sum()), right / of
    by_chance = float(np.mean(1 / of))  # of what a person's share varies, answers apart: p(1 - p)
    if len(of) < 2 or not 0 < share < 1 or by_chance == 1:
        return 0.0, 1.0
    single = share * (1 - share)
    statistic = float(((shares - share) ** 2 * of / single).sum())
    varies = float(np.var(shares, ddof=1))
    spread = float(np.sqrt(max(0.0, (varies - single * by_chance) / (1 - by_chance))))
    return spread, float(chi2.sf(statistic, len(of) - 1))


@dataclass(frozen=True)
class Difficulty:
    """How often a snippet was told: real from made in A, made from real in A, of two in B."""

    snippet: int
    text: str
    hand: str
    real: Share | None
    made: Share | None
    pair: Share | None

    @property
    def found_out(self) -> float:
        """Share of answers in which its made form was told, in A and B together."""
        parts = [share for share in (self.made, self.pair) if share is not None]
        return sum(s.right for s in parts) / sum(s.of for s in parts) if parts else float("nan")


@dataclass(frozen=True)
class Confusions:
    """What was said of what is true: (truth, answer) → how often; and what follows from that.

    sensitivity : d′, 0 for who tells nothing; bias : the criterion, above 0 for who says the second answer rarely.
    """

    counts: Mapping[tuple[str, str], int]
    sensitivity: float
    bias: float


def confusions_of(judged: Sequence[Judgement], answers: tuple[str, str]) -> Confusions:
    """The confusions of a questionnaire with two answers.

    Source: N. A. Macmillan, C. D. Creelman, "Detection Theory", 2005; extreme rates by M. L. Hautus, 1995.  In B the
    difference of the two is divided by √2, as in two-alternative forced choice.
    """
    from scipy.stats import norm

    counts = Counter((one.truth, one.answer) for one in judged)
    rates = [
        (counts[truth, answers[1]] + 0.5) / (counts[truth, answers[0]] + counts[truth, answers[1]] + 1)
        for truth in answers
    ]
    false, hit = (float(norm.ppf(rate)) for rate in rates)
    single = REAL in answers
    table = {(truth, answer): counts[truth, answer] for truth in answers for answer in answers}
    return Confusions(table, (hit - false) / (1 if single else float(np.sqrt(2))), -(hit + false) / 2)


@dataclass(frozen=True)
class Test:
    """Two conditions compared: how likely a chance difference is as large; Bonferroni's correction is in it."""

    first: str
    second: str
    p: float


def conditions_test(judged: Sequence[Judgement], rng: np.random.Generator) -> list[Test]:
    """Conditions, from the hardest to tell, each against the next.

    Labels are permuted within each person; where everybody saw one of the two alone, people are permuted whole.

    Source: seed 001, table 1 (a randomised permutation test of each row and the next, corrected after Bonferroni).
    """
    parts = grouped(judged, lambda one: one.condition)
    order = sorted(parts, key=lambda name: parts[name].share)
    pairs = list(pairwise(order))
    return [Test(a, b, min(1.0, len(pairs) * _permuted(judged, a, b, rng))) for a, b in pairs]


def _permuted(judged: Sequence[Judgement], a: str, b: str, rng: np.random.Generator) -> float:
    """How likely shuffled conditions are as far apart; b then has hypergeometrically many of a person's right ones."""
    parts: dict[int, list[int]] = defaultdict(lambda: [0, 0, 0, 0])  # of each person right and wrong ones of a, of b
    for one in judged:
        if one.condition in (a, b):
            parts[one.person][2 * (one.condition == b) + (not one.right)] += 1
    counts = np.array(list(parts.values()))
    right, of = counts[:, [0, 2]].sum(axis=1), counts.sum(axis=1)
    if not (counts[:, :2].any(axis=1) & counts[:, 2:].any(axis=1)).any():
        return _people_permuted(right, of, np.asarray(counts[:, 2:].any(axis=1)), rng)
    of_a, of_b = counts[:, :2].sum(), counts[:, 2:].sum()
    drawn = rng.hypergeometric(right, of - right, counts[:, 2:].sum(axis=1), (_PERMUTATIONS, len(counts))).sum(axis=1)

    def apart(right_of_b: Indices) -> Array:
        return np.asarray(np.abs(right_of_b / of_b - (right.sum() - right_of_b) / of_a))

    as_far = apart(drawn) >= apart(counts[:, 2].sum()) - 1e-12
    return float((1 + as_far.sum()) / (1 + _PERMUTATIONS))


def _people_permuted(right: Indices, of: Indices, b: NDArray[np.bool_], rng: np.random.Generator) -> float:
    """How likely people who are parted by chance are as far apart; b : who saw the second condition."""
    drawn = rng.permuted(np.tile(b, (_PERMUTATIONS + 1, 1)), axis=1)
    drawn[0] = b
    apart = np.abs(drawn @ right / (drawn @ of) - ~drawn @ right / (~drawn @ of))
    return float((apart >= apart[0] - 1e-12).mean())


def grouped(judged: Iterable[Judgement], by: Callable[[Judgement], str]) -> dict[str, Share]:
    """The share of every group of answers."""
    parts: dict[str, list[Judgement]] = defaultdict(list)
    for one in judged:
        parts[by(one)].append(one)
    return {name: share_of(parts[name]) for name in sorted(parts)}


@dataclass(frozen=True)
class Taken:
    """The answers that count.

    empty : rows without an answer; decided : doubtful rows that a person decided; unwilling : people who did not tick
    that they agree, or whose cover is not there; careless : people who told too few controls.
    """

    judged: tuple[Judgement, ...]
    about: Mapping[int, Mapping[str, str]]
    empty: int
    decided: int
    unwilling: tuple[int, ...]
    careless: tuple[int, ...]


def taken(key: Key, answers: Sequence[Answer], least_controls: int = 0) -> Taken:
    """What counts of some answers, with what the key says of each.

    Raises
    ------
    InputError
        An answer to what was not asked, or nothing that counts.
    """
    about = _about(answers)
    people = {row.person for row in answers}
    unwilling = tuple(sorted(person for person in people if not about.get(person, {}).get("consent")))
    asked = [row for row in answers if row.questionnaire != COVER and row.person not in unwilling]
    given = [row for row in asked if row.answer]
    judged = [_judged(key, row) for row in given]
    careless = _careless(judged, least_controls)
    judged = [one for one in judged if one.person not in careless]
    if not judged:
        raise InputError("No answer counts: each is empty, or its person did not agree, or told too few controls.")
    decided = sum(row.state == DOUBTFUL for row in given)
    return Taken(tuple(judged), about, len(asked) - len(given), decided, unwilling, careless)


def _careless(judged: Sequence[Judgement], least: int) -> tuple[int, ...]:
    """Who told fewer of the controls than that."""
    told = Counter(one.person for one in judged if one.condition == CONTROL and one.right)
    return tuple(sorted(person for person in {one.person for one in judged} if told[person] < least))


def _about(answers: Sequence[Answer]) -> dict[int, dict[str, str]]:
    """What people said of themselves."""
    about: dict[int, dict[str, str]] = defaultdict(dict)
    for answer in answers:
        if answer.questionnaire == COVER:
            about[answer.person][answer.item] = answer.answer
    return about


def _judged(key: Key, answer: Answer) -> Judgement:
    people, number = key.people, int(answer.item) if answer.item.isdecimal() else 0
    items = people[answer.person - 1].items(answer.questionnaire) if 0 < answer.person <= len(people) else ()
    if not 0 < number <= len(items):
        raise InputError(
            f"Person {answer.person} was not asked {answer.questionnaire} {answer.item}: these are answers of another "
            "study."
        )
    item = items[number - 1]
    hand = "" if answer.questionnaire == ENVELOPES else key.hands[key.snippets[item.snippet].hand]
    return Judgement(answer.person, answer.questionnaire, item.snippet, item.condition, hand, item.truth, answer.answer)


@dataclass(frozen=True)
class Scores:
    """One questionnaire's figures; conditions but the first are in nothing but `conditions`, the hardest first."""

    questionnaire: str
    share: Share
    hands: Mapping[str, Share]
    skill: Skill
    confusions: Confusions
    conditions: Mapping[str, Share]
    tests: tuple[Test, ...]
    groups: Mapping[str, Mapping[str, Share]]


def scores(key: Key, answers: Taken, seed: int = 0) -> dict[str, Scores]:
    """The figures of each questionnaire that was answered."""
    found = {}
    for kind in (SINGLES, PAIRS, ENVELOPES):
        every = [one for one in answers.judged if one.questionnaire == kind]
        ours = [one for one in every if one.condition == OURS]
        if ours:
            both = (design.LEFT, design.RIGHT) if kind == PAIRS else (REAL, MADE)
            conditions = dict(sorted(grouped(every, lambda one: one.condition).items(), key=lambda each: each[1].share))
            tests = tuple(conditions_test(every, np.random.default_rng(seed))) if len(conditions) > 1 else ()
            found[kind] = Scores(kind, share_of(ours), grouped(ours, lambda one: one.hand), skill_of(ours),
                                 confusions_of(ours, both), conditions, tests, _groups(key, ours, answers))  # fmt: skip
    return found


def _groups(key: Key, judged: Sequence[Judgement], answers: Taken) -> dict[str, Mapping[str, Share]]:
    """Shares by what people said of themselves, and by what the hand lacked."""
    asked = dict.fromkeys(item for said in answers.about.values() for item in said if item != "consent")

    def said(item: str, one: Judgement) -> str:
        return answers.about.get(one.person, {}).get(item) or "not said"

    found: dict[str, Mapping[str, Share]] = {item: grouped(judged, partial(said, item)) for item in asked}
    if judged[0].questionnaire != ENVELOPES:
        shown = [one for one in judged if one.truth != REAL]
        found["made"] = grouped(shown, lambda one: _LENT[bool(key.snippets[one.snippet].lent)])
    return found


_LENT = ("all letters the hand's own", "a letter that the hand lacked")


def difficulties(key: Key, judged: Sequence[Judgement]) -> list[Difficulty]:
    """All snippets that were judged, those first whose made form was told least."""
    parts: dict[Hashable, list[Judgement]] = defaultdict(list)
    for one in judged:
        if one.questionnaire != ENVELOPES and one.condition == OURS:
            kind = one.truth if one.questionnaire == SINGLES else PAIRS
            parts[one.snippet, kind].append(one)
    found = []
    for number in sorted({one.snippet for one in judged if one.questionnaire != ENVELOPES}):
        snippet = key.snippets[number]
        three = [share_of(parts[number, kind]) if (number, kind) in parts else None for kind in (REAL, MADE, PAIRS)]
        found.append(Difficulty(number + 1, snippet.text, key.hands[snippet.hand], *three))
    return sorted(found, key=lambda one: (np.isnan(one.found_out), one.found_out))


def difficulty_histogram(judged: Sequence[Judgement]) -> list[float]:
    """Share of the snippets that were told by 0–10 %, 10–20 % … of those who saw them in one form, as `OURS`."""
    ours = [one for one in judged if one.condition == OURS]
    shares = list(
        grouped(ours, lambda one: f"{one.snippet} {one.truth if one.questionnaire == SINGLES else ''}").values()
    )
    counts = np.histogram([each.share for each in shares], bins=_BINS, range=(0, 1))[0]
    return [float(count) / len(shares) for count in counts]
