"""A printer and a flatbed that exist only in the computer, in the place of the user who prints and scans."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.printing.simulated import Flatbed, Inkjet, Press, rip, stock
from handout.profiles import Printer

WHITE = "white"  # paper that is plain
_DPI = 200


@dataclass
class Loop:
    """Prints and scans documents as the simulated devices do.

    profile : of the simulated printer.
    press : the simulated printer; flatbed : the scanner; dpi : of scans.
    rng : lays every page otherwise.
    """

    profile: Printer
    press: Press
    flatbed: Flatbed = field(default_factory=Flatbed)
    dpi: int = _DPI
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def scan(self, document: Path, to: Path) -> list[Path]:
        """Print a document and scan its pages: a file each, beside `to`.

        Raises
        ------
        InputError
            No document as this printer gets them.
        """
        paths = []
        for number, (_, pixels) in enumerate(rip.pages(document, self.profile.dpi), 1):
            sheet = self.press.printed(pixels, self.profile.dpi, self.profile.margins, self.rng)
            picture = self.flatbed.scan(sheet, self.dpi, self.rng)
            paths.append(to.with_name(f"{to.stem}-{number}.tif"))
            write(picture, self.dpi, paths[-1])
        return paths


def write(picture: NDArray[np.unsignedinteger[Any]], dpi: float, path: Path) -> None:
    """A scan as a TIFF that says its resolution."""
    import tifffile

    tifffile.imwrite(path, picture, photometric="rgb", resolution=(dpi, dpi), resolutionunit="INCH")


def simulated(profile: Printer, paper: str = WHITE, faults: Iterable[str] = ()) -> Loop:
    """The loop of a simulated printer.

    Raises
    ------
    InputError
        Not a simulated printer, a paper that it does not have, or an unknown fault.
    """
    if not profile.simulated:
        raise InputError(f"{profile.title} is not simulated: print the chart on it and scan that.")
    known = WHITE if paper == "plain" else paper
    stock.paper(known)
    return Loop(profile, Inkjet(known, faults=faults))
