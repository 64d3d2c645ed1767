"""A printer that was measured: colours of an offset press, between which is interpolated."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np

from handout import shipped
from handout.errors import InputError
from handout.simulated import spectra
from handout.simulated.printer import MORE_GAIN, Press, grow_dots
from handout.values import Array, readonly

_FILE = "fogra39-cmy.csv"


class Measured(Press):
    """Offset printing on coated paper (FOGRA39), driven as an RGB printer with three inks: cyan = 1 − red, and so on.

    Its colours were measured; between them is interpolated linearly, and every colour is given a smooth spectrum.

    Parameters
    ----------
    faults, grain : see `Press`; "wrong-media" is as if 8 % more of the sheet were covered in the middle tones.
    """

    def __init__(self, faults: Iterable[str] = (), grain: float = 0.0) -> None:
        super().__init__(faults, grain)
        from scipy.interpolate import RegularGridInterpolator

        levels, colours = table()
        self._colours = RegularGridInterpolator((levels,) * 3, colours)

    def separate(self, device: Array) -> Array:
        """(n, 4) cyan, magenta and yellow as 1 − RGB, and no black."""
        return np.concatenate([1 - device, np.zeros((len(device), 1))], axis=1)

    def spectra(self, coverage: Array) -> Array:
        """(n, 31) reflectance of what was asked for, below 0 in places where the colour is too saturated for one."""
        asked = np.clip(np.asarray(coverage)[:, :3], 0, 1)
        if "wrong-media" in self.faults:
            asked = grow_dots(asked, MORE_GAIN)
        return spectra.smooth(self._colours(asked))


@cache
def table() -> tuple[Array, Array]:
    """(9,) levels of ink, 0–1, and (9, 9, 9, 3) XYZ, white Y = 1, of cyan × magenta × yellow, from calibration/.

    Raises
    ------
    InputError
        The file is missing or damaged.
    """
    path = shipped.folder("calibration") / _FILE
    rows = _rows(path)
    levels = np.unique(rows[:, 0])
    side = len(levels)
    grid = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    if rows.shape != (side**3, 6) or not np.array_equal(rows[:, :3], grid):
        raise InputError(f"{path} is damaged: it is no full cube of cyan, magenta and yellow.")
    return readonly(levels / 100, None), readonly(rows[:, 3:].reshape(side, side, side, 3) / 100, None, None, None, 3)


def _rows(path: Path) -> Array:
    try:
        return np.loadtxt(path, delimiter=",", comments="#", ndmin=2)
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}.") from error
