"""A simulated printer and a simulated flatbed, in place of the user who prints, writes in a chart's frame, and scans.

A page goes through what a person's page goes through: its job, a PDF of one picture a page as `sinks.picture_pdf`
writes it, is read, printed and scanned, each with faults on demand.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.libraries import cv2
from handout.profiles import Printer
from handout.simulated import printer
from handout.simulated.flatbed import SETTINGS, Flatbed
from handout.simulated.printer import Inkjet, Press
from handout.simulated.spectra import WAVELENGTHS, SimulatedSheet, WrittenSheet
from handout.values import Array, Page

WHITE = "white"  # paper that is plain
_DPI = 200  # enough for the marks of a chart and for lines of a pen, and sooner scanned than 300
_SHARPENED = 1.5  # the hand's pages were blurred by one scan already: a page seen twice is to look as if seen once
_INKED = 0.3  # of the usual amount of ink


@dataclass
class Loop:
    """Prints and scans documents as the simulated devices do.

    profile : of the simulated printer.
    press : the simulated printer; flatbed : the scanner; dpi : of scans.
    rng : decides how each page lies on the glass.
    hand : a scanned hand, whose pen writes in the frames of charts and strips; empty: nobody writes there.
    """

    profile: Printer
    press: Press
    flatbed: Flatbed = field(default_factory=Flatbed)
    dpi: int = _DPI
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    hand: str = ""

    def scan(self, document: Path, to: Path, frame: tuple[float, float, float, float] | None = None) -> list[Path]:
        """Print a document and scan its pages: a file each, beside `to`.

        frame : left, top, right, bottom, mm, of what the hand's pen writes in, on every page.

        Raises InputError: no document as this printer gets them.
        """
        paths = []
        for number, (_, pixels) in enumerate(pages(document, self.profile.dpi), 1):
            sheet = self.press.print_page(pixels, self.profile.dpi, self.profile.margins, self.rng)
            if frame is not None and self.hand:
                sheet = self._write_sheet(sheet, frame)
            picture = self.flatbed.scan(sheet, self.dpi, self.rng)
            paths.append(to.with_name(f"{to.stem}-{number}.tif"))
            write(picture, self.dpi, paths[-1])
        return paths

    def _write_sheet(self, sheet: SimulatedSheet, frame: tuple[float, float, float, float]) -> SimulatedSheet:
        """The sheet with a line of the hand's writing in the frame; its pages count as scans of a usual flatbed."""
        from handout.calibrating import pen_reference
        from handout.colour.ink_match import strokes_in
        from handout.hand.library import find

        hand = find(self.hand)
        if hand.pages is None:
            return sheet
        density, paper, dpi = pen_reference.writing(hand)
        lines = strokes_in(density, dpi)
        if lines is None:
            return sheet
        core = np.median(lines.rings[1], axis=0)
        amount = density.mean(axis=2) / float(core.mean())
        height = round((frame[3] - frame[1]) * dpi / 25.4)
        ink = np.convolve((amount > _INKED).sum(axis=1), np.ones(height), "valid")
        row = int(ink.argmax()) if len(ink) > 1 else 0
        spectrum = ink_of(paper * np.exp(-core), paper, Flatbed())
        return write_on_sheet(sheet, frame, amount[row : row + height], dpi, spectrum, _SHARPENED)


def write(picture: NDArray[np.unsignedinteger[Any]], dpi: float, path: Path) -> None:
    """A scan as a TIFF that says its resolution."""
    import tifffile

    tifffile.imwrite(path, picture, photometric="rgb", resolution=(dpi, dpi), resolutionunit="INCH")


def make_loop(profile: Printer, paper: str = WHITE, faults: Iterable[str] = (), hand: str = "") -> Loop:
    """The loop of a simulated printer; `faults` are of the printer, or settings of the scanner (`SETTINGS`).

    Raises InputError: not a simulated printer, a paper that it does not have, or an unknown fault.
    """
    if not profile.simulated:
        raise InputError(f"{profile.title} is not simulated: print the chart on it and scan that.")
    paper_name = WHITE if paper == "plain" else paper
    printer.find_paper(paper_name)
    settings = {name: value for fault in faults for name, value in SETTINGS.get(fault, {}).items()}
    press = Inkjet(paper_name, faults=[fault for fault in faults if fault not in SETTINGS])
    return Loop(profile, press, Flatbed(**settings), hand=hand)


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

    dpi : of the printer.

    Raises InputError: the file cannot be read, is no such PDF, or was made for another resolution.
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
    image = objects.get(int(picture.group(1)), b"")
    sizes = [re.search(rb"/" + side + rb" (\d+)", image) for side in (b"Width", b"Height")]
    try:
        wide, high = (int(side.group(1)) for side in sizes if side is not None)
        pixels = np.frombuffer(zlib.decompress(_stream(image)), dtype=np.uint8).reshape(high, wide, 3)
    except (ValueError, zlib.error) as error:
        raise InputError(f"{path}: a picture in it cannot be read ({error}).") from error
    place = _PLACE.search(_stream(objects.get(int(content.group(1)), b"")))
    if place is None:
        raise InputError(f"{path}: a page whose picture has no place.")
    a, _, _, d, e, f = (float(number) for number in place.groups())
    if abs(a * dpi / _POINTS - pixels.shape[1]) > 0.5 or abs(d * dpi / _POINTS - pixels.shape[0]) > 0.5:
        picture_dpi = pixels.shape[1] / a * _POINTS
        raise InputError(f"{path}: made for {picture_dpi:.0f} dpi, and the printer has {dpi:g} dpi.")
    # what falls beside the sheet is lost
    x, y = round(e * dpi / _POINTS), round((height - f - d) * dpi / _POINTS)
    rows = slice(max(y, 0), min(y + pixels.shape[0], sheet.shape[0]))
    columns = slice(max(x, 0), min(x + pixels.shape[1], sheet.shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        sheet[rows, columns] = pixels[rows.start - y : rows.stop - y, columns.start - x : columns.stop - x]
    return size, sheet


def _stream(body: bytes) -> bytes:
    return body.partition(_STREAM)[2].removesuffix(b"\nendstream")


_ROUNDS = 12  # of the fixed-point iteration; set by eye
_INSET = 0.8  # mm from the frame
_BLUR = 0.06  # mm, standard deviation of what a scan at 300 dpi makes of a point
_MOST = 2.5  # of the usual amount


def ink_of(colour: Array, paper: Array, flatbed: Flatbed) -> Array:
    """(31,) density of an ink that a flatbed shows as `colour` on paper that it shows as `paper`, (3,) in 0–1.

    Between the middles of the sensor's colours it runs straight.
    """
    bands = flatbed.bands
    wanted = np.clip(np.asarray(colour) / np.asarray(paper), 0.02, 1.0) ** flatbed.gamma
    at = np.argmax(bands, axis=0)
    order = np.argsort(at)
    density = -np.log10(wanted)
    for _ in range(_ROUNDS):
        spectrum = np.interp(WAVELENGTHS, WAVELENGTHS[at[order]], density[order])
        density = np.maximum(density + np.log10((10**-spectrum @ bands) / wanted), 0)
    return np.interp(WAVELENGTHS, WAVELENGTHS[at[order]], density[order])


def write_on_sheet(sheet: SimulatedSheet, field: tuple[float, float, float, float], amount: NDArray[Any], dpi: float,
            density: Array, sharpened: float = 0.0) -> SimulatedSheet:  # fmt: skip
    """A sheet on which somebody wrote.

    field : left, top, right, bottom, mm, of the frame; what does not fit into it is left out.
    amount : (h, w), how much ink, 1 where it is usual, at `dpi`.
    density : (31,) of the ink, see `WrittenSheet`.
    sharpened : how much is put back of what an earlier scan of the writing has blurred.
    """
    scale = sheet.dpi / 25.4
    left, top, right, bottom = (round(edge * scale) for edge in np.add(field, (_INSET, _INSET, -_INSET, -_INSET)))
    size = (round(amount.shape[1] * sheet.dpi / dpi), round(amount.shape[0] * sheet.dpi / dpi))
    ink = cv2.resize(np.asarray(amount, dtype=np.float32), size, interpolation=cv2.INTER_LINEAR)
    if sharpened:
        ink = ink + sharpened * (ink - cv2.GaussianBlur(ink, (0, 0), max(0.3, _BLUR * scale)))
    inked = np.clip(ink[: bottom - top, : right - left], 0, _MOST).astype(np.float32)
    return replace(sheet, written=(*sheet.written, WrittenSheet((top, left), inked, np.asarray(density))))
