"""The colours of a page: its paper, its inks, and the axes along which ink is told from paper and from printed ruling.

Printed rules and squares are found so that the axis of an ink can be laid past their colour.  They are not removed:
taking lines out of a page would cut the letters that cross them.

Source: seed 000, §5.1.1; core colour of ink, several inks and ruled paper: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.hues import kinds
from handout.scanning.checks import blank_page
from handout.scanning.scan import Scan
from handout.values import Array


@dataclass(frozen=True)
class InkSettings:
    """How ink is told from paper; chosen on six real pages (docs/bibliography.md)."""

    bins: int = 32  # cells a channel of the histogram of colours, narrower than the kernel of the mean shift
    kernel: float = 0.05  # of the mean shift, in colour
    contrast: float = 0.12  # least distance of ink from paper
    zero: float = 0.30  # the share of ink that counts as none, on plain paper
    above_ruling: float = 0.03  # how far over the ruling zero ink lies
    highest_zero: float = 0.65  # a higher zero would cost letters
    share: float = 0.004  # of the strokes, for an ink to count
    as_dark: float = 0.6  # of the commonest ink's contrast, for another to count: a paler one is what shines through
    stiff: float = 2e-3  # variance of colour that every axis has to bear
    stretch: float = 0.05  # level of ruling that a unit of the axis' length costs
    enough: int = 200  # pixels of strokes


_INK = InkSettings()


@dataclass(frozen=True)
class RulingSettings:
    """What counts as printed ruling; chosen on the same pages."""

    run: float = 6.0  # mm of straight line: no stroke of a letter is so long and so level
    least_contrast: float = 0.10  # of the contrast of ink: fainter lines need no care
    lines: float = 4.0  # ruled lines as long as the page is wide, together


_RULING = RulingSettings()


@dataclass(frozen=True, eq=False)
class PageInk:
    """One ink of a page.

    colour : (3,) float, 0–1: the usual colour in the middle of strokes.
    axis : (3,) float: (c − paper)·axis is the share s of ink in a colour c: 0 for paper, 1 for `colour`.
    zero : s up to which there is no ink.
    share : its part of the strokes of the page.
    ruled : s that 99 % of the ruling stays under, 0 on plain paper.
    """

    colour: Array
    axis: Array
    zero: float
    share: float = 1.0
    ruled: float = 0.0


@dataclass(frozen=True, eq=False)
class PageInks:
    """The paper and the inks of a page, the commonest first.

    paper : (3,) float, 0–1.
    grain : how much the middle of strokes varies: standard deviation of the share of ink along them.
    ruling : (h, w) bool or None: where printed lines are.
    """

    paper: Array
    inks: tuple[PageInk, ...]
    grain: float
    ruling: NDArray[np.bool_] | None = None

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
    import cv2

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
    contrast = float(np.median(away[core]))
    ruling = find_ruling(scan, paper.astype(np.float32), contrast)
    if ruling is not None:
        core = core & ~_wider(ruling, scan.pixels(0.13))
        ruled = scan.rgb[ruling & ~_wider(core, scan.pixels(0.5))][::5] / 255.0
        # the ruling itself: where writing or an underline lies on it the colours are others
        off = np.abs(ruled - np.median(ruled, axis=0))
        ruled = ruled[(off / np.maximum(np.median(off, axis=0), 1 / 255)).max(axis=1) <= 5.0]
    else:
        ruled = np.zeros((0, 3))
    colours = scan.rgb[core] / 255.0
    if len(colours) < _INK.enough or float(np.median(np.linalg.norm(colours - paper, axis=1))) < _INK.contrast:
        raise blank_page(scan)
    # the covariance (3, 3) of the paper's colour
    plain = away[::4, ::4] < 0.08
    rest = scan.rgb[::4, ::4][plain] / 255.0 - paper
    noise = np.asarray(rest.T @ rest / max(1, len(rest)) + 1e-4 * np.eye(3))
    inks, grain = _told_apart(colours, paper, noise, ruled)
    return PageInks(paper, inks, grain, ruling)


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


def _wider(mask: NDArray[np.bool_], by: float) -> NDArray[np.bool_]:
    """The mask grown by so many pixels to every side."""
    import cv2

    size = 2 * max(1, round(by)) + 1
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)).astype(bool))


def _told_apart(colours: Array, paper: Array, noise: Array, ruled: Array) -> tuple[tuple[PageInk, ...], float]:
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
        axis, level = _axis(colour, paper, noise, ruled)
        if inks and level > _INK.highest_zero:
            continue  # it cannot be told from the ruling
        zero = float(np.clip(level + _INK.above_ruling, _INK.zero, _INK.highest_zero))
        inks.append(PageInk(colour, axis, zero, float(share[k]), level))
        grain.append(float(np.std((members - paper) @ axis)))
    return tuple(inks), grain[0]


def _axis(colour: Array, paper: Array, noise: Array, ruled: Array) -> tuple[Array, float]:
    """The axis on which this ink stands out, and the level of the ruling on it.

    On plain paper the straight line from paper to ink.  On ruled paper the one of five on which the ruling reaches
    least: that line, the channels, and the one that makes noise and ruling together least for an ink of 1.  A long
    axis stretches small differences of colour, and a scanner's colour is coarser than its light: it must be worth it.
    """
    away = colour - paper
    straight = away / (away @ away)
    if not len(ruled):
        return straight, 0.0
    rules = ruled - paper
    calm = np.linalg.solve(noise + rules.T @ rules / len(rules) + _INK.stiff * np.eye(3), away)
    candidates = [straight, calm / (away @ calm)]
    candidates += [np.eye(3)[k] / away[k] for k in range(3) if abs(away[k]) > 0.5 * np.abs(away).max()]
    levels = [float(np.percentile(rules @ axis, 99)) for axis in candidates]
    costs = [level + _INK.stretch * float(np.linalg.norm(axis)) for level, axis in zip(levels, candidates, strict=True)]
    best = int(np.argmin(costs))
    return candidates[best], levels[best]


def find_ruling(scan: Scan, colour: NDArray[np.float32], contrast: float) -> NDArray[np.bool_] | None:
    """Where printed lines are, (h, w) bool, or None on plain paper.

    Parameters
    ----------
    scan : evened out.
    colour : (3,) float, the paper's.
    contrast : the distance of ink from paper in colour, 0–√3.
    """
    import cv2

    marked = np.zeros(scan.shape, dtype=np.uint8)
    for start in range(0, scan.shape[0], 512):
        part = scan.rgb[start : start + 512].astype(np.float32) / 255 - colour
        marked[start : start + 512] = np.linalg.norm(part, axis=2) > _RULING.least_contrast * contrast
    run = max(15, round(scan.pixels(_RULING.run)))
    ruling = np.zeros_like(marked)
    for shape in ((run, 1), (1, run)):
        kernel = np.ones(shape[::-1], dtype=np.uint8)
        lines = np.asarray(cv2.morphologyEx(marked, cv2.MORPH_OPEN, kernel), dtype=np.uint8)
        # whether long runs lie on many rows of the page, as ruling does and a few underlines do not
        covered = (lines > 0).mean(axis=(1 if shape[0] > 1 else 0))
        # thickness does not count: the strongest row of every 2 % of the page stands for it
        blocks = np.array([block.max() for block in np.array_split(covered, 50)])
        if bool(blocks[blocks > 0.25].sum() > _RULING.lines):
            ruling |= lines
    return ruling.astype(bool) if ruling.any() else None
