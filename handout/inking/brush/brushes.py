"""Brushes: learned from photographs of strokes, kept in files, found by their names, and used as pens.

A ``.brush`` file is an archive (`hand.archive`) of ``brush.json`` and one picture a ribbon.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import msgspec
import numpy as np

from handout.errors import InputError
from handout.hand.archive import Archive, Content, pack
from handout.inking.brush.painting import Sized
from handout.inking.brush.photographs import find_strokes
from handout.inking.brush.ribbon import SEGMENTS, Ribbon, straighten_stroke
from handout.inking.brush.synthesis import Library
from handout.inking.pen import BRUSH_FILE, brushes, check_width
from handout.scanning.picture_files import read_picture
from handout.summary import one_line

_FORMAT = 1  # of the file; older programs refuse newer ones
_WIDTH = 0.8  # mm: usual width of a brush's line, broad for letters of 2.5 mm and still read; set by eye
_MOST_RIBBONS = 60  # their borders make a table of some thousand rows
_MOST_PIXELS = 4_000_000  # of a ribbon: a stroke of 100 widths


@dataclass(frozen=True, eq=False)
class Brush:
    """How a brush paints.

    ribbons : strokes that it was learned from.
    width : mm, usual for its line.
    title, notice : what it is called for people, and whose the photographs are.
    """

    ribbons: tuple[Ribbon, ...]
    width: float = _WIDTH
    title: str = ""
    notice: str = ""

    __repr__ = one_line

    @cached_property
    def library(self) -> Library:
        """All segments."""
        return Library.from_ribbons(self.ribbons)

    @cached_property
    def colour(self) -> str:
        """``"#rrggbb"``: of its solid ink."""
        solid = np.concatenate([each.rgba[each.rgba[..., 3] > 200] for each in self.ribbons])
        return "#{:02x}{:02x}{:02x}".format(*np.median(solid[:, :3], axis=0).astype(int).tolist())

    @cached_property
    def _sizes(self) -> dict[int, Sized]:
        return {}

    def fit_width(self, width: float) -> Sized:
        """The segments for a line of so many pixels."""
        new = Sized.fitting(self.library, width)
        return self._sizes.setdefault(new.columns, new)


class _Ribbon(msgspec.Struct, forbid_unknown_fields=True):
    bend: list[float]


class _BrushFile(msgspec.Struct, forbid_unknown_fields=True):
    format: int
    ribbons: list[_Ribbon]
    width: float = _WIDTH
    title: str = ""
    notice: str = ""


def learn(
    photographs: Sequence[Path], *, width: float = _WIDTH, title: str = "", rows: int = 240
) -> tuple[Brush, tuple[str, ...]]:
    """A brush of the strokes in some photographs, and sentences on what of them was left out.

    photographs : pictures of one stroke each, or of several.
    width : mm, usual for the brush's line, 0.1 to 50.
    rows : of pixels across a ribbon, at most.

    Raises InputError: a picture that cannot be read, or without a stroke that can be used; more strokes than a brush
    holds.
    """
    check_width(width)
    ribbons, notes = list[Ribbon](), list[str]()
    for path in photographs:
        found = find_strokes(read_picture(path).rgb, str(path))
        ribbons += [straighten_stroke(stroke, rows)[0] for stroke in found.strokes]
        notes += found.left_out
    if len(ribbons) > _MOST_RIBBONS:
        raise InputError(f"The pictures hold {len(ribbons)} strokes, more than the {_MOST_RIBBONS} of a brush.")
    return Brush(tuple(ribbons), width, title), tuple(notes)


def to_bytes(brush: Brush) -> bytes:
    """The brush as the bytes of a file; the same brush gives the same bytes."""
    from PIL import Image

    facts = _BrushFile(
        _FORMAT, [_Ribbon(np.round(each.bend, 4).tolist()) for each in brush.ribbons], brush.width, brush.title,
        brush.notice,
    )  # fmt: skip
    parts: dict[str, Content] = {"brush.json": facts}
    for number, ribbon in enumerate(brush.ribbons):
        stream = io.BytesIO()
        Image.fromarray(ribbon.rgba).save(stream, "WEBP", lossless=True, quality=90, method=6)
        parts[f"{number}.webp"] = stream.getvalue()
    return pack(parts)


def load(path: Path) -> Brush:
    """The brush of a file. Raises InputError: not a .brush file, or one that is damaged or made by a newer program."""
    with Archive(path) as archive:
        if "brush.json" not in archive:
            raise InputError(f"{path} is not a brush; handout brush learn makes one of photographs of strokes.")
        facts = archive.json("brush.json", _BrushFile)
        if facts.format != _FORMAT:
            raise InputError(
                f"{path} is of format {facts.format}, which this program does not know; it knows {_FORMAT}."
            )
        if not 0 < len(facts.ribbons) <= _MOST_RIBBONS:
            raise InputError(f"{path} cannot be used: it holds {len(facts.ribbons)} strokes, not 1 to {_MOST_RIBBONS}.")
        check_width(facts.width)
        ribbons = list[Ribbon]()
        for number, each in enumerate(facts.ribbons):
            rgba, count = archive.picture(f"{number}.webp", "RGBA", _MOST_PIXELS), len(each.bend)
            fits = rgba.shape[1] % max(count, 1) == 0 and 10 * len(rgba) > 8 * SEGMENTS and np.isfinite(each.bend).all()
            if count < 2 or not fits or not (rgba[..., 3] > 127).any():
                raise InputError(f"{path} cannot be used: a stroke of it does not fit its segments, or has no ink.")
            ribbons.append(Ribbon(rgba, np.array(each.bend)))
    return Brush(tuple(ribbons), facts.width, facts.title, facts.notice)


def find(name: str) -> Brush:
    """The brush of that name, or of that file. Raises InputError: there is none, or as `load`."""
    path = Path(name) if name.endswith(BRUSH_FILE) else brushes().get(name, Path(name))
    if not path.is_file():
        known = ", ".join(brushes())
        raise InputError(
            f"{name}: there is no such brush; there are {known}, and files that handout brush learn makes."
        )
    return _load_file(path.resolve(), path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _load_file(path: Path, _changed: int) -> Brush:
    return load(path)
