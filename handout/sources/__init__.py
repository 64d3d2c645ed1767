"""Inputs that are drawings: which suffix is read as which format. The opposite of `sinks`.

Formats are imported only when they are read.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np

from handout.errors import InputError, reported
from handout.values import Drawing

__all__ = ["read_drawing", "suffixes"]

_LARGEST = 64 * 2**20  # bytes


def _json(data: bytes, path: Path) -> Drawing:
    from handout.sources import pointer_events
    from handout.sources.drawing_json import from_json

    return pointer_events.from_pointer_events(data) if pointer_events.looks_like(data) else from_json(data)


def _unipen(data: bytes, path: Path) -> Drawing:
    from handout.sources.unipen import from_unipen

    def include(name: str) -> bytes | None:
        """Looked for beside the file, and in ``include`` beside each folder above it, as the public collections lie."""
        relative = Path(name)
        if relative.is_absolute() or ".." in relative.parts:
            return None
        places = [path.parent / relative, *(folder / "include" / relative for folder in path.resolve().parents)]
        return next((place.read_bytes() for place in places if place.is_file()), None)

    return from_unipen(data, include)


# suffix → the module here that reads it, whose function is named `from_` and the module's name
_MODULES = {".svg": "svg", ".inkml": "inkml", ".svc": "svc", ".gml": "gml", ".cyn": "cyn", ".uim": "uim"}
_OTHERS: dict[str, Callable[[bytes, Path], Drawing]] = {".json": _json, ".dat": _unipen, ".unp": _unipen}


def suffixes() -> list[str]:
    """All suffixes that can be read."""
    return sorted([*_MODULES, *_OTHERS])


def read_drawing(path: str | Path, *, texts: bool = False) -> Drawing:
    """Read a drawing from a file whose suffix says the format; `texts` : see `svg.from_svg`.

    The drawing's `about["left_out"]` lists in words what of the file is not in it, if anything.

    Raises InputError: an unknown suffix (the message lists the known ones), a file that cannot be read, is larger than
    64 MiB, or is not what its suffix says.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in suffixes():
        raise InputError(f"{path}: {path.suffix or 'no suffix'!r} is not one of {', '.join(suffixes())}.")
    with reported(f"read {path}"), path.open("rb") as stream:
        data = stream.read(_LARGEST + 1)
    if len(data) > _LARGEST:
        raise InputError(f"{path} is larger than {_LARGEST // 2**20} MiB: simplify the drawing or split it.")
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what is too large is refused, see `recorded.refuse_far`
            if suffix in _OTHERS:
                drawing = _OTHERS[suffix](data, path)
            else:
                module, options = _MODULES[suffix], {"texts": texts} if suffix == ".svg" else {}
                drawing = getattr(import_module(f"handout.sources.{module}"), f"from_{module}")(data, **options)
            # without what a preview of a plot shows besides: what its plotter does, and pale, what is not plotted
            about = {name: value for name, value in drawing.about.items() if name not in ("hooks", "part")}
            match drawing.about.get("part"):
                case [_, _, pale]:
                    strokes = tuple(stroke for stroke in drawing.strokes if stroke.colour != pale)
                    return dataclasses.replace(drawing, strokes=strokes, about=about)
            return dataclasses.replace(drawing, about=about) if len(about) < len(drawing.about) else drawing
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
