"""The picture of a printed sheet: place, warp, flare, lamp, glare, dust, optics, sensor, tone curve.

All that happens before the tone curve is linear in light.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.simulated.flatbed import (
    ROWS,
    FlatbedSettings,
    GlassPlacement,
    Lamp,
    add_noise,
    blur_rows,
    dust,
    kernels,
    lamp,
    lay,
    reach,
    smooth_field,
)
from handout.simulated.spectra import SimulatedSheet
from handout.values import Array, Page

Floats = NDArray[np.float32]
Picture = NDArray[np.uint8 | np.uint16]

_DPI = (50.0, 1200.0)  # that flatbeds have
# flare, glare and what automatic programs aim at: set by eye, for tests of what names them
_FLARE = 8.0  # mm, how far flare reaches (standard deviation)
_FLARE_DPI = 25.4  # pixels of its field: a millimetre
_STREAK = 12.0  # mm, half the width of glare
_TAIL = 0.2  # per cent of the pixels that automatic levels give up at either end
_MIDDLE = 0.55  # to which automatic gamma brings the mean


class Flatbed(FlatbedSettings):
    """A simulated flatbed, which scans printed sheets; what it is like: see `FlatbedSettings`."""

    def scan(self, sheet: SimulatedSheet, dpi: float, rng: np.random.Generator) -> Picture:
        """The picture of a printed sheet: see `scan` of this file."""
        return scan(sheet, dpi, self, rng)


def scan(sheet: SimulatedSheet, dpi: float, flatbed: FlatbedSettings, rng: np.random.Generator) -> Picture:
    """(h, w, 3) uint8, or uint16 with 16 bits: the picture of a printed sheet at `dpi` pixels an inch.

    The same state of `rng` lays the sheet, its warp, its dust and the lamp alike at any resolution.

    Raises InputError: a resolution outside 50–1200 dpi, or a crop that leaves nothing.
    """
    import cv2

    if not _DPI[0] <= dpi <= _DPI[1]:
        raise InputError(f"flatbed: {dpi:g} dpi is outside {_DPI[0]:g} to {_DPI[1]:g}.")
    place = lay(sheet.page, dpi, flatbed, rng)
    lamp = _lamp(flatbed, rng)
    glare = _glare(place, flatbed, rng)
    specks = dust(place, flatbed, rng)
    light = sheet.reflectance(flatbed.bands)
    if dpi < sheet.dpi:  # a pixel of the scan sees all that lies under it
        down, across = (max(1, round(side * dpi / sheet.dpi)) for side in light.shape[:2])
        light = np.asarray(cv2.resize(light, (across, down), interpolation=cv2.INTER_AREA))
    flare = _flare(light, sheet.page, flatbed)
    tone = _fit_automatic(light) if flatbed.automatic else (_middle_tone if flatbed.middle else _tone)(light, flatbed)
    blur = kernels(flatbed, dpi)
    halo = reach(blur)
    picture: Picture = np.empty((*place.shape, 3), dtype=np.uint8 if flatbed.bits == 8 else np.uint16)
    height, width = place.shape
    for start in range(0, height, ROWS):
        rows = np.arange(start - halo, min(start + ROWS, height) + halo, dtype=np.float64)
        under = _see_rows(light, flare, place, rows, sheet.page, flatbed)
        if specks is not None:
            under *= specks[np.clip(rows, 0, height - 1).astype(int), :, None]
        inner = slice(halo, len(rows) - halo)
        lit = blur_rows(under, blur)[inner]
        lit = lit * lamp((np.arange(width) + 0.5) / width, (rows[inner] + 0.5) / height)[:, :, None]
        lit += glare(rows[inner])[:, :, None]
        black, white, power = tone
        noisy = add_noise(lit, flatbed.noise, rng)
        shown = np.asarray(flatbed.apply_tone(np.clip((noisy - black) / (white - black), 0, 1), power))
        shown *= np.float32(2**flatbed.bits - 1)
        picture[start : start + ROWS] = np.rint(shown, out=shown)
    top, right, bottom, left = (round(edge * dpi / 25.4) for edge in flatbed.crop)
    height, width = picture.shape[:2]
    if top + bottom >= height or left + right >= width:
        raise InputError(f"flatbed: crop {flatbed.crop} mm leaves nothing of the sheet.")
    cropped = np.ascontiguousarray(picture[top : height - bottom, left : width - right])
    return _store_picture(cropped, flatbed)


def _lamp(flatbed: FlatbedSettings, rng: np.random.Generator) -> Lamp:
    """The lamp over a picture, places counted 0–1: a few cosines."""
    cosines = rng.normal(0.0, 1.0, (3, 3)) * [[0.0, 1.0, 0.6], [1.0, 0.4, 0.2], [0.6, 0.2, 0.1]]
    u = np.linspace(0, 1, 41)

    def field(x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.floating]:
        return -smooth_field(cosines, np.asarray(x), np.asarray(y))

    return lamp(flatbed.shading, field, field(u, u))


def _glare(place: GlassPlacement, flatbed: FlatbedSettings, rng: np.random.Generator) -> Callable[[Array], Floats]:
    """What (n, w) a bright streak adds in rows (n,)."""
    angle, at = rng.uniform(0, math.pi), rng.uniform((0.25, 0.25), (0.75, 0.75))
    unit = 25.4 / place.dpi
    across = np.cos(angle) * ((np.arange(place.shape[1]) + 0.5) * unit - at[0] * place.glass.width)

    def glare(rows: Array) -> Floats:
        if not flatbed.glare:
            return np.zeros((len(rows), 1), dtype=np.float32)
        down = np.sin(angle) * ((rows + 0.5) * unit - at[1] * place.glass.height)
        away = np.add.outer(down, across).astype(np.float32) / np.float32(_STREAK)
        return np.asarray(np.float32(flatbed.glare) * np.exp(-(away**2)))

    return glare


def _flare(light: Floats, page: Page, flatbed: FlatbedSettings) -> Floats | None:
    """(h', w', 3) light of the surroundings, a pixel a millimetre."""
    import cv2

    if not flatbed.flare:
        return None
    size = tuple(max(1, round(side / 25.4 * _FLARE_DPI)) for side in (page.width, page.height))
    coarse = cv2.resize(light, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(coarse, (0, 0), _FLARE * _FLARE_DPI / 25.4, borderType=cv2.BORDER_REPLICATE))


def _see_rows(
    light: Floats, flare: Floats | None, place: GlassPlacement, rows: Array, page: Page, flatbed: FlatbedSettings
) -> Floats:
    """(n, w, 3) what lies under the pixels of `rows`."""
    import cv2

    x, y = place.on_sheet(rows)
    lid = (flatbed.lid,) * 3

    def sample_picture(picture: Floats, mode: int) -> Floats:
        across, down = (
            np.float32(n / side) for n, side in zip(picture.shape[1::-1], (page.width, page.height), strict=True)
        )
        half = np.float32(0.5)
        return np.asarray(
            cv2.remap(picture, x * across - half, y * down - half, cv2.INTER_LINEAR, borderMode=mode, borderValue=lid)
        )

    under = sample_picture(light, cv2.BORDER_CONSTANT)
    if flare is not None:
        under *= np.float32(1 - flatbed.flare)
        under += np.float32(flatbed.flare) * sample_picture(flare, cv2.BORDER_REPLICATE)
    return under


_Tone = tuple[Floats, Floats, float]  # black and white of each colour, power


def _tone(_: Floats, flatbed: FlatbedSettings) -> _Tone:
    black, white = (np.full(3, value, dtype=np.float32) for value in (flatbed.black, flatbed.white))
    return black, white, 1 / flatbed.gamma


def _middle_tone(light: Floats, flatbed: FlatbedSettings) -> _Tone:
    """The gamma that the scanner chooses for this sheet."""
    black, white, _ = _tone(light, flatbed)
    shown = np.clip((light[::4, ::4] - black) / (white - black), 0, 1)
    powers = np.linspace(0.2, 1.5, 131)
    return black, white, float(np.interp(-flatbed.middle, [-float((shown**p).mean()) for p in powers], powers))


def _fit_automatic(light: Floats) -> _Tone:
    """The levels and the gamma that the scanner chooses for this sheet."""
    pixels = light[::4, ::4].reshape(-1, 3)
    black, white = np.percentile(pixels, [_TAIL, 100 - _TAIL], axis=0).astype(np.float32)
    white = np.maximum(white, black + np.float32(0.05))
    mean = float(np.clip((pixels - black) / (white - black), 0, 1).mean())
    power = math.log(_MIDDLE) / math.log(min(max(mean, 0.02), 0.98))
    return black, white, min(max(power, 1 / 3), 1.0)


def _store_picture(picture: Picture, flatbed: FlatbedSettings) -> Picture:
    """The picture after it was kept in a file."""
    import cv2

    if not flatbed.jpeg:
        return picture
    _, coded = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, flatbed.jpeg])
    decoded = cv2.imdecode(coded, cv2.IMREAD_COLOR)
    return np.ascontiguousarray(np.asarray(decoded, dtype=np.uint8)[..., ::-1])
