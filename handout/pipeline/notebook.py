"""How values show themselves where a notebook asks them to: a drawing as SVG, pixels and scanned ink as PNG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from handout.inking.plain import flatten
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.writing import drawings
from handout.sinks.png import to_png
from handout.sinks.svg import to_inline_svg
from handout.values import Drawing, Raster

if TYPE_CHECKING:
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand

_WIDTH = 1000  # pixels, of what is shown
_DPI = 150.0  # of scanned ink
_SAMPLE = "The quick brown fox jumps over the lazy dog, 1234567890"
_LETTERS = 40  # of a hand that cannot write that
_PAPER, _X_HEIGHT = "148x40mm", 2.5  # of the sample; mm


def svg(value: Drawing | Hand) -> str | None:
    """The strokes of a page, None of one that is shown by its scanned ink; of a drawn hand a line, always the same."""
    if isinstance(value, Drawing):
        return None if value.ink is not None else to_inline_svg(value)
    words = [word for word in _SAMPLE.split() if all(letter in value.letters for letter in word)]
    text = " ".join(words) or "".join(letter for letter in value.letters if len(letter) == 1)[:_LETTERS]
    writing = WritingOptions(hand=value, seed=1, x_height=_X_HEIGHT, fit=True)
    return svg(drawings(text, writing, SheetOptions(_PAPER, "4mm"))[0])


def png(value: Drawing | Raster | ScannedHand) -> bytes | None:
    """Pixels on white: of a page its scanned ink, None if it has strokes only; of a scanned hand its first page."""
    if isinstance(value, Drawing):
        return None if value.ink is None else png(value.ink(_DPI))
    if not isinstance(value, Raster):
        return _pixels(value.pages[0].on_paper(), value.pages[0].dpi)
    return _pixels(flatten(value), value.dpi)


def _pixels(rgb: NDArray[np.uint8], dpi: float) -> bytes:
    """(h, w, 3) pixels, made smaller where they are wider than a notebook."""
    if rgb.shape[1] > _WIDTH:
        scale = _WIDTH / rgb.shape[1]
        size = (_WIDTH, max(round(rgb.shape[0] * scale), 1))
        rgb, dpi = np.asarray(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA), np.uint8), dpi * scale
    return to_png(rgb, dpi)
