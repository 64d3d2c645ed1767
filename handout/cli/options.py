"""What the verbs have in common: the options, where the text comes from, how it becomes strokes."""

from __future__ import annotations

import secrets
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from handout import __version__, units
from handout.errors import InputError
from handout.inking.pen import PENS

if TYPE_CHECKING:
    import numpy as np

    from handout.hand.scanned import ScannedHand
    from handout.inking.papers import Paper
    from handout.inking.pen import Pen
    from handout.values import Drawing, Hand, Manuscript
    from handout.writing.layout import Layout

F = TypeVar("F", bound=Callable[..., Any])

_MOST_TEXT = 2_000_000  # bytes; a longer file is surely not meant to be written by hand
_HURRIED = 2.5  # --speed fast, for a file

_WRITING = (
    click.option(
        "--hand", default="house-joined", show_default=True, help="A built-in hand, your own, or a .hand or .toml file."
    ),
    click.option("--seed", type=int, help="Same seed, same writing; without it every run differs."),
    click.option("--x-height", "x_height", help="Height of a small letter; default: 2.5mm, or a scanned hand's own."),
    click.option("--line-spacing", help="Distance of lines, e.g. 9mm; default: the hand's own."),
    click.option(
        "--align", type=click.Choice(["left", "right", "centre", "ragged"]), default="ragged", show_default=True
    ),
    click.option(
        "--kinematics",
        type=click.Choice(["optimal-control", "sigma-lognormal"]),
        default="optimal-control",
        show_default=True,
        help="How the strokes move.",
    ),
    click.option("--speed", default="human", show_default=True, help="human, fast, or a factor such as 1.5."),
    click.option(
        "--variation",
        "--jitter",
        "jitter",
        type=float,
        default=1.0,
        show_default=True,
        help="1 as people vary, 0 none.",
    ),
    click.option("--haste", type=float, default=0.0, show_default=True, help="-1 careful, 0 as drawn, 1 hurried."),
    click.option("--fit", is_flag=True, help="Shrink what does not fit instead of refusing it."),
    click.option("--fallback", is_flag=True, help="Accept similar forms for characters that the hand lacks."),
    click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output."),
    click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors."),
)
_RASTER = (
    click.option("--dpi", type=click.FloatRange(36, 2400), default=300.0, show_default=True, help="Of PNG files."),
    click.option(
        "--pen",
        help=f"What the ink looks like, in PNG files and prints: {', '.join(PENS)}, by default ballpoint. A scanned "
        "hand has its own; another .hand file lends it that of its pages.",
    ),
    click.option("--pen-width", help="Width of the line, in pictures; default: the pen's own, plain 0.3mm."),
    click.option("--ink", help="Colour of the ink, in pictures, as #rrggbb; default: the pen's own."),
    click.option(
        "--paper",
        default="none",
        show_default=True,
        help="Behind the ink, in PNG files: plain laid ruled squared (ruled:9mm), or a picture.",
    ),
    click.option("--transparent", is_flag=True, help="PNG files without any paper."),
)


def _all(options: Sequence[Callable[[F], F]]) -> Callable[[F], F]:
    def decorate(function: F) -> F:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


writing_options = _all(_WRITING)


def sheet_options(default: str) -> Callable[[F], F]:
    """--page (of that default), --margin and --pages."""
    sizes = "A4 A5 A6 letter DL C6 C5 number-10 or WxHmm."
    sides = "e.g. 15mm, or 20mm,15mm (vertical, horizontal), or four from the top clockwise."
    return _all(
        (
            click.option("--page", "page_name", default=default, show_default=True, help=sizes),
            click.option("--margin", help=sides),
            click.option("--pages", type=click.IntRange(1), help="How many pages there may be."),
        )
    )


picture_options = _all(_RASTER)


def text_of(words: Sequence[str], file: str | None) -> str:
    """The text to write: the arguments, a file, or standard input for ``-``.

    Raises
    ------
    InputError
        None or two of them given; a file that is missing, too long, or not text in UTF-8 (or UTF-16 with a mark).
    """
    if file is not None and words:
        raise InputError("Both a text and --file are given; give one of them.")
    if file is None and not words:
        raise InputError('Nothing to write: give a text, --file letter.txt, or "-" to read standard input.')
    if file is None and list(words) != ["-"]:
        return " ".join(words)
    name = "standard input" if file in (None, "-") else str(file)
    try:
        data = sys.stdin.buffer.read(_MOST_TEXT + 1) if file in (None, "-") else Path(str(file)).read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {name}: {error.strerror or error}.") from error
    return decoded(data, name)


def decoded(data: bytes, name: str) -> str:
    """The text in some bytes, UTF-8 or UTF-16 with a mark, without empty lines at its end.

    Raises
    ------
    InputError
        They are too many, or no text; `name` says where they come from.
    """
    if len(data) > _MOST_TEXT:
        raise InputError(f"{name} is longer than {_MOST_TEXT} bytes: write it in parts.")
    coding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = data.decode(coding)
    except UnicodeDecodeError as error:
        raise InputError(f"{name} is not text in UTF-8 (byte {error.start + 1}): save it as UTF-8.") from error
    if "\0" in text:
        raise InputError(f"{name} is not text: it holds zero bytes.")
    return text.rstrip("\n")


def margins(text: str | None, width: float, height: float) -> tuple[float, float, float, float]:
    """(top, right, bottom, left) in mm from one, two or four lengths; default: a tenth of the short side."""
    if text is None:
        margin = min(20.0, 0.1 * min(width, height))
        return (margin,) * 4
    parts = [units.length(part, "margin") for part in text.split(",")]
    if len(parts) not in (1, 2, 4):
        raise InputError(f"margin: {text!r} holds {len(parts)} lengths; give one, two or four.")
    top, right, bottom, left = (parts * 4)[:4]
    return (top, right, bottom, left)


@dataclass(frozen=True)
class Setup:
    """The options of a verb, checked."""

    hand: Hand | ScannedHand
    layout: Layout
    seed: int
    kinematics: str
    speed: float
    fast: bool
    pages: int | None
    fallback: bool
    lent: ScannedHand | None = None  # whose pen a scanned hand is written with, if not its own


def setup(options: Mapping[str, Any], page_name: str, margin: str | None = None, pages: int | None = None) -> Setup:
    """Check the common options; `options` are those of `writing_options`."""
    from handout.writing.layout import Layout, page

    hand = _hand(options["hand"], options["haste"])
    sheet = page(page_name)
    spacing, x_height = options["line_spacing"], options["x_height"]
    layout = Layout(
        page=sheet,
        margin=margins(margin, sheet.width, sheet.height),
        x_height=hand.x_height if x_height is None else units.length(x_height, "x-height"),
        line_spacing=units.length(spacing, "line spacing") if spacing else None,
        align=options["align"],
        fit=options["fit"],
        jitter=options["jitter"],
    )
    fast, factor = _speed(options["speed"])
    return Setup(
        hand,
        layout,
        seed(options),
        options["kinematics"],
        factor,
        fast,
        pages,
        options["fallback"],
        _lent(options.get("pen"), hand),
    )


def seed(options: Mapping[str, Any]) -> int:
    """The seed that was asked for, or one by chance."""
    given: int = options["seed"] if options["seed"] is not None else secrets.randbelow(10**6)
    if given < 0:
        raise InputError(f"seed: {given} is negative; use 0 or more.")
    return given


def _hand(name: str, haste: float) -> Hand | ScannedHand:
    from handout.hand.haste import hasten
    from handout.hand.library import find
    from handout.values import Hand

    hand = find(name)
    if isinstance(hand, Hand):
        return hasten(hand, haste)
    if haste:
        raise InputError(f"haste: {name} is a scanned hand, which is as hurried as it was written; leave --haste out.")
    return hand


def _lent(pen: str | None, hand: Hand | ScannedHand) -> ScannedHand | None:
    """The hand whose pen is asked for."""
    from handout.hand import file, library
    from handout.values import Hand

    if pen is None:
        return None
    scanned = pen not in PENS and (pen.endswith(file.SUFFIX) or pen in library.scanned())
    if isinstance(hand, Hand):
        if scanned:
            raise InputError(f"pen: {pen} holds scanned ink, which only scanned hands can be written with.")
        return None
    if not scanned:
        raise InputError(
            f"pen: {hand.name} is a scanned hand, written with its own pen or that of another scanned hand."
        )
    return file.load(library.scanned_file(pen))


def drawn_hand(job: Setup) -> Hand:
    """The hand, of which strokes are wanted.

    Raises
    ------
    InputError
        It is a scanned one.
    """
    from handout.values import Hand

    if isinstance(job.hand, Hand):
        return job.hand
    raise InputError(
        f"{job.hand.name} is a scanned hand, whose strokes are not known: it can be written as .png and .pdf and "
        "printed; use a drawn hand."
    )


def _speed(text: str) -> tuple[bool, float]:
    if text in ("human", "fast"):
        return text == "fast", 1.0
    try:
        return False, float(text)
    except ValueError:
        raise InputError(f"speed: {text!r} is neither human, fast, nor a factor such as 1.5.") from None


def compose_and_trace(
    text: str, job: Setup, layout: Layout | None = None, row: int | None = None
) -> tuple[list[Manuscript], list[Drawing]]:
    """The pages of a text as manuscripts and as drawings; each `row` of a batch varies in its own way."""
    import numpy as np

    from handout.writing.compose import compose

    rng = np.random.default_rng([job.seed] if row is None else [job.seed, row])
    job, borrowed = _supplied(text, job)
    pages = compose(text, job.hand, layout or job.layout, rng, pages=job.pages, fallback=job.fallback)
    borrowed = borrowed if row is None else [{"row": row, **one} for one in borrowed]
    pages = [replace(sheet, about={**sheet.about, "borrowed": borrowed}) for sheet in pages] if borrowed else pages
    about = {"title": " ".join(text.split())[:60], "pages": len(pages)} | ({} if row is None else {"row": row})
    drawings = [traced(sheet, job, rng, {**about, "page_number": n}) for n, sheet in enumerate(pages, 1)]
    return pages, drawings


def _supplied(text: str, job: Setup) -> tuple[Setup, list[dict[str, Any]]]:
    """The job with a hand that has every letter of a text, as far as it may be supplied; and what was."""
    from handout.values import Hand

    if isinstance(job.hand, Hand):
        return job, []
    from handout.inking.lending import lend

    hand, found = lend(job.hand, text, fallback=job.fallback, seed=job.seed)
    told = [{"letter": x.letter, "from": x.source, "own": x.own, "at": list(x.at)} for x in found]
    return replace(job, hand=hand), told


def traced(sheet: Manuscript, job: Setup, rng: np.random.Generator, about: Mapping[str, Any]) -> Drawing:
    """A page as timed strokes, or as scanned ink, with what is stored in every output."""
    from handout.values import Hand

    if isinstance(job.hand, Hand):
        from handout.motion.trace import trace

        speed = job.speed * (_HURRIED if job.fast else 1.0)
        drawing = trace(sheet, job.hand, rng, job.kinematics, speed=speed, jitter=job.layout.jitter)
    else:
        from handout.inking.scanned import drawn

        drawing = drawn(sheet, job.hand, job.lent)
    return replace(drawing, about={"program": f"handout {__version__}", "seed": job.seed, **about, **drawing.about})


def pen(given: Mapping[str, Any]) -> Pen:
    """The pen that pictures are drawn with, from `picture_options`."""
    from handout.inking.pen import usual

    width, name = given["pen_width"], given["pen"] or "ballpoint"
    if name not in PENS and (name.endswith(".hand") or _is_scanned(name)):
        return usual("ballpoint")  # never drawn with
    if name not in PENS:
        raise InputError(f"pen: {name!r} is not one of {', '.join(PENS)}.")
    return usual(name, None if width is None else units.length(width, "pen width"), given["ink"])


def _is_scanned(name: str) -> bool:
    from handout.hand.library import scanned

    return name in scanned()


def paper(given: Mapping[str, Any]) -> Paper:
    """The paper that pictures show, from `picture_options`: a name, a name and the pitch of its lines, or a file."""
    from handout.inking.papers import PAPERS, Paper

    name, colon, pitch = given["paper"].partition(":")
    if colon and name in ("ruled", "squared"):
        return Paper(name, units.length(pitch, "distance of the paper's lines"))
    if given["paper"] not in PAPERS and not Path(given["paper"]).is_file():
        raise InputError(f"paper: {given['paper']!r} is neither a picture nor one of {', '.join(PAPERS)}.")
    return Paper(given["paper"])


def look(given: Mapping[str, Any]) -> dict[str, Any]:
    """How pictures look, from `picture_options`: what `write_drawings` takes besides pages and paths.

    Raises
    ------
    InputError
        A pen, a colour or a paper that there is not, or both a paper and --transparent.
    """
    found = paper(given)
    if given["transparent"] and found.name != "none":
        raise InputError("--transparent leaves the paper out and --paper puts it in: give one of them.")
    return {"pen": pen(given), "dpi": given["dpi"], "paper": found, "transparent": given["transparent"]}
