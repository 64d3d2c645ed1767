"""Laying a transcript along a line: where each of its letters begins and ends, given what the columns look like.

A semi-Markov chain: every letter is a segment whose thirds are read each as what they are, whose length follows the
letter's usual width, and whose ends would rather not cut ink.  Between letters of a word a gap is possible, between
words it is the rule, at both ends of a line it is free.  The best segmentation is found exactly.

Source: seed 000, §5.1.3 and Appendix D (a chain over the transcript); segments, thirds and gaps are this project's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from handout.alphabet import JUNK, SPACE, THIRDS, state
from handout.tagging.line_space import ABOVE, INKY, STEP, X_HEIGHT, Image
from handout.values import Array

NEVER = -1e9  # a score that no path wins with
BAR = 2  # columns between two lines: as many as the least gap
_BARRED = -1e6  # score of a letter across the end of a line
_BODY_UP, _BODY_DOWN = int(1.6 * X_HEIGHT), 4  # rows over and under the baseline where cutting ink counts
_LOW = 11  # rows under the baseline where ink in a space still counts in full
_TIGHTEST = 5  # columns: narrower spaces between words cost
Step = tuple[Array, NDArray[np.int32]]


@dataclass(frozen=True)
class Terms:
    """What the parts of the score weigh.  They hardly matter, but for `sigma`.

    temper : of the networks' log probabilities.
    prior : power of the states' own frequencies that is divided out.
    sigma : of the logarithm of a letter's width.
    cut, clear : cost of ink in a cut column, and gain of a column without.
    smudge : cost of ink in a space, a column's full pen.
    gap : cost of a gap inside a word.
    broken : cost of ending a line inside a word.
    missing, silent : cost of a letter, and of a mark, that the page has not.
    """

    temper: float = 0.35
    prior: float = 0.6
    sigma: float = 0.18
    cut: float = 0.5
    clear: float = 0.6
    smudge: float = 0.6
    gap: float = 1.5
    broken: float = 15.0
    missing: float = 25.0
    silent: float = 10.0


TERMS = Terms()


@dataclass(frozen=True, eq=False)
class ColumnReading:
    """What the columns of a line (or of several, one after the other) say, summed up from the left.

    letters : (n + 1, states) float, score of the columns before each border as each state.
    space, gap : (n + 1,) the same as space between words and inside one.
    border : (n + 1,) what it costs to cut there.
    lines : columns at which the lines begin, when there are several.
    unread : score of each of these lines as a whole, if nothing of the text is on it; none where text is on all.
    """

    letters: Array
    space: Array
    gap: Array
    border: Array
    lines: tuple[int, ...] = (0,)
    unread: tuple[float, ...] = ()

    @property
    def columns(self) -> int:
        return len(self.border) - 1


@dataclass(frozen=True, eq=False)
class Decoded:
    """Where the letters are.

    left, right : (m,) float, pixels of the line's image, for every letter and space given.
    score : of the whole.
    found : (m,) bool, False for a letter that the page seems not to have (its width is 0).
    """

    left: Array
    right: Array
    score: float
    found: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))


@dataclass(frozen=True)
class Held:
    """A letter whose place is known or likely; pixels of the line's image.

    left, right : of its ends.
    reach : how far an end may lie from there.
    gain : added to the score where both ends lie so; infinite where they must.
    """

    left: float
    right: float
    reach: float
    gain: float = np.inf


def read_line(image: Image, log_posterior: NDArray[np.float32], log_prior: NDArray[np.float32]) -> ColumnReading:
    """The reading of one line from its image and the networks' probabilities of every described column."""
    log_states = TERMS.temper * (log_posterior.astype(np.float64) - TERMS.prior * log_prior)
    ink = image > INKY
    ink_in_body = _heights(ink[ABOVE - _BODY_UP : ABOVE + _BODY_DOWN])
    tall = ink.sum(axis=0)
    pen = 0.8 * max(float(np.median(tall[tall > 0])), 2.0) if tall.any() else 2.0
    border = np.where(ink_in_body == 0, TERMS.clear, -TERMS.cut * np.clip(ink_in_body / pen - 0.5, 0, 3))
    ink_near = _heights(ink[ABOVE - _BODY_UP : ABOVE + _LOW])
    ink_far = _heights(ink[: ABOVE - _BODY_UP]) + _heights(ink[ABOVE + _LOW :])
    as_space = log_states[:, state(SPACE)] - TERMS.smudge * np.minimum(ink_near + 0.3 * ink_far, 2.5)
    space = _sum_columns(as_space)
    return ColumnReading(_sum_columns(log_states), space, space, np.append(border, TERMS.clear))


def _heights(rows: NDArray[np.bool_]) -> Array:
    """(n,) float: pixels of ink a column, meaned over each step."""
    starts = np.arange(0, rows.shape[1], STEP)
    return np.add.reduceat(rows.sum(axis=0).astype(np.float64), starts) / STEP


def _sum_columns(each: Array) -> Array:
    return np.concatenate([np.zeros((1, *each.shape[1:])), np.cumsum(each, axis=0)])


def in_a_row(readings: Sequence[ColumnReading], unread: Sequence[float] = ()) -> ColumnReading:
    """Several lines as one: between two of them lie columns that only a gap may cross; `unread` as there."""
    letters, space, gap, border, lines = [], [], [], [], [0]
    for number, reading in enumerate(readings):
        if number:
            letters.append(np.full((BAR, reading.letters.shape[1]), _BARRED))
            space.append(np.zeros(BAR))
            gap.append(np.full(BAR, -TERMS.broken / BAR))
            border.append(np.zeros(BAR - 1))
            lines.append(lines[-1] + readings[number - 1].columns + BAR)
        letters.append(np.diff(reading.letters, axis=0))
        space.append(np.diff(reading.space))
        gap.append(np.diff(reading.gap))
        border.append(reading.border)
    sums = [_sum_columns(np.concatenate(parts)) for parts in (letters, space, gap)]
    return ColumnReading(sums[0], sums[1], sums[2], np.concatenate(border), tuple(lines), tuple(unread))


def decode(
    reading: ColumnReading,
    letters: Sequence[str],
    widths: Mapping[str, float],
    held: Mapping[int, Held] = MappingProxyType({}),
) -> Decoded:
    """The best places for `letters` (of the alphabet, spaces among them) along a line.

    widths : usual width of each letter, pixels.
    held : what is known of the place of some of them, by their number among `letters`.
    """
    steps = _steps(letters)
    starts, ends = _pass_steps(reading, steps, widths, held)
    left, right = _trace_borders(starts, [kind for kind, _ in steps], reading.columns)
    return Decoded(left * STEP, right * STEP, float(ends[-1, -1]), right > left)


def _pass_steps(
    reading: ColumnReading,
    steps: Sequence[tuple[str, str]],
    widths: Mapping[str, float],
    held: Mapping[int, Held] = MappingProxyType({}),
    *,
    backwards: bool = False,
) -> tuple[NDArray[np.int32], Array]:
    """(steps, n + 1): where each segment begins that ends at a border, and the best score up to there.

    backwards : the reading and the steps are mirrored; a border counts once where a gap lies, before it.
    """
    best = np.full(reading.columns + 1, NEVER)
    best[0] = 0.0
    starts = np.empty((len(steps), reading.columns + 1), dtype=np.int32)
    scores = np.empty(starts.shape)
    number = -1
    for row, (kind, letter) in enumerate(steps):
        number += kind not in ("edge", "gap")
        if kind == "letter":
            best, starts[row] = _letter(reading, best, letter, widths[letter] / STEP, held.get(number))
        elif kind == "gap":
            best, starts[row] = _gap(reading, best)
        elif kind == "space":
            best, starts[row] = _pass_lines(reading, *_space(reading, best))
        else:
            score, least = (reading.space, 0) if kind == "edge" else (reading.letters[:, state(JUNK)], 4)
            best, starts[row] = _blank(score, best, least)
            if kind == "edge":
                best, starts[row] = _pass_lines(reading, best, starts[row])
        scores[row] = best
        if row < len(steps) - 1 and steps[row + backwards][0] != "gap":
            best = best + reading.border
    return starts, scores


def word_gains(
    reading: ColumnReading, letters: Sequence[str], widths: Mapping[str, float], unread: Array
) -> tuple[list[float], list[float]]:
    """How much higher a line scores without each of its words, and with something unread before each and at the end.

    letters, widths : as of `decode`.
    unread : (n + 1,) score of the columns before each border as something that is not in the text, summed up.
    """
    steps, border = _steps(letters), reading.border
    row = [at for at, (kind, _) in enumerate(steps) if kind not in ("edge", "gap")]
    ahead = _pass_steps(reading, steps, widths)[1]
    behind = _pass_steps(_mirrored(reading), steps[::-1], widths, backwards=True)[1][::-1, ::-1]
    spaces = [i for i, letter in enumerate(letters) if letter == SPACE]
    words = list(zip([0, *(i + 1 for i in spaces)], [*spaces, len(letters)], strict=True))
    without, beside = [], []
    for first, stop in words:
        before = ahead[row[first] - 1] + border
        beside.append(_space(reading, _blank(unread, before, _TIGHTEST)[0] + border)[0] + border + behind[row[first]])
        if stop < len(letters):
            without.append(before + behind[row[stop] + 1])
        elif first:
            without.append(ahead[row[first - 1] - 1] + border + behind[-1])
    last = _space(reading, ahead[row[-1]] + border)[0] + border
    beside.append(_blank(unread, last, _TIGHTEST)[0] + border + behind[-1])
    score = ahead[-1, -1]
    return [float(one.max() - score) for one in without], [float(one.max() - score) for one in beside]


def _mirrored(reading: ColumnReading) -> ColumnReading:
    """One line read from the right, the thirds of its letters in turn."""
    thirds = np.arange(reading.letters.shape[1]).reshape(-1, THIRDS)[:, ::-1].ravel()
    letters, space, gap = (sums[-1] - sums[::-1] for sums in (reading.letters, reading.space, reading.gap))
    return ColumnReading(letters[:, thirds], space, gap, reading.border[::-1])


def _steps(letters: Sequence[str]) -> list[tuple[str, str]]:
    """Kinds of segment and their letters, in order: the free ends, the letters, the gaps that may lie between."""
    steps = [("edge", "")]
    for i, letter in enumerate(letters):
        if i and SPACE not in (letter, letters[i - 1]):
            steps.append(("gap", ""))
        steps.append(("space" if letter == SPACE else "junk" if letter == JUNK else "letter", letter))
    return [*steps, ("edge", "")]


def _letter(reading: ColumnReading, before: Array, letter: str, usual: float, hold: Held | None) -> Step:
    """Best score with the letter, usually so many columns wide, ending at every border, and where it begins then."""
    most = min(int(2.6 * usual) + 6, reading.columns)
    if hold is not None:
        most = min(max(most, int((hold.right - hold.left + 2 * hold.reach) / STEP) + 1), reading.columns)
    long = np.arange(2, max(most, 2) + 1)
    first, second = np.rint(long / THIRDS).astype(int), np.rint(2 * long / THIRDS).astype(int)
    thirds = reading.letters[:, state(letter, 0) : state(letter, 0) + THIRDS]
    a, b, c = thirds.T
    prior = -0.5 * (np.log(long / usual) / TERMS.sigma) ** 2
    total = _delay_rows(before - a, long) + prior[:, None]
    total += _delay_rows(a - b, long - first)
    total += _delay_rows(b - c, long - second)
    ends = np.arange(len(before))
    if hold is not None:
        there = (np.abs(STEP * ends - hold.right) <= hold.reach)[None] & (
            np.abs(STEP * (ends[None] - long[:, None]) - hold.left) <= hold.reach
        )
        total = np.where(there, total, NEVER) if np.isinf(hold.gain) else total + hold.gain * there
    winner = total.argmax(axis=0)
    best, start = total[winner, ends] + c, ends - long[winner]
    lost = before - (TERMS.silent if not letter.isalnum() else TERMS.missing)
    if hold is not None and np.isinf(hold.gain):
        lost = np.full(len(before), 2 * NEVER)
    skipped = lost > best
    return np.where(skipped, lost, best), np.where(skipped, ends, start).astype(np.int32)


def _delay_rows(values: Array, by: NDArray[np.intp]) -> Array:
    """(k, n): row i is `values` moved right by by[i] columns, NEVER coming in from the left."""
    most, count = int(by.max()), len(values)
    padded = np.full(most + count, NEVER)
    padded[most:] = values
    # overlapping rows of one array; `sliding_window_view` takes longer than all the rest
    windows = np.ndarray((most + 1, count), np.float64, padded, strides=padded.strides * 2)
    return np.asarray(windows[most - by])


def _blank(score: Array, before: Array, least: int) -> Step:
    """A segment of `least` columns or more, whose score is the sum of its columns."""
    gained = before - score
    ends = np.arange(len(before))
    highest = np.maximum.accumulate(gained)
    at = np.maximum.accumulate(np.where(gained >= highest, ends, 0))
    best = np.full(len(before), NEVER)
    start = ends.copy()
    best[least:] = highest[: len(before) - least] + score[least:]
    start[least:] = at[: len(before) - least]
    return best, start.astype(np.int32)


def _gap(reading: ColumnReading, before: Array) -> Step:
    best, start = _blank(reading.gap, before, 2)
    best -= TERMS.gap
    ends = np.arange(len(before), dtype=np.int32)
    return np.maximum(best, before), np.where(best > before, start, ends).astype(np.int32)


def _space(reading: ColumnReading, before: Array) -> Step:
    best, start = _blank(reading.space, before, _TIGHTEST)
    ends = np.arange(len(before))
    for long in range(2, _TIGHTEST):
        tight = np.full(len(before), NEVER)
        tight[long:] = before[:-long] + reading.space[long:] - reading.space[:-long]
        tight -= 0.5 * ((_TIGHTEST - long) / 3) ** 2
        start = np.where(tight > best, ends - long, start)
        best = np.maximum(best, tight)
    return best, start.astype(np.int32)


def _pass_lines(reading: ColumnReading, best: Array, start: NDArray[np.int32]) -> Step:
    """A space, or an end of the text, that may go on over lines which hold nothing of the text."""
    first = (*reading.lines, reading.columns + BAR)
    for number, score in enumerate(reading.unread):
        begin, end, stop = first[number], first[number + 1] - BAR, first[min(number + 2, len(first) - 1)]
        passed = best[begin] + score + reading.space[end:stop] - reading.space[end]
        better = passed > best[end:stop]
        best[end:stop] = np.where(better, passed, best[end:stop])
        start[end:stop] = np.where(better, start[begin], start[end:stop])
    return best, start


def _trace_borders(starts: NDArray[np.int32], kinds: Sequence[str], end: int) -> tuple[Array, Array]:
    """Left and right borders, in columns, of every letter and space, by going back from the end."""
    spans = []
    for row in range(len(kinds) - 1, -1, -1):
        start = int(starts[row, end])
        if kinds[row] not in ("gap", "edge"):
            spans.append((start, end))
        end = start
    borders = np.array(spans[::-1], dtype=np.float64).reshape(-1, 2)
    return borders[:, 0], borders[:, 1]
