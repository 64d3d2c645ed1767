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
        "Ink for the pen, before it writes and on the way: go X Y; go NAME; down [VALUE]; up; wait TIME; send LINE.",
        HOOKS,
        metavar="STEPS",
    )
    dip_every: Length | None = option(None, "Ink between two dips at most, e.g. 150mm.", HOOKS, metavar="LENGTH")
    before_page: str | None = option(
        None, "What the machine does before every page, in such steps.", HOOKS, metavar="STEPS"
    )
    after_page: str | None = option(None, "And after it.", HOOKS, metavar="STEPS")
    before_stroke: str | None = option(None, "Before every stroke, with the pen lifted.", HOOKS, metavar="STEPS")
    after_stroke: str | None = option(None, "And after it.", HOOKS, metavar="STEPS")


@dataclass(frozen=True)
class DrawingOptions:
    """What becomes of a drawing that is given for a text."""

    svg_text: str = option(
        "write",
        "Texts of an SVG: write them in the hand, at their places, or leave them out.",
        FILES,
        choices=("write", "leave"),
    )


@dataclass(frozen=True)
class PlotOptions:
    """How something is plotted.

    device : None: a GRBL plotter with a servo, or the simulated one at a simulated port.
    pen_up, pen_down : servo values, or of a Z axis lengths; overlap None: `usual_overlap`.
    hooks : what is done besides drawing.
    """

    device: str | None = shared(None, "The plotter's profile; see: handout devices list.", MACHINE, sent=Name | None)
    order: Order = option(
        "writing",
        "Of words; travel moves the strokes of a drawing about in any way.",
        MACHINE,
        choices=("writing", "travel"),
        sent=Literal["writing", "travel"],
    )
    layers: Layers = option(
        "none",
        "Stop for another pen before every layer.",
        MACHINE,
        choices=("none", "name", "colour"),
        sent=Literal["none", "colour"],
    )
    layer: tuple[str, ...] = option(
        (),
        "A layer in its turn, with --layers: its name, and after commas speed=50%, pen=red (layers that share a pen "
        "need no stop), or out. Those that are not named come behind.",
        MACHINE,
        metavar="LAYER",
    )
    copies: int = option(1, "Of all pages.", PARTS, least=1, most=1000, sent=Number)
    pause_every: Length | None = option(
        None, "Stop for a look at the pen after so much ink, e.g. 20m.", MACHINE, metavar="LENGTH"
    )
    overlap: Length | None = option(
        None, "Ink that may be drawn twice after a break; default: 20mm.", PARTS, metavar="LENGTH"
    )
    pen_up: str | None = option(
        None, "Lift the pen to this height, not the profile's (pen.up).", MACHINE, metavar="HEIGHT"
    )
    pen_down: str | None = option(
        None, "Lower it to this height, not the profile's (pen.down).", MACHINE, metavar="HEIGHT"
    )
    envelopes_to: tuple[str, ...] = option((), "Where these are plotted.", ENVELOPES, metavar="PORT")
    grid: str = option("", "Cards side by side on the bed, 2x3 is two across.", TABLE, metavar="NxM")
    gap: Length = option("0mm", "Between the cards of a grid.", TABLE)
    hooks: HookOptions = HookOptions()


@dataclass(frozen=True)
class PartOptions:
    """Which part is plotted, as `plotting.jobs.parts.pieces` takes it; with nothing said, all."""

    begin: str | None = option(
        None, "Plot from there on: 40% of the ink, or 2m30s.", PARTS, flags=("--from",), metavar="PLACE"
    )
    end: str | None = option(None, "And no further than there.", PARTS, flags=("--to",), metavar="PLACE")
    from_word: str | None = option(
        None, "Plot from that word on: a word, several, or its number.", PARTS, metavar="WORD"
    )
    to_word: str | None = option(None, "And no further than that word.", PARTS, metavar="WORD")
    sheets: str = option("", "Plot these sheets alone: 2, 2-3, 1,4-.", PARTS, metavar="NUMBERS")

    def __bool__(self) -> bool:
        return self != PartOptions()


@dataclass(frozen=True)
class AttendanceOptions:
    """What happens at the plotter while a job is drawn.

    reached : told how far the pen has come: the number of the job's part, and the place on it.
    """

    at_zero: bool = option(False, "With --resume: the pen stands above the zero, lifted.", PARTS)
    home_after: bool = option(False, "Back to zero when it ends, after Ctrl-C too.", MACHINE)
    hold_limit: str | None = option(
        None,
        "How long the plotter may stand on hold before the plot ends, pen lifted; default: 2min with --yes "
        "or without a terminal, else for ever.",
        MACHINE,
        metavar="TIME",
    )
    report: str | Path | None = option(None, "Write how faithful the motion is, as JSON.", FILES)
    reached: Callable[[int, DrawnPlace], None] | None = None


@dataclass(frozen=True)
class HeightOptions:
    """Which heights of a pen are tried, and where what is found goes."""

    up: float | None = option(None, "Try this upper height at once, without questions; with --down.")
    down: float | None = option(None, "Try this lower height: a row is drawn with both.")
    save: str | None = option(None, "Keep what was found as a profile of your own.", metavar="NAME")
    again: bool = option(False, "With --save: replace a profile of that name.")


@dataclass(frozen=True)
class ExportOptions:
    """Which plotter programs are for, None: a common one that reads such files; hooks : as in `PlotOptions`."""

    device: str | None = shared(None, "The plotter it is for; default: a common one that reads such files.", MACHINE)
    order: Order = option("writing", "Of words.", MACHINE, choices=("writing", "travel"))
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
