"""The colours of a page: its paper, its inks, and the axes along which ink is told from paper.

Source: seed 000, §5.1.1; core colour of ink and several inks: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.hues import kinds
from handout.libraries import cv2
from handout.scanning.checks import blank_page
from handout.scanning.scan import Scan
from handout.values import Array


@dataclass(frozen=True)
class InkSettings:
    """How ink is told from paper; chosen on six real pages (docs/bibliography.md)."""

    bins: int = 32  # cells a channel of the histogram of colours, narrower than the kernel of the mean shift
    kernel: float = 0.05  # of the mean shift, in colour
    contrast: float = 0.12  # least distance of ink from paper
    share: float = 0.004  # of the strokes, for an ink to count
    as_dark: float = 0.6  # of the commonest ink's contrast, for another to count: a paler one is what shines through
    enough: int = 200  # pixels of strokes


_INK = InkSettings()


@dataclass(frozen=True, eq=False)
class PageInk:
    """One ink of a page.

    colour : (3,) float, 0–1: the usual colour in the middle of strokes.
    axis : (3,) float: (c − paper)·axis is the share s of ink in a colour c: 0 for paper, 1 for `colour`.
    share : its part of the strokes of the page.
    zero : s up to which there is no ink; chosen on six real pages (docs/bibliography.md).
    """

    colour: Array
    axis: Array
    share: float = 1.0
    zero: float = 0.30


@dataclass(frozen=True, eq=False)
class PageInks:
    """The paper and the inks of a page, the commonest first.

    paper : (3,) float, 0–1.
    grain : how much the middle of strokes varies: standard deviation of the share of ink along them.
    """

    paper: Array
    inks: tuple[PageInk, ...]
    grain: float

    def levels(self, rgb: Array) -> Array:
        """(…, k) float: the level q = (s − zero)/(1 − zero) of every ink for colours (…, 3) in 0–1."""
        away = np.asarray(rgb) - self.paper
        q = [(away @ ink.axis - ink.zero) / (1 - ink.zero) for ink in self.inks]
        return np.stack(q, axis=-1)


def find_inks(scan: Scan) -> PageInks:
    """The colours of a page whose light has been evened out.

    Raises InputError: nothing but paper.

    Source: seed 000, §5.1.1; the colour of ink is that of the middle of strokes, not the second mode.
    """
    paper = paper_mode(scan)
    # (h, w) float32: distance from the paper's colour, a little blurred
    away = np.empty(scan.shape, dtype=np.float32)
    ground = paper.astype(np.float32) * 255
    for start in range(0, scan.shape[0], 512):
        part = scan.rgb[start : start + 512].astype(np.float32) - ground
        away[start : start + 512] = np.linalg.norm(part, axis=2) / 255
    away = np.asarray(cv2.GaussianBlur(away, (0, 0), 1.0, dst=away))
    core, threshold = _cores(away)
    if int(core.sum()) < _INK.enough or threshold < 0.4 * _INK.contrast:
        raise blank_page(scan)
    colours = scan.rgb[core] / 255.0
    if len(colours) < _INK.enough or float(np.median(np.linalg.norm(colours - paper, axis=1))) < _INK.contrast:
        raise blank_page(scan)
    return PageInks(paper, *_told_apart(colours, paper))


def paper_mode(scan: Scan) -> Array:
    """(3,) float: the commonest colour, by mean shift.

    Source: seed 000, §5.1.1: Gaussian kernel, here on a histogram of 32³ colours of every fourth pixel.
    """
    # the mean colour and the count of every occupied cell of 32³
    flat = scan.rgb[::2, ::2].reshape(-1, 3)
    cell = (flat >> 3).astype(np.int32) @ np.array([_INK.bins * _INK.bins, _INK.bins, 1], dtype=np.int32)
    counts = np.bincount(cell, minlength=_INK.bins**3).astype(np.float64)
    sums = [np.bincount(cell, flat[:, k], minlength=_INK.bins**3) for k in range(3)]
    occupied = counts > 0
    colours = np.stack(sums, axis=1)[occupied] / counts[occupied, None] / 255
    counts = counts[occupied]
    mode = colours[np.argmax(counts)]
    for _ in range(100):
        weight = counts * np.exp(-((colours - mode) ** 2).sum(axis=1) / (2 * _INK.kernel**2))
        step = weight @ colours / weight.sum() - mode
        mode = mode + step
        if np.abs(step).max() < 1e-4:
            break
    return np.asarray(mode)


def _cores(away: NDArray[np.float32]) -> tuple[NDArray[np.bool_], float]:
    """The middles of strokes: above Otsu's threshold and greatest across or down the page."""
    from skimage.filters import threshold_otsu

    dark = away[away > 0.08]
    if len(dark) < _INK.enough:
        return np.zeros(away.shape, dtype=bool), 0.0
    threshold = float(threshold_otsu(dark, nbins=128))  # type: ignore[no-untyped-call]
    core = away > threshold
    greatest = np.zeros(away.shape, dtype=bool)
    greatest[1:-1] = away[1:-1] >= np.maximum(away[:-2], away[2:])
    core[:, 1:-1] &= (away[:, 1:-1] >= np.maximum(away[:, :-2], away[:, 2:])) | greatest[:, 1:-1]
    return core, threshold


def _told_apart(colours: Array, paper: Array) -> tuple[tuple[PageInk, ...], float]:
    """The inks of a page from the colours of its strokes, and their grain."""
    colours = colours[:: max(1, len(colours) // 40_000)]
    away = colours - paper
    size = np.linalg.norm(away, axis=1)
    kind = kinds(away / np.maximum(size, 1e-9)[:, None], _INK.share)
    share = np.bincount(kind) / len(kind)
    inks: list[PageInk] = []
    grain: list[float] = []
    for k in np.argsort(-share):
        members = colours[kind == k]
        if share[k] < _INK.share or len(members) < _INK.enough / 2:
            continue
        colour = np.median(members, axis=0)
        if inks and np.linalg.norm(colour - paper) < _INK.as_dark * np.linalg.norm(inks[0].colour - paper):
            continue
        axis = (colour - paper) / ((colour - paper) @ (colour - paper))
        inks.append(PageInk(colour, axis, float(share[k])))
        grain.append(float(np.std((members - paper) @ axis)))
    return tuple(inks), grain[0]
