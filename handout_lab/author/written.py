"""The picture of a written sheet, layer by layer: the paper, the same with ink, and the picture with dust and noise.

A printed sheet is scanned by `Flatbed.scan`: that knows its spectra at the printer's resolution and bends it.  Here the
ink is drawn on the glass at the picture's own resolution, so that the truth about every pixel is exact; warp, flare,
glare and what a scanner's program does by itself are left out.  Both lay the sheet, blur, scatter and show light alike.
The lamp here is a polynomial and not cosines: the scanned hands that ship were made with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.simulated.flatbed import (
    ROWS,
    GlassPlacement,
    Lamp,
    add_noise,
    blur_rows,
    lamp,
    reach,
)
from handout_lab.author.worn_flatbed import WornFlatbed

Floats = NDArray[np.float32]

FULL = np.iinfo(np.uint16).max  # light that ink lets pass is kept in shares of this
_SEEN = 6.0  # mm of the shadow beside a sheet
_DEPTH = 1.1  # mm: the shadow's, which falls off as exp(−d / depth); set by eye beside real scans


def ground(place: GlassPlacement, paper: NDArray[np.uint8], flatbed: WornFlatbed) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: what lies on the glass: the paper (h', w', 3), turned, and the lid with the sheet's shadow."""
    import cv2

    lid = round(255 * flatbed.lid)
    unit = 25.4 / place.dpi
    margin = max(2, round(_SEEN / unit))
    height, width = paper.shape[:2]
    around = np.full((height + 2 * margin, width + 2 * margin, 3), lid, dtype=np.uint8)
    _shade(around, margin, unit, flatbed)
    around[margin:-margin, margin:-margin] = paper
    matrix = place.to_glass.copy()
    # places of pixels (their middles) on the padded sheet to those on the glass
    matrix[:, 2] = matrix[:, 2] / unit - 0.5 + matrix[:, :2] @ np.full(2, 0.5 - margin)
    size = (place.shape[1], place.shape[0])
    kind = cv2.INTER_CUBIC if np.abs(matrix - np.round(matrix)).max() > 1e-9 else cv2.INTER_NEAREST
    turned = cv2.warpAffine(
        around, matrix, size, flags=kind, borderMode=cv2.BORDER_CONSTANT, borderValue=(lid, lid, lid)
    )
    return np.asarray(turned, dtype=np.uint8)


def _shade(around: NDArray[np.uint8], margin: int, unit: float, flatbed: WornFlatbed) -> None:
    """The shadow of the sheet's edge on the lid, which is a little further away than the glass."""
    away = (np.arange(margin) + 0.5)[::-1] * unit
    light = 255 * flatbed.lid * (1 - flatbed.shadow * np.exp(-away / _DEPTH))
    ring = np.rint(light).astype(np.uint8)
    for i, value in enumerate(ring.tolist()):
        around[i : len(around) - i, [i, -1 - i]] = value
        around[[i, -1 - i], i : around.shape[1] - i] = value


@dataclass(frozen=True, eq=False)
class Rows:
    """Some rows of a picture, (n, w, 3) float32 in 0–1, after the tone curve.

    start : the first row.
    picture : as the scanner shows it; sheet : without ink, dust and noise; inked : without dust and noise.
    """

    start: int
    picture: Floats
    sheet: Floats
    inked: Floats


def layers(
    place: GlassPlacement,
    paper: NDArray[np.uint8],
    light: NDArray[np.uint16],
    specks: Floats | None,
    flatbed: WornFlatbed,
    rng: np.random.Generator,
) -> Iterator[Rows]:
    """Scan, some rows at a time.

    Parameters
    ----------
    paper : (h, w, 3) uint8, paper and lid as `ground` gives them.
    light : (h, w, 3) uint16, what the ink over it lets pass, of `FULL`.
    specks : (h, w) float32 in 0–1, light that dust on the glass lets pass; None: no dust.
    """
    height, width = paper.shape[:2]
    blur = flatbed.optics(place.dpi)
    halo = reach(blur)
    lamp = _lamp(flatbed, rng)
    columns, lines = (np.linspace(-1, 1, size, dtype=np.float32) for size in (width, height))
    for start in range(0, height, ROWS):
        stop = min(start + ROWS, height)
        rows = np.clip(np.arange(start - halo, stop + halo), 0, height - 1)
        cut = slice(halo, halo + stop - start)
        lit = lamp(columns, lines[start:stop])[:, :, None]
        bare = paper[rows].astype(np.float32) * np.float32(1 / 255)
        inked = bare * (light[rows] * np.float32(1 / FULL))
        sheet = blur_rows(bare, blur)[cut] * lit
        shown = blur_rows(inked, blur)[cut] * lit
        dusty = shown if specks is None else blur_rows(inked * specks[rows][:, :, None], blur)[cut] * lit
        noisy = add_noise(dusty, flatbed.noise, rng)
        yield Rows(start, flatbed.show_light(noisy), flatbed.show_light(sheet), flatbed.show_light(shown))


def _lamp(flatbed: WornFlatbed, rng: np.random.Generator) -> Lamp:
    """The lamp over a picture, places counted −1 to 1: it falls off along a random direction."""
    w = rng.normal(0.0, [1.0, 1.0, 0.6, 0.6, 0.4])
    u = np.linspace(-1, 1, 33)

    def field(x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.floating]:
        x, y = x[None, :], y[:, None]
        return np.asarray(w[0] * x + w[1] * y + w[2] * x * x + w[3] * y * y + w[4] * x * y)

    return lamp(flatbed.shading, field, field(u, u))
