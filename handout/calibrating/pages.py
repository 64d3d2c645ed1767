"""Charts and strips on their way to a printer: pixels in, a document out, nothing resampled and nothing mapped."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

import handout
from handout import atomic
from handout.colour import cgats, chart_files
from handout.colour.chart import Chart, chart
from handout.colour.chart_files import render
from handout.errors import InputError
from handout.inking.device_pixels import DevicePixels
from handout.printing.documents import WRITERS, Pixels, png
from handout.printing.media import Feeding
from handout.printing.printers import open_queue, ticket
from handout.printing.queue import Queue
from handout.profiles import Printer
from handout.sinks import picture_pdf
from handout.values import Page

_LEAST_DPI = 300  # a chart is drawn at least so finely; set by eye


@dataclass(frozen=True)
class Printed:
    """Pages of device RGB.

    page : size of the sheet; pixels : (h, w, 3) uint8 of each page; dpi : theirs; about : stored with them.
    """

    page: Page
    pixels: Sequence[Pixels]
    dpi: int
    about: Mapping[str, Any]


def write(pages: Printed, path: Path) -> tuple[Path, ...]:
    """Write pages as one .pdf, or as .png: a file, or one a page.

    Raises
    ------
    InputError
        Another ending, or a file that cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".pdf":
        atomic.write(path, _document(pages))
        return (path,)
    if suffix != ".png":
        raise InputError(f"{path}: the chart is written as .pdf or .png; give the file one of these endings.")
    count = len(pages.pixels)
    paths = [path.with_name(f"{path.stem}-{n}{path.suffix}") if count > 1 else path for n in range(1, count + 1)]
    atomic.write_all((to, png(pixels, pages.dpi)) for pixels, to in zip(pages.pixels, paths, strict=True))
    return tuple(paths)


def send(pages: Printed, profile: Printer, queue: Queue | None = None) -> tuple[str, ...]:
    """Print pages, each a job of its own, at its true size; the names of the jobs.

    Raises
    ------
    PrinterError
        No queue, or one that refuses the page.
    """
    queue = queue or open_queue(profile)
    request = ticket(profile, pages.page, "handout colour chart", "chart")
    queue.check(request)
    feeding = Feeding.of(pages.page, profile)
    names = []
    with tempfile.TemporaryDirectory(prefix="handout-") as work:
        for number, pixels in enumerate(pages.pixels, 1):
            path = Path(work) / f"page-{number}.{queue.format}"
            path.write_bytes(_fed(pages, pixels, feeding, queue.format))
            named = ticket(profile, pages.page, f"handout colour chart, page {number}", f"chart-{number}")
            names.append(queue.send(path, named))
    return tuple(names)


def _document(pages: Printed) -> bytes:
    stream = BytesIO()
    writer = picture_pdf.PdfWriter(stream, pages.about)
    for pixels in pages.pixels:
        writer.add_pixels(pages.page, pixels, pages.dpi)
    writer.finish()
    return stream.getvalue()


def _fed(pages: Printed, pixels: Pixels, feeding: Feeding, kind: str) -> bytes:
    """One page as the printer is fed, in the queue's format."""
    turned = pixels
    for turn in feeding.turns:
        turned = np.ascontiguousarray(np.rot90(turned, 1 if turn == "left" else -1))
    if kind == "pdf":
        return _document(Printed(feeding.sheet, [turned], pages.dpi, pages.about))
    return WRITERS[kind](feeding.sheet, DevicePixels(turned, pages.dpi), pages.about)


def chart_for(printer: Printer, paper: str = "A4", pages: int | None = None) -> Chart:
    """The chart for a printer, within its margins.

    Raises
    ------
    InputError, DoesNotFit
        See `handout.colour.chart.chart`.
    """
    edges = printer.margins
    return chart(paper, pages=pages, margins=(edges.top, edges.right, edges.bottom, edges.left))


def fine_enough(dpi: float) -> float:
    """The printer's resolution, or the multiple of it from 300 dpi on that a chart is drawn at."""
    return dpi * -(-_LEAST_DPI // dpi)


def write_chart_pdf(chart: Chart, path: Path, dpi: float, lines: tuple[str, ...] = ()) -> tuple[Path, ...]:
    """Write the chart as PDF, one DeviceRGB picture a page at the printer's resolution, with .ti1 and .ti2 beside it.

    path : of the PDF; dpi : the printer's, of one below 300 a multiple of it; lines : at most two, printed under the
    title: printer, paper, date.  Returns the paths of the PDF, the .ti1 and the .ti2.

    Raises
    ------
    InputError
        Another suffix than .pdf, or a file that cannot be written.
    """
    if path.suffix.lower() != ".pdf":
        raise InputError(f"The chart is written as PDF, not {path.suffix or 'without a suffix'}: use {path.stem}.pdf.")
    paths = (path, path.with_suffix(".ti1"), path.with_suffix(".ti2"))
    for file in paths:
        atomic.check_writable(file)
    fine = fine_enough(dpi)
    about = {"chart": chart.version, "paper": chart.paper.name, "dpi": fine}
    with picture_pdf.document(path, about) as document:
        for page in chart.pages:
            document.add_pixels(page.paper, render(page, fine, lines), fine)
    cgats.write(paths[1], chart_files.ti1(chart))
    cgats.write(paths[2], chart_files.ti2(chart))
    return paths


def chart_pages(chart: Chart, profile: Printer, name: str) -> Printed:
    """The pages of a chart as the printer's own pixels."""
    dpi = round(fine_enough(profile.dpi))
    pixels = [render(page, dpi, _title_lines(name)) for page in chart.pages]
    return Printed(chart.paper, pixels, dpi, {"chart": chart.version, "printer": name})


def write_chart(chart: Chart, profile: Printer, name: str, path: Path) -> tuple[Path, ...]:
    """Write a chart as .pdf, with its tables beside it, or as .png.

    Raises
    ------
    InputError
        Another ending, or a file that cannot be written.
    """
    if path.suffix.lower() == ".png":
        return write(chart_pages(chart, profile, name), path)
    return write_chart_pdf(chart, path, profile.dpi, _title_lines(name))


def _title_lines(name: str) -> tuple[str, ...]:
    return (f"{name}   {date.today().isoformat()}   handout {handout.__version__}",)
