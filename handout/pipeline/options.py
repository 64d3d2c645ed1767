"""What a caller may ask for, typed and frozen: the options of all verbs, each declared once.

What a plotter is asked for is in `plot_request`; `declarations` says how an option is declared.  Nothing heavy is
imported here: the command reads this file to show its help.
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from msgspec import Meta

from handout import page_sizes, units
from handout.colour import METHODS
from handout.errors import InputError
from handout.inking.pen import PENS as PENS
from handout.inking.pen import TEXTURED as TEXTURED
from handout.motion import ENGINES as ENGINES
from handout.motion import POSE_METHODS as POSE_METHODS
from handout.pipeline.declarations import (
    ENVELOPES,
    FILES,
    HAND,
    INK,
    MACHINE,
    PAGE,
    PARTS,
    STYLE,
    TABLE,
    Colour,
    Lengths,
    Name,
    Number,
    PageName,
    PaperName,
    Seed,
    SentLength,
    option,
    shared,
)

if TYPE_CHECKING:
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand
    from handout.sinks import Look

Length = str | float  # a length with its unit, such as "2.5mm", or a number of mm

Align = Literal["left", "right", "centre", "ragged"]
LayerBy = Literal["ink", "line", "word"]

COLOUR_METHODS = METHODS  # by which a table is made of patches
LAYERS: tuple[LayerBy, ...] = get_args(LayerBy)  # what a layer of a file may be
ALIGNMENTS: tuple[Align, ...] = get_args(Align)

_SIDES = "e.g. 15mm, or 20mm,15mm (vertical, horizontal), or four from the top clockwise."
_POSE = "Hold the pen as a pose library suggests: one that comes with the program, or a .pose file."
_METHOD = "How the pose is put together of the library's strokes."
_STYLES = "fast-tag, calm, blackletter, chancery, scrawl, learned, one of your own, or a .toml or .style file."
_PRIME = "Of a learned style: the example that primes it, by its name, or a drawing's file."
_TEMPERATURE = "Of a learned style: how much chance; 1 as in its examples."
_ROWS = "Rows by their numbers in the file, the header is 1: 3-7,9 or 7-."


def slip_rate(text: str) -> float:
    """Slips in 100 words: a number of them, or "usual". Raises InputError: no number, or one outside 0 to 100."""
    from handout.writing.slips import USUAL, check_rate

    try:
        return check_rate(USUAL if text == "usual" else float(text))
    except ValueError:
        raise InputError(
            f"slips: {text!r} is no number of slips in 100 words; give one, such as --slips 3, or put --slips last."
        ) from None


@dataclass(frozen=True)
class WritingOptions:
    """How a text is written.

    hand : the name of a hand, the path of its file, or a hand that was loaded or read.
    seed : None: one by chance, which the result tells.
    speed : "human", "fast", or a factor.
    slips : words in 100 that are begun wrongly and struck out.
    rewritten : words that are written again while all others stay as they are: where each begins in the text, and how
        many times; in a letter file, where in what its hands write, as `write` tells it.
    """

    hand: str | Hand | ScannedHand = shared(
        "house-joined",
        "A built-in hand, your own, or a .hand or .toml file or .svg font.",
        HAND,
        sent=Name,
        of_strokes=False,
    )
    seed: int | None = shared(
        None, "Same seed, same writing; without it every run differs.", HAND, sent=Seed | None, of_strokes=False
    )
    x_height: Length | None = shared(
        None, "Height of a small letter; default: 2.5mm, or a scanned hand's own.", PAGE, sent=SentLength | None
    )
    line_spacing: Length | None = shared(
        None, "Distance of lines, e.g. 9mm; default: the hand's own.", PAGE, sent=SentLength | None
    )
    align: Align = shared(
        "ragged", "Of lines; ragged begins them on the left, not quite straight.", PAGE, choices=ALIGNMENTS, sent=Align
    )
    kinematics: str = shared("optimal-control", "How the strokes move.", HAND, choices=ENGINES)
    speed: str | float = shared("human", "human, fast, or a factor such as 1.5.", HAND)
    jitter: float = shared(
        1.0,
        "1 as people vary, 0 none.",
        HAND,
        flags=("--variation", "--jitter"),
        sent=Annotated[float, Meta(ge=0, le=3)],
        sent_as="variation",
    )
    haste: float = shared(0.0, "-1 careful, 0 as drawn, 1 hurried.", HAND, sent=Annotated[float, Meta(ge=-1, le=1)])
    legible: float = shared(
        0.0,
        "0 as the author of a scanned hand writes, 1 (or no number) as legible as his letters can be.",
        HAND,
        alone="1",
        sent=Annotated[float, Meta(ge=0, le=1)],
    )
    language: str = shared(
        "en",
        "Of dates in letters (de, fr, en-GB …), and of letters that it writes its own way (bg, sr).",
        HAND,
        sent=Annotated[str, Meta(pattern=r"^[A-Za-z_-]{1,20}(?!\n)$")],
    )
    fit: bool = shared(False, "Shrink what does not fit instead of refusing it.", PAGE, sent=bool)
    fallback: bool = shared(
        False, "Take similar forms for characters that the hand lacks, leave out emoji.", HAND, sent=bool
    )
    slips: float = shared(
        0.0,
        "Words in 100 begun wrongly, struck out and written again; without a number 2. Never in addresses.",
        HAND,
        kind=slip_rate,
        metavar="[RATE]",
        alone="usual",
        sent=Annotated[float, Meta(ge=0, le=100)],
    )
    strict: bool = shared(
        False, "Refuse a text of which a word, as written, reads as another.", HAND, sent=bool, of_strokes=False
    )
    pose: str | None = shared(None, _POSE, STYLE, of_strokes=False)
    pose_method: str = shared(POSE_METHODS[0], _METHOD, STYLE, choices=POSE_METHODS)
    style: str | None = shared(
        None, f"Move through what is written in a handstyle: {_STYLES}", STYLE, sent=Name | None, of_strokes=False
    )
    prime: str | None = shared(None, _PRIME, STYLE, of_strokes=False)
    temperature: float | None = shared(None, _TEMPERATURE, STYLE)
    rewritten: tuple[tuple[int, int], ...] = option(
        (),
        sent=Annotated[
            tuple[tuple[Annotated[int, Meta(ge=0, le=100_000)], Annotated[int, Meta(ge=1, le=100)]], ...],
            Meta(max_length=1000),
        ],
    )


@dataclass(frozen=True)
class SheetOptions:
    """The sheet that is written on.

    page : a name such as "A5", or WxHmm; None: that of a scanned sheet, or else `usual_page`.
    margin : None: a tenth of the short side.
    pages : how many there may be; None: as many as the text needs.
    usual_page : the page where none is asked for.
    at : a place in a text, graphemes from 0: only the page that holds it is written, whose number is told as `page` if
        there are others; of a letter file all pages are.
    """

    page: str | None = shared(None, page_sizes.HELP, PAGE, usual="usual_page", sent=PageName | None)
    margin: str | None = shared(None, _SIDES, PAGE, sent=Lengths | None)
    pages: int | None = shared(None, "How many pages there may be.", PAGE, least=1, sent=Number | None)
    usual_page: str = "A4"
    at: int | None = None

    @property
    def page_name(self) -> str:
        """The page that is asked for, or the usual one."""
        return self.usual_page if self.page is None else self.page


@dataclass(frozen=True)
class PictureOptions:
    """How writing looks in pictures.

    pen : one of `PENS`, a brush or a .brush file, or for a scanned hand another .hand file; None: ballpoint, or a
        scanned hand's own pen.
    paper : "none", "plain", "laid", "ruled", "squared" (with ":8mm", ":8mm,25mm"), or a picture or PDF
        of a sheet, FILE or FILE:2.
    """

    dpi: float = shared(300.0, "Of PNG files.", INK, least=36, most=2400, sent=Annotated[float, Meta(ge=20, le=1200)])
    pen: str | None = shared(
        None,
        f"What the ink looks like, in PNG files and prints: {', '.join(PENS)}, by default ballpoint; "
        "dry-brush, marker, sumi, crayon, or a .brush file. A scanned hand has its own; another .hand file lends it "
        "that of its pages.",
        INK,
        sent=Name | None,
    )
    pen_width: Length | None = shared(
        None, "Width of the line, in pictures; default: the pen's own, plain 0.3mm.", INK, sent=SentLength | None
    )
    ink: str | None = shared(
        None,
        "Colour of the ink, in pictures: #rrggbb, or a name such as navy; default: the pen's own.",
        INK,
        sent=Colour | None,
    )
    paper: str = shared(
        "none",
        "plain laid ruled squared (ruled:8mm; ruled:8mm,25mm: the first rule 25mm from the top), or a picture or "
        "PDF of a sheet (FILE, FILE:2): behind the ink in PNG files, and written on its lines and beside its print in "
        "all.",
        INK,
        unless=("transparent",),
        sent=PaperName,
    )
    transparent: bool = shared(False, "PNG files without any paper.", INK, unless=("paper",), sent=bool)
    layer_by: LayerBy = shared("ink", "What each layer of SVG and DXF files is.", INK, choices=LAYERS)

    @property
    def has_scanned_pen(self) -> bool:
        """Whether the pen is a scanned hand's: its name, or a .hand file."""
        from handout.hand import library

        name = self.pen
        return name is not None and name not in PENS and (name.endswith(".hand") or name in library.scanned_files())

    def look(self, *, styled: bool = False) -> Look:
        """How pictures look that are asked for so; where a scanned hand lends its ink, strokes are a ballpoint's.

        styled : whether strokes are moved anew by a style, which brings its own widths: an even ink is the usual one.

        Raises InputError: a pen, a colour or a paper that there is not, both a paper and --transparent, or a style and
        a pen whose scanned ink cannot be moved anew.
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
        sheet = papers.parse_paper(self.paper)
        if self.transparent and sheet.name != "none":
            raise InputError("--transparent leaves the paper out and --paper puts it in: give one of them.")
        return Look(strokes, self.dpi, sheet, self.transparent, layers=self.layer_by)


@dataclass(frozen=True)
class ChartOptions:
    """The sheets that charts and strips are printed on; pages None: what the printer's margins ask for."""

    sheet: str = option("A4", "A4 or letter.", sent=Literal["A4", "letter"])
    pages: int | None = option(None, "1, or 2 where the printer's margins are wide.", sent=Literal[1, 2] | None)


@dataclass(frozen=True)
class CalibrationOptions:
    """How a printer is calibrated; output None: chart and strip go to the printer."""

    scanner: str | None = option(
        None, "Scan through SANE with this scanner (scanimage -L lists them) instead of giving files."
    )
    scanner_name: str = option("", "What the scanner that makes the files is called, for the record.")
    hand: str = option("", "Verify with the ink of this hand; compare the scan with its pages.")
    output: Path | None = option(
        None, "Folder for chart and strip as PDF, if you print them yourself.", flags=("-o", "--output")
    )
    method: str = option("forward", "How the table is made of the patches.", choices=COLOUR_METHODS)
    no_verify: bool = option(False, "Store the table without printing a verification strip.")
    accept: bool = option(False, "Calibrate with the print as it is, though inks are weak in it.", sent=bool)
    afresh: bool = option(False, "Begin anew instead of going on where the last run was left.", sent=bool)
    faults: tuple[str, ...] = option(
        (),
        "With sim: something wrong with printer or scanner.",
        flags=("--fault",),
        sent=Annotated[tuple[Name, ...], Meta(max_length=4)],
    )


@dataclass(frozen=True)
class CalibrationPlace:
    """A calibration that is done step by step, and what a page asks of it.

    step : what comes next as far as who asks knows; "" where that is asked for.
    folder : for files that are made; scans : that were sent; to_printer : print a page, else write it into the folder;
    made : of a stored calibration, when it was made.
    """

    printer: str
    paper: str
    chart: ChartOptions = ChartOptions()
    options: CalibrationOptions = CalibrationOptions()
    step: str = ""
    folder: Path = Path()
    scans: tuple[Path, ...] = ()
    to_printer: bool = True
    made: str = ""


@dataclass(frozen=True)
class ReadingOptions:
    """How a hand is read from pages."""

    dpi: float | None = option(
        None,
        "Pixels an inch of the scans, where the files do not say.",
        sent=Annotated[float, Meta(ge=50, le=2400)] | None,
    )
    pen: str | None = option(
        None,
        "What it was written with; default: told from the ink.",
        choices=TEXTURED,
        sent=Literal["ballpoint", "fineliner", "fountain", "pencil"] | None,
    )
    title: str | None = option(
        None, "What to call the hand, for people.", sent=Annotated[str, Meta(max_length=200)] | None
    )
    seed: int = option(0, "Same seed, same hand.", least=0, sent=Seed)
    ink_only: bool = option(
        False, "Keep nothing of the scans but their ink. What is painted is then not segmented anew.", sent=bool
    )


@dataclass(frozen=True)
class TableOptions:
    """Which rows of a table are made, how its columns are read, and how a batch of them is gone on with."""

    rows: str = option("", _ROWS, TABLE, sent=Annotated[str, Meta(pattern=r"^[0-9, -]{0,500}(?!\n)$")])
    columns: tuple[str, ...] = option(
        (),
        'What columns hold: "name=Guest(s)" or "1=name"; also of a row its own hand, pen, language, copies, '
        "or its text.",
        TABLE,
        metavar="WHAT=COLUMN",
        sent=Annotated[tuple[Annotated[str, Meta(max_length=200)], ...], Meta(max_length=50)],
    )
    address: str = option("", "Of several addresses of a row: home, business, 2 …", TABLE)
    no_name: bool = option(False, "Take a table that has no names.", TABLE)
    copies: int = option(1, "Of each row.", PARTS, sent=Number)
    resume: bool = option(
        False, "Go on with a batch that broke off: print exactly the rest of it.", PARTS, of_batch=False
    )
    again: str = option("", "With --resume: make these whatever became of them.", TABLE, metavar="ROWS", of_batch=False)
    afresh: bool = option(False, "Make all of it, though an earlier run of it broke off.", TABLE, of_batch=False)
    jobs: int = shared(1, "Processes that make pages.", TABLE, least=1, of_batch=False)
    cluster: str = shared(
        "", "Of a Dask scheduler: its workers make the pages.", TABLE, metavar="ADDRESS", of_batch=False
    )


@dataclass(frozen=True)
class PrintOptions(TableOptions):
    """What is printed of a table, on which printer, and how it is fed.

    printer : its profile, its queue, or an address ipp://…
    flap : of an envelope, the edge that goes in first upwards; feed None: the profile's.
    """

    printer: str = shared("pdf", "A printer's profile (epson), queue, or ipp://…", MACHINE)
    queue: str | tuple[str, ...] = option(
        (), "Where pages go: a CUPS queue, ipp://HOST/ipp/print, file:FOLDER; several share.", MACHINE, of_batch=False
    )
    envelopes_to: tuple[str, ...] = option(
        (), "Where envelopes go, if not with letters.", ENVELOPES, metavar="PRINTER", of_batch=False
    )
    dry_run: str | Path | None = option(None, "Write .pdf, .png or .svg instead of printing.", FILES, of_batch=False)
    page: str | None = option(None, f"{page_sizes.HELP}  [default: A4, or without a letter DL]", PAGE, of_batch=False)
    tray: str = option("", "Feed from this tray, as the printer calls it (rear, main …).", MACHINE)
    feed: str | None = option(None, "The edge of the sheet that goes in first.", MACHINE, choices=("short", "long"))
    flap: str | None = option(
        None,
        "Where an envelope's flap is, print side towards you, the edge that goes in first upwards.",
        ENVELOPES,
        choices=("left", "right", "leading", "trailing"),
    )
    nudge: str | None = option(None, "Move the writing to the right and down: 1.5mm,-0.5mm.", MACHINE, metavar="X,Y")
    format: str | None = option(
        None, "Of what is sent; default: the best.", MACHINE, choices=("pdf", "pwg", "urf", "png")
    )
    calibration: str = option("", "A printer/paper, a file, or none; default: the printer's newest.", MACHINE)
    stock: str = option("", "What paper is in the printer, as it was called when it was calibrated.", MACHINE)


@dataclass(frozen=True)
class MergeOptions:
    """The letter that every row of a table fills, and what goes on its envelope.

    letter : its file, a template; None: there is none, or the text stands in a column.
    margin, pages : of the letter, as in `SheetOptions`.
    given : options that win over the head of a letter file, as in `pipeline.letters.prepare_letter`.
    alone : whether letter, table and return address were sent from elsewhere, and may name no other files.
    """

    letter: str | Path | None = option(
        None, "A letter with gaps, {{ first_name }}, that every row of the table fills.", TABLE, of_batch=False
    )
    approved: str | Path | None = option(None, "A proof's .json: refuse what differs from it.", TABLE, of_batch=False)
    given: frozenset[str] | None = option(None, of_batch=False)
    with_envelopes: bool = option(False, "An envelope for every letter.", ENVELOPES, sent=bool)
    envelope: str = shared("DL", "The size of these envelopes.", ENVELOPES, sent=PageName)
    margin: str | None = option(None, f"Of letters: {_SIDES}", PAGE, sent=Lengths | None)
    pages: int | None = option(None, "How many pages a letter may have.", PAGE, least=1, sent=Number | None)
    return_address: str = shared(
        "", "The sender on envelopes: a text, or its file.", ENVELOPES, sent=Annotated[str, Meta(max_length=500)]
    )
    return_at: Literal["corner", "back"] = shared(
        "corner",
        "Where the sender stands: in the corner of the front, or on the back.",
        ENVELOPES,
        choices=("corner", "back"),
    )
    home_country: str = shared(
        "", "The country that is left out of addresses.", ENVELOPES, sent=Annotated[str, Meta(max_length=60)]
    )
    window: str = shared("", "Address on the letter, for a window: DL, C5, #10, CH, CH-left or FR.", ENVELOPES)
    tick: bool = shared(False, "The row's number, small, on letter and envelope.", TABLE, sent=bool)
    skip_bad: bool = shared(
        False, "Make the rows that can be made, though others cannot.", TABLE, sent=bool, of_batch=False
    )
    once: bool = shared(False, "Of rows that are the same, make only the first.", TABLE, sent=bool)
    alone: bool = option(False, of_batch=False)


@dataclass(frozen=True)
class FillOptions:
    """How a PDF form is filled in; device None: a common plotter."""

    columns: tuple[str, ...] = option(
        (),
        'Which column answers a field: "Surname=Last name"; "=Notes" leaves a column out.',
        TABLE,
        metavar="FIELD=COLUMN",
    )
    rows: str = option("", _ROWS, TABLE)
    mark: Literal["cross", "tick"] = option("cross", "In check boxes.", choices=("cross", "tick"))
    writing_only: bool = option(False, "Without the form, for sheets that it is printed on already.")
    device: str | None = shared(
        None, "The plotter, for --port and .gcode, .hpgl or .ebb files; default: a common one.", MACHINE
    )


@dataclass(frozen=True)
class StyleOptions:
    """A handstyle, and what is changed of it; None: the style's own."""

    style: str | None = option(None, f"Default: fast-tag. Or {_STYLES.removeprefix('fast-tag, ')}", STYLE)
    smooth: float | None = option(None, "0.05 to 1: how much the movement rounds; default: the style's.", STYLE)
    shear: str | None = option(None, "Lean of the letters, such as 12deg; default: the style's.", STYLE)
    jitter: float | None = option(None, "How much the hand varies, 1 as people do; default: the style's.", STYLE)
    prime: str | None = shared(None, _PRIME, STYLE)
    temperature: float | None = shared(None, _TEMPERATURE, STYLE)
    seed: int | None = option(None, "Same seed, same bytes; without it every run may differ.", STYLE)


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

    title: str | None = option(None, "What to call it, for people; default: the name of the file.")
    size: str = option(
        "small",
        "Of the networks; berio_2017 is that of the paper, with 36 times the weights.",
        choices=("small", "berio_2017"),
    )
    inputs: str = option(
        "ahead", "What they are told of a stroke.", choices=("ahead", "local", "berio_2017", "berio_2017_no_history")
    )
    seed: int = option(0, "Same seed, same style.")


@dataclass(frozen=True)
class PoseOptions:
    """How a pen is held, after a library of recorded strokes; pose None: as it was."""

    pose: str | None = option(None, _POSE, STYLE)
    method: str = option(POSE_METHODS[0], _METHOD, STYLE, choices=POSE_METHODS)
    trajectory: bool = option(False, "Draw the strokes, too, as the library's writer draws.", STYLE)
    one_pass: bool = option(False, "With --trajectory: hold the pen as the old strokes suggest.", STYLE)


@dataclass(frozen=True)
class PromptOptions:
    """The sheets that an author is asked to write on."""

    pages: int | None = option(
        None,
        "How many to write; default: 4, or 1 with --for.",
        least=1,
        most=100,
        sent=Annotated[int, Meta(ge=1, le=20)] | None,
    )
    hand: str | None = option(
        None, "A scanned hand, or .hand file: the letters of which it has few sure ones.", flags=("--for",)
    )
    characters: str | None = option(None, "Each occurs at least once; default: all printable ASCII, or the hand's.")
    also: str = option("", "More characters than these, e.g. äöüß€.", sent=Annotated[str, Meta(max_length=500)])
    target: str | None = option(None, "A file with texts such as will be wanted later: its letters count, and occur.")
    corpus_file: str | None = option(
        None, "A file of text to take the sentences from; default: the program's own.", flags=("--corpus",)
    )
    language: str = option(
        "en",
        "Of the sentences: en, be, bg, el, ru, sr or uk; other than en, its letters take the place of ASCII's.",
        sent=Literal["en", "be", "bg", "el", "ru", "sr", "uk"],
    )
    page: str = option("A4", "A4 or letter.", sent=Literal["A4", "letter"])
    ruling: Length = option("10mm", "Distance of the lines, 6mm to 20mm.", sent=SentLength)
    letter_width: Length | None = option(
        None, "Width your letters take, with gaps, e.g. 2.8mm; default: a third of the ruling."
    )
    ruled: bool = option(
        True,
        "Lines and words printed pale where you write; or nothing but the marks, with the words on a page beside "
        "and lines to lay under: for printers without colour, and for red ink.",
        off="--plain",
    )


@dataclass(frozen=True)
class ProofOptions(TableOptions):
    """What a proof is of: the page, and the machine, printer or plotter, whose reach, time and prices are looked at."""

    page: str | None = option(None, f"{page_sizes.HELP}  [default: A4, of a plotter A5, without a letter DL]", PAGE)
    printer: str = option("", "Whose reach is looked at: a printer's profile, or its queue.", MACHINE)
    device: str = option("", "Whose reach and time are looked at: a plotter's profile.", MACHINE)
    prices: str = option("", "sheet=0.02,envelope=0.1,hour=4,currency=EUR …", TABLE, metavar="NAME=…,…")


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


@dataclass(frozen=True)
class BatchPlan:
    """How a batch is made.

    to : a PDF file, a printer (`printer`, by its profile or queue), or a plotter (`device`, its profile).
    queues : further queues, which share it with that; grid : of a plotter, cards side by side, see `PlotOptions`.
    key : by which a program that asks twice keeps it once; test : it is proofed, and nothing is sent.
    webhook : the address that is told how it ended, with a signature of `secret`.
    """

    title: str
    to: Literal["pdf", "printer", "plotter"]
    writing: WritingOptions
    picture: PictureOptions
    table: TableOptions
    merge: MergeOptions
    page: str
    printer: str = ""
    queues: tuple[str, ...] = ()
    device: str | None = None
    grid: str = ""
    key: str = ""
    test: bool = False
    webhook: str = ""
    secret: str = ""
