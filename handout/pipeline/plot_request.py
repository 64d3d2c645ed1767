"""What a caller may ask of a plotter."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from handout.pipeline.declarations import (
    ENVELOPES,
    FILES,
    HOOKS,
    MACHINE,
    OWN,
    PARTS,
    TABLE,
    Name,
    Number,
    option,
    shared,
)
from handout.pipeline.inputs import Source
from handout.pipeline.options import Length, PictureOptions, SheetOptions, WritingOptions

if TYPE_CHECKING:
    from collections.abc import Callable

    from handout.plotting.jobs.parts import Layers
    from handout.plotting.jobs.places import DrawnPlace
    from handout.plotting.planning.plan import Order


@dataclass(frozen=True)
class HookOptions:
    """What is done besides drawing, instead of the profile's: steps (`handout.hooks`) with ; between them.

    Each None: the profile's; "": nothing.
    """

    dip: str | None = option(
        None,
        HOOKS,
        "Ink for the pen, before it writes and on the way: go X Y; go NAME; down [VALUE]; up; wait TIME; send LINE.",
        metavar="STEPS",
    )
    dip_every: Length | None = option(None, HOOKS, "Ink between two dips at most, e.g. 150mm.", metavar="LENGTH")
    before_page: str | None = option(
        None, HOOKS, "What the machine does before every page, in such steps.", metavar="STEPS"
    )
    after_page: str | None = option(None, HOOKS, "And after it.", metavar="STEPS")
    before_stroke: str | None = option(None, HOOKS, "Before every stroke, with the pen lifted.", metavar="STEPS")
    after_stroke: str | None = option(None, HOOKS, "And after it.", metavar="STEPS")


@dataclass(frozen=True)
class DrawingOptions:
    """What becomes of a drawing that is given for a text."""

    svg_text: str = option(
        "write",
        FILES,
        "Texts of an SVG: write them in the hand, at their places, or leave them out.",
        choices=("write", "leave"),
    )


@dataclass(frozen=True)
class PlotOptions:
    """How something is plotted.

    device : None: a GRBL plotter with a servo, or the simulated one at a simulated port.
    pen_up, pen_down : servo values, or of a Z axis lengths; overlap None: `usual_overlap`.
    hooks : what is done besides drawing.
    """

    device: str | None = shared(None, MACHINE, "The plotter's profile; see: handout devices list.", sent=Name | None)
    order: Order = option(
        "writing",
        MACHINE,
        "Of words; travel moves the strokes of a drawing about in any way.",
        choices=("writing", "travel"),
        sent=Literal["writing", "travel"],
    )
    layers: Layers = option(
        "none",
        MACHINE,
        "Stop for another pen before every layer.",
        choices=("none", "name", "colour"),
        sent=Literal["none", "colour"],
    )
    copies: int = option(1, PARTS, "Of all pages.", least=1, most=1000, sent=Number)
    pause_every: Length | None = option(
        None, MACHINE, "Stop for a look at the pen after so much ink, e.g. 20m.", metavar="LENGTH"
    )
    overlap: Length | None = option(
        None, PARTS, "Ink that may be drawn twice after a break; default: 20mm.", metavar="LENGTH"
    )
    pen_up: str | None = option(
        None, MACHINE, "Lift the pen to this height, not the profile's (pen.up).", metavar="HEIGHT"
    )
    pen_down: str | None = option(
        None, MACHINE, "Lower it to this height, not the profile's (pen.down).", metavar="HEIGHT"
    )
    envelopes_to: tuple[str, ...] = option((), ENVELOPES, "Where these are plotted.", repeated=True, metavar="PORT")
    grid: str = option("", TABLE, "Cards side by side on the bed, 2x3 is two across.", metavar="NxM")
    gap: Length = option("0mm", TABLE, "Between the cards of a grid.")
    hooks: HookOptions = HookOptions()


@dataclass(frozen=True)
class PartOptions:
    """Which part is plotted, as `plotting.jobs.stretch.pieces` takes it; with nothing said, all."""

    begin: str | None = option(
        None, PARTS, "Plot from there on: 40% of the ink, or 2m30s.", flags=("--from",), metavar="PLACE"
    )
    end: str | None = option(None, PARTS, "And no further than there.", flags=("--to",), metavar="PLACE")
    from_word: str | None = option(
        None, PARTS, "Plot from that word on: a word, several, or its number.", metavar="WORD"
    )
    to_word: str | None = option(None, PARTS, "And no further than that word.", metavar="WORD")
    sheets: str = option("", PARTS, "Plot these sheets alone: 2, 2-3, 1,4-.", metavar="NUMBERS")

    def __bool__(self) -> bool:
        return self != PartOptions()


@dataclass(frozen=True)
class AttendanceOptions:
    """What happens at the plotter while a job is drawn.

    reached : told how far the pen has come: the number of the job's part, and the place on it.
    """

    at_zero: bool = option(False, PARTS, "With --resume: the pen stands above the zero, lifted.")
    home_after: bool = option(False, MACHINE, "Back to zero when it ends, after Ctrl-C too.")
    hold_limit: str | None = option(
        None,
        MACHINE,
        "How long the plotter may stand on hold before the plot ends, pen lifted; default: 2min with --yes "
        "or without a terminal, else for ever.",
        metavar="TIME",
    )
    report: str | Path | None = option(None, FILES, "Write how faithful the motion is, as JSON.", kind=Path)
    reached: Callable[[int, DrawnPlace], None] | None = None


@dataclass(frozen=True)
class HeightOptions:
    """Which heights of a pen are tried, and where what is found goes."""

    up: float | None = option(None, OWN, "Try this upper height at once, without questions; with --down.", kind=float)
    down: float | None = option(None, OWN, "Try this lower height: a row is drawn with both.", kind=float)
    save: str | None = option(None, OWN, "Keep what was found as a profile of your own.", metavar="NAME")
    again: bool = option(False, OWN, "With --save: replace a profile of that name.")


@dataclass(frozen=True)
class ExportOptions:
    """Which plotter programs are for, None: a common one that reads such files; hooks : as in `PlotOptions`."""

    device: str | None = shared(None, MACHINE, "The plotter it is for; default: a common one that reads such files.")
    order: Order = option("writing", MACHINE, "Of words.", choices=("writing", "travel"))
    hooks: HookOptions = HookOptions()


@dataclass(frozen=True)
class PlotRequest:
    """What is plotted, which part of it, and how: what is written, in which hand, on which sheet, with which pen."""

    source: Source
    writing: WritingOptions = WritingOptions()
    sheet: SheetOptions = SheetOptions(usual_page="A5")
    picture: PictureOptions = PictureOptions()
    plotting: PlotOptions = PlotOptions()
    part: PartOptions = PartOptions()
