"""A picture as it lies in a file, before its resolution is settled: PNG, JPEG, TIFF, or a page of a PDF.

The size is read from the head of the file and refused there, before anything is decoded.  Colours stay the scanner's
own (device RGB); 16-bit files are read at 8 bits, which is finer than the noise of paper.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.summary import one_line

if TYPE_CHECKING:
    from PIL.Image import Image as Image_

MOST_PIXELS = 200_000_000  # an A4 sheet at 1200 dpi has 139 million
_ROWS = 1024  # of a picture with transparent parts that are laid on white at a time: memory
_SQUARE = 1.02  # how far the resolutions across and down may differ
_CAMERA = (271, 272)  # EXIF: maker and model
_EXPOSED = 33434  # EXIF: exposure time, which scanners do not note
# first bytes of files that are none of ours, and what is to be done with them
_FOREIGN = (
    (b"ftyphei", 4, "a HEIC photograph: save it as JPEG or PNG"),
    (b"ftypmif", 4, "a HEIF photograph: save it as JPEG or PNG"),
    (b"AT&TFORM", 0, "a DjVu document: save the page as PNG or TIFF"),
    (b"PK\x03\x04", 0, "a ZIP or Office document: save the page as PNG, TIFF or PDF"),
)


# what Pillow raises for files that are damaged or cut off
_DAMAGED = (OSError, SyntaxError, ValueError, EOFError, MemoryError, TypeError, KeyError, IndexError)


@dataclass(frozen=True, eq=False)
class Picture:
    """What a file holds.

    rgb : (h, w, 3) uint8, device RGB.
    own : pixels per inch, as the file says; None if it does not.
    source : the file, with the number of the page if it holds several: for messages.
    photographed : whether a camera took it.
    """

    rgb: NDArray[np.uint8]
    own: float | None
    source: str
    photographed: bool = False

    __repr__ = one_line


def read_picture(path: Path, page: int | None = None) -> Picture:
    """The picture in a file.

    Parameters
    ----------
    path : Path
    page : int, optional
        Which page of a file that holds several, from 1.

    Raises
    ------
    InputError
        Unreadable, empty, above 200 megapixels, several pages and none chosen, a PDF without a picture or locked, a
        colour space that cannot be read well, or pixels that are not square.
    """
    path = Path(path)
    if _is_pdf(path):
        from handout.scanning.pdf import page_of_pdf

        rgb, own, count = page_of_pdf(path, page)
        return Picture(rgb, own, source_of(path, page, count))
    return _read_image(path, page)


def count_pages(path: Path) -> int:
    """How many pages a file holds, as its head says; 1 for a file that cannot be read.

    Raises
    ------
    InputError
        As `read_picture`, of a PDF.
    """
    if _is_pdf(path):
        from handout.scanning.pdf import count_of_pdf

        return count_of_pdf(path)
    from PIL import Image

    from handout.scanning import tiff

    Image.MAX_IMAGE_PIXELS = None
    try:
        with _quietly(), Image.open(path) as image:
            return int(getattr(image, "n_frames", 1)) if image.format == "TIFF" else 1
    except _DAMAGED:
        return tiff.count_of_tiff(path) if tiff.is_tiff(path) else 1


@contextmanager
def _quietly() -> Iterator[None]:
    """Without Pillow's warnings of damage, which is reported here if it matters."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def source_of(path: Path, page: int | None, count: int) -> str:
    """What a page of a file is called."""
    return f"{path}:{page}" if count > 1 else str(path)


def _is_pdf(path: Path) -> bool:
    if path.is_file():
        with path.open("rb") as file:
            return b"%PDF-" in file.read(1024)
    return False


def refuse_large(width: int, height: int, path: Path) -> None:
    """Raise InputError for a picture above the limit, and for an empty one."""
    if width * height > MOST_PIXELS:
        raise InputError(
            f"{path} has {width} × {height} pixels, {width * height / 1e6:.0f} megapixels; the limit is "
            f"{MOST_PIXELS // 10**6}. Scan at 600 dpi or less, or cut the page into parts."
        )
    if width < 32 or height < 32:
        raise InputError(f"{path} has {width} × {height} pixels: too small to hold a line of writing.")


def choose_page(count: int, page: int | None, path: Path) -> int:
    """Index from 0 of the page to read, of a file of `count` pages."""
    if page is None:
        if count > 1:
            raise InputError(f"{path} holds {count} pages: say which one, as {path}:1 … {path}:{count}.")
        return 0
    if not 1 <= page <= count:
        raise InputError(f"{path}:{page}: there is no such page; {path} holds {_pages(count)}.")
    return page - 1


def _pages(count: int) -> str:
    return "1 page" if count == 1 else f"pages 1–{count}"


def _read_image(path: Path, page: int | None) -> Picture:
    """The picture in a file that is no PDF."""
    from PIL import Image, ImageOps

    from handout.scanning import tiff

    # the check below is exact and says what to do; Pillow's own would warn on ordinary scans
    Image.MAX_IMAGE_PIXELS = None
    try:
        with _quietly(), Image.open(path) as image:
            refuse_large(image.width, image.height, path)
            frames = int(getattr(image, "n_frames", 1)) if image.format == "TIFF" else 1
            index = choose_page(frames, page, path)
            if index:
                image.seek(index)
                refuse_large(image.width, image.height, path)
            if image.format == "TIFF" and getattr(image, "tag_v2", {}).get(284) == 2:
                return _by_tifffile(path, page)  # Pillow misreads 16-bit planes
            own, taken = image.info.get("dpi"), _photographed(image)
            ImageOps.exif_transpose(image, in_place=True)
            rgb = _as_rgb(image, path)
            return Picture(rgb, _square(own, path), source_of(path, page, frames), taken)
    except _DAMAGED as error:
        if tiff.is_tiff(path):
            return _by_tifffile(path, page)
        raise InputError(f"Cannot read {path}: {_reason(error, path)}.") from error


def _by_tifffile(path: Path, page: int | None) -> Picture:
    from handout.scanning.tiff import page_of_tiff

    rgb, own, count = page_of_tiff(path, page)
    return Picture(rgb, _square(own, path), source_of(path, page, count))


def _reason(error: BaseException, path: Path) -> str:
    """Why a file cannot be read, and what to do."""
    said = getattr(error, "strerror", None)
    if said:
        return str(said)
    with path.open("rb") as file:
        head = file.read(32)
    if not head:
        return "it is empty (0 bytes); scan or copy it again"
    for mark, at, kind in _FOREIGN:
        if head[at:].startswith(mark):
            return f"it is {kind}"
    return "it is not an image that can be read, or it is damaged or cut off; copy it again, or scan it as PNG"


def _photographed(image: Image_) -> bool:
    exif = image.getexif()
    return any(exif.get(tag) for tag in _CAMERA) and bool(exif.get_ifd(0x8769).get(_EXPOSED))


def _square(own: Any, path: Path) -> float | None:
    """Pixels per inch, the same across and down.

    Raises
    ------
    InputError
        They are not.
    """
    if not own or not all(float(side) > 0 for side in own):
        return None
    across, down = (float(side) for side in own)
    if max(across, down) > _SQUARE * min(across, down):
        raise InputError(
            f"{path} has {across:g} dpi across and {down:g} down, as faxes have: scan the page at 300 dpi both ways."
        )
    return across


def _as_rgb(image: Image_, path: Path) -> NDArray[np.uint8]:
    """Pixels (h, w, 3): transparent parts white, 16 bits to 8, CMYK by the profile that it carries."""
    if image.mode in ("CMYK", "LAB"):
        image = _by_profile(image, path)
    if image.mode == "F" or image.mode.startswith("I"):
        return _grey(np.asarray(image), path)
    if image.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in image.info:
        return _on_white(image)
    return np.array(image if image.mode == "RGB" else image.convert("RGB"), dtype=np.uint8)


def _on_white(image: Image_) -> NDArray[np.uint8]:
    """Pixels (h, w, 3) of a picture with transparent parts, laid on white."""
    from PIL import Image

    rgb = np.empty((image.height, image.width, 3), dtype=np.uint8)
    for top in range(0, image.height, _ROWS):
        over = image.crop((0, top, image.width, min(top + _ROWS, image.height))).convert("RGBA")
        white = Image.new("RGBA", over.size, "white")
        rgb[top : top + _ROWS] = np.asarray(Image.alpha_composite(white, over))[:, :, :3]
    return rgb


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
        turned = ImageCms.profileToProfile(image, source, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except ImageCms.PyCMSError as error:
        raise InputError(f"{path}: its colour profile cannot be used; save it as RGB.") from error
    assert turned is not None
    return turned


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
