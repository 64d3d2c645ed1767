"""Time that a hand spends between strokes."""

from __future__ import annotations

import math

# people write about 1.25 characters a second, lifts included
_LIFT = 0.11  # s, inside a word
_WORD = 0.22  # s more, between words
_LINE = 0.45  # s more, between lines
_SPEED = 18.0  # x-heights a second, of the way between


def in_the_air(way: float, *, line: bool, word: bool) -> float:
    """Seconds with the pen up.

    Parameters
    ----------
    way : x-heights from the end of one movement to the beginning of the next.
    line, word : whether they are on different lines, and of different words.
    """
    pause = _LINE if line else _WORD if word else 0.0
    # a hand crosses the page quicker, mm for mm, than it goes to the next letter
    return _LIFT + pause + math.sqrt(way) / math.sqrt(_SPEED) * 0.25
