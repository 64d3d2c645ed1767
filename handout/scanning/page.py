"""A scan as it comes from a file: PNG, JPEG, TIFF, or a page of a PDF.

The size is read from the head of the file and refused there, before anything is decoded.  Colours stay the scanner's
own (device RGB); 16-bit files are read at 8 bits, which is finer than the noise of paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

MOST_PIXELS = 400_000_000
LEAST_DPI, MOST_DPI = 100.0, 2400.0
_LONGEST_SIDE = 610.0  # mm: what a file's own resolution may make of a scan, two sheets of A3
_SHEETS = {"A4": (210.0, 297.0), "Letter": (215.9, 279.4)}


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
        Unreadable, above 400 megapixels, several pages and none chosen, a colour space that cannot be read well, or a
        resolution that is missing or not plausible.
    """
    path = Path(path)
    if dpi is not None and not LEAST_DPI <= dpi <= MOST_DPI:
        raise InputError(
            f"--dpi {dpi:g} is outside {LEAST_DPI:g}–{MOST_DPI:g}: handwriting needs a scan of 300 or more."
        )
    rgb, own = read_pixels(path, page)
    height, width = rgb.shape[:2]
    resolution = dpi if dpi is not None else _plausible(own, width, height, path)
    return Scan(rgb, float(resolution), str(path), told=dpi is not None)


def read_pixels(path: Path, page: int | None = None) -> tuple[NDArray[np.uint8], float | None]:
    """Pixels (h, w, 3) of a page of a file, transparent parts white, and the resolution that the file names.

    Raises
    ------
    InputError
        As `read_scan`, but for the resolution.
    """
    if path.suffix.lower() == ".pdf":
        from handout.scanning.pdf import page_of_pdf

        return page_of_pdf(path, page)
    return _read_picture(path, page)


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
            raise InputError(f"{path} holds {count} pages: say which one with --page 1 … --page {count}.")
        return 0
    if not 1 <= page <= count:
        raise InputError(f"--page {page}: {path} holds {'1 page' if count == 1 else f'pages 1–{count}'}.")
    return page - 1


def _read_picture(path: Path, page: int | None) -> tuple[NDArray[np.uint8], float | None]:
    """Pixels (h, w, 3) and the file's own resolution of an image file."""
    from PIL import Image, ImageOps

    # the check below is exact and says what to do; Pillow's own would warn on ordinary scans
    Image.MAX_IMAGE_PIXELS = None
    try:
        with Image.open(path) as image:
            refuse_large(image.width, image.height, path)
            frames = getattr(image, "n_frames", 1) if image.format in ("TIFF", "MPO") else 1
            index = choose_page(1 if image.format == "MPO" else frames, page, path)
            if index:
                image.seek(index)
                refuse_large(image.width, image.height, path)
            if image.format == "TIFF" and getattr(image, "tag_v2", {}).get(284) == 2:
                return _read_tiff(path, page)  # Pillow misreads 16-bit planes
            own = image.info.get("dpi")
            upright = ImageOps.exif_transpose(image)
            return _as_rgb(upright, path), float(own[0]) if own else None
    except (OSError, SyntaxError, ValueError, EOFError, MemoryError) as error:
        if path.suffix.lower() in (".tif", ".tiff") and path.is_file():
            return _read_tiff(path, page)
        reason = getattr(error, "strerror", None) or "it is not an image that can be read, or it is damaged"
        raise InputError(f"Cannot read {path}: {reason}.") from error


def _as_rgb(image: Picture, path: Path) -> NDArray[np.uint8]:
    """Pixels (h, w, 3): transparent parts white, 16 bits to 8, CMYK by the profile that it carries."""
    from PIL import Image

    if image.mode in ("CMYK", "LAB"):
        image = _by_profile(image, path)
    if image.mode == "F" or image.mode.startswith("I"):
        return _grey(np.asarray(image), path)
    if image.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in image.info:
        over = image.convert("RGBA")
        white = Image.new("RGBA", over.size, "white")
        image = Image.alpha_composite(white, over)
    return np.array(image.convert("RGB"), dtype=np.uint8)


def _by_profile(image: Picture, path: Path) -> Picture:
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


def _read_tiff(path: Path, page: int | None) -> tuple[NDArray[np.uint8], float | None]:
    """A TIFF that Pillow cannot read: 16-bit colour, planes apart."""
    import tifffile

    try:
        with tifffile.TiffFile(path) as file:
            series = file.pages
            index = choose_page(len(series), page, path)
            one = series[index]
            assert isinstance(one, tifffile.TiffPage)
            refuse_large(one.imagewidth, one.imagelength, path)
            values = one.asarray()
            photometric, planes = tifffile.PHOTOMETRIC(one.photometric).name, one.planarconfig
            own = one.get_resolution(2)[0] if one.resolutionunit in (2, 3) else None
    except InputError:
        raise
    except Exception as error:  # what a damaged file raises there is not one kind
        raise InputError(f"Cannot read {path}: it is damaged, or packed in a way that cannot be read.") from error
    if values.ndim == 3 and planes == 2:
        values = np.moveaxis(values, 0, -1)
    return _tiff_rgb(values, photometric, path), float(own) if own else None


def _tiff_rgb(values: NDArray[Any], photometric: str, path: Path) -> NDArray[np.uint8]:
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


def _plausible(own: float | None, width: int, height: int, path: Path) -> float:
    """The file's own resolution, if it can be a scanner's; otherwise a question."""
    longest = max(width, height) / own * 25.4 if own else np.inf
    if own and LEAST_DPI <= own <= MOST_DPI and longest <= _LONGEST_SIDE:
        return own
    said = f"says {own:g} dpi, which is not a scan's" if own else "does not say its resolution"
    raise InputError(f"{path} {said}: give it with --dpi{_guess(width, height)}.")


def _guess(width: int, height: int) -> str:
    """What the resolution would be if a whole sheet had been scanned."""
    for name, (narrow, high) in _SHEETS.items():
        for dpi in (200, 300, 400, 600, 1200):
            if abs(width / dpi * 25.4 / narrow - 1) < 0.025 and height / dpi * 25.4 < 1.03 * high:
                return f" (if the {name} sheet was scanned at its full width: --dpi {dpi})"
    return ""
