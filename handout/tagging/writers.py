"""Writers for training: the built-in hands, mixed, and with habits that people have and the hands have not.

Each writer is a hand of its own.  Some of its letters may come from another built-in hand (letters are kept upright and
one x-height high, so that they fit), and its n may be another writer's u.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout.values import Glyph, Hand

_BORROWS = 0.45  # how many writers have letters of a second hand
_BORROWED = (0.15, 0.7)  # and what share of their letters
_TURNED = 0.2  # how many write n as u, m as w or h without its arch
_FORM = 500  # numbers of borrowed forms start here, so that no two forms share one


@dataclass(frozen=True)
class Habits:
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


def habits(rng: np.random.Generator) -> Habits:
    """The habits of a writer, drawn at random."""

    def now_and_then(share: float, least: float, most: float) -> float:
        return float(rng.uniform(least, most)) if rng.random() < share else 0.0

    return Habits(
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


def writer(hands: Sequence[Hand], rng: np.random.Generator) -> Hand:
    """A writer whose letters are those of one of `hands`, some perhaps those of another."""
    hand = hands[int(rng.integers(len(hands)))]
    glyphs = dict(hand.glyphs)
    if len(hands) > 1 and rng.random() < _BORROWS:
        other = hands[int(rng.integers(len(hands)))]
        share = rng.uniform(*_BORROWED)
        glyphs |= {letter: forms for letter, forms in other.glyphs.items() if rng.random() < share}
    if rng.random() < _TURNED:
        glyphs |= _turned(glyphs)
    return replace(hand, glyphs=glyphs)


def _turned(glyphs: Mapping[str, tuple[Glyph, ...]]) -> dict[str, tuple[Glyph, ...]]:
    """n drawn as u, m as w: what is left of arches that are written from below."""
    pairs = [(letter, like) for letter, like in (("n", "u"), ("m", "w")) if letter in glyphs and like in glyphs]
    return {
        letter: glyphs[letter] + tuple(replace(form, letter=letter, form=form.form + _FORM) for form in glyphs[like])
        for letter, like in pairs
    }
