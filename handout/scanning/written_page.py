"""A page read: from the file to ink, line graph, matte and text lines; `read_page` does it in one call.

Source: seed 000, §5.1.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.checks import PALE, check_pale_marks, check_writing_size, refuse_false_resolution
from handout.scanning.density import Density, Scale, find_density, find_scale
from handout.scanning.foreign_ink import pale_marks
from handout.scanning.inks import PageInks, find_inks
from handout.scanning.line_graph import find_line_graph, mean_within
from handout.scanning.mask import Mask, find_mask, hysteresis, stroke_width
from handout.scanning.matting import Matte, find_matte
from handout.scanning.paper import BarePaper, crop, find_paper, flatten
from handout.scanning.picture_files import read_scan
from handout.scanning.scan import Scan
from handout.scanning.text_lines import TextLines, find_text_lines
from handout.summary import one_line
from handout.values import POSE, Array, LineGraph, Moments, Stroke


@dataclass(frozen=True, eq=False)
class WrittenPage:
    """All that is known of a scanned page before its letters are.

    scan : as scanned, borders cut off.
    paper : light and stains.
    inks : colours.
    density : (h, w), 0–2.
    mask : ink or paper.
    graph : the line of the pen, mm on the page.
    matte : ink without paper.
    text_lines : where the writing runs, mm on the page.
    notes : sentences to show the user.
    seconds : processor time of every step.
    moments : what a recorded pen says of the vertices of `graph`.
    """

    scan: Scan
    paper: BarePaper
    inks: PageInks
    density: Density
    mask: Mask
    graph: LineGraph
    matte: Matte
    text_lines: TextLines
    notes: tuple[str, ...]
    seconds: Mapping[str, float]
    moments: Moments | None = None

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """A scan whose light and inks are known, which is all that the common scale of a hand's pages needs.

    scan : as scanned, borders cut off.
    paper : light and stains.
    inks : colours.
    scale : of the page's own ink.
    seconds : processor time of every step.
    """

    scan: Scan
    paper: BarePaper
    inks: PageInks
    scale: Scale
    seconds: Mapping[str, float]

    def turn_quarters(self, quarters: int) -> PreparedScan:
        """The page turned anticlockwise by a number of quarter turns."""
        return prepare(self.scan.turn_quarters(quarters))


@dataclass(frozen=True, eq=False)
class Inked:
    """A page whose ink and lines are known.

    prepared : what it was found from.
    density : (h, w), 0–2.
    mask : ink or paper.
    text_lines : where the writing runs, mm on the page.
    seconds : processor time of every step.
    pale : marks too pale for ink, as a share of the ink.
    """

    prepared: PreparedScan
    density: Density
    mask: Mask
    text_lines: TextLines
    seconds: Mapping[str, float]
    pale: float = 0.0


def prepare(source: Path | Scan, dpi: float | None = None, page: int | None = None) -> PreparedScan:
    """Light, paper and inks of a scan.

    Parameters
    ----------
    source, dpi, page : as `read_page`.

    Raises
    ------
    InputError
        Unreadable or too large; no resolution; nothing but paper.
    """
    seconds: dict[str, float] = {}
    with _time_step(seconds, "scan"):
        scan = crop(source if isinstance(source, Scan) else read_scan(Path(source), dpi, page))
    with _time_step(seconds, "paper"):
        paper = find_paper(scan)
        level = flatten(scan, paper)
    with _time_step(seconds, "inks"):
        inks = find_inks(level)
        scale = find_scale(level, inks)
    return PreparedScan(scan, paper, inks, scale, seconds)


def find_ink(
    prepared: PreparedScan,
    pen: str | None = None,
    *,
    lines: int | None = None,
    scale: Scale | None = None,
    method: str = "cut",
    paint: NDArray[np.int8] | None = None,
) -> Inked:
    """Ink and lines of a page that has been prepared.

    Parameters
    ----------
    prepared : Prepared
    pen, lines, scale, method, paint : as `read_page`.

    Raises
    ------
    InputError
        Strokes too thin, nothing but specks.
    """
    scan, inks, seconds = prepared.scan, prepared.inks, dict(prepared.seconds)
    with _time_step(seconds, "density"):
        level = flatten(scan, prepared.paper)
        density = find_density(level, inks, scale or prepared.scale)
    with _time_step(seconds, "mask"):
        try:
            mask = find_mask(level, inks, density, pen, method, paint)
        except InputError:
            refuse_false_resolution(stroke_width(hysteresis(density.values, density)), scan)
            raise
    with _time_step(seconds, "text lines"):
        text_lines = find_text_lines(mask.ink, scan.dpi, lines)
    return Inked(prepared, density, mask, text_lines, seconds, pale_marks(level, inks, mask))


def finish(inked: Inked) -> WrittenPage:
    """Line graph and matte of a page whose ink is known.

    Raises
    ------
    InputError
        The size of the writing belies the resolution.
    """
    prepared, density, mask = inked.prepared, inked.density, inked.mask
    scan, seconds = prepared.scan, dict(inked.seconds)
    notes = (*check_writing_size(inked.text_lines, scan), *check_pale_marks(inked.pale, scan))
    with _time_step(seconds, "graph"):
        graph = find_line_graph(scan, mask, density)
    with _time_step(seconds, "matte"):
        matte = find_matte(scan, mask, prepared.inks, pale=inked.pale >= PALE)
    return WrittenPage(
        scan, prepared.paper, prepared.inks, density, mask, graph, matte, inked.text_lines, notes, seconds
    )


def read_page(
    source: Path | Scan,
    dpi: float | None = None,
    pen: str | None = None,
    *,
    page: int | None = None,
    lines: int | None = None,
    scale: Scale | None = None,
    method: str = "cut",
    paint: NDArray[np.int8] | None = None,
) -> WrittenPage:
    """Read a scanned page of handwriting.

    Parameters
    ----------
    source : Path or Scan
        PNG, JPEG, TIFF, PDF, or a scan in memory.
    dpi : float, optional
        Pixels per inch, where the file does not say.
    pen : str, optional
        One of `mask.PENS`; otherwise told from the ink.
    page : int, optional
        Which page of a file that holds several, from 1.
    lines : int, optional
        How many lines of writing there are, if a transcript says so.
    scale : Scale, optional
        Scale of densities of the whole hand (`density.pooled_scale`).
    method : "cut" or "hysteresis".
    paint : (h, w) int8, optional
        What the user painted, on the cropped scan: 1 ink, −1 paper.

    Raises
    ------
    InputError
        Unreadable or too large; no resolution, or one that the size of the writing belies; nothing but paper; strokes
        too thin.
    """
    prepared = prepare(source, dpi, page)
    return finish(find_ink(prepared, pen, lines=lines, scale=scale, method=method, paint=paint))


@contextmanager
def _time_step(seconds: dict[str, float], name: str) -> Iterator[None]:
    begin = time.process_time()
    yield
    seconds[name] = time.process_time() - begin


def with_recorded_line(written: WrittenPage, strokes: Sequence[Stroke], *, timed: bool) -> WrittenPage:
    """A page with the line that its pen was recorded on in place of the one its ink shows.

    Parameters
    ----------
    strokes : in the order of writing, mm on the page before its borders were cut off; samples about a pixel apart, all
        with `width`.
    timed : whether their times mean anything.

    Raises
    ------
    InputError
        There are none.
    """
    if not strokes:
        raise InputError(f"{written.scan.source}: the recording has no movement of a pen on paper.")
    scan = written.scan
    counts = [len(stroke.t) for stroke in strokes]
    uv = np.concatenate([stroke.xy for stroke in strokes]) / scan.pixel - 0.5 - np.array(scan.origin)
    radius = _join_parts([stroke.width for stroke in strokes]) / 2
    density = np.clip(mean_within(written.density.values, uv, radius / scan.pixel), 0, 2)
    first = np.cumsum([0, *counts[:-1]])
    edges = np.concatenate(
        [np.column_stack([np.arange(n - 1), np.arange(1, n)]) + a for a, n in zip(first, counts, strict=True)]
    )
    graph = LineGraph((uv + 0.5) * scan.pixel, radius, density, uv, edges)
    held = {name: [getattr(stroke, name) for stroke in strokes] for name in POSE}
    channels = {name: _join_parts(parts) for name, parts in held.items() if all(part is not None for part in parts)}
    times = np.concatenate([stroke.t for stroke in strokes]) if timed else None
    return replace(written, graph=graph, moments=Moments(times, **channels))


def _join_parts(parts: Sequence[Array | None]) -> Array:
    return np.concatenate([part for part in parts if part is not None])
