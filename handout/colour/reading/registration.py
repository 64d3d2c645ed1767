"""Finds a chart's marks in a scan, and from them where every patch lies, on a page that is turned or bent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import markers
from handout.colour.chart import CELLS, MARKS, Chart, ChartPage, dictionary, page_of_marks, whole
from handout.colour.reading.scan_files import ChartScan, ScanRefused, make_refusal
from handout.libraries import cv2, interpolate
from handout.values import Array, readonly, readonly_indices

_SEARCHED = 1400.0  # pixels, long side of the picture in which marks are looked for first
_ENOUGH = 12  # marks; with fewer a larger picture is searched, thoroughly
_LEAST = 5
_STRAY = 6.0  # mm: a mark further off than a sheet can bend was read wrongly
_UNIT = 100.0  # mm; the spline counts in it
_SMOOTHING = 2e-4  # of the spline, in that unit: keeps errors of single corners from reaching beyond their mark
_INCH = 25.4
_COARSE = 60.0  # dpi under which marks cannot be read
_SHEET = 210.0  # mm, the shorter side of a sheet


@dataclass(frozen=True, eq=False)
class ChartPlacement:
    """Where a page of the chart lies in a scan.

    page : ChartPage
    mirrored : whether the scan shows it as a mirror does.
    to_pixels : (3, 3), homogeneous mm on the page to pixels; pixel (0, 0) has its middle at 0, 0.
    bend : takes points (n, 2), mm on the page, and gives how far (n, 2), mm, the paper is displaced there.
    mark_indices : (m,) int: which of the page's marks were found.
    corners : (4 m, 2) pixels of their corners.
    scale : measured over nominal size, across and down the page; None if the file does not say its resolution.
    stretch : the greatest over the least scale in any direction, 1 if the page has its true shape.
    warp : mm, greatest distance of a mark from where it would be on a flat sheet.
    doubt : mm, greatest distance of a mark from where a spline through the other marks puts it.
    """

    page: ChartPage
    mirrored: bool
    to_pixels: Array
    bend: Callable[[Array], Array]
    mark_indices: NDArray[np.intp]
    corners: Array
    scale: tuple[float, float] | None
    stretch: float
    warp: float
    doubt: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "to_pixels", readonly(self.to_pixels, 3, 3))
        object.__setattr__(self, "mark_indices", readonly_indices(self.mark_indices, None))
        object.__setattr__(self, "corners", readonly(self.corners, None, 2))

    def pixels(self, mm: Array) -> Array:
        """(n, 2) pixels of points (n, 2) on the page in mm."""
        return markers.project(self.to_pixels, mm + self.bend(mm))

    @property
    def pixel(self) -> float:
        """mm of the page that a pixel covers."""
        return 1 / math.sqrt(abs(float(np.linalg.det(self.to_pixels[:2, :2]))))

    @property
    def dpi(self) -> float:
        """Pixels an inch of the page as it was meant to be printed."""
        return _INCH / self.pixel


def place(
    scan: ChartScan, chart: Chart | None = None, page_of: Callable[[int], ChartPage | None] = page_of_marks
) -> ChartPlacement:
    """Find a page of the chart in a scan.

    chart : the one that it must be a page of; None: any that is known.
    page_of : the page that has a mark of a number, for pages that are laid out as the chart's are.

    Raises ScanRefused: no marks, too few, or those of another chart or of several pages.
    """
    grey = in_grey(scan.pixels)
    marks, mirrored = _marks(grey, page_of)
    try:
        page, mark_corners = _one_page(marks, scan.source, page_of)
    except ScanRefused as error:
        # what the file says, or as if the picture showed a sheet and little else
        dpi = max(scan.dpi) if scan.dpi is not None else min(scan.pixels.shape[:2]) * _INCH / _SHEET
        if error.finding.code == "another-chart" or dpi >= _COARSE:
            raise
        raise make_refusal(
            "low-dpi",
            f"The scan has only {dpi:.0f} dpi, too few to read the chart's marks: scan the whole page at 300 dpi.",
            scan.source,
        ) from error
    if chart is not None and whole(page) is not chart:
        wanted = f"chart {chart.version} on {chart.paper.name}"
        pages = f" in {len(chart.pages)} pages" if len(chart.pages) > 1 else ""
        raise make_refusal(
            "another-chart", f"The page is of {page.label}, and wanted is {wanted}{pages}: scan that.", scan.source
        )
    width = grey.shape[1]
    upright = grey[:, ::-1] if mirrored else grey
    order = np.array(sorted(mark_corners))
    corners = markers.refine_corners(
        np.ascontiguousarray(upright), np.concatenate([mark_corners[i] for i in order]), CELLS
    )
    if mirrored:
        corners = np.column_stack([width - 1 - corners[:, 0], corners[:, 1]])
    return _fit_placement(scan, page, mirrored, order, corners)


def in_grey(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """(h, w) uint8 of a scan's pixels."""
    eight = pixels if pixels.dtype == np.uint8 else (pixels >> 8).astype(np.uint8)
    return np.asarray(cv2.cvtColor(eight, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _marks(grey: NDArray[np.uint8], page_of: Callable[[int], ChartPage | None]) -> tuple[list[tuple[int, Array]], bool]:
    """The marks of the picture, or of its mirror image if that shows more; and whether it is the mirror image."""
    code = dictionary()
    upright = markers.find(grey, code, lambda _: True, _ENOUGH, _SEARCHED, MARKS)
    if len([1 for number, _ in upright if page_of(number)]) >= _LEAST:
        return upright, False
    flipped = markers.find(np.ascontiguousarray(grey[:, ::-1]), code, lambda _: True, _ENOUGH, _SEARCHED, MARKS)
    ours = [sum(page_of(number) is not None for number, _ in marks) for marks in (upright, flipped)]
    return (flipped, True) if ours[1] > ours[0] else (upright, False)


def _one_page(
    marks: list[tuple[int, Array]], source: str, page_of: Callable[[int], ChartPage | None]
) -> tuple[ChartPage, dict[int, Array]]:
    """The page that most marks are of, and its marks by their place."""
    pages: dict[str, tuple[ChartPage, dict[int, Array]]] = {}
    for number, corners in marks:
        if (page := page_of(number)) is not None:
            pages.setdefault(page.label, (page, {}))[1].setdefault(number % MARKS, corners)
    if not marks:
        raise make_refusal(
            "no-marks",
            "None of the chart's 16 square marks can be seen: is it the chart, and the printed side down? Scan the "
            "whole page in colour at 300 dpi.",
            source,
        )
    # a stray number or two is noise; more of them are another chart
    several = sorted(pages.values(), key=lambda p: -len(p[1]))
    if not several or len(marks) - len(several[0][1]) > max(2, len(several[0][1])):
        raise make_refusal(
            "another-chart",
            "The marks are those of a chart that this version does not know: print and scan a new chart.",
            source,
        )
    if len(several) > 1 and len(several[1][1]) >= _LEAST:
        raise make_refusal(
            "another-chart",
            f"The picture shows two charts ({several[0][0].label}; {several[1][0].label}): scan one page at a time.",
            source,
        )
    page, mark_corners = several[0]
    if len(mark_corners) < _LEAST:
        raise make_refusal(
            "few-marks",
            f"Only {len(mark_corners)} of the chart's {MARKS} marks can be seen, and {_LEAST} are needed: scan the "
            "whole page at 300 dpi, flat and with nothing on it.",
            source,
        )
    return page, mark_corners


def _fit_placement(
    scan: ChartScan, page: ChartPage, mirrored: bool, order: NDArray[np.intp], corners: Array
) -> ChartPlacement:
    mm = page.marks[order].reshape(-1, 2)
    pixels_a_mm = math.sqrt(
        cv2.contourArea(cv2.convexHull(corners.astype(np.float32)))
        / max(1e-9, cv2.contourArea(cv2.convexHull(mm.astype(np.float32))))
    )
    matrix, _ = cv2.findHomography(mm, corners, cv2.RANSAC, _STRAY * pixels_a_mm)
    if matrix is None or not np.isfinite(matrix).all():
        raise make_refusal("few-marks", "The marks do not lie in a plane: lay the page flat and scan it.", scan.source)
    off = markers.project(np.linalg.inv(matrix), corners) - mm
    near = np.linalg.norm(off, axis=1).reshape(-1, 4).max(axis=1) < _STRAY
    if near.sum() < _LEAST:
        raise make_refusal(
            "few-marks",
            f"Only {near.sum()} marks lie as on a sheet, and {_LEAST} are needed: lay the page flat and "
            "scan the whole of it.",
            scan.source,
        )
    order, corners, mm = order[near], corners[np.repeat(near, 4)], mm[np.repeat(near, 4)]
    to_pixels = np.asarray(cv2.findHomography(mm, corners, 0)[0], dtype=np.float64)
    off = markers.project(np.linalg.inv(to_pixels), corners) - mm
    # the affine map (2, 3) that takes mm to pixels best
    affine = np.asarray(np.linalg.lstsq(np.column_stack([mm, np.ones(len(mm))]), corners, rcond=None)[0].T)
    # size across and down the page against the true one; stretch: its longest extension over its shortest
    across, down = scan.dpi if scan.dpi is not None else (1.0, 1.0)
    real = affine[:, :2] * np.array([[_INCH / across], [_INCH / down]])
    first, second = np.linalg.svd(real, compute_uv=False).tolist()
    along = np.linalg.norm(real, axis=0)
    scale = (float(along[0]), float(along[1])) if scan.dpi is not None else None
    flat = corners - np.column_stack([mm, np.ones(len(mm))]) @ affine.T
    warp = float(np.linalg.norm(flat.reshape(-1, 4, 2).mean(axis=1), axis=1).max()) / pixels_a_mm
    placement = ChartPlacement(
        page, mirrored, to_pixels, _spline(mm, off), order, corners, scale, first / second, warp, 0.0
    )
    # how far, in mm, a mark lies from where a spline through the others puts it, at worst
    worst = 0.0
    for i in range(0, len(mm), 4):
        rest = np.ones(len(mm), dtype=bool)
        rest[i : i + 4] = False
        foreseen = _spline(mm[rest], off[rest])(mm[i : i + 4])
        worst = max(worst, float(np.linalg.norm((foreseen - off[i : i + 4]).mean(axis=0))))
    return replace(placement, doubt=worst)


def _spline(mm: Array, off: Array) -> Callable[[Array], Array]:
    spline = interpolate.RBFInterpolator(mm / _UNIT, off, smoothing=_SMOOTHING, kernel="thin_plate_spline", degree=1)
    return lambda points: np.asarray(spline(np.asarray(points) / _UNIT))
