"""What happens to light between the sheet and the numbers of a picture: lamp, blur, noise of the sensor."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from handout.simulated.scanner.flatbed import FlatbedSettings
from handout.values import Array

Floats = NDArray[np.float32]
Field = Callable[[NDArray[np.floating], NDArray[np.floating]], NDArray[np.floating]]
Lamp = Callable[[NDArray[np.floating], NDArray[np.floating]], Floats]
Kernels = list[tuple[Array, Array]]

ROWS = 512  # of a picture that are made at a time, so that one of 1200 dpi needs little memory beside itself
_SHARPEST = 0.2  # pixels: a finer blur is none


def lamp(loss: float, field: Field, sampled: NDArray[np.floating]) -> Lamp:
    """The lamp's light over the picture: 1 where `field` is least, less by the share `loss` where it is greatest.

    Parameters
    ----------
    field : of places x (w,) and y (h,), (h, w); sampled : its values over the whole picture.
    """
    least, span = float(sampled.min()), max(float(np.ptp(sampled)), 1e-9)

    def light_at(x: NDArray[np.floating], y: NDArray[np.floating]) -> Floats:
        if not loss:
            return np.ones((len(y), len(x)), dtype=np.float32)
        return np.asarray(1 - loss * (field(x, y) - least) / span, dtype=np.float32)

    return light_at


def kernels(flatbed: FlatbedSettings, dpi: float) -> Kernels:
    """For red, green and blue the blur along x and along y, moved by the channel's misregistration."""
    scale = dpi / 25.4
    red, blue = flatbed.misregistration
    return [(_bell(flatbed.blur * scale, x * scale), _bell(flatbed.blur * scale, y * scale))
            for x, y in (red, (0.0, 0.0), blue)]  # fmt: skip


def reach(blur: Kernels) -> int:
    """Rows beyond a part of a picture that the blur brings into it."""
    return max(len(kernel) // 2 for pair in blur for kernel in pair)


def _bell(sigma: float, shift: float) -> Array:
    """(2 k + 1,) sum 1: a Gaussian about `shift` pixels, or what moves a picture by so much."""
    extent = math.ceil(4 * sigma + abs(shift)) if sigma > _SHARPEST else math.ceil(abs(shift))
    at = np.arange(-extent, extent + 1)
    if sigma > _SHARPEST:
        weight = np.exp(-0.5 * ((at - shift) / sigma) ** 2)
    else:
        weight = np.maximum(0.0, 1 - np.abs(at - shift))
    return np.asarray(weight / weight.sum())


def blur_rows(rows: Floats, blur: Kernels) -> Floats:
    """Rows (n, w, 3) after the optics."""
    import cv2

    if all(len(k) == 1 for pair in blur for k in pair):
        return rows
    # OpenCV correlates: a kernel is turned round to move the picture towards its shift
    return np.stack(
        [
            cv2.sepFilter2D(np.ascontiguousarray(rows[:, :, c]), -1, x[::-1], y[::-1], borderType=cv2.BORDER_REPLICATE)
            for c, (x, y) in enumerate(blur)
        ],
        axis=2,
    )


def noisy(light: Floats, noise: float, rng: np.random.Generator) -> Floats:
    """Light after the sensor: photons are counted, so noise goes with the root of the light; some is in the dark."""
    if not noise:
        return light
    scatter = rng.standard_normal(light.shape, dtype=np.float32)
    scatter *= np.sqrt(np.float32(0.1) + np.float32(0.9) * np.maximum(light, 0)) * np.float32(noise)
    return np.asarray(light + scatter)
