"""A file where a text could stand: what `plot` and `export` take besides words, a text in a file or a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from handout.cli import results
from handout.pipeline import inputs

if TYPE_CHECKING:
    from handout.values import Drawing, Manuscript


def given(text: Sequence[str], file: str | None, *, quiet: bool) -> Drawing | None:
    """As `pipeline.inputs`."""
    return inputs._drawing(text, file, results.Telling())


def named_file(text: tuple[str, ...], file: str | None, quiet: bool) -> tuple[Sequence[str], str | None]:
    """As `pipeline.inputs`."""
    return inputs._named_file(text, file, results.Telling())


def unwritten(drawing: Drawing) -> Manuscript:
    """A page without writing, for what counts words and lines."""
    from handout.values import Manuscript

    return Manuscript((), drawing.page, 0.0)
