"""Pictures and scans from files: PNG, JPEG, TIFF and whatever else Pillow reads, or a page of a PDF.

A new format gets a module of its own beside `pdf_pages`, and a line in `read_picture` and
`count_pages`.

The size is read from the head of the file and refused there, before anything is decoded.  Colours stay the scanner's
own (device RGB); 16-bit files are read at 8 bits, which is finer than the noise of paper.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.libraries import cv2
from handout.scanning.checks import (
    check_dpi,
    has_plausible_dpi,
    likely_dpi,
    page_index,
    plausible_dpi,
    refuse_large,
    refuse_oversize,
    source_of,
    square_resolution,
)
from handout.scanning.scan import FilePicture, Scan

if TYPE_CHECKING:
    from PIL.Image import Image as Image_
from handout import tiff

ENOUGH_DPI, _FINE = 600.0, 700.0  # a pen's line shows nothing finer than the first; scans above the second are reduced
_ROWS = 1024  # of a picture with transparent parts that are laid on white at a time: memory
_CAMERA = (271, 272)  # EXIF: maker and model
_EXPOSED = 33434  # EXIF: exposure time, which scanners do not note
# mark, where it stands, and what to do with files of formats that cannot be read
_FOREIGN = (
    (b"ftyphei", 4, "a HEIC photograph: save it as JPEG or PNG"),
    (b"ftypmif", 4, "a HEIF photograph: save it as JPEG or PNG"),
    (b"AT&TFORM", 0, "a DjVu document: save the page as PNG or TIFF"),
    (b"PK\x03\x04", 0, "a ZIP or Office document: save the page as PNG, TIFF or PDF"),
)


# what Pillow raises for files that are damaged or cut off
_DAMAGED = (OSError, SyntaxError, ValueError, EOFError, MemoryError, TypeError, KeyError, IndexError)


def read_picture(path: Path, page: int | None = None) -> FilePicture:
    """The picture in a file.

    page : which page of a file that holds several, from 1.

    Raises InputError: unreadable, empty, above 200 megapixels, several pages and none chosen, a PDF without a picture
    or locked, a colour space that cannot be read well, or pixels that are not square.
    """
    path = Path(path)
    if is_pdf(path):
        from handout.scanning.pdf_pages import page_of_pdf

        rgb, dpi, count = page_of_pdf(path, page)
        return FilePicture(rgb, dpi, source_of(path, page, count))
    return _read_image(path, page)


def count_pages(path: Path) -> int:
    """How many pages a file holds, as its head says; 1 for a file that cannot be read.

    Raises InputError: as `read_picture`, of a PDF.
    """
    if is_pdf(path):
        from handout.scanning.pdf_pages import count_of_pdf

        return count_of_pdf(path)
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = None
    try:
        with _quietly(), Image.open(path) as image:
            return int(getattr(image, "n_frames", 1)) if image.format == "TIFF" else 1
    except _DAMAGED:
        return count_of_tiff(path) if is_tiff(path) else 1


@contextmanager
def _quietly() -> Iterator[None]:
    """Without Pillow's warnings of damage, which is reported here if it matters."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def is_pdf(path: Path) -> bool:
    """Whether a file is a PDF, whatever it is called."""
    if path.is_file():
        with path.open("rb") as file:
            return b"%PDF-" in file.read(1024)
    return False


def _read_image(path: Path, page: int | None) -> FilePicture:
    """The picture in a file that is no PDF."""
    from PIL import Image, ImageOps

    # the check below is exact and says what to do; Pillow's own would warn on ordinary scans
    Image.MAX_IMAGE_PIXELS = None
    try:
        with _quietly(), Image.open(path) as image:
            if image.format == "EPS":  # Pillow would have another program run it
                raise InputError(f"{path} is PostScript, which is a program: save it as PNG or TIFF.")
            refuse_large(image.width, image.height, path)
            frames = int(getattr(image, "n_frames", 1)) if image.format == "TIFF" else 1
            index = page_index(frames, page, path)
            if index:
                image.seek(index)
                refuse_large(image.width, image.height, path)
            if image.format == "TIFF" and getattr(image, "tag_v2", {}).get(284) == 2:
                return _by_tifffile(path, page)  # Pillow misreads 16-bit planes
            dpi, exif = image.info.get("dpi"), image.getexif()
            photographed = any(map(exif.get, _CAMERA)) and bool(exif.get_ifd(0x8769).get(_EXPOSED))
            ImageOps.exif_transpose(image, in_place=True)
            rgb = _as_rgb(image, path)
            return FilePicture(rgb, square_resolution(dpi, path), source_of(path, page, frames), photographed)
    except _DAMAGED as error:
        if is_tiff(path):
            return _by_tifffile(path, page)
        raise InputError(f"Cannot read {path}: {_reason(error, path)}.") from error


def _by_tifffile(path: Path, page: int | None) -> FilePicture:
    rgb, dpi, count = page_of_tiff(path, page)
    return FilePicture(rgb, square_resolution(dpi, path), source_of(path, page, count))


def _reason(error: BaseException, path: Path) -> str:
    """Why a file cannot be read, and what to do."""
    system_message = getattr(error, "strerror", None)
    if system_message:
        return str(system_message)
    with path.open("rb") as file:
        head = file.read(32)
    if not head:
        return "it is empty (0 bytes); scan or copy it again"
    for mark, at, kind in _FOREIGN:
        if head[at:].startswith(mark):
            return f"it is {kind}"
    return "it is not an image that can be read, or it is damaged or cut off; copy it again, or scan it as PNG"


def _as_rgb(image: Image_, path: Path) -> NDArray[np.uint8]:
    """Pixels (h, w, 3): transparent parts white, 16 bits to 8, CMYK by the profile that it carries."""
    if image.mode in ("CMYK", "LAB"):
        image = _by_profile(image, path)
    if image.mode == "F" or image.mode.startswith("I"):
        return _grey(np.asarray(image), path)
    if image.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in image.info:
        # pixels (h, w, 3) of a picture with transparent parts, laid on white
        from PIL import Image

        rgb = np.empty((image.height, image.width, 3), dtype=np.uint8)
        for top in range(0, image.height, _ROWS):
            over = image.crop((0, top, image.width, min(top + _ROWS, image.height))).convert("RGBA")
            white = Image.new("RGBA", over.size, "white")
            rgb[top : top + _ROWS] = np.asarray(Image.alpha_composite(white, over))[:, :, :3]
        return rgb
    return np.array(image if image.mode == "RGB" else image.convert("RGB"), dtype=np.uint8)


def _by_profile(image: Image_, path: Path) -> Image_:
    import io

    from PIL import ImageCms

    profile = image.info.get("icc_profile")
    if not profile:
        raise InputError(
            f"{path} is in {image.mode} without a colour profile, so that its colours cannot be told: "
            "scan in RGB or grey, or save it as RGB."
        )
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        converted = ImageCms.profileToProfile(image, source, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except ImageCms.PyCMSError as error:
        raise InputError(f"{path}: its colour profile cannot be used; save it as RGB.") from error
    assert converted is not None
    return converted


def _grey(values: NDArray[Any], path: Path) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 of whole numbers of more than 8 bits, or of floats in 0–1."""
    if np.issubdtype(values.dtype, np.floating):
        if not np.isfinite(values).all() or values.min() < 0 or values.max() > 1:
            raise InputError(f"{path} holds numbers outside 0–1: save it as an ordinary image of 8 or 16 bits.")
        grey = np.rint(values * 255).astype(np.uint8)
    else:
        if values.min() < 0 or values.max() > 65535:
            raise InputError(
                f"{path} holds numbers of more than 16 bits: save it as an ordinary image of 8 or 16 bits."
            )
        grey = (values.astype(np.uint16) >> 8).astype(np.uint8)
    return np.repeat(grey[:, :, None], 3, axis=2)


def read_scan(path: Path, dpi: float | None = None, page: int | None = None) -> Scan:
    """A scan from a file.

    path : PNG, JPEG, TIFF or any other image that Pillow reads, or a PDF.
    dpi : pixels per inch; without it the file's own resolution, if it has a plausible one.
    page : which page of a file that holds several, from 1.

    Raises InputError: as `read_picture` and `scan_of`.
    """
    check_dpi(dpi)
    return scan_of(read_picture(Path(path), page), dpi)


def scan_of(picture: FilePicture, dpi: float | None = None, *, guess: bool = False) -> Scan:
    """A picture as a scan; above 700 dpi it is reduced to 600, since nothing of a pen's line is finer.

    dpi : pixels per inch; without it the file's own, if it has a plausible one.
    guess : whether that of a usual sheet is taken where there is none.

    Raises InputError: a resolution that is missing or not plausible, or that makes the page larger than two sheets of
    A3.
    """
    check_dpi(dpi)
    told: bool | None = dpi is not None
    if dpi is not None:
        refuse_oversize(picture, dpi)
    elif has_plausible_dpi(picture) or not guess:
        dpi = plausible_dpi(picture)
    else:
        dpi, told = likely_dpi(picture.rgb.shape), None
    scan = Scan(picture.rgb, float(dpi), picture.source, told)
    if scan.dpi <= _FINE:
        return scan
    size = (round(scan.shape[1] * ENOUGH_DPI / scan.dpi), round(scan.shape[0] * ENOUGH_DPI / scan.dpi))
    rgb = np.asarray(cv2.resize(scan.rgb, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return Scan(rgb, ENOUGH_DPI, scan.source, scan.told)


def is_tiff(path: Path) -> bool:
    """Whether a file calls itself a TIFF and is not empty."""
    return path.suffix.lower() in (".tif", ".tiff") and path.is_file() and path.stat().st_size > 0


def count_of_tiff(path: Path) -> int:
    """How many pages a TIFF holds; 1 for one that cannot be read."""
    try:
        with tiff.open_tiff(path) as file:
            return max(1, len(file.pages))
    except Exception:  # what a damaged file raises there is not one kind
        return 1


def page_of_tiff(path: Path, page: int | None) -> tuple[NDArray[np.uint8], tuple[float, float] | None, int]:
    """One page of a TIFF: its pixels (h, w, 3), dpi across and down if the file says them, and how many pages it holds.

    Raises InputError: damaged, too large, no such page, or colours that cannot be read well.
    """
    import tifffile

    try:
        with tiff.open_tiff(path) as file:
            pages = file.pages
            page_file = pages[page_index(len(pages), page, path)]
            assert isinstance(page_file, tifffile.TiffPage)
            refuse_large(page_file.imagewidth, page_file.imagelength, path)
            values = page_file.asarray()
            photometric, planes = tifffile.PHOTOMETRIC(page_file.photometric).name, page_file.planarconfig
            dpi = tiff.resolution(page_file)
            orientation = page_file.tags.get(274)
            count = len(pages)
    except InputError:
        raise
    except Exception as error:  # what a damaged file raises there is not one kind
        raise InputError(
            f"Cannot read {path}: it is damaged or cut off, or packed in a way that cannot be read; scan it as PNG."
        ) from error
    if values.ndim == 3 and planes == 2:
        values = np.moveaxis(values, 0, -1)
    rgb = _turn_upright(_tiff_as_rgb(values, photometric, path), int(orientation.value) if orientation else 1)
    return rgb, dpi, count


def _turn_upright(rgb: NDArray[np.uint8], orientation: int) -> NDArray[np.uint8]:
    """The picture (h, w, 3) turned as the orientation of the TIFF, 1–8, asks for."""
    if orientation in (5, 6, 7, 8):
        rgb = rgb.transpose(1, 0, 2)
    if orientation in (3, 4, 7, 8):
        rgb = rgb[::-1]
    if orientation in (2, 3, 6, 7):
        rgb = rgb[:, ::-1]
    return np.ascontiguousarray(rgb)


def _tiff_as_rgb(values: NDArray[Any], photometric: str, path: Path) -> NDArray[np.uint8]:
    if photometric not in ("RGB", "MINISBLACK", "MINISWHITE") or values.ndim not in (2, 3):
        raise InputError(f"{path} is a TIFF of kind {photometric}: save it as RGB or grey.")
    if values.ndim == 2:
        values = values[:, :, None]
    full = np.iinfo(values.dtype).max if np.issubdtype(values.dtype, np.integer) else 1
    if full > 65535:
        raise InputError(f"{path} holds numbers of more than 16 bits: save it as an ordinary image of 8 or 16 bits.")
    colours = 3 if values.shape[2] >= 3 else 1
    rgb = np.empty((*values.shape[:2], 3), dtype=np.uint8)
    for k in range(3):  # a plane at a time: memory
        plane = values[:, :, min(k, colours - 1)]
        rgb[:, :, k] = (
            (plane >> 8) if full == 65535 else (plane if full == 255 else np.rint(np.clip(plane, 0, 1) * 255))
        )
    return 255 - rgb if photometric == "MINISWHITE" else rgb
