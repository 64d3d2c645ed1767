"""What can go wrong in the simulated printer, on demand."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.simulated.scanner.flatbed import SETTINGS
from handout.values import Array

FAULTS = {
    "fit-to-page": "the page is printed at 97 % of its size, in the middle of the sheet",
    "mirrored": "left and right are exchanged, as for a transfer film",
    "managed": "the driver takes the page for sRGB, turns it into Adobe RGB and makes it lighter",
    "wrong-media": "the driver was told another paper: dots grow by 8 % more",
    "weak-cyan": "half of the cyan nozzles print nothing",
    "weak-magenta": "half of the magenta nozzles print nothing",
    "weak-yellow": "half of the yellow nozzles print nothing",
    "no-black": "the black ink is empty",
    "draft": "60 % of the ink",
    "ink-limit": "the driver was told another paper: no more than 120 % of ink anywhere",
    "clogged": "two groups of the cyan nozzles are blocked: two lines without cyan in every pass of the head",
    "banding": "ink gets lighter over each pass of the head, and a pale line lies between passes",
}
_SHARES = {
    "weak-cyan": (0.5, 1, 1, 1), "weak-magenta": (1, 0.5, 1, 1), "weak-yellow": (1, 1, 0.5, 1),
    "no-black": (1, 1, 1, 0), "draft": (0.6, 0.6, 0.6, 0.6),
}  # fmt: skip
_LIMIT = 1.2  # of the sheet, all inks together
FITTED = 0.97  # of the size
MORE_GAIN = 0.08
_PASS = 25.4 / 3  # mm, height of the print head
_BLOCKED = ((1.9, 2.15), (5.4, 5.55))  # mm from the head's top
_FADING, _JOINT, _PALE = 0.05, 0.13, 0.35  # share of ink; mm; share of ink
_LIGHTER = 0.85  # power
# linear sRGB to linear Adobe RGB (1998), both D65
_TO_ADOBE = np.array([[0.71513, 0.28487, 0.0], [0.0, 1.0, 0.0], [0.0, 0.04117, 0.95883]])
_ADOBE_GAMMA = 563 / 256  # Source: Adobe RGB (1998) Color Image Encoding


def check(names: Iterable[str]) -> frozenset[str]:
    """The faults of those names.

    Raises
    ------
    InputError
        No such fault; the message lists what there is.
    """
    asked = frozenset(names)
    for name in sorted(asked - set(FAULTS)):
        choices = [*FAULTS, *SETTINGS]
        near = difflib.get_close_matches(name, choices, 1)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise InputError(f"The simulated printer has no fault {name!r}{hint} It has: {', '.join(choices)}.")
    return asked


def manage_colour(device: Array) -> Array:
    """(n, 3) what a driver that manages colour makes of device RGB (n, 3), 0–1."""
    linear = np.where(device <= 0.04045, device / 12.92, ((device + 0.055) / 1.055) ** 2.4)
    turned = np.clip(linear @ _TO_ADOBE.T, 0, 1) ** (1 / _ADOBE_GAMMA)
    return np.asarray(turned**_LIGHTER)


def lay_ink(coverage: Array, names: Iterable[str]) -> Array:
    """(n, 4): the ink that a printer with these faults lays down when the driver asks for (n, 4)."""
    amounts = np.array(coverage, dtype=np.float64)
    if "ink-limit" in names:
        amounts *= np.minimum(1, _LIMIT / np.maximum(amounts.sum(axis=1, keepdims=True), _LIMIT))
    for name in names:
        amounts *= np.array(_SHARES.get(name, (1, 1, 1, 1)))
    return amounts


def shrink_page(page: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The page (h, w, 3) made smaller about its middle, white around it."""
    import cv2

    height, width = page.shape[:2]
    matrix = np.array([[FITTED, 0, (1 - FITTED) * (width - 1) / 2], [0, FITTED, (1 - FITTED) * (height - 1) / 2]])
    white = (255, 255, 255)
    return np.asarray(
        cv2.warpAffine(page, matrix, (width, height), flags=cv2.INTER_LINEAR, borderValue=white), dtype=np.uint8
    )


def find_blocked_rows(rows: int, dpi: float) -> NDArray[np.bool_]:
    """(rows,) whether the nozzles that would print the row are blocked."""
    at = _in_pass(rows, dpi)
    return np.asarray(np.logical_or.reduce([(at >= start) & (at < stop) for start, stop in _BLOCKED]))


def weaken_rows(rows: int, dpi: float) -> NDArray[np.float32]:
    """(rows,) how much of its ink every row gets, 0–1."""
    at = _in_pass(rows, dpi)
    ink = 1 - _FADING * at / _PASS
    ink[at < _JOINT] -= _PALE
    return np.asarray(ink, dtype=np.float32)


def _in_pass(rows: int, dpi: float) -> Array:
    """(rows,) mm from the top of the print head."""
    return np.asarray((np.arange(rows) + 0.5) * (25.4 / dpi) % _PASS)
