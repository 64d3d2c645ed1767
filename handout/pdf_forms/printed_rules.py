"""The lines printed in and under the fields of a form, on which people write.

Source: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.pdf_forms.fields import Box

DPI = 150.0  # at which a page is drawn to look for lines


@dataclass(frozen=True)
class RuleSearch:
    """What counts as a line of a field; set by eye on forms with boxes, rules and dotted rules."""

    beyond: float = 1.5  # mm above and below a field within which its lines may lie
    dark: float = 0.12  # share of light that a line takes at least
    dots: float = 1.6  # mm between the dots of a rule that are one line
    share: float = 0.85  # of a field's width that a line covers
    thick: float = 0.9  # mm: what is thicker is an edge of a shaded field, or a bar


_SEARCH = RuleSearch()


def rules(page: NDArray[np.uint8], box: Box) -> tuple[float, ...]:
    """Heights of level lines as wide as a field, mm from the field's top, downwards.

    Parameters
    ----------
    page : (h, w, 3) uint8, drawn at `DPI`.
    box : of the field, mm, as it is shown.
    """
    scale = DPI / 25.4
    left, top, right, bottom = box
    beyond = _SEARCH.beyond
    first = max(0, round((top - beyond) * scale))
    part = page[
        first : max(first, round((bottom + beyond) * scale)), max(0, round(left * scale)) : round(right * scale)
    ]
    if part.shape[0] < 3 or part.shape[1] < 3:
        return ()
    light = part.mean(axis=2)
    paper = float(np.percentile(light, 80))  # most of a field is empty
    dark = light < (1 - _SEARCH.dark) * paper
    # rows with the gaps between dots closed: what has ink within `reach` pixels on both sides
    reach = max(1, round(_SEARCH.dots * scale))
    before = np.zeros((len(dark), dark.shape[1] + 1), dtype=np.int64)
    np.cumsum(dark, axis=1, out=before[:, 1:])
    at = np.arange(dark.shape[1])
    on_left = before[:, at + 1] - before[:, np.maximum(at + 1 - reach, 0)] > 0
    on_right = before[:, np.minimum(at + reach, dark.shape[1])] - before[:, at] > 0
    found = ((on_left & on_right) | dark).mean(axis=1) > _SEARCH.share
    edges = np.flatnonzero(np.diff(np.concatenate([[False], found, [False]]).astype(np.int8)))
    bands = [(a, b) for a, b in edges.reshape(-1, 2).tolist() if b - a <= _SEARCH.thick * scale]
    return tuple((first + (a + b) / 2) / scale - top for a, b in bands)
