"""Checks of a scan, as a picture, that can refuse it, in the order in which a page meets them.

Each raises `InputError` with a sentence that says what is wrong and what to do; most take plain numbers, so that each
step of the pipeline can call its own:

- of a file, before it is decoded: `refuse_large`, `page_index`, `square_resolution`
- of the resolution: `check_dpi`, `plausible_dpi`, `refuse_oversize`
- of the inks and the mask: `blank_page`, `refuse_bad_strokes`, `refuse_false_resolution`
- of the text lines: `check_writing_size`; of what is too pale for ink: `check_pale_marks`, which only tells of it

Two checks look at the whole picture and stand by themselves, in `page_layout`: a sheet photographed at an angle and two
columns side by side.  Checks that need the transcript are in `tagging.page_sources`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from handout.errors import InputError
from handout.page_sizes import page
from handout.scanning.scan import FilePicture, Scan

if TYPE_CHECKING:
    from handout.scanning.text_lines import TextLines

MOST_PIXELS = 200_000_000  # an A4 sheet at 1200 dpi has 139 million
# of the ink: clean pages have .002 of it in pale marks, one whose back shines through half as much as it has ink
PALE = 0.15
_LEAST_SIDE = 32  # pixels: a line of writing needs more
_SQUARE = 1.02  # greatest ratio of the resolutions across and down: faxes have 2
LEAST_DPI, MOST_DPI = 100.0, 2400.0  # below, strokes have no width to measure; above, no scanner resolves
_ROUNDED = 0.5  # dpi: PNG counts whole pixels a metre
_LONGEST_SIDE = 610.0  # mm: two sheets of A3
_SHEETS = ("A4", "Letter")  # whose width a scan is compared with
_SHAPES, _ALIKE = ("A4", "Letter", "A5", "A6", "A3"), 0.04  # of photographed sheets; ratios of sides that tell them
_SCANNER_DPI = (200, 300, 400, 600, 1200)  # that scanners offer
LEAST_STROKE = 2.0  # pixels: of a thinner stroke neither radius nor density can be measured
_FINEST_PEN = 0.1  # mm: technical pens start there
_PITCHES = (3.0, 28.0)  # mm from line to line: handwriting has 5 to 15
_X_HEIGHTS, _USUAL_X_HEIGHT = (0.8, 9.0), 2.6  # mm


def refuse_large(width: int, height: int, path: Path) -> None:
    """Raise InputError for a picture above the limit, and for an empty one."""
    if width * height > MOST_PIXELS:
        raise InputError(
            f"{path} has {width} × {height} pixels, {width * height / 1e6:.0f} megapixels; the limit is "
            f"{MOST_PIXELS // 10**6}. Scan at 600 dpi or less, or cut the page into parts."
        )
    if min(width, height) < _LEAST_SIDE:
        raise InputError(f"{path} has {width} × {height} pixels: too small to hold a line of writing.")


def source_of(path: Path, page: int | None, count: int) -> str:
    """What a page of a file is called."""
    return f"{path}:{page}" if count > 1 else str(path)


def page_index(count: int, page: int | None, path: Path) -> int:
    """Index from 0 of the page to read, of a file of `count` pages."""
    if page is None:
        if count > 1:
            raise InputError(f"{path} holds {count} pages: say which one, as {path}:1 … {path}:{count}.")
        return 0
    if not 1 <= page <= count:
        pages = "1 page" if count == 1 else f"pages 1–{count}"
        raise InputError(f"{path}:{page}: there is no such page; {path} holds {pages}.")
    return page - 1


def square_resolution(dpi: Any, path: Path) -> float | None:
    """Pixels per inch, the same across and down. Raises InputError: they are not."""
    if not dpi or not all(float(side) > 0 for side in dpi):
        return None
    across, down = (float(side) for side in dpi)
    if max(across, down) > _SQUARE * min(across, down):
        raise InputError(
            f"{path} has {across:g} dpi across and {down:g} down, as faxes have: scan the page at 300 dpi both ways."
        )
    return across


def check_dpi(dpi: float | None) -> None:
    """Raise InputError for a resolution that no scan has."""
    if dpi is not None and not LEAST_DPI <= dpi <= MOST_DPI:
        raise InputError(
            f"--dpi {dpi:g} is outside {LEAST_DPI:g}–{MOST_DPI:g}: handwriting needs a scan of 300 or more."
        )


def has_plausible_dpi(picture: FilePicture) -> bool:
    """Whether the file's own resolution can be a scanner's."""
    dpi, longest = picture.own or 0.0, max(picture.rgb.shape[:2])
    return LEAST_DPI - _ROUNDED <= dpi <= MOST_DPI and longest / dpi * 25.4 <= _LONGEST_SIDE


def plausible_dpi(picture: FilePicture) -> float:
    """The file's own resolution, if it can be a scanner's; otherwise a question."""
    dpi, (height, width) = picture.own, picture.rgb.shape[:2]
    if dpi and has_plausible_dpi(picture):
        return dpi
    problem = f"says {dpi:g} dpi, which is not a scan's" if dpi else "does not say its resolution"
    if picture.photographed:
        problem = f"is a photograph and {problem}"
    raise InputError(f"{picture.source} {problem}: give it with --dpi{_dpi_hint(width, height)}.")


def likely_dpi(shape: tuple[int, ...], x_height: float | None = None) -> float:
    """Pixels an inch of a picture (h, w) that says none: those of a standard sheet of its shape, or by its letters.

    x_height : of its small letters, pixels, where it is known; a sheet on which they would be half as high as usual, or
        twice as high, is another one.
    """
    short, long = sorted(shape[:2])
    sizes = [sorted((sheet.width, sheet.height)) for sheet in map(page, _SHAPES)]
    sheets = [25.4 * long / size[1] for size in sizes if abs(long / short * size[0] / size[1] - 1) < _ALIKE]
    if x_height is None:
        return min(max([*sheets, 25.4 * long / page(_SHAPES[0]).height][0], LEAST_DPI), MOST_DPI)
    by_letters = 25.4 * x_height / _USUAL_X_HEIGHT
    far = {dpi: abs(float(np.log(dpi / max(by_letters, 1.0)))) for dpi in sheets}
    return min((dpi for dpi in sheets if far[dpi] < np.log(2)), key=far.__getitem__, default=by_letters)


def _dpi_hint(width: int, height: int) -> str:
    """What the resolution would be if a whole sheet had been scanned."""
    for name in _SHEETS:
        sheet = page(name)
        for dpi in _SCANNER_DPI:
            if abs(width / dpi * 25.4 / sheet.width - 1) < 0.025 and height / dpi * 25.4 < 1.03 * sheet.height:
                return f" (if the {name} sheet was scanned at its full width: --dpi {dpi})"
    return ""


def refuse_oversize(picture: FilePicture, dpi: float) -> None:
    """Raise InputError for a resolution by which the page would be larger than two sheets of A3."""
    height, width = picture.rgb.shape[:2]
    if max(width, height) / dpi * 25.4 > _LONGEST_SIDE:
        raise InputError(
            f"{picture.source} would be {width / dpi * 25.4:.0f} × {height / dpi * 25.4:.0f} mm large at "
            f"--dpi {dpi:g}, and a page has at most {_LONGEST_SIDE:g}: give its true resolution"
            f"{_dpi_hint(width, height)}."
        )


def blank_page(scan: Scan) -> InputError:
    """The error of a scan without ink."""
    return InputError(
        f"{scan.source} holds nothing but paper: no strokes stand out from it. "
        "Was the right side scanned? A faint pencil needs a darker scan."
    )


def refuse_bad_strokes(strokes: bool, width: float, source: str) -> None:
    """Raise InputError if there are no strokes, or strokes of a width, pixels, at which nothing can be measured."""
    if not strokes:
        raise InputError(f"{source} holds nothing but paper and specks: no strokes stand out from it.")
    if width < LEAST_STROKE:
        raise InputError(
            f"{source}: strokes are {width:.1f} pixels wide, and need {LEAST_STROKE:g}: "
            "scan at a higher resolution (300 dpi, better 600)."
        )


def refuse_false_resolution(stroke: float, scan: Scan) -> None:
    """Raise InputError if strokes of that width, pixels, would be thinner than any pen's, were the resolution true."""
    if scan.told is None or not 0 < stroke * scan.pixel < _FINEST_PEN or stroke >= LEAST_STROKE:
        return
    raise InputError(
        f"{scan.source}: strokes would be {stroke * scan.pixel:.2f} mm wide, and pens write {_FINEST_PEN:g} or more: "
        f"{'--dpi' if scan.told else 'the resolution in the file'} is wrong; give the true one with --dpi."
    )


def check_writing_size(text: TextLines, scan: Scan) -> tuple[str, ...]:
    """Notes on the writing, such as that there is none.

    Raises InputError: writing of that size is not handwriting: the resolution is wrong.
    """
    if not text.lines:
        return (f"{scan.source}: no line of writing was found.",)
    fits = _X_HEIGHTS[0] <= text.x_height <= _X_HEIGHTS[1]
    if len(text.lines) > 2:
        fits &= _PITCHES[0] <= text.pitch <= _PITCHES[1]
    if fits:
        return ()
    usual = min((150, *_SCANNER_DPI), key=lambda dpi: abs(np.log(text.x_height * scan.dpi / dpi / _USUAL_X_HEIGHT)))
    raise InputError(
        f"{scan.source}: at {scan.dpi:g} dpi small letters are {text.x_height:.1f} mm tall and lines "
        f"{text.pitch:.1f} mm apart, which is not the size of handwriting ({_X_HEIGHTS[0]:g}–{_X_HEIGHTS[1]:g} mm, "
        f"{_PITCHES[0]:g}–{_PITCHES[1]:g} mm): {'--dpi' if scan.told else 'the resolution in the file'} is wrong; "
        f"give the true one with --dpi, perhaps {usual}."
    )


def check_pale_marks(share: float, scan: Scan) -> tuple[str, ...]:
    """Notes on marks too pale for the ink of a page; `share` : how much of them there is, for 1 of ink."""
    if share < PALE:
        return ()
    return (
        f"{scan.source}: pale marks, {share:.0%} as much as its ink, were left out: writing that shines through from "
        "the back, or stains. What of them is writing can be painted as ink with `handout hand edit`.",
    )
