"""The colour table of one printer, paper and scanner, pages that go through it, and what of an ink is lost there.

A table turns the scanned colour that is wanted into the device colour to send.  `apply` sends a page of ink on
transparent ground through it; `reach` says how much of a hand's ink the printer cannot reach.
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
from numpy.typing import NDArray

from handout import __version__, atomic
from handout.colour.models import Model, inverse
from handout.colour.models.forward import Forward, Nodes, look_up
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

    Raises InputError: arrays of other shapes, or numbers that are no colours.
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

    Raises InputError: a size outside 9–129.
    """
    if not _SIZES[0] <= size <= _SIZES[1]:
        raise InputError(f"colour table: {size} nodes a side are outside {_SIZES[0]} to {_SIZES[1]}.")
    device = model.nodes(size)
    about_table = {**(about or {}), "method": model.method, "version": __version__}
    nodes = device.reshape(size, size, size, 3).astype(np.float32)
    return ColourTable(nodes, model.forward.grid.astype(np.float32), about_table)


def save(table: ColourTable, path: Path) -> None:
    """Write a table as one file, whole or not at all; the same table gives the same bytes.

    Raises InputError: the file cannot be written.
    """
    out = io.BytesIO()
    header = json.dumps({"format": _FORMAT, "about": dict(table.about)}, ensure_ascii=False, sort_keys=True)
    about = np.frombuffer(header.encode(), dtype=np.uint8)
    np.savez_compressed(out, nodes=table.nodes, seen=table.scanned, about=about)
    atomic.write(path, out.getvalue())


def load(path: Path) -> ColourTable:
    """The table of a file that `save` wrote.

    Raises InputError: the file cannot be read, is no colour table, or is of a newer version.
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


def apply(raster: Raster, table: ColourTable) -> Raster:
    """The raster whose print, on the table's paper, scans as this raster laid on that paper would look.

    Thin ink shows the paper through, and a printer answers to the mixture otherwise than to the ink alone.  So it is
    the mixture that is looked up, and colour and cover are found that, on white, which sends nothing, give the device
    colour of the mixture.  The cover grows only where ink of the given cover cannot be dark enough.

    raster : colours as the scanner of the hand sees them; pixels without cover stay as they are.

    Source: seed 000, §7.1; Porter and Duff 1984 (over).
    """
    white = np.asarray(table.paper, dtype=np.float32)
    inked, out = np.flatnonzero(raster.inked), raster.rgba.copy()
    if len(inked):
        ink = np.asarray(out.reshape(-1, 4).take(inked, axis=0) / 255, dtype=np.float32)
        out.reshape(-1, 4)[inked] = np.rint(_match_ink(ink, table, white) * 255)
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


SEEN = 1.0  # ΔE00 from which a colour counts as out of reach: about what is just noticed
_SWATCH, _GAP, _SWATCHES = 48, 6, 12  # pixels; how many


@dataclass(frozen=True, eq=False)
class Reach:
    """What becomes of samples of ink.

    wanted, shown : (n, 3) float: scanned RGB of the samples, and of the nearest that the printer can print.
    lost : (n,) float, ΔE00 between them.
    """

    wanted: Array
    shown: Array
    lost: Array

    __repr__ = one_line

    @property
    def share_out(self) -> float:
        """Share of the samples that lose more than `SEEN`, 0–1."""
        return float((self.lost > SEEN).mean())

    @property
    def mean(self) -> float:
        """ΔE00 lost, mean of the samples out of reach; 0 without any."""
        far = self.lost[self.lost > SEEN]
        return float(far.mean()) if len(far) else 0.0

    def __str__(self) -> str:
        return tell_loss(self.share_out, self.mean)


def tell_loss(out: float, mean: float, whose: str = "") -> str:
    """The sentence, the same everywhere, on what of an ink cannot be printed.

    out : share of the ink's samples that are out of reach; mean : ΔE00 lost there, as `Reach` has both.
    whose : what the ink is called: "of house-joined".
    """
    ink = f"the ink {whose}" if whose else "the ink"
    if not out:
        return f"This printer can print all of {ink} (within ΔE00 {SEEN:g})."
    return (
        f"This printer cannot print {out:.0%} of {ink}, and prints the nearest colour instead: off by ΔE00 {mean:.1f} "
        "on the mean, which only another paper or printer can better."
    )


def reach(samples: Array, table: ColourTable) -> Reach:
    """What of (n, 3) scanned RGB samples of ink, 0–1, the printer of a table can print.

    Raises InputError: no samples, or samples that are not (n, 3) numbers in 0–1.
    """
    wanted = np.asarray(samples, dtype=np.float64)
    if wanted.ndim != 2 or wanted.shape[1:] != (3,) or not len(wanted) or not ((wanted >= 0) & (wanted <= 1)).all():
        raise InputError(f"gamut: samples of ink must be (n, 3) scanned RGB in 0 to 1, not {np.shape(samples)}.")
    forward = Forward(np.asarray(table.scanned, dtype=np.float64))
    device, lost = inverse.printable(forward, wanted)
    return Reach(wanted, forward.inside(device), lost)


def swatches(reach: Reach) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: wanted colours over what is printed for them, from the least lost to the most."""
    order = np.argsort(reach.lost, kind="stable")
    chosen = order[np.linspace(0, len(order) - 1, min(_SWATCHES, len(order))).round().astype(int)]
    tile = _SWATCH + _GAP
    sheet = np.full((2 * _SWATCH + 2 * _GAP, len(chosen) * tile + _GAP, 3), 255, dtype=np.uint8)
    for row, colours in enumerate((reach.wanted, reach.shown)):
        for at, which in enumerate(chosen):
            x, y = _GAP + at * tile, _GAP + row * _SWATCH
            sheet[y : y + _SWATCH, x : x + _SWATCH] = np.rint(np.clip(colours[which], 0, 1) * 255)
    return sheet
