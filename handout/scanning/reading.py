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
from handout.scanning.density import Density, Scale, find_density
from handout.scanning.inks import Inks, find_inks
from handout.scanning.linegraph import find_lines_of_ink
from handout.scanning.mask import Mask, find_mask
from handout.scanning.matting import Matte, find_matte
from handout.scanning.page import Scan, read_scan
from handout.scanning.paper import Paper, crop, find_paper, flatten
from handout.scanning.rules import Rules, find_rules
from handout.values import LineGraph

_PITCHES = (3.0, 28.0)  # mm
_X_HEIGHTS = (0.8, 9.0)  # mm


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
    seconds: dict[str, float] = {}
    with _timed(seconds, "scan"):
        scan = crop(source if isinstance(source, Scan) else read_scan(Path(source), dpi, page))
    with _timed(seconds, "paper"):
        paper = find_paper(scan)
        level = flatten(scan, paper)
    with _timed(seconds, "density"):
        inks = find_inks(level)
        density = find_density(level, inks, scale)
    with _timed(seconds, "mask"):
        mask = find_mask(level, inks, density, pen, method, paint)
    with _timed(seconds, "rules"):
        rules = find_rules(mask.ink, scan.dpi, lines)
        notes = _plausible(rules, scan)
    with _timed(seconds, "graph"):
        graph = find_lines_of_ink(scan, mask, density)
    with _timed(seconds, "matte"):
        matte = find_matte(scan, mask, inks)
    return WrittenPage(scan, paper, inks, density, mask, graph, matte, rules, notes, seconds)


@contextmanager
def _timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    begin = time.process_time()
    yield
    seconds[name] = time.process_time() - begin


def _plausible(rules: Rules, scan: Scan) -> tuple[str, ...]:
    """What is to be said of the size of the writing.

    Raises
    ------
    InputError
        The resolution is the file's own, and writing of that size is not handwriting.
    """
    if not rules.lines:
        return (f"{scan.source}: no line of writing was found.",)
    fits = _X_HEIGHTS[0] <= rules.x_height <= _X_HEIGHTS[1]
    if len(rules.lines) > 2:
        fits &= _PITCHES[0] <= rules.pitch <= _PITCHES[1]
    if fits:
        return ()
    said = (
        f"{scan.source}: at {scan.dpi:g} dpi small letters are {rules.x_height:.1f} mm tall and lines "
        f"{rules.pitch:.1f} mm apart, which is not the size of handwriting"
    )
    if scan.told:
        return (f"{said}: is --dpi {scan.dpi:g} right?",)
    raise InputError(f"{said}: the file's resolution is probably wrong; give it with --dpi.")
