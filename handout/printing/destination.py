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
from handout.printing.documents import WRITERS
from handout.printing.media import Feeding
from handout.printing.printers import ticket
from handout.printing.queue import Queue
from handout.profiles import Printer
from handout.sinks import picture_pdf as pdf
from handout.values import Drawing, Page, Raster

Ink = Callable[[Drawing, int], Raster]
Sink = Callable[[Drawing, Path], object]


@dataclass(frozen=True)
class Target:
    """What a page is made for: the printer, its ink (drawing, dpi → raster), and what is stored with every output."""

    profile: Printer
    ink: Ink
    about: Mapping[str, Any]


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
        raster = self._target.ink(drawing, self._target.profile.dpi)
        for _ in range(self._copies):
            self._writer.add(drawing.page, raster)

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
    """Pages made ready for a queue, each a document in the direction of feed, in a folder that goes away afterwards."""

    def __init__(self, queue: Queue, target: Target) -> None:
        """Nothing is sent before `send` is called."""
        self.queue, self._target = queue, target
        self._stack = ExitStack()
        self._pages: dict[int, tuple[Path, Page]] = {}

    def __enter__(self) -> Self:
        self._folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="handout-")))
        return self

    def __exit__(self, *exc: Any) -> None:
        self._stack.close()

    def take(self, number: int, drawing: Drawing) -> None:
        """Make the row's page ready."""
        profile, kind = self._target.profile, self.queue.format
        feeding = Feeding.of(drawing.page, profile)
        raster = feeding.raster(self._target.ink(drawing, self.queue.resolution(profile.dpi)))
        path = self._folder / f"row-{number:03d}.{kind}"
        path.write_bytes(WRITERS[kind](feeding.sheet, raster, {**self._target.about, "row": number}))
        self._pages[number] = path, drawing.page

    def send(self, number: int, title: str, name: str) -> str:
        """Hand the row's page to the queue as a job of that title; the job's name there."""
        path, page = self._pages[number]
        return self.queue.send(path, ticket(self._target.profile, page, title, name))

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
