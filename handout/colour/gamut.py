"""How much of a hand's ink a printer cannot reach, and how much it loses there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.colour.models import inverse
from handout.colour.models.forward import Forward
from handout.colour.table import ColourTable
from handout.errors import InputError
from handout.summary import one_line
from handout.values import Array

SEEN = 1.0  # ΔE00 from which a colour counts as out of reach: about what is just noticed
_SWATCH, _GAP = 48, 6  # pixels


@dataclass(frozen=True, eq=False)
class Reach:
    """What becomes of samples of ink.

    wanted, shown : (n, 3) float: scanned RGB of the samples, and of the nearest that the printer can print.
    lost : (n,) float, ΔE00 between them.
    """

    wanted: Array
    shown: Array
    lost: Array

    __repr__ = one_line

    @property
    def share_out(self) -> float:
        """Share of the samples that lose more than `SEEN`, 0–1."""
        return float((self.lost > SEEN).mean())

    @property
    def mean(self) -> float:
        """ΔE00 lost, mean of the samples out of reach; 0 without any."""
        far = self.lost[self.lost > SEEN]
        return float(far.mean()) if len(far) else 0.0

    @property
    def p95(self) -> float:
        """ΔE00 lost, 95th percentile of the samples out of reach; 0 without any."""
        far = self.lost[self.lost > SEEN]
        return float(np.percentile(far, 95)) if len(far) else 0.0

    def __str__(self) -> str:
        return tell_loss(self.share_out, self.mean)


def tell_loss(out: float, mean: float, whose: str = "") -> str:
    """The sentence, the same everywhere, on what of an ink cannot be printed.

    Parameters
    ----------
    out : share of the ink's samples that are out of reach; mean : ΔE00 lost there, as `Reach` has both.
    whose : what the ink is called: "of house-joined".
    """
    ink = f"the ink {whose}" if whose else "the ink"
    if not out:
        return f"This printer can print all of {ink} (within ΔE00 {SEEN:g})."
    return (
        f"This printer cannot print {out:.0%} of {ink}, and prints the nearest colour instead: off by ΔE00 {mean:.1f} "
        "on the mean, which only another paper or printer can better."
    )


def reach(samples: Array, table: ColourTable) -> Reach:
    """What of (n, 3) scanned RGB samples of ink, 0–1, the printer of a table can print.

    Raises
    ------
    InputError
        No samples, or samples that are not (n, 3) numbers in 0–1.
    """
    wanted = np.asarray(samples, dtype=np.float64)
    if wanted.ndim != 2 or wanted.shape[1:] != (3,) or not len(wanted) or not ((wanted >= 0) & (wanted <= 1)).all():
        raise InputError(f"gamut: samples of ink must be (n, 3) scanned RGB in 0 to 1, not {np.shape(samples)}.")
    forward = Forward(np.asarray(table.scanned, dtype=np.float64))
    device, lost = inverse.printable(forward, wanted)
    return Reach(wanted, forward.inside(device), lost)


def swatches(reach: Reach, count: int = 12) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: wanted colours over what is printed for them, from the least lost to the most."""
    order = np.argsort(reach.lost, kind="stable")
    chosen = order[np.linspace(0, len(order) - 1, min(count, len(order))).round().astype(int)]
    tile = _SWATCH + _GAP
    sheet = np.full((2 * _SWATCH + 2 * _GAP, len(chosen) * tile + _GAP, 3), 255, dtype=np.uint8)
    for row, colours in enumerate((reach.wanted, reach.shown)):
        for at, which in enumerate(chosen):
            x, y = _GAP + at * tile, _GAP + row * _SWATCH
            sheet[y : y + _SWATCH, x : x + _SWATCH] = np.rint(np.clip(colours[which], 0, 1) * 255)
    return sheet
