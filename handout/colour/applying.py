"""A page of ink through a colour table."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.colour.table import ColourTable
from handout.errors import InputError
from handout.values import Raster

_SHARE = 0.35  # of an 8-bit page that is inked, above which Pillow's own table is faster for all of it


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
        out.reshape(-1, 4)[inked] = _matched(pixels.take(inked, axis=0), table, white)
    return Raster(out, raster.dpi, raster.origin)


def _matched(ink: NDArray[np.float32], table: ColourTable, white: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 4) RGBA in device RGB of (n, 4) RGBA with cover, in scanned RGB."""
    channels = np.ascontiguousarray(ink.T)
    cover, bare = channels[3], 1 - channels[3]
    wanted = cover * channels[:3] + bare * white[:, None]
    # the table's own error at the paper must not print a veil where there is next to no ink
    veil = 1 - table.unclamped(white[None])
    lack = np.clip(1 - table.unclamped(wanted.T).T - bare * veil.T, 0, 1)
    covers = np.maximum(cover, np.maximum(np.maximum(lack[0], lack[1]), lack[2]))
    return np.stack([*(1 - lack / covers), covers], axis=1)


def apply_page(pixels: NDArray[np.uint8], table: ColourTable) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 to send for (h, w, 3) uint8 wanted; white (255, 255, 255) is bare paper and stays.

    Where ink covers little of the page, only it is looked up.

    Raises
    ------
    InputError
        Pixels of another form.
    """
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3:
        raise InputError(f"colour: a page must be (h, w, 3) of uint8, not {pixels.shape} of {pixels.dtype}.")
    flat = pixels.reshape(-1, 3)
    inked = np.flatnonzero(~_white(pixels).ravel())
    if len(inked) > _SHARE * len(flat):
        return _whole(pixels, table)
    out = flat.copy()
    out[inked] = np.rint(table(flat.take(inked, axis=0) * np.float32(1 / 255)) * 255).astype(np.uint8)
    return out.reshape(pixels.shape)


def _whole(pixels: NDArray[np.uint8], table: ColourTable) -> NDArray[np.uint8]:
    from PIL import Image, ImageFilter

    rows = table.nodes.transpose(2, 1, 0, 3).reshape(-1)
    lut = ImageFilter.Color3DLUT(table.size, rows.tolist())
    out = np.array(Image.fromarray(pixels).filter(lut))
    out[_white(pixels)] = 255
    return out


def _white(pixels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    return np.asarray((pixels[..., 0] & pixels[..., 1] & pixels[..., 2]) == 255)
