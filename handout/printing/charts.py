"""The calibration chart as files: a PDF for the printer, and tables of its colours beside it."""

from __future__ import annotations

from pathlib import Path

from handout import atomic
from handout.colour import cgats, chart_files
from handout.colour.chart import Chart, chart
from handout.colour.chart_files import render
from handout.errors import InputError
from handout.profiles import Printer
from handout.sinks import picture_pdf

_LEAST_DPI = 300  # a chart is drawn at least so finely; set by eye


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


def write_chart(chart: Chart, path: Path, dpi: float, lines: tuple[str, ...] = ()) -> tuple[Path, ...]:
    """Write the chart as PDF, one DeviceRGB picture a page at the printer's resolution, with .ti1 and .ti2 beside it.

    Parameters
    ----------
    chart : Chart
    path : Path
        Of the PDF.
    dpi : float
        The printer's; of one below 300 a multiple is taken, so that a pixel of the chart is no fraction of the
        printer's.
    lines : at most two str
        Printed under the title: printer, paper, date.

    Returns
    -------
    tuple of Path
        The PDF, the .ti1, the .ti2.

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
