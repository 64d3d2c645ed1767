"""The words of the test sheet, written by the hands of the house."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from handout.hand.library import find
from handout.motion.trace import trace
from handout.plotting.trying.panel import Caption
from handout.values import Drawing, Hand, Line, Manuscript, Page, Placed
from handout.writing.compose import compose
from handout.writing.layout import Layout

_WIDE = 400.0  # mm, more than any caption needs
_FURTHER = 30.0  # mm from one line to the next: they are moved to their places afterwards
_CALM = 0.5  # of a person's variation: captions have to be read


def written(captions: Sequence[Caption], hand: str, page: Page, rng: np.random.Generator, speed: float) -> Drawing:
    """All captions as timed strokes on a page, in their order.

    Raises
    ------
    MissingCharacters
        The hand cannot write one of them.
    """
    if not captions:
        return Drawing((), page)
    known = find(hand)
    assert isinstance(known, Hand)
    size = captions[0].x_height
    sheet = Page(_WIDE, _FURTHER * (len(captions) + 2))
    layout = Layout(sheet, (10.0,) * 4, x_height=size, line_spacing=_FURTHER, align="left", jitter=_CALM)
    (composed,) = compose("\n".join(one.text for one in captions), known, layout, rng, pages=1)
    lines = [_moved(line, one, one.x_height / size) for line, one in zip(composed.lines, captions, strict=True)]
    return trace(Manuscript(tuple(lines), page, size), known, rng, jitter=_CALM, speed=speed)


def _moved(line: Line, caption: Caption, scale: float) -> Line:
    """A line where its caption is to stand."""
    left = min(float(stroke[:, 0].min()) for placed in line.placed for stroke in placed.strokes)
    base = np.array([left, line.baseline])

    def there(placed: Placed) -> Placed:
        strokes = tuple((stroke - base) * scale + [caption.x, caption.y] for stroke in placed.strokes)
        return dataclasses.replace(placed, strokes=strokes)

    return dataclasses.replace(line, placed=tuple(there(placed) for placed in line.placed), baseline=caption.y)
