"""A simulated printer and a simulated flatbed, in place of the user who prints and scans."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.profiles import Printer
from handout.simulated.printer import SETTINGS, Flatbed, Inkjet, Press, SimulatedSheet, inkjet, job_reader, pen

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

        Parameters
        ----------
        frame : left, top, right, bottom, mm, of what the hand's pen writes in, on every page.

        Raises
        ------
        InputError
            No document as this printer gets them.
        """
        paths = []
        for number, (_, pixels) in enumerate(job_reader.pages(document, self.profile.dpi), 1):
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
        spectrum = pen.ink_of(paper * np.exp(-core), paper, Flatbed())
        return pen.write_on_sheet(sheet, frame, amount[row : row + height], dpi, spectrum, _SHARPENED)


def write(picture: NDArray[np.unsignedinteger[Any]], dpi: float, path: Path) -> None:
    """A scan as a TIFF that says its resolution."""
    import tifffile

    tifffile.imwrite(path, picture, photometric="rgb", resolution=(dpi, dpi), resolutionunit="INCH")


def make_loop(profile: Printer, paper: str = WHITE, faults: Iterable[str] = (), hand: str = "") -> Loop:
    """The loop of a simulated printer; `faults` are of the printer, or settings of the scanner (`SETTINGS`).

    Raises
    ------
    InputError
        Not a simulated printer, a paper that it does not have, or an unknown fault.
    """
    if not profile.simulated:
        raise InputError(f"{profile.title} is not simulated: print the chart on it and scan that.")
    paper_name = WHITE if paper == "plain" else paper
    inkjet.find_paper(paper_name)
    settings = {name: value for fault in faults for name, value in SETTINGS.get(fault, {}).items()}
    press = Inkjet(paper_name, faults=[fault for fault in faults if fault not in SETTINGS])
    return Loop(profile, press, Flatbed(**settings), hand=hand)
