"""A page read: from the file to ink, line graph, matte and rules, in one function.

Source: seed 000, §5.1.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.density import Density, Scale, find_density, find_scale
from handout.scanning.inks import Inks, find_inks
from handout.scanning.linegraph import find_lines_of_ink
from handout.scanning.mask import LEAST_STROKE, Mask, find_mask, hysteresis, stroke_width
from handout.scanning.matting import Matte, find_matte
from handout.scanning.page import Scan, read_scan
from handout.scanning.paper import Paper, crop, find_paper, flatten
from handout.scanning.rules import Rules, find_rules
from handout.summary import one_line
from handout.values import LineGraph, Moments

_PITCHES = (3.0, 28.0)  # mm
_X_HEIGHTS, _USUAL_X_HEIGHT = (0.8, 9.0), 2.6  # mm
_FINEST_PEN = 0.1  # mm
_USUAL_DPI = (150, 200, 300, 400, 600, 1200)


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
    rules : the written lines, mm on the page.
    notes : sentences to show the user.
    seconds : processor time of every step.
    moments : what a recorded pen says of the vertices of `graph`.
    """

    scan: Scan
    paper: Paper
    inks: Inks
    density: Density
    mask: Mask
    graph: LineGraph
    matte: Matte
    rules: Rules
    notes: tuple[str, ...]
    seconds: Mapping[str, float]
    moments: Moments | None = None

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scan whose light and inks are known: all that the scale of densities of a hand's pages is made of.

    scan : as scanned, borders cut off.
    paper : light and stains.
    inks : colours.
    scale : of the page's own ink.
    seconds : processor time of every step.
    """

    scan: Scan
    paper: Paper
    inks: Inks
    scale: Scale
    seconds: Mapping[str, float]

    def turned(self, quarters: int) -> Prepared:
        """The page turned anticlockwise by so many quarters of a circle."""
        return prepare(self.scan.turned(quarters))


@dataclass(frozen=True, eq=False)
class Inked:
    """A page whose ink and lines are known.

    prepared : what it was found from.
    density : (h, w), 0–2.
    mask : ink or paper.
    rules : the written lines, mm on the page.
    seconds : processor time of every step.
    """

    prepared: Prepared
    density: Density
    mask: Mask
    rules: Rules
    seconds: Mapping[str, float]


def prepare(source: Path | Scan, dpi: float | None = None, page: int | None = None) -> Prepared:
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
    with _timed(seconds, "scan"):
        scan = crop(source if isinstance(source, Scan) else read_scan(Path(source), dpi, page))
    with _timed(seconds, "paper"):
        paper = find_paper(scan)
        level = flatten(scan, paper)
    with _timed(seconds, "inks"):
        inks = find_inks(level)
        scale = find_scale(level, inks)
    return Prepared(scan, paper, inks, scale, seconds)


def find_ink(
    prepared: Prepared,
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
    with _timed(seconds, "density"):
        level = flatten(scan, prepared.paper)
        density = find_density(level, inks, scale or prepared.scale)
    with _timed(seconds, "mask"):
        try:
            mask = find_mask(level, inks, density, pen, method, paint)
        except InputError as error:
            raise _belied(scan, density) or error from error
    with _timed(seconds, "rules"):
        rules = find_rules(mask.ink, scan.dpi, lines)
    return Inked(prepared, density, mask, rules, seconds)


def _belied(scan: Scan, density: Density) -> InputError | None:
    """What is said of strokes that are thinner than any pen's, if the resolution were true."""
    stroke = stroke_width(hysteresis(density.values, density))
    if not 0 < stroke * scan.pixel < _FINEST_PEN or stroke >= LEAST_STROKE:
        return None
    return InputError(
        f"{scan.source}: strokes would be {stroke * scan.pixel:.2f} mm wide, and pens write {_FINEST_PEN:g} or more: "
        f"{'--dpi' if scan.told else 'the resolution in the file'} is wrong; give the true one with --dpi."
    )


def finish(inked: Inked) -> WrittenPage:
    """Line graph and matte of a page whose ink is known.

    Raises
    ------
    InputError
        The size of the writing belies the resolution.
    """
    prepared, density, mask = inked.prepared, inked.density, inked.mask
    scan, seconds = prepared.scan, dict(inked.seconds)
    notes = check_size(inked.rules, scan)
    with _timed(seconds, "graph"):
        graph = find_lines_of_ink(scan, mask, density)
    with _timed(seconds, "matte"):
        matte = find_matte(scan, mask, prepared.inks)
    return WrittenPage(scan, prepared.paper, prepared.inks, density, mask, graph, matte, inked.rules, notes, seconds)


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
        Scale of densities of the whole hand (`density.pooled`).
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
def _timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    begin = time.process_time()
    yield
    seconds[name] = time.process_time() - begin


def check_size(rules: Rules, scan: Scan) -> tuple[str, ...]:
    """What is to be said of the size of the writing.

    Raises
    ------
    InputError
        Writing of that size is not handwriting: the resolution is wrong.
    """
    if not rules.lines:
        return (f"{scan.source}: no line of writing was found.",)
    fits = _X_HEIGHTS[0] <= rules.x_height <= _X_HEIGHTS[1]
    if len(rules.lines) > 2:
        fits &= _PITCHES[0] <= rules.pitch <= _PITCHES[1]
    if fits:
        return ()
    usual = min(_USUAL_DPI, key=lambda dpi: abs(np.log(rules.x_height * scan.dpi / dpi / _USUAL_X_HEIGHT)))
    raise InputError(
        f"{scan.source}: at {scan.dpi:g} dpi small letters are {rules.x_height:.1f} mm tall and lines "
        f"{rules.pitch:.1f} mm apart, which is not the size of handwriting ({_X_HEIGHTS[0]:g}–{_X_HEIGHTS[1]:g} mm, "
        f"{_PITCHES[0]:g}–{_PITCHES[1]:g} mm): {'--dpi' if scan.told else 'the resolution in the file'} is wrong; "
        f"give the true one with --dpi, perhaps {usual}."
    )
