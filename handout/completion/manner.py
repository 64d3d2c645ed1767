"""How an author writes a letter that he did not write on his pages: as his other letters depart from drawn ones.

Each letter that he wrote has a form of each built-in hand bent onto it (`ways.fit`).  How far a place of such a form is
moved, in x-heights, is a Gaussian process over all places of all letters: what it depends on is how high a place is,
how far right in its letter, where the pen goes there, how it turns, and how near the stroke's ends are (`_places`).
Places that are alike in this are moved alike: what is known of the stem of an l tells of that of a k, and of a B.  It
is a ridge regression on all that, with widths, lean and the heights of what goes up and down as linear terms; what a
letter has for itself is noise that its places share.  Its mean at the places of a letter that is lacking is that letter
in the author's manner.

Of the forms that could be meant, each weighs as much as the other letters of its hand fit the author's, and that is
taken which lies nearest to all of them: between unlike forms a choice of extremes is wrong more often.

Source: Rasmussen and Williams 2006, §2.2, §2.7 (the process and its linear terms); otherwise own method.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from handout.completion import ways
from handout.completion.ways import HANDS, AuthorGlyph, FormWay
from handout.hand.learnt import learnt
from handout.hand.scanned import ScannedHand
from handout.hand.vetting import vet
from handout.values import Array, Indices
from handout.writing.variation import warp

VERSION = 8  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
# letters from which on there is a manner.  On pages of four people (csafe w0154 w0394, cvl 0013 0002) that knew 3, 5, 8
# and 12 small letters alone, others came .88, .83, .85 and .83 times as near as drawn forms, nearer in .74 of them
LEAST = 3
_GLYPHS = 3  # of a letter that forms are bent onto: time
_LIKELY = 0.6  # probability from which on a glyph is looked at
_APART = 3  # places of a way from one that the process knows to the next
_DIGITS = 3  # after the point, of what is kept: thousandths of an x-height


@dataclass(frozen=True)
class MannerSettings:
    """Chosen on six people's pages (csafe w0154 w0394 w0076 w0238, cvl 0013 0002), each letter left out in turn.

    across, up, way, end, turn : how unlike places may be, one standard deviation: x-heights from the letter's middle
        and from the baseline, of the unit vector along the way, of the nearness of an end, and of the curvature.
    near_end, turning : x-heights from an end, and 1/x-height of curvature, that count as half way.
    moved : x-heights that alike places of all letters are moved; own : places of one letter, beside that.
    own_reach : x-heights over which that is the same.
    noise : x-heights, of a place.  doubt : of the cost of the fit, added to that.
    other : correlation between classes of letters: small ones, capitals, figures, signs.
    aside, upward : standard deviations of the linear terms: of x moved by x, y, y over the x-height, y under the
        baseline; of y moved by 1, y, the same two, x.
    clear : of the mean logarithm of two hands' costs, at which the better counts e times as much.
    class_counts : of letters of another class, beside those of the same, in that.
    narrowed : x-heights that a form is as if further away, whose loops are all narrowed to a line: by eye.
    """

    across: float = 1.0
    up: float = 0.45
    way: float = 0.8
    end: float = 0.45
    turn: float = 0.4
    near_end: float = 0.35
    turning: float = 4.0
    moved: float = 0.06
    own: float = 0.06
    own_reach: float = 0.35
    noise: float = 0.05
    doubt: float = 1.4
    other: float = 0.8
    aside: tuple[float, ...] = (0.15, 0.15, 0.15, 0.25)
    upward: tuple[float, ...] = (0.075, 0.075, 0.6, 0.6, 0.075)
    clear: float = 0.1
    class_counts: float = 0.25
    narrowed: float = 0.3


SETTINGS = MannerSettings()


@dataclass(frozen=True, eq=False)
class Known:
    """A form bent onto a letter that the author wrote.

    number : of the form; glyphs : how many it was bent onto; cost : of the fit; weights : (n, 2) of every `_APART`th
    place, in what the places of other letters are moved by, along the line and upwards.
    """

    letter: str
    number: int
    glyphs: int
    cost: float
    weights: Array

    @property
    def way(self) -> FormWay:
        """The form."""
        return ways.way(self.letter, self.number)


@dataclass(frozen=True)
class LetterSpread:
    """How the letters of an author vary, standard deviations: relative width and height, lean, rise, and bends."""

    breadth: float
    height: float
    lean: float
    rise: float
    bend: float


class WritingManner:
    """How an author writes, as far as forms of the built-in hands were bent onto his letters."""

    def __init__(self, hand: ScannedHand) -> None:
        kept = learnt(hand, "manner", VERSION, None, lambda: _measure_manner(hand))
        try:
            self._known = tuple(_unpack_known(kept[5:]))
        except (ValueError, OverflowError):  # forms drawn otherwise since, or a file that somebody wrote into
            kept = _measure_manner(hand)
            self._known = tuple(_unpack_known(kept[5:]))
        self.spread = LetterSpread(*kept[:5].tolist())

    @property
    def letters(self) -> frozenset[str]:
        """The letters that it was learnt from."""
        return frozenset(known.letter for known in self._known)

    def ways(self, letter: str, parted: Sequence[bool], rng: np.random.Generator) -> tuple[list[list[Array]], int]:
        """A letter written several times, each time its strokes (n, 2), upright x-heights; [] where none is drawn.

        Also the number of the last of them that is written with the word.  What is known of the very letter does not
        count.

        parted : for each time, whether it is without its way up to the next letter.
        """
        way = self.likeliest(letter)
        if way is None:
            return [], 0
        form, places = way
        written = [form.strokes(places + _vary_places(places, self.spread, rng)) for _ in parted]
        cut = [form.split_strokes(strokes) if cut else strokes for strokes, cut in zip(written, parted, strict=True)]
        return cut, form.last

    def likeliest(self, letter: str) -> tuple[FormWay, Array] | None:
        """The form of a letter that the author might use, and its places (n, 2) as he would write it."""
        forms = [ways.way(letter, number) for number in range(ways.count(letter))]
        if not forms:
            return None
        weight = self._likelihood(letter)[[form.hand for form in forms]]
        weight = weight / np.bincount([form.hand for form in forms], minlength=len(HANDS))[[f.hand for f in forms]]
        made = [self._process(form.hand).move_places(form, letter) + form.xy for form in forms]
        level = [xy - [float(np.median(xy[:, 0])), 0.0] for xy in made]
        narrowed = [
            _share_beside(xy, form) - _share_beside(form.xy, form) for xy, form in zip(level, forms, strict=True)
        ]
        # how far the lines lie apart on the average, x-heights
        distances = np.zeros((len(level), len(level)))
        for i, a in enumerate(level):
            for j, b in enumerate(level[:i]):
                squares = ways.measure_squares(a, b)
                mean = np.sqrt(squares.min(axis=0)).mean() + np.sqrt(squares.min(axis=1)).mean()
                distances[i, j] = distances[j, i] = 0.5 * mean
        price = distances @ (weight / weight.sum()) + SETTINGS.narrowed * np.maximum(narrowed, 0.0)
        best = int(np.argmin(price))
        return forms[best], level[best]

    def _likelihood(self, letter: str) -> Array:
        """(hands,): how well each built-in hand's other letters fit, those of the same class before others."""
        total, weight = np.zeros(len(HANDS)), np.zeros(len(HANDS))
        for known in self._known:
            if known.letter != letter:
                counts = 1.0 if _kind(known.letter) == _kind(letter) else SETTINGS.class_counts
                total[known.way.hand] += counts * np.log(known.cost)
                weight[known.way.hand] += counts
        mean = total / np.maximum(weight, 1e-9)
        return np.asarray(np.exp(-(mean - mean.min()) / SETTINGS.clear))

    @lru_cache(maxsize=3)  # noqa: B019 - a manner lives as long as the letters that are made of it
    def _process(self, hand: int) -> _GaussianProcess:
        return _GaussianProcess([known for known in self._known if known.way.hand == hand])


class _GaussianProcess:
    """The Gaussian process of how the forms of one built-in hand are moved."""

    def __init__(self, known: Sequence[Known]) -> None:
        each = [_places(one.way)[::_APART] for one in known]
        self._known = known
        self._of = np.repeat(np.arange(len(known)), [len(places) for places in each])
        self._places = np.concatenate(each)
        self._kinds = np.array([_kind(one.letter) for one in known])[self._of]
        self._weights = np.concatenate([one.weights for one in known])

    def learn_weights(self, moved: Array) -> list[Array]:
        """The weights (n, 2) of each letter's places, if all places are moved by (n, 2)."""
        from scipy.linalg import solve

        weights = [solve(self._covariance(axis), moved[:, axis], assume_a="pos") for axis in (0, 1)]
        return list(np.split(np.column_stack(weights), np.flatnonzero(np.diff(self._of)) + 1))

    def move_places(self, form: FormWay, letter: str) -> Array:
        """(n, 2): how far the places of a form are moved, by what is known of other letters."""
        places, weights = _places(form), self._weights_without(letter)
        alike = (
            _find_covariance(places, np.full(len(places), _kind(letter)), self._places, self._kinds, k) for k in (0, 1)
        )
        return np.column_stack([a @ w for a, w in zip(alike, weights.T, strict=True)])

    def _weights_without(self, letter: str) -> Array:
        """(n, 2): the weights of all places, if one letter were not known."""
        numbers = [k for k, one in enumerate(self._known) if one.letter == letter]
        if not numbers:
            return self._weights
        gone = self._of == numbers[0]
        weights = self._weights.copy()
        for axis, inverse in enumerate(self._inverse):
            weights[:, axis] -= inverse[:, gone] @ np.linalg.solve(inverse[np.ix_(gone, gone)], weights[gone, axis])
        return weights

    @cached_property
    def _inverse(self) -> list[Array]:
        return [np.asarray(np.linalg.inv(self._covariance(axis)), dtype=np.float64) for axis in (0, 1)]

    def _covariance(self, axis: int) -> Array:
        """(n, n): of what is seen of the places, along the line or upwards."""
        s, glyphs, cost = SETTINGS, *np.array([(one.glyphs, one.cost) for one in self._known]).T
        noise = s.noise**2 * (1 + _GLYPHS / glyphs) + (s.doubt * cost) ** 2
        near = s.own**2 * np.exp(-0.5 * ways.measure_squares(self._places[:, :2], self._places[:, :2]) / s.own_reach**2)
        own = np.where(self._of[:, None] == self._of, near, 0.0)
        own += np.diag(noise[self._of])
        return np.asarray(_find_covariance(self._places, self._kinds, self._places, self._kinds, axis) + own)


def _kind(letter: str) -> int:
    """Small letters, capitals, figures, signs."""
    return 0 if letter.islower() else 1 if letter.isupper() else 2 if letter.isdigit() else 3


def _places(way: FormWay) -> Array:
    """(n, 7): what tells places of a way apart: x from the middle, y, where the pen goes, near both ends, turning."""
    places = []
    for xy, along in zip(way.strokes(way.xy), way.strokes(way.unit_vectors), strict=True):
        run = np.arange(len(xy)) * ways.STEP
        ends = np.exp(-np.column_stack([run, run[::-1]]) / SETTINGS.near_end)
        turn = np.zeros(len(xy))
        if len(xy) > 2:
            turn = np.gradient(np.unwrap(np.arctan2(along[:, 1], along[:, 0]))) / ways.STEP
            turn = np.convolve(np.pad(turn, 1, "edge"), np.full(3, 1 / 3), "valid")
        places.append(np.column_stack([xy, along, ends, np.tanh(turn / SETTINGS.turning)]))
    found = np.concatenate(places)
    found[:, 0] -= 0.5 * (found[:, 0].min() + found[:, 0].max())
    return found


def _find_covariance(places: Array, kinds: Indices, others: Array, other_kinds: Indices, axis: int) -> Array:
    """Covariance (n, m) of what places and others are moved by, along the line (axis 0) or upwards."""
    s = SETTINGS
    scale = 1 / np.array([s.across, s.up, s.way, s.way, s.end, s.end, s.turn])
    near = s.moved**2 * np.exp(-0.5 * ways.measure_squares(places * scale, others * scale))
    weights = np.square((s.aside, s.upward)[axis])
    linear = (_terms(places, axis) * weights) @ _terms(others, axis).T
    return np.asarray(np.where(kinds[:, None] == other_kinds, 1.0, s.other) * (near + linear))


def _terms(places: Array, axis: int) -> Array:
    """(n, 4) or (n, 5): the linear terms of how places are moved along the line, or upwards."""
    x, y = places[:, 0], places[:, 1]
    up, down = np.maximum(y - 1, 0.0), np.maximum(-y, 0.0)
    return np.column_stack([x, y, up, down] if axis == 0 else [np.ones(len(x)), y, up, down, x])


_NEAR, _FURTHER, _PARALLEL = 0.22, 5, 0.9  # x-heights, places along the way, and cosine, of strokes side by side


def _share_beside(xy: Array, form: FormWay) -> float:
    """The share of the places (n, 2) of a bent form that run beside other places of the form."""
    along, number = form.tangents(xy), np.arange(len(xy))
    near = (ways.measure_squares(xy, xy) < _NEAR**2) & (np.abs(along @ along.T) > _PARALLEL)
    return float((near & (np.abs(number[:, None] - number) > _FURTHER)).any(axis=1).mean())


_WAVES = (0.9, 2.6)  # x-heights: of the field that bends a letter that is written again


def _vary_places(places: Array, spread: LetterSpread, rng: np.random.Generator) -> Array:
    """(n, 2): how far places lie from the usual ones when a letter is written once more."""
    breadth, height, lean, rise = rng.normal(0.0, (spread.breadth, spread.height, spread.lean, spread.rise))
    x, y = places.T
    even = np.column_stack([breadth * x + lean * (y - 0.5), height * y + rise])
    return np.asarray(even + warp(places, rng, spread.bend, *_WAVES))


def _measure_manner(hand: ScannedHand) -> Array:
    """What is kept of a hand: its spread, and the form of each built-in hand bent onto each of its letters."""
    seen, moved, varying = list[Known](), list[Array](), list[tuple[Array, Array]]()
    for letter, glyphs in _good_glyphs(hand):
        bends = [_bend_form(letter, number, glyphs) for number in _nearest(letter, glyphs[0])]
        seen += [known for known, _, _ in bends]
        moved += [places for _, places, _ in bends]
        if len(glyphs) > 1:
            varying.append(min(bends, key=lambda bend: bend[0].cost)[2])
    kept = [_measure_spread(varying)]
    for number in sorted({known.way.hand for known in seen}):
        which = [k for k, known in enumerate(seen) if known.way.hand == number]
        learned = _GaussianProcess([seen[k] for k in which]).learn_weights(np.concatenate([moved[k] for k in which]))
        for known, weights in zip((seen[k] for k in which), learned, strict=True):
            head = ord(known.letter), known.number, known.glyphs, known.cost, len(weights)
            kept.append(np.concatenate([head, weights.ravel()]))
    return np.asarray(np.round(np.concatenate(kept), _DIGITS), dtype=np.float64)


def _good_glyphs(hand: ScannedHand) -> Iterator[tuple[str, list[AuthorGlyph]]]:
    """Letters of a hand that have forms, each with the glyphs that are likeliest labelled right."""
    probability = vet(hand).plainness
    for letter in hand.letters:
        if len(letter) == 1 and letter.isalnum() and ways.count(letter):
            numbers = sorted(hand.numbers_of_letter(letter).tolist(), key=lambda i: -probability[i])
            if glyphs := [ways.take_glyph(hand, i) for i in numbers[:_GLYPHS] if probability[i] >= _LIKELY]:
                yield letter, glyphs


def _bend_form(letter: str, number: int, glyphs: Sequence[AuthorGlyph]) -> tuple[Known, Array, tuple[Array, Array]]:
    """A form bent onto glyphs; how far its places are moved (n, 2); its usual places, and each glyph's from those."""
    form = ways.way(letter, number)
    fits = [ways.fit(form, glyph) for glyph in glyphs]
    bent = np.array([_level(fit.bent) for fit in fits])
    middle, cost = np.median(bent, axis=0), float(np.median([fit.cost for fit in fits]))
    moved = _level(middle - form.xy)[::_APART]
    return Known(letter, number, len(fits), cost, np.zeros_like(moved)), moved, (middle, bent - middle)


def _level(xy: Array) -> Array:
    return xy - [float(np.median(xy[:, 0])), 0.0]


def _nearest(letter: str, glyph: AuthorGlyph) -> Iterator[int]:
    """The form of each built-in hand that is nearest to a glyph."""
    forms = [ways.way(letter, number) for number in range(ways.count(letter))]
    away = np.array([ways.measure_distance(form.xy, form.unit_vectors, glyph) for form in forms])
    hands = np.array([form.hand for form in forms])
    for hand in np.unique(hands):
        of_hand = np.flatnonzero(hands == hand)
        yield int(of_hand[away[of_hand].argmin()])


def _unpack_known(kept: Array) -> Iterator[Known]:
    at = 0
    while at < len(kept):
        code, number, glyphs, cost, count = kept[at : at + 5].tolist()
        end = at + 5 + 2 * int(count)
        letter, number = chr(int(code)), int(number)
        places = len(ways.way(letter, number).xy[::_APART]) if 0 <= number < ways.count(letter) else 0
        if not at + 5 <= end <= len(kept) or count != places:
            raise ValueError(f"{count:g} places of {len(kept)} figures for {places} of {letter!r}")
        yield Known(letter, number, int(glyphs), cost, kept[at + 5 : end].reshape(-1, 2))
        at = end


_ENOUGH = 8  # glyphs that vary, from which on their spread is told
# of a hand with too few letters to tell, and the most: fits err, too
_USUAL = LetterSpread(0.06, 0.06, 0.05, 0.04, 0.03)


def _measure_spread(varying: Sequence[tuple[Array, Array]]) -> Array:
    """(5,): `LetterSpread` of letters, each by its usual places (n, 2) and how far they lie off, (glyphs, n, 2)."""
    usual = np.array([_USUAL.breadth, _USUAL.height, _USUAL.lean, _USUAL.rise, _USUAL.bend])
    found = []
    for middle, off in varying:
        if np.ptp(middle[:, 0]) < 0.3 or len(middle) < 6:  # a stem has no width to vary
            continue
        for xy in off:
            aside = np.column_stack([np.ones(len(middle)), middle[:, 0], middle[:, 1] - 0.5])
            upward = aside[:, [0, 2]]
            across, up = np.linalg.lstsq(aside, xy[:, 0])[0], np.linalg.lstsq(upward, xy[:, 1])[0]
            left = xy - np.column_stack([aside @ across, upward @ up])
            found.append([across[1], up[1], across[2], up[0], np.sqrt((left**2).mean())])
    if len(found) < _ENOUGH:
        return usual
    size = np.abs(np.array(found))
    sizes = 1.4826 * np.median(size, axis=0)
    sizes[4] = np.median(size[:, 4])
    return np.asarray(np.minimum(sizes, usual))
