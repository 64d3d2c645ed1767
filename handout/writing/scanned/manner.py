"""How a hand that was read from paper sets its letters: what setting needs to know of it, worked out once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices
from handout.writing.scanned.bending import Bend, Spread, spread
from handout.writing.scanned.beside import Beside, beside
from handout.writing.scanned.flow import Flow, flow
from handout.writing.scanned.forms import Form, Forms
from handout.writing.scanned.spacing import Spacing, spacing


@dataclass(frozen=True, eq=False)
class Manner:
    """Forms of a hand's glyphs, and how it places and varies them."""

    forms: Forms
    beside: Beside
    spacing: Spacing
    flow: Flow
    spread: Spread

    def reach(self, numbers: Indices, bends: Sequence[Bend]) -> Array:
        """(n, 2) float, line space: how far the ink of bent glyphs goes left (negative) and right of their centres.

        Strokes count that are its own part of a ligature: where it is joined, the next letter has more of it.
        """
        found = [_reach(self.forms[int(number)], bend) for number, bend in zip(numbers, bends, strict=True)]
        return np.array(found).reshape(-1, 2)


def manner(hand: ScannedHand) -> Manner:
    """The manner of a hand; takes about a third of a second for a page of a thousand letters."""
    forms = Forms(hand)
    near = beside(hand, forms.centre[:, 0])
    return Manner(forms, near, spacing(forms, near), flow(forms, near), spread(forms))


def _reach(form: Form, bend: Bend) -> tuple[float, float]:
    xy, radius = form.whole
    xy = bend(xy)
    return float((xy[:, 0] - radius).min()), float((xy[:, 0] + radius).max())
