"""Reading the codes of a sheet: since its marks say where they are, nothing has to be looked for.

Every module is sampled where it must be, made black or white against its neighbourhood, and only the clean square
that results is given to the decoder. That reads scans of 150 dpi, shadows and all, in which a search for codes fails.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from handout.prompting import code
from handout.prompting.registration import Registration
from handout.values import Array

_FINDER = 7  # modules of the squares at three corners of a code
_REACH = 1.6  # modules by which a code may lie off
_STEP = 0.2
_SCALE = 4  # pixels a module, of the square for the decoder
_QUIET = 4  # modules
_SHARPEN = (0.8, 0.0, 1.6)  # tried in turn
_AROUND = np.array([[0.25, 0.5, 0.25], [0.5, 0.0, 0.5], [0.25, 0.5, 0.25]]) / 3


def read_codes(grey: NDArray[np.uint8], registration: Registration, boxes: Array) -> list[bytes]:
    """What can be read of the codes in some boxes (n, 4) mm, each as bytes."""
    found: list[bytes] = []
    versions: tuple[int, ...] = code.VERSIONS[::-1]
    smooth = _smoothed(grey, registration, boxes)
    for box in boxes:
        for version in versions:
            data = _read(smooth, registration, box, code.side(version))
            if data is not None:
                found.append(data)
                versions = (version,)  # all codes of a page have one size
                break
    return found


def _smoothed(grey: NDArray[np.uint8], registration: Registration, boxes: Array) -> NDArray[np.uint8]:
    """The picture, freed of detail much finer than the finest module, which single samples would be at the mercy of."""
    import cv2

    finest = (boxes[0, 2] - boxes[0, 0]) / code.side(code.VERSIONS[-1]) * registration.dpi / 25.4
    sigma = 0.3 * finest
    return grey if sigma < 0.8 else np.asarray(cv2.GaussianBlur(grey, (0, 0), sigma))


def _read(grey: NDArray[np.uint8], registration: Registration, box: Array, side: int) -> bytes | None:
    for grid in _grids(grey, registration, box, side):
        seen = _sampled(grey, registration.pixels(grid.reshape(-1, 2)).reshape(side, side, 2))
        for strength in _SHARPEN:
            text = _decoded(_black(_sharpened(seen, strength)))
            data = code.from_base45(text) if text else None
            if data:
                return data
    return None


def _grids(grey: NDArray[np.uint8], registration: Registration, box: Array, side: int) -> Iterator[Array]:
    """Where the modules' middles may be, (side, side, 2) mm: as drawn, then as its three corner squares have moved."""
    module = (box[2] - box[0]) / side
    at = (np.arange(side) + 0.5) * module
    drawn = box[:2] + np.stack(np.meshgrid(at, at), axis=-1)
    first, last = slice(0, _FINDER), slice(-_FINDER, None)
    corners = ((first, first), (first, last), (last, first))
    fits = [_moved(grey, registration, drawn[corner], module) for corner in corners]
    if min(likeness for likeness, _ in fits) < 0.5:
        return  # not a code of this size, or a spoilt one
    yield drawn
    (_, a), (_, b), (_, c) = fits
    weight = (np.arange(side) - _FINDER / 2 + 0.5) / (side - _FINDER)
    yield drawn + a + weight[None, :, None] * (b - a) + weight[:, None, None] * (c - a)


def _moved(grey: NDArray[np.uint8], registration: Registration, points: Array, module: float) -> tuple[float, Array]:
    """How well the square of a code's corner fits, −1 to 1, and by how many mm (2,) it has moved."""
    steps = np.arange(-_REACH, _REACH + _STEP / 2, _STEP) * module
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    places = points.reshape(1, -1, 2) + shifts[:, None, :]
    seen = _sampled(grey, registration.pixels(places.reshape(-1, 2)).reshape(len(shifts), -1, 2))
    ring = np.abs(np.arange(_FINDER) - _FINDER // 2)
    far = np.maximum(ring[:, None], ring)
    wanted = np.where(far == 2, 1.0, -1.0).reshape(-1)
    wanted -= wanted.mean()
    seen = seen - seen.mean(axis=1, keepdims=True)
    norm = np.linalg.norm(seen, axis=1) * np.linalg.norm(wanted)
    likeness = seen @ wanted / np.maximum(norm, 1e-9)
    # of all that fit nearly as well, the middle: blur makes the peak flat
    best = likeness >= likeness.max() - 0.02
    return float(likeness.max()), shifts[best].mean(axis=0)


def _sampled(grey: NDArray[np.uint8], pixels: Array) -> Array:
    """Grey at pixels (…, 2), linear between them; white outside the picture."""
    import cv2

    flat = pixels.reshape(len(pixels), -1, 2).astype(np.float32)
    white = cv2.BORDER_CONSTANT
    found = cv2.remap(grey, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR, borderMode=white, borderValue=255)
    return np.asarray(found, dtype=np.float64).reshape(pixels.shape[:-1])


def _sharpened(seen: Array, strength: float) -> Array:
    """Modules (m, m) less what their neighbours spilt into them: at 150 dpi a module is no larger than the blur."""
    from scipy.ndimage import convolve

    return np.asarray(seen + strength * (seen - convolve(seen, _AROUND, mode="nearest")))


def _black(seen: Array) -> NDArray[np.bool_]:
    """Modules (m, m) that are dark against their neighbourhood: light falls off across a code, and ink is uneven."""
    from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

    low, high = minimum_filter(seen, 9, mode="nearest"), maximum_filter(seen, 9, mode="nearest")
    return np.asarray(seen < gaussian_filter((low + high) / 2, 2.0, mode="nearest"))


def _decoded(black: NDArray[np.bool_]) -> str:
    import cv2

    side = len(black)
    image = np.full((side + 2 * _QUIET,) * 2, 255, dtype=np.uint8)
    image[_QUIET:-_QUIET, _QUIET:-_QUIET] = np.where(black, 0, 255)
    image = np.kron(image, np.ones((_SCALE, _SCALE), dtype=np.uint8))
    low, high = _QUIET * _SCALE, (_QUIET + side) * _SCALE - 1
    corners = np.array([[[low, low], [high, low], [high, high], [low, high]]], dtype=np.float32)
    try:
        text, _ = cv2.QRCodeDetector().decode(image, corners)
    except cv2.error:  # a damaged code may name a size or mode that cannot be
        return ""
    return str(text)
