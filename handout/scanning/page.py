"""A scan: a picture of a page, with its resolution."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.page_sizes import page
from handout.scanning.picture import Picture, read_picture
from handout.summary import one_line

LEAST_DPI, MOST_DPI = 100.0, 2400.0
ENOUGH_DPI, _FINE = 600.0, 700.0  # what is finer than the second is reduced to the first
_ROUNDED = 0.5  # dpi: PNG counts pixels a metre
_LONGEST_SIDE = 610.0  # mm: what a file's own resolution may make of a scan, two sheets of A3
_SHEETS = ("A4", "Letter")  # whose width a scan is held against


@dataclass(frozen=True, eq=False)
class Scan:
    """A scanned page.

    rgb : (h, w, 3) uint8, device RGB, read-only.
    dpi : pixels per inch.
    source : where it came from, for messages.
    told : whether the resolution was given by the user (it is believed then) or read from the file.
    origin : (x, y) of the first pixel in the file's own picture, pixels (not 0 where a border was cut off).
    """

    rgb: NDArray[np.uint8]
    dpi: float
    source: str = "the scan"
    told: bool = True
    origin: tuple[int, int] = (0, 0)

    __repr__ = one_line

    def __post_init__(self) -> None:
        rgb = np.asarray(self.rgb)
        if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[2] != 3:
            raise ValueError(f"expected (h, w, 3) of uint8, got {rgb.shape} of {rgb.dtype}")
        if not (np.isfinite(self.dpi) and self.dpi > 0):
            raise ValueError(f"expected a resolution above 0, got {self.dpi}")
        rgb = rgb.view()
        rgb.flags.writeable = False
        object.__setattr__(self, "rgb", rgb)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width, pixels."""
        return int(self.rgb.shape[0]), int(self.rgb.shape[1])

    @property
    def pixel(self) -> float:
        """Side of a pixel, mm."""
        return 25.4 / self.dpi

    def turned(self, quarters: int) -> Scan:
        """The scan turned anticlockwise by so many quarters of a circle; places count from its own first pixel."""
        rgb = np.ascontiguousarray(np.rot90(self.rgb, quarters))
        return Scan(rgb, self.dpi, self.source, self.told)

    def pixels(self, length: float) -> float:
        """A length in mm as pixels of this scan."""
        return length / self.pixel


def read_scan(path: Path, dpi: float | None = None, page: int | None = None) -> Scan:
    """A scan from a file.

    Parameters
    ----------
    path : Path
        PNG, JPEG, TIFF or any other image that Pillow reads, or a PDF.
    dpi : float, optional
        Pixels per inch; without it the file's own resolution, if it has a plausible one.
    page : int, optional
        Which page of a file that holds several, from 1.

    Raises
    ------
    InputError
        As `read_picture` and `scan_of`.
    """
    check_dpi(dpi)
    return scan_of(read_picture(Path(path), page), dpi)


def check_dpi(dpi: float | None) -> None:
    """Raise InputError for a resolution that no scan has."""
    if dpi is not None and not LEAST_DPI <= dpi <= MOST_DPI:
        raise InputError(
            f"--dpi {dpi:g} is outside {LEAST_DPI:g}–{MOST_DPI:g}: handwriting needs a scan of 300 or more."
        )


def scan_of(picture: Picture, dpi: float | None = None) -> Scan:
    """A picture as a scan; above 700 dpi it is reduced to 600, since nothing of a pen's line is finer.

    Parameters
    ----------
    picture : Picture
    dpi : float, optional
        Pixels per inch; without it the file's own, if it has a plausible one.

    Raises
    ------
    InputError
        A resolution that is missing or not plausible, or that makes the page larger than two sheets of A3.
    """
    check_dpi(dpi)
    told = dpi is not None
    height, width = picture.rgb.shape[:2]
    if dpi is None:
        dpi = _plausible(picture)
    elif max(width, height) / dpi * 25.4 > _LONGEST_SIDE:
        raise InputError(
            f"{picture.source} would be {width / dpi * 25.4:.0f} × {height / dpi * 25.4:.0f} mm large at "
            f"--dpi {dpi:g}, and a page has at most {_LONGEST_SIDE:g}: give its true resolution"
            f"{_guess(width, height)}."
        )
    return _reduced(Scan(picture.rgb, float(dpi), picture.source, told=told))


def _reduced(scan: Scan) -> Scan:
    import cv2

    if scan.dpi <= _FINE:
        return scan
    size = (round(scan.shape[1] * ENOUGH_DPI / scan.dpi), round(scan.shape[0] * ENOUGH_DPI / scan.dpi))
    rgb = np.asarray(cv2.resize(scan.rgb, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return Scan(rgb, ENOUGH_DPI, scan.source, scan.told)


def _plausible(picture: Picture) -> float:
    """The file's own resolution, if it can be a scanner's; otherwise a question."""
    own, (height, width) = picture.own, picture.rgb.shape[:2]
    longest = max(width, height) / own * 25.4 if own else np.inf
    if own and LEAST_DPI - _ROUNDED <= own <= MOST_DPI and longest <= _LONGEST_SIDE:
        return own
    said = f"says {own:g} dpi, which is not a scan's" if own else "does not say its resolution"
    if picture.photographed:
        said = f"is a photograph and {said}"
    raise InputError(f"{picture.source} {said}: give it with --dpi{_guess(width, height)}.")


def _guess(width: int, height: int) -> str:
    """What the resolution would be if a whole sheet had been scanned."""
    for name in _SHEETS:
        sheet = page(name)
        for dpi in (200, 300, 400, 600, 1200):
            if abs(width / dpi * 25.4 / sheet.width - 1) < 0.025 and height / dpi * 25.4 < 1.03 * sheet.height:
                return f" (if the {name} sheet was scanned at its full width: --dpi {dpi})"
    return ""
