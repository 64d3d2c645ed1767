"""A hand in a hurry, or taking care: one knob that every hand has.

Haste makes a hand quicker, larger in breadth and smaller in height, more slanted and more joined; it rounds what it
passes, its words flatten towards their ends, and their last strokes trail off.  Care does the opposite.  The
directions are those of writing speeded up on request; the amounts are this project's, set by looking.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handout.errors import InputError
from handout.values import Array, Glyph, Hand

_LAST = frozenset({"end", "alone"})
# at haste 1; care (haste −1) goes as far the other way, except where it says
_SMOOTH, _SMOOTH_CARE = 0.05, 0.03
_PACE = 0.3  # of the logarithm of the interval
_SLANT = 0.06  # tangent
_BREADTH, _HEIGHT = 0.07, -0.06  # of the logarithm
_VARIATION = 0.35  # of the logarithm
_FADING = 0.16
_TRAIL = 0.22  # x-heights that the last stroke of a word reaches further
_JOINING = 2.0  # added to the reluctance to lift


def hasten(hand: Hand, haste: float) -> Hand:
    """`hand` written with haste.

    Parameters
    ----------
    haste : float
        −1 (careful) to 1 (as fast as it goes); 0 is the hand as it was drawn.

    Raises
    ------
    InputError
        A haste outside −1 to 1.
    """
    if not -1 <= haste <= 1:
        raise InputError(f"haste: {haste:g} is outside -1 (careful) to 1 (hurried).")
    if haste == 0:
        return hand
    shape = np.diag(np.exp([_BREADTH * haste, _HEIGHT * haste]))
    return replace(
        hand,
        glyphs={letter: tuple(_glyph(g, shape, haste) for g in glyphs) for letter, glyphs in hand.glyphs.items()},
        marks={mark: tuple(_glyph(g, shape, 0.0) for g in glyphs) for mark, glyphs in hand.marks.items()},
        smooth=hand.smooth + (_SMOOTH if haste > 0 else _SMOOTH_CARE) * haste,
        interval=hand.interval * float(np.exp(-_PACE * haste)),
        slant=hand.slant + _SLANT * haste,
        word_space=hand.word_space * float(np.exp(_BREADTH * haste)),
        variation=hand.variation * float(np.exp(_VARIATION * haste)),
        fading=max(0.0, hand.fading + _FADING * haste),
    )


def _glyph(glyph: Glyph, shape: Array, haste: float) -> Glyph:
    strokes = [stroke @ shape for stroke in glyph.strokes]
    width = glyph.width * float(shape[0, 0])
    if haste > 0 and glyph.exit == "lifted" and glyph.places <= _LAST and glyph.letter.islower():
        last = glyph.late.index(True) - 1 if True in glyph.late else len(strokes) - 1
        trailed = _trailed(strokes[last], haste)
        width += max(0.0, float(trailed[-1, 0] - strokes[last][-1, 0]))
        strokes[last] = trailed
    joining = glyph.reluctance + _JOINING * haste if glyph.reluctance else 0.0
    return replace(glyph, strokes=tuple(strokes), width=width, reluctance=joining)


def _trailed(stroke: Array, haste: float) -> Array:
    """The last stroke of a word, its tip drawn out along the line if it leaves to the right near the line."""
    tip, before = stroke[-1], stroke[-2] if len(stroke) > 1 else stroke[-1]
    if tip[0] <= before[0] or not -0.1 < tip[1] < 0.6:
        return stroke
    moved = np.array([tip[0] + _TRAIL * haste, tip[1] * (1 - 0.5 * haste)])
    return np.vstack([stroke[:-1], moved])
