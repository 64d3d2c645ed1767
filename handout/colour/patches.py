"""What was sent to a printer, and what the scanner saw of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.errors import InputError
from handout.summary import one_line
from handout.values import Array

LEAST = 100  # patches; a printer is not known from fewer
_SPAN = 0.2  # of scanned light, between the darkest and the lightest patch of every channel
_OVER = 0.05  # how far a flat-fielded mean may leave 0–1


@dataclass(frozen=True, eq=False)
class Patches:
    """The patches of one printed and scanned chart; rows of equal `device` are repeats of one patch.

    device : (n, 3) float in 0–1: the RGB that was sent.
    scanned : (n, 3) float, about 0–1: robust mean of each patch as the scanner saw it, flat-fielded.
    deviation : (n,) float, in the unit of `scanned`: standard error of each mean; NaN where it is not known.

    Raises
    ------
    InputError
        Arrays of other shapes, fewer than 100 patches, numbers out of bounds, a chart that does not vary; the message
        names the patch, counted from 1.
    """

    device: Array
    scanned: Array
    deviation: Array

    __repr__ = one_line

    def __post_init__(self) -> None:
        rows = len(np.atleast_1d(np.asarray(self.device)))
        if rows < LEAST:
            raise InputError(f"patches: {rows} are too few to know a printer by; print a chart of {LEAST} or more.")
        object.__setattr__(self, "device", _rows("device", self.device, (rows, 3), 0.0, 1.0))
        object.__setattr__(self, "scanned", _rows("scanned", self.scanned, (rows, 3), -_OVER, 1 + _OVER))
        object.__setattr__(self, "deviation", _rows("deviation", self.deviation, (rows,), 0.0, 1.0, unknown=True))
        _check_varies(self.device, self.scanned)

    def __len__(self) -> int:
        return len(self.device)


def _rows(name: str, values: Array, shape: tuple[int, ...], low: float, high: float, unknown: bool = False) -> Array:
    array = np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise InputError(f"patches: {name} has the shape {array.shape}; {shape} is wanted.")
    wrong = ~((array >= low) & (array <= high)) & ~(np.isnan(array) & unknown)
    if wrong.any():
        first = tuple(np.argwhere(wrong)[0].tolist())
        raise InputError(
            f"patches: {name} of patch {first[0] + 1} is {array[first]:g}, outside {low:g} to {high:g}; "
            "leave the patch out, or scan the chart again."
        )
    array.flags.writeable = False
    return array


def _check_varies(device: Array, scanned: Array) -> None:
    spans = zip(("red", "green", "blue"), np.ptp(device, axis=0), np.ptp(scanned, axis=0), strict=True)
    for channel, sent_span, scan_span in spans:
        if sent_span < 0.5:
            raise InputError(f"patches: {channel} was sent in a range of {sent_span:.2f} only; at least 0.5 is wanted.")
        if scan_span < _SPAN:
            raise InputError(
                f"patches: the scanned {channel} of all patches lies within {scan_span:.3f}, and a printed chart "
                f"spans {_SPAN:g} or more: scan the chart itself, in colour."
            )
