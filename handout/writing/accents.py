"""Accented letters, built from a letter and the hand's own marks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handout.values import Array, Glyph, Hand

_BELOW = {"\u0327"}  # cedilla
_TALL = 1.25  # a letter higher than this lifts its accent
_CLEAR = 1.0  # accents are drawn over letters of this height


def accented(glyph: Glyph, marks: tuple[str, ...], hand: Hand, rng: np.random.Generator) -> Glyph:
    """`glyph` with `marks` set on it; i and j lose their dots to an accent above."""
    strokes = [s for s, late in zip(glyph.strokes, glyph.late, strict=True) if not late]
    above = any(mark not in _BELOW for mark in marks)
    dotted = glyph.letter in ("i", "j") and above
    late = [s for s, is_late in zip(glyph.strokes, glyph.late, strict=True) if is_late and not dotted]
    for mark in marks:
        forms = hand.marks[mark]
        form = forms[int(rng.integers(len(forms)))]
        shift = _seat(strokes, glyph, mark)
        late.extend(stroke + shift for stroke in form.strokes)
    return replace(glyph, strokes=(*strokes, *late), late=(False,) * len(strokes) + (True,) * len(late))


def _seat(strokes: list[Array], glyph: Glyph, mark: str) -> Array:
    """Where the centre of the mark goes, relative to that of an x-height letter at x = 0."""
    body = np.vstack([*strokes[:-1], strokes[-1][:-1] if glyph.exit == "high" else strokes[-1]])
    top = float(body[:, 1].max())
    if mark in _BELOW:
        under = body[body[:, 1] < 0.35 * top]
        return np.array([0.5 * (under[:, 0].min() + under[:, 0].max()), 0.0])
    if glyph.letter in ("i", "j"):
        centre = float(body[body[:, 1].argmax(), 0]) + 0.02
    else:
        upper = body[body[:, 1] > 0.5 * top]
        centre = 0.5 * float(upper[:, 0].min() + upper[:, 0].max())
    return np.array([centre, top - _CLEAR if top > _TALL else 0.0])
