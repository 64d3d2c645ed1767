"""Accented letters, built from a letter and the hand's own marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handout.hand.diacritics import APOSTROPHE, BAR, BELOW, DOTLESS, NOT_ABOVE, OGONEK, STROKE_HEIGHT, THROUGH
from handout.hand.letter_classes import STEM_AT_LEFT
from handout.values import Array, Glyph, Hand

_TALL = 1.25  # a letter higher than this lifts its accent
_CLEAR = 1.0  # accents are drawn over letters of this height
_STOREY = 0.45  # x-heights from one accent to the next above it
_LOW, _ON_THE_LINE = 0.3, 0.14  # shares of the height, x-heights: where feet are, and ends that are feet
_TOP = 0.5  # x-heights below a letter's top beside which an apostrophe hangs
_DENSE = 12  # places between two points


def accented(glyph: Glyph, marks: tuple[str, ...], hand: Hand, rng: np.random.Generator) -> Glyph:
    """`glyph` with `marks` set on it; i and j lose their dots to an accent above."""
    strokes, delayed = glyph.parted(glyph.strokes)
    above = [mark for mark in marks if mark not in NOT_ABOVE]
    dotted = glyph.letter in ("i", "j") and above
    delayed = [] if dotted else delayed
    beside: list[Array] = []
    for mark in marks:
        if mark == DOTLESS:
            continue
        forms = hand.marks[mark]
        form = forms[int(rng.integers(len(forms)))]
        placed = _placed(form.strokes, strokes, glyph, mark)
        if mark in above:
            storey = np.array([0.0, _STOREY * above.index(mark)])
            placed = [stroke + storey for stroke in placed]
        # what takes room beside a letter is written with it, where the pen is lifted anyway
        (beside if mark == APOSTROPHE and glyph.exit == "lifted" else delayed).extend(placed)
    flags = (False,) * (len(strokes) + len(beside)) + (True,) * len(delayed)
    return replace(glyph, strokes=(*strokes, *beside, *delayed), delayed=flags)


def _placed(mark: Sequence[Array], letter: Sequence[Array], glyph: Glyph, kind: str) -> list[Array]:
    """The strokes of a mark where they go on a letter."""
    if kind in THROUGH:
        return _crossing(mark, letter, glyph.letter, kind)
    if kind == OGONEK:
        seat = _foot(letter)
    elif kind == APOSTROPHE:
        body = np.vstack(letter)
        top = float(body[:, 1].max())
        seat = np.array([float(body[body[:, 1] > top - _TOP, 0].max()), top])
    else:
        seat = _seat(letter, glyph, kind)
    return [stroke + seat for stroke in mark]


def _seat(strokes: Sequence[Array], glyph: Glyph, mark: str) -> Array:
    """Where the centre of the mark goes, relative to that of an x-height letter at x = 0."""
    body = np.vstack([*strokes[:-1], strokes[-1][:-1] if glyph.exit == "high" else strokes[-1]])
    top = float(body[:, 1].max())
    if mark in BELOW:
        under = body[body[:, 1] < 0.35 * top]
        return np.array([0.5 * (under[:, 0].min() + under[:, 0].max()), 0.0])
    if glyph.letter in ("i", "j"):
        centre = float(body[body[:, 1].argmax(), 0]) + 0.02
    else:
        upper = body[body[:, 1] > 0.5 * top]
        centre = 0.5 * float(upper[:, 0].min() + upper[:, 0].max())
    return np.array([centre, top - _CLEAR if top > _TALL else 0.0])


def _foot(strokes: Sequence[Array]) -> Array:
    """The place from which an ogonek hangs: the rightmost foot, where a stroke turns on the line, or else ends there.

    What leaves a foot along the line, as the last stroke of a word does, is no part of it.
    """
    top = max(float(stroke[:, 1].max()) for stroke in strokes)
    feet = [np.vstack(strokes)[np.vstack(strokes)[:, 1].argmin()]]
    for stroke in strokes:
        y = stroke[:, 1]
        turns = np.flatnonzero((y[1:-1] <= y[:-2]) & (y[1:-1] <= y[2:]) & (y[1:-1] < _LOW * top)) + 1
        ends = [end for end in (stroke[0], stroke[-1]) if end[1] < _ON_THE_LINE]
        feet += ends if top > _TALL or not len(turns) else [stroke[turns[-1]]]
        feet += [stroke[i] for i in turns]
    return np.asarray(max(feet, key=lambda foot: float(foot[0])))


def _crossing(mark: Sequence[Array], letter: Sequence[Array], name: str, kind: str) -> list[Array]:
    """A stroke through a letter, as broad as it takes to leave all of its stems; it was drawn through one at x = 0."""
    body = np.vstack(letter)
    low, high = max(0.0, float(body[:, 1].min())), float(body[:, 1].max())
    y = low + STROKE_HEIGHT.get(name, 0.5) * (high - low)
    stems = np.concatenate([_at(stroke, y) for stroke in letter])
    if not len(stems):
        stems = np.array([body[:, 0].min(), body[:, 0].max()])
    left, right = float(stems.min()), float(stems.min() if name in STEM_AT_LEFT else stems.max())
    aside = 0.5 * (right - left) if kind == BAR else 0.0
    return [np.column_stack([s[:, 0] + np.sign(s[:, 0]) * aside + 0.5 * (left + right), s[:, 1] + y]) for s in mark]


def _at(stroke: Array, y: float) -> Array:
    """(n,): where a stroke crosses a height, x."""
    at = np.linspace(0, len(stroke) - 1, _DENSE * len(stroke))
    x, height = (np.interp(at, np.arange(len(stroke)), axis) for axis in stroke.T)
    over = height > y
    return np.asarray(x[1:][over[1:] != over[:-1]])
