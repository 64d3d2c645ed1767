"""The colour table of one printer, paper and scanner, and pages that go through it.

A table turns the scanned colour that is wanted into the device colour to send.  `apply` sends a page of ink on
transparent ground through it.
"""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout import __version__, atomic
from handout.colour.interpolation import Nodes, look_up
from handout.colour.models import Model
from handout.errors import InputError
from handout.summary import one_line
from handout.values import Array, Raster

SIZE = 49  # at 33, dark colours on glossy paper were off by up to ΔE00 1.7 between nodes, and .6 at this
_SIZES = (9, 129)
_GREATEST = 10.0  # of a node: colours are 0–1, and what models add beyond is clipped; more is damage
# how numpy and its reader of zip files meet a damaged file
_DAMAGED = (zipfile.BadZipFile, zlib.error, tokenize.TokenError)
_FORMAT = 1  # of the file, for later ones


@dataclass(frozen=True, eq=False)
class ColourTable:
    """Wanted scanned RGB → device RGB on an even grid over the cube.

    nodes : (s, s, s, 3) float32: device RGB, unclamped, wanted at scanned RGB (i, j, k) / (s − 1); values are cut to
        0–1 after interpolation only.
    scanned : (t, t, t, 3) float32: the model the other way, scanned RGB of device RGB (i, j, k) / (t − 1).
    about : printer, paper, scanner, date, method, version …

    Raises
    ------
    InputError
        Arrays of other shapes, or numbers that are no colours.
    """

    nodes: Nodes
    scanned: Nodes
    about: Mapping[str, str] = field(default_factory=dict)

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name in ("nodes", "scanned"):
            array = np.array(getattr(self, name), dtype=np.float32)
            side = len(array) if array.ndim else 0
            shaped = array.shape == (side,) * 3 + (3,) and _SIZES[0] <= side <= _SIZES[1]
            if not shaped or not (np.abs(array) <= _GREATEST).all():
                raise InputError(
                    f"colour table: {name} must be numbers from -{_GREATEST:g} to {_GREATEST:g} of the shape "
                    f"(s, s, s, 3) with s from {_SIZES[0]} to {_SIZES[1]}; here it is {array.shape}."
                )
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def size(self) -> int:
        """Nodes along each side."""
        return len(self.nodes)

    @property
    def paper(self) -> Nodes:
        """(3,) scanned RGB of the bare paper."""
        return np.asarray(self.scanned[-1, -1, -1])

    def interpolate(self, scanned: Array | NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, 3) device RGB of (n, 3) scanned RGB, as interpolated."""
        return look_up(self.nodes, scanned)

    def __call__(self, scanned: Array | NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, 3) device RGB in 0–1 to send for (n, 3) wanted scanned RGB."""
        return np.clip(self.interpolate(scanned), 0, 1)


def build(model: Model, about: Mapping[str, str] | None = None, size: int = SIZE) -> ColourTable:
    """The table of a model; `about` names printer, paper, scanner and date, method and version are added.

    Raises
    ------
    InputError
        A size outside 9–129.
    """
    if not _SIZES[0] <= size <= _SIZES[1]:
        raise InputError(f"colour table: {size} nodes a side are outside {_SIZES[0]} to {_SIZES[1]}.")
    device = model.nodes(size)
    about_table = {**(about or {}), "method": model.method, "version": __version__}
    nodes = device.reshape(size, size, size, 3).astype(np.float32)
    return ColourTable(nodes, model.forward.grid.astype(np.float32), about_table)


def save(table: ColourTable, path: Path) -> None:
    """Write a table as one file, whole or not at all; the same table gives the same bytes.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    out = io.BytesIO()
    header = json.dumps({"format": _FORMAT, "about": dict(table.about)}, ensure_ascii=False, sort_keys=True)
    about = np.frombuffer(header.encode(), dtype=np.uint8)
    np.savez_compressed(out, nodes=table.nodes, seen=table.scanned, about=about)
    atomic.write(path, out.getvalue())


def load(path: Path) -> ColourTable:
    """The table of a file that `save` wrote.

    Raises
    ------
    InputError
        The file cannot be read, is no colour table, or is of a newer version.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            header = msgspec.json.decode(stored["about"].tobytes())
            if header["format"] != _FORMAT:
                raise InputError(
                    f"{path} is a colour table of format {header['format']}; this program reads {_FORMAT}."
                )
            return ColourTable(stored["nodes"], stored["seen"], header["about"])
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror or error}.") from error
    except (ValueError, KeyError, TypeError, AttributeError, EOFError, SyntaxError, *_DAMAGED) as error:
        raise InputError(f"{path} is not a colour table that this program has written.") from error


def apply(raster: Raster, table: ColourTable, paper: ArrayLike | None = None) -> Raster:
    """The raster whose print, on the table's paper, scans as this raster laid on that paper would look.

    Thin ink shows the paper through, and a printer answers to the mixture otherwise than to the ink alone.  So it is
    the mixture that is looked up, and colour and cover are found that, on white, which sends nothing, give the device
    colour of the mixture.  The cover grows only where ink of the given cover cannot be dark enough.

    Parameters
    ----------
    raster : Raster
        Colours as the scanner of the hand sees them; pixels without cover stay as they are.
    table : ColourTable
    paper : (3,) float in 0–1, optional
        Scanned RGB of the sheet that is printed on; None: the table's own.

    Raises
    ------
    InputError
        A paper that is not three numbers in 0–1.

    Source: seed 000, §7.1; Porter and Duff 1984 (over).
    """
    white = np.asarray(table.paper if paper is None else paper, dtype=np.float32)
    if white.shape != (3,) or not ((white >= -0.05) & (white <= 1.05)).all():
        raise InputError(f"colour: the paper must be scanned RGB, three numbers in 0 to 1, not {paper!r}.")
    pixels = raster.rgba.reshape(-1, 4)
    inked = np.flatnonzero(pixels[:, 3] != 0)
    out = raster.rgba.copy()
    if len(inked):
        out.reshape(-1, 4)[inked] = _match_ink(pixels.take(inked, axis=0), table, white)
    return Raster(out, raster.dpi, raster.origin)


def _match_ink(ink: NDArray[np.float32], table: ColourTable, white: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 4) RGBA in device RGB of (n, 4) RGBA with cover, in scanned RGB."""
    channels = np.ascontiguousarray(ink.T)
    cover, bare = channels[3], 1 - channels[3]
    wanted = cover * channels[:3] + bare * white[:, None]
    # the table's own error at the paper must not print a veil where there is next to no ink
    veil = 1 - table.interpolate(white[None])
    lack = np.clip(1 - table.interpolate(wanted.T).T - bare * veil.T, 0, 1)
    covers = np.maximum(cover, np.maximum(np.maximum(lack[0], lack[1]), lack[2]))
    return np.stack([*(1 - lack / covers), covers], axis=1)
