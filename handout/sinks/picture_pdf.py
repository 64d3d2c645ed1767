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

import msgspec
import numpy as np
from numpy.typing import NDArray

import handout
from handout import atomic
from handout.inking.device_pixels import DevicePixels
from handout.units import POINT
from handout.values import Page

_CATALOG, _PAGES, _INFO = 1, 2, 3  # numbers of these objects
# pixels by which a picture keeps inside its edges: an edge that lies on a pixel's boundary counts as the next pixel
# for Poppler, which would then stretch the picture by one
_INSET = 0.0001


class PagePicture(msgspec.Struct, frozen=True):
    """The picture of a page, compressed: of width x height pixels; placing : the content stream that shows it.

    A blank page has none.
    """

    placing: bytes = b""
    width: int = 0
    height: int = 0
    data: bytes = b""

    def pack(self) -> bytes:
        """As bytes, of which `unpack` makes the same."""
        return msgspec.msgpack.encode(self)

    @staticmethod
    def unpack(data: bytes) -> PagePicture:
        return msgspec.msgpack.decode(data, type=PagePicture)


def page_picture(page: Page, pixels: DevicePixels | None) -> PagePicture:
    """What of a page's pixels is not white, as a PDF holds it; None: a blank page."""
    cropped = pixels.crop_white() if pixels is not None else None
    return PagePicture() if pixels is None or cropped is None else _picture(page, *cropped, pixels.dpi)


def _picture(page: Page, pixels: NDArray[np.uint8], x: int, y: int, dpi: float) -> PagePicture:
    height, width = pixels.shape[:2]
    # on the grid of the printer's pixels, which is counted from the top left of the sheet; PDF counts from the bottom
    pixel = 72 / dpi
    bottom = page.height / POINT - (y + height - _INSET) * pixel
    matrix = ((width - 2 * _INSET) * pixel, 0, 0, (height - 2 * _INSET) * pixel, (x + _INSET) * pixel, bottom)
    placing = f"q {' '.join(map(_number, matrix))} cm /Im Do Q".encode()
    return PagePicture(placing, width, height, zlib.compress(pixels.tobytes(), 6))


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
        self._write_bytes(b"%PDF-1.6\n%\xe2\xe3\xcf\xd3\n")
        # ASCII with the three characters that mean something in a PDF string escaped
        text = json.dumps(dict(about or {}), sort_keys=True, default=str)
        for special in "\\()":
            text = text.replace(special, f"\\{special}")
        self._object(_INFO, f"<< /Producer (handout {handout.__version__}) /Subject ({text}) >>".encode("ascii"))

    def add(self, page: Page, pixels: DevicePixels | None) -> None:
        """Write one page of the size of `page`, with what of the pixels is not white (None: a blank page) on it."""
        self.add_picture(page, page_picture(page, pixels))

    def add_pixels(self, page: Page, pixels: NDArray[np.uint8], dpi: float) -> None:
        """Write one page all of which is `pixels`, (h, w, 3) uint8 device RGB, from its top left corner."""
        self.add_picture(page, _picture(page, np.ascontiguousarray(pixels), 0, 0, dpi))

    def add_picture(self, page: Page, picture: PagePicture) -> None:
        """Write one page that is compressed already."""
        if picture.placing:
            image = self._take()
            head = (
                f"<< /Type /XObject /Subtype /Image /Width {picture.width} /Height {picture.height} "
                f"/ColorSpace /DeviceRGB /BitsPerComponent 8 /Filter /FlateDecode /Length {len(picture.data)} >>"
            )
            self._object(image, f"{head}\nstream\n".encode() + picture.data + b"\nendstream")
            self._page(page, picture.placing, f"<< /XObject << /Im {image} 0 R >> >>")
        else:
            self._page(page, b"", "<< >>")

    def _page(self, page: Page, content: bytes, resources: str) -> None:
        body = self._take()
        self._object(body, b"<< /Length %d >>\nstream\n%b\nendstream" % (len(content), content))
        number = self._take()
        box = f"[0 0 {_number(page.width / POINT)} {_number(page.height / POINT)}]"
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
        self._write_bytes(f"xref\n0 {size}\n0000000000 65535 f \n{table}".encode())
        self._write_bytes(
            f"trailer\n<< /Size {size} /Root {_CATALOG} 0 R /Info {_INFO} 0 R >>\nstartxref\n{start}\n%%EOF\n".encode()
        )

    def _take(self) -> int:
        self._next += 1
        return self._next - 1

    def _object(self, number: int, body: bytes) -> None:
        self._offsets[number] = self._at
        self._write_bytes(b"%d 0 obj\n%b\nendobj\n" % (number, body))

    def _write_bytes(self, data: bytes) -> None:
        self._stream.write(data)
        self._at += len(data)


@contextmanager
def document(path: Path, about: Mapping[str, Any] | None = None) -> Iterator[PdfWriter]:
    """A PDF at `path` to which pages are added; the file appears only when the block ends without an error.

    Raises InputError: the file cannot be written.
    """
    with atomic.open_file(path) as stream:
        writer = PdfWriter(stream, about)
        yield writer
        writer.finish()


def _number(value: float) -> str:
    """Seven decimals: exact to far less than the inset above."""
    return f"{value:.7f}".rstrip("0").rstrip(".")
