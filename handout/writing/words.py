"""A word as it is written: its glyphs chosen, set side by side and given life, before it has a place on a line.

Word space is letter space (x-height 1, baseline 0, y up) with the word's first letter at x = 0, slanted.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from handout.values import Array, Glyph, Hand
from handout.writing.accents import accented
from handout.writing.choice import Chooser, joined
from handout.writing.text import Letter

# Standard deviations at jitter 1, in x-heights unless said otherwise
SLANT = 0.025  # tangent, a word
SIZE = 0.025  # relative, a word
RISE = 0.02  # a letter, correlated with its neighbours
GAP = 0.022  # a letter
BREADTH = 0.06  # relative width of a letter
HEIGHT = 0.035  # relative height of a letter
SHEAR = 0.022  # slant of a letter against its word, tangent
# smooth fields that bend a word: (standard deviation, shortest and longest wavelength)
WARPS = ((0.028, 1.6, 3.4), (0.016, 0.7, 1.6))
CAPITALS = 0.12  # x-heights between two capitals, besides their widths
_RISE_MEMORY = 0.7
_WAVES = 6


@dataclass(frozen=True, eq=False)
class Word:
    """Glyphs with their strokes in word space, which of them are joined to the one before, and the advance.

    at, spelt : index in the text and grapheme of each glyph.
    left, right : horizontal extent of the ink within reach of the neighbouring words, x-heights.
    """

    glyphs: tuple[Glyph, ...]
    strokes: tuple[tuple[Array, ...], ...]
    joins: tuple[bool, ...]
    at: tuple[int, ...]
    spelt: tuple[str, ...]
    advance: float
    left: float
    right: float


def write_word(
    letters: Sequence[Letter], hand: Hand, chooser: Chooser, rng: np.random.Generator, jitter: float
) -> Word:
    """Choose the forms of a word and set them side by side."""
    jitter *= hand.variation
    glyphs = [
        accented(glyph, letter.marks, hand, rng) if letter.marks else glyph
        for glyph, letter in zip(chooser.word(letters), letters, strict=True)
    ]
    joins = (False, *(joined(a, b) for a, b in pairwise(glyphs)))
    shapes = _shapes(len(glyphs), rng, jitter)
    widths = _advances(glyphs) * shapes[:, 0, 0] + rng.normal(0.0, GAP * jitter, len(glyphs))
    starts = np.column_stack([np.concatenate([[0.0], np.cumsum(widths)[:-1]]), _walk(rng, len(glyphs), RISE * jitter)])
    flat = np.vstack(
        [
            stroke @ shape + start
            for glyph, shape, start in zip(glyphs, shapes, starts, strict=True)
            for stroke in glyph.strokes
        ]
    )
    flat = flat + sum(_warp(flat, rng, sd * jitter, shortest, longest) for sd, shortest, longest in WARPS)
    slant = hand.slant + rng.normal(0.0, SLANT * jitter)
    size = 1.0 + rng.normal(0.0, SIZE * jitter)
    flat = size * (flat + slant * flat[:, 1:] * (1.0, 0.0))
    advance = size * float(widths.sum())
    return Word(
        glyphs=tuple(glyphs),
        strokes=_unflatten(flat, glyphs),
        joins=joins,
        at=tuple(letter.at for letter in letters),
        spelt=tuple(unicodedata.normalize("NFC", letter.base + "".join(letter.marks)) for letter in letters),
        advance=advance,
        left=float(flat[:, 0].min()),
        right=max(float(flat[flat[:, 1] > -0.2, 0].max(initial=0.0)), advance - 0.2),
    )


def _advances(glyphs: Sequence[Glyph]) -> Array:
    """How far each glyph is from the next; capitals among themselves stand further apart than before small letters."""
    letters = [glyph.letter for glyph in glyphs]
    capitals = [a.isupper() and b.isupper() for a, b in pairwise(letters)] + [False]
    return np.array([glyph.width for glyph in glyphs]) + CAPITALS * np.array(capitals)


def _shapes(n: int, rng: np.random.Generator, jitter: float) -> Array:
    """(n, 2, 2): for each letter the matrix that makes it broader or narrower, taller or shorter, and leans it."""
    shapes = np.zeros((n, 2, 2))
    shapes[:, 0, 0] = np.exp(rng.normal(0.0, BREADTH * jitter, n))
    shapes[:, 1, 1] = np.exp(_walk(rng, n, HEIGHT * jitter))
    shapes[:, 1, 0] = rng.normal(0.0, SHEAR * jitter, n)
    return shapes


def _walk(rng: np.random.Generator, n: int, sd: float) -> Array:
    """A first-order autoregressive walk of standard deviation `sd`."""
    steps = rng.normal(0.0, sd * np.sqrt(1 - _RISE_MEMORY**2), n)
    walk = np.empty(n)
    value = rng.normal(0.0, sd)
    for i in range(n):
        walk[i] = value
        value = _RISE_MEMORY * value + steps[i]
    return walk


def _warp(xy: Array, rng: np.random.Generator, sd: float, shortest: float, longest: float) -> Array:
    """Displacements by a smooth random field, so that strokes that cross or touch stay registered.

    White noise a point would kink the eased ends of strokes; a field bends the word as a whole.
    """
    angle = rng.uniform(0.0, 2 * np.pi, _WAVES)
    length = rng.uniform(shortest, longest, _WAVES)
    phase = rng.uniform(0.0, 2 * np.pi, _WAVES)
    size = rng.normal(0.0, sd * np.sqrt(2 / _WAVES), (_WAVES, 2))
    wave = 2 * np.pi / length * np.vstack([np.cos(angle), np.sin(angle)])
    return np.asarray(np.sin(xy @ wave + phase) @ size)


def _unflatten(flat: Array, glyphs: Sequence[Glyph]) -> tuple[tuple[Array, ...], ...]:
    sizes = [len(stroke) for glyph in glyphs for stroke in glyph.strokes]
    pieces = iter(np.split(flat, np.cumsum(sizes)[:-1]))
    return tuple(tuple(next(pieces) for _ in glyph.strokes) for glyph in glyphs)
