"""Pages as a PDF for a printer: nothing in it but one picture a page, pixel for pixel.

Fonts, colour profiles and transparency would each give a print system something to improve; a picture in DeviceRGB
at the printer's own resolution, on a page of the exact size of the sheet, leaves it nothing to do.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

import handout
from handout import atomic
from handout.inking.device_pixels import DevicePixels
from handout.values import Page

_POINT = 25.4 / 72  # mm
_CATALOG, _PAGES, _INFO = 1, 2, 3  # numbers of these objects
# pixels by which a picture keeps inside its edges: an edge that lies on a pixel's boundary counts as the next pixel
# for Poppler, which would then stretch the picture by one
_INSET = 0.0001


class PdfWriter:
    """Writes pages one after the other to a stream; nothing of a page is kept once it is written.

    The same pages give the same bytes: there is no date and no random identifier.
    """

    def __init__(self, stream: BinaryIO, about: Mapping[str, Any] | None = None) -> None:
        """Begin a file on `stream`; `about` (seed, hand, options) is kept in its description as JSON."""
        self._stream = stream
        self._at = 0
        self._offsets: dict[int, int] = {}
        self._kids: list[int] = []
        self._next = _INFO + 1
        # the second line marks the file as binary for programs that guess
        self._put(b"%PDF-1.6\n%\xe2\xe3\xcf\xd3\n")
        self._object(_INFO, _information(about or {}))

    def add(self, page: Page, pixels: DevicePixels | None) -> None:
        """Write one page of the size of `page`, with what of the pixels is not white (None: a blank page) on it."""
        cropped = pixels.cropped() if pixels is not None else None
        if pixels is None or cropped is None:
            self._page(page, b"", "<< >>")
        else:
            self._picture(page, *cropped, pixels.dpi)

    def add_pixels(self, page: Page, pixels: NDArray[np.uint8], dpi: float) -> None:
        """Write one page all of which is `pixels`, (h, w, 3) uint8 device RGB, from its top left corner."""
        self._picture(page, np.ascontiguousarray(pixels), 0, 0, dpi)

    def _picture(self, page: Page, pixels: NDArray[np.uint8], x: int, y: int, dpi: float) -> None:
        image = self._image(pixels)
        self._page(page, _placing(pixels, x, y, dpi, page), f"<< /XObject << /Im {image} 0 R >> >>")

    def _page(self, page: Page, content: bytes, resources: str) -> None:
        body = self._take()
        self._object(body, b"<< /Length %d >>\nstream\n%b\nendstream" % (len(content), content))
        number = self._take()
        box = f"[0 0 {_number(page.width / _POINT)} {_number(page.height / _POINT)}]"
        self._object(
            number,
            f"<< /Type /Page /Parent {_PAGES} 0 R /MediaBox {box} /Resources {resources} "
            f"/Contents {body} 0 R >>".encode(),
        )
        self._kids.append(number)

    def finish(self) -> None:
        """Write the table of contents that makes the file complete."""
        kids = " ".join(f"{kid} 0 R" for kid in self._kids)
        self._object(_PAGES, f"<< /Type /Pages /Count {len(self._kids)} /Kids [{kids}] >>".encode())
        unscaled = "/ViewerPreferences << /PrintScaling /None >>"
        self._object(_CATALOG, f"<< /Type /Catalog /Pages {_PAGES} 0 R {unscaled} >>".encode())
        start, size = self._at, self._next
        table = "".join(f"{self._offsets[number]:010d} 00000 n \n" for number in range(1, size))
        self._put(f"xref\n0 {size}\n0000000000 65535 f \n{table}".encode())
        self._put(
            f"trailer\n<< /Size {size} /Root {_CATALOG} 0 R /Info {_INFO} 0 R >>\nstartxref\n{start}\n%%EOF\n".encode()
        )

    def _image(self, pixels: NDArray[np.uint8]) -> int:
        height, width = pixels.shape[:2]
        data = zlib.compress(pixels.tobytes(), 6)
        number = self._take()
        self._object(
            number,
            f"<< /Type /XObject /Subtype /Image /Width {width} /Height {height} /ColorSpace /DeviceRGB "
            f"/BitsPerComponent 8 /Filter /FlateDecode /Length {len(data)} >>\nstream\n".encode()
            + data
            + b"\nendstream",
        )
        return number

    def _take(self) -> int:
        self._next += 1
        return self._next - 1

    def _object(self, number: int, body: bytes) -> None:
        self._offsets[number] = self._at
        self._put(b"%d 0 obj\n%b\nendobj\n" % (number, body))

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._at += len(data)


@contextmanager
def document(path: Path, about: Mapping[str, Any] | None = None) -> Iterator[PdfWriter]:
    """A PDF at `path` to which pages are added; the file appears only when the block ends without an error.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    with atomic.opened(path) as stream:
        writer = PdfWriter(stream, about)
        yield writer
        writer.finish()


def _information(about: Mapping[str, Any]) -> bytes:
    # ASCII with the three characters that mean something in a PDF string escaped
    text = json.dumps(dict(about), sort_keys=True, default=str)
    for special in "\\()":
        text = text.replace(special, f"\\{special}")
    return f"<< /Producer (handout {handout.__version__}) /Subject ({text}) >>".encode("ascii")


def _number(value: float) -> str:
    """Seven decimals: exact to far less than the inset above."""
    return f"{value:.7f}".rstrip("0").rstrip(".")


def _placing(pixels: NDArray[np.uint8], x: int, y: int, dpi: float, page: Page) -> bytes:
    """The content stream that puts the picture, whose corner is pixel (x, y), on the grid of the printer's pixels.

    The grid is counted from the top left of the sheet, as printers count it; PDF counts from the bottom.
    """
    pixel = 72 / dpi
    height, width = pixels.shape[:2]
    bottom = page.height / _POINT - (y + height - _INSET) * pixel
    matrix = ((width - 2 * _INSET) * pixel, 0, 0, (height - 2 * _INSET) * pixel, (x + _INSET) * pixel, bottom)
    return f"q {' '.join(map(_number, matrix))} cm /Im Do Q".encode()
