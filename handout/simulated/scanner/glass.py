"""From a printed sheet on the glass to a picture: place, warp, flare, lamp, glare, dust, optics, sensor, tone curve.

All that happens before the tone curve is linear in light.  A picture is made some rows at a time, so that one of
1200 dpi needs little memory beside itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.simulated.scanner.flatbed import Flatbed
from handout.simulated.sheet import Sheet
from handout.values import Array, Page

Floats = NDArray[np.float32]
Picture = NDArray[np.uint8 | np.uint16]

_ROWS = 512
_FIELD = 4  # cosines a side of what varies smoothly over the glass
_FLARE = 8.0  # mm, how far flare reaches (standard deviation)
_FLARE_DPI = 25.4  # pixels of its field: a millimetre
_STREAK = 12.0  # mm, half the width of glare
_FINER = 4  # bits of a pixel's place
_TAIL = 0.2  # per cent of the pixels that automatic levels give up at either end
_MIDDLE = 0.55  # to which automatic gamma brings the mean


@dataclass(frozen=True, eq=False)
class _Place:
    """Where the sheet lies.

    glass : size of the picture, mm.
    matrix : (2, 3) mm on the glass to mm on the sheet.
    bends : (2, _FIELD, _FIELD) cosines of the warp, mm.
    dpi : of the picture.
    """

    glass: Page
    matrix: Array
    bends: Array
    dpi: float

    @property
    def shape(self) -> tuple[int, int]:
        scale = self.dpi / 25.4
        return max(1, round(self.glass.height * scale)), max(1, round(self.glass.width * scale))

    def on_sheet(self, rows: Array) -> tuple[Floats, Floats]:
        """(n, w) x and y on the sheet, mm, of the middles of all pixels in `rows` (n,)."""
        unit = 25.4 / self.dpi
        x, y = ((np.arange(self.shape[1]) + 0.5) * unit)[None, :], ((rows + 0.5) * unit)[:, None]
        u, v = x[0] / self.glass.width, y[:, 0] / self.glass.height
        (a, b, c), (d, e, f) = self.matrix
        across, down = a * x + b * y + c, d * x + e * y + f
        if self.bends.any():
            across += _smooth_field(self.bends[0], u, v)
            down += _smooth_field(self.bends[1], u, v)
        return across.astype(np.float32), down.astype(np.float32)


def scan(sheet: Sheet, dpi: float, flatbed: Flatbed, rng: np.random.Generator) -> Picture:
    """See `Flatbed.scan`."""
    place = _lay(sheet.page, dpi, flatbed, rng)
    lamp = _lamp(place, flatbed, rng)
    glare = _glare(place, flatbed, rng)
    dust = _dust(place, flatbed, rng)
    light = _sharp_enough(sheet.reflectance(flatbed.bands), sheet.dpi, dpi)
    flare = _flare(light, sheet.page, flatbed)
    tone = _automatic(light, flatbed) if flatbed.automatic else (_middled if flatbed.middle else _tone)(light, flatbed)
    halo = math.ceil(4 * flatbed.blur * dpi / 25.4)
    picture: Picture = np.empty((*place.shape, 3), dtype=np.uint8 if flatbed.bits == 8 else np.uint16)
    for start in range(0, len(picture), _ROWS):
        rows = np.arange(start - halo, min(start + _ROWS, len(picture)) + halo, dtype=np.float64)
        seen = _seen(light, flare, place, rows, sheet.page, flatbed)
        if dust is not None:
            seen *= dust[np.clip(rows, 0, len(dust) - 1).astype(int), :, None]
        if halo:
            seen = _blurred(seen, flatbed.blur * dpi / 25.4)
        inner = slice(halo, len(rows) - halo)
        lit = seen[inner] * lamp(rows[inner])[:, :, None] + glare(rows[inner])[:, :, None]
        picture[start : start + _ROWS] = _shown(_noisy(lit, flatbed, rng), tone, flatbed)
    return _kept(_cropped(picture, dpi, flatbed), flatbed)


def _lay(page: Page, dpi: float, flatbed: Flatbed, rng: np.random.Generator) -> _Place:
    turned, aside = rng.normal(0.0, flatbed.skew), rng.normal(0.0, flatbed.slack, 2)
    angle = turned if flatbed.rotation is None else flatbed.rotation
    move = aside if flatbed.offset is None else np.asarray(flatbed.offset)
    cos, sin = math.cos(angle), math.sin(angle)
    # a sheet that lies on its side needs a glass that does too
    upright = abs(cos) >= abs(sin)
    width, height = (page.width, page.height) if upright else (page.height, page.width)
    glass = Page(width + 2 * flatbed.border, height + 2 * flatbed.border)
    back = np.array([[cos, sin], [-sin, cos]])
    middle = np.array([page.width, page.height]) / 2
    shift = middle - back @ (np.array([glass.width, glass.height]) / 2 + move)
    return _Place(glass, np.column_stack([back, shift]), _bends(flatbed.warp, rng), dpi)


def _bends(most: float, rng: np.random.Generator) -> Array:
    """(2, _FIELD, _FIELD) cosines of a smooth shift that is `most` mm where it is greatest."""
    u = np.linspace(0, 1, 41)
    fields = rng.normal(0.0, 1.0, (2, _FIELD, _FIELD)) / (1 + np.add.outer(np.arange(_FIELD), np.arange(_FIELD)))
    fields[:, 0, 0] = 0
    size = np.hypot(_smooth_field(fields[0], u, u), _smooth_field(fields[1], u, u)).max()
    return np.asarray(fields * (most / size))


def _smooth_field(cosines: Array, u: Array, v: Array) -> Array:
    """(n, m) a sum of cosines (k, k) at u (m,) across and v (n,) down, both 0–1."""
    order = np.arange(len(cosines))
    return np.asarray(np.cos(np.pi * np.outer(v, order)) @ cosines @ np.cos(np.pi * np.outer(order, u)))


def _lamp(place: _Place, flatbed: Flatbed, rng: np.random.Generator) -> Callable[[Array], Floats]:
    """What (n, w) the lamp leaves of the light in rows (n,): at its brightest 1."""
    cosines = rng.normal(0.0, 1.0, (3, 3)) * [[0.0, 1.0, 0.6], [1.0, 0.4, 0.2], [0.6, 0.2, 0.1]]
    u = np.linspace(0, 1, 41)
    field = _smooth_field(cosines, u, u)
    height, width = place.shape

    def lamp(rows: Array) -> Floats:
        if not flatbed.shading:
            return np.ones((len(rows), 1), dtype=np.float32)
        here = _smooth_field(cosines, (np.arange(width) + 0.5) / width, (rows + 0.5) / height)
        return np.asarray(1 - flatbed.shading * (field.max() - here) / np.ptp(field), dtype=np.float32)

    return lamp


def _glare(place: _Place, flatbed: Flatbed, rng: np.random.Generator) -> Callable[[Array], Floats]:
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


def _dust(place: _Place, flatbed: Flatbed, rng: np.random.Generator) -> Floats | None:
    """(h, w) share of light that what lies on the glass lets pass."""
    import cv2

    count = int(rng.poisson(flatbed.dust * place.glass.width * place.glass.height / 1e4))
    if not count:
        return None
    scale = place.dpi / 25.4
    clear = np.full(place.shape, 255, dtype=np.uint8)
    for _ in range(count):
        at = rng.uniform((0.0, 0.0), (place.glass.width, place.glass.height)) * scale - 0.5
        size = min(0.06 * math.exp(rng.normal(0.0, 0.6)), 0.5) * scale
        grey = round(255 * rng.uniform(0.3, 0.85))
        middle = tuple(np.rint(at * 2**_FINER).astype(int).tolist())
        cv2.circle(clear, middle, max(1, round(size * 2**_FINER)), grey, -1, cv2.LINE_AA, _FINER)
    return clear.astype(np.float32) / np.float32(255)


def _sharp_enough(light: Floats, sheet_dpi: float, dpi: float) -> Floats:
    """The sheet's light at no more than the resolution of the scan: a pixel of it sees all that lies under it."""
    import cv2

    if dpi >= sheet_dpi:
        return light
    height, width = (max(1, round(side * dpi / sheet_dpi)) for side in light.shape[:2])
    return np.asarray(cv2.resize(light, (width, height), interpolation=cv2.INTER_AREA))


def _flare(light: Floats, page: Page, flatbed: Flatbed) -> Floats | None:
    """(h', w', 3) light of the surroundings, a pixel a millimetre."""
    import cv2

    if not flatbed.flare:
        return None
    size = tuple(max(1, round(side / 25.4 * _FLARE_DPI)) for side in (page.width, page.height))
    coarse = cv2.resize(light, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(coarse, (0, 0), _FLARE * _FLARE_DPI / 25.4, borderType=cv2.BORDER_REPLICATE))


def _seen(light: Floats, flare: Floats | None, place: _Place, rows: Array, page: Page, flatbed: Flatbed) -> Floats:
    """(n, w, 3) what lies under the pixels of `rows`."""
    import cv2

    x, y = place.on_sheet(rows)
    lid = (flatbed.lid,) * 3

    def taken(picture: Floats, mode: int) -> Floats:
        across, down = (
            np.float32(n / side) for n, side in zip(picture.shape[1::-1], (page.width, page.height), strict=True)
        )
        half = np.float32(0.5)
        return np.asarray(
            cv2.remap(picture, x * across - half, y * down - half, cv2.INTER_LINEAR, borderMode=mode, borderValue=lid)
        )

    seen = taken(light, cv2.BORDER_CONSTANT)
    if flare is not None:
        seen *= np.float32(1 - flatbed.flare)
        seen += np.float32(flatbed.flare) * taken(flare, cv2.BORDER_REPLICATE)
    return seen


def _blurred(seen: Floats, sigma: float) -> Floats:
    import cv2

    return np.asarray(cv2.GaussianBlur(seen, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE))


def _noisy(light: Floats, flatbed: Flatbed, rng: np.random.Generator) -> Floats:
    """Photons are counted, so that noise goes with the root of the light; a little is left in the dark."""
    if not flatbed.noise:
        return light
    noise = rng.standard_normal(light.shape, dtype=np.float32)
    noise *= np.sqrt(np.float32(0.1) + np.float32(0.9) * np.maximum(light, 0)) * np.float32(flatbed.noise)
    return np.asarray(light + noise)


_Tone = tuple[Floats, Floats, float]  # black and white of each colour, power


def _tone(_: Floats, flatbed: Flatbed) -> _Tone:
    black, white = (np.full(3, value, dtype=np.float32) for value in (flatbed.black, flatbed.white))
    return black, white, 1 / flatbed.gamma


def _middled(light: Floats, flatbed: Flatbed) -> _Tone:
    """The gamma that the scanner chooses for this sheet."""
    black, white, _ = _tone(light, flatbed)
    shown = np.clip((light[::4, ::4] - black) / (white - black), 0, 1)
    powers = np.linspace(0.2, 1.5, 131)
    return black, white, float(np.interp(-flatbed.middle, [-float((shown**p).mean()) for p in powers], powers))


def _automatic(light: Floats, flatbed: Flatbed) -> _Tone:
    """The levels and the gamma that the scanner chooses for this sheet."""
    pixels = light[::4, ::4].reshape(-1, 3)
    black, white = np.percentile(pixels, [_TAIL, 100 - _TAIL], axis=0).astype(np.float32)
    white = np.maximum(white, black + np.float32(0.05))
    mean = float(np.clip((pixels - black) / (white - black), 0, 1).mean())
    power = math.log(_MIDDLE) / math.log(min(max(mean, 0.02), 0.98))
    return black, white, min(max(power, 1 / 3), 1.0)


def _shown(light: Floats, tone: _Tone, flatbed: Flatbed) -> Floats:
    """(n, w, 3) numbers of the picture, rounded."""
    black, white, power = tone
    shown = np.asarray(flatbed.toned(np.clip((light - black) / (white - black), 0, 1), power))
    if flatbed.grey:
        shown = np.repeat(shown.mean(axis=2, keepdims=True), 3, axis=2)
    shown *= np.float32(2**flatbed.bits - 1)
    return np.asarray(np.rint(shown, out=shown))


def _cropped(picture: Picture, dpi: float, flatbed: Flatbed) -> Picture:
    top, right, bottom, left = (round(edge * dpi / 25.4) for edge in flatbed.crop)
    height, width = picture.shape[:2]
    if top + bottom >= height or left + right >= width:
        raise InputError(f"flatbed: crop {flatbed.crop} mm leaves nothing of the sheet.")
    return np.ascontiguousarray(picture[top : height - bottom, left : width - right])


def _kept(picture: Picture, flatbed: Flatbed) -> Picture:
    """The picture after it was kept in a file."""
    import cv2

    if not flatbed.jpeg:
        return picture
    _, coded = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, flatbed.jpeg])
    kept = cv2.imdecode(coded, cv2.IMREAD_COLOR)
    return np.ascontiguousarray(np.asarray(kept, dtype=np.uint8)[..., ::-1])
