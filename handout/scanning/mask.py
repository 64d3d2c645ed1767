"""Which pixels are ink: the exact minimum of a random field.  Quicker, and as good on clean pages, is hysteresis.

The edge of the ink of rough pencils and wide pens is then smoothed along the line; that of thin pens is not.

Source: seed 000, Appendices A and B, §5.1.2; in eq. 14 the sign is corrected: a neighbour at offset n̄ stands n̂·n̄
higher in the field, so that its estimate of this pixel is s_j − n̂·n̄.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.libraries import cv2
from handout.scanning.checks import refuse_bad_strokes
from handout.scanning.density import Density
from handout.scanning.graph_cut import Weights, least_cut
from handout.scanning.inks import PageInks
from handout.scanning.scan import Scan
from handout.summary import one_line

PENS = {
    "fineliner": Weights(8, 12, 64, 4),
    "pencil": Weights(8, 12, 64, 4),
    "ballpoint": Weights(4, 16, 24, 32),
    "fountain": Weights(4, 16, 24, 32),
}
_AROUND = 3  # pixels around possible ink that the cut decides too
_GRAINY, _PALE = 0.12, 0.45
_DUST = 0.05  # mm², the least that is taken for a full stop
_STREAK, _THIN = 0.5, 2.0  # of the page's side; mm
_RIM = 4.0  # mm: where the sheet's own edge may show
LEAST_WIDTH = 6.0  # pixels: thinner lines are broken, not smoothed
_DX = np.array([-1, 0, 1, 1, 1, 0, -1, -1], dtype=np.int32)  # around the pixel, each adjacent to the next
_DY = np.array([-1, -1, -1, 0, 1, 1, 1, 0], dtype=np.int32)
_UNIT = (np.stack([_DX, _DY], axis=1) / np.hypot(_DX, _DY)[:, None]).astype(np.float32)
# Batcher's odd-even merge sort of eight
_NETWORK = (
    (0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (1, 2), (5, 6),
    (0, 4), (1, 5), (2, 6), (3, 7), (2, 4), (3, 5), (1, 2), (3, 4), (5, 6),
)  # fmt: skip
_BAND = 2.5  # pixels from the edge


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


def find_mask(scan: Scan, inks: PageInks, density: Density, pen: str | None = None) -> Mask:
    """Ink mask of a page whose light has been evened out.

    pen : one of `PENS`, optional; otherwise told from the ink.

    Raises InputError: an unknown pen; strokes too thin for the resolution; nothing but specks.
    """
    if pen is not None and pen not in PENS:
        raise InputError(f"--pen {pen}: not known; choose one of {', '.join(PENS)}.")
    pen = pen or guess_pen(inks)
    ink = cut_ink(scan, density, PENS[pen])
    stroke = stroke_width(ink)
    ink = without_specks(ink, density, stroke, scan.dpi)
    refuse_bad_strokes(bool(ink.any()), stroke, scan.source)
    return Mask(smooth(ink) if stroke >= LEAST_WIDTH else ink, pen, stroke)


def cut_ink(scan: Scan, density: Density, weights: Weights) -> NDArray[np.bool_]:
    """(h, w) bool: the ink of least cost, looked for where there may be any and a little around."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _AROUND + 1, 2 * _AROUND + 1))
    domain = np.asarray(cv2.dilate((density.values > 0).astype(np.uint8), kernel).astype(bool))
    return least_cut(scan.rgb, density.values, domain, weights)


def guess_pen(inks: PageInks) -> str:
    """The pen that an ink looks like: grainy and pale a pencil, grainy a ballpoint, even a fineliner."""
    away = float(np.linalg.norm(inks.inks[0].colour - inks.paper))
    tint = float(np.ptp(inks.inks[0].colour - inks.paper))
    if inks.grain < _GRAINY:
        return "fineliner"
    return "pencil" if away / np.sqrt(3) < _PALE and tint < 0.05 else "ballpoint"


def hysteresis(values: NDArray[np.float32], density: Density) -> NDArray[np.bool_]:
    """(h, w) bool: pieces of possible ink that hold sure ink."""
    from skimage.filters import apply_hysteresis_threshold

    ink = apply_hysteresis_threshold(values, density.perhaps, density.sure)  # type: ignore[no-untyped-call]
    return np.asarray(ink)


def stroke_width(ink: NDArray[np.bool_]) -> float:
    """Usual width of strokes, pixels: twice the median distance of their middles from the edge; 0 without ink."""
    inside = np.asarray(cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)
    core = inside[1:-1, 1:-1] > 0
    for ahead, behind in ((inside[2:, 1:-1], inside[:-2, 1:-1]), (inside[1:-1, 2:], inside[1:-1, :-2])):
        core &= (inside[1:-1, 1:-1] >= ahead) & (inside[1:-1, 1:-1] >= behind)
    middle = inside[1:-1, 1:-1][core]
    if not len(middle):
        return 0.0
    low, high = np.percentile(middle, [25, 75])
    return float(2 * np.mean(middle[(middle >= low) & (middle <= high)]) - 1)


def without_specks(ink: NDArray[np.bool_], density: Density, stroke: float, dpi: float) -> NDArray[np.bool_]:
    """The mask without dust: pieces with no sure ink, smaller than a full stop, or straight across half the page.

    A sheet that lies a little askew shows its edge round a corner of the picture: such a piece goes, too.
    """
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
    keep[0] = False
    return np.asarray(keep[labels])


def smooth(mask: NDArray[np.bool_], passes: int = 2) -> NDArray[np.bool_]:
    """The mask (h, w) with its edges smoothed along the line.

    Only for lines at least `LEAST_WIDTH` wide; the caller decides.
    """
    field = np.pad(signed_distance(mask), 1, mode="edge")
    near = np.abs(field) < _BAND
    near[[0, -1]] = near[:, [0, -1]] = False
    where = np.flatnonzero(near)
    flat = field.ravel()
    for _ in range(passes):
        new = flat.copy()
        for start in range(0, len(where), 200_000):
            part = where[start : start + 200_000]
            new[part] = _estimate(flat, part, field.shape[1])
        flat = new
    return np.asarray(flat.reshape(field.shape)[1:-1, 1:-1] <= 0)


def signed_distance(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(h, w) float32: distance from the edge of the ink, pixels, negative inside."""
    ink = mask.astype(np.uint8)
    inside = cv2.distanceTransform(ink, cv2.DIST_L2, 5)
    outside = cv2.distanceTransform(1 - ink, cv2.DIST_L2, 5)
    return np.where(mask, 0.5 - inside, outside - 0.5).astype(np.float32)


def _estimate(flat: NDArray[np.float32], where: NDArray[np.intp], width: int) -> NDArray[np.float32]:
    """New values (n,) at `where`: by the direction, of eight, on which the neighbours agree best."""
    around = np.stack([flat[where + step] for step in _DY * width + _DX])
    rise = (around - flat[where]) / np.hypot(_DX, _DY).astype(np.float32)[:, None]
    best = np.full(len(where), np.inf, dtype=np.float32)
    value = flat[where].copy()
    for k in range(8):
        pair = rise[[k, k - 7]]
        size = [_UNIT[[k, k - 7], axis] @ pair for axis in (0, 1)]
        length = np.hypot(*size)
        steep = length > 1e-3
        x, y = (part / np.maximum(length, 1e-3) for part in size)
        guess = [around[j] - (x * np.float32(_DX[j]) + y * np.float32(_DY[j])) for j in range(8)]
        middle = _median_of_eight(guess)
        disagree = _median_of_eight([np.abs(estimate - middle) for estimate in guess])
        better = steep & (disagree < best)
        best[better], value[better] = disagree[better], middle[better]
    return value


def _median_of_eight(values: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Median of eight arrays, element by element: a sorting network is ten times as fast as sorting."""
    row = list(values)
    for i, j in _NETWORK:
        row[i], row[j] = np.minimum(row[i], row[j]), np.maximum(row[i], row[j])
    return np.asarray((row[3] + row[4]) * np.float32(0.5))
