"""Printer, paper and scanner as one function, from device RGB to scanned RGB.

A smooth spline is sampled once on a dense grid, because its inverse asks for a hundred thousand values.  Outside the
cube of device RGB the function goes on straight, so that the inverse has a value just out of gamut too.  Colours are
looked up in a grid, as in the table that is made of the inverse, by cutting each cell into six tetrahedra that share
its grey diagonal.

Source: Kasson, Plouffe and Nin 1993, §3 (tetrahedral interpolation); the model is this project's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from handout.colour import conversions
from handout.colour.models import splines
from handout.errors import InputError
from handout.libraries import ndimage
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

    Raises InputError: arrays of other shapes, fewer than 100 patches, numbers out of bounds, a chart that does not
    vary; the message names the patch, counted from 1.
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


_CHUNK = 16384  # colours at a time, so that what is in between stays in the cache

Nodes = NDArray[np.float32]
_Float = TypeVar("_Float", np.float32, np.float64)


def look_up(nodes: Nodes, colours: Array | NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, k) float32 values of an even (s, s, s, k) table over the cube at (n, 3) `colours`.

    Colours outside 0–1 take the value of the nearest point of the cube.
    """
    side, width = nodes.shape[0], nodes.shape[3]
    flat = np.ascontiguousarray(nodes.reshape(-1, width))
    out = np.empty((len(colours), width), dtype=np.float32)
    for begin in range(0, len(colours), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        corners, shares = parts(side, np.ascontiguousarray(np.asarray(colours[part], dtype=np.float32).T))
        value = flat[corners[0]] * shares[0][:, None]
        for corner, share in zip(corners[1:], shares[1:], strict=True):
            value += flat[corner] * share[:, None]
        out[part] = value
    return out


def parts(side: int, colours: NDArray[_Float]) -> tuple[list[NDArray[np.int32]], list[NDArray[_Float]]]:
    """Of (3, n) colours: the numbers of the four nodes between which each lies, and the share of each node.

    The nodes are met on the way from the cell's dark corner to its light one along the channels, that with the
    largest part of the cell first.
    """
    scaled = np.clip(colours, 0, 1) * colours.dtype.type(side - 1)
    cell = np.minimum(scaled.astype(np.int32), side - 2)
    x, y, z = (scaled - cell).astype(colours.dtype)
    strides = np.array([side * side, side, 1], dtype=np.int32)
    opposite = np.int32(strides.sum())
    corner = (cell[0] * side + cell[1]) * side + cell[2]
    largest, least = np.maximum(np.maximum(x, y), z), np.minimum(np.minimum(x, y), z)
    middle = x + y + z - largest - least
    first = strides[np.where(x == largest, 0, np.where(y == largest, 1, 2))]
    last = strides[np.where(z == least, 2, np.where(y == least, 1, 0))]
    corners = [corner, corner + first, corner + (opposite - last), corner + opposite]
    return corners, [1 - largest, largest - middle, middle - least, least]


SIZE = 33  # of the baked grid
_MARGIN = 5  # nodes beyond the grid, within which the even ends of its cubic spline fade
_STEP = 1e-3  # device, for slopes
_ROUNDS, _FEW = 3, 1 / 20  # of leaving patches out; share of them
_FAR, _HARMLESS = 6.0, 1.5 / 255  # medians; scanned: a patch farther off than both is left out


@dataclass(frozen=True, eq=False)
class Forward:
    """device RGB → scanned RGB; grid : (33, 33, 33, 3) float: scanned RGB at device RGB (i, j, k) / 32."""

    grid: Array

    @cached_property
    def _coefficients(self) -> list[Array]:
        wide = _extrapolate(np.moveaxis(np.asarray(self.grid, dtype=np.float64), 3, 0))
        return [ndimage.spline_filter(channel, order=3, mode="mirror") for channel in wide]

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
        at = device.T * (len(self.grid) - 1) + _MARGIN
        channels = [ndimage.map_coordinates(c, at, order=3, mode="mirror", prefilter=False) for c in self._coefficients]
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
