"""How much ink lies on every pixel: 0 none, 1 as much as the pen usually leaves, at most 2.

The levels of different pens spread differently between paper and ink; the scale bends them all to the same spread, so
that lines of one pen can take the place of another's.  Pages of one hand share a scale.

Source: seed 000, §5.1.1; what was corrected in it: docs/bibliography.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.libraries import interpolate, ndimage
from handout.scanning.inks import PageInks
from handout.scanning.scan import Scan
from handout.values import Array, readonly

MOST = 2.0  # greatest density: seed 000, §5.1.1
_TOP = 4.0  # levels beyond are one
_STEPS = 800
_KERNEL = 0.1  # of the density of levels
_CELLS = 32  # of the table from colour to density, a side
_CENTRES = 7  # lattice of the spline's points, a side
_OWN = 300  # points of the spline at the page's own colours
_SURE, _PERHAPS = 0.357, 0.071  # levels: s = .55 and .35 where zero ink lies at s = .30


@dataclass(frozen=True, eq=False)
class Scale:
    """From the level q of ink to density: the share of the ink that has less, divided by that share at q = 1.

    counts : (800,) float: how often each level from 0 to 4 occurs; scales of pages are pooled by adding them.
    """

    counts: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "counts", readonly(self.counts, _STEPS))

    def density(self, level: Array) -> Array:
        """Density 0–2 of levels of any shape.

        Source: seed 000, §5.1.1: cumulative distribution of a kernel density estimate.
        """
        smooth = ndimage.gaussian_filter1d(self.counts, _KERNEL / (_TOP / _STEPS), mode="reflect")
        share = np.concatenate([[0.0], np.cumsum(smooth)])
        at = np.linspace(0, _TOP, _STEPS + 1)
        return np.asarray(np.clip(np.interp(level, at, share) / np.interp(1.0, at, share), 0, MOST))


@dataclass(frozen=True, eq=False)
class Density:
    """Ink on a page.

    values : (h, w) float32, 0–2.
    scale : from level to density.
    sure : density at and above which a pixel is ink beyond doubt.
    perhaps : density at which it may be.
    """

    values: NDArray[np.float32]
    scale: Scale
    sure: float
    perhaps: float


def find_scale(scan: Scan, inks: PageInks) -> Scale:
    """The scale of a page's own ink; `pooled_scale` makes one of several."""
    rows = max(1, scan.shape[0] // 1500)
    level = inks.levels(scan.rgb[::rows].reshape(-1, 3)[:: max(1, 2 // rows)] / 255.0).max(axis=-1)
    counts, _ = np.histogram(np.clip(level[level > 0], 0, _TOP - 1e-6), bins=_STEPS, range=(0, _TOP))
    return Scale(counts.astype(np.float64))


def pooled_scale(scales: Sequence[Scale]) -> Scale:
    """One scale for all pages of a hand."""
    return Scale(np.sum([scale.counts / max(scale.counts.sum(), 1.0) for scale in scales], axis=0))


def find_density(scan: Scan, inks: PageInks, scale: Scale | None = None) -> Density:
    """Density of ink on a page whose light has been evened out.

    scale : that of all pages of the hand; without it the page's own.
    """
    scale = scale or find_scale(scan, inks)
    table = density_table(inks, scale, scan.rgb)
    values = np.empty(scan.shape, dtype=np.float32)
    for start in range(0, scan.shape[0], 512):
        values[start : start + 512] = look_up(table, scan.rgb[start : start + 512])
    sure, perhaps = scale.density(np.array([_SURE, _PERHAPS]))
    return Density(values, scale, float(sure), float(perhaps))


def density_table(inks: PageInks, scale: Scale, rgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(33, 33, 33) float32: density at colours on a lattice over 0–255, by a thin-plate spline through samples.

    It is worked out where the page has colours; elsewhere the table holds what the spline was fitted to.  And it is cut
    off where there is no ink: its ripple would make paper of almost no density, which is not none.

    Source: seed 000, §5.1.1 (thin plate spline from RGB to density).
    """
    points = _sample(inks, rgb)
    densities = scale.density(np.clip(inks.levels(points).max(axis=-1), 0, None))
    spline = interpolate.RBFInterpolator(points, densities, kernel="thin_plate_spline", smoothing=1e-6)
    axis = np.linspace(0, 1, _CELLS + 1)
    lattice = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    level = inks.levels(lattice).max(axis=-1)
    table = np.where(level > 0, scale.density(np.clip(level, 0, None)), np.clip(level, -1, 0))
    # (33³,) bool: corners of the cells in which the page has colours
    low = np.minimum(rgb[::3, ::3].astype(np.uint16) * _CELLS // 255, _CELLS - 1)
    used = np.zeros((_CELLS + 1,) * 3, dtype=bool)
    used[low[..., 0], low[..., 1], low[..., 2]] = True
    in_use = (level > 0) & np.asarray(ndimage.maximum_filter(used, size=2, origin=(0, 0, 0))).ravel()
    table[in_use] = np.clip(spline(lattice[in_use]), 0, MOST)
    return np.asarray(table.reshape(_CELLS + 1, _CELLS + 1, _CELLS + 1), dtype=np.float32)


def _sample(inks: PageInks, rgb: NDArray[np.uint8]) -> Array:
    """(n, 3) float: a lattice over all colours, and the page's own inky colours, evenly over their levels."""
    axis = np.linspace(0, 1, _CENTRES)
    lattice = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    code = (rgb[::3, ::3] >> 2).astype(np.int32) @ np.array([4096, 64, 1], dtype=np.int32)
    cells_used = np.flatnonzero(np.bincount(code.ravel(), minlength=64**3))
    page_colours = np.stack([cells_used >> 12, cells_used >> 6 & 63, cells_used & 63], axis=1) * 4.0 / 255
    level = inks.levels(page_colours).max(axis=-1)
    page_colours = page_colours[level > -0.3][np.argsort(level[level > -0.3])]
    return np.asarray(np.unique(np.concatenate([lattice, page_colours[:: max(1, len(page_colours) // _OWN)]]), axis=0))


def look_up(table: NDArray[np.float32], rgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Density of colours (…, 3) uint8 by trilinear interpolation; what lies below 0 is 0.

    Only colours with ink in one of the eight corners of their cell are worked out: paper has none.
    """
    cells = table.shape[0] - 1
    where = rgb.astype(np.uint16) * cells  # in 255ths of a cell
    low = np.minimum(where // 255, cells - 1)
    # (cells, cells, cells) bool: any corner of the cell has ink
    with_ink = np.asarray(ndimage.maximum_filter(table > 0, size=2, origin=(-1, -1, -1))[:-1, :-1, :-1])
    inky = with_ink[low[..., 0], low[..., 1], low[..., 2]]
    result = np.zeros(rgb.shape[:-1], dtype=np.float32)
    corner = low[inky].astype(np.intp)
    part = where[inky].astype(np.float32) / 255 - corner
    flat = (corner[:, 0] * (cells + 1) + corner[:, 1]) * (cells + 1) + corner[:, 2]
    values, interpolated = table.ravel(), np.zeros(len(flat), dtype=np.float32)
    for i in range(8):
        bits = np.array([i >> 2 & 1, i >> 1 & 1, i & 1])
        weight = np.where(bits, part, 1 - part).prod(axis=1)
        interpolated += weight * values[flat + (bits[0] * (cells + 1) + bits[1]) * (cells + 1) + bits[2]]
    result[inky] = np.maximum(interpolated, 0)
    return result
