"""From what lies on the glass to a picture: lamp, optics, dust, sensor and tone curve, some rows at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.simulated.scanner.scanner import Scanner
from handout.values import Array

FULL = np.iinfo(np.uint16).max  # light that ink lets pass is kept in shares of this
_ROWS = 512
_SHARPEST = 0.2  # pixels: a finer blur is none

Floats = NDArray[np.float32]


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


def look(
    ground: NDArray[np.uint8],
    light: NDArray[np.uint16],
    specks: Floats | None,
    dpi: float,
    scanner: Scanner,
    rng: np.random.Generator,
) -> Iterator[Rows]:
    """Scan.

    Parameters
    ----------
    ground : (h, w, 3) uint8, paper and lid; light : (h, w, 3) uint16, what the ink over it lets pass, of `FULL`.
    specks : (h, w) float32 in 0–1, light that dust on the glass lets pass; None: no dust.
    """
    height, width = ground.shape[:2]
    kernels = [_kernels(scanner, dpi, channel) for channel in range(3)]
    halo = max(len(k) // 2 for pair in kernels for k in pair)
    lamp = _lamp(scanner, rng)
    columns = np.linspace(-1, 1, width, dtype=np.float32)
    for start in range(0, height, _ROWS):
        stop = min(start + _ROWS, height)
        rows = np.clip(np.arange(start - halo, stop + halo), 0, height - 1)
        cut = slice(halo, halo + stop - start)
        lit = lamp(columns, np.linspace(-1, 1, height, dtype=np.float32)[start:stop])[:, :, None]
        bare = ground[rows].astype(np.float32) * np.float32(1 / 255)
        inked = bare * (light[rows] * np.float32(1 / FULL))
        sheet = _blurred(bare, kernels)[cut] * lit
        shown = _blurred(inked, kernels)[cut] * lit
        dusty = shown if specks is None else _blurred(inked * specks[rows][:, :, None], kernels)[cut] * lit
        yield Rows(start, *(tone(part, scanner) for part in (_noisy(dusty, scanner, rng), sheet, shown)))


def tone(light: Floats, scanner: Scanner) -> Floats:
    """What the scanner shows of light: 0–1."""
    span = scanner.white - scanner.black
    shown = np.clip((light - np.float32(scanner.black)) * np.float32(1 / span), 0, 1)
    if scanner.gamma != 1:
        shown **= np.float32(scanner.gamma)
    return np.repeat(shown.mean(axis=-1, keepdims=True), 3, axis=-1) if scanner.grey else shown


def _kernels(scanner: Scanner, dpi: float, channel: int) -> tuple[Array, Array]:
    """The blur along x and along y, moved by what the channel is beside green."""
    scale = dpi / 25.4
    shift = (scanner.misregistration[0], (0.0, 0.0), scanner.misregistration[1])[channel]
    return _bell(scanner.blur * scale, shift[0] * scale), _bell(scanner.blur * scale, shift[1] * scale)


def _bell(sigma: float, shift: float) -> Array:
    """(2 k + 1,) sum 1: a Gaussian about `shift` pixels, or what moves a picture by so much."""
    reach = math.ceil(4 * sigma + abs(shift)) if sigma > _SHARPEST else math.ceil(abs(shift))
    at = np.arange(-reach, reach + 1)
    if sigma > _SHARPEST:
        weight = np.exp(-0.5 * ((at - shift) / sigma) ** 2)
    else:
        weight = np.maximum(0.0, 1 - np.abs(at - shift))
    return np.asarray(weight / weight.sum())


def _blurred(rows: Floats, kernels: list[tuple[Array, Array]]) -> Floats:
    import cv2

    if all(len(k) == 1 for pair in kernels for k in pair):
        return rows
    # OpenCV correlates: a kernel is turned round to move the picture towards its shift
    return np.stack(
        [
            cv2.sepFilter2D(np.ascontiguousarray(rows[:, :, c]), -1, x[::-1], y[::-1], borderType=cv2.BORDER_REPLICATE)
            for c, (x, y) in enumerate(kernels)
        ],
        axis=2,
    )


class _Lamp:
    """Light over the picture: at its brightest 1, falling off along a random direction."""

    def __init__(self, loss: float, weights: Array) -> None:
        x, y = np.meshgrid(np.linspace(-1, 1, 33), np.linspace(-1, 1, 33))
        field = self._field(weights, x, y)
        self._weights, self._least = weights, float(field.min())
        self._span, self._loss = max(float(np.ptp(field)), 1e-9), loss

    @staticmethod
    def _field(w: Array, x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.floating]:
        return np.asarray(w[0] * x + w[1] * y + w[2] * x * x + w[3] * y * y + w[4] * x * y)

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """(h, w) of places x (w,) and y (h,) in −1 to 1."""
        if not self._loss:
            return np.ones((len(y), len(x)), dtype=np.float32)
        field = self._field(self._weights, x[None, :], y[:, None])
        return np.asarray(1 - self._loss * (field - self._least) / self._span, dtype=np.float32)


def _lamp(scanner: Scanner, rng: np.random.Generator) -> _Lamp:
    return _Lamp(scanner.unevenness, rng.normal(0.0, [1.0, 1.0, 0.6, 0.6, 0.4]))


def _noisy(light: Floats, scanner: Scanner, rng: np.random.Generator) -> Floats:
    """Sensor noise: photons are counted, so that it goes with the root of the light; a little is left in the dark."""
    if not scanner.noise:
        return light
    noise = rng.standard_normal(light.shape, dtype=np.float32)
    noise *= np.sqrt(np.float32(0.1) + np.float32(0.9) * np.maximum(light, 0)) * np.float32(scanner.noise)
    return np.asarray(light + noise)
