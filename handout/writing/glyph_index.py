"""The glyphs of a scanned hand, indexed once for choosing among them, and everything that a choice costs.

The cost of a sequence of glyphs is the sum of four terms; `choosing` looks for the cheapest.  To add a cost, add its
weight to `ChoiceWeights`, and add it up in one of these:

- `intrinsic_cost` of a glyph, whatever is written: doubt that it is what it is called (`hand.vetting`), or no body
- `GlyphIndex.candidates`: of a glyph for a letter in its place
- `TransitionCosts.cost` of a glyph after another
- `GlyphIndex.repetition` of a glyph that was written before

The transitions are measured, not learnt.  The paper learns from a hand's ligatures what those that were not written
would have cost, by a forest of regression trees on what glyphs look like (seed 000, §6.2; Xiong et al. 2012).  On
ligatures of glyphs that it has not seen such a forest tells nothing: on two real pages its guesses correlate by .05 to
.07 with the truth, and err as much as the mean does, whether grown by scikit-learn, by OpenCV or here.  Where a letter
shows no ligature, what counts is that the two look alike.

`neighbours` finds which glyphs stood side by side on the pages, `legibility` how often strangers misread each;
`residuals` measures how far each departs from the median of its letter.  Arrays are indexed by the numbers of the
glyphs; lengths are in line space.

Source: seed 000, §6.2, §6.3 (perturb-and-MAP; the residuals and the cost of writing a glyph again are this project's).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import accumulate, islice, pairwise

import numpy as np
from numpy.typing import NDArray

from handout.hand.author_reader import find_odd_rarities
from handout.hand.learnt import learnt
from handout.hand.measures import body_sizes, in_other_ink
from handout.hand.places import PLACES, Place, places
from handout.hand.scanned import NOBODY, ScannedHand
from handout.hand.vetting import SURE, vet
from handout.values import Array, Indices, readonly, readonly_indices
from handout.writing import glyph_prices
from handout.writing.choosing import Candidates, fading_cost, glyph_chances
from handout.writing.forms import spread_evenly, ways
from handout.writing.legibility import made_words, misreadings, prefer_legible
from handout.writing.text import Letter, spelt


@dataclass(frozen=True)
class ChoiceWeights:
    """What each term counts; all are set by eye on texts written with scanned hands, unless said otherwise."""

    # of a glyph
    # times the probability that it is not what it is called.  Of 1000 letters of new text in three hands, glyphs that
    # are wrong by eye (49 of 1036) were 26, 56 and 57 with a cost that spared doubtful ones, 10, 33 and 32 with this;
    # with 35 they were 4, 19 and 20, but the repetition of a page was .039 instead of .009
    doubtful: float = 20.0
    # a glyph that was added to the hand: as one that is right with .6.  On four people's pages (csafe w0076 w0154
    # w0394, cvl 0052) four letters had no glyph above .8; the best of each had .70 to .79, and all were right by eye
    lent: float = 8.0
    # times strangers' surprise, nats: what they mostly misread is shunned, what only now and then is not.  Of 240
    # words in four hands (csafe w0018 w0341, cvl 0013 0052) 26 are misspelt by eye, 35 where 10 times the share of
    # misreadings counted; a reader that had no part in it (PP-OCRv6) misreads 29.6 and 32.5 of 100 in four hands that
    # this was chosen on, 19.0 and 19.5 in five others.  That was with 7; `often` evens out, this takes some back
    misread: float = 10.0
    # as much more where the writing is wished legible.  Of 1200 words in six hands (csafe w0018 w0200 w0238 w0341, cvl
    # 0013 0052) that reader misread 22 of 100 instead of 39, with letters lent where the author's read worse; the hinge
    # ratio of four pages went from 1.32 to 1.53
    legible: float = 30.0
    blot: float = 20.0  # times its `blots`
    broken: float = 3.0  # without a body
    # each share beyond its own that a glyph has of what is written of its letter (`glyph_prices`); with 1.5, and 10 of
    # misreading instead of 7, glyphs that are written in 1300 letters of csafe w0182 rise from 212 to 236, one comes
    # again within 60 letters in .20 instead of .24, and the hinge ratio falls from 1.63 to 1.48 and from 1.21 to 1.13
    # (cvl 0013 0012, four pages each)
    often: float = 1.5
    # of a glyph for a letter
    elsewhere: float = 0.5  # from another place in its word
    # of a glyph after another
    fit: float = 32.0  # for each unit that a ligature lies from where it should; less, and joins have humps
    unseen: float = 0.3  # where one of the two was not joined: what does not meet is not seen
    # for each letter of a pair, where neither was joined: as far as those letters mostly are.  With it letters join as
    # often as the author's do
    lifted: float = 2.0
    # a deviation between two residuals.  Of the variance of height, slant, width and darkness .07, .06, .10, .10 lie
    # then between words (the author's own: .09, .04, .14, .15; four hands).  Twice that is nearer to the author's, and
    # takes the hinge ratio of a half page from 1.38 to 1.47: fewer glyphs are written
    unlike: float = 0.5
    unmatched: float = 0.4  # each ligature of one glyph, beyond the first, that meets none of the other's
    # a ligature that meets none, in a word: the pen would have gone on, and lifts.  3 and 4 % of the pairs of two
    # joined hands
    loose: float = 6.0
    # of two glyphs that were no neighbours, where others of their letters were; and more than that where the letters
    # are the same: a double one is written in one go.  In 230 words of four hands (csafe w0154 w0180 w0394, cvl 0013)
    # .40 of the pairs that a page has then come from it in one piece (.24 without), 9 of 12.5 double letters (2.5); the
    # words read no worse to a reader that had no part in choosing, and as many glyphs are used
    apart: float = 1.0
    doubled: float = 4.0
    cut: float = 3.0  # a ligature that is cut for a word to end, or begin, there
    between_words: float = 0.5  # share of the cost that is left between words
    # of a glyph that was written before
    again: float = 5.0  # that was the last one written
    # letters after which it is as good as new, a line and a half.  With 100, of 100 words 24 and 15 change behind a new
    # one instead of 5 and 4 (csafe w0182, cvl 0027), and 31 and 24 with a glyph less instead of 19 and 16
    forgotten: float = 60.0
    # scale of the perturbation at variation 1.  Two texts of one wording have the same glyph in .44 and .32 of all
    # places (the same two hands of one page each); with .3 in .65 and .51, and 25 and 24 words change with a glyph less
    noise: float = 0.8


WEIGHTS = ChoiceWeights()
VERSION = 1  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
_LEAST_READ = 0.05  # share of readings: a few words do not tell one in twenty from none


def intrinsic_cost(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n,) float ≥ 0: of writing each glyph at all, given its body, which may be empty."""
    empty = np.array([not len(body) for body in bodies], dtype=bool)
    lent = np.arange(len(bodies)) >= hand.own_count
    odd = doubt(hand) + WEIGHTS.blot * blots(hand)
    share = misreadings(hand.author or hand)
    odd[: hand.own_count] += WEIGHTS.misread * -np.log(np.maximum(1 - share, _LEAST_READ))
    odd[: hand.own_count] += WEIGHTS.legible * hand.legible * share
    return np.asarray(odd + WEIGHTS.broken * empty + WEIGHTS.lent * lent)


@lru_cache(maxsize=4)
def doubt(hand: ScannedHand) -> Array:
    """(n,) float ≥ 0: what glyphs cost that do not look what they are called, or that only their author reads.

    That a person confirmed a glyph takes nothing from it.
    """
    own = np.arange(len(hand.glyphs)) < hand.own_count
    odd = find_odd_rarities(hand.author or hand)
    cost = WEIGHTS.doubtful * (1 - vet(hand).plainness)
    cost[own] += WEIGHTS.lent * odd[: hand.own_count]
    return readonly(cost, len(hand.glyphs))


_WIDE = 1.6  # times the usual width of a page's line: what crosses or is retraced is narrower; by eye, four pages


def blots(hand: ScannedHand) -> Array:
    """(n,) float ≥ 0: how much more ink than their letter's median glyphs have where their line is far too wide.

    It is the length of such line, x-heights, times the widths by which it is too wide.
    """
    return learnt(hand, "blots", VERSION, len(hand.glyphs), lambda: _measure_blots(hand))


def _measure_blots(hand: ScannedHand) -> Array:
    surplus = []
    for page in hand.pages:
        graph, count = page.graph, len(page.graph)
        a, b = graph.edges.T
        step = np.hypot(*(graph.xy[a] - graph.xy[b]).T) / (2 * page.x_height)
        length = np.bincount(a, step, count) + np.bincount(b, step, count)
        usual = float(np.median(graph.radius)) if count else 1.0
        surplus.append(length * np.maximum(graph.radius / usual - _WIDE, 0.0))
    each = np.array([surplus[glyph.page][glyph.vertices].sum() for glyph in hand.glyphs])
    for letter in hand.letters:
        numbers = hand.numbers_of_letter(letter)
        each[numbers] = np.maximum(each[numbers] - np.median(each[numbers]), 0.0)
    return np.asarray(each)


def better_lent(hand: ScannedHand, letter: str) -> bool:
    """Whether all glyphs of a letter are more doubtful than a lent one would be strange; none that is confirmed is.

    Where the writing is wished legible, what strangers misread counts as doubtful.
    """
    numbers = [n for n in hand.numbers_of_letter(letter).tolist() if not hand.glyphs[n].confirmed]
    cost = doubt(hand)[numbers]
    if hand.legible:
        cost = cost + WEIGHTS.legible * hand.legible * misreadings(hand)[numbers]
    return len(numbers) == len(hand.numbers_of_letter(letter)) and float(cost.min(initial=np.inf)) > WEIGHTS.lent


class TransitionCosts:
    """The costs of all pairs of a hand's glyphs, each worked out when it is first asked for.

    exits, entries : (n, k, p, 2) float; residual : (n, 4) float; after : (n,) int; leaving, entered : (n,) float: see
        `GlyphIndex`.
    letters : (n) of the glyphs.
    """

    def __init__(
        self,
        exits: Array,
        entries: Array,
        residual: Array,
        after: Indices,
        leaving: Array,
        entered: Array,
        letters: Sequence[str],
    ) -> None:
        names, self._letter = np.unique(np.array(letters, dtype=str), return_inverse=True)
        self._beside = np.zeros((len(names), len(names)))  # what a pair of letters that never was one costs
        of, next_to = self._letter[after != NOBODY], self._letter[after[after != NOBODY]]
        self._beside[of, next_to] = WEIGHTS.apart + WEIGHTS.doubled * (of == next_to)
        self._exits, self._entries, self._leaving, self._entered = exits, entries, leaving, entered
        self._residual, self._after = residual, after
        self._exit_count, self._entry_count = ((~np.isnan(ways[:, :, 0, 0])).sum(axis=1) for ways in (exits, entries))
        self.has_exit, self.has_entry = self._exit_count > 0, self._entry_count > 0
        # takes memory only where costs are asked for
        self._costs = np.empty((len(after), len(after)), dtype=np.float32)
        self._known = np.zeros((len(after), len(after)), dtype=bool)

    def cost(self, first: Indices, second: Indices, parted: bool) -> Array:
        """(k, l) float ≥ 0: of each of `first` (k,) before each of `second` (l,), with or without a space between."""
        pairs = first[:, None], second
        costs, known = self._costs[pairs], self._known[pairs]
        if not known.all():
            row, column = np.nonzero(~known)
            costs[row, column] = self._of_pairs(first[row], second[column])
            self._costs[pairs], self._known[pairs] = costs, True
        cost = costs.astype(np.float64)
        if parted:
            return np.asarray(
                WEIGHTS.between_words * cost + self.cut(first)[:, None] + WEIGHTS.cut * self.has_entry[second]
            )
        loose = self.has_exit[first][:, None] != self.has_entry[second]
        apart = ~self.has_exit[first][:, None] & ~self.has_entry[second] & (self._after[first][:, None] != second)
        lifted = self._leaving[first][:, None] * self._entered[second]
        torn = self._beside[self._letter[first][:, None], self._letter[second]] * (
            self._after[first][:, None] != second
        )
        return np.asarray(cost + WEIGHTS.loose * loose + WEIGHTS.lifted * lifted * apart + torn)

    def cut(self, last: Indices) -> Array:
        """(k,) float ≥ 0: of ending a word with each of some glyphs (k,), whose ligatures then lead nowhere."""
        return np.asarray(WEIGHTS.cut * self.has_exit[last])

    def _of_pairs(self, first: Indices, second: Indices) -> Array:
        """(m,) float: of pairs."""
        joined = self.has_exit[first] & self.has_entry[second]
        cost = np.full(len(first), WEIGHTS.unseen)
        single = joined & (self._exit_count[first] == 1) & (self._entry_count[second] == 1)
        for pairs, which in ((single, slice(1)), (joined & ~single, slice(None))):
            exits, entries = self._exits[:, which][first[pairs]], self._entries[:, which][second[pairs]]
            cost[pairs] = WEIGHTS.fit * mismatch(exits, entries)
        cost[joined] += WEIGHTS.unmatched * np.abs(self._exit_count[first[joined]] - self._entry_count[second[joined]])
        cost += WEIGHTS.unlike * np.abs(self._residual[first] - self._residual[second]).mean(axis=1)
        cost[self._after[first] == second] = 0.0
        return cost


def mismatch(exits: Array, entries: Array) -> Array:
    """(…): how far the ligature out of one glyph lies from the one into another; inf where either has none.

    The two may be moved along the line, as the letters will be, but not up or down: both stand on one baseline.  Their
    mean distance is then what the way between the letters must be bent by.  (The paper compares first and last points
    under any shift; a way out of an o, which is high, then meets one into an n that begins low.)  Of several ligatures
    the best two count.

    exits, entries : (…, k, p, 2) float, line space: places along ligatures, nan for none.
    """
    pairs = np.broadcast_shapes(exits.shape[:-3], entries.shape[:-3])
    out, into = (
        np.broadcast_to(ways, (*pairs, *ways.shape[-3:])).reshape(-1, *ways.shape[-3:]) for ways in (exits, entries)
    )
    # few glyphs have more than one ligature: only those that there are, are compared
    of, i, j = np.nonzero(~(np.isnan(out[:, :, None, 0, 0]) | np.isnan(into[:, None, :, 0, 0])))
    away = out[of, i] - into[of, j]
    away[..., 0] -= away[..., 0].mean(axis=-1, keepdims=True)
    least = np.full(len(out), np.inf)
    np.minimum.at(least, of, np.hypot(away[..., 0], away[..., 1]).mean(axis=-1))
    return least.reshape(pairs)


_FEW = 4  # glyphs of a letter, below which there is no median to compare with
_MOST_APART = 2.5  # deviations at most: a glyph further off was misread


def residuals(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n, 4) float: height, slant, log thickness and density of bodies less their letter's median, in deviations.

    0 for letters with fewer than `_FEW` glyphs.
    """
    if not bodies:
        return readonly(np.zeros((0, 4)), 0, 4)
    size = np.array([len(body) for body in bodies])
    of, first = np.repeat(np.arange(len(size)), size), np.concatenate([[0], np.cumsum(size)])
    vertices = np.concatenate(list(bodies))
    pages = [(page.graph.radius / page.pitch, page.graph.density) for page in hand.pages]
    radius, density = (
        np.concatenate([pages[glyph.page][k][body] for glyph, body in zip(hand.glyphs, bodies, strict=True)])
        for k in (0, 1)
    )
    _, height, _, slant = body_sizes(hand.place_vertices(of, vertices), radius, first, 1 / hand.pitch).T
    begin = first[:-1]
    thick, dark = np.add.reduceat(radius, begin) / size, np.add.reduceat(density, begin) / size
    features = np.stack([height, slant, np.log(thick), dark], axis=1)
    departures = np.zeros_like(features)
    for letter in hand.letters:
        numbers = hand.numbers_of_letter(letter)
        if len(numbers) >= _FEW:
            departures[numbers] = features[numbers] - np.median(features[numbers], axis=0)
    compared = departures[np.abs(departures).sum(axis=1) > 0]
    usual = 1.4826 * np.median(np.abs(compared), axis=0) + 1e-9 if len(compared) else np.ones(4)
    return readonly(np.clip(departures / usual, -_MOST_APART, _MOST_APART), len(size), 4)


_PLACES = 8  # along a ligature, at which two are compared


@dataclass(frozen=True, eq=False)
class GlyphIndex:
    """The glyphs of a hand with all that choosing among them needs.

    letters : (n) letter of each glyph; "" for one without a name, or one that is kept out.
    places : (n,) int: its place in its word, index in `hand.places.PLACES`.
    before, after : (n,) int: the glyphs beside it in its word, −1 for none.
    exits, entries : (n, k, 8, 2) float: places along each ligature to the glyph after, and from the one before, over
        the baseline; nan where there are fewer.
    residual : (n, 4) float: see `residuals`.
    leaving, entered : (n,) float, 0–1: how often its letter is joined to the one after, and to the one before.
    intrinsic_cost : (n,) float: 0 for a sure one with a body.
    refused : (n,) bool: not to be written while another stands.
    even_price : (n,) float: what evens out how often each is written, see `glyph_prices`.
    """

    hand: ScannedHand
    letters: tuple[str, ...]
    places: Indices
    before: Indices
    after: Indices
    exits: Array
    entries: Array
    residual: Array
    leaving: Array
    entered: Array
    intrinsic_cost: Array
    refused: NDArray[np.bool_]
    even_price: Array

    def __len__(self) -> int:
        return len(self.letters)

    @cached_property
    def _of(self) -> dict[tuple[str, int], Indices]:
        numbers_of: dict[tuple[str, int], list[int]] = {}
        for number, key in enumerate(zip(self.letters, self.places.tolist(), strict=True)):
            numbers_of.setdefault(key, []).append(number)
        return {key: readonly_indices(numbers, None) for key, numbers in numbers_of.items()}

    def of(self, letter: str, place: Place | None = None) -> Indices:
        """(m,) int: the glyphs of a letter, of one place or of all, rising."""
        kinds = range(len(PLACES)) if place is None else (PLACES.index(place),)
        groups = [self._of[letter, kind] for kind in kinds if (letter, kind) in self._of]
        return readonly_indices(np.sort(np.concatenate(groups)) if groups else np.zeros(0), None)

    @cached_property
    def transitions(self) -> TransitionCosts:
        """The costs of writing one glyph after another."""
        return TransitionCosts(
            self.exits, self.entries, self.residual, self.after, self.leaving, self.entered, self.letters
        )

    @property
    def chance(self) -> float:
        """See `choosing.GlyphStock`."""
        return WEIGHTS.noise

    @property
    def twice(self) -> float:
        """See `choosing.GlyphStock`."""
        return WEIGHTS.again

    @cached_property
    def kind(self) -> Indices:
        """See `choosing.GlyphStock`: each is remembered for itself."""
        return readonly_indices(np.arange(len(self)), None)

    def candidates(self, letters: Sequence[Letter], seed: int | None) -> list[Candidates]:
        """See `choosing.GlyphStock`; where a hand has many, others are drawn each time."""
        graphemes = [spelt(letter) for letter in letters]
        each = [self.all_candidates(*target) for target in zip(graphemes, places(graphemes), strict=True)]
        return [_sampled(candidates, place, seed) for place, candidates in enumerate(each)]

    def all_candidates(self, letter: str, place: Place) -> Candidates:
        """All glyphs that might do for a letter in its place, the best first."""
        numbers = self.of(letter, place)
        if (self.intrinsic_cost[numbers] < WEIGHTS.doubtful * (1 - SURE)).sum() < _ENOUGH:
            numbers = self.of(letter)
        standing = numbers[~self.refused[numbers]]
        numbers = standing if len(standing) else numbers
        cost = self.intrinsic_cost[numbers] + self.even_price[numbers]
        cost += WEIGHTS.elsewhere * (self.places[numbers] != PLACES.index(place))
        order = np.argsort(cost, kind="stable")
        return Candidates(readonly_indices(numbers[order], None), readonly(cost[order], None))

    def steps(self, first: Indices, second: Indices, *, varied: bool) -> Array:
        """See `choosing.GlyphStock`."""
        return self.transitions.cost(first, second, parted=False)

    def between_words(self, last: int, first: Indices, *, parted: bool) -> Array:
        """See `choosing.GlyphStock`."""
        return np.asarray(self.transitions.cost(np.array([last]), first, parted)[0])

    def ending(self, last: Indices) -> Array:
        """See `choosing.GlyphStock`."""
        return self.transitions.cut(last)

    def repetition(self, age: Array) -> Array:
        """See `choosing.GlyphStock`."""
        return fading_cost(age, WEIGHTS.again, WEIGHTS.forgotten)


_ENOUGH = 8  # exact matches from which on no others are asked
_MOST_CANDIDATES = 64  # of a place: time
_DRAWN = 24  # the same where a hand has more good ones than that: other ones each time, or the same few would be taken


def _sampled(candidates: Candidates, place: int, seed: int | None) -> Candidates:
    good = int(np.searchsorted(candidates.cost, candidates.cost[0] + WEIGHTS.elsewhere))
    which = np.arange(min(len(candidates.numbers), _MOST_CANDIDATES))
    if good > _MOST_CANDIDATES and seed is not None:
        which = np.argsort(glyph_chances(seed + 1, place, candidates.numbers[:good]))[:_DRAWN]
    rising = which[np.argsort(candidates.numbers[which])]
    return Candidates(readonly_indices(candidates.numbers[rising], None), readonly(candidates.cost[rising], None))


def index_glyphs(hand: ScannedHand) -> GlyphIndex:
    """The index of a hand's glyphs."""
    glyphs, count = hand.glyphs, len(hand.glyphs)
    inner = [np.zeros(len(page.graph), dtype=bool) for page in hand.pages]
    for glyph in glyphs:
        for way in glyph.ligatures:
            inner[glyph.page][way.path[1:-1]] = True
    bodies = [glyph.vertices[~inner[glyph.page][glyph.vertices]] for glyph in glyphs]
    whole = [body if len(body) else glyph.vertices for body, glyph in zip(bodies, glyphs, strict=True)]
    exits, entries = _ligatures(hand)
    refused = vet(hand).refused
    refused[: hand.own_count] |= in_other_ink(hand.author or hand)
    index = GlyphIndex(
        hand,
        tuple("" if glyph.kept_out else glyph.letter for glyph in glyphs),
        readonly_indices([PLACES.index(glyph.place) for glyph in glyphs], count),
        readonly_indices([glyph.before for glyph in glyphs], count),
        readonly_indices([glyph.after for glyph in glyphs], count),
        exits,
        entries,
        residuals(hand, whole),
        *_joined_shares(hand),
        readonly(intrinsic_cost(hand, bodies), count),
        refused,
        np.zeros(count),
    )
    return replace(index, even_price=readonly(_even_prices(index), count))


def _even_prices(index: GlyphIndex) -> Array:
    """(n,) float: 0 of glyphs that were added to the hand; less where the writing is wished legible."""
    hand, prices = index.hand, np.zeros(len(index))

    def work_out() -> Array:
        if hand.author is not None or hand.legible:
            return index_glyphs(prefer_legible(hand.author or hand, 0.0)).even_price
        # those too that are not to be written: else each would change what all others cost
        out = np.array([glyph.kept_out for glyph in hand.glyphs], dtype=bool)
        named = replace(index, letters=tuple(g.letter for g in hand.glyphs), refused=index.refused & ~out)
        return glyph_prices.even_prices(
            _likely_words(named), named.letters, named.intrinsic_cost, WEIGHTS.often, WEIGHTS.noise
        ).round(3)

    known = learnt(hand.author or hand, "even prices", glyph_prices.VERSION, hand.own_count, work_out)
    prices[: hand.own_count] = (1 - hand.legible) * known
    return prices


def _likely_words(index: GlyphIndex) -> list[glyph_prices.Word]:
    """Words that nobody wrote, of letters as the hand's pages have them."""
    found = list[glyph_prices.Word]()
    for made in islice(made_words(index.hand, np.random.default_rng(0)), _WORDS_TRIED):
        spelling = [index.letters[number] for number in made]
        each = [index.all_candidates(*target) for target in zip(spelling, places(spelling), strict=True)]
        numbers = [candidates.numbers[:_MOST_CANDIDATES] for candidates in each]
        more = [
            candidates.cost[: len(some)] - index.intrinsic_cost[some]
            for candidates, some in zip(each, numbers, strict=True)
        ]
        more[-1] = more[-1] + index.ending(numbers[-1])
        steps = [index.steps(one, other, varied=True) for one, other in pairwise(numbers)]
        found.append((numbers, more, [np.exp(-np.minimum(step, _DEAREST) / WEIGHTS.noise) for step in steps]))
    return found


_WORDS_TRIED = 400  # half a second for a page
_DEAREST = 60.0  # of a step: beyond that all are as unlikely


def _joined_shares(hand: ScannedHand) -> tuple[Array, Array]:
    """Twice (n,): what share of each glyph's letter is joined to the letter after it, and to the one before, in words.

    A letter with few pairs is taken for as joined as all are.
    """
    joined = np.array([bool(glyph.ligatures) for glyph in hand.glyphs], dtype=bool)
    first = np.array([n for n, glyph in enumerate(hand.glyphs) if glyph.after != NOBODY], dtype=np.intp)
    second = np.array([hand.glyphs[n].after for n in first], dtype=np.intp)
    usual = float(joined[first].mean()) if len(first) else 0.0
    letters, number = np.unique([glyph.letter for glyph in hand.glyphs], return_inverse=True)
    small = np.array([glyph.letter.islower() for glyph in hand.glyphs], dtype=bool)
    shares = []
    for side, counted in ((first, small[second]), (second, small[first])):
        pairs = np.bincount(number[side], weights=counted, minlength=len(letters))
        met = np.bincount(number[side], weights=joined[first] & counted, minlength=len(letters))
        shares.append(readonly(((met + _PRIOR * usual) / (pairs + _PRIOR))[number], None))
    return shares[0], shares[1]


_PRIOR = 3.0  # pairs that all letters together count for


def _ligatures(hand: ScannedHand) -> tuple[Array, Array]:
    """Places along the ligatures of each glyph to the next, and along those from the one before."""
    paths_of = ways(hand)
    most = max((len(paths) for paths in paths_of.values()), default=0)
    exits = np.full((len(hand.glyphs), max(1, most), _PLACES, 2), np.nan)
    entries = exits.copy()
    each = [(number, k, path) for number, paths in paths_of.items() for k, path in enumerate(paths)]
    size = [len(path) for _, _, path in each]
    of, rank = np.array([way[:2] for way in each], dtype=np.intp).reshape(-1, 2).T
    vertices = np.concatenate([np.zeros(0, dtype=np.intp), *(path for _, _, path in each)])
    places = hand.place_vertices(np.repeat(of, size), vertices)
    after = np.array([hand.glyphs[number].after for number in of.tolist()], dtype=np.intp)
    lines = [places[a:b] for a, b in pairwise(accumulate(size, initial=0))]
    exits[of, rank] = entries[after, rank] = spread_evenly(lines, _PLACES)
    for array in (exits, entries):
        array.flags.writeable = False
    return exits, entries
