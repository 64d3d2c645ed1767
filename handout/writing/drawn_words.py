"""Words of a drawn hand: forms set side by side, out of each other's way, and given life.

Word space is letter space (x-height 1, baseline 0, y up) with the word's first letter at x = 0, slanted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from handout.hand.drawn import Hand
from handout.hand.letter_classes import CROSSED
from handout.values import Array, Glyph, Placed
from handout.writing import variation as varying
from handout.writing.choosing import Choice, Rewrites, word_stream
from handout.writing.drawn_forms import accent_glyph, drawn_forms
from handout.writing.layout import USUAL_BASELINES, BaselineModel, on_rules
from handout.writing.pages import ToPage, Unit, Word, wide_gap
from handout.writing.text import Letter, spelt
from handout.writing.variation import USUAL, Drift, Variation, warp

if TYPE_CHECKING:
    from handout.mathematics.shapes import Wander

LEAST_ROOM = 0.28  # between the lines of two letters that are not joined, at any height: a line, and paper that is seen
_MOST_ROOM = 1 / 3  # of the gap between words; on four joined pages 90 of 100 lifts leave less than .28 to .53 of it
_BAR_ROOM = 0.13  # between the end of a bar and a letter that it does not cross
_SIGN_ROOM = 0.34  # between a sign such as + or @ and a letter, which it must not become a part of
_MARK_ROOM = 0.08  # between a letter and punctuation, which stands near
_MARKS = frozenset(".,;:!?'\"‘’“”‚„…()[]{}«»‹›-–—_/\\|^`´°¡¿*·•ª™")
_HEIGHTS, _SEEN = np.arange(-0.9, 2.4, 0.15), 0.2  # where distances are taken, and over what reach
_WIDEST_DOT = 0.45  # a stroke that is wider, and lies, is a bar; set by eye
_DOT_ROOM = 0.29  # from a dot or an accent to another letter's line: two half lines, and paper that is seen between
_SIDEWAYS, _UPWARDS = np.arange(-0.45, 0.28, 0.03), np.arange(-0.12, 0.4, 0.03)  # where it still is its letter's
_MOVES = np.array([(x, y) for x in _SIDEWAYS for y in _UPWARDS])
_MOVES = _MOVES[np.argsort(np.hypot(_MOVES[:, 0], 1.3 * _MOVES[:, 1]), kind="stable")]  # the least first
_OVER = 0.3  # a bar that passes nearer over a letter strikes it through
_TIE = 0.14  # a bar crosses its stem by as much at least
_FLIGHT = (0.9, 0.3)  # beyond its stem at most, or as this share of its word
_MEANT = 0.2  # a bar that was drawn to run so far into its neighbour is meant to


def are_joined(left: Glyph, right: Glyph) -> bool:
    """Whether the pen stays down between two neighbours."""
    return left.exit != "lifted" and right.entry != "lifted"


def change_of_room(left: Glyph, right: Glyph, width: float, gap: float, breadths: Sequence[float] = (1, 1)) -> float:
    """How much further apart than `width` two letters that are not joined must stand, so that each reads as itself.

    Less than 0 where they would gape as two words do.  gap : between words; breadths : of both as they are written.
    """
    barred = (right.letter in left.before or left.letter in right.after) and (_has_bar(left) or _has_bar(right))
    if are_joined(left, right) or barred:  # the one bar of tt or ft was drawn for where the other letter stands
        return 0.0
    least, most = _MARK_ROOM if {left.letter, right.letter} & _MARKS else _SIGN_ROOM, np.inf
    if left.letter.isalnum() and right.letter.isalnum():
        # a rising stroke meets the letter that it was to lead to; one at the height of an o would make a d of ol
        least = 0.0 if left.exit == "low" else LEAST_ROOM
        most = max(_MOST_ROOM * gap, least) if right.letter.islower() else most
    room = float((width + breadths[1] * _edges(right)[0] - breadths[0] * _edges(left)[1]).min())
    return float(np.clip(room, least, most)) - room if np.isfinite(room) else 0.0


def _has_bar(glyph: Glyph) -> bool:
    """Whether one of its strokes, delayed or not, is a bar."""
    return any(is_bar(stroke) for stroke in glyph.strokes)


def is_bar(stroke: Array) -> bool:
    """Whether a stroke lies rather than stands, and is longer than a dot."""
    return bool(np.ptp(stroke[:, 0]) > max(_WIDEST_DOT, 2 * np.ptp(stroke[:, 1])))


@lru_cache(maxsize=4096)
def _edges(glyph: Glyph) -> tuple[Array, Array]:
    """Leftmost and rightmost x of a letter at some heights, without its delayed strokes; ±inf where it has nothing."""
    ways = [_evenly(stroke) for stroke in glyph.part_strokes(glyph.strokes)[0]]
    left, right = np.full(len(_HEIGHTS), np.inf), np.full(len(_HEIGHTS), -np.inf)
    if ways:
        xy = np.vstack(ways)
        near = np.abs(xy[:, 1, None] - _HEIGHTS) < _SEEN
        left = np.where(near, xy[:, :1], np.inf).min(axis=0)
        right = np.where(near, xy[:, :1], -np.inf).max(axis=0)
    return left, right


def _evenly(stroke: Array) -> Array:
    """Places along the straight ways between the points of a stroke."""
    at = np.linspace(0, len(stroke) - 1, 8 * len(stroke))
    return np.column_stack([np.interp(at, np.arange(len(stroke)), axis) for axis in stroke.T])


def bound_bars(glyphs: Sequence[Glyph], strokes: Sequence[list[Array]]) -> None:
    """Shorten the bars of t and f that would strike through other letters of their word, or fly far beyond its ends.

    strokes : of each glyph, (n, 2) in the word's space; bars are replaced where they change.
    """
    if not any(glyph.letter in CROSSED for glyph in glyphs):
        return
    ink = [_ink(glyph, letter_strokes) for glyph, letter_strokes in zip(glyphs, strokes, strict=True)]
    whole = np.vstack(ink)
    most = max(_FLIGHT[0], _FLIGHT[1] * float(np.ptp(whole[:, 0])))
    beside = [None, *glyphs, None]
    for i, glyph in enumerate(glyphs):
        for k, drawn in enumerate(glyph.strokes):
            if glyph.letter in CROSSED and is_bar(strokes[i][k]):
                # whether it was drawn to run into the letter before, and into the one behind
                previous, following = beside[i], beside[i + 2]
                left = previous is not None and previous.letter in glyph.after and float(drawn[:, 0].min()) < -_MEANT
                right = following is not None and following.letter in glyph.before
                right = right and float(drawn[:, 0].max()) > glyph.width + _MEANT
                before, after = ink[: max(i - left, 0)], ink[i + 1 + right :]
                limits = (np.inf if left else most, np.inf if right else most)
                strokes[i][k] = _limit_bar(strokes[i][k], ink[i], before, after, limits)


def _ink(glyph: Glyph, strokes: Sequence[Array]) -> Array:
    """(n, 2): places along the strokes of a letter, the bars of t and f left out."""
    crossed = glyph.letter in CROSSED
    stems = [stroke for stroke in strokes if not (crossed and is_bar(stroke))]
    return np.vstack([_evenly(stroke) for stroke in stems or strokes])  # a stem may be slurred until it lies, too


def _limit_bar(
    bar: Array, letter: Array, before: Sequence[Array], after: Sequence[Array], most: tuple[float, float]
) -> Array:
    """A bar between the letters before and behind that it would touch, not more than `most` beyond its stem."""
    away = np.abs(letter[:, 1] - float(np.median(bar[:, 1])))
    stem = float(np.median(letter[away <= max(0.1, float(away.min())), 0]))
    right = _reach(bar, stem, after, most[1])
    # the same to the left, seen in a mirror
    mirror = np.array([-1.0, 1.0])
    left = _reach(bar * mirror, -stem, [ink * mirror for ink in before], most[0])
    if left == right == 1.0:
        return bar
    offset = bar[:, 0] - stem
    return np.column_stack([stem + np.where(offset > 0, offset * right, offset * left), bar[:, 1]])


def _reach(bar: Array, stem: float, ink: Sequence[Array], most: float) -> float:
    """What share of a bar right of its stem is left when it keeps away from ink on that side."""
    drawn = float(bar[:, 0].max()) - stem
    if drawn <= _TIE:
        return 1.0
    order = np.argsort(bar[:, 0])
    wall = np.inf
    if ink:
        xy = np.vstack(ink)
        over = np.abs(xy[:, 1] - np.interp(xy[:, 0], bar[order, 0], bar[order, 1])) < _OVER
        wall = float(xy[over & (xy[:, 0] > stem), 0].min(initial=np.inf))
    return max(min(drawn, wall - _BAR_ROOM - stem, most), _TIE) / drawn


def clear_dots(glyphs: Sequence[Glyph], strokes: Sequence[list[Array]]) -> None:
    """Move the dots and accents that would touch other letters of their word to the nearest place that is clear.

    strokes : of each glyph, (n, 2) in the word's space; dots and accents are replaced where they move.
    """
    for i, glyph in enumerate(glyphs):
        if dots := _dots(glyph, strokes[i]):
            beside = [stroke for near in (*strokes[max(i - 2, 0) : i], *strokes[i + 1 : i + 3]) for stroke in near]
            move = _move(np.vstack([_evenly(strokes[i][k]) for k in dots]), beside)
            for k in dots if move.any() else ():
                strokes[i][k] = strokes[i][k] + move


def _dots(glyph: Glyph, strokes: Sequence[Array]) -> list[int]:
    """Which strokes of a letter are its dots or accent: delayed strokes that lie wholly above the rest."""
    if not any(glyph.delayed) or all(glyph.delayed):
        return []
    top = max(float(stroke[:, 1].max()) for stroke in glyph.part_strokes(strokes)[0])
    return [k for k, delayed in enumerate(glyph.delayed) if delayed and float(strokes[k][:, 1].min()) > top]


def _move(mark: Array, others: Sequence[Array]) -> Array:
    """(2,): the shortest move to a place with enough room for a mark, or else to the place with most room."""
    if not others:
        return np.zeros(2)
    lines = np.vstack([_evenly(stroke) for stroke in others])
    reach = _DOT_ROOM + float(np.abs(_MOVES).max())
    near = lines[((lines > mark.min(axis=0) - reach) & (lines < mark.max(axis=0) + reach)).all(axis=1)]
    if not len(near) or float(_room(mark[None], near)[0]) >= _DOT_ROOM:
        return np.zeros(2)
    room = _room(mark + _MOVES[:, None], near)
    wanted = min(_DOT_ROOM, float(room.max()))
    return np.asarray(_MOVES[int(np.argmax(room >= wanted))])


def _room(marks: Array, lines: Array) -> Array:
    """(k,): the least distance of (k, n, 2) marks from points (m, 2) of lines."""
    places = marks.reshape(-1, 2)  # a matrix product is faster than a tree for so few points, and needs no import
    square = (places**2).sum(axis=1)[:, None] + (lines**2).sum(axis=1) - 2 * places @ lines.T
    return np.asarray(np.sqrt(np.maximum(square.min(axis=1), 0.0)).reshape(len(marks), -1).min(axis=1))


_MOST_SLURRED = 0.3  # beyond it nobody reads the word
_CAPITALS = 0.12  # x-heights between two capitals, besides their widths


@dataclass(frozen=True, eq=False)
class PlannedGlyph:
    """A glyph with its strokes in word space, and whether it is joined to the one before."""

    glyph: Glyph
    strokes: tuple[Array, ...]
    joined: bool

    def move_by(self, x: float) -> PlannedGlyph:
        """See `pages.SetGlyph`."""
        return replace(self, strokes=tuple(stroke + np.array([x, 0.0]) for stroke in self.strokes))


class WordWriter:
    """Writes the words of one text, one after the other; slant drifts from word to word, height by letters."""

    def __init__(
        self, hand: Hand, rng: np.random.Generator, jitter: float, lying: BaselineModel = USUAL_BASELINES
    ) -> None:
        self._hand, self.seeds = hand, rng.integers(2**63, size=(2, 2)).tolist()
        self._vary: Variation = replace(USUAL, line_rise=lying.line_rise).scale_by(jitter * hand.variation)
        self._slant = Drift(self._vary.slant, varying.SLANT_MEMORY, rng)
        self._slow_slant = Drift(self._vary.slow_slant, varying.SLOW_MEMORY, rng)
        self._slow_breadth = Drift(self._vary.slow_breadth, varying.SLOW_MEMORY, rng)
        self._line_rise = Drift(self._vary.line_rise, varying.LINE_MEMORY, rng)
        self._line_height = Drift(self._vary.line_height, varying.LINE_MEMORY, rng)
        self._rise = Drift(self._vary.rise, varying.LETTER_MEMORY, rng)
        self._height = Drift(self._vary.height, varying.LETTER_MEMORY, rng)
        self._slur = Drift(self._vary.slur, varying.LETTER_MEMORY, rng)
        self._drifts = [each for each in vars(self).values() if isinstance(each, Drift)]

    def word(self, forms: Sequence[Glyph], letters: Sequence[Letter], rng: np.random.Generator) -> Word[PlannedGlyph]:
        """Set the chosen forms of a word side by side; `rng` makes all variation."""
        glyphs = [
            accent_glyph(glyph, letter.marks, self._hand, rng) if letter.marks else glyph
            for glyph, letter in zip(forms, letters, strict=True)
        ]
        flat, width = self._set_glyphs(glyphs, rng)
        flat += warp(flat, rng, self._vary.warp, 1.6, 3.4) + warp(flat, rng, self._vary.warp_fine, 0.7, 1.6)
        slant = self._hand.slant + self._slant.draw_next(rng) + self._slow_slant.draw_next(rng)
        flat = flat + slant * flat[:, 1:] * (1.0, 0.0)
        sizes = [len(stroke) for glyph in glyphs for stroke in glyph.strokes]
        pieces = iter(np.split(flat, np.cumsum(sizes)[:-1]))
        strokes = [tuple(next(pieces) for _ in glyph.strokes) for glyph in glyphs]
        joins = (False, *(are_joined(a, b) for a, b in pairwise(glyphs)))
        return Word(
            glyphs=tuple(map(PlannedGlyph, glyphs, strokes, joins)),
            extents=np.array(
                [(min(s[:, 0].min() for s in each), max(s[:, 0].max() for s in each)) for each in strokes]
            ),
            at=tuple(letter.at for letter in letters),
            spelt=tuple(spelt(letter) for letter in letters),
            advance=width,
            left=float(flat[:, 0].min()),
            right=max(float(flat[flat[:, 1] > -0.2, 0].max(initial=0.0)), width - 0.2),
        )

    def other(self, forms: Sequence[Glyph], letters: Sequence[Letter], rng: np.random.Generator) -> Word[PlannedGlyph]:
        """Write the last word again with another generator; the next word comes out as if this had not happened."""
        state = self.state()
        word = self.word(forms, letters, rng)
        self.resume(state)
        return word

    def state(self) -> Sequence[float]:
        """See `kept_text.Resumable`: where everything that drifts from word to word has come to."""
        return [drift.value for drift in self._drifts]

    def resume(self, state: Sequence[float]) -> None:
        """See there."""
        for drift, value in zip(self._drifts, state, strict=True):
            drift.value = value

    def _set_glyphs(self, glyphs: Sequence[Glyph], rng: np.random.Generator) -> tuple[Array, float]:
        """All points of the glyphs side by side, (n, 2), and the advance of the whole."""
        n, vary = len(glyphs), self._vary
        shapes = self._shapes(n, rng)
        capitals = [a.letter.isupper() and b.letter.isupper() for a, b in pairwise(glyphs)] + [False]
        advances = np.array([glyph.width for glyph in glyphs]) + _CAPITALS * np.array(capitals)
        widths = advances * shapes[:, 0, 0] + rng.normal(0.0, vary.gap, n)
        pairs = zip(pairwise(glyphs), widths, pairwise(shapes[:, 0, 0].tolist()), strict=False)
        widths[:-1] += [change_of_room(*pair, width, self._hand.word_space, both) for pair, width, both in pairs]
        rises = self._line_rise.walk(rng, n) + self._rise.walk(rng, n)
        starts = np.column_stack([np.concatenate([[0.0], np.cumsum(widths)[:-1]]), rises])
        points = list[list[Array]]()
        # by what share the pen falls short of each letter's points; the first letters are written with care
        settled = np.minimum((np.arange(n) + 0.5) / 4, 1.0)
        slurs = np.minimum(np.abs(self._slur.walk(rng, n)) * settled, _MOST_SLURRED)
        for glyph, shape, start, share in zip(glyphs, shapes, starts, slurs, strict=True):
            points.append([])
            for stroke, delayed in zip(glyph.strokes, glyph.delayed, strict=True):
                placed = slur_stroke(stroke, share) @ shape
                if delayed:
                    placed = placed + rng.normal([vary.late_right, 0.0], [vary.late_x, vary.late_y])
                points[-1].append(placed + start)
        bound_bars(glyphs, points)
        clear_dots(glyphs, points)
        return np.vstack([stroke for strokes in points for stroke in strokes]), float(widths.sum())

    def _shapes(self, n: int, rng: np.random.Generator) -> Array:
        """(n, 2, 2): for each letter the matrix that makes it broader or narrower, taller or shorter, and leans it.

        In a hurried hand the letters of a word grow flatter towards its end.
        """
        vary = self._vary
        fading = 1.0 - self._hand.fading * np.minimum(np.arange(n) / 6, 1.0)
        shapes = np.zeros((n, 2, 2))
        shapes[:, 0, 0] = np.exp(self._slow_breadth.draw_next(rng) + rng.normal(0.0, vary.breadth, n))
        heights = self._line_height.walk(rng, n) + self._height.walk(rng, n) + rng.normal(0.0, vary.own_height, n)
        shapes[:, 1, 1] = np.exp(heights) * fading
        shapes[:, 1, 0] = rng.normal(0.0, vary.shear, n)
        return shapes


def slur_stroke(stroke: Array, share: float) -> Array:
    """The points (n, 2) of a stroke, each moved by a share of the way to the middle of its neighbours, both ends kept.

    This is how a hand that turns back before it has arrived falls short: a row of arches becomes a zigzag, a loop
    closes, while a straight way stays what it is.
    """
    if len(stroke) < 3:
        return stroke
    short = stroke.copy()
    short[1:-1] += share * ((stroke[:-2] + stroke[2:]) / 2 - stroke[1:-1])
    return short


class DrawnHandwriting:
    """Writes one text in a drawn hand, word by word on demand, independently of the lines.

    streams : the generators of the text, and of what in it is struck out: all else stays as it is without.
    jitter : scale of all variation; rewrites : words that are written again; ruled : on rules, which letters keep to.
    """

    def __init__(
        self, hand: Hand, streams: Sequence[np.random.Generator], jitter: float, rewrites: Rewrites, ruled: bool
    ) -> None:
        self._hand, self._jitter, self._rewrites = hand, jitter, rewrites
        self.baseline_model, self.stock = on_rules(USUAL_BASELINES) if ruled else USUAL_BASELINES, drawn_forms(hand)
        self.writers = [WordWriter(hand, rng, jitter, self.baseline_model) for rng in streams]
        self.name, self.pitch, self.space, self.repertoire = hand.name, hand.pitch, hand.word_space, hand.repertoire

    def wander(self, key: Sequence[int]) -> Wander:
        """See `pages.Handwriting`."""
        from handout.mathematics.shapes import Wander

        return Wander(word_stream(self.writers[0].seeds[0], (*key, 0)), self._jitter)

    def ink_box(self, word: Word[PlannedGlyph]) -> tuple[float, float, float, float]:
        """See `pages.Handwriting`."""
        xy = np.concatenate([stroke for glyph in word.glyphs for stroke in glyph.strokes])
        (left, bottom), (right, top) = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
        return left, bottom, right, top

    def set_paragraph(self, words: Iterable[Choice]) -> Iterator[Unit[PlannedGlyph]]:
        """See `pages.Handwriting`."""
        for choice in words:
            writer = self.writers[choice.intended is not None]
            forms, at = [self.stock.glyphs[number] for number in choice.numbers], choice.letters[0].at
            rng = word_stream(writer.seeds[0], choice.key)
            word = writer.word(forms, choice.letters, rng)
            if choice.intended is None and (times := self._rewrites.of(at)):
                word = writer.other(forms, choice.letters, word_stream(writer.seeds[1], (times, *choice.key)))
            yield Unit(word, self._gap(choice.spaces, rng), choice.intended)

    def _gap(self, spaces: int, rng: np.random.Generator) -> float:
        if not spaces:
            return 0.0
        usual = self._hand.word_space
        # a writer has one habit of spacing: neither a closed gap nor one that reads as two
        slack = rng.normal(0.0, USUAL.word_gap * self._jitter)
        return wide_gap(usual, spaces) + min(max(slack, -0.28 * usual), 0.5 * usual)

    def place(
        self, words: Sequence[Word[PlannedGlyph]], starts: Sequence[float], scale: float, to_page: ToPage
    ) -> Iterator[Placed]:
        """See `pages.Handwriting`."""
        for number, (word, start) in enumerate(zip(words, starts, strict=True)):
            for i, (each, at) in enumerate(zip(word.glyphs, word.at, strict=True)):
                strokes = tuple(to_page(stroke * scale + (start, 0.0)) for stroke in each.strokes)
                yield Placed(each.glyph, strokes, each.joined and i > 0, number, at)
