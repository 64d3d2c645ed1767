"""Models of one printer, paper and scanner, from the patches of a chart, by several methods behind `fit`.

    forward    device → scanned: a smoothed spline, baked into a grid
    inverse    scanned → device by Gauss–Newton on the forward model; the nodes of a table
    splines    polyharmonic splines and their smoothing; patches made ready for them

Add a method: its name in `colour.METHODS`, its branch in `fit`, its sentence in the docstring there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.colour import METHODS, conversions
from handout.colour.models import inverse, splines
from handout.colour.models.forward import Forward, Patches, fit_forward, lattice, measure_misses
from handout.colour.models.inverse import optimised_nodes
from handout.errors import InputError
from handout.values import Array

_BOUND = 3.0  # ΔE00, mean over its own patches, that a model may miss


@dataclass(frozen=True, eq=False)
class Model:
    """Which device colour gives a scanned colour, and which scanned colour a device colour gives.

    method : one of `METHODS`.
    forward : device → scanned, whatever the method, for telling what can be printed.
    direct : scanned → device, of the methods that fit it directly.
    misses : (n,) ΔE00 by which the model misses its own patches.
    """

    method: str
    forward: Forward
    direct: splines.Spline | None
    misses: Array

    def invert(self, scanned: Array) -> Array:
        """(n, 3) device RGB, unclamped, of (n, 3) scanned RGB."""
        if self.direct is not None:
            return self.direct(scanned)
        return inverse.invert(self.forward, scanned)

    def nodes(self, side: int) -> Array:
        """(side³, 3) device RGB, unclamped, for a table over the cube of scanned RGB, blue fastest."""
        exact = self.invert(lattice(side))
        return exact if self.direct is not None else optimised_nodes(self.forward, exact, side)


def fit(patches: Patches, method: str = "forward") -> Model:
    """A model of a printed and scanned chart.

    method : ``forward``: a smooth spline device → scanned, inverted numerically; the most accurate. ``tps``: thin-plate
        splines scanned → device, smoothed by the measured noise. ``tps-haines2016``: the paper's exact thin-plate
        splines scanned → device; noise goes into them as it is.

    Raises InputError: an unknown method; a model that misses its own patches by more than ΔE00 3 on average.

    Source: seed 000, §7.1.
    """
    if method not in METHODS:
        raise InputError(f"colour: there is no method {method!r}; there are {', '.join(METHODS)}.")
    forward = fit_forward(patches)
    if method == "forward":
        direct, reached = None, patches.device
    else:
        variances = splines.noise(patches.device, patches.scanned, patches.deviation)
        if method == "tps-haines2016":
            ready = splines.merge_close_rows(patches.scanned, patches.device, np.ones(len(patches)))
            direct = splines.exact(ready.x, ready.y)
        else:
            ready = splines.merge_close_rows(patches.scanned, patches.device, variances * _steepness(patches) ** 2)
            direct = splines.smooth(ready.x, ready.y, ready.variances, ("r2 log r",), degree=1)
        reached = direct(patches.scanned)
    misses = measure_misses(forward, reached, patches.scanned)
    mean, worst = float(misses.mean()), int(misses.argmax())
    if not mean <= _BOUND:
        sent = ", ".join(f"{255 * value:.0f}" for value in patches.device[worst])
        raise InputError(
            f"colour: the model ({method}) misses its own patches by ΔE00 {mean:.1f} on average, more than {_BOUND:g} "
            f"(the worst is patch {worst + 1}, sent as {sent}: {misses[worst]:.1f}); scan or print the chart again."
        )
    return Model(method, forward, direct, misses)


def _steepness(patches: Patches) -> Array:
    """(n,) how much device RGB changes with scanned RGB at every patch, from a cubic through all of them."""
    light = conversions.linear(patches.scanned)
    design = np.column_stack([splines.terms(patches.scanned, 2), light, light**2])
    fitted = np.linalg.lstsq(design, patches.device, rcond=None)[0]
    slopes = []
    for channel in range(3):
        moved = patches.scanned + 1e-3 * np.eye(3)[channel]
        light = conversions.linear(moved)
        there = np.column_stack([splines.terms(moved, 2), light, light**2]) @ fitted
        slopes.append((there - design @ fitted) / 1e-3)
    return np.asarray(np.sqrt((np.array(slopes) ** 2).sum(axis=(0, 2)) / 3))
