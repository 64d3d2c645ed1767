"""Reads the jobs that a simulated queue was sent: PDFs of one picture a page, as `sinks.picture_pdf` writes them."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.values import Page

_POINTS = 72.0  # an inch
_OBJECT = re.compile(rb"(?:^|\n)(\d+) 0 obj\n")
_STREAM = b"stream\n"
_NUMBER = rb"(-?[\d.]+)"
_BOX = re.compile(rb"/MediaBox \[0 0 " + _NUMBER + rb" " + _NUMBER + rb"\]")
_PICTURE = re.compile(rb"/XObject << /\w+ (\d+) 0 R >>")
_CONTENT = re.compile(rb"/Contents (\d+) 0 R")
_PLACE = re.compile(rb"q " + b" ".join([_NUMBER] * 6) + rb" cm /Im Do Q")


def pages(path: Path, dpi: float) -> Iterator[tuple[Page, NDArray[np.uint8]]]:
    """Every page of a job: its sheet, mm, and what is to be printed on it, (h, w, 3) uint8 device RGB.

    Nothing is resampled: a picture has to lie on the printer's own grid.

    Parameters
    ----------
    dpi : of the printer.

    Raises
    ------
    InputError
        The file cannot be read, is no such PDF, or was made for another resolution.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}.") from error
    objects = _read_objects(data)
    sheets = [body for body in objects.values() if body.startswith(b"<< /Type /Page ")]
    if not sheets:
        raise InputError(
            f"{path}: the simulated printer reads only PDFs of one picture a page, as handout writes them."
        )
    for body in sheets:
        yield _read_page(body, objects, dpi, path)


def _read_objects(data: bytes) -> dict[int, bytes]:
    """The objects of the file by their number; a stream is skipped by its length, whatever is in it."""
    objects: dict[int, bytes] = {}
    at = 0
    while match := _OBJECT.search(data, at):
        start = at = match.end()
        ends = data.find(b"\nendobj", start)
        stream = data.find(_STREAM, start, ends if ends >= 0 else len(data))
        if stream >= 0:
            length = re.search(rb"/Length (\d+)", data[start:stream])
            if length is not None:
                at = stream + len(_STREAM) + int(length.group(1))
                ends = data.find(b"\nendobj", at)
        if ends < 0:
            break
        objects[int(match.group(1))] = data[start:ends]
        at = ends
    return objects


def _read_page(body: bytes, objects: dict[int, bytes], dpi: float, path: Path) -> tuple[Page, NDArray[np.uint8]]:
    box = _BOX.search(body)
    if box is None:
        raise InputError(f"{path}: a page without a size.")
    width, height = (float(side) for side in box.groups())
    sheet = np.full((round(height * dpi / _POINTS), round(width * dpi / _POINTS), 3), 255, dtype=np.uint8)
    size = Page(width * 25.4 / _POINTS, height * 25.4 / _POINTS)
    picture, content = _PICTURE.search(body), _CONTENT.search(body)
    if picture is None or content is None:
        return size, sheet
    pixels = _read_pixels(objects.get(int(picture.group(1)), b""), path)
    place = _PLACE.search(_stream(objects.get(int(content.group(1)), b"")))
    if place is None:
        raise InputError(f"{path}: a page whose picture has no place.")
    a, _, _, d, e, f = (float(number) for number in place.groups())
    wide, high = a * dpi / _POINTS, d * dpi / _POINTS
    if abs(wide - pixels.shape[1]) > 0.5 or abs(high - pixels.shape[0]) > 0.5:
        picture_dpi = pixels.shape[1] / a * _POINTS
        raise InputError(f"{path}: made for {picture_dpi:.0f} dpi, and the printer has {dpi:g} dpi.")
    # what falls beside the sheet is lost
    x, y = round(e * dpi / _POINTS), round((height - f - d) * dpi / _POINTS)
    rows = slice(max(y, 0), min(y + pixels.shape[0], sheet.shape[0]))
    columns = slice(max(x, 0), min(x + pixels.shape[1], sheet.shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        sheet[rows, columns] = pixels[rows.start - y : rows.stop - y, columns.start - x : columns.stop - x]
    return size, sheet


def _read_pixels(body: bytes, path: Path) -> NDArray[np.uint8]:
    sizes = [re.search(rb"/" + side + rb" (\d+)", body) for side in (b"Width", b"Height")]
    try:
        width, height = (int(size.group(1)) for size in sizes if size is not None)
        return np.frombuffer(zlib.decompress(_stream(body)), dtype=np.uint8).reshape(height, width, 3)
    except (ValueError, zlib.error) as error:
        raise InputError(f"{path}: a picture in it cannot be read ({error}).") from error


def _stream(body: bytes) -> bytes:
    return body.partition(_STREAM)[2].removesuffix(b"\nendstream")
