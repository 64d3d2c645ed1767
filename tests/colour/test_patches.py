from __future__ import annotations

import re

import numpy as np
import pytest
from formula_printers import chart, dull

from handout.colour.models.forward import Patches
from handout.errors import InputError

DEVICE = chart()
SCANNED = dull(DEVICE)
UNKNOWN = np.full(len(DEVICE), np.nan)


def changed(array: np.ndarray, at: object, value: float) -> np.ndarray:
    out = array.copy()
    out[at] = value
    return out


@pytest.mark.parametrize(
    ("device", "scanned", "deviation", "message"),
    [
        (DEVICE[:99], SCANNED[:99], UNKNOWN[:99], "99 are too few"),
        (DEVICE, SCANNED[:-1], UNKNOWN, "scanned has the shape (267, 3); (268, 3) is wanted"),
        (DEVICE[:, :2], SCANNED, UNKNOWN, "device has the shape"),
        (DEVICE, SCANNED, UNKNOWN[:-3], "deviation has the shape"),
        (changed(DEVICE, (6, 1), 1.2), SCANNED, UNKNOWN, "device of patch 7 is 1.2, outside 0 to 1"),
        (DEVICE, changed(SCANNED, (11, 0), np.nan), UNKNOWN, "scanned of patch 12 is nan"),
        (DEVICE, changed(SCANNED, (0, 2), np.inf), UNKNOWN, "scanned of patch 1 is inf"),
        (DEVICE, 255 * SCANNED, UNKNOWN, "outside -0.05 to 1.05"),
        (DEVICE, SCANNED, changed(UNKNOWN, 4, -0.1), "deviation of patch 5 is -0.1"),
        (DEVICE, 0.9 + 0.02 * SCANNED, UNKNOWN, "scanned red of all patches lies within"),
        (changed(DEVICE, (slice(None), 2), 0.3), SCANNED, UNKNOWN, "blue was sent in a range of 0.00"),
    ],
)
def test_bad_patches_are_named(device, scanned, deviation, message) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        Patches(device, scanned, deviation)


def test_good_patches_are_kept_and_read_only() -> None:
    made = Patches(DEVICE, SCANNED, UNKNOWN)
    assert len(made) == len(DEVICE)
    np.testing.assert_array_equal(made.scanned, SCANNED)
    with pytest.raises(ValueError):
        made.device[0, 0] = 1
