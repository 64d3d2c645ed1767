"""Synthetic writers and what they write: the built-in hands with habits that people have and those hands lack.

Each writer is a `Hand`.  It may take some letters from a second built-in hand (letters are stored upright and one
x-height high, so that they fit), and may write its n like a u.
Half of the texts are sentences, half are random words mixed with groups of capitals, digits and punctuation, so that
every letter of the alphabet is seen next to many others.
"""

from __future__ import annotations

import string
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout.hand import library
from handout.hand.drawn import Hand
from handout.values import Array, Glyph
from handout.writing.variation import warp

# shares, set so that writers differ about as much as those of five real pages
_BORROWS = 0.45  # of writers who have letters of a second hand
_BORROWED = (0.15, 0.7)  # of their letters
_TURNED = 0.2  # of writers who write n like u and m like w
_FORM = 500  # numbers of borrowed forms start here, so that no two forms share one
_SENTENCES, _WORDS = 2, 24  # in a text, which one writer writes: about two lines
_GROUPED = 0.3  # share of the words that are groups of characters
_RARE = "–£€ßæøœ…éèàüöäçñ"
# standard deviations of what makes a writer's form of a letter his own, set by eye: letters stay what they are
_OWN_BREADTH, _OWN_HEIGHT, _OWN_LEAN = 0.14, 0.14, 0.08
_OWN_BEND = 0.11  # greatest, of a smooth field that bends a form, x-heights …
_OWN_WAVES = (0.9, 2.6)  # … with waves of these lengths
_HELD = 0.5  # x-heights from where a letter is joined, within which its form is bent less
_LIFTS, _LIFTED = 0.35, 0.4  # share of writers who lift the pen after some letters, and greatest share of those


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
    glyphs = dict(hand.glyphs)
    if len(hands) > 1 and rng.random() < _BORROWS:
        other = hands[int(rng.integers(len(hands)))]
        share = rng.uniform(*_BORROWED)
        glyphs |= {letter: forms for letter, forms in other.glyphs.items() if rng.random() < share}
    if rng.random() < _TURNED:
        # forms of n like u and of m like w: arches that are written from below look so
        pairs = [(letter, like) for letter, like in (("n", "u"), ("m", "w")) if letter in glyphs and like in glyphs]
        glyphs |= {
            letter: glyphs[letter]
            + tuple(replace(form, letter=letter, form=form.form + _FORM) for form in glyphs[like])
            for letter, like in pairs
        }
    return replace(hand, glyphs=glyphs)


def with_own_forms(hand: Hand, rng: np.random.Generator) -> Hand:
    """The same hand as a person with other forms writes it: every letter with proportions, lean and bends of its own.

    Ends at which letters are joined keep their height, so that joins still meet.  Some writers lift the pen after
    some letters.
    """
    lifts = float(rng.uniform(0.0, _LIFTED)) if rng.random() < _LIFTS else 0.0
    bend = float(rng.uniform(0.0, _OWN_BEND))
    glyphs = {}
    for letter, forms in hand.glyphs.items():
        seed, lifted = int(rng.integers(2**32)), rng.random() < lifts
        glyphs[letter] = tuple(_own_form(form, np.random.default_rng(seed), bend, lifted) for form in forms)
    return replace(hand, glyphs=glyphs)


def _own_form(form: Glyph, rng: np.random.Generator, bend: float, lifted: bool) -> Glyph:
    """One form, changed alike for the same state of the generator."""
    xy = np.vstack(form.strokes)
    breadth, tall = np.exp(rng.normal(0.0, (_OWN_BREADTH, _OWN_HEIGHT)))
    x, y = xy.T
    bent = np.column_stack(
        [x * breadth + rng.normal(0.0, _OWN_LEAN) * (y - 0.5), np.where(y > 1, 1 + (y - 1) * tall, y)]
    )
    bent = bent + warp(xy, rng, bend, *_OWN_WAVES)
    held = np.zeros(len(xy))
    for end, joins in ((form.strokes[0][0], form.entry), (form.strokes[form.last_main][-1], form.exit)):
        if joins != "lifted":
            held = np.maximum(held, np.clip(1 - np.hypot(*(xy - end).T) / _HELD, 0.0, 1.0))
    bent[:, 1] = held * y + (1 - held) * bent[:, 1]
    strokes: list[Array] = np.split(bent, np.cumsum([len(stroke) for stroke in form.strokes])[:-1])
    ends = "lifted" if lifted else form.exit
    return replace(form, strokes=tuple(strokes), width=form.width * float(breadth), exit=ends)


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
