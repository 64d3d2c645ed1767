"""Where the pages of a batch go: a print queue, one PDF, or a picture a row."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

from handout import atomic
from handout.errors import InputError
from handout.printing import media
from handout.printing.submit import Queue, Ticket, ticket
from handout.profiles import Printer
from handout.sinks import picture_pdf as pdf
from handout.values import Drawing, Page, Raster

Ink = Callable[[Drawing, int], Raster]
Sink = Callable[[Drawing, Path], object]


@dataclass(frozen=True)
class Target:
    """What a page is made for: the printer, how to ink for it, and what is stored with every output."""

    profile: Printer
    ink: Ink
    about: Mapping[str, Any]

    def ready(self, drawing: Drawing, turn: media.Turn) -> tuple[Page, Raster]:
        """The sheet and its ink at the printer's resolution, turned."""
        raster = self.ink(drawing, self.profile.dpi)
        return media.turned_page(drawing.page, turn), media.turned_raster(raster, drawing.page, turn)


class Destination(Protocol):
    """Takes the drawings of the rows that passed their checks; a context, so that nothing stays half-done."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: Any) -> None: ...

    def take(self, number: int, drawing: Drawing) -> None:
        """Make ready what row `number` needs."""
        ...

    def files(self) -> tuple[Path, ...]:
        """What has been written for the user."""
        ...


class PdfFile:
    """All pages in one PDF, each as it is read; the file appears when the batch is through."""

    def __init__(self, path: Path, target: Target, copies: int = 1) -> None:
        """Check now that `path` can be written."""
        atomic.check_writable(path)
        self._path, self._target, self._copies = path, target, copies
        self._stack = ExitStack()
        self._writer: pdf.PdfWriter | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: Any) -> None:
        self._stack.__exit__(*exc)

    def take(self, number: int, drawing: Drawing) -> None:
        """Add the row's page, once for each copy."""
        if self._writer is None:
            # only now, so that a batch without a single good row leaves no empty file
            self._writer = self._stack.enter_context(pdf.document(self._path, self._target.about))
        page, raster = self._target.ready(drawing, "")
        for _ in range(self._copies):
            self._writer.add(page, raster)

    def files(self) -> tuple[Path, ...]:
        """The PDF, if it has a page."""
        return (self._path,) if self._writer is not None else ()


class PictureFiles:
    """A file a row: ``cards.png`` becomes ``cards-002.png``, ``cards-003.png`` …, numbered as the table's rows."""

    def __init__(self, path: Path, sink: Sink) -> None:
        """`sink` writes one drawing to one path, its format told by the suffix."""
        atomic.check_writable(path)
        self._path, self._sink = path, sink
        self._written: list[Path] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: Any) -> None:
        return None

    def take(self, number: int, drawing: Drawing) -> None:
        """Write the row's picture."""
        path = self._path.with_name(f"{self._path.stem}-{number:03d}{self._path.suffix}")
        self._sink(drawing, path)
        self._written.append(path)

    def files(self) -> tuple[Path, ...]:
        """The pictures."""
        return tuple(self._written)


class Spool:
    """Pages made ready for a queue, each a PDF in the direction of feed, in a folder that goes away afterwards."""

    def __init__(self, queue: Queue, target: Target) -> None:
        """Nothing is sent before `send` is called."""
        self.queue, self._target = queue, target
        self._stack = ExitStack()
        self._jobs: dict[int, tuple[Path, Ticket]] = {}

    def __enter__(self) -> Self:
        self._folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="handout-")))
        return self

    def __exit__(self, *exc: Any) -> None:
        self._stack.close()

    def take(self, number: int, drawing: Drawing) -> None:
        """Make the row's job ready."""
        page, raster = self._target.ready(drawing, media.turn_for(drawing.page, self._target.profile))
        path = self._folder / f"row-{number:03d}.pdf"
        with pdf.document(path, {**self._target.about, "row": number}) as document:
            document.add(page, raster)
        self._jobs[number] = path, ticket(self._target.profile, drawing.page, f"handout row {number}")

    def send(self, number: int) -> str:
        """Hand the row's job to the queue; its name there."""
        path, told = self._jobs[number]
        return self.queue.send(path, told)

    def files(self) -> tuple[Path, ...]:
        """Nothing for the user: it went to the queue."""
        return ()


def preview(path: Path, target: Target, sink: Sink, copies: int = 1) -> Destination:
    """The destination that a file name asks for.

    Raises
    ------
    InputError
        A format that is not offered, or a file that cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".pdf":
        return PdfFile(path, target, copies)
    if suffix in (".png", ".svg"):
        return PictureFiles(path, sink)
    raise InputError(f"{path}: pages are written as .pdf, .png or .svg; give the file one of these endings.")
