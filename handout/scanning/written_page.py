"""A page read: from the file to ink, line graph, matte and text lines; `read_page` does it in one call.

Ink that is not the page's, what a later hand wrote or stamped on it, is told by its colour (`foreign_ink`), compared
as its optical density, in which a thin line and a thick one of one pen point the same way.  It is meaned along
stretches of line, as a single pixel at the edge of a stroke tells little.

Source: seed 000, §5.1; ink of another colour: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches
from handout.errors import InputError
from handout.libraries import cv2
from handout.scanning.checks import PALE, check_pale_marks, check_writing_size, refuse_false_resolution
from handout.scanning.density import Density, Scale, find_density, find_scale
from handout.scanning.inks import PageInks, find_inks
from handout.scanning.line_erasure import erase_printed_lines
from handout.scanning.line_graph import find_line_graph, mean_within
from handout.scanning.mask import Mask, find_mask, hysteresis, stroke_width
from handout.scanning.matting import Matte, find_matte
from handout.scanning.paper import BarePaper, crop, find_paper, flatten
from handout.scanning.picture_files import read_scan
from handout.scanning.scan import Scan
from handout.scanning.text_lines import TextLines, find_text_lines
from handout.summary import one_line
from handout.values import POSE, Array, LineGraph, Moments, Stroke

_ENLARGED = (200.0, 400.0)  # dpi: such scans may be read enlarged, since fine pens write lines of 2 pixels at 300


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
    moments: Moments | None = None

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """A scan whose light and inks are known, which is all that the common scale of a hand's pages needs.

    scan : as scanned, borders cut off.
    paper : light and stains.
    inks : colours.
    scale : of the page's own ink.
    erased : how many lines were printed on its paper, which the scan no longer has.
    """

    scan: Scan
    paper: BarePaper
    inks: PageInks
    scale: Scale
    erased: int = 0

    def turn_quarters(self, quarters: int, dpi: float | None = None) -> PreparedScan:
        """The page turned anticlockwise by a number of quarter turns, or of another resolution."""
        turned = prepare(replace(self.scan.turn_quarters(quarters), dpi=dpi or self.scan.dpi))
        return replace(turned, erased=self.erased + turned.erased)


@dataclass(frozen=True, eq=False)
class Inked:
    """A page whose ink and lines are known.

    prepared : what it was found from.
    density : (h, w), 0–2.
    mask : ink or paper.
    text_lines : where the writing runs, mm on the page.
    pale : marks too pale for ink, as a share of the ink.
    notes : sentences to show the user.
    """

    prepared: PreparedScan
    density: Density
    mask: Mask
    text_lines: TextLines
    pale: float = 0.0
    notes: tuple[str, ...] = ()


def prepare(source: Path | Scan, dpi: float | None = None) -> PreparedScan:
    """Light, paper and inks of a scan, from which printed lines are taken away.

    source, dpi : as `read_page`.

    Raises InputError: unreadable or too large; no resolution; nothing but paper.
    """
    scan, erased = erase_printed_lines(crop(source if isinstance(source, Scan) else read_scan(Path(source), dpi)))
    paper = find_paper(scan)
    level = flatten(scan, paper)
    inks = find_inks(level)
    return PreparedScan(scan, paper, inks, find_scale(level, inks), erased)


def find_ink(
    prepared: PreparedScan, pen: str | None = None, *, lines: int | None = None, scale: Scale | None = None
) -> Inked:
    """Ink and lines of a page that has been prepared; strokes too thin to be measured are read from an enlarged scan.

    pen, lines : as `read_page`.
    scale : scale of densities of the whole hand (`density.pooled_scale`).

    Raises InputError: nothing but specks; strokes too thin for a scan that is coarser or finer than most.
    """
    scan, inks = prepared.scan, prepared.inks
    level = flatten(scan, prepared.paper)
    density = find_density(level, inks, scale or prepared.scale)
    try:
        mask = find_mask(level, inks, density, pen)
    except InputError:
        thin = stroke_width(hysteresis(density.values, density))
        refuse_false_resolution(thin, scan)
        if not (thin and _ENLARGED[0] <= scan.dpi <= _ENLARGED[1]):
            raise
        note = (
            f"{scan.source}: strokes are but {thin:.1f} pixels wide at {scan.dpi:g} dpi, so the scan is read enlarged "
            "to twice its size; a scan at 600 dpi shows more of the ink."
        )
        enlarged = replace(prepare(scan.enlarge(2)), erased=prepared.erased)
        return replace(find_ink(enlarged, pen, lines=lines, scale=scale), notes=(note,))
    text_lines = find_text_lines(mask.ink, scan.dpi, lines)
    return Inked(prepared, density, mask, text_lines, pale_marks(level, inks, mask))


def finish(inked: Inked) -> WrittenPage:
    """Line graph and matte of a page whose ink is known.

    Raises InputError: the size of the writing belies the resolution.
    """
    prepared, density, mask, scan = inked.prepared, inked.density, inked.mask, inked.prepared.scan
    printed = (
        f"{scan.source}: {prepared.erased} lines that were printed on its paper were taken away before it was read."
    )
    told = (*[printed] * bool(prepared.erased), *inked.notes)
    notes = (*told, *check_writing_size(inked.text_lines, scan), *check_pale_marks(inked.pale, scan))
    graph = find_line_graph(scan, mask, density)
    matte = find_matte(scan, mask, prepared.inks, pale=inked.pale >= PALE)
    return WrittenPage(scan, prepared.paper, prepared.inks, density, mask, graph, matte, inked.text_lines, notes)


def read_page(source: Path | Scan, dpi: float | None = None, *, lines: int | None = None) -> WrittenPage:
    """Read a scanned page of handwriting.

    source : PNG, JPEG, TIFF, PDF, or a scan in memory.
    dpi : pixels per inch, where the file does not say.
    lines : how many lines of writing there are, if a transcript says so.

    Raises InputError: unreadable or too large; no resolution, or one that the size of the writing belies; nothing but
    paper; strokes too thin.
    """
    return finish(find_ink(prepare(source, dpi), lines=lines))


def with_recorded_line(written: WrittenPage, strokes: Sequence[Stroke], *, timed: bool) -> WrittenPage:
    """A page with the line that its pen was recorded on in place of the one its ink shows.

    strokes : in the order of writing, mm on the page before its borders were cut off; samples about a pixel apart, all
        with `width`.
    timed : whether their times mean anything.

    Raises InputError: there are none.
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


@dataclass(frozen=True)
class ForeignInkSettings:
    """Measured on a page with a stamp and a note, 19–30° from its ink, and on two real ones, 99.9 % within 9° of it."""

    apart: float = 14.0  # degrees between the directions of the densities of two inks
    run: int = 25  # vertices of line that are meaned
    blur: float = 1.0  # pixels, deviation
    darkest: float = 2.0  # of 255: light below that is counted as that
    pale: float = 0.12  # share of ink from which a mark is seen, where less than the page's zero ink lies
    around: float = 0.4  # mm around ink that is the ink's own
    dpi: float = 100.0  # at which pale marks are looked for


_FOREIGN = ForeignInkSettings()


def foreign_ink(graph: LineGraph, scan: Scan, paper: BarePaper) -> NDArray[np.bool_]:
    """(n,) which vertices of a page's line have ink of another colour than most, over the paper where they lie.

    Over paper of one colour, all ink in the shadow of a photograph would have that of the shadow, too.
    """
    if not len(graph):
        return np.zeros(0, dtype=bool)
    column, row = np.rint(graph.uv).astype(np.intp).T
    column, row = column.clip(0, scan.shape[1] - 1), row.clip(0, scan.shape[0] - 1)
    soft = cv2.GaussianBlur(flatten(scan, paper).rgb, (0, 0), _FOREIGN.blur)[row, column].astype(np.float64)
    density = -np.log(np.maximum(soft, _FOREIGN.darkest) / np.maximum(255 * paper.colour, _FOREIGN.darkest))
    usual = _unit_vectors(np.median(_unit_vectors(density), axis=0))
    foreign = np.zeros(len(graph), dtype=bool)
    for path in branches(graph.edges, len(graph)):
        for start in range(0, len(path), _FOREIGN.run):
            run = path[start : start + _FOREIGN.run]
            foreign[run] = _unit_vectors(density[run].sum(axis=0)) @ usual < np.cos(np.radians(_FOREIGN.apart))
    return foreign


def _unit_vectors(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))


def pale_marks(level: Scan, inks: PageInks, mask: Mask) -> float:
    """How much of a page has marks too pale for its ink, as a share of what has ink.

    level : the page, its light evened out.
    """
    if not mask.ink.any():
        return 0.0
    part = min(1.0, _FOREIGN.dpi / level.dpi)
    size = (max(1, round(level.shape[1] * part)), max(1, round(level.shape[0] * part)))
    small = cv2.resize(level.rgb, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    inked = np.asarray(cv2.resize(mask.ink.astype(np.uint8) * 255, size, interpolation=cv2.INTER_AREA)) > 0
    reach = 2 * max(1, round(_FOREIGN.around / 25.4 * level.dpi * part)) + 1
    near = cv2.dilate(inked.astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0
    share = (small - inks.paper.astype(np.float32)) @ inks.inks[0].axis.astype(np.float32)
    return float(((share > _FOREIGN.pale) & ~near).sum() / inked.sum())
