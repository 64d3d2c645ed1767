"""Files with scans: their pixels as the scanner gave them, and what is found wrong, in words that say what to do."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from handout import tiff
from handout.errors import InputError
from handout.libraries import cv2
from handout.summary import one_line

MOST_NAMED = 8  # patches that a sentence names

Severity = Literal["refuse", "warn"]


@dataclass(frozen=True)
class ScanFinding:
    """One thing that is wrong, or may be.

    code : names the kind of fault, for programs: "mirrored", "cropped" …
    severity : "refuse": no calibration may be made of it; "warn": it may, but less well.
    sentence : what is wrong, and what to do.
    where : the file, and its page if it holds several.
    patches : the patches that it concerns, by their names on the chart.
    """

    code: str
    severity: Severity
    sentence: str
    where: str = ""
    patches: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.where}: {self.sentence}" if self.where else self.sentence

    def facts(self) -> dict[str, str]:
        """What ``--json`` prints of it."""
        return {"code": self.code, "severity": self.severity, "sentence": str(self)}


class ScanRefused(InputError):
    """A scan that cannot be read at all; `finding` says why."""

    def __init__(self, finding: ScanFinding) -> None:
        super().__init__(str(finding))
        self.finding = finding


def make_refusal(code: str, sentence: str, where: str) -> ScanRefused:
    """The error for one fault that leaves nothing to read."""
    return ScanRefused(ScanFinding(code, "refuse", sentence, where))


_MOST = 300_000_000  # pixels: A4 at 1200 dpi has 139 million
_LEAST = 200  # pixels a side: a chart at 50 dpi has 413
_SQUARE = 1.01
_DAMAGED = (OSError, SyntaxError, ValueError, EOFError, TypeError, KeyError, IndexError)
# quality in the sense of the Independent JPEG Group, from the mean of its luminance table; 57.6 is that of quality 50
_STANDARD_SUM = 57.625
_POOR, _BAD = 80.0, 40.0


@dataclass(frozen=True, eq=False)
class ChartScan:
    """A scanned page.

    pixels : (h, w, 3) uint8 or uint16, as in the file, no profile applied.
    dpi : (across, down) as the file says; None if it does not.
    source : what it is called in messages.
    findings : what its file says is wrong.
    jpeg : whether the file is a JPEG, so that its tables have told its quality.
    """

    pixels: NDArray[Any]
    dpi: tuple[float, float] | None = None
    source: str = "scan"
    findings: tuple[ScanFinding, ...] = ()
    jpeg: bool = False

    __repr__ = one_line

    def __post_init__(self) -> None:
        if self.pixels.dtype not in (np.uint8, np.uint16) or self.pixels.ndim != 3 or self.pixels.shape[2] != 3:
            raise InputError(
                f"{self.source}: a scan is (h, w, 3) of 8 or 16 bits, and this is {self.pixels.shape} of "
                f"{self.pixels.dtype}: convert it."
            )
        height, width = self.pixels.shape[:2]
        if not (min(height, width) >= _LEAST and height * width <= _MOST):
            raise InputError(
                f"{self.source} has {width} × {height} pixels; {_LEAST} a side to {_MOST // 10**6} million in all can "
                "be read: scan the whole chart at 300 dpi."
            )

    @property
    def full(self) -> int:
        """The greatest number that a pixel can have."""
        return int(np.iinfo(self.pixels.dtype).max)


def open_scans(path: Path) -> list[ChartScan]:
    """All pages of a TIFF, PNG or JPEG.

    Raises InputError: unreadable. ScanRefused: of a kind that has no colours to read: CMYK, palette.
    """
    if not path.is_file():
        raise InputError(f"Cannot read {path}: there is no such file.")
    with path.open("rb") as file:
        head = file.read(4)
    if head[:2] in (b"II", b"MM"):
        return list(_tiff(path))
    if head == b"%PDF":
        raise InputError(f"{path} is a PDF: let the scanner save the chart as TIFF or PNG.")
    return [_picture(path)]


def _tiff(path: Path) -> Iterator[ChartScan]:
    import tifffile

    try:
        with tiff.open_tiff(path) as file:
            pages = [page for page in file.pages if isinstance(page, tifffile.TiffPage)]
            whole = [page for page in pages if not page.is_reduced]
            read = [(_tiff_page(page, path), page.photometric, _tiff_dpi(page)) for page in whole]
            jpeg = [page.compression in (6, 7) for page in whole]
            if not whole:
                raise ValueError("no pages")
    except Exception as error:  # what a damaged file raises there is not one kind
        raise InputError(
            f"Cannot read {path}: it is damaged or cut off, or packed in a way that cannot be read; save it as an "
            "uncompressed TIFF, or as PNG."
        ) from error
    for i, (values, photometric, dpi) in enumerate(read):
        source = f"{path}:{i + 1}" if len(read) > 1 else str(path)
        kind = tifffile.PHOTOMETRIC(photometric).name
        if kind not in ("RGB", "YCBCR", "MINISBLACK", "MINISWHITE"):
            raise _not_rgb({"SEPARATED": "CMYK", "PALETTE": "P"}.get(kind, kind), source)
        if kind == "MINISWHITE":
            values = ~values
        findings = [] if not jpeg[i] else [ScanFinding("jpeg", "warn", _JPEG_INSIDE, source)]
        yield _scan(values, dpi, source, findings, jpeg[i])


_JPEG_INSIDE = (
    "The TIFF is packed as JPEG, which smears colours into each other: let the scanner save it without compression."
)


def _tiff_page(page: Any, path: Path) -> NDArray[Any]:
    """Pixels (h, w) or (h, w, channels)."""
    try:
        values = np.asarray(page.asarray())
    except ValueError:
        # packed in a way that tifffile needs another package for, as LZW is: OpenCV reads these, 16 bits too
        done, pictures = cv2.imreadmulti(str(path), start=page.index, count=1, flags=cv2.IMREAD_UNCHANGED)
        if not done or not pictures:
            raise
        return _as_rgb(np.asarray(pictures[0]))
    return np.moveaxis(values, 0, -1) if page.planarconfig == 2 and values.ndim == 3 else values


def _as_rgb(values: NDArray[Any]) -> NDArray[Any]:
    """Channels in the order of OpenCV, blue first, in that of everyone else."""
    return values if values.ndim == 2 else values[:, :, [2, 1, 0, 3][: values.shape[2]]]


def _tiff_dpi(page: Any) -> tuple[float, float] | None:
    dpi = tiff.resolution(page)
    return dpi if dpi is not None and min(dpi) > 1 else None


def _picture(path: Path) -> ChartScan:
    from PIL import Image, ImageOps

    Image.MAX_IMAGE_PIXELS = None
    source = str(path)
    try:
        with warnings.catch_warnings(), Image.open(path) as image:
            warnings.simplefilter("ignore")
            if image.width * image.height > _MOST:
                raise InputError(f"{path} has {image.width} × {image.height} pixels: scan the chart at 300 dpi.")
            deep = image.format == "PNG" and _png_depth(path) == 16
            dpi = image.info.get("dpi")
            jpeg, findings = image.format in ("JPEG", "MPO"), _jpeg(image, source)
            ImageOps.exif_transpose(image, in_place=True)
            mode = image.mode
            values = np.asarray(image) if not deep else np.empty(0)
    except _DAMAGED as error:
        raise InputError(
            f"Cannot read {path}: it is no TIFF, PNG or JPEG, or it is damaged or cut off; scan the chart again."
        ) from error
    if mode in ("P", "PA", "CMYK", "LAB", "HSV"):
        raise _not_rgb(mode, source)
    if deep:
        deep_values = cv2.imdecode(np.fromfile(path, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
        if deep_values is None:
            raise InputError(f"Cannot read {path}: it is damaged or cut off; scan the chart again.")
        values = _as_rgb(np.asarray(deep_values))  # Pillow would reduce 16 bits to 8 without a word
    resolution = (float(dpi[0]), float(dpi[1])) if dpi and min(dpi) > 1 else None
    return _scan(values, resolution, source, findings, jpeg)


def _not_rgb(mode: str, source: str) -> ScanRefused:
    what = "The picture has a palette of few colours" if mode[0] == "P" else f"The picture is in {mode}"
    sentence = f"{what}, which cannot show what the scanner saw: scan in RGB colour, 24 or 48 bits, without conversion."
    return make_refusal("palette" if mode[0] == "P" else "not-rgb", sentence, source)


def _png_depth(path: Path) -> int:
    with path.open("rb") as file:
        return file.read(25)[24]


def _scan(
    values: NDArray[Any], dpi: tuple[float, float] | None, source: str, findings: list[ScanFinding], jpeg: bool
) -> ChartScan:
    """A scan of what a file holds: three channels, whatever it had."""
    if values.dtype == bool:
        findings = [*findings, ScanFinding("grey", "refuse", _ONE_BIT, source)]
        values = np.where(values, 255, 0).astype(np.uint8)
    if values.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{source} holds numbers of kind {values.dtype}: scan in RGB colour, 24 or 48 bits.")
    if values.ndim == 2 or values.shape[2] < 3:
        if not any(finding.code == "grey" for finding in findings):
            findings = [*findings, ScanFinding("grey", "refuse", GREY, source)]
        values = np.repeat(values.reshape(*values.shape[:2], -1)[:, :, :1], 3, axis=2)
    if values.shape[2] > 3:
        values, more = _without_alpha(values, source)
        findings = findings + more
    if dpi is None:
        findings = [*findings, ScanFinding("no-dpi", "warn", _NO_DPI, source)]
    elif max(dpi) > _SQUARE * min(dpi):
        across, down = (round(each) for each in dpi)
        differs = f"The file says {across} dpi across and {down} down: scan with the same resolution both ways."
        findings = [*findings, ScanFinding("dpi-differs", "warn", differs, source)]
    return ChartScan(np.ascontiguousarray(values[:, :, :3]), dpi, source, tuple(findings), jpeg)


GREY = "The scan is grey: choose colour (24 or 48 bits) in the scanner's program and scan the chart again."
_ONE_BIT = (
    "The scan is black and white only, 1 bit a pixel: choose colour (24 or 48 bits) in the scanner's program and scan "
    "the chart again."
)
_NO_DPI = (
    "The file does not say its resolution, so that it cannot be checked whether the chart was printed at its true "
    "size: save scans as TIFF or PNG from the scanner's own program."
)


def _without_alpha(values: NDArray[Any], source: str) -> tuple[NDArray[Any], list[ScanFinding]]:
    full = np.iinfo(values.dtype).max
    alpha = values[:, :, 3]
    if alpha.min() == full:
        return values, []
    share = float((alpha < full).mean())
    sentence = (
        f"{share:.0%} of the picture is transparent, which no scanner does; it was laid on white. Give the scan as the "
        "scanner saved it, before any program cut it out."
    )
    part = alpha[:, :, None].astype(np.float32) / full
    laid = np.rint(values[:, :, :3] * part + full * (1 - part)).astype(values.dtype)
    return laid, [ScanFinding("alpha", "warn", sentence, source)]


def _jpeg(image: Any, source: str) -> list[ScanFinding]:
    """What the tables of a JPEG say of its quality."""
    tables = getattr(image, "quantization", None)
    if not tables:
        return []
    ratio = float(np.mean(tables[0])) / _STANDARD_SUM * 100
    quality = 100 - ratio / 2 if ratio <= 100 else 5000 / ratio
    if quality >= _POOR:
        return []
    sentence = (
        f"The JPEG is of quality about {quality:.0f}, which smears colours into each other: save the scan as TIFF or "
        "PNG, or as JPEG of quality 90 or more."
    )
    return [ScanFinding("jpeg", "refuse" if quality < _BAD else "warn", sentence, source)]
