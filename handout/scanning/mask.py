"""Which pixels are ink.

By default the exact minimum of a random field; hysteresis on the density is the fast way and as good on clean pages.

Source: seed 000, Appendix A and §5.1.2; handwriting specification §3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.cut import Weights, least_cut
from handout.scanning.density import Density
from handout.scanning.inks import Inks
from handout.scanning.page import Scan
from handout.scanning.smoothing import LEAST_WIDTH, smooth
from handout.summary import one_line

PENS = {
    "fineliner": Weights(8, 12, 64, 4),
    "pencil": Weights(8, 12, 64, 4),
    "ballpoint": Weights(4, 16, 24, 32),
    "fountain": Weights(4, 16, 24, 32),
}
METHODS = ("cut", "hysteresis")
LEAST_STROKE = 2.0  # pixels: below that width neither radius nor density can be read
_AROUND = 3  # pixels around possible ink that the cut decides too
_GRAINY, _PALE = 0.12, 0.45
_DUST = 0.05  # mm², the least that is taken for a full stop
_STREAK, _THIN = 0.5, 2.0  # of the page's side; mm
_RIM = 4.0  # mm: where the sheet's own edge may show


@dataclass(frozen=True, eq=False)
class Mask:
    """Ink and paper.

    ink : (h, w) bool.
    pen : the kind of pen whose weights were taken.
    stroke : usual width of a stroke, pixels.
    """

    ink: NDArray[np.bool_]
    pen: str
    stroke: float

    __repr__ = one_line


def find_mask(
    scan: Scan,
    inks: Inks,
    density: Density,
    pen: str | None = None,
    method: str = "cut",
    paint: NDArray[np.int8] | None = None,
    soften: int = 0,
) -> Mask:
    """Ink mask of a page whose light has been evened out.

    Parameters
    ----------
    scan, inks, density : Scan, Inks, Density
    pen : one of `PENS`, optional; otherwise told from the ink.
    method : "cut" or "hysteresis".
    paint : (h, w) int8, optional: 1 where the user painted ink, −1 paper, 0 nothing.
    soften : radius in pixels of a median on the density before the cut; for very grainy pages at 600 dpi.

    Raises
    ------
    InputError
        An unknown pen; strokes too thin for the resolution; nothing but specks.
    """
    if pen is not None and pen not in PENS:
        raise InputError(f"--pen {pen}: not known; choose one of {', '.join(PENS)}.")
    if method not in METHODS:
        raise ValueError(f"method {method!r} is not one of {METHODS}")
    pen = pen or guess_pen(inks)
    values = _softened(density.values, soften)
    ink = hysteresis(values, density)
    if method == "cut":
        weights = PENS[pen]
        ink = least_cut(scan.rgb, values, _domain(values, paint), weights, paint)
    elif paint is not None:
        ink = (ink | (paint > 0)) & ~(paint < 0)
    stroke = stroke_width(ink)
    ink = without_specks(ink, density, stroke, scan.dpi, paint)
    _check(ink, stroke, scan)
    return Mask(smooth(ink) if stroke >= LEAST_WIDTH else ink, pen, stroke)


def guess_pen(inks: Inks) -> str:
    """The pen that an ink looks like: grainy and pale a pencil, grainy a ballpoint, even a fineliner."""
    away = float(np.linalg.norm(inks.inks[0].colour - inks.paper))
    tint = float(np.ptp(inks.inks[0].colour - inks.paper))
    if inks.grain < _GRAINY:
        return "fineliner"
    return "pencil" if away / np.sqrt(3) < _PALE and tint < 0.05 else "ballpoint"


def hysteresis(values: NDArray[np.float32], density: Density) -> NDArray[np.bool_]:
    """(h, w) bool: pieces of possible ink that hold sure ink."""
    from skimage.filters import apply_hysteresis_threshold

    found = apply_hysteresis_threshold(values, density.perhaps, density.sure)  # type: ignore[no-untyped-call]
    return np.asarray(found)


def stroke_width(ink: NDArray[np.bool_]) -> float:
    """Usual width of strokes, pixels: twice the median distance of their middles from the edge; 0 without ink."""
    import cv2

    inside = np.asarray(cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)
    core = inside[1:-1, 1:-1] > 0
    for ahead, behind in ((inside[2:, 1:-1], inside[:-2, 1:-1]), (inside[1:-1, 2:], inside[1:-1, :-2])):
        core &= (inside[1:-1, 1:-1] >= ahead) & (inside[1:-1, 1:-1] >= behind)
    middle = inside[1:-1, 1:-1][core]
    return float(2 * np.mean(middle[_middle_half(middle)]) - 1) if len(middle) else 0.0


def _middle_half(values: NDArray[np.float32]) -> NDArray[np.bool_]:
    low, high = np.percentile(values, [25, 75])
    return np.asarray((values >= low) & (values <= high))


def without_specks(
    ink: NDArray[np.bool_], density: Density, stroke: float, dpi: float, paint: NDArray[np.int8] | None = None
) -> NDArray[np.bool_]:
    """The mask without dust: pieces with no sure ink, smaller than a full stop, or straight across half the page.

    A sheet that lies a little askew shows its edge round a corner of the picture: such a piece goes, too.

    Painted ink stays.
    """
    import cv2

    count, labels, stats, _ = cv2.connectedComponentsWithStats(ink.astype(np.uint8), connectivity=8)
    least = max(_DUST / 25.4**2 * dpi**2, 0.5 * np.pi / 4 * stroke**2)
    keep = stats[:, cv2.CC_STAT_AREA] >= least
    keep &= np.bincount(labels[density.values >= density.sure], minlength=count) > 0
    wide, tall = stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]
    thin = _THIN / 25.4 * dpi
    keep &= ~((wide > _STREAK * ink.shape[1]) & (tall < thin) | (tall > _STREAK * ink.shape[0]) & (wide < thin))
    long = (wide > _STREAK * ink.shape[1]) | (tall > _STREAK * ink.shape[0])
    if long[1:].any():
        rim = max(1, round(_RIM / 25.4 * dpi))
        within = np.bincount(labels[rim:-rim, rim:-rim].ravel(), minlength=count)
        keep &= ~(long & (within < 0.1 * stats[:, cv2.CC_STAT_AREA]))
    if paint is not None:
        keep[labels[paint > 0]] = True
    keep[0] = False
    return np.asarray(keep[labels])


def _softened(values: NDArray[np.float32], radius: int) -> NDArray[np.float32]:
    import cv2

    if radius <= 0:
        return values
    levels = np.rint(values * 127).astype(np.uint8)
    return np.asarray(cv2.medianBlur(levels, 2 * radius + 1), dtype=np.float32) / np.float32(127)


def _domain(values: NDArray[np.float32], paint: NDArray[np.int8] | None) -> NDArray[np.bool_]:
    import cv2

    inky = values > 0
    if paint is not None:
        inky |= paint > 0
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _AROUND + 1, 2 * _AROUND + 1))
    return np.asarray(cv2.dilate(inky.astype(np.uint8), kernel).astype(bool))


def _check(ink: NDArray[np.bool_], stroke: float, scan: Scan) -> None:
    if not ink.any():
        raise InputError(f"{scan.source} holds nothing but paper and specks: no strokes stand out from it.")
    if stroke < LEAST_STROKE:
        raise InputError(
            f"{scan.source}: strokes are {stroke:.1f} pixels wide, and need {LEAST_STROKE:g}: "
            "scan at a higher resolution (300 dpi, better 600)."
        )
