"""Printer, paper and scanner as one function, from device RGB to scanned RGB.

A smooth spline is sampled once on a dense grid, because its inverse asks for a hundred thousand values.  Outside the
cube of device RGB the function goes on straight, so that the inverse has a value just out of gamut too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from handout.colour import conversions
from handout.colour.interpolation import Nodes
from handout.colour.models import splines
from handout.colour.patches import Patches
from handout.values import Array

SIZE = 33  # of the baked grid
_MARGIN = 5  # nodes beyond the grid, within which the even ends of its cubic spline fade
_STEP = 1e-3  # device, for slopes
_ROUNDS, _FEW = 3, 1 / 20  # of leaving patches out; share of them
_FAR, _HARMLESS = 6.0, 1.5 / 255  # medians; scanned: a patch farther off than both is left out


@dataclass(frozen=True, eq=False)
class Forward:
    """device RGB → scanned RGB.

    grid : (33, 33, 33, 3) float: scanned RGB at device RGB (i, j, k) / 32.
    """

    grid: Array

    @cached_property
    def _coefficients(self) -> list[Array]:
        from scipy.ndimage import spline_filter

        wide = _extrapolate(np.moveaxis(np.asarray(self.grid, dtype=np.float64), 3, 0))
        return [spline_filter(channel, order=3, mode="mirror") for channel in wide]

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """(m, 3) device colours over the cube, and (m, 3) what is seen of them."""
        return lattice(len(self.grid)), self.grid.reshape(-1, 3)

    @cached_property
    def skin(self) -> tuple[Array, Array]:
        """(m, 3) device colours on the faces of the cube, and (m, 3) what is seen of them."""
        device, scanned = self.samples
        outer = ((device == 0) | (device == 1)).any(axis=1)
        return device[outer], scanned[outer]

    @cached_property
    def looks(self) -> Nodes:
        """(33, 33, 33, 3) float32: L*a*b* of the grid."""
        return conversions.lab(self.grid).astype(np.float32)

    @property
    def white(self) -> Array:
        """(3,) scanned RGB of the bare paper."""
        return np.asarray(self.grid[-1, -1, -1])

    def inside(self, device: Array) -> Array:
        """(n, 3) scanned RGB of (n, 3) device RGB within 0–1."""
        from scipy.ndimage import map_coordinates

        at = device.T * (len(self.grid) - 1) + _MARGIN
        channels = [map_coordinates(c, at, order=3, mode="mirror", prefilter=False) for c in self._coefficients]
        return np.stack(channels, axis=1)

    def slopes(self, device: Array, scanned: Array) -> Array:
        """(n, 3, 3) ∂scanned / ∂device at (n, 3) device RGB within 0–1 where `scanned` is its scanned RGB."""
        out = np.empty((len(device), 3, 3))
        for channel in range(3):
            step = np.where(device[:, channel] > 0.5, -_STEP, _STEP)
            moved = device.copy()
            moved[:, channel] += step
            out[:, :, channel] = (self.inside(moved) - scanned) / step[:, None]
        return out

    def __call__(self, device: Array) -> Array:
        """(n, 3) scanned RGB of (n, 3) device RGB, which goes on straight outside 0–1."""
        within = np.clip(device, 0, 1)
        scanned = self.inside(within)
        out = np.flatnonzero((device != within).any(axis=1))
        if len(out):
            slopes = self.slopes(within[out], scanned[out])
            scanned[out] += np.einsum("nij,nj->ni", slopes, (device - within)[out])
        return scanned


def _extrapolate(values: Array) -> Array:
    """(k, s, s, s) continued by `_MARGIN` nodes on every side, each on the cubic through the last four."""
    for axis in (1, 2, 3):
        ends = np.moveaxis(values, axis, 0)
        for _ in range(_MARGIN):
            low = 4 * ends[0] - 6 * ends[1] + 4 * ends[2] - ends[3]
            high = 4 * ends[-1] - 6 * ends[-2] + 4 * ends[-3] - ends[-4]
            ends = np.concatenate([low[None], ends, high[None]])
        values = np.moveaxis(ends, 0, axis)
    return np.ascontiguousarray(values)


def lattice(size: int) -> Array:
    """(size³, 3) float: the colours of an even grid over the cube, blue fastest."""
    axis = np.linspace(0, 1, size)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)


def spline(patches: Patches) -> splines.Spline:
    """The smoothed spline device → scanned, of the kernel under which the chart is likelier.

    Patches that lie far off what all others say, as dust and glare make them, are left out, at most one in 20.
    """
    usable = np.ones(len(patches), dtype=bool)
    for _ in range(_ROUNDS):
        device, scanned = patches.device[usable], patches.scanned[usable]
        ready = splines.merge_close_rows(device, scanned, splines.noise(device, scanned, patches.deviation[usable]))
        fit = splines.smooth(ready.x, ready.y, ready.variances, ("r3", "r5"), degree=2)
        off = np.linalg.norm(fit(patches.device) - patches.scanned, axis=1)
        near = off <= max(_FAR * float(np.median(off)), _HARMLESS)
        if np.array_equal(near, usable) or (~near).mean() > _FEW:
            break
        usable = near
    return fit


def fit_forward(patches: Patches) -> Forward:
    """The forward model of a chart."""
    return Forward(spline(patches)(lattice(SIZE)).reshape(SIZE, SIZE, SIZE, 3))


def measure_misses(forward: Forward, device: Array, scanned: Array) -> Array:
    """(n,) ΔE00 between scanned colours and what is seen of the device colours, cut to 0–1, meant to give them."""
    return conversions.delta_e(conversions.lab(forward.inside(np.clip(device, 0, 1))), conversions.lab(scanned))
