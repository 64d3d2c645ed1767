"""Brushes: learned from photographs of strokes, and shown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from handout import atomic
from handout.errors import InputError
from handout.inking.brush import brushes, sheet
from handout.inking.brush.ribbon import SEGMENTS
from handout.inking.pen import BRUSH_FILE, PENS
from handout.pipeline.inputs import output_path
from handout.pipeline.options import Length, millimetres
from handout.pipeline.results import Delivery
from handout.sinks.png import to_png


def learn(
    photographs: Sequence[str | Path], output: str | Path, *, width: Length | None = None, title: str = ""
) -> Delivery:
    """Learn a brush from photographs of its strokes, one or several to a picture, and keep it in a .brush file.

    width : usual for its line; None: 0.8 mm.

    Raises InputError: a picture without a stroke that can be used, or a file that cannot be written.
    """
    path = output_path(output, BRUSH_FILE, "a brush is kept as")
    if path.stem in PENS:
        raise InputError(f"{path}: {path.stem} is the name of a pen; take another.")
    pictures = [Path(each) for each in photographs]
    if width is None:
        brush, notes = brushes.learn(pictures, title=title)
    else:
        brush, notes = brushes.learn(pictures, width=millimetres(width, "width"), title=title)
    atomic.write(path, brushes.to_bytes(brush))
    return _report(path, brush, notes)


def show(name: str, output: str | Path, seed: int = 1) -> Delivery:
    """Show a brush, by its name or file, on a sheet (PNG).

    Raises InputError: there is no such brush, or the sheet cannot be written.
    """
    path = output_path(output, ".png", "a brush is shown as")
    brush = brushes.find(name)
    picture = sheet.show(brush, name, np.random.default_rng(seed))
    atomic.write(path, to_png(picture, sheet.DPI, about={"brush": name, "seed": seed}))
    return _report(path, brush, (brush.notice,) if brush.notice else ())


def _report(path: Path, brush: brushes.Brush, notes: tuple[str, ...]) -> Delivery:
    """Of a brush that was learned or shown; the notes are on strokes that were left out."""
    lengths = [round(len(ribbon) / SEGMENTS, 1) for ribbon in brush.ribbons]  # in widths of the line
    told = {"file": str(path), "strokes": len(lengths), "lengths_in_widths": lengths}
    return Delivery(files=(path,), told={**told, "width_mm": brush.width, "colour": brush.colour}, notes=notes)
