"""What is written, as one kind of thing: a text, a letter file or a drawing, whatever becomes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from handout.pipeline.inputs import Source
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.texts import INK, Pages, TextDocument, WritingTask, prepare
from handout.progress import Tell, silent
from handout.values import Drawing, Manuscript


class Document(Protocol):
    """A source with its options, checked."""

    @property
    def name(self) -> str:
        """What it is called: the name of its file, or the beginning of its text."""

    @property
    def task(self) -> WritingTask:
        """How it is written; of a letter file by its own hand."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user is told of it: what of the source is not written."""

    @property
    def inks(self) -> tuple[str, ...]:
        """The inks that it names besides its own."""

    @property
    def timed(self) -> bool:
        """Whether the times of its strokes mean anything."""

    def draw(self, wanted: frozenset[str] = INK, row: int | None = None, tell: Tell = silent) -> Pages:
        """Its pages; see `TextDocument.draw`."""

    def check(self, row: int | None = None) -> None:
        """Raise as `draw` would, without drawing."""


@dataclass(frozen=True)
class DrawingDocument:
    """A drawing, which is taken as it is."""

    name: str
    drawing: Drawing
    task: WritingTask
    notes: tuple[str, ...] = ()
    inks: tuple[str, ...] = ()

    @property
    def timed(self) -> bool:
        """See `Document`, as for the rest."""
        return self.drawing.timed

    def draw(self, wanted: frozenset[str] = INK, row: int | None = None, tell: Tell = silent) -> Pages:
        """See there: a page without writing, for what counts words and lines."""
        return Pages([Manuscript((), self.drawing.page, 0.0)], [self.drawing])

    def check(self, row: int | None = None) -> None:
        """See there."""


def open_document(
    source: Source,
    writing: WritingOptions = WritingOptions(),
    sheet: SheetOptions = SheetOptions(),
    picture: PictureOptions = PictureOptions(),
) -> Document:
    """A source with its options.

    Raises
    ------
    InputError
        An option is wrong, or a hand is missing.
    """
    if source.letter is not None:
        from handout.pipeline.letters import prepare_letter

        return prepare_letter(source.letter, writing, sheet, picture, source.given)
    if source.drawing is None:
        return TextDocument(source.text, prepare(writing, sheet, picture))
    asked = [f"--{name}" for name in ("style", "pose") if getattr(writing, name) is not None]
    notes = [f"{' and '.join(asked)}: a drawing is taken as it is; handout restyle moves it anew."] if asked else []
    plain = replace(writing, style=None, prime=None, temperature=None, pose=None)
    task = prepare(plain, sheet, picture, lined=False)
    return DrawingDocument(source.text, source.drawing, task, tuple(notes))


def one_pen(document: Document) -> list[str]:
    """The note that a machine with one pen draws several inks, where the document has them."""
    named = ", ".join(document.inks)
    return [f"{document.name} is in {named}, too: --layers colour stops for another pen."] if named else []
