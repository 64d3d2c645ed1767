"""Charts and strips on their way to a printer: pixels in, a document out, nothing resampled and nothing mapped."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

import handout
from handout import atomic
from handout.colour import cgats, chart_files
from handout.colour.cgats import CgatsTable
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
class DevicePages:
    """Pages of device RGB.

    page : size of the sheet; pixels : draw (h, w, 3) uint8 of each page; dpi : theirs; about : stored with them.
    filed : stored with them in a file, where that is something else; tables : what lies beside a PDF, by its ending.
    """

    page: Page
    pixels: Sequence[Callable[[], Pixels]]
    dpi: float
    about: Mapping[str, Any]
    filed: Mapping[str, Any] | None = None
    tables: Mapping[str, Sequence[CgatsTable]] = field(default_factory=dict)


def write(pages: DevicePages, path: Path) -> tuple[Path, ...]:
    """Write pages as one .pdf, with their tables beside it, or as .png: a file, or one a page.

    Raises InputError: another ending, or a file that cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".pdf":
        files = (path, *map(path.with_suffix, pages.tables))
        for file in files:
            atomic.check_writable(file)
        with picture_pdf.document(path, pages.about if pages.filed is None else pages.filed) as document:
            for draw in pages.pixels:
                document.add_pixels(pages.page, draw(), pages.dpi)
        for file, tables in zip(files[1:], pages.tables.values(), strict=True):
            cgats.write(file, tables)
        return files
    if suffix != ".png":
        raise InputError(f"{path}: the chart is written as .pdf or .png; give the file one of these endings.")
    count = len(pages.pixels)
    paths = [path.with_name(f"{path.stem}-{n}{path.suffix}") if count > 1 else path for n in range(1, count + 1)]
    atomic.write_all((to, png(draw(), pages.dpi)) for draw, to in zip(pages.pixels, paths, strict=True))
    return tuple(paths)


def send(pages: DevicePages, profile: Printer, queue: Queue | None = None) -> tuple[str, ...]:
    """Print pages, each a job of its own, at its true size; the names of the jobs.

    Raises PrinterError: no queue, or one that refuses the page.
    """
    queue = queue or open_queue(profile)
    request = ticket(profile, pages.page, "handout colour chart", "chart")
    queue.check(request)
    feeding = Feeding.for_page(pages.page, profile)
    names = []
    with tempfile.TemporaryDirectory(prefix="handout-") as work:
        for number, draw in enumerate(pages.pixels, 1):
            path = Path(work) / f"page-{number}.{queue.format}"
            path.write_bytes(_feed_page(pages, draw(), feeding, queue.format))
            named = ticket(profile, pages.page, f"handout colour chart, page {number}", f"chart-{number}")
            names.append(queue.send(path, named))
    return tuple(names)


def _feed_page(pages: DevicePages, pixels: Pixels, feeding: Feeding, kind: str) -> bytes:
    """One page as the printer is fed, in the queue's format."""
    for turn in feeding.turns:
        pixels = np.ascontiguousarray(np.rot90(pixels, 1 if turn == "left" else -1))
    if kind != "pdf":
        return WRITERS[kind](feeding.sheet, DevicePixels(pixels, pages.dpi), pages.about)
    stream = BytesIO()
    writer = picture_pdf.PdfWriter(stream, pages.about)
    writer.add_pixels(feeding.sheet, pixels, pages.dpi)
    writer.finish()
    return stream.getvalue()


def chart_for(printer: Printer, paper: str = "A4", pages: int | None = None) -> Chart:
    """The chart for a printer, within its margins. Raises InputError, DoesNotFit: see `handout.colour.chart.chart`."""
    edges = printer.margins
    return chart(paper, pages=pages, margins=(edges.top, edges.right, edges.bottom, edges.left))


def fine_enough(dpi: int) -> int:
    """The printer's resolution, or the multiple of it from 300 dpi on that a chart is drawn at."""
    return dpi * -(-_LEAST_DPI // dpi)


def chart_pages(chart: Chart, profile: Printer, name: str) -> DevicePages:
    """The pages of a chart as the printer's own pixels, with its tables (.ti1, .ti2); `name` : ``printer/paper``."""
    dpi = fine_enough(profile.dpi)
    lines = (f"{name}   {date.today().isoformat()}   handout {handout.__version__}",)
    return DevicePages(
        chart.paper,
        [partial(render, page, dpi, lines) for page in chart.pages],
        dpi,
        {"chart": chart.version, "printer": name},
        {"chart": chart.version, "paper": chart.paper.name, "dpi": dpi},
        {".ti1": chart_files.ti1(chart), ".ti2": chart_files.ti2(chart)},
    )
