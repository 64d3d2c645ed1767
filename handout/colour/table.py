"""The table of one printer, paper and scanner: what to send so that a scan shows the colour that is wanted."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import __version__, atomic
from handout.colour.models import Model
from handout.colour.models.forward import lattice
from handout.colour.tetrahedra import Nodes, look_up
from handout.errors import InputError
from handout.summary import one_line
from handout.values import Array

SIZE = 33
_SIZES = (9, 129)
_FORMAT = 1


@dataclass(frozen=True, eq=False)
class ColourTable:
    """Wanted scanned RGB → device RGB on an even grid over the cube.

    nodes : (s, s, s, 3) float32: device RGB, unclamped, wanted at scanned RGB (i, j, k) / (s − 1); values are cut to
        0–1 after interpolation only.
    seen : (t, t, t, 3) float32: the model the other way, scanned RGB of device RGB (i, j, k) / (t − 1).
    about : printer, paper, scanner, date, method, version …

    Raises
    ------
    InputError
        Arrays of other shapes, or numbers that are not finite.
    """

    nodes: Nodes
    seen: Nodes
    about: Mapping[str, str] = field(default_factory=dict)

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name in ("nodes", "seen"):
            array = np.array(getattr(self, name), dtype=np.float32)
            side = len(array) if array.ndim else 0
            if array.shape != (side,) * 3 + (3,) or not _SIZES[0] <= side <= _SIZES[1] or not np.isfinite(array).all():
                raise InputError(
                    f"colour table: {name} must be finite numbers of the shape (s, s, s, 3) with s from "
                    f"{_SIZES[0]} to {_SIZES[1]}; here it is {array.shape}."
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
        return np.asarray(self.seen[-1, -1, -1])

    def unclamped(self, scanned: Array | NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, 3) device RGB of (n, 3) scanned RGB, as interpolated."""
        return look_up(self.nodes, scanned)

    def __call__(self, scanned: Array | NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, 3) device RGB in 0–1 to send for (n, 3) wanted scanned RGB."""
        return np.clip(self.unclamped(scanned), 0, 1)


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
    said = {**(about or {}), "method": model.method, "version": __version__}
    nodes = device.reshape(size, size, size, 3).astype(np.float32)
    return ColourTable(nodes, model.forward.grid.astype(np.float32), said)


def save(table: ColourTable, path: Path) -> None:
    """Write a table as one file, whole or not at all; the same table gives the same bytes.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    out = io.BytesIO()
    said = json.dumps({"format": _FORMAT, "about": dict(table.about)}, ensure_ascii=False, sort_keys=True)
    about = np.frombuffer(said.encode(), dtype=np.uint8)
    np.savez_compressed(out, nodes=table.nodes, seen=table.seen, about=about)
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
            said = json.loads(stored["about"].tobytes())
            if said["format"] != _FORMAT:
                raise InputError(f"{path} is a colour table of format {said['format']}; this program reads {_FORMAT}.")
            return ColourTable(stored["nodes"], stored["seen"], said["about"])
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror or error}.") from error
    except (ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} is not a colour table that this program has written.") from error


def write_cube(table: ColourTable, path: Path) -> None:
    """Write a table as ``.cube`` (Cube LUT Specification 1.0), for programs that correct pictures; red varies fastest.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    title = " ".join(str(value) for value in table.about.values()).replace('"', "'").replace("\n", " ")
    rows = table.nodes.transpose(2, 1, 0, 3).reshape(-1, 3)
    head = [f'TITLE "{title}"', f"LUT_3D_SIZE {table.size}", "DOMAIN_MIN 0.0 0.0 0.0", "DOMAIN_MAX 1.0 1.0 1.0"]
    lines = [*head, *(f"{r:.6f} {g:.6f} {b:.6f}" for r, g, b in rows.tolist())]
    atomic.write(path, ("\n".join(lines) + "\n").encode())


def picture(table: ColourTable, across: int = 11) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: slices of equal blue, `across` a row; of each the wanted colours over what is sent for them."""
    wanted = lattice(table.size).reshape(table.nodes.shape)
    tiles = [np.concatenate([wanted[:, :, k], np.clip(table.nodes[:, :, k], 0, 1)]) for k in range(table.size)]
    tall, wide = 2 * table.size, table.size
    rows = -(-table.size // across)
    sheet = np.ones((rows * (tall + 2), across * (wide + 2), 3))
    for k, tile in enumerate(tiles):
        y, x = k // across * (tall + 2), k % across * (wide + 2)
        sheet[y : y + tall, x : x + wide] = tile
    return np.rint(sheet * 255).astype(np.uint8)


def write_picture(table: ColourTable, path: Path) -> None:
    """Write `picture` as a PNG, each node 4 pixels wide.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(picture(table).repeat(4, axis=0).repeat(4, axis=1)).save(out, "PNG")
    atomic.write(path, out.getvalue())
