"""What a caller may ask for, typed and frozen, with the command's defaults: the options of all verbs.

Nothing heavy is imported here: the command reads this file to show its help.
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from handout import units
from handout.colour import METHODS, exports
from handout.errors import InputError
from handout.inking.pen import PENS as PENS
from handout.inking.pen import TEXTURED as TEXTURED
from handout.motion import ENGINES as ENGINES
from handout.motion import POSE_METHODS as POSE_METHODS

if TYPE_CHECKING:
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand
    from handout.sinks import Look

Length = str | float  # a length with its unit, such as "2.5mm", or a number of mm

Align = Literal["left", "right", "centre", "ragged"]
LayerBy = Literal["ink", "line", "word"]

COLOUR_METHODS = METHODS  # by which a table is made of patches
COLOUR_FORMATS = tuple(exports.FORMATS)  # that a calibration can be written as
LAYERS: tuple[LayerBy, ...] = get_args(LayerBy)  # what a layer of a file may be
ALIGNMENTS: tuple[Align, ...] = get_args(Align)


@dataclass(frozen=True)
class WritingOptions:
    """How a text is written.

    hand : the name of a hand, the path of its file, or a hand that was loaded or read.
    seed : same seed, same writing; None: one by chance, which the result tells.
    x_height : height of a small letter; None: 2.5 mm, or a scanned hand's own.
    line_spacing : distance of baselines; None: the hand's own.
    align : one of `ALIGNMENTS`.
    kinematics : how strokes move, one of `ENGINES`.
    speed : "human", "fast", or a factor.
    jitter : variation, 1 as people vary, 0 none.
    haste : −1 careful, 0 as drawn, 1 hurried; for drawn hands.
    fit : shrink what does not fit its page.
    fallback : take similar forms for characters that the hand lacks.
    slips : words in 100 that are begun wrongly and struck out.
    strict : refuse a text of which a word reads as another.
    pose : a pose library, by its name or the path of a .pose file, that says how the pen is held; None: none.
    pose_method : one of `POSE_METHODS`.
    style : a handstyle, by its name or file, in which the written strokes are moved through anew; None: none.
    prime : of a learned style, the example that primes it, by its name or the file of a drawing; None: the style's own.
    temperature : of a learned style, how much chance there is, 1 as in its examples; None: the style's own.
    rewritten : words that are written again while all others stay as they are: where each begins in the text, and how
        many times; in a letter file, where in what its hands write, as `Written.words` tells it.
    """

    hand: str | Hand | ScannedHand = "house-joined"
    seed: int | None = None
    x_height: Length | None = None
    line_spacing: Length | None = None
    align: Align = "ragged"
    kinematics: str = "optimal-control"
    speed: str | float = "human"
    jitter: float = 1.0
    haste: float = 0.0
    fit: bool = False
    fallback: bool = False
    slips: float = 0.0
    strict: bool = False
    pose: str | None = None
    pose_method: str = POSE_METHODS[0]
    style: str | None = None
    prime: str | None = None
    temperature: float | None = None
    rewritten: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class SheetOptions:
    """The sheet that is written on.

    page : a name such as "A5", or WxHmm; None: that of a scanned sheet, or else `usual_page`.
    margin : one, two or four lengths, parted by commas, from the top clockwise; None: a tenth of the short side.
    pages : how many there may be; None: as many as the text needs.
    usual_page : the page where none is asked for.
    """

    page: str | None = None
    margin: str | None = None
    pages: int | None = None
    usual_page: str = "A4"

    @property
    def page_name(self) -> str:
        """The page that is asked for, or the usual one."""
        return self.usual_page if self.page is None else self.page


@dataclass(frozen=True)
class PictureOptions:
    """How writing looks in pictures.

    dpi : pixels an inch of PNG files.
    pen : one of `PENS`, a brush or a .brush file, or for a scanned hand another .hand file; None: ballpoint, or a
        scanned hand's own pen.
    pen_width : width of the line; None: the pen's own.
    ink : colour of the ink, "#rrggbb" or a name; None: the pen's own.
    paper : "none", "plain", "laid", "ruled", "squared" (with ":8mm", ":8mm,25mm"), or a picture or PDF
        of a sheet, FILE or FILE:2.
    transparent : leave the paper out of PNG files.
    layer_by : what a layer of SVG and DXF files is, one of `LAYERS`.
    """

    dpi: float = 300.0
    pen: str | None = None
    pen_width: Length | None = None
    ink: str | None = None
    paper: str = "none"
    transparent: bool = False
    layer_by: LayerBy = "ink"

    @property
    def has_scanned_pen(self) -> bool:
        """Whether the pen is a scanned hand's: its name, or a .hand file."""
        from handout.hand import library

        name = self.pen
        return name is not None and name not in PENS and (name.endswith(".hand") or name in library.scanned())

    def look(self, *, styled: bool = False) -> Look:
        """How pictures look that are asked for so; where a scanned hand lends its ink, strokes are a ballpoint's.

        styled : whether strokes are moved anew by a style, which brings its own widths: an even ink is the usual one.

        Raises
        ------
        InputError
            A pen, a colour or a paper that there is not, both a paper and --transparent, or a style and a pen whose
            scanned ink cannot be moved anew.
        """
        from handout.inking import papers, pen
        from handout.sinks import Look

        name, width = self.pen or ("plain" if styled else "ballpoint"), self.pen_width
        if styled and self.has_scanned_pen:
            raise InputError(
                f"--style moves strokes anew, and the ink of {name} lies as it was scanned: leave --pen out."
            )
        if self.has_scanned_pen:
            strokes = pen.usual("ballpoint", colour=self.ink)
        elif name in PENS or pen.is_brush(name):
            own: tuple[float | None, str | None] = (None, None)
            if name not in PENS:
                from handout.inking.brush.brushes import find

                own = (find(name).width, find(name).colour)
            strokes = pen.usual(name, own[0] if width is None else millimetres(width, "pen width"), self.ink or own[1])
        else:
            known = ", ".join((*PENS, *pen.brushes()))
            raise InputError(f"pen: {name!r} is not one of {known}, nor a .brush or .hand file.")
        sheet = papers.named(self.paper)
        if self.transparent and sheet.name != "none":
            raise InputError("--transparent leaves the paper out and --paper puts it in: give one of them.")
        return Look(strokes, self.dpi, sheet, self.transparent, layers=self.layer_by)


@dataclass(frozen=True)
class ChartOptions:
    """The sheets that charts and strips are printed on.

    sheet : "A4" or "letter"; pages : 1, or 2 where the printer's margins are wide; None: what the margins ask for.
    """

    sheet: str = "A4"
    pages: int | None = None


@dataclass(frozen=True)
class CalibrationOptions:
    """How a printer is calibrated.

    scanner : scan through SANE with this scanner instead of asking for files; scanner_name : for the record.
    hand : the hand whose ink verifies the calibration, and with whose pages the scan is compared.
    output : a folder for chart and strip as PDF, for a user who prints them; None: they go to the printer.
    method : how the table is made of the patches, one of `colour.models.METHODS`.
    no_verify : store the table without a verification strip; accept : take a print in which inks are weak.
    afresh : begin anew instead of going on where the last run was left.
    faults : of the simulated printer or scanner.
    """

    scanner: str | None = None
    scanner_name: str = ""
    hand: str = ""
    output: Path | None = None
    method: str = "forward"
    no_verify: bool = False
    accept: bool = False
    afresh: bool = False
    faults: tuple[str, ...] = ()


@dataclass(frozen=True)
class CalibrationPlace:
    """A calibration that is done step by step.

    step : what comes next as far as who asks knows; "" where that is asked for.
    """

    printer: str
    paper: str
    chart: ChartOptions = ChartOptions()
    options: CalibrationOptions = CalibrationOptions()
    step: str = ""


@dataclass(frozen=True)
class ReadingOptions:
    """How a hand is read from pages.

    dpi : pixels an inch of the scans, where the files do not say.
    pen : what it was written with, one of `TEXTURED`; None: told from the ink.
    title : what to call the hand, for people.
    seed : same seed, same hand.
    ink_only : the file keeps nothing of the scans but their ink.
    """

    dpi: float | None = None
    pen: str | None = None
    title: str | None = None
    seed: int = 0
    ink_only: bool = False


@dataclass(frozen=True)
class TableOptions:
    """Which rows of a table are made, how its columns are read, and how a batch of them is gone on with."""

    rows: str = ""  # by their numbers in the file, "3-7,9" or "7-"; all for ""
    columns: tuple[str, ...] = ()  # what columns hold, where headers do not say it: "name=Guest(s)", "1=name"
    address: str = ""  # which of several addresses of a row: home, business, 2 …
    no_name: bool = False  # whether a table without names may be
    copies: int = 1  # of each row
    resume: bool = False  # go on with a batch that broke off
    again: str = ""  # with `resume`, rows to make whatever became of them
    afresh: bool = False  # make all of it, though an earlier run broke off
    jobs: int = 1  # processes that make rows
    cluster: str = ""  # address of a Dask scheduler whose workers make them instead


@dataclass(frozen=True)
class PrintOptions(TableOptions):
    """What is printed of a table, on which printer, and how it is fed."""

    printer: str = "pdf"  # its profile, its queue, or an address ipp://…
    queue: (
        str | tuple[str, ...]
    ) = ()  # where they go instead of the profile's queue: a CUPS queue, ipp://…, file:FOLDER
    envelopes_to: tuple[str, ...] = ()  # where envelopes go, if not where letters do: likewise, or a profile
    dry_run: str | Path | None = None  # a .pdf, .png or .svg that is written instead of printing
    page: str | None = None  # the letter's, or without one the envelope's: a name or WxHmm; None: A4, or DL
    tray: str = ""  # as the printer calls it
    feed: str | None = None  # the edge that goes in first, short or long; None: the profile's
    flap: str | None = None  # of an envelope, the edge that goes in first upwards: left, right, leading or trailing
    nudge: str | None = None  # how far the writing is moved to the right and down, "1.5mm,-0.5mm"
    format: str | None = None  # of what is sent: pdf, pwg, urf, png; None: the best
    calibration: str = ""  # a printer/paper, a file, or none; "": the printer's newest
    stock: str = ""  # what paper is in the printer, as it was called when it was calibrated


@dataclass(frozen=True)
class MergeOptions:
    """The letter that every row of a table fills, and what goes on its envelope.

    letter : its file, a template; None: there is none, or the text stands in a column.
    with_envelopes : whether every row has an envelope besides; envelope : a name or WxHmm.
    margin, pages : of the letter, as in `SheetOptions`.
    language : of the rows that do not say one, for dates.
    return_address : the sender's, a text or its file; return_at : "corner" of the envelope's front, or its "back".
    home_country : the country that is left out of addresses.
    window : the envelope whose window shows the address, which then stands on the letter: DL, C5 or #10.
    tick : whether the row's number stands small on letter and envelope.
    skip_bad : whether rows that can be made are made although others cannot.
    once : whether of rows that are the same only the first is made.
    given : options that win over the head of a letter file, as in `pipeline.letters.prepare_letter`.
    approved : the .json file of a proof, which these pages have to be.
    alone : whether letter, table and return address were sent from elsewhere, and may name no other files.
    """

    letter: str | Path | None = None
    approved: str | Path | None = None
    given: frozenset[str] | None = None
    with_envelopes: bool = False
    envelope: str = "DL"
    margin: str | None = None
    pages: int | None = None
    language: str = "en"
    return_address: str = ""
    return_at: Literal["corner", "back"] = "corner"
    home_country: str = ""
    window: str = ""
    tick: bool = False
    skip_bad: bool = False
    once: bool = False
    alone: bool = False


@dataclass(frozen=True)
class FillOptions:
    """How a PDF form is filled in."""

    columns: tuple[str, ...] = ()  # what columns answer, where their headers do not say it: "field=column", "=column"
    rows: str = ""  # by their numbers in the file, "3-7,9" or "7-"; all for ""
    mark: Literal["cross", "tick"] = "cross"  # in a box
    writing_only: bool = False  # .pdf and .png without the form, for sheets on which it is printed already
    device: str | None = None  # the plotter; None: a common one


@dataclass(frozen=True)
class StyleOptions:
    """A handstyle, and what is changed of it."""

    style: str | None = None  # a style's name, or a .toml or .style file; None: fast-tag
    smooth: float | None = None  # 0.05 to 1: how much the movement rounds; None: the style's
    shear: str | None = None  # lean of the letters, such as "12deg"; None: the style's
    jitter: float | None = None  # how much the hand varies, 1 as people do; None: the style's
    prime: str | None = None  # of a learned style, an example by its name or file; None: the style's own
    temperature: float | None = None  # of a learned style, 1 for as much chance as in its examples; None: the style's
    seed: int | None = None  # same seed, same bytes; None: one by chance


StyleValue = float | str | Sequence[float]


@dataclass(frozen=True)
class StyleDraft:
    """A handstyle that is being edited.

    values : "movement.smooth" → 0.3; angles in degrees, times in ms, directions as lists.
    base : the style (name or file) whose learned manner it has, "" for one by rules.
    name : what it is called.
    """

    values: Mapping[str, StyleValue]
    base: str = ""
    name: str = "draft"


@dataclass(frozen=True)
class LessonOptions:
    """How a style is learned from examples."""

    title: str | None = None  # for people; None: the name of the file
    size: str = "small"  # of the networks: small, or berio_2017, that of the paper
    inputs: str = "ahead"  # what they are told of a way: ahead, local, berio_2017, berio_2017_no_history
    seed: int = 0  # same seed, same style


@dataclass(frozen=True)
class PoseOptions:
    """How a pen is held, after a library of recorded strokes."""

    pose: str | None = None  # a pose library's name, or a .pose file; None: the pen is held as it was
    method: str = POSE_METHODS[0]  # one of `POSE_METHODS`
    trajectory: bool = False  # whether the strokes themselves become like those of the library
    one_pass: bool = False  # with `trajectory`: pose and path both after the path that was drawn


@dataclass(frozen=True)
class PromptOptions:
    """The sheets that an author is asked to write on."""

    pages: int | None = None  # how many to write; None: 4, or 1 for a hand
    hand: str | None = None  # a scanned hand: sheets of the letters of which it has few sure ones
    characters: str | None = None  # each occurs at least once; None: all printable ASCII, or the letters of the hand
    also: str = ""  # more characters than these
    target: str | None = None  # a file with texts such as will be wanted later: its letters count, and occur
    corpus_file: str | None = None  # a file of text to take the sentences from; None: the program's own
    page: str = "A4"  # or letter
    ruling: Length = "10mm"  # distance of the lines
    letter_width: Length | None = None  # width that letters take, with gaps; None: a third of the ruling
    ruled: bool = True  # lines and words printed pale where one writes; or nothing but the marks


def millimetres(length: Length, what: str) -> float:
    """A length in mm; `what` names it in the error message."""
    return units.length(str(length), what)


def seed_of(number: int | None) -> int:
    """The seed that was asked for, or one by chance."""
    seed = secrets.randbelow(10**6) if number is None else number
    if seed < 0:
        raise InputError(f"seed: {seed} is negative; use 0 or more.")
    return seed


def pace(speed: str | float) -> tuple[bool, float]:
    """Whether the writing is as fast as it goes, and the factor of its pace."""
    if speed in ("human", "fast"):
        return speed == "fast", 1.0
    try:
        return False, float(speed)
    except ValueError:
        raise InputError(f"speed: {speed!r} is neither human, fast, nor a factor such as 1.5.") from None


def slip_rate(text: str | None) -> float:
    """Slips in 100 words: none, a number of them, or "usual".

    Raises
    ------
    InputError
        No number, or one outside 0 to 100.
    """
    if text is None:
        return 0.0
    from handout.writing.slips import USUAL, check_rate

    try:
        return check_rate(USUAL if text == "usual" else float(text))
    except ValueError:
        raise InputError(
            f"slips: {text!r} is no number of slips in 100 words; give one, such as --slips 3, or put --slips last."
        ) from None
