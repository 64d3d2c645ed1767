"""A person who fills in the sheets of a study: how well he tells made from real, and how he marks boxes.

Pens and manners were set by eye beside photographs of filled forms: crosses overshoot their boxes by up to a millimetre
and miss their middles by half of one, ticks run out of them upwards, boxes that are filled in are hatched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout.simulated.flatbed import Flatbed
from handout.simulated.print_and_scan import ink_of
from handout.simulated.spectra import SimulatedSheet, WrittenSheet
from handout.values import Array
from handout_lab.study.design import Item, Person
from handout_lab.study.sheets import ANSWERS, Row

_FINER = 4  # of a pixel, while a line is drawn
_PAPER = np.array([0.97, 0.97, 0.96])


@dataclass(frozen=True)
class WritingTool:
    """name, width of its line in mm (least, greatest), colours on white paper, how much ink (least, greatest), grain:
    standard deviation of the ink, of itself, from pixel to pixel."""

    name: str
    width: tuple[float, float]
    colours: tuple[tuple[float, float, float], ...]
    amount: tuple[float, float]
    grain: float = 0.0


TOOLS = (
    WritingTool("pencil", (0.3, 0.7), ((0.45, 0.45, 0.46),), (0.35, 0.9), 0.5),
    WritingTool("ballpoint", (0.25, 0.45), ((0.15, 0.2, 0.55), (0.2, 0.2, 0.2), (0.75, 0.15, 0.2)), (0.6, 1.1), 0.15),
    WritingTool("fineliner", (0.3, 0.5), ((0.1, 0.1, 0.1), (0.1, 0.35, 0.2), (0.8, 0.1, 0.1)), (0.9, 1.1)),
    WritingTool("felt", (0.7, 1.1), ((0.05, 0.05, 0.05), (0.1, 0.15, 0.6), (0.75, 0.05, 0.1)), (0.8, 1.2), 0.05),
)
MANNERS = ("cross", "tick", "fill", "line")  # how an answer is given
_SHARES = (0.55, 0.25, 0.12, 0.08)  # of people


@dataclass(frozen=True)
class Participant:
    """How one person marks: `tool`, of some `width`, colour and `amount` of ink; `manner`; `tremor` in mm."""

    tool: WritingTool
    width: float
    colour: tuple[float, float, float]
    amount: float
    manner: str
    tremor: float

    @classmethod
    def anyone(cls, rng: np.random.Generator) -> Participant:
        """Somebody."""
        tool = TOOLS[rng.integers(len(TOOLS))]
        colour = tool.colours[rng.integers(len(tool.colours))]
        width, amount = float(rng.uniform(*tool.width)), float(rng.uniform(*tool.amount))
        return cls(tool, width, colour, amount, str(rng.choice(MANNERS, p=_SHARES)), float(rng.uniform(0.02, 0.25)))

    def strokes(self, box: Array, manner: str, rng: np.random.Generator) -> list[Array]:
        """The strokes (n, 2) mm by which a box (left, top, right, bottom) is marked."""
        side, middle = float(box[2] - box[0]), (box[:2] + box[2:]) / 2 + rng.normal(0, 0.35, 2)
        half = side / 2 * rng.uniform(0.75, 1.35)
        if manner == "cross":
            ways: list[list[tuple[float, float]]] = [[(-1, -1), (1, 1)], [(1, -1), (-1, 1)]]
        elif manner == "tick":
            ways = [[(-0.7, 0.1), (-0.1, 0.8), (rng.uniform(0.8, 2.0), rng.uniform(-2.2, -0.9))]]
        elif manner == "line":
            ways = [[(-1, 1), (1, -1)] if rng.random() < 0.7 else [(-1, 0), (1, 0)]]
        else:
            return self._hatching(box, rng)
        return [self._shaken(middle + half * (np.array(way) + rng.normal(0, 0.1, (len(way), 2))), rng) for way in ways]

    def _hatching(self, box: Array, rng: np.random.Generator) -> list[Array]:
        """Lines to and fro, as close as the pen is wide or nearly, sometimes once more across."""
        left, top, right, bottom = box + np.array([1, 1, -1, -1]) * rng.uniform(-0.2, 0.25)
        step = self.width * rng.uniform(0.55, 1.0)
        layers = []
        for across in range(1 if step < 0.8 * self.width else 2):
            count = max(3, int((bottom - top) / step))
            y = np.linspace(top, bottom, count) + rng.normal(0, 0.08, count)
            x = np.where(np.arange(count) % 2, right, left) + rng.normal(0, 0.2, count)
            layers.append(np.column_stack([x, y]) if not across else np.column_stack([y - top + left, x - left + top]))
        return [self._shaken(layer, rng) for layer in layers]

    def _shaken(self, corners: Array, rng: np.random.Generator) -> Array:
        """A path through some corners, as an unsteady hand draws it."""
        at = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
        along = np.linspace(0, at[-1], max(4, int(at[-1] / 0.15)))
        path = np.column_stack([np.interp(along, at, corners[:, k]) for k in (0, 1)])
        waves = rng.normal(0, 1, (4, 2)) / np.arange(1, 5)[:, None]
        turns = np.sin(np.outer(along, 2 * np.pi * np.array([0.1, 0.25, 0.5, 0.8])) + rng.uniform(0, 6, 4))
        return np.asarray(path + self.tremor * turns @ waves)

    def marked(
        self, sheet: SimulatedSheet, box: Array, manner: str, rng: np.random.Generator, light: float = 1.0
    ) -> SimulatedSheet:
        """The sheet with a box marked; `light`: how strongly, of the usual."""
        import cv2

        paths = self.strokes(box, manner, rng)
        scale = sheet.dpi / 25.4
        everything = np.concatenate(paths)
        corner = np.maximum(np.floor((everything.min(axis=0) - self.width) * scale).astype(int), 0)
        size = np.ceil((everything.max(axis=0) + self.width) * scale).astype(int) - corner
        fine = np.zeros((size[1] * _FINER, size[0] * _FINER), dtype=np.uint8)
        thick = max(1, round(self.width * scale * _FINER))
        for path in paths:
            points = np.rint((path * scale - corner) * _FINER).astype(np.int32)
            cv2.polylines(fine, [points.reshape(-1, 1, 2)], False, 255, thick, cv2.LINE_8)
        amount = cv2.resize(fine, size.tolist(), interpolation=cv2.INTER_AREA).astype(np.float32) / 255
        amount *= self.amount * light * np.maximum(0, 1 + self.tool.grain * rng.standard_normal(amount.shape))
        density = ink_of(np.array(self.colour), _PAPER, Flatbed())
        ink = WrittenSheet((int(corner[1]), int(corner[0])), amount.astype(np.float32), density)
        return replace(sheet, written=(*sheet.written, ink))


def answered(person: Person, skill: float, rng: np.random.Generator) -> dict[str, list[str]]:
    """Questionnaire → what somebody answers who is right in a share `skill` of the rows."""
    return {
        kind: [said(item, answers, bool(rng.random() < skill)) for item in person.items(kind)]
        for kind, answers in ANSWERS.items()
    }


def said(item: Item, answers: Sequence[str], right: bool) -> str:
    """What somebody says of an item who is right about it, or not."""
    return item.truth if right else next(answer for answer in answers if answer != item.truth)


@dataclass(frozen=True)
class Doing:
    """What becomes of a row: the boxes that are marked, each in a manner; and whether its answer is plain.

    answer : the number of the box that is meant; None where nobody could know.
    """

    marks: tuple[tuple[int, str, float], ...]
    answer: int | None


def doing(who: Participant, meant: int, boxes: int, slips: float, rng: np.random.Generator) -> Doing:
    """How somebody marks a row; in a share `slips` of rows otherwise than asked: withdrawn, left out, twice, erased."""
    other = (meant + 1) % boxes
    if rng.random() >= slips or boxes < 2:
        return Doing(((meant, who.manner, 1.0),), meant)
    kind = rng.choice(["withdrawn", "none", "both", "erased"], p=[0.55, 0.15, 0.15, 0.15])
    if kind == "none":
        return Doing((), None)
    if kind == "both" or (kind == "withdrawn" and who.manner == "fill"):
        return Doing(((meant, who.manner, 1.0), (other, who.manner, 1.0)), None)
    if kind == "erased":
        return Doing(((other, who.manner, 0.06), (meant, who.manner, 1.0)), meant)
    return Doing(((other, who.manner, 1.0), (other, "fill", 1.0), (meant, who.manner, 1.0)), meant)


def filled(
    sheet: SimulatedSheet, rows: Sequence[Row], doings: Sequence[Doing], who: Participant, rng: np.random.Generator
) -> SimulatedSheet:
    """A printed sheet with its rows marked."""
    for row, done in zip(rows, doings, strict=True):
        for box, manner, light in done.marks:
            sheet = who.marked(sheet, row.boxes[box], manner, rng, light)
    return sheet
