"""What may be asked of the studio: typed bodies, and the options of the pipeline that they mean.

Names are names and no paths: they have no dot, no slash and no colon but where a length follows, so that the pipeline,
which takes files in their place, cannot be led to one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal, TypeVar, cast

from msgspec import Meta, Raw, Struct, defstruct

from handout.pipeline.declarations import Name, PageName, Seed, list_declared
from handout.pipeline.inputs import Source
from handout.pipeline.options import (
    BatchPlan,
    CalibrationOptions,
    CalibrationPlace,
    ChartOptions,
    MergeOptions,
    PictureOptions,
    PromptOptions,
    ReadingOptions,
    SheetOptions,
    TableOptions,
    WritingOptions,
)
from handout.pipeline.plot_request import PlotOptions, PlotRequest
from handout.profiles import PenTurn

T = TypeVar("T")
B = TypeVar("B", bound="Body")
Text = Annotated[str, Meta(max_length=100_000)]
UploadId = Annotated[str, Meta(pattern=r"^[\w-]{22}(?!\n)$")]
Format = Literal["svg", "png", "pdf", "inkml", "json", "gcode", "hpgl", "ebb"]


class Body(Struct, frozen=True, forbid_unknown_fields=True):
    """A JSON object; a field that is not known is an error."""

    def options(self, kind: Callable[..., T], **more: object) -> T:
        """The options of a kind that this body holds, and more."""
        names = {each.name: what.sent_as or each.name for each, what in list_declared(kind) if what.sent is not None}
        held = {name: getattr(self, sent) for name, sent in names.items() if sent in self.__struct_fields__}
        return kind(**{**held, **more})


def _with_options(*kinds: Any) -> Callable[[type[B]], type[B]]:
    """A body also has the options that some dataclasses declare for the API; its own fields win."""

    def extend(body: type[B]) -> type[B]:
        found = {
            what.sent_as or each.name: (Annotated[what.sent, Meta(description=what.help)], each.default)
            for kind in kinds
            for each, what in list_declared(kind)
            if what.sent is not None
        }
        added: list[Any] = [(name, *rest) for name, rest in found.items() if name not in body.__struct_fields__]
        about = {"__doc__": body.__doc__}
        options: dict[str, Any] = {"frozen": True, "kw_only": True, "module": __name__, "namespace": about}
        return cast("type[B]", defstruct(body.__name__, added, bases=(body,), **options))

    return extend


class Login(Body, frozen=True):
    """The token of the link that opened the studio."""

    token: Annotated[str, Meta(max_length=200)]


class Draft(Body, frozen=True):
    """What a page wants kept: any JSON; since : the `kept_at` of what it goes on from, a later one is not replaced."""

    draft: Raw
    since: int | None = None


@_with_options(WritingOptions, SheetOptions, PictureOptions)
class Write(Body, frozen=True, kw_only=True):
    """A text in a hand, on pages, as files of a format; lengths have units, as "2.5mm"."""

    text: Text
    letter: bool = False  # whether the text is that of a letter file, in Markdown
    # that it shows, by the names they were sent with
    pictures: Annotated[tuple[UploadId, ...], Meta(max_length=20)] = ()
    format: Format = "svg"
    hand: Name = "house-joined"
    page: PageName = "A4"
    device: Name | None = None


class WritePage(Write, frozen=True):
    """The same, or one page of it.

    at : a place in the text, characters from 0: only the page that holds it is written, and `page` of the answer is its
        number where there are others.
    """

    at: Annotated[int, Meta(ge=0)] | None = None


@_with_options(PlotOptions)
class NewPlot(Write, frozen=True):
    """A text for a plotter: as for files, and how it is plotted."""

    def request(self, hand: str) -> PlotRequest:
        """How it is plotted."""
        parts = self.options(WritingOptions, hand=hand), self.options(SheetOptions), self.options(PictureOptions)
        return PlotRequest(Source(""), *parts, self.options(PlotOptions))


PortName = Annotated[str, Meta(max_length=100)]  # one of those that are found: see `plot_desk`


class AskedPort(Body, frozen=True):
    """Where a machine is looked for."""

    port: PortName


class DrawnPlot(Body, frozen=True):
    """Where a plot is drawn; at_zero : its pen stands above the machine's zero; home_after : so it does at the end."""

    port: PortName
    at_zero: bool = False
    home_after: bool = False


class Said(Body, frozen=True):
    """What is said to a plot that is drawn, or to a batch that asks for something."""

    word: Literal["pause", "on", "stop"]


class PenMoveBody(Body, frozen=True):
    """A pen that is moved by hand; x, y : how far to jog, mm along the machine's axes."""

    port: PortName
    move: Literal["up", "down", "home", "jog", "release"]
    device: Name | None = None
    x: Annotated[float, Meta(ge=-2000, le=2000)] = 0.0
    y: Annotated[float, Meta(ge=-2000, le=2000)] = 0.0


class SheetOnBed(Body, frozen=True):
    """How a sheet lies: quarters to the left; x, y : its upper left corner as it is seen, mm from that of the bed."""

    quarters: Literal[0, 1, 2, 3]
    x: Annotated[float, Meta(ge=-5000, le=5000)]
    y: Annotated[float, Meta(ge=-5000, le=5000)]


class TurnedPens(Body, frozen=True):
    """What draws each layer of a plot, in this order."""

    pens: Annotated[tuple[PenTurn, ...], Meta(max_length=200)]


PrinterName = Annotated[str, Meta(pattern=r"^[\w.-]{0,100}(?!\n)$")]  # a profile or a queue, and no address


class Webhook(Body, frozen=True):
    """An address on this computer, or on one the studio trusts, and a secret that signs what it is told."""

    url: Annotated[str, Meta(max_length=500)]
    secret: Annotated[str, Meta(min_length=16, max_length=200)]


@_with_options(TableOptions, MergeOptions)
class NewBatch(Write, frozen=True):
    """A letter for every row of a table that was sent to /api/uploads, and how it is made; without a table, once."""

    table: UploadId | None = None
    title: Annotated[str, Meta(max_length=200)] = ""
    to: Literal["pdf", "printer", "plotter"] = "pdf"
    printer: PrinterName = ""
    queues: Annotated[tuple[PrinterName, ...], Meta(max_length=16)] = ()  # further ones that share it
    grid: Annotated[str, Meta(pattern=r"^([1-9]\d?x[1-9]\d?)?(?!\n)$")] = ""
    # one that is asked for twice is kept once; it is proofed, and nothing is sent; who is told how it ended
    key: Annotated[str, Meta(pattern=r"^[\w.:-]{0,100}(?!\n)$")] = ""
    test: bool = False
    webhook: Webhook | None = None

    def plan(self, hand: str, name: str) -> BatchPlan:
        """How it is made; `name` : of the table."""
        table = self.options(TableOptions, no_name=True)
        parts = self.options(WritingOptions, hand=hand), self.options(PictureOptions), table, self.options(MergeOptions)
        own = {each: getattr(self, each) for each in ("printer", "queues", "device", "grid", "key", "test")}
        own |= {} if self.webhook is None else {"webhook": self.webhook.url, "secret": self.webhook.secret}
        return BatchPlan(self.title or name, self.to, *parts, self.page, **own)


class TriedBatch(NewBatch, frozen=True, kw_only=True):
    """A table and its letter before they are kept; row : whose letter is wanted, by its number in the file."""

    row: int | None = None


class Approval(Body, frozen=True):
    """Which proof was looked at: when it was made, as its facts say; without, the last.

    left_out : rows, by their numbers in the file, that are not to be made.
    """

    made: Annotated[str, Meta(max_length=40)] = ""
    left_out: Annotated[tuple[int, ...], Meta(max_length=10_000)] = ()


class EditedRow(Body, frozen=True):
    """Cells of a row by their headers; none: it is only shown.  was : as they were when they were looked at."""

    cells: Annotated[dict[str, Annotated[str, Meta(max_length=10_000)]], Meta(max_length=200)] = {}
    was: Annotated[dict[str, str], Meta(max_length=200)] = {}


class MadeBatch(Body, frozen=True):
    """Where a batch is made: the ports of plotters, which share it; at_zero : each pen stands above its zero."""

    port: PortName | Annotated[tuple[PortName, ...], Meta(min_length=1, max_length=16)] = ""
    at_zero: bool = False

    @property
    def ports(self) -> tuple[str, ...]:
        """All of them."""
        return (self.port,) if isinstance(self.port, str) else self.port


@_with_options(ReadingOptions)
class NewHand(Body, frozen=True, kw_only=True):
    """Scans that were sent to /api/uploads, and what is on each; sheets of the studio need no text."""

    name: Name
    scans: Annotated[tuple[UploadId, ...], Meta(min_length=1, max_length=20)]
    texts: Annotated[tuple[Text, ...], Meta(max_length=20)] = ()


class MorePages(Body, frozen=True):
    """More scans of an author, and what is on each, as for a new hand."""

    scans: Annotated[tuple[UploadId, ...], Meta(min_length=1, max_length=20)]
    texts: Annotated[tuple[Text, ...], Meta(max_length=20)] = ()
    dpi: Annotated[float, Meta(ge=50, le=2400)] | None = None
    ink_only: bool = False


class GivenHand(Body, frozen=True):
    """A .hand file that was sent to /api/uploads, and what it is to be called here."""

    name: Name
    upload: UploadId


class HandCheck(Body, frozen=True):
    """What is asked of a hand: at most so many questions about letters that read badly; 0: a picture of its pages."""

    questions: Annotated[int, Meta(ge=0, le=40)] = 0


class Answered(Body, frozen=True):
    """Answers to questions about a hand, as `handout hand answer` takes them; task : that asked them."""

    task: Annotated[str, Meta(max_length=100)]
    answers: Annotated[tuple[Annotated[str, Meta(max_length=40)], ...], Meta(min_length=1, max_length=200)]


class Lacking(Body, frozen=True):
    """A text that is to be written in a hand."""

    text: Text


@_with_options(PromptOptions)
class Sheets(Body, frozen=True):
    """Sheets to write a hand on; for a hand those letters of which it has few sure ones."""

    hand: Name | None = None


Revision = Annotated[str, Meta(max_length=60)]


class Revised(Body, frozen=True):
    """A change of a hand as it was when it had this revision."""

    revision: Revision


class CorrectionsBody(Body, frozen=True):
    """A list of corrections, each an object with `do`, `page` and places in pixels of the scan.

    later : answer before the words around them are aligned anew.
    """

    revision: Revision
    corrections: Raw
    later: bool = False


class Rewinding(Body, frozen=True):
    """So many entries of the journal are undone; negative: made again."""

    revision: Revision
    back: Annotated[int, Meta(ge=-1000, le=1000)] = 1


_StyleValue = float | Annotated[str, Meta(max_length=500)] | Annotated[tuple[float, ...], Meta(max_length=40)]


class Handstyle(Body, frozen=True):
    """A handstyle that is being edited: "movement.smooth" → 0.3, angles in degrees, times in ms.

    base : the learned style whose manner it has, if it has one.
    """

    name: Name
    values: Annotated[dict[str, _StyleValue], Meta(max_length=80)] = {}
    base: Name | None = None


class MovementBody(Body, frozen=True):
    """Targets, in the JSON that `handout strokes draw` takes, to be moved through in a style."""

    plan: Raw
    style: Handstyle
    seed: Seed = 1
    samples: Annotated[int, Meta(ge=0, le=12)] = 0


class StyledWord(Body, frozen=True):
    """A word in a drawn hand and a style."""

    text: Annotated[str, Meta(min_length=1, max_length=40)]
    style: Handstyle
    hand: Name = "house-print"
    seed: Seed = 1


class MovementFile(Body, frozen=True):
    """What is on the desk as a file; toml is the style, and style the same of a learned one."""

    plan: Raw
    style: Handstyle
    format: Literal["toml", "style", "svg", "pdf", "png", "inkml", "json"]
    seed: Seed = 1


class KeptStyle(Body, frozen=True):
    """A style that is to be kept among the user's own, or in the file that was opened."""

    style: Handstyle
    replace: bool = False


@_with_options(ChartOptions, CalibrationOptions)
class Calibrating(Body, frozen=True, kw_only=True):
    """A calibration, and what is done next of it.

    step : what comes next as far as the page knows.
    to_printer : print it, else it is given as PDF; uploads : scans that were sent; made : of a stored calibration.
    """

    printer: Name
    paper: Annotated[str, Meta(pattern=r"^[\w -]{1,60}(?!\n)$")] = "plain"
    hand: Name | None = None
    step: Annotated[str, Meta(max_length=40)] = ""
    to_printer: bool = True
    uploads: Annotated[tuple[UploadId, ...], Meta(max_length=4)] = ()
    made: Annotated[str, Meta(max_length=40)] = ""

    def place(self, hand: str) -> CalibrationPlace:
        """The calibration; `hand` is where its hand is kept, or its name."""
        parts = self.options(ChartOptions), self.options(CalibrationOptions, hand=hand)
        return CalibrationPlace(self.printer, self.paper, *parts, self.step, to_printer=self.to_printer, made=self.made)
