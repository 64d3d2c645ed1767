"""What a pen did to the boxes of a row, and which of them is the answer.

Depth is the light that is missing, of the paper's, in the colour that misses most: red, blue and black pens and pencil
alike.  The lines of the boxes are found first, all of a row together, since paper stretches and bends between the
marks at its corners; then what lies inside them is told by how much of it is inked, and where.

A box is empty, holds a trace, a mark (a cross, a tick, any line), or is filled in, which withdraws it.  How thick and
how deep somebody's marks are is told from all of his rows: of those who fill boxes in to answer, a filled one is a
mark.  What is not plain is doubtful, never guessed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from handout.values import Array
from handout_lab.study.sheets import BOX, EDGE, Row

DPI = 200.0  # of the flat page on which boxes are read
_UNIT = DPI / 25.4  # pixels a mm
_AWAY = 2.0  # mm that a box may lie from its place, on paper that bends; set by eye on curled photographs
_APART = 0.9  # mm that one box of a row may lie further than the others
_MARGIN = 1.5  # mm around that, in which paper is seen
_INSIDE = 0.65  # mm inside the line of a box where its inside begins: half the line, and the blur of 150 dpi
_LEAST, _NOISES = 0.10, 6.0  # depth of ink at least, and in standard deviations of the paper's noise
_LINE = 0.15  # depth of the lines of a box, at least: less is none
# shares of a box's inside that are inked; fitted on simulated sheets of seeds below 100, see benchmarks/study.py
_EMPTY, _MARKED = 0.012, 0.04
_STRIP = 0.75  # mm: a filled box is inked along each of its four sides so far in, in the middle of the side
_FILLED, _MORE = 0.6, 1.35  # of the inside of a filled box at least, and of what is usual for the person's marks
_SIDES = 0.38  # of each of its sides
_EDGE_OF_INK = 0.4  # of the depth of a mark: what is paler is the blur beside it
_CORE = 80  # per cent of a mark's ink that is less deep than what counts as its depth
_FAINT = 0.45  # of the depth of another mark, of the row or usual for the person: what is fainter was rubbed out
_STRAY = 0.3  # of the other's ink: so little beside a mark is a line that ran over


@dataclass(frozen=True)
class Mark:
    """What a box holds.

    share : of its inside that is inked; depth : of that ink, 0–1; sides : share of that one of its four sides, in the
        middle, that is inked least: a cross leaves these free, however thick.
    """

    share: float
    depth: float = 1.0
    sides: float = 0.0

    @property
    def touched(self) -> bool:
        """Whether there is a mark, and not only a trace."""
        return self.share >= _MARKED


@dataclass(frozen=True)
class Decision:
    """The answer of a row: the number of its box, None where it is doubtful, and why it is so, or was not plain."""

    box: int | None
    why: str = ""


def depth_of(flat: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(h, w) light that is missing at each pixel of a flat page (h, w, 3) or (h, w), 0–1, of the paper around it."""
    import cv2

    small = cv2.resize(flat, None, fx=1 / 8, fy=1 / 8, interpolation=cv2.INTER_AREA)
    paper = cv2.dilate(small, np.ones((9, 9), np.uint8))  # no print or mark is so wide: 9 mm
    paper = cv2.resize(cv2.blur(paper, (9, 9)), flat.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    colours = zip(cv2.split(flat), cv2.split(paper), strict=True)
    light = [cv2.divide(seen, np.maximum(white, 1), dtype=cv2.CV_32F) for seen, white in colours]
    return np.asarray(np.clip(1 - reduce(cv2.min, light), 0, 1), dtype=np.float32)


def read_row(depth: NDArray[np.float32], row: Row) -> list[Mark] | None:
    """What each box of a row holds; None if the lines of its boxes are not there.

    depth : (h, w) of the flat page at `DPI`; see `depth_of`.
    """
    patches = [_patch(depth, box) for box in row.boxes]
    maps = [_lines(patch) for patch in patches]
    total = np.sum(maps, axis=0)
    y, x = (int(at) for at in np.unravel_index(int(total.argmax()), total.shape))
    if float(total[y, x]) < _LINE * len(patches):
        return None
    return [_mark(patch, *_near(own, x, y)) for patch, own in zip(patches, maps, strict=True)]


def _near(own: NDArray[np.float32], x: int, y: int) -> tuple[int, int]:
    """Where the lines of one box are best seen, near where those of all its row are: paper bends between them."""
    reach = round(_APART * _UNIT)
    top, left = max(0, y - reach), max(0, x - reach)
    part = own[top : y + reach + 1, left : x + reach + 1]
    down, across = np.unravel_index(int(part.argmax()), part.shape)
    return left + int(across), top + int(down)


def _patch(depth: NDArray[np.float32], box: Array) -> NDArray[np.float32]:
    """The page around a box, as far as it may lie away; white beyond the page."""
    rim = _AWAY + _MARGIN
    left, top = (round(float(at - rim) * _UNIT) for at in box[:2])
    side = round((BOX + 2 * rim) * _UNIT)
    patch = np.zeros((side, side), dtype=np.float32)
    part = depth[max(top, 0) : top + side, max(left, 0) : left + side]
    y, x = max(-top, 0), max(-left, 0)
    patch[y : y + part.shape[0], x : x + part.shape[1]] = part
    return patch


def _lines(patch: NDArray[np.float32]) -> NDArray[np.float32]:
    """How dark the lines of a box would be, less what lies beside them, for every place of its upper left corner."""
    import cv2

    return np.asarray(cv2.matchTemplate(patch, _frame(), cv2.TM_CCORR))


def _frame() -> NDArray[np.float32]:
    """A template whose product is the mean depth of a box's lines less that of the paper outside them."""
    rim = round(0.5 * _MARGIN * _UNIT)
    side = round(BOX * _UNIT)
    at = np.abs(np.arange(side + 2 * rim) + 0.5 - (side + 2 * rim) / 2) / _UNIT
    reach = np.maximum(at[:, None], at[None, :]) - BOX / 2
    line, outside = np.abs(reach) <= EDGE / 2 + 0.05, reach > EDGE
    return np.asarray(line / line.sum() - outside / outside.sum(), dtype=np.float32)


def _mark(patch: NDArray[np.float32], x: int, y: int) -> Mark:
    """What a box holds whose template begins at (x, y) of its patch."""
    start = round(0.5 * _MARGIN * _UNIT) + round(_INSIDE * _UNIT)
    side = round((BOX - 2 * _INSIDE) * _UNIT)
    inside = patch[y + start : y + start + side, x + start : x + start + side]
    noise = 1.48 * float(np.median(np.abs(patch - np.median(patch))))  # most of a patch is paper
    least = max(_LEAST, _NOISES * noise)
    ink = inside[inside > least]
    deep = float(np.percentile(ink, _CORE)) if len(ink) else 0.0
    inked = inside > max(least, _EDGE_OF_INK * deep)
    return Mark(float(inked.mean()), deep, min(_strips(inked)))


def _strips(inked: NDArray[np.bool_]) -> list[float]:
    """How much of the middle of each side is inked."""
    wide, third = round(_STRIP * _UNIT), len(inked) // 3
    middle = slice(third, len(inked) - third)
    return [
        float(part.mean())
        for part in (inked[:wide, middle], inked[-wide:, middle], inked[middle, :wide], inked[middle, -wide:])
    ]


@dataclass(frozen=True)
class Manner:
    """How somebody marks: how much of a box, and how deep, as a median."""

    share: float = 0.0
    depth: float = 0.0


def manner(rows: Sequence[Sequence[Mark]]) -> Manner:
    """How somebody marks, from those of his rows in which one box is touched."""
    touched = [[mark for mark in row if mark.touched] for row in rows]
    alone = [(marks[0].share, marks[0].depth) for marks in touched if len(marks) == 1]
    return Manner(*map(float, np.median(alone, axis=0))) if alone else Manner()


def decided(marks: Sequence[Mark], how: Manner = Manner()) -> Decision:
    """The answer of a row."""
    touched = _touched(marks, how)
    traces = any(mark.share >= _EMPTY for k, mark in enumerate(marks) if k not in touched)
    marked = [k for k in touched if not _filled(marks[k], how)]
    if len(marked) == 1:
        withdrawn = "another box was filled in: withdrawn" if len(touched) > 1 else ""
        return Decision(marked[0], withdrawn or ("a trace of a mark in another box" if traces else ""))
    if marked:
        return _of_several(marks, marked)
    if touched:
        many = "a box is" if len(touched) == 1 else f"{len(touched)} boxes are"
        return Decision(None, f"{many} filled in, and no other one is marked")
    return Decision(None, "only a trace of a mark" if traces else "no box is marked")


def _touched(marks: Sequence[Mark], how: Manner) -> list[int]:
    """The boxes that hold more than a trace, or what was rubbed out."""
    deepest = max([how.depth, *(mark.depth for mark in marks if mark.touched)])
    return [k for k, mark in enumerate(marks) if mark.touched and mark.depth >= _FAINT * deepest]


def _of_several(marks: Sequence[Mark], marked: Sequence[int]) -> Decision:
    """Which of several marks is meant, where the others are a line that ran over."""
    most, second, *_ = sorted(marked, key=lambda k: -marks[k].share)
    if marks[second].share < min(_STRAY * marks[most].share, 2 * _MARKED):
        return Decision(most, "a line runs over another box")
    return Decision(None, f"{len(marked)} boxes are marked")


def _filled(mark: Mark, how: Manner) -> bool:
    """Whether a box is filled in, more than somebody marks it to answer."""
    return mark.share >= max(_FILLED, _MORE * how.share) and mark.sides >= _SIDES
