"""A brush stroke straightened to a ribbon of ink, cut into segments, with what each is chosen by.

A ribbon runs from the stroke's head, where the brush was put down full of paint, to its tail.  Its rows span
`SPAN` half widths on either side of the spine, so that the stroke's ragged outline is in its ink and nothing is
stretched to fit.  A segment is an eighth of the stroke's width long; it is a slice of columns.

Source: seed 004, §3.1 and §3.2; cover and streaks as features, and mirrored ribbons: own method.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking.brush.photographs import PhotographedStroke
from handout.libraries import cv2, interpolate, ndimage
from handout.summary import one_line
from handout.values import Array

SPAN = 1.25  # half widths on either side of the spine
SEGMENTS = 8  # in a width
ROWS = 10 * SEGMENTS // 4  # that borders are compared in: 20, as a quilt's seams are
_MOST_ROWS = 240  # of a ribbon: a width of 192 pixels
_FAINT = 0.02  # of a column's cover: less is paper before or after the stroke
_EDGE = 0.15  # of the paper covered, smoothed: where the stroke's edge is
_STEADY = 0.35  # widths: deviation of the Gaussian by which a spine moves to the middle of its edges
_PIECE = 2.0  # widths of one parabola of a spine
_INK = 0.5  # covered so far, a pixel shows its ink's own colour

_Pixels = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Ribbon:
    """A straightened stroke.

    rgba : (rows, columns, 4) uint8, straight alpha, head at the left; as many columns as segments have.
    bend : (n,) float: turning of the spine in each segment, rad a width.
    """

    rgba: NDArray[np.uint8]
    bend: Array

    __repr__ = one_line

    def __len__(self) -> int:
        return len(self.bend)

    @property
    def columns(self) -> int:
        """Of a segment."""
        return int(self.rgba.shape[1] // len(self.bend))

    @cached_property
    def premultiplied_ink(self) -> _Pixels:
        """(rows, columns, 4) float32, 0–1."""
        ink = self.rgba.astype(np.float32) / np.float32(255)
        ink[..., :3] *= ink[..., 3:]
        return ink

    @cached_property
    def borders(self) -> _Pixels:
        """(n + 1, ROWS, 4): the ink at the border before each segment, and after the last."""
        step = self.columns
        padded = np.pad(self.premultiplied_ink, ((0, 0), (1, 1), (0, 0)))
        at = np.arange(len(self) + 1) * step
        lines = (padded[:, at] + padded[:, at + 1]) / 2
        small = cv2.resize(np.ascontiguousarray(lines), (len(at), ROWS), interpolation=cv2.INTER_AREA)
        return np.asarray(small.swapaxes(0, 1), dtype=np.float32)

    @cached_property
    def cover(self) -> Array:
        """(n,): share of the outline's usual width that is covered, of each segment."""
        rows = len(self.rgba)
        edge = round(rows * (1 - 1 / SPAN) / 2)
        alpha = self.rgba[edge : rows - edge, :, 3].mean(axis=0) / 255.0
        return np.asarray(alpha.reshape(len(self), -1).mean(axis=1))

    @cached_property
    def streaks(self) -> Array:
        """(n,): edges between ink and paper across a segment, in all of its width."""
        alpha = self.rgba[..., 3].astype(np.float64) / 255
        return np.asarray(np.abs(np.diff(alpha, axis=0)).sum(axis=0).reshape(len(self), -1).mean(axis=1) / 2)

    @cached_property
    def widths(self) -> Array:
        """(n + 1, 2): from the spine to either edge at the borders, in half widths."""
        step = self.columns
        alpha = np.pad(self.rgba[..., 3] / np.float32(255), ((0, 0), (step // 2, step)))
        return _edges(alpha[:, : (len(self) + 1) * step].reshape(len(alpha), len(self) + 1, step).mean(axis=2)) * SPAN

    def mirror(self) -> Ribbon:
        """The same stroke with its sides exchanged."""
        return Ribbon(np.ascontiguousarray(self.rgba[::-1]), -self.bend)


def _edges(cover: NDArray[np.floating[Any]]) -> Array:
    """(n, 2): share of the rows from the middle to the first and to the last that is covered, of (rows, n)."""
    rows = len(cover)
    ink = np.asarray(cover > _EDGE)
    some = np.asarray(ink.any(axis=0))
    first, last = ink.argmax(axis=0), rows - np.flipud(ink).argmax(axis=0)
    sides = np.stack([1 - 2 * first / rows, 2 * last / rows - 1], axis=1)
    return np.asarray(np.where(some[:, None], sides, 0.0))


def straighten_stroke(found: PhotographedStroke, most_rows: int = _MOST_ROWS) -> tuple[Ribbon, Array, float]:
    """The ribbon of a stroke; its tail is the end that the paint streaks towards.

    most_rows : of the ribbon; no more than the picture has pixels.

    Returns the ribbon; (n, 2) float, pixels: its spine from head to tail; half the stroke's width, pixels.
    """
    spine, half = _centre_spine(found)
    rows = int(np.clip(round(2 * SPAN * half), 2 * ROWS, most_rows))
    rows -= rows % ROWS
    columns = max(1, round(rows / (SPAN * SEGMENTS)))
    step = 2 * half / (SEGMENTS * columns)
    line = _space_evenly(spine, step)
    density, light = _unwrap_picture(found.density, line, half, rows), _unwrap_picture(found.light, line, half, rows)
    here = np.flatnonzero(density.mean(axis=0) > _FAINT)
    first, count = int(here[0]), -(-(int(here[-1]) + 1 - int(here[0])) // columns)
    cut = slice(first, first + count * columns)
    density, light, line = density[:, cut], light[:, cut], line[cut]
    lacking = count * columns - density.shape[1]
    density, light = np.pad(density, ((0, 0), (0, lacking))), np.pad(light, ((0, 0), (0, lacking), (0, 0)))
    # the colour of the ink that covers so much of the paper and lets that light pass
    solid = density > _INK
    covered = np.maximum(density, _INK)[..., None]
    own = np.clip(1 - (1 - light) / covered, 0, 1)
    usual = np.median(own[density > 0.9], axis=0) if (density > 0.9).any() else own[solid].mean(axis=0)
    colours = np.where(solid[..., None], own, usual).astype(np.float32)
    rgba = np.concatenate([colours, density[..., None]], axis=2)
    way = np.diff(line, axis=0, append=2 * line[-1:] - line[-2:-1])
    angle = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    bend = np.diff(np.interp(np.arange(count + 1) * columns, np.arange(len(angle)), angle)) * SEGMENTS
    ribbon = Ribbon(np.rint(rgba * 255).astype(np.uint8), bend)
    third = max(1, count // 3)
    if ribbon.streaks[:third].sum() <= ribbon.streaks[-third:].sum():
        return ribbon, line, half
    return Ribbon(np.ascontiguousarray(ribbon.rgba[:, ::-1]), -bend[::-1]), line[::-1], half


def _centre_spine(found: PhotographedStroke) -> tuple[Array, float]:
    """The spine in the middle between the stroke's edges, and half the stroke's width, pixels."""
    spine, half = _space_evenly(found.spine, 1.0), found.width / 2
    for _ in range(3):
        rows = 2 * round(1.6 * half)
        band = ndimage.gaussian_filter1d(_unwrap_picture(found.density, spine, half, rows, 1.6), 0.06 * half, axis=0)
        band = ndimage.gaussian_filter1d(band, 0.3 * half, axis=1)
        sides = _edges(band) * 1.6 * half
        inked = np.flatnonzero(band.max(axis=0) > _EDGE)
        core = inked[len(inked) // 8 : -(len(inked) // 8) or None]
        aside = (sides[:, 1] - sides[:, 0]) / 2
        aside = np.interp(np.arange(len(spine)), core, aside[core])
        aside = ndimage.gaussian_filter1d(aside, _STEADY * 2 * half, mode="nearest")
        half = float(np.median(sides[core].sum(axis=1))) / 2
        # the line as a brush goes: a parabola, or in a long stroke parabolas of two widths each; straight past `core`
        line = spine + aside[:, None] * _normals(spine)
        first, last = float(core[0]), float(core[-1])
        knots = np.linspace(first, last, max(2, round((last - first) / (_PIECE * 2 * half)) + 1))
        knots = np.concatenate([knots[:1], knots[:1], knots, knots[-1:], knots[-1:]])
        spline = interpolate.make_lsq_spline(core, line[core], knots, 2)
        at = np.arange(len(line), dtype=np.float64)
        inside = np.clip(at, first, last)
        spine = _space_evenly(spline(inside) + spline.derivative()(inside) * (at - inside)[:, None], 1.0)
    return spine, half


def _normals(line: Array) -> Array:
    """(n, 2): to the right of the way, in pixels of a picture."""
    way = np.gradient(line, axis=0)
    way /= np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)[:, None]
    return np.asarray(way[:, ::-1] * [-1.0, 1.0])


def _space_evenly(line: Array, step: float) -> Array:
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.arange(0, along[-1] + 1e-9, step)
    return np.stack([np.interp(at, along, line[:, k]) for k in (0, 1)], axis=1)


def _unwrap_picture(picture: _Pixels, line: Array, half: float, rows: int, span: float = SPAN) -> _Pixels:
    """(rows, n[, 3]): a picture along a line, `span` half widths on either side; nothing beyond its rim."""
    across = ((np.arange(rows) + 0.5) / rows * 2 - 1) * span * half
    at = line + across[:, None, None] * _normals(line)
    x, y = (np.ascontiguousarray(at[..., k], dtype=np.float32) for k in (0, 1))
    taken = cv2.remap(picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(np.clip(taken, 0, 1), dtype=np.float32)
