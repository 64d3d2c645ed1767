"""Ink segmented anew around what a person painted: one dab brings back a whole faint stroke, or takes a whole stain.

What was painted is hard evidence, and shows what is meant: how dark and of which colour.  Ink that is missing is looked
for along what hangs together with the dab and is as dark, at the share of the marked stroke's own contrast at which
strokes of usual ink begin (s = .30).  Ink that is none is told from the page's ink by contrast, colour and width in the
middle of each stroke: two classes with one covariance, the marks being of one, the rest of the window parted between
them in a few rounds.  A random field then decides as for whole pages, with marks that cannot be overruled, and only
what hangs together with the dab changes: the rest of the window stays as it was.

Source: Y. Boykov and M.-P. Jolly, Interactive graph cuts for optimal boundary and region segmentation, ICCV 2001
(marks as hard constraints, models learned from them); C. Rother, V. Kolmogorov and A. Blake, GrabCut, SIGGRAPH 2004
(the models learned again from what was parted); seed 000, §5.2 and Appendix A.  The classes and the limit to what
hangs together: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.scanning.graph_cut import field_cut
from handout.scanning.mask import PENS
from handout.scanning.matting import fill_smooth
from handout.values import Array

Bools = NDArray[np.bool_]
Floats = NDArray[np.float32]


@dataclass(frozen=True)
class ScribbleSettings:
    """How marks are understood; chosen with `benchmarks.painting` on simulated pages and seen on development scans."""

    zero: float = 0.30  # of a stroke's own contrast: where its edge is, as in `inks`
    noise: float = 3.0  # deviations of the paper by which the softened middle of what is marked must differ from it
    least: float = 0.04  # of the usual ink's contrast: what is paler is not seen by people, either
    soft: float = 0.5  # half widths: the Gaussian that calms the paper's grain
    hue: float = 0.7  # least cosine between the colour of what is marked and of what belongs to it
    plain: float = 2.0  # log-likelihood ratio from which something is of the kind that was marked, wherever it lies
    gap: float = 1.0  # half widths of nothing over which a faint stroke goes on
    reach: float = 1.5  # half widths within which a stroke's middle lies
    ground: float = 12.0  # half widths: structures of the paper wider than that are light or stains
    rounds: int = 4  # of parting the two classes
    # deviations that a class has at least: of contrast, of colour beside the way from paper to ink (shares of that
    # way), of the logarithm of a stroke's width
    steady: tuple[float, float, float, float] = (0.12, 0.04, 0.04, 0.35)
    most: float = 6.0  # of the log-likelihood ratio that counts
    stay: float = 1.0  # cost by pixel of ink that becomes paper where neither class is likelier


_SETTINGS = ScribbleSettings()
_WEIGHTS = PENS["ballpoint"]  # with those thin strokes stay


@dataclass(frozen=True, eq=False)
class PageWindow:
    """A part of a page, and what is known of it.

    rgb : (h, w, 3) uint8, as scanned.
    ink : (h, w) bool: the segmentation so far.
    usual : (3,) float, 0–255: the colour of the page's ink.
    half : half the usual width of a stroke, pixels.
    x_height : pixels.
    held : (h, w) bool: ink of letters that a person confirmed.
    """

    rgb: NDArray[np.uint8]
    ink: Bools
    usual: Array
    half: float
    x_height: float
    held: Bools

    def contrast(self) -> tuple[Floats, Array]:
        """(h, w, 3) the difference of each colour from the paper around it, and (3,) that of the page's ink."""
        # (h, w, 3) the paper: what lies around the ink, without anything as thin as a stroke
        hole = _grow_mask(self.ink, 2 * self.half).astype(np.uint8)
        filled = fill_smooth(self.rgb, hole)
        step = max(2, round(self.half))
        small = cv2.resize(filled, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_AREA)
        side = 2 * round(_SETTINGS.ground * self.half / step / 2) + 1
        calm = cv2.GaussianBlur(cv2.medianBlur(small, min(side, 255)), (0, 0), side / 4)
        paper = np.asarray(cv2.resize(calm, self.ink.shape[::-1], interpolation=cv2.INTER_LINEAR), dtype=np.float32)
        away = self.rgb.astype(np.float32) - paper
        return away, self.usual - np.median(paper.reshape(-1, 3), axis=0)


@dataclass(frozen=True, eq=False)
class SegmentedWindow:
    """A window segmented anew.  ink : (h, w) bool; seen : whether the scan shows anything where ink was painted."""

    ink: Bools
    seen: bool = True


def with_ink(window: PageWindow, scribble: Bools) -> SegmentedWindow:
    """The window with the faint stroke that a person painted ink on; where the scan shows nothing, the paint alone.

    scribble : (h, w) bool: surely ink.
    """
    away, usual = window.contrast()
    level = _soft(away @ (usual / (usual @ usual)).astype(np.float32), window.half)
    fresh = scribble & ~window.ink
    plain = ~_grow_mask(window.ink | scribble, window.half)
    deviation = 1.4826 * float(np.median(np.abs(level[plain]))) if plain.any() else 0.0
    darkest = float(np.percentile(level[fresh], 75)) if fresh.any() else 0.0
    if darkest < max(_SETTINGS.noise * deviation, _SETTINGS.least):
        return SegmentedWindow(window.ink | scribble, not fresh.any())
    middle = fresh & (level >= 0.75 * darkest)
    axis = np.median(away[middle], axis=0)
    size = float(axis @ axis)
    share = _soft(away @ (axis / size).astype(np.float32), window.half / 2)
    length = _soft(np.linalg.norm(away, axis=2).astype(np.float32), window.half / 2)
    alike = share * np.float32(np.sqrt(size)) >= _SETTINGS.hue * length
    own = np.maximum(_darkest(share, window.half), 1.0)
    density = (share / own - _SETTINGS.zero) / (1 - _SETTINGS.zero)
    floor = _SETTINGS.noise * deviation * np.sqrt(float(usual @ usual) / size)
    density[(share < floor) | ~alike] = 0
    open_ = ((density > 0) & ~window.ink) | scribble
    near = _pieces_under(_grow_mask(open_, _SETTINGS.gap * window.half / 2), scribble)
    domain = _grow_mask(open_ & near, 2.0)
    sure = (scribble | (window.ink & domain)).astype(np.int8)
    cost = np.where(density > 0, -_WEIGHTS.ink * np.minimum(density, 1), _WEIGHTS.paper)
    ink = field_cut(window.rgb, cost.astype(np.float32), domain, _WEIGHTS, sure)
    return SegmentedWindow(window.ink | ink)


def without_ink(window: PageWindow, scribble: Bools) -> Bools:
    """(h, w) bool: the ink of the window without what a person painted paper on, as far as that hangs together.

    scribble : (h, w) bool: surely paper.
    """
    marked = scribble & window.ink
    if not marked.any():
        return window.ink & ~scribble
    likelier = _likelier(window, marked)
    like = (window.ink & (likelier > _SETTINGS.plain)) | marked
    near = _in_line(window, like, scribble)
    near |= _pieces_under(_grow_mask(window.ink & (likelier > 0), window.half), scribble)
    domain = window.ink & _grow_mask(near & window.ink & ((likelier > 0) | marked), 2 * window.half)
    edge = domain & _grow_mask(window.ink & ~domain, 1.0)
    cost = np.where(window.ink, np.clip(likelier, -_SETTINGS.most, _SETTINGS.most) - _SETTINGS.stay, 0)
    sure = np.where(scribble, -1, np.where(edge | window.held, 1, 0)).astype(np.int8)
    gone = domain & ~field_cut(window.rgb, cost.astype(np.float32), domain, _WEIGHTS, sure)
    gone &= _pieces_under(_grow_mask(gone, 2 * window.half), scribble) | _in_line(window, gone, scribble)
    return window.ink & ~gone & ~scribble


def _in_line(window: PageWindow, like: Bools, scribble: Bools) -> Bools:
    """(h, w): the part of a mask that a dab means: what it touches, and its continuation beyond strokes across it.

    A rule, or the limb of a stain, is known by its direction; a round one has all directions alike.
    """
    found = like & _pieces_under(_grow_mask(like, window.half), scribble)
    grid: Array = np.indices(like.shape).astype(np.float64)
    y, x = grid[0], grid[1]
    for _ in range(_SETTINGS.rounds):
        places = np.column_stack([x[found], y[found]])
        if len(places) < 2:
            break
        mx, my = float(x[found].mean()), float(y[found].mean())
        dx, dy = np.linalg.eigh(np.cov(places.T))[1][:, 1].tolist()
        off = np.abs((places - [mx, my]) @ np.array([-dy, dx]))
        strip = np.abs((y - my) * dx - (x - mx) * dy) <= np.percentile(off, 95) + window.half
        reached = like & strip & _pieces_under(_grow_mask((like & strip) | found, window.x_height), scribble)
        if not (reached & ~found).any():
            break
        found |= reached
    return found


def _likelier(window: PageWindow, marked: Bools) -> Floats:
    """(h, w): how much likelier ink is of the kind that was marked than the page's, natural logarithm."""
    features = _features(window)
    flat = features[window.ink].astype(np.float64)
    is_ = marked[window.ink]
    page = np.array([1.0, 0.0, 0.0, float(np.median(flat[:, 3]))])  # the page's ink, whatever fills the window
    means = np.array([np.median(flat[is_], axis=0), page])
    other = np.zeros(len(flat), dtype=bool)
    ratio = np.zeros(len(flat))
    for _ in range(_SETTINGS.rounds):
        # (n,) log-likelihood ratio of two normal classes with one covariance
        off = flat - means[np.where((is_ | other), 0, 1)]
        spread = np.clip(np.median(np.abs(off), axis=0) * 1.4826, _SETTINGS.steady, None)
        away = ((flat[None] - means[:, None]) / spread) ** 2
        ratio = np.asarray((away[1] - away[0]).sum(axis=1) / 2)
        other = ratio > 0
        for k, some in enumerate((is_ | other, ~(is_ | other))):
            if some.any():
                # the marks count half of their class, and the page's ink half of its own: neither is given away
                means[k] = (means[k] + np.median(flat[some], axis=0)) / 2
    found = np.zeros(window.ink.shape, dtype=np.float32)
    found[window.ink] = ratio
    return found


def _features(window: PageWindow) -> Floats:
    """(h, w, 4): contrast and colour of the middle of the stroke that a pixel is of, and the logarithm of its width.

    Colour is how far it lies beside the way from paper to ink, in two directions, as a share of that way.
    """
    away, usual = window.contrast()
    size = float(usual @ usual)
    level = _soft(away @ (usual / size).astype(np.float32), window.half / 2)
    middle = _darkest(np.where(window.ink, level, 0).astype(np.float32), window.half)
    own = np.where(level >= _SETTINGS.zero * middle, middle, level)
    weight = np.where(window.ink, np.clip(level, 0, None) ** 2, 0).astype(np.float32)
    deviation = _SETTINGS.reach * window.half
    total = np.maximum(cv2.GaussianBlur(weight, (0, 0), deviation), 1e-6)
    off = away - level[:, :, None] * usual.astype(np.float32)
    tint = cv2.GaussianBlur(off * weight[:, :, None], (0, 0), deviation) / total[:, :, None]
    across = np.linalg.svd(usual[None] / np.sqrt(size))[2][1:] / np.sqrt(size)
    inside = cv2.distanceTransform(window.ink.astype(np.uint8), cv2.DIST_L2, 5)
    width = np.log2(np.maximum(_darkest(np.asarray(inside, dtype=np.float32), 2 * window.half), 0.5) / window.half)
    return np.dstack([own, tint @ across.T.astype(np.float32), width]).astype(np.float32)


def _soft(values: Floats, half: float) -> Floats:
    return np.asarray(cv2.GaussianBlur(values, (0, 0), max(_SETTINGS.soft * half, 0.3)), dtype=np.float32)


def _darkest(values: Floats, half: float) -> Floats:
    """(h, w): the greatest value within a stroke's reach."""
    size = 2 * max(1, round(_SETTINGS.reach * half)) + 1
    return np.asarray(
        cv2.dilate(values, np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), dtype=np.uint8)),
        dtype=np.float32,
    )


def _grow_mask(mask: Bools, by: float) -> Bools:
    if not mask.any():
        return mask
    # of wide discs a dilation takes a hundred times as long
    return np.asarray(cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5) <= max(1.0, by))


def _pieces_under(mask: Bools, places: Bools) -> Bools:
    """The pieces of a mask (h, w) that lie under some places."""
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    under = np.zeros(count, dtype=bool)
    under[labels[places & mask]] = True
    under[0] = False
    return np.asarray(under[labels])
