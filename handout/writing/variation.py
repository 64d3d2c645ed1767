"""How people vary, as named distributions: one place for every standard deviation of the writing.

All are normal unless said otherwise, in x-heights unless said otherwise, and correlated where people's are: a writer
who leans more in one word leans more in the next, and letters' heights, and heights over the line, wander from letter
to letter, through the spaces between words, so that no word is taller or higher as a whole than those beside it.
`Variation.scaled` is what the knob ``jitter`` turns; at 0 every letter has its ideal form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from handout.values import Array, Indices


@dataclass(frozen=True)
class Variation:
    """Standard deviations.

    slant : tangent, of a word about the hand's slant; `SLANT_MEMORY` is its correlation with the word before.
    slow_slant, slow_breadth : tangent and relative: how a writer changes over a page, a page being two or three
        times as long as the memory, `SLOW_MEMORY`.
    line_height : relative, of the letters of a stretch; each is correlated with the one before by `LINE_MEMORY`.
    line_rise : of the writing's height over the line, correlated so, too.
    rise : of a letter's height over that, correlated with the one before by `LETTER_MEMORY`.
    gap : of the distance between letters.
    breadth, height, own_height : relative width and height of a letter; `height` is correlated by `LETTER_MEMORY`.
    shear : tangent, slant of a letter against its word.
    warp, warp_fine : of the smooth fields that bend a word, of long (1.6–3.4) and short (0.7–1.6) waves.
    slur : how far the pen falls short of what it aims at, in shares of the way to the middle between what comes before
        and after; half a normal distribution, correlated by `LETTER_MEMORY`, growing over the first letters of a word.
    late_x, late_y : of a dot, bar or accent about its place; `late_right`: how far it flies right on average.
    word_gap : of the distance between words.
    edge : of the left edge, correlated from line to line by `EDGE_MEMORY`.
    tilt : tangent, slope of a line; half of it is the page's.
    bend : sag of a line over its length.
    pitch : of the height of lines about even distances, correlated from line to line by `PITCH_MEMORY`.
    pace : relative, of the time a stroke takes.
    tremor : of the pen about its intended path, each axis; below `TREMOR` Hz it is as strong at every frequency.
        With it 1–2 % of the power of the pen's velocity lies at 8–12 Hz and 0.2 % at 12–16 Hz; in people's words
        recorded at 200 Hz (thirteen writers) 3–10 % and 0.5–2 %, part of which is quicker writing.  More of it looks
        like an unsteady hand.
    """

    slant: float = 0.04
    slow_slant: float = 0.04
    slow_breadth: float = 0.045  # by the lengths of the lines of 113 pages
    line_height: float = 0.05  # all three heights: by the small letters of fifteen people's pages
    line_rise: float = 0.16
    rise: float = 0.08
    gap: float = 0.03
    breadth: float = 0.06
    height: float = 0.07
    own_height: float = 0.05
    shear: float = 0.022
    warp: float = 0.036
    warp_fine: float = 0.015
    slur: float = 0.07
    late_x: float = 0.04
    late_y: float = 0.03
    late_right: float = 0.025
    word_gap: float = 0.36
    edge: float = 0.18
    tilt: float = 0.0035
    bend: float = 0.28
    pitch: float = 0.2
    pace: float = 0.06
    tremor: float = 0.018

    def scale_by(self, jitter: float) -> Variation:
        """Every standard deviation times `jitter`."""
        return replace(self, **{field.name: jitter * getattr(self, field.name) for field in fields(self)})


USUAL = Variation()
# correlation of neighbours: letters, words, lines of a page
LETTER_MEMORY, SLANT_MEMORY, SLOW_MEMORY, EDGE_MEMORY, PITCH_MEMORY = 0.75, 0.75, 0.99, 0.6, 0.6
LINE_MEMORY = 0.97  # of letters, too: half of what a word has of it is still there five words later
TREMOR = 7.0
_WAVES = 6


class Drift:
    """A quantity that wanders slowly about 0: a first-order autoregressive process."""

    def __init__(self, sd: float, memory: float, rng: np.random.Generator) -> None:
        self._sd, self._memory = sd, memory
        self.value = float(rng.normal(0.0, sd))

    def draw_next(self, rng: np.random.Generator) -> float:
        """The next value; of standard deviation `sd`, correlated by `memory` with the one before."""
        fresh = rng.normal(0.0, self._sd * np.sqrt(1 - self._memory**2))
        self.value = self._memory * self.value + float(fresh)
        return self.value

    def walk(self, rng: np.random.Generator, n: int) -> Array:
        """(n,): the next n values."""
        return np.array([self.draw_next(rng) for _ in range(n)])


def correlate_values(fresh: Array, memory: float = LETTER_MEMORY) -> Array:
    """(n, …): independent values of one standard deviation, each correlated by `memory` with the one before."""
    values = fresh.copy()
    values[1:] *= np.sqrt(1 - memory**2)
    for i in range(1, len(values)):
        values[i] += memory * values[i - 1]
    return values


@dataclass(frozen=True, eq=False)
class Chances:
    """What chance says of each letter of a line.

    gap : (n, 3): of the gap before it, uniform from −1 to 1, standard normal, uniform from 0 to 1.
    rise : (n,), walk : (n, 3): standard normal.
    seed : (n,) int.
    """

    gap: Array
    rise: Array
    walk: Array
    seed: Indices

    @staticmethod
    def draw(rng: np.random.Generator, n: int) -> Chances:
        """Of n letters."""
        gap = np.column_stack([rng.uniform(-1, 1, n), rng.standard_normal(n), rng.uniform(size=n)])
        return Chances(gap, rng.standard_normal(n), rng.standard_normal((n, 3)), rng.integers(2**63, size=n))

    @staticmethod
    def join_words(parts: Sequence[Chances]) -> Chances:
        """Of some words, one after the other."""
        names = [field.name for field in fields(Chances)]
        return Chances(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def tremor(rng: np.random.Generator, n: int, rate: float, sd: float) -> Array:
    """(n, 2): a path sampled `rate` times a second trembles by this; of standard deviation `sd` each axis.

    It starts and ends at rest, as the path does.
    """
    width = rate / (2 * np.pi * TREMOR)
    reach = int(np.ceil(4 * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    kernel *= sd / np.sqrt(np.square(kernel).sum())
    white = rng.normal(size=(2, n + 2 * reach))
    trembling = np.stack([np.convolve(axis, kernel, "valid") for axis in white], axis=1)
    to_end = np.minimum(np.arange(n), np.arange(n)[::-1]) * (2 * TREMOR / rate)
    eased = np.sin(0.5 * np.pi * np.minimum(to_end, 1.0)) ** 2
    return np.asarray(trembling * eased[:, None])


def warp(xy: Array, rng: np.random.Generator, sd: float, shortest: float, longest: float) -> Array:
    """Displacements (n, 2) of places xy (n, 2) by a smooth random field, so that strokes that touch stay registered.

    White noise a point would kink the eased ends of strokes; a field bends a word as a whole.

    shortest, longest : wavelengths of the field, x-heights.
    """
    angle = rng.uniform(0.0, 2 * np.pi, _WAVES)
    length = rng.uniform(shortest, longest, _WAVES)
    phase = rng.uniform(0.0, 2 * np.pi, _WAVES)
    size = rng.normal(0.0, sd * np.sqrt(2 / _WAVES), (_WAVES, 2))
    wave = 2 * np.pi / length * np.vstack([np.cos(angle), np.sin(angle)])
    return np.asarray(np.sin(xy @ wave + phase) @ size)
