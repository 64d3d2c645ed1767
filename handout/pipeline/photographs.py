"""Photographs that a phone sends: the code that leads it here, and what is seen of them at once."""

from __future__ import annotations

import hashlib
from pathlib import Path

from handout.libraries import cv2
from handout.pipeline.results import Facts

_SMALL = 320  # pixels of the longer side of a picture in a list: twice what a page shows; own choice


def draw_code(text: str) -> Facts:
    """A text as a QR code: `size`, its modules a side, and `path`, an SVG path of those that are dark.

    Source: ISO/IEC 18004, as reportlab has it; level M, which stands 15 % of damage.
    """
    from reportlab.graphics.barcode import qrencoder

    code = qrencoder.QRCode(None, qrencoder.QRErrorCorrectLevel.M)
    code.addData(text)
    code.make()
    size = int(code.getModuleCount())
    dark = [(x, y) for y in range(size) for x in range(size) if code.isDark(y, x)]
    return {"size": size, "path": "".join(f"M{x} {y}h1v1h-1z" for x, y in dark)}


def look_at(path: Path) -> Facts:
    """What is seen of a photograph: `small`, a JPEG of it; `width` and `height`, its pixels; `digest`, of its bytes.

    Raises InputError: it cannot be read whole.
    """
    from handout.scanning.picture_files import read_picture

    pixels = read_picture(path).rgb
    height, width = pixels.shape[:2]
    scale = min(1.0, _SMALL / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = cv2.resize(pixels[:, :, ::-1], size, interpolation=cv2.INTER_AREA)
    data = cv2.imencode(".jpg", small)[1].tobytes()
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return {"small": data, "width": width, "height": height, "digest": digest}
