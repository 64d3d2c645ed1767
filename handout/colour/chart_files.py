"""A chart as the printer's own pixels, and as the .ti1, .ti2 and .ti3 tables that ArgyllCMS takes.

Every edge in the pixels is on a boundary of pixels and nothing is smoothed but words: the printer receives exactly the
colours that the reading expects.

A scanner measures no colour: the XYZ in a .ti3 takes the scan's numbers for sRGB (IEC 61966-2-1), adapted to D50.  That
is near enough to look at the table with other programs, and no basis for a profile of the printer.  The numbers of the
scan themselves are in SCAN_R, SCAN_G and SCAN_B, percent of full scale, and their standard error in SCAN_SE.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import handout
from handout.colour import cgats, conversions
from handout.colour.chart import CELLS, FRAME, Chart, ChartPage, dictionary, letters
from handout.errors import InputError
from handout.libraries import cv2
from handout.values import Array, readonly

if TYPE_CHECKING:
    from handout.colour.models.forward import Patches
    from handout.colour.reading import ChartReading


DPI = (300.0, 2400.0)  # below, letters and marks break up; above, a page takes gigabytes
_INCH = 25.4
_TITLE, _WORDS, _NAMES = 3.0, 2.1, 1.7  # mm, sizes of the letters
_ASK = ("Write some words in the frame with the", "pen of the handwriting, before you scan:")
_LINES = (3.2, 5.4)  # mm under the top of the title: where lines of words begin


def render(page: ChartPage, dpi: float, lines: tuple[str, ...] = (), title: str = "") -> NDArray[np.uint8]:
    """The page at the printer's resolution.

    dpi : 300–2400.
    lines : at most two, under the title: printer, paper, date.
    title : empty: that of the chart.

    Returns (h, w, 3) uint8: device RGB; pixel (i, j) covers ((j … j + 1), (i … i + 1)) · 25.4 / dpi mm of the sheet.
    Raises InputError: a resolution outside its bounds, or words that cannot be printed there.
    """
    if not DPI[0] <= dpi <= DPI[1]:
        raise InputError(f"chart: {dpi:g} dpi is outside {DPI[0]:g} to {DPI[1]:g}.")
    if len(lines) > len(_LINES):
        raise InputError(f"chart: {len(lines)} lines of words, and there is room for {len(_LINES)}.")
    scale = dpi / _INCH
    pixels = np.full((round(page.paper.height * scale), round(page.paper.width * scale), 3), 255, dtype=np.uint8)
    colours = np.rint(page.device * 255).astype(np.uint8)
    for (left, top, right, bottom), colour in zip(_edges(page.boxes, scale), colours, strict=True):
        pixels[top:bottom, left:right] = colour
    for number, corners in zip(page.ids.tolist(), page.marks, strict=True):
        cells = np.asarray(cv2.aruco.generateImageMarker(dictionary(), number, CELLS))
        across, down = np.rint(np.linspace(corners[0], corners[2], CELLS + 1) * scale).astype(int).T
        for row, column in np.argwhere(cells < 128).tolist():
            pixels[down[row] : down[row + 1], across[column] : across[column + 1]] = 0
    _draw_names(pixels, page, scale)
    _draw_field(pixels, page, scale)
    x, y, width = page.title
    title = title or f"Colour chart {page.version}   page {page.number} of {page.pages}   {page.paper.name}"
    _draw_words(pixels, title, (x, y), _TITLE, width, scale)
    for line, under in zip(lines, _LINES, strict=False):
        _draw_words(pixels, line, (x, y + under), _WORDS, width, scale)
    return pixels


def _edges(boxes: NDArray[np.float64], scale: float) -> list[list[int]]:
    """Boxes (n, 4) in mm as pixels."""
    edges: list[list[int]] = np.rint(boxes * scale).astype(int).tolist()
    return edges


def _draw_names(pixels: NDArray[np.uint8], page: ChartPage, scale: float) -> None:
    """Letters over the columns and figures beside the rows."""
    x, y = page.origin
    for column in range(page.columns):
        spot = (x + (column + 0.5) * page.pitch, y - _NAMES - 0.3)
        _draw_words(pixels, letters(column), spot, _NAMES, page.pitch, scale, "middle")
    for row in range(page.rows):
        spot = (x - 0.5, y + (row + 0.5) * page.pitch - _NAMES / 2)
        _draw_words(pixels, str(row + 1), spot, _NAMES, page.pitch, scale, "right")


def _draw_field(pixels: NDArray[np.uint8], page: ChartPage, scale: float) -> None:
    """The frame in which a person writes with the pen itself, and what asks for it."""
    left, top, right, bottom = page.scribble_field
    lines = [
        (left, top, right, top),
        (left, bottom, right, bottom),
        (left, top, left, bottom),
        (right, top, right, bottom),
    ]
    boxes = np.array(lines) + np.array([-1, -1, 1, 1]) * FRAME / 2
    for x0, y0, x1, y1 in _edges(boxes, scale):
        pixels[y0:y1, x0:x1] = 0
    for number, words in enumerate(_ASK):
        spot = (left - 2 * _NAMES, (top + bottom) / 2 + (number - 1) * 1.6 * _WORDS)
        _draw_words(pixels, words, spot, _WORDS, left - page.origin[0], scale, "right")


def _draw_words(
    pixels: NDArray[np.uint8],
    text: str,
    place: tuple[float, float],
    size: float,
    width: float,
    scale: float,
    align: str = "left",
) -> None:
    """Black words in letters of `size` mm, with top left, middle or right at `place` mm, at most `width` mm long."""
    from PIL import Image, ImageDraw

    if not text.isprintable() or any(ord(char) > 0x17F for char in text):
        raise InputError(f"chart: {text!r} cannot be printed on it; use Western letters, digits and signs.")
    font = _font(max(1, round(size * scale)))
    left, _, right, bottom = font.getbbox(text or " ")
    if right - left > width * scale:
        room = int(len(text) * width * scale / (right - left))
        raise InputError(f"chart: {text!r} is too long for its line; use at most {room} letters.")
    x = place[0] * scale - {"left": 0.0, "middle": (right + left) / 2, "right": float(right)}[align]
    h, w = int(bottom) + 2, int(right) + 2
    image = Image.new("L", (w, h), 255)
    ImageDraw.Draw(image).text((0, 0), text, fill=0, font=font)
    at_x, at_y = round(x), round(place[1] * scale)
    under = pixels[at_y : at_y + h, at_x : at_x + w]
    np.minimum(under, np.asarray(image)[: under.shape[0], : under.shape[1], None], out=under)


@cache
def _font(size: int) -> Any:
    import reportlab
    from PIL import ImageFont

    return ImageFont.truetype(str(Path(reportlab.__file__).parent / "fonts" / "Vera.ttf"), size)


DEVICE, XYZ = ("RGB_R", "RGB_G", "RGB_B"), ("XYZ_X", "XYZ_Y", "XYZ_Z")
SCANNED, ERROR = ("SCAN_R", "SCAN_G", "SCAN_B"), "SCAN_SE"
# device colours of which further tables of a .ti1 tell what is expected: ArgyllCMS' printtarg refuses one without
_CORNERS = np.array([[1, 1, 1], [0, 1, 1], [1, 0, 1], [0, 0, 1], [1, 1, 0], [0, 1, 0], [1, 0, 0], [0, 0, 0]], float)
_EXTREMES = {"DENSITY_EXTREME_VALUES": _CORNERS, "DEVICE_COMBINATION_VALUES": np.vstack([_CORNERS, [[0.5] * 3]])}
_DESCRIPTOR = "Argyll Calibration Target chart information"
_ORIGINATOR = f"handout {handout.__version__}"


def ti1(chart: Chart) -> tuple[cgats.CgatsTable, ...]:
    """The different colours of a chart, with what is to be expected of them on a printer that prints sRGB."""
    columns = {"SAMPLE_ID": _ids(len(chart.colours)), **_predict(chart.colours)}
    keywords = {"DESCRIPTOR": f"{_DESCRIPTOR} 1", "ORIGINATOR": _ORIGINATOR}
    further = [
        cgats.table("CTI1", keywords | {name: str(len(device))}, {"INDEX": _ids(len(device), 0), **_predict(device)})
        for name, device in _EXTREMES.items()
    ]
    return (cgats.table("CTI1", _make_keywords("1", "iRGB", _make_white_keyword()), columns), *further)


def ti2(chart: Chart) -> tuple[cgats.CgatsTable, ...]:
    """Every patch of a chart and its place: page number, column and row."""
    pages = chart.pages
    device = np.vstack([page.device for page in pages])
    several = len(pages) > 1
    names = [f"{page.number}-{name}" if several else name for page in pages for name in page.names]
    columns = {"SAMPLE_ID": _ids(len(device)), "SAMPLE_LOC": names, **_predict(device)}
    about = _make_white_keyword() | {"STEPS_IN_PASS": str(pages[0].rows), "PASSES_IN_STRIPS2": str(pages[0].columns)}
    return (cgats.table("CTI2", _make_keywords("2", "iRGB", about), columns),)


def ti3(reading: ChartReading | Patches, about: Mapping[str, str] | None = None) -> tuple[cgats.CgatsTable, ...]:
    """What was read: a set for each colour; `about` : further keywords: printer, paper, scanner."""
    columns = {
        "SAMPLE_ID": _ids(len(reading.device)),
        **_columns(DEVICE, reading.device * 100),
        **_columns(XYZ, conversions.xyz_d50(reading.scanned)),
        **_columns(SCANNED, reading.scanned * 100),
        **_columns((ERROR,), reading.deviation[:, None] * 100),
    }
    keywords = {"DEVICE_CLASS": "OUTPUT", "TARGET_INSTRUMENT": "flatbed scanner, taken for sRGB", **(about or {})}
    return (cgats.table("CTI3", _make_keywords("3", "iRGB_XYZ", keywords), columns),)


def from_ti3(tables: tuple[cgats.CgatsTable, ...]) -> tuple[Array, Array, Array]:
    """What `ti3` stored: device (n, 3), scanned (n, 3) and deviation (n,), all in 0–1.

    Raises InputError: the table is none of a scan.
    """
    table = tables[0]
    if SCANNED[0] not in table.fields:
        raise InputError(
            "The table holds no numbers of a scan (SCAN_R, SCAN_G, SCAN_B): it was measured by an instrument, and a "
            "calibration needs the chart as the scanner of the handwriting sees it. Scan the chart."
        )
    device, scanned, deviation = (table.numbers(*names) / 100 for names in (DEVICE, SCANNED, (ERROR,)))
    return readonly(device, None, 3), readonly(scanned, None, 3), readonly(deviation[:, 0], None)


def _make_keywords(number: str, representation: str, more: Mapping[str, str]) -> dict[str, str]:
    return {"DESCRIPTOR": f"{_DESCRIPTOR} {number}", "ORIGINATOR": _ORIGINATOR, "COLOR_REP": representation, **more}


def _make_white_keyword() -> dict[str, str]:
    white = conversions.xyz_d50(np.ones((1, 3)))[0]
    return {"APPROX_WHITE_POINT": " ".join(f"{v:.6f}" for v in white)}


def _predict(device: Array) -> dict[str, list[str]]:
    return {**_columns(DEVICE, device * 100), **_columns(XYZ, conversions.xyz_d50(device))}


def _ids(count: int, first: int = 1) -> list[str]:
    return [str(first + i) for i in range(count)]


def _columns(names: tuple[str, ...], values: Array) -> dict[str, list[str]]:
    """Columns of numbers, in so many figures that the same number is read again."""
    return {name: [repr(float(v)) for v in values[:, k]] for k, name in enumerate(names)}
