"""How a hand that was read from paper sets its letters: what setting needs to know of it, worked out once."""

from __future__ import annotations

from dataclasses import dataclass

from handout.hand.scanned import ScannedHand
from handout.writing.scanned.bending import Spread, spread
from handout.writing.scanned.beside import Beside, beside
from handout.writing.scanned.flow import Flow, flow
from handout.writing.scanned.forms import Forms
from handout.writing.scanned.spacing import Spacing, spacing


@dataclass(frozen=True, eq=False)
class Manner:
    """Forms of a hand's glyphs, and how it places and varies them."""

    forms: Forms
    beside: Beside
    spacing: Spacing
    flow: Flow
    spread: Spread


def manner(hand: ScannedHand) -> Manner:
    """The manner of a hand; takes about a second for a page."""
    forms = Forms(hand)
    near = beside(hand, forms.centre[:, 0])
    return Manner(forms, near, spacing(forms, near), flow(forms, near), spread(forms))
