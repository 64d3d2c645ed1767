"""What the writing verbs do with their options: the hand and the layout they ask for, and the pages of a text."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from handout import __version__, units
from handout.errors import InputError
from handout.inking.pen import PENS
from handout.progress import Tell, silent

if TYPE_CHECKING:
    import numpy as np

    from handout.cli.lined import Lined
    from handout.hand.scanned import ScannedHand
    from handout.values import Drawing, Hand, Manuscript
    from handout.writing.layout import Layout
    from handout.writing.sheets import Sheet
    from handout.writing.text import Borrowed

_SET = 0.5  # of the work on a text before it is drawn, when its letters are on their pages; measured
_HURRIED = 2.5  # --speed fast, for a file
# what a page in a scanned hand may be wanted as
INK, STROKES = frozenset({"ink"}), frozenset({"strokes"})


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
    slips: float = 0.0  # words in 100 that are begun wrongly
    lent: ScannedHand | None = None  # whose pen a scanned hand is written with, if not its own
    inked: bool = False  # whether the colour of the ink is given, which the strokes of a scanned hand then have
    lined: Lined | None = None  # the lined paper that is written on


def setup(given: Mapping[str, Any], page_name: str, margin: str | None = None, pages: int | None = None) -> Setup:
    """Check the common options; `given` are those of `options.writing_options`."""
    from handout.writing.layout import Layout, page

    hand = _hand(given["hand"], given["haste"])
    sheet = page(page_name)
    spacing, x_height = given["line_spacing"], given["x_height"]
    layout = Layout(
        page=sheet,
        margin=margins(margin, sheet.width, sheet.height),
        x_height=hand.x_height if x_height is None else units.length(x_height, "x-height"),
        line_spacing=units.length(spacing, "line spacing") if spacing else None,
        align=given["align"],
        fit=given["fit"],
        jitter=given["jitter"],
    )
    fast, factor = _speed(given["speed"])
    return Setup(
        hand,
        layout,
        seed(given),
        given["kinematics"],
        factor,
        fast,
        pages,
        given["fallback"],
        given.get("slips", 0.0),
        _lent(given.get("pen"), hand),
        given.get("ink") is not None,
    )


def on_paper(job: Setup, given: Mapping[str, Any]) -> Setup:
    """The job with its lines on those of the paper, and what is said of these."""
    from handout.cli.lined import lined

    found = lined(given, job.layout, job.hand)
    return replace(job, layout=found.layout, lined=found)


def on_sheet(look: dict[str, Any], job: Setup) -> dict[str, Any]:
    """How pictures look, with the paper's lines where they are written on."""
    return look if job.lined is None or job.lined.paper is None else {**look, "paper": job.lined.paper}


def seed(given: Mapping[str, Any]) -> int:
    """The seed that was asked for, or one by chance."""
    found: int = given["seed"] if given["seed"] is not None else secrets.randbelow(10**6)
    if found < 0:
        raise InputError(f"seed: {found} is negative; use 0 or more.")
    return found


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


def _speed(text: str) -> tuple[bool, float]:
    if text in ("human", "fast"):
        return text == "fast", 1.0
    try:
        return False, float(text)
    except ValueError:
        raise InputError(f"speed: {text!r} is neither human, fast, nor a factor such as 1.5.") from None


def compose_and_trace(
    text: str,
    job: Setup,
    layout: Layout | None = None,
    row: int | None = None,
    shown: frozenset[str] = INK,
    tell: Tell = silent,
) -> tuple[list[Manuscript], list[Drawing]]:
    """The pages of a text as manuscripts and as drawings; each `row` of a batch varies in its own way.

    `shown` : what is wanted of a scanned hand, its `INK` or its `STROKES` or both; a drawn one has strokes.
    """
    tell(0.0, "setting the text")
    pages, drawings = composed(text, job, layout, row, shown)
    made = []
    for number in range(1, len(pages) + 1):
        tell(_SET + (1 - _SET) * (number - 1) / len(pages), f"writing {number}/{len(pages)}")
        made.append(next(drawings))
    return pages, made


def composed(
    text: str, job: Setup, layout: Layout | None = None, row: int | None = None, shown: frozenset[str] = STROKES
) -> tuple[list[Manuscript], Iterator[Drawing]]:
    """The same with every drawing made when it is asked for, so that a long text need not be held as strokes."""
    job, made = sheets(text, job, layout, row)
    known = list(made)
    about = {"title": title(text), "pages": len(known)} | ({} if row is None else {"row": row})
    drawings = (
        traced(sheet.manuscript, job, sheet.rng, {**about, "page_number": n}, shown) for n, sheet in enumerate(known, 1)
    )
    return [sheet.manuscript for sheet in known], drawings


def sheets(
    text: str, job: Setup, layout: Layout | None = None, row: int | None = None
) -> tuple[Setup, Iterator[Sheet]]:
    """The pages of a text, each made when it is asked for, and the job with the hand that they are written in."""
    import numpy as np

    from handout.writing.compose import each_page

    rng = np.random.default_rng([job.seed] if row is None else [job.seed, row])
    job, borrowed = _supplied(text, job)
    made = each_page(text, job.hand, layout or job.layout, rng, pages=job.pages, fallback=job.fallback, slips=job.slips)
    borrowed = borrowed if row is None else [{"row": row, **one} for one in borrowed]
    return job, (_borrowing(sheet, borrowed) for sheet in made) if borrowed else made


def _borrowing(sheet: Sheet, borrowed: list[dict[str, Any]]) -> Sheet:
    about = {**sheet.manuscript.about, "borrowed": borrowed}
    return sheet._replace(manuscript=replace(sheet.manuscript, about=about))


def title(text: str) -> str:
    """The beginning of a text, by which its pages are known."""
    return " ".join(text.split())[:60]


def _supplied(text: str, job: Setup) -> tuple[Setup, list[dict[str, Any]]]:
    """The job with a hand that has every letter of a text, as far as it may be supplied; and what was."""
    from handout.values import Hand

    if isinstance(job.hand, Hand):
        return job, _instead(text, job.hand) if job.fallback else []
    hand, told = supplied(text, job.hand, job.fallback, job.seed)
    return replace(job, hand=hand), told


def _instead(text: str, hand: Hand) -> list[dict[str, Any]]:
    """What a drawn hand writes for the characters of a text that it lacks."""
    from handout.writing import text as texts
    from handout.writing.drawn_line_writer import repertoire

    return [_told(one) for one in texts.borrowed(texts.normalise(text), repertoire(hand))]


def _told(one: Borrowed) -> dict[str, Any]:
    """What `--json` prints of a borrowed letter."""
    return {"letter": one.letter, "from": one.source, "own": one.own, "count": len(one.at), "at": list(one.at)}


def supplied(text: str, hand: ScannedHand, fallback: bool, seed: int) -> tuple[ScannedHand, list[dict[str, Any]]]:
    """A scanned hand with every letter of a text, as far as it may be supplied; and what was."""
    from handout.inking.lending import lend

    lent, found = lend(hand, text, fallback=fallback, seed=seed)
    return lent, [_told(one) for one in found]


def traced(
    sheet: Manuscript, job: Setup, rng: np.random.Generator, about: Mapping[str, Any], shown: frozenset[str] = INK
) -> Drawing:
    """A page as timed strokes, or as scanned ink, with what is stored in every output; `shown` as above."""
    from handout.values import Drawing, Hand

    speed = job.speed * (_HURRIED if job.fast else 1.0)
    drawing = Drawing((), sheet.page, {})
    if isinstance(job.hand, Hand) or shown & STROKES:
        from handout.motion.trace import trace

        drawing = _in_ink(trace(sheet, job.hand, rng, job.kinematics, speed=speed, jitter=job.layout.jitter), job)
    if not isinstance(job.hand, Hand) and shown & INK:
        from handout.inking.scanned import drawn

        drawing = replace(drawn(sheet, job.hand, job.lent), strokes=drawing.strokes)
    return replace(drawing, about={"program": f"handout {__version__}", "seed": job.seed, **about, **drawing.about})


def unheeded(job: Setup, given: Mapping[str, Any], pictures: bool) -> list[str]:
    """What is said of options that a scanned hand does not follow; `pictures` : whether its ink itself is shown."""
    from handout.values import Hand

    if isinstance(job.hand, Hand):
        return []
    name = job.hand.name
    notes = [f"--pen-width: lines are as wide as on the pages of {name}."] if given["pen_width"] is not None else []
    if given["ink"] is not None and pictures:
        notes.append(
            f"--ink: the ink of {name} stays as it was scanned in PNG and PDF files; strokes, as in SVG, have that "
            "colour. --pen FILE.hand lends another pen."
        )
    return notes


def _in_ink(drawing: Drawing, job: Setup) -> Drawing:
    """A drawing in the ink that is asked for, where that is not the hand's own."""
    from handout.hand.ink_colours import ink_colours

    if not (job.inked or job.lent):
        return drawing
    # the colour that is given goes with the pen that pictures are drawn with
    colour = ink_colours(job.lent).colours[0] if job.lent and not job.inked else ""
    return replace(drawing, strokes=tuple(replace(stroke, colour=colour) for stroke in drawing.strokes))
