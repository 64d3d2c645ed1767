"""How a hand that was read from paper sets its letters: what setting needs to know of it, worked out once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from handout.hand.scanned import ScannedHand
from handout.values import Array, readonly
from handout.writing.scanned.bending import Spread, spread
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

    @cached_property
    def reach(self) -> Array:
        """(n, 2) float, line space: how far the ink of each glyph goes left (negative) and right of its centre.

        Strokes count that are its own part of a ligature: where it is joined, the next letter has more of it.
        """
        return readonly([_reach(self.forms[number]) for number in range(len(self.forms))], len(self.forms), 2)


def manner(hand: ScannedHand) -> Manner:
    """The manner of a hand; takes about a third of a second for a page of a thousand letters."""
    forms = Forms(hand)
    near = beside(hand, forms.centre[:, 0])
    return Manner(forms, near, spacing(forms, near), flow(forms, near), spread(forms))


def _reach(form: Form) -> tuple[float, float]:
    xy, radius = form.whole
    return float((xy[:, 0] - radius).min()), float((xy[:, 0] + radius).max())
