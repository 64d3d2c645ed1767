"""A page as the bytes of one document, in the formats that printers take: PDF, PWG Raster, URF, PNG.

A new format is one more function in `WRITERS`.  PWG Raster and URF, its relative, are for printers that read no PDF:
both hold compressed lines, of which each says how often it repeats, then runs of equal and of different pixels.

Source: PWG 5102.4 §4 (PWG Raster); URF as CUPS reads it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from handout.inking.device_pixels import WHITE, DevicePixels
from handout.printing import media
from handout.sinks.picture_pdf import PdfWriter
from handout.values import Page

About = Mapping[str, object]
# the sheet as it is fed, its pixels, what is stored with it → the document
Writer = Callable[[Page, DevicePixels, About], bytes]

Pixels = NDArray[np.uint8]
_SYNC, _HEADER = b"RaS2", 1796  # big-endian; bytes of a page's header
_URF_SYNC, _URF_HEADER = b"UNIRAST\0", 32
_SRGB, _CHUNKED = 19, 0  # codes of colour space and order, PWG 5102.4 table 2
_MOST_LINES, _MOST_PIXELS = 256, 128  # repeated lines and pixels of a run that one byte can count
# where the fields of a page's header stand, PWG 5102.4 table 2: offset → what is kept there
_RESOLUTION, _COPIES, _PAGE_SIZE, _WIDTH, _HEIGHT = 276, 340, 352, 372, 376
_BITS, _BITS_OF_PIXEL, _BYTES_OF_LINE, _ORDER, _SPACE, _COLOURS = 384, 388, 392, 396, 400, 420
_TOTAL_PAGES, _CROSS_FEED, _FEED, _BOX = 452, 456, 460, 464
_CLASS, _MEDIA_TYPE, _SIZE_NAME = 0, 128, 1732


def page_pixels(page: Page, pixels: DevicePixels) -> Pixels:
    """The whole sheet as (height, width, 3) 8-bit device RGB, white where there is no ink."""
    scale = pixels.dpi / 25.4
    sheet = np.full((round(page.height * scale), round(page.width * scale), 3), WHITE, np.uint8)
    cropped = pixels.crop_white()
    if cropped is None:
        return sheet
    ink, x, y = cropped
    # ink beyond the edge of the sheet is cut off, as by a printer
    left, top = max(-x, 0), max(-y, 0)
    ink = ink[top : max(sheet.shape[0] - y, 0), left : max(sheet.shape[1] - x, 0)]
    sheet[y + top : y + top + ink.shape[0], x + left : x + left + ink.shape[1]] = ink
    return sheet


def pwg(pixels: Pixels, dpi: int, page: Page, media: str = "") -> bytes:
    """One page of PWG Raster.

    pixels : (height, width, 3) uint8: sRGB, or whatever the printer takes for it.
    page : the sheet as it is fed, mm.
    media : its PWG name, at most 63 characters.
    """
    height, width = pixels.shape[:2]
    header = bytearray(_HEADER)
    points = [round(side * 72 / 25.4) for side in (page.width, page.height)]
    fields = {
        _RESOLUTION: (dpi, dpi), _COPIES: (1,), _PAGE_SIZE: points, _WIDTH: (width,), _HEIGHT: (height,),
        _BITS: (8,), _BITS_OF_PIXEL: (24,), _BYTES_OF_LINE: (3 * width,), _ORDER: (_CHUNKED,), _SPACE: (_SRGB,),
        _COLOURS: (3,), _TOTAL_PAGES: (1,), _CROSS_FEED: (1,), _FEED: (1,), _BOX: (0, 0, width, height),
    }  # fmt: skip
    for offset, values in fields.items():
        struct.pack_into(f">{len(values)}I", header, offset, *values)
    for offset, text in ((_CLASS, "PwgRaster"), (_MEDIA_TYPE, "auto"), (_SIZE_NAME, media)):
        words = text.encode("ascii")[:63]
        header[offset : offset + len(words)] = words
    return _SYNC + bytes(header) + b"".join(_compress_lines(pixels))


def urf(pixels: Pixels, dpi: int) -> bytes:
    """One page of URF: (height, width, 3) uint8 sRGB, 24 bits a pixel, one side."""
    height, width = pixels.shape[:2]
    header = bytearray(_URF_HEADER)
    bits, space_srgb, one_sided, normal = 24, 1, 1, 4
    struct.pack_into(">4B", header, 0, bits, space_srgb, one_sided, normal)
    struct.pack_into(">3I", header, 12, width, height, dpi)
    return _URF_SYNC + struct.pack(">I", 1) + bytes(header) + b"".join(_compress_lines(pixels))


def _compress_lines(pixels: Pixels) -> Iterator[bytes]:
    """The compressed lines; equal lines that follow each other are written once."""
    new = np.ones(len(pixels), bool)
    new[1:] = (pixels[1:] != pixels[:-1]).any(axis=(1, 2))
    starts = np.flatnonzero(new)
    for start, end in zip(starts, [*starts[1:], len(pixels)], strict=True):
        packed = _pack_line(pixels[start])
        for first in range(start, end, _MOST_LINES):
            yield bytes([min(end - first, _MOST_LINES) - 1]) + packed


def _pack_line(line: Pixels) -> bytes:
    """One line: runs of an equal pixel as (count − 1, pixel), different pixels as (257 − count, pixels …)."""
    edges = np.flatnonzero((line[1:] != line[:-1]).any(axis=1)) + 1
    starts, ends = [0, *edges.tolist()], [*edges.tolist(), len(line)]
    data, loose = line.tobytes(), 0  # loose: single pixels before the present run
    parts: list[bytes] = []
    for start, end in zip(starts, ends, strict=True):
        if end - start == 1:
            loose += 1
            continue
        parts += _pack_literal(data, start - loose, start)
        loose = 0
        for first in range(start, end, _MOST_PIXELS):
            parts.append(bytes([min(end - first, _MOST_PIXELS) - 1]) + data[3 * start : 3 * start + 3])
    return b"".join([*parts, *_pack_literal(data, len(line) - loose, len(line))])


def _pack_literal(data: bytes, start: int, end: int) -> Iterator[bytes]:
    for first in range(start, end, _MOST_PIXELS):
        last = min(first + _MOST_PIXELS, end)
        # a single pixel is a run of one: a count of 257 − 1 has no byte
        yield bytes([257 - (last - first) if last - first > 1 else 0]) + data[3 * first : 3 * last]


def _pdf(page: Page, pixels: DevicePixels, about: About) -> bytes:
    stream = BytesIO()
    writer = PdfWriter(stream, about)
    writer.add(page, pixels)
    writer.finish()
    return stream.getvalue()


def _pwg(page: Page, pixels: DevicePixels, about: About) -> bytes:
    name = media.name(page)
    return pwg(page_pixels(page, pixels), round(pixels.dpi), page, "" if name.startswith("Custom") else name)


def png(pixels: Pixels, dpi: float) -> bytes:
    """(height, width, 3) uint8 as a PNG."""
    from PIL import Image

    stream = BytesIO()
    Image.fromarray(pixels).save(stream, "PNG", dpi=(dpi, dpi))
    return stream.getvalue()


WRITERS: Mapping[str, Writer] = {
    "pdf": _pdf,
    "pwg": _pwg,
    "urf": lambda page, pixels, about: urf(page_pixels(page, pixels), round(pixels.dpi)),
    "png": lambda page, pixels, about: png(page_pixels(page, pixels), pixels.dpi),
}
# what IPP calls them
MIME = {"pdf": "application/pdf", "pwg": "image/pwg-raster", "urf": "image/urf", "png": "image/png"}
