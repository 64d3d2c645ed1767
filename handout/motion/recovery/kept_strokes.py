"""The strokes of a hand's glyphs as one row of whole numbers, to be kept with the hand: how branches follow each other.

Of each glyph: how many strokes; of each stroke: 1 if it is delayed, 2 if it is a crossbar and 4 if the order of the
glyph's is guessed, added up; its first vertex; and how many runs follow, of each the vertex to which the pen goes and
how many it then goes through, where the line leads only one way.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from handout.motion.recovery.letter_line import LetterStrokes
from handout.values import Array, Indices


class _Line:
    """Where a line's edges (m, 2) lead from each of its vertices."""

    def __init__(self, edges: Indices) -> None:
        self._beside = defaultdict[int, list[int]](list)
        for a, b in edges.tolist():
            self._beside[a].append(b)
            self._beside[b].append(a)

    def follow(self, before: int, vertex: int) -> int:
        """The vertex that comes after one that was reached from `before`; −1 where the line ends or parts."""
        others = [other for other in self._beside[vertex] if other != before]
        return others[0] if len(others) == 1 else -1


def strokes_as_numbers(written: LetterStrokes, edges: Indices) -> list[int]:
    """The strokes of one glyph; edges : (m, 2), of its line."""
    line, numbers = _Line(edges), [len(written.strokes)]
    bars = written.bars or written.delayed
    for stroke, delayed, bar in zip(written.strokes, written.delayed, bars, strict=True):
        way, runs = stroke.tolist(), list[list[int]]()
        for at in range(1, len(way)):
            if at > 1 and line.follow(way[at - 2], way[at - 1]) == way[at]:
                runs[-1][1] += 1
            else:
                runs.append([way[at], 0])
        numbers += [
            delayed + 2 * bar + 4 * written.guessed,
            way[0],
            len(runs),
            *(number for run in runs for number in run),
        ]
    return numbers


def strokes_of_numbers(numbers: Sequence[int], edges: Indices, count: int) -> LetterStrokes | None:
    """The strokes of one glyph, of what `strokes_as_numbers` gives; None where they do not lie on its line.

    count : of the line's vertices.
    """
    line, read = _Line(edges), iter(numbers)
    strokes, delayed, bars, guessed = list[Indices](), list[bool](), list[bool](), False
    for _ in range(next(read)):
        how, first, runs = next(read), next(read), next(read)
        way = [first]
        for _ in range(runs):
            way.append(next(read))
            for _ in range(min(next(read), len(edges))):
                way.append(line.follow(way[-2], way[-1]))
        if not 0 <= min(way) <= max(way) < count:
            return None
        strokes.append(np.array(way, dtype=np.intp))
        delayed.append(bool(how & 1))
        bars.append(bool(how & 2))
        guessed |= bool(how & 4)
    return LetterStrokes(tuple(strokes), tuple(delayed), tuple(bars), guessed)


def part_by_glyph(numbers: Array, glyphs: int) -> dict[int, list[int]]:
    """Of each glyph its numbers in the row of all; nothing where these are not of so many."""
    row, ends = numbers.astype(np.int64).tolist(), [0]
    while ends[-1] < len(row) and len(ends) <= glyphs:
        at, strokes = ends[-1] + 1, row[ends[-1]]
        while strokes > 0 and at + 2 < len(row):
            at, strokes = at + 3 + 2 * max(row[at + 2], 0), strokes - 1
        ends.append(at if strokes <= 0 else len(row) + 1)
    return {n: row[a:b] for n, (a, b) in enumerate(pairwise(ends))} if ends[-1] == len(row) else {}
