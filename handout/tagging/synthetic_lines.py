"""Lines of writing for training, with the place of every letter known.

They come out of the product itself: text is composed in a hand, given a writer's habits, and traced by the motor
engine; the traced strokes are drawn into the image of a straightened, upright line.

Each writer is a `Hand` with habits that people have and the built-in hands lack.  It may take some letters from a
second built-in hand (letters are stored upright and one x-height high, so that they fit), and may write its n like a
u. Half of the texts are sentences, half are random words mixed with groups of capitals, digits and punctuation, so
that every letter of the alphabet is seen next to many others.
"""

from __future__ import annotations

import string
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import JUNK, SPACE, THIRDS, fold, state
from handout.hand import library
from handout.hand.drawn import DerivedForms, Hand
from handout.motion.trace import letters_of_samples, trace
from handout.tagging.line_space import ABOVE, HEIGHT, STEP, X_HEIGHT, Image, column_count, describe
from handout.tagging.network import LabelledColumns
from handout.values import Array, Glyph, Indices, Line, Manuscript, Page, Placed, Stroke
from handout.writing.compose import compose
from handout.writing.drawn_words import slur_stroke
from handout.writing.layout import Layout
from handout.writing.variation import warp

# shares, set so that writers differ about as much as those of five real pages
_BORROWS = 0.45  # of writers who have letters of a second hand
_BORROWED = (0.15, 0.7)  # of their letters
_TURNED = 0.2  # of writers who write n like u and m like w
_FORM = 500  # numbers of borrowed forms start here, so that no two forms share one
_SENTENCES, _WORDS = 2, 24  # in a text, which one writer writes: about two lines
_GROUPED = 0.3  # share of the words that are groups of characters
_RARE = "–£€ßæøœ…éèàüöäçñ"


def built_in_hands() -> list[Hand]:
    """The drawn hands that handout comes with."""
    return [library.load(name) for name in library.names() if name.startswith("house-")]


@dataclass(frozen=True)
class WriterHabits:
    """What one writer does beyond the forms of the letters; lengths in x-heights.

    tight : how far letters are set off beyond their hand's distance, negative: closer.
    gap : between words.
    slur : share by which arches fall flat, added to the hand's own.
    swash : length of the stroke that leads into a word, 0: none.
    tail : length of the stroke that leads out of a word, 0: none.
    breadth, size, shear, rise : of all letters; relative, relative, tangent, and over the line.
    ascender, descender : lengths, 1 as drawn.
    wobble : of the smooth field that bends the writing.
    pen : width of the line.
    haste : smoothing, relative to the hand's.
    """

    tight: float
    gap: float
    slur: float
    swash: float
    tail: float
    breadth: float
    size: float
    shear: float
    rise: float
    ascender: float
    descender: float
    wobble: float
    pen: float
    haste: float


def random_habits(rng: np.random.Generator) -> WriterHabits:
    """The habits of a writer, drawn at random."""

    def now_and_then(share: float, least: float, most: float) -> float:
        return float(rng.uniform(least, most)) if rng.random() < share else 0.0

    return WriterHabits(
        tight=float(rng.uniform(-0.12, 0.22)),
        gap=float(rng.uniform(0.5, 1.8)),
        slur=now_and_then(0.4, 0.05, 0.4),
        swash=now_and_then(0.25, 0.3, 0.9),
        tail=now_and_then(0.3, 0.3, 1.1),
        breadth=float(np.exp(rng.normal(0.0, 0.18))),
        size=float(np.exp(rng.normal(0.0, 0.07))),
        shear=float(rng.normal(0.0, 0.1)),
        rise=float(rng.normal(0.0, 0.05)),
        ascender=float(np.exp(rng.normal(0.0, 0.18))),
        descender=float(np.exp(rng.normal(0.0, 0.18))),
        wobble=float(rng.uniform(0.0, 0.07)),
        pen=float(rng.uniform(0.06, 0.17)),
        haste=float(rng.uniform(0.9, 1.35)),
    )


def random_writer(hands: Sequence[Hand], rng: np.random.Generator) -> Hand:
    """A writer with the letters of one of `hands`, and perhaps some of another."""
    hand = hands[int(rng.integers(len(hands)))]
    drawn = dict.fromkeys(hand.glyphs, hand)
    if len(hands) > 1 and rng.random() < _BORROWS:
        other = hands[int(rng.integers(len(hands)))]
        share = rng.uniform(*_BORROWED)
        drawn |= {letter: other for letter in other.glyphs if rng.random() < share}
    # forms of n like u and of m like w: arches that are written from below look so
    turned = {"n": "u", "m": "w"} if rng.random() < _TURNED else {}

    def forms_of(letter: str) -> tuple[Glyph, ...]:
        like, own = turned.get(letter), drawn[letter].glyphs[letter]
        if like not in drawn:
            return own
        return own + tuple(replace(each, letter=letter, form=each.form + _FORM) for each in drawn[like].glyphs[like])

    return replace(hand, glyphs=DerivedForms(drawn, forms_of))


def texts(sentences: Sequence[str], rng: np.random.Generator) -> Iterator[str]:
    """Texts to write, without end."""
    words = sorted({word for sentence in sentences for word in sentence.split()})
    while True:
        if rng.random() < 0.5:
            yield " ".join(rng.choice(np.array(sentences, dtype=object), _SENTENCES))
            continue
        yield " ".join(
            _group(rng) if rng.random() < _GROUPED else _dress_word(words[int(rng.integers(len(words)))], rng)
            for _ in range(_WORDS)
        )


def _group(rng: np.random.Generator) -> str:
    """Two to five characters of one kind, sometimes with a mark among them."""
    kinds = (string.ascii_uppercase, string.digits, string.punctuation, string.ascii_lowercase + _RARE)
    kind = kinds[int(rng.choice(4, p=(0.35, 0.35, 0.15, 0.15)))]
    group = list(rng.choice(list(kind), int(rng.integers(1, 5))))
    if rng.random() < 0.4:
        group.insert(int(rng.integers(len(group) + 1)), str(rng.choice(list(".,:;-'/!?\"()"))))
    return "".join(group)


def _dress_word(word: str, rng: np.random.Generator) -> str:
    """A word as it is, with a capital, all in capitals, in quotation marks, or followed by a mark."""
    chance = rng.random()
    if chance < 0.12:
        return word.capitalize()
    if chance < 0.16:
        return word.upper()
    if chance < 0.21:
        mark = str(rng.choice(["'", '"', "“”", "()"]))
        return mark[0] + word + mark[-1]
    return word + (str(rng.choice(list(",.;:!?-"))) if chance < 0.35 else "")


_MM = 3.0  # mm: x-height of the composed page
_PAGE = Page(170.0, 5000.0)  # mm: lines of usual length, any number of them
_BEFORE = 0.1  # x-heights from where a letter's box begins in its drawing to where the letter begins
_OVER = 0.35  # x-heights by which the last letter of a word may reach beyond its box
_MARGIN = 40  # pixels of paper on both sides: the window of features is 24 wide
_FIRM = 0.5  # weight, in points, of the prior that a placed letter is as broad and upright as it was drawn
_LED_INTO = frozenset("tiuwpjrsnmvylhbfkT")  # letters that people begin with a stroke from the left
_STRIKES_OUT = 0.25  # share of writers who strike words out …
_STRUCK = 0.06  # … and of the words that they strike out
# of a line's columns that are learned from: neighbours are nearly alike, and space is frequent and easy
SHARE, SHARE_OF_SPACE = 0.75, 0.3
Box = tuple[str, int, float, float]  # letter, word, left, right


@dataclass(frozen=True, eq=False)
class LetterSpan:
    """A letter of the alphabet and where it begins and ends along its line."""

    letter: str
    left: float
    right: float


@dataclass(frozen=True, eq=False)
class SyntheticLine:
    """A straightened line and the letters on it.

    image : (HEIGHT, w) uint8, 255 where there is ink.
    spans : letters from left to right, in pixels.
    """

    image: Image
    spans: tuple[LetterSpan, ...]


def write_lines(
    text: str, hand: Hand, habits: WriterHabits, rng: np.random.Generator, *, struck: bool = False
) -> list[SyntheticLine]:
    """The lines of `text` as `hand` writes it with these habits.

    struck : strike out a word now and then.
    """
    lines, strokes, _ = write_text(text, hand, habits, rng)
    return [_draw(line, of_line, habits, rng, struck) for line, of_line in zip(lines, strokes, strict=True) if of_line]


def write_text(
    text: str, hand: Hand, habits: WriterHabits, rng: np.random.Generator, engine: str = "optimal-control"
) -> tuple[list[HabitualLine], list[list[Stroke]], list[list[Indices]]]:
    """The lines of a text with a writer's habits, the strokes of each, and the letter in the text of every sample."""
    layout = Layout(_PAGE, x_height=_MM, jitter=float(rng.uniform(0.8, 1.7)))
    manuscript, *_ = compose(text, hand, layout, rng, fallback=True)
    lines = [HabitualLine(line, hand, habits, rng) for line in manuscript.lines]
    changed = Manuscript(tuple(line.line for line in lines), manuscript.page, manuscript.x_height)
    hurried = replace(hand, smooth=min(hand.smooth * habits.haste, 0.5))
    drawing = trace(changed, hurried, rng, engine)
    owner = {placed.word: number for number, line in enumerate(changed.lines) for placed in line.placed}
    strokes: list[list[Stroke]] = [[] for _ in lines]
    letters: list[list[Indices]] = [[] for _ in lines]
    for stroke, of in zip(drawing.strokes, letters_of_samples(changed, hurried), strict=True):
        strokes[owner[stroke.word]].append(stroke)
        letters[owner[stroke.word]].append(of)
    return lines, strokes, letters


class HabitualLine:
    """A composed line with a writer's habits: upright space, x-heights, y up from the baseline."""

    def __init__(self, line: Line, hand: Hand, habits: WriterHabits, rng: np.random.Generator) -> None:
        self._baseline, self._slant = line.baseline, hand.slant
        self.boxes: list[tuple[str, int, float, float]] = []
        placed: list[Placed] = []
        shift = 0.0
        for number, (_, group) in enumerate(groupby(line.placed, key=lambda p: p.word)):
            word = list(group)
            if number:
                shift += habits.gap - hand.word_space + float(rng.normal(0.0, 0.15))
            for i, unit in enumerate(word):
                lifted = not unit.joined
                shift += (habits.tight if lifted else 0.5 * habits.tight) if i else 0.0
                placed.append(self._move_glyph(unit, shift, habits, (i == 0, i == len(word) - 1), rng))
        self.line = replace(line, placed=tuple(placed))

    def upright(self, xy: Array) -> Array:
        """Page to upright space."""
        up = (self._baseline - xy[:, 1]) / _MM
        return np.column_stack([xy[:, 0] / _MM - self._slant * up, up])

    def _move_glyph(
        self, unit: Placed, shift: float, habits: WriterHabits, at: tuple[bool, bool], rng: np.random.Generator
    ) -> Placed:
        """The glyph moved along its line, with its box noted; led in and out where it begins or ends a word."""
        strokes = [self.upright(stroke) + np.array([shift, 0.0]) for stroke in unit.strokes]
        # where x = 0 of the drawing lies now, and its scale: least squares with a firm prior
        drawn, now = np.vstack(unit.glyph.strokes), np.vstack(strokes)
        a, b = (drawn - drawn.mean(axis=0)).T
        normal = np.array([[a @ a + _FIRM, a @ b], [a @ b, b @ b + _FIRM]])
        x = now[:, 0] - now[:, 0].mean()
        scale, lean = np.linalg.solve(normal, np.array([a @ x + _FIRM, b @ x]))
        left, scale = float(now[:, 0].mean() - drawn.mean(axis=0) @ (scale, lean)), float(scale)
        box = (left - _BEFORE, left + scale * unit.glyph.width - _BEFORE)
        self.boxes.append((fold(unit.glyph.letter), unit.word, *box))
        if habits.slur and unit.glyph.letter in "nmuhrwia":
            strokes = [slur_stroke(stroke, habits.slur) for stroke in strokes]
        first, last = at
        if first and habits.swash and unit.glyph.letter in _LED_INTO:
            strokes[0] = _led_in(strokes[0], habits.swash * rng.uniform(0.7, 1.2), rng)
        if last and habits.tail and unit.glyph.letter.isalpha():
            k = unit.glyph.last_main
            strokes[k] = _led_out(strokes[k], habits.tail * rng.uniform(0.7, 1.2), rng)
        return replace(
            unit,
            strokes=tuple(
                np.column_stack(
                    [(stroke[:, 0] + self._slant * stroke[:, 1]) * _MM, self._baseline - stroke[:, 1] * _MM]
                )
                for stroke in strokes
            ),
        )


def _led_in(stroke: Array, length: float, rng: np.random.Generator) -> Array:
    """A stroke that rises into the first one from the left, more or less bent."""
    start = stroke[0]
    if len(stroke) < 2 or start[1] < 0.3:
        return stroke
    low = start - (length, min(start[1], 1.1) * rng.uniform(0.3, 1.0))
    middle = 0.5 * (start + low) + (rng.normal(0.0, 0.05), rng.normal(-0.08, 0.08))
    return np.vstack([low, middle, stroke])


def _led_out(stroke: Array, length: float, rng: np.random.Generator) -> Array:
    """A stroke that runs on to the right from the last one."""
    end = stroke[-1]
    if len(stroke) < 2 or not -0.4 < end[1] < 1.2:
        return stroke
    far = np.array([end[0] + length, np.clip(end[1] + rng.normal(0.1, 0.3), -0.3, 1.3)])
    middle = 0.5 * (end + far) + (0.0, rng.normal(-0.05, 0.08))
    return np.vstack([stroke, middle, far])


def _draw(
    line: HabitualLine, strokes: Sequence[Stroke], habits: WriterHabits, rng: np.random.Generator, struck: bool
) -> SyntheticLine:
    paths = [line.upright(stroke.xy) for stroke in strokes]
    words = [stroke.word for stroke in strokes]
    # the boxes of each word end where its ink does, unless that is far beyond them
    boxes: list[Box] = []
    for word, group in groupby(line.boxes, key=lambda box: box[1]):
        boxes_of_word = sorted(group, key=lambda box: box[2] + box[3])
        ink = np.concatenate([p[:, 0] for p, w in zip(paths, words, strict=True) if w == word])
        lefts = [max(boxes_of_word[0][2] - _OVER, float(ink.min())), *(box[2] for box in boxes_of_word[1:])]
        rights = [*lefts[1:], min(boxes_of_word[-1][3] + _OVER, float(ink.max()) + 0.05)]
        boxes += [(box[0], word, a, b) for box, a, b in zip(boxes_of_word, lefts, rights, strict=True)]
    if struck:
        boxes = _strike(boxes, paths, words, rng)
    ends = np.array([[x, 0.5] for _, _, left, right in boxes for x in (left, right)])
    everything = bend_space(np.vstack([*paths, ends]), habits, rng)
    x = everything[:, 0] * X_HEIGHT
    shift = _MARGIN - float(x[: -len(ends)].min())
    pieces = np.split(np.column_stack([x + shift, ABOVE - everything[:, 1] * X_HEIGHT]), _ends_of(paths))
    edges = pieces[-1][:, 0]
    spans = tuple(
        LetterSpan(letter, float(a), float(b))
        for (letter, *_), a, b in zip(boxes, edges[::2], edges[1::2], strict=True)
        if b > a
    )
    return SyntheticLine(_draw_strokes(pieces[:-1], habits.pen * X_HEIGHT), spans)


def _ends_of(paths: Sequence[Array]) -> Array:
    return np.cumsum([len(path) for path in paths])


def bend_space(xy: Array, habits: WriterHabits, rng: np.random.Generator) -> Array:
    """Upright space with the writer's proportions and wobble."""
    x, y = xy.T.copy()
    y = np.where(y > 1, 1 + (y - 1) * habits.ascender, np.where(y < 0, y * habits.descender, y))
    xy = np.column_stack([x * habits.breadth + habits.shear * (y - 0.5), y])
    xy = xy + warp(xy, rng, habits.wobble, 1.5, 5.0)
    return habits.size * xy + (0.0, habits.rise)


def _strike(boxes: list[Box], paths: list[Array], words: list[int], rng: np.random.Generator) -> list[Box]:
    """Some words crossed out by one or more strokes, which are added to `paths`; their letters become one of junk."""
    struck: list[Box] = []
    for word, group in groupby(boxes, key=lambda box: box[1]):
        boxes_of_word = list(group)
        if rng.random() > _STRUCK:
            struck += boxes_of_word
            continue
        left, right = boxes_of_word[0][2], boxes_of_word[-1][3]
        for _ in range(int(rng.integers(1, 5))):
            n = int(rng.integers(2, 6))
            waypoints = np.column_stack([np.linspace(left, right, n), 0.5 + rng.normal(0.0, 0.35, n)])
            paths.append(waypoints + rng.normal(0.0, 0.05, (n, 2)))
            words.append(word)
        struck.append((JUNK, word, left, right))
    return struck


def _draw_strokes(paths: Sequence[Array], pen: float) -> Image:
    """(HEIGHT, w) uint8: the strokes as a round pen draws them."""
    import cv2

    width = int(max(path[:, 0].max() for path in paths)) + _MARGIN
    fine = np.zeros((2 * HEIGHT, 2 * width), np.uint8)
    points = [np.rint(path * 2 * 8).astype(np.int32) for path in paths]
    cv2.polylines(fine, points, False, 255, max(2, round(2 * pen)), cv2.LINE_AA, 3)
    return np.asarray(cv2.resize(fine, (width, HEIGHT), interpolation=cv2.INTER_AREA))


def synthetic_lines(
    hands: Sequence[Hand], sentences: Sequence[str], count: int, rng: np.random.Generator
) -> Iterator[SyntheticLine]:
    """At least `count` lines; every two or three are by another writer."""
    source, written = texts(sentences, rng), 0
    while written < count:
        text, writer, habits = next(source), random_writer(hands, rng), random_habits(rng)
        lines = write_lines(text, writer, habits, rng, struck=rng.random() < _STRIKES_OUT)
        written += len(lines)
        yield from lines


def sampled_columns(
    line: SyntheticLine, rng: np.random.Generator, share: float = SHARE, share_of_space: float = SHARE_OF_SPACE
) -> LabelledColumns:
    """A random share of the columns of a line, and another share of its columns of space, with their states."""
    states = column_states([(s.letter, s.left, s.right) for s in line.spans], column_count(line.image))
    chosen = np.flatnonzero(rng.random(len(states)) < np.where(states == state(SPACE), share_of_space, share))
    return LabelledColumns(describe(line.image, chosen), states[chosen])


def column_states(spans: Sequence[tuple[str, float, float]], columns: int) -> NDArray[np.intp]:
    """(columns,) int: the state of every column, given letters with their left and right ends in pixels."""
    states = np.full(columns, state(SPACE), dtype=np.intp)
    x = np.arange(columns) * STEP
    for letter, left, right in spans:
        first, end = np.searchsorted(x, (left, right))
        if letter in (JUNK, SPACE):
            states[first:end] = state(letter)
            continue
        third = ((x[first:end] - left) * (THIRDS / max(right - left, 1e-6))).astype(np.intp)
        states[first:end] = state(letter, 0) + np.minimum(third, THIRDS - 1)
    return states
