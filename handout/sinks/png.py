"""Pixels as PNG, with their resolution and where they came from."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import __version__
from handout.errors import InputError
from handout.inking import plain
from handout.sinks import about as origin
from handout.values import Raster

_ROWS = 256  # that are compressed at once


def to_png(
    image: Raster | NDArray[np.uint8],
    dpi: float | None = None,
    *,
    about: Mapping[str, Any] | None = None,
    paper: tuple[float, float, float] | None = (1.0, 1.0, 1.0),
    palette: NDArray[np.uint8] | None = None,
) -> bytes:
    """An image as PNG; the same pixels give the same bytes.

    image : Raster, or (h, w, 3) or (h, w) uint8: a raster is laid on `paper`.
    dpi : pixels per inch, stored as ``pHYs``; None: that of the raster.
    about : stored as text: ``seed``, ``hand``, and all of it as JSON under ``about``.
    paper : (r, g, b) in 0–1, or None: None keeps a raster transparent.
    palette : (256, 3) uint8, optional: colours of the values of (h, w) pixels; a page of one ink takes half the bytes
        so.

    Raises InputError: pixels without a resolution, or of another form.
    """
    pixels = _pixels(image, paper)
    resolution = image.dpi if dpi is None and isinstance(image, Raster) else dpi
    if resolution is None or not resolution > 0:
        raise InputError("A PNG of bare pixels needs a resolution: give dpi.")
    kind = 3 if palette is not None else {1: 0, 3: 2, 4: 6}[pixels[0, 0].size]
    chunks = [(b"IHDR", struct.pack(">2I5B", pixels.shape[1], len(pixels), 8, kind, 0, 0, 0))]
    chunks += [(b"PLTE", palette.tobytes())] if palette is not None else []
    chunks += [(b"pHYs", struct.pack(">2IB", *2 * (round(resolution / 0.0254),), 1))]
    told = {"Software": f"handout {__version__}"}
    told |= {key: str(origin.plain(about[key])) for key in ("seed", "hand") if about and about.get(key) is not None}
    for key, text in (told | ({"about": origin.json_text(about)} if about else {})).items():
        name, head = (b"tEXt", b"\0") if text.isascii() else (b"iTXt", bytes(5))
        chunks += [(name, key.encode() + head + text.encode())]
    chunks += [*((b"IDAT", part) for part in _packed(pixels, palette is not None)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks
    )


def _packed(pixels: NDArray[np.uint8], by_palette: bool) -> Iterator[bytes]:
    """The pixels, compressed, some rows at a time: numbers of a palette as they are, colours less those above them.

    Of colours only runs are looked for: in a third of the time a white page takes the same room, one of grain 16 % more
    than what an encoder makes that tries five filters a row (pages of 600 and 300 dpi).
    """
    rows = pixels.reshape(len(pixels), -1)
    packer = zlib.compressobj(6, strategy=zlib.Z_DEFAULT_STRATEGY if by_palette else zlib.Z_RLE)
    for top in range(0, len(rows), _ROWS):
        part = rows[top : top + _ROWS]
        filtered = np.empty((len(part), rows.shape[1] + 1), dtype=np.uint8)
        filtered[:, 0], filtered[:, 1:] = 0 if by_palette else 2, part
        if not by_palette:
            filtered[top == 0 :, 1:] -= rows[max(top - 1, 0) : top + len(part) - 1]
        yield packer.compress(filtered.data)
    yield packer.flush()


def _pixels(image: Raster | NDArray[np.uint8], paper: tuple[float, float, float] | None) -> NDArray[np.uint8]:
    if isinstance(image, Raster):
        return image.rgba if paper is None else plain.flatten(image, paper)
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] not in (3, 4)):
        raise InputError(f"A PNG needs (h, w, 3) or (h, w) of uint8, not {image.shape} of {image.dtype}.")
    return image
