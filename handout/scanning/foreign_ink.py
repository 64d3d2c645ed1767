"""Ink that is not the page's: what a later hand wrote or stamped on it, told by its colour; and pale marks.

The colour of ink is compared as its optical density, in which a thin line and a thick one of one pen point the same
way.  It is meaned along stretches of line, as a single pixel at the edge of a stroke tells little.

Source: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches
from handout.scanning.inks import PageInks
from handout.scanning.mask import Mask
from handout.scanning.scan import Scan
from handout.values import LineGraph


@dataclass(frozen=True)
class ForeignInkSettings:
    """Measured on a page with a stamp and a note, 19–30° from its ink, and on two real ones, 99.9 % within 9° of it."""

    apart: float = 14.0  # degrees between the directions of the densities of two inks
    run: int = 25  # vertices of line that are meaned
    blur: float = 1.0  # pixels, deviation
    darkest: float = 2.0  # of 255: light below that is counted as that
    pale: float = 0.12  # share of ink from which a mark is seen, where less than the page's zero ink lies
    around: float = 0.4  # mm around ink that is the ink's own
    dpi: float = 100.0  # at which pale marks are looked for


_SETTINGS = ForeignInkSettings()


def foreign_ink(graph: LineGraph, scan: Scan, paper: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n,) which vertices of a page's line have ink of another colour than most.

    paper : (3,) 0–1, the paper's colour.
    """
    import cv2

    if not len(graph):
        return np.zeros(0, dtype=bool)
    column, row = np.rint(graph.uv).astype(np.intp).T
    column, row = column.clip(0, scan.shape[1] - 1), row.clip(0, scan.shape[0] - 1)
    soft = cv2.GaussianBlur(scan.rgb, (0, 0), _SETTINGS.blur)[row, column].astype(np.float64)
    density = -np.log(np.maximum(soft, _SETTINGS.darkest) / np.maximum(255 * paper, _SETTINGS.darkest))
    usual = _unit(np.median(_unit(density), axis=0))
    foreign = np.zeros(len(graph), dtype=bool)
    for path in branches(graph.edges, len(graph)):
        for start in range(0, len(path), _SETTINGS.run):
            run = path[start : start + _SETTINGS.run]
            foreign[run] = _unit(density[run].sum(axis=0)) @ usual < np.cos(np.radians(_SETTINGS.apart))
    return foreign


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))


def pale_marks(level: Scan, inks: PageInks, mask: Mask) -> float:
    """How much of a page has marks too pale for its ink, as a share of what has ink; 0 on ruled paper.

    level : the page, its light evened out.
    """
    import cv2

    if inks.ruling is not None or not mask.ink.any():
        return 0.0
    part = min(1.0, _SETTINGS.dpi / level.dpi)
    size = (max(1, round(level.shape[1] * part)), max(1, round(level.shape[0] * part)))
    small = cv2.resize(level.rgb, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    inked = np.asarray(cv2.resize(mask.ink.astype(np.uint8) * 255, size, interpolation=cv2.INTER_AREA)) > 0
    reach = 2 * max(1, round(_SETTINGS.around / 25.4 * level.dpi * part)) + 1
    near = cv2.dilate(inked.astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0
    share = (small - inks.paper.astype(np.float32)) @ inks.inks[0].axis.astype(np.float32)
    return float(((share > _SETTINGS.pale) & ~near).sum() / inked.sum())
