"""Formulas as words: their leaves, which the hand has set one by one, are laid out, and flow with the other words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from handout.mathematics.formulas import Formula
from handout.mathematics.layout import Box, SetLeaf, lay_out
from handout.mathematics.shapes import Wander
from handout.writing.pages import FormulaWord, Handwriting, Unit, Word
from handout.writing.text import FormulaLetters

_BESIDE = 0.28  # x-heights between a formula and a bracket or a comma that stands right beside it; set by eye
_BEARING = 0.25  # x-heights behind its ink that belong to it, as letters have them; set by eye
_AROUND = 0.35  # x-heights of paper above and below a displayed formula, at least; set by eye
_NOTHING = (0.0, 0.0, 0.0, 0.0)


class _Laid(NamedTuple):
    """Something that was laid out, with the words that its leaves are, and the gap before it, where a line may end.

    source : the TeX of the formula that begins with it; "": none does.
    """

    box: Box
    words: Sequence[Word[Any] | None]
    gap: float | None
    source: str = ""


def set_formula(
    piece: FormulaLetters, words: Sequence[Word[Any]], gap: float, writer: Handwriting[Any], wander: Wander
) -> Iterator[Unit[Any]]:
    """The units of one formula with what stands right beside it.

    words : of its leaves, as the hand sets them; gap : before it, x-heights.
    """
    left, laid = list(words), list[_Laid]()
    for formula, letters in piece.parts:
        own = [left.pop(0) if word else None for word in letters]
        laid += _lay_part(formula, own, writer, wander)
    displayed = any(formula is not None and formula.displayed for formula, _ in piece.parts)
    begun: list[_Laid] = []
    for each in laid:
        if begun and each.gap is not None:
            yield Unit(_join_boxes(begun, displayed), gap)
            begun, gap = [], each.gap
        begun.append(each)
    yield Unit(_join_boxes(begun, displayed), gap)


def _lay_part(
    formula: Formula | None, words: Sequence[Word[Any] | None], writer: Handwriting[Any], wander: Wander
) -> Iterator[_Laid]:
    """A formula, or a word that stands beside one."""
    boxes = [_NOTHING if word is None else writer.ink_box(word) for word in words]
    if formula is None:
        yield _Laid(Box((SetLeaf(0, 0.0, 0.0, 1.0),), *boxes[0]), words, None)
        return
    for number, (gap, box) in enumerate(lay_out(formula.tree, boxes, formula.displayed, wander)):
        yield _Laid(box, words, gap, "") if number else _Laid(box, words, None, formula.source)


def _join_boxes(laid: Sequence[_Laid], displayed: bool) -> FormulaWord:
    """What stands side by side, as one word."""
    parts, letters, end = list[Any](), list[tuple[int, str, float, float]](), 0.0
    for number, (box, words, _, _) in enumerate(laid):
        moved = box.move_by(end + (_BESIDE if number else 0.0) - box.left, 0.0)
        end = moved.right
        for part in moved.parts:
            if not isinstance(part, SetLeaf):
                parts.append(part.strokes)
            elif (word := words[part.number]) is not None:
                parts.append((word, part.x, part.y, part.size))
                ends = (part.x + part.size * word.extents).tolist()
                letters += [(at, spelt, *each) for at, spelt, each in zip(word.at, word.spelt, ends, strict=True)]
    return FormulaWord(
        (),
        np.array([each[2:] for each in letters]).reshape(-1, 2),
        tuple(each[0] for each in letters),
        tuple(each[1] for each in letters),
        end + _BEARING,
        0.0,
        end,
        low=min(each.box.bottom for each in laid) - _AROUND * displayed,
        high=max(each.box.top for each in laid) + _AROUND * displayed,
        displayed=displayed,
        parts_of=tuple(parts),
        sources=tuple(each.source for each in laid if each.source),
    )
