"""How values show themselves where a notebook asks them to: a drawing as SVG, pixels and scanned ink as PNG.

The rooms that draw are imported when something is shown, as `handout` itself does it: values know nothing of them.
"""

from __future__ import annotations

from collections.abc import Collection
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from handout.values import Drawing, Raster

_WIDTH = 1000  # pixels, of what is shown
_DPI = 150.0  # of scanned ink
_SAMPLE = "The quick brown fox jumps over the lazy dog, 1234567890"
_LETTERS = 40  # of a hand that cannot write that
_PAPER, _X_HEIGHT = "148x40mm", 2.5  # of the sample; mm


def drawing_svg(drawing: Drawing) -> str | None:
    """The strokes of a page; None of one that is shown by its scanned ink."""
    if drawing.ink is not None:
        return None
    said: str = import_module("handout.sinks.svg").to_inline_svg(drawing)
    return said


def drawing_png(drawing: Drawing) -> bytes | None:
    """The scanned ink of a page; None of one that has strokes only."""
    return None if drawing.ink is None else raster_png(drawing.ink(_DPI))


def hand_svg(hand: object, letters: Collection[str]) -> str | None:
    """A line in a hand that was drawn and has some letters; the same every time."""
    pipeline = import_module("handout.pipeline.writing")
    writing = pipeline.WritingOptions(hand=hand, seed=1, x_height=_X_HEIGHT, fit=True)
    return drawing_svg(pipeline.drawings(_sample(letters), writing, pipeline.SheetOptions(_PAPER, "4mm"))[0])


def _sample(letters: Collection[str]) -> str:
    words = [word for word in _SAMPLE.split() if all(letter in letters for letter in word)]
    return " ".join(words) or "".join(letter for letter in letters if len(letter) == 1)[:_LETTERS]


def raster_png(raster: Raster) -> bytes:
    """Pixels on white."""
    import numpy as np

    cover = raster.rgba[..., 3:]
    paper = raster.rgba[..., :3] * cover + (1 - cover)
    return pixels_png(np.rint(np.clip(paper, 0, 1) * 255).astype(np.uint8), raster.dpi)


def pixels_png(rgb: NDArray[np.uint8], dpi: float) -> bytes:
    """(h, w, 3) pixels, made smaller where they are wider than a notebook."""
    if rgb.shape[1] > _WIDTH:
        import cv2
        import numpy as np

        scale = _WIDTH / rgb.shape[1]
        size = (_WIDTH, max(round(rgb.shape[0] * scale), 1))
        rgb, dpi = np.asarray(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA), np.uint8), dpi * scale
    data: bytes = import_module("handout.sinks.png").to_png(rgb, dpi)
    return data
