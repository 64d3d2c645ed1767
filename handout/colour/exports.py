"""A colour table in the formats of other programs: the registry of what ``handout calibrate export`` can write.

Add a format: a function that gives the bytes, its line in `FORMATS`, and a line about it in the help of the command.
The command reads the names of the formats here when it starts, so nothing heavy is imported at the head.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from handout.colour.table import ColourTable


@dataclass(frozen=True, eq=False)
class ExportSource:
    """What is exported: a table, when it was made and what it is called; the files that it and its patches lie in."""

    table: ColourTable
    date: datetime
    title: str
    table_file: Path
    patches_file: Path | None


def cube(table: ColourTable) -> bytes:
    """A table as ``.cube`` (Cube LUT Specification 1.0), for programs that correct pictures; red varies fastest."""
    title = " ".join(str(value) for value in table.about.values()).replace('"', "'").replace("\n", " ")
    rows = table.nodes.transpose(2, 1, 0, 3).reshape(-1, 3)
    head = [f'TITLE "{title}"', f"LUT_3D_SIZE {table.size}", "DOMAIN_MIN 0.0 0.0 0.0", "DOMAIN_MAX 1.0 1.0 1.0"]
    lines = [*head, *(f"{r:.6f} {g:.6f} {b:.6f}" for r, g, b in rows.tolist())]
    return ("\n".join(lines) + "\n").encode()


def picture(table: ColourTable, across: int = 11) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: slices of equal blue, `across` a row; of each the wanted colours over what is sent for them."""
    import numpy as np

    from handout.colour.models.forward import lattice

    wanted = lattice(table.size).reshape(table.nodes.shape)
    tiles = [np.concatenate([wanted[:, :, k], np.clip(table.nodes[:, :, k], 0, 1)]) for k in range(table.size)]
    tall, wide = 2 * table.size, table.size
    rows = -(-table.size // across)
    sheet = np.ones((rows * (tall + 2), across * (wide + 2), 3))
    for k, tile in enumerate(tiles):
        y, x = k // across * (tall + 2), k % across * (wide + 2)
        sheet[y : y + tall, x : x + wide] = tile
    return np.rint(sheet * 255).astype(np.uint8)


def png(table: ColourTable) -> bytes:
    """`picture` as a PNG, each node 4 pixels wide."""
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(picture(table).repeat(4, axis=0).repeat(4, axis=1)).save(out, "PNG")
    return out.getvalue()


def _profiles() -> Any:
    from handout.colour import icc

    return icc


def _ti3(source: ExportSource) -> bytes:
    assert source.patches_file is not None
    return source.patches_file.read_bytes()


FORMATS: dict[str, Callable[[ExportSource], bytes]] = {
    "icc": lambda source: _profiles().output_profile(source.table, source.date, source.title),
    "icc-link": lambda source: _profiles().device_link(source.table, source.date, source.title),
    "cube": lambda source: cube(source.table),
    "ti3": _ti3,
    "png": lambda source: png(source.table),
    "npz": lambda source: source.table_file.read_bytes(),
}
