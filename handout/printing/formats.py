"""A page as the bytes of one document, in the formats that printers take."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO
from typing import Any

from handout.printing import media, pwg
from handout.sinks.picture_pdf import PdfWriter
from handout.values import Page, Raster

# the sheet as it is fed, its ink, what is stored with it → the document
Writer = Callable[[Page, Raster, Mapping[str, Any]], bytes]


def _pdf(page: Page, raster: Raster, about: Mapping[str, Any]) -> bytes:
    stream = BytesIO()
    writer = PdfWriter(stream, about)
    writer.add(page, raster)
    writer.finish()
    return stream.getvalue()


def _pwg(page: Page, raster: Raster, about: Mapping[str, Any]) -> bytes:
    name = media.name(page)
    return pwg.pwg(pwg.page_pixels(page, raster), round(raster.dpi), page, "" if name.startswith("Custom") else name)


def _urf(page: Page, raster: Raster, about: Mapping[str, Any]) -> bytes:
    return pwg.urf(pwg.page_pixels(page, raster), round(raster.dpi))


def _png(page: Page, raster: Raster, about: Mapping[str, Any]) -> bytes:
    from PIL import Image

    stream = BytesIO()
    Image.fromarray(pwg.page_pixels(page, raster)).save(stream, "PNG", dpi=(raster.dpi, raster.dpi))
    return stream.getvalue()


WRITERS: Mapping[str, Writer] = {"pdf": _pdf, "pwg": _pwg, "urf": _urf, "png": _png}
# what IPP calls them
MIME = {"pdf": "application/pdf", "pwg": "image/pwg-raster", "urf": "image/urf", "png": "image/png"}
