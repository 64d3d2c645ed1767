"""What may be asked of the studio: typed bodies, and the options of the pipeline that they mean.

Names are names and no paths: they have no dot, no slash and no colon but where a length follows, so that the pipeline,
which takes files in their place, cannot be led to one.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Raw, Struct

from handout.pipeline.batch_desk import BatchPlan
from handout.pipeline.inputs import Source
from handout.pipeline.options import (
    Align,
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
    slip_rate,
)
from handout.pipeline.plot_request import PlotOptions, PlotRequest

Name = Annotated[str, Meta(pattern=r"^[\w-]{1,80}(?!\n)$")]
Length = Annotated[str, Meta(pattern=r"^[0-9.]{1,9} ?(mm|cm|in|pt)?(?!\n)$")]
Lengths = Annotated[str, Meta(pattern=r"^[0-9., a-z]{1,60}(?!\n)$")]
PageName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9.-]{1,30}(?!\n)$")]
PaperName = Annotated[str, Meta(pattern=r"^(none|plain|laid|ruled|squared)(:[0-9.]+mm(,[0-9.]+mm)?)?(?!\n)$")]
Colour = Annotated[str, Meta(pattern=r"^(#[0-9a-fA-F]{3,6}|[a-zA-Z ]{1,30})(?!\n)$")]
Text = Annotated[str, Meta(max_length=100_000)]
Seed = Annotated[int, Meta(ge=0, le=2**53)]
UploadId = Annotated[str, Meta(pattern=r"^[\w-]{22}(?!\n)$")]
Place = Annotated[int, Meta(ge=0, le=100_000)]
Times = Annotated[int, Meta(ge=1, le=100)]
Format = Literal["svg", "png", "pdf", "inkml", "json", "gcode", "hpgl", "ebb"]


class Body(Struct, frozen=True, forbid_unknown_fields=True):
    """A JSON object; a field that is not known is an error."""


class Login(Body, frozen=True):
    """The token of the link that opened the studio."""

    token: Annotated[str, Meta(max_length=200)]


class Draft(Body, frozen=True):
    """What a page wants kept: any JSON."""

    draft: Raw


class Write(Body, frozen=True):
    """A text in a hand, on pages, as files of a format; lengths have units, as "2.5mm"."""

    text: Text
    letter: bool = False  # whether the text is that of a letter file, in Markdown
    pictures: Annotated[
        tuple[UploadId, ...], Meta(max_length=20)
    ] = ()  # that it shows, by the names they were sent with
    format: Format = "svg"
    hand: Name = "house-joined"
    seed: Seed | None = None
    page: PageName = "A4"
    margin: Lengths | None = None
    pages: Annotated[int, Meta(ge=1, le=100)] | None = None
    x_height: Length | None = None
    line_spacing: Length | None = None
    align: Align = "ragged"
    variation: Annotated[float, Meta(ge=0, le=3)] = 1.0
    haste: Annotated[float, Meta(ge=-1, le=1)] = 0.0
    slips: Annotated[float, Meta(ge=0, le=100)] = 0.0
    fit: bool = False
    fallback: bool = False
    strict: bool = False
    style: Name | None = None
    rewritten: Annotated[tuple[tuple[Place, Times], ...], Meta(max_length=1000)] = ()  # words: place in the text, times
    pen: Name | None = None
    pen_width: Length | None = None
    ink: Colour | None = None
    paper: PaperName = "none"
    transparent: bool = False
    dpi: Annotated[float, Meta(ge=20, le=1200)] = 300.0
    device: Name | None = None

    def writing(self, hand: str) -> WritingOptions:
        """How it is written; `hand` is where its hand is kept, or its name."""
        return WritingOptions(
            hand=hand,
            seed=self.seed,
            x_height=self.x_height,
            line_spacing=self.line_spacing,
            align=self.align,
            jitter=self.variation,
            haste=self.haste,
            fit=self.fit,
            fallback=self.fallback,
            slips=slip_rate(str(self.slips)) if self.slips else 0.0,
            strict=self.strict,
            style=self.style,
            rewritten=self.rewritten,
        )

    def sheet(self) -> SheetOptions:
        """What it is written on."""
        return SheetOptions(self.page, self.margin, self.pages)

    def picture(self) -> PictureOptions:
        """How it looks."""
        return PictureOptions(self.dpi, self.pen, self.pen_width, self.ink, self.paper, self.transparent)


class NewPlot(Write, frozen=True):
    """A text for a plotter: as for files, and how it is plotted."""

    copies: Annotated[int, Meta(ge=1, le=100)] = 1
    order: Literal["writing", "travel"] = "writing"
    layers: Literal["none", "colour"] = "none"

    def request(self, hand: str) -> PlotRequest:
        """How it is plotted."""
        ways = PlotOptions(self.device, self.order, self.layers, self.copies)
        return PlotRequest(Source(""), self.writing(hand), self.sheet(), self.picture(), ways)


PortName = Annotated[str, Meta(max_length=100)]  # one of those that are found: see `plot_desk`


class DrawnPlot(Body, frozen=True):
    """Where a plot is drawn; at_zero : its pen stands above the machine's zero; home_after : so it does at the end."""

    port: PortName
    at_zero: bool = False
    home_after: bool = False


class Said(Body, frozen=True):
    """What is said to a plot that is drawn, or to a batch that asks for something."""

    word: Literal["pause", "on", "stop"]


class PenMove(Body, frozen=True):
    """A pen that is moved by hand; x, y : how far to jog, mm along the machine's axes."""

    port: PortName
    move: Literal["up", "down", "home", "jog", "release"]
    device: Name | None = None
    x: Annotated[float, Meta(ge=-2000, le=2000)] = 0.0
    y: Annotated[float, Meta(ge=-2000, le=2000)] = 0.0


PrinterName = Annotated[str, Meta(pattern=r"^[\w.-]{0,100}(?!\n)$")]  # a profile or a queue, and no address


class NewBatch(Write, frozen=True):
    """A letter for every row of a table that was sent to /api/uploads, and how it is made; without a table, once."""

    table: UploadId | None = None
    title: Annotated[str, Meta(max_length=200)] = ""
    to: Literal["pdf", "printer", "plotter"] = "pdf"
    printer: PrinterName = ""
    queues: Annotated[tuple[PrinterName, ...], Meta(max_length=16)] = ()  # further ones that share it
    grid: Annotated[str, Meta(pattern=r"^([1-9]\d?x[1-9]\d?)?(?!\n)$")] = ""
    rows: Annotated[str, Meta(pattern=r"^[0-9, -]{0,500}(?!\n)$")] = ""
    columns: Annotated[tuple[Annotated[str, Meta(max_length=200)], ...], Meta(max_length=50)] = ()
    copies: Annotated[int, Meta(ge=1, le=100)] = 1
    with_envelopes: bool = False
    envelope: PageName = "DL"
    language: Annotated[str, Meta(pattern=r"^[A-Za-z_-]{1,20}(?!\n)$")] = "en"
    return_address: Annotated[str, Meta(max_length=500)] = ""
    home_country: Annotated[str, Meta(max_length=60)] = ""
    tick: bool = False
    skip_bad: bool = False

    def plan(self, hand: str, name: str) -> BatchPlan:
        """How it is made; `name` : of the table."""
        merge = MergeOptions(
            with_envelopes=self.with_envelopes,
            envelope=self.envelope,
            margin=self.margin,
            pages=self.pages,
            language=self.language,
            return_address=self.return_address,
            home_country=self.home_country,
            tick=self.tick,
            skip_bad=self.skip_bad,
        )
        table = TableOptions(self.rows, self.columns, no_name=True, copies=self.copies)
        title = self.title or name
        ways = {"printer": self.printer, "queues": self.queues, "device": self.device, "grid": self.grid}
        return BatchPlan(
            title,
            self.to,
            self.writing(hand),
            self.picture(),
            table,
            merge,
            self.page,
            **ways,  # type: ignore[arg-type]
        )


class Approval(Body, frozen=True):
    """Which proof was looked at: when it was made, as its facts say; without, the last."""

    made: Annotated[str, Meta(max_length=40)] = ""


class MadeBatch(Body, frozen=True):
    """Where a batch is made: the ports of plotters, which share it; at_zero : each pen stands above its zero."""

    port: PortName | Annotated[tuple[PortName, ...], Meta(min_length=1, max_length=16)] = ""
    at_zero: bool = False

    @property
    def ports(self) -> tuple[str, ...]:
        """All of them."""
        return (self.port,) if isinstance(self.port, str) else self.port


class NewHand(Body, frozen=True):
    """Scans that were sent to /api/uploads, and what is on each; sheets of the studio need no text."""

    name: Name
    scans: Annotated[tuple[UploadId, ...], Meta(min_length=1, max_length=20)]
    texts: Annotated[tuple[Text, ...], Meta(max_length=20)] = ()
    title: Annotated[str, Meta(max_length=200)] | None = None
    dpi: Annotated[float, Meta(ge=50, le=2400)] | None = None
    pen: Literal["ballpoint", "fineliner", "fountain", "pencil"] | None = None
    seed: Seed = 0
    ink_only: bool = False

    def reading(self) -> ReadingOptions:
        """How it is read."""
        return ReadingOptions(self.dpi, self.pen, self.title, self.seed, self.ink_only)


class MorePages(Body, frozen=True):
    """More scans of an author, and what is on each, as for a new hand."""

    scans: Annotated[tuple[UploadId, ...], Meta(min_length=1, max_length=20)]
    texts: Annotated[tuple[Text, ...], Meta(max_length=20)] = ()
    dpi: Annotated[float, Meta(ge=50, le=2400)] | None = None
    ink_only: bool = False

    def reading(self) -> ReadingOptions:
        """How they are read."""
        return ReadingOptions(self.dpi, ink_only=self.ink_only)


class GivenHand(Body, frozen=True):
    """A .hand file that was sent to /api/uploads, and what it is to be called here."""

    name: Name
    upload: UploadId


class Lacking(Body, frozen=True):
    """A text that is to be written in a hand."""

    text: Text


class Sheets(Body, frozen=True):
    """Sheets to write a hand on; for a hand those letters of which it has few sure ones."""

    pages: Annotated[int, Meta(ge=1, le=20)] | None = None
    hand: Name | None = None
    also: Annotated[str, Meta(max_length=500)] = ""
    page: Literal["A4", "letter"] = "A4"
    ruling: Length = "10mm"

    def prompt(self, hand: str | None) -> PromptOptions:
        """What is on them."""
        return PromptOptions(pages=self.pages, hand=hand, also=self.also, page=self.page, ruling=self.ruling)


Revision = Annotated[str, Meta(max_length=60)]


class Revised(Body, frozen=True):
    """A change of a hand as it was when it had this revision."""

    revision: Revision


class Corrections(Body, frozen=True):
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


class Movement(Body, frozen=True):
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


class Calibrating(Body, frozen=True):
    """A calibration, and what is done next of it.

    step : what comes next as far as the page knows; faults : of the simulated printer or scanner.
    to_printer : print it, else it is given as PDF; uploads : scans that were sent; made : of a stored calibration.
    """

    printer: Name
    paper: Annotated[str, Meta(pattern=r"^[\w -]{1,60}(?!\n)$")] = "plain"
    sheet: Literal["A4", "letter"] = "A4"
    pages: Literal[1, 2] | None = None
    hand: Name | None = None
    accept: bool = False
    afresh: bool = False
    step: Annotated[str, Meta(max_length=40)] = ""
    to_printer: bool = True
    uploads: Annotated[tuple[UploadId, ...], Meta(max_length=4)] = ()
    faults: Annotated[tuple[Name, ...], Meta(max_length=4)] = ()
    made: Annotated[str, Meta(max_length=40)] = ""

    def place(self, hand: str) -> CalibrationPlace:
        """The calibration; `hand` is where its hand is kept, or its name."""
        options = CalibrationOptions(hand=hand, accept=self.accept, afresh=self.afresh, faults=self.faults)
        return CalibrationPlace(self.printer, self.paper, ChartOptions(self.sheet, self.pages), options, self.step)
