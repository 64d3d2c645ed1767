"""A file where a text could stand: what `plot` and `export` take besides words, a text in a file or a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from handout.cli import results
from handout.errors import InputError

if TYPE_CHECKING:
    from handout.values import Drawing, Manuscript

# those of `sources`, which is imported only where there is something to read
_SUFFIXES = (".svg", ".json", ".inkml", ".svc", ".gml")


def given(text: Sequence[str], file: str | None, *, quiet: bool) -> Drawing | None:
    """The drawing that a single argument (or --file) names, by a suffix of drawings; None where it is a text.

    What of the file is not drawn is said on standard error.

    Raises
    ------
    InputError
        The file is there and cannot be read as a drawing.
    """
    name = text[0] if len(text) == 1 and file is None else file if not text else None
    if name is None or len(name) > 255 or Path(name).suffix.lower() not in _SUFFIXES:
        return None
    if file is None and not Path(name).is_file():
        return None
    from handout.sources import read_drawing

    drawing = read_drawing(name)
    if drawing.about.get("left_out"):
        results.talk(quiet)(f"Left out of {name}: {', '.join(drawing.about['left_out'])}.")
    return drawing


def named_file(text: tuple[str, ...], file: str | None, quiet: bool) -> tuple[tuple[str, ...], str | None]:
    """A single argument that names a file is that file.

    Raises
    ------
    InputError
        It looks like the name of a drawing or a text, and there is no such file: it would be written out.
    """
    if file is None and len(text) == 1 and text[0] != "-" and len(text[0]) < 256 and Path(text[0]).is_file():
        results.talk(quiet)(f"Reading the file {text[0]}.")
        return (), text[0]
    if file is None and len(text) == 1 and Path(text[0]).suffix.lower() in (*_SUFFIXES, ".txt") and " " not in text[0]:
        raise InputError(f"There is no file {text[0]}; to write these very words, give them through --file -.")
    return text, file


def unwritten(drawing: Drawing) -> Manuscript:
    """A page without writing, for what counts words and lines."""
    from handout.values import Manuscript

    return Manuscript((), drawing.page, 0.0)
