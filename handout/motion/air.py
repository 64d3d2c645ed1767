"""Time that a hand spends between strokes.

Source: medians of 1264 lifts in 92 sentences by 13 writers (UNIPEN, `atu`), told in durations of the writer's own usual
stroke and by distance.  The time for a new line is not measured: no recording of several lines was at hand.
"""

from __future__ import annotations

import math

# s: with it the usual stroke of traced ink lasts .15, as those of two healthy writers on paper (.135 and .160)
STROKE = 0.18
# in strokes, and in strokes by the square root of the way in x-heights
_LIFT, _LIFT_BY_WAY = 0.38, 0.41
_WORD, _WORD_BY_WAY = 0.23, 1.88
_LINE = 2.0  # strokes more
_FARTHEST = 6.0  # x-heights: a hand goes back to the margin quicker, mm for mm, than to the next word
# of the logarithm: how much one lift differs from another of the same way
HESITATION, _MOST = 0.5, 2.0


def in_the_air(way: float, *, line: bool, word: bool, chance: float = 0.0) -> float:
    """Seconds with the pen up.

    Parameters
    ----------
    way : x-heights from the end of one movement to the beginning of the next.
    line, word : whether they are on different lines, and of different words.
    chance : how many standard deviations the pause is longer or shorter than usual.
    """
    first, by_way = (_WORD, _WORD_BY_WAY) if line or word else (_LIFT, _LIFT_BY_WAY)
    strokes = first + by_way * math.sqrt(min(way, _FARTHEST)) + (_LINE if line else 0.0)
    return STROKE * strokes * math.exp(HESITATION * min(max(chance, -_MOST), _MOST))
