"""A sheet in its picture: what shows that it is no single flat page, and a sheet to write on made flat, and alone.

The outline of a sheet against the ground that it lies on tells a photograph taken at an angle from a scan.  The empty
band between two columns tells an open book, or two pages scanned at once.  A sheet that is to be written on, and that
lies on something darker in a photograph, is cut out along its outline and made rectangular (`read_sheet`).

Source: own method.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.libraries import cv2
from handout.scanning.checks import LEAST_DPI, MOST_DPI, has_plausible_dpi
from handout.scanning.picture_files import is_pdf, read_picture
from handout.scanning.scan import FilePicture
from handout.scanning.text_lines import find_text_lines
from handout.values import Array


@dataclass(frozen=True)
class OutlineSettings:
    """What counts as the outline of a sheet; set by eye on photographs."""

    long: int = 800  # pixels of the picture in which the outline is looked for
    contrast: int = 40  # levels between sheet and ground
    share: tuple[float, float] = (0.2, 0.97)  # of the picture that a sheet covers
    full: float = 0.96  # of the area between its four sides that a sheet fills
    edge: int = 4  # pixels from the edge of the picture: what lies there is no side of the sheet
    beside: int = 6  # pixels to either side of an edge
    straight: float = 2.5  # pixels: how far a side may bend
    angle: float = 2.0  # degrees between opposite sides
    focal: float = 1.0  # long sides of the picture: of phones 0.7, more where they zoom; 0.75 and 1.2 do the same


_OUTLINE = OutlineSettings()


@dataclass(frozen=True)
class GutterSettings:
    """What counts as the gap between two columns; set by eye."""

    cell: float = 1.0  # mm
    width: float = 8.0  # mm: wider than any space between words
    middle: tuple[float, float] = (0.2, 0.8)  # of the ink's width: where the band may lie
    strays: float = 0.02  # of the rows with ink: so few may cross the band
    lines: int = 3  # on either side


_GUTTER = GutterSettings()
_LEANS = np.tan(np.radians(np.arange(-3.0, 3.01, 0.5)))  # of the page on the scanner


def flat_sheet(picture: FilePicture) -> FilePicture:
    """The sheet alone, flat, of a picture that is no scan and shows all its sides; any other picture as it is.

    Raises InputError: its opposite sides are not parallel, so that it was photographed at an angle, and not all are to
    be seen.
    """
    sides = outline(picture.rgb)
    pairs = [(one, other) for one, other in (sides[0::2], sides[1::2]) if one is not None and other is not None]
    cosines = [abs(float(one[1] @ other[1])) for one, other in pairs]
    angle = max((float(np.degrees(np.arccos(min(cosine, 1.0)))) for cosine in cosines), default=0.0)
    oblique = angle > _OUTLINE.angle
    if len(pairs) == 2 and (oblique or picture.photographed or not has_plausible_dpi(picture)):
        return replace(picture, rgb=_straighten_sheet(picture.rgb, sides))
    if oblique:
        raise InputError(
            f"{picture.source} was photographed at an angle: opposite edges of the sheet are {angle:.1f}° apart "
            f"(at most {_OUTLINE.angle:g}°). Photograph it again with all its edges in the picture, on something "
            "darker, so that it can be made flat; or lay it on a scanner."
        )
    return picture


def outline(rgb: NDArray[np.uint8]) -> list[Array | None]:
    """The sheet's upper, right, lower and left side; None for one that is not to be seen.

    Each is (2, 2): a point on it, pixels of the picture, and its direction.
    """
    factor = min(1.0, _OUTLINE.long / max(rgb.shape[:2]))
    small = np.asarray(cv2.resize(rgb, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA))
    grey = np.asarray(cv2.morphologyEx(small.max(axis=2), cv2.MORPH_CLOSE, np.ones((15, 15), np.uint8)))
    piece = _sheet(np.asarray(grey, dtype=np.uint8))
    if piece is None:
        return [None] * 4
    # take away the fall of light over the piece of the sheet, so that all of it is as bright
    rows, columns = np.nonzero(piece[::4, ::4])
    light = np.log(np.maximum(grey[::4, ::4][rows, columns], 1.0))
    level, down, across = np.linalg.lstsq(np.column_stack([np.ones(len(rows)), rows, columns]), light, rcond=None)[0]
    y, x = np.arange(grey.shape[0])[:, None] / 4, np.arange(grey.shape[1]) / 4
    even = grey / np.exp(down * y + across * x + level - float(light.mean()))
    lit = np.asarray(np.clip(even, 0, 255), dtype=np.uint8)
    piece = _sheet(lit)
    if piece is None:
        return [None] * 4
    contour = max(cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=len)
    points = contour.reshape(-1, 2).astype(np.float64)
    # the outermost points (4, 2) of the contour along the diagonals, clockwise from the upper left
    diagonals = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=np.float64)
    corners = points[np.argmax(points @ diagonals.T, axis=0)]
    # a sheet is convex: what a shadow takes of it counts
    if cv2.contourArea(cv2.convexHull(contour)) < _OUTLINE.full * cv2.contourArea(corners.astype(np.float32)):
        return [None] * 4
    sides = _sides(points, corners, np.asarray(lit, dtype=np.float64))
    # the middle of a pixel of the smaller picture
    return [None if side is None else np.array([(side[0] + 0.5) / factor - 0.5, side[1]]) for side in sides]


def _sheet(grey: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """(h, w) uint8: the largest bright piece, if it stands out and is large enough."""
    bright = np.asarray(cv2.threshold(grey, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[1])
    if not bright.any() or bright.all():
        return None
    if float(np.median(grey[bright > 0])) - float(np.median(grey[bright == 0])) < _OUTLINE.contrast:
        return None
    bright = np.asarray(cv2.morphologyEx(bright, cv2.MORPH_OPEN, np.ones((9, 9), np.uint8)))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(bright, connectivity=4)
    if count < 2:
        return None
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    if not _OUTLINE.share[0] < stats[largest, cv2.CC_STAT_AREA] / grey.size < _OUTLINE.share[1]:
        return None
    return np.asarray(labels == largest, dtype=np.uint8)


def _sides(points: Array, corners: Array, grey: Array) -> list[Array | None]:
    """A point and the direction of each side, where it lies inside the picture, runs straight, and is no shadow's."""
    high, wide = (side - 1 - _OUTLINE.edge for side in grey.shape)
    inside = (points > _OUTLINE.edge).all(axis=1) & (points[:, 0] < wide) & (points[:, 1] < high)
    sides: list[Array | None] = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.linalg.norm(b - a))
        direction = (b - a) / max(length, 1e-9)
        along = (points - a) @ direction
        across = (points - a) @ np.array([-direction[1], direction[0]])
        on_side = inside & (along > 0.1 * length) & (along < 0.9 * length) & (np.abs(across) < 0.04 * length)
        long_enough = on_side.sum() > 0.6 * 0.8 * length > 40
        visible = long_enough and _step(grey, points[on_side], direction) > _OUTLINE.contrast / 2
        sides.append(_fit_side(points[on_side]) if visible else None)
    return sides


def _step(grey: Array, points: Array, direction: Array) -> float:
    """How much darker it is just outside a side than just inside, levels; little at the edge of a shadow."""
    inwards = np.array([-direction[1], direction[0]])
    inner, outer = (np.rint(points + by * inwards).astype(np.intp) for by in (_OUTLINE.beside, -_OUTLINE.beside))
    levels = [
        grey[np.clip(at[:, 1], 0, len(grey) - 1), np.clip(at[:, 0], 0, grey.shape[1] - 1)] for at in (inner, outer)
    ]
    return float(np.median(levels[0] - levels[1]))


def _fit_side(points: Array) -> Array | None:
    """(2, 2): a point and the direction of the line through points (n, 2), or None if they do not lie on one."""
    count = len(points)
    for _ in range(3):
        middle = points.mean(axis=0)
        _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
        distance = np.abs((points - middle) @ axes[1])
        line = np.array([middle, axes[0]])
        if distance.max() < _OUTLINE.straight:
            return line
        points = points[distance < max(_OUTLINE.straight, float(np.percentile(distance, 90)))]
    return line if len(points) > 0.6 * count else None


@dataclass(frozen=True)
class Gutter:
    """A band without ink between two columns.

    at : x of its middle, half-way down the page, mm.
    width : mm.
    lines : how many lines of writing there are left and right of it.
    """

    at: float
    width: float
    lines: tuple[int, int]


def find_gutter(ink: NDArray[np.bool_], dpi: float) -> Gutter | None:
    """The band between two columns of writing, or None if there is one column.

    ink : (h, w) bool
    dpi : pixels per inch.
    """
    side = _GUTTER.cell / 25.4 * dpi
    y, x = np.nonzero(ink)
    cells = np.zeros((int(ink.shape[0] / side) + 1, int(ink.shape[1] / side) + 1), dtype=bool)
    cells[(y / side).astype(np.intp), (x / side).astype(np.intp)] = True
    rows = np.flatnonzero(cells.any(axis=1))
    if not len(rows):
        return None
    part = cells[rows[0] : rows[-1] + 1]
    width, at = max(_band(_shear_cells(part, lean)) for lean in _LEANS.tolist())
    if width * _GUTTER.cell < _GUTTER.width:
        return None
    cut = round(at * _GUTTER.cell / 25.4 * dpi)
    sides = tuple(len(find_text_lines(np.ascontiguousarray(side), dpi).lines) for side in (ink[:, :cut], ink[:, cut:]))
    if min(sides) < _GUTTER.lines:
        return None
    return Gutter(at * _GUTTER.cell, width * _GUTTER.cell, (sides[0], sides[1]))


def _shear_cells(cells: NDArray[np.bool_], lean: float) -> NDArray[np.bool_]:
    """The cells with their rows moved, so that a band that leans stands upright."""
    middle = len(cells) / 2
    return np.stack([np.roll(row, round(lean * (i - middle))) for i, row in enumerate(cells)])


def _band(cells: NDArray[np.bool_]) -> tuple[int, float]:
    """Width of the widest empty band inside the ink, and its middle, in cells."""
    ink_cells = cells.sum(axis=0)
    inky = np.flatnonzero(ink_cells > _GUTTER.strays * len(cells))
    if len(inky) < 2:
        return 0, 0.0
    low, high = (inky[0] + share * (inky[-1] - inky[0]) for share in _GUTTER.middle)
    gaps, left = np.diff(inky) - 1, inky[:-1] + 1
    middle = left + gaps / 2
    inside = np.flatnonzero((middle > low) & (middle < high))
    if not len(inside):
        return 0, 0.0
    k = int(inside[np.argmax(gaps[inside])])
    return int(gaps[k]), float(middle[k])


_PDF_DPI = 300.0  # at which a page of a PDF is drawn
_NUMBERED = re.compile(r"(?P<file>.+):(?P<page>[1-9]\d{0,5})")


@dataclass(frozen=True, eq=False)
class GivenSheet:
    """A sheet as pixels.

    name : of its file, and its page.
    rgb : (h, w, 3) uint8.
    size : width and height, mm, where the file tells them.
    straightened : whether it was cut out of a photograph.
    pages : how many its file holds, where none of them was named.
    """

    name: str
    rgb: NDArray[np.uint8]
    size: tuple[float, float] | None = None
    straightened: bool = False
    pages: int = 1


def sheet_file(name: str) -> tuple[Path, int | None] | None:
    """The file that a sheet's name means, ``FILE`` or ``FILE:2``, and the page; None where there is none."""
    if Path(name).is_file():
        return Path(name), None
    numbered = _NUMBERED.fullmatch(name)
    if numbered is not None and Path(numbered["file"]).is_file():
        return Path(numbered["file"]), int(numbered["page"])
    return None


def read_sheet(name: str) -> GivenSheet:
    """The sheet of a picture, or of a page of a PDF or TIFF file (the first, unless the name ends with another).

    Raises InputError: no such file, or one that cannot be read.
    """
    found = sheet_file(name)
    if found is None:
        raise InputError(f"There is no sheet {name}.")
    path, page = found
    return _read_sheet(path, page, path.stat().st_mtime_ns)


@lru_cache(maxsize=2)  # it is looked at for its size, for its lines, and for every picture of the writing
def _read_sheet(path: Path, page: int | None, _changed: int) -> GivenSheet:
    label = path.name if page is None else f"{path.name}:{page}"
    if is_pdf(path):
        from handout.scanning.pdf_pages import count_of_pdf, drawn_page

        rgb = drawn_page(path, page or 1, _PDF_DPI)
        height, width = (side / _PDF_DPI * 25.4 for side in rgb.shape[:2])
        return GivenSheet(label, _read_only(rgb), (width, height), pages=1 if page else count_of_pdf(path))
    picture = read_picture(path, page)
    measured = picture.own is not None and LEAST_DPI - 1 <= picture.own <= MOST_DPI and not picture.photographed
    if measured and picture.own is not None:
        height, width = (side / picture.own * 25.4 for side in picture.rgb.shape[:2])
        return GivenSheet(label, _read_only(picture.rgb), (width, height))
    sides = outline(picture.rgb)
    flat = None if any(side is None for side in sides) else _straighten_sheet(picture.rgb, sides)
    return GivenSheet(label, _read_only(picture.rgb if flat is None else flat), None, flat is not None)


def _read_only(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    rgb = rgb.view()
    rgb.flags.writeable = False
    return rgb


def _straighten_sheet(rgb: NDArray[np.uint8], outlined: Sequence[Array | None]) -> NDArray[np.uint8]:
    """The sheet alone, (h, w, 3), its sides the edges of the picture; all four of its outline are known."""
    sides = [side for side in outlined if side is not None]
    # the corners, clockwise from the upper left: each where a side meets the one before
    corners = np.array([_meeting_point(sides[k - 1], sides[k]) for k in range(4)])
    lengths = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    width, height = max(lengths[0], lengths[2]), max(lengths[1], lengths[3])
    ratio = _true_ratio(corners - np.array([rgb.shape[1], rgb.shape[0]]) / 2, _OUTLINE.focal * max(rgb.shape[:2]))
    width, height = round(max(width, height * ratio)), round(max(height, width / ratio))
    frame = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=np.float32)
    matrix = cv2.getPerspectiveTransform(corners.astype(np.float32), frame)
    flat = cv2.warpPerspective(rgb, matrix, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(flat, dtype=np.uint8)


def _true_ratio(corners: Array, focal: float) -> float:
    """Width over height of a rectangle in a photograph.

    corners : (4, 2), clockwise from the upper left, pixels from the middle of the picture.
    focal : of the camera, pixels.  That it is told by the corners, too, is of no use: paper is never flat.

    Source: Zhang and He, Whiteboard scanning and image enhancement, Digital Signal Processing 17, 2007.
    """
    upper_left, upper_right, lower_right, lower_left = np.column_stack([corners, np.full(4, 1.0)])
    across = np.cross(upper_left, lower_right)
    n2 = across @ lower_left / (np.cross(upper_right, lower_right) @ lower_left) * upper_right - upper_left
    n3 = across @ upper_right / (np.cross(lower_left, lower_right) @ upper_right) * lower_left - upper_left
    scale = np.array([1 / focal, 1 / focal, 1.0])
    return float(np.linalg.norm(n2 * scale) / np.linalg.norm(n3 * scale))


def _meeting_point(a: Array, b: Array) -> Array:
    """Where two lines, each a point and a direction (2, 2), meet."""
    along = np.linalg.solve(np.column_stack([a[1], -b[1]]), b[0] - a[0])[0]
    return np.asarray(a[0] + along * a[1])
