"""What a caller may ask of a plotter, and who stands at it while it draws."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from handout.pipeline.inputs import Source
from handout.pipeline.options import HookOptions, Length, PictureOptions, SheetOptions, WritingOptions

if TYPE_CHECKING:
    from collections.abc import Callable

    from handout.errors import DeviceError
    from handout.plotting.driving.driver import Progress
    from handout.plotting.jobs.parts import Layers
    from handout.plotting.jobs.places import Place
    from handout.plotting.planning.plan import Order


@dataclass(frozen=True)
class PlotOptions:
    """How something is plotted.

    device : the plotter's profile; None: a GRBL plotter with a servo, or the simulated one at a simulated port.
    order : "writing", or "travel": shorter ways, by moving words, or the strokes of a drawing in any way.
    layers : what makes a layer, for which another pen is put in: "none", "name" or "colour".
    copies : of all pages; pause_every : ink after which a pen is looked at, or None.
    overlap : ink that may be drawn twice after a break; None: `usual_overlap`.
    pen_up, pen_down : heights of the pen instead of the profile's: servo values, or of a Z axis lengths.
    envelopes_to : ports at which the envelopes of a table are plotted, if not where its letters are.
    grid, gap : of the pages of a table, how many lie side by side on the bed, "2x3" is two across, and how far apart.
    hooks : what is done besides drawing.
    """

    device: str | None = None
    order: Order = "writing"
    layers: Layers = "none"
    copies: int = 1
    pause_every: Length | None = None
    overlap: Length | None = None
    pen_up: str | None = None
    pen_down: str | None = None
    envelopes_to: tuple[str, ...] = ()
    grid: str = ""
    gap: Length = 0.0
    hooks: HookOptions = field(default_factory=HookOptions)


@dataclass(frozen=True)
class PartOptions:
    """Which part is plotted, as `plotting.jobs.stretch.pieces` takes it; with nothing said, all."""

    begin: str | None = None
    end: str | None = None
    from_word: str | None = None
    to_word: str | None = None
    sheets: str = ""

    def __bool__(self) -> bool:
        return self != PartOptions()


@dataclass(frozen=True)
class PlotRequest:
    """What is plotted, which part of it, and how: what is written, in which hand, on which sheet, with which pen."""

    source: Source
    writing: WritingOptions = WritingOptions()
    sheet: SheetOptions = SheetOptions(usual_page="A5")
    picture: PictureOptions = PictureOptions()
    plotting: PlotOptions = PlotOptions()
    part: PartOptions = PartOptions()


@dataclass(frozen=True)
class AttendanceOptions:
    """What happens at the plotter while a job is drawn.

    at_zero : the pen of a job that is resumed stands above the machine's zero, lifted.
    home_after : back to zero after an interrupt too.
    hold_limit : how long the plotter may stand on hold before the plot ends, its pen lifted; None: 2 minutes where
        nobody is there to be asked, else for ever.
    report : a file that is told how faithful the motion is, as JSON.
    reached : told how far the pen has come: the number of the job's part, and the place on it.
    """

    at_zero: bool = False
    home_after: bool = False
    hold_limit: str | None = None
    report: str | Path | None = None
    reached: Callable[[int, Place], None] | None = None


@dataclass(frozen=True)
class HeightOptions:
    """Which heights are tried, and where what is found goes.

    up, down : heights to try without questions, or neither.
    save : name of a profile of the user's own that gets them; again : whether one of that name is replaced.
    """

    up: float | None = None
    down: float | None = None
    save: str | None = None
    again: bool = False


@dataclass(frozen=True)
class ExportOptions:
    """Which plotter programs are for, None: a common one that reads such files; order, hooks : as in `PlotOptions`."""

    device: str | None = None
    order: Order = "writing"
    hooks: HookOptions = field(default_factory=HookOptions)


class Operator(Protocol):
    """Whoever stands at the plotter: is asked for sheets and pens, and hears how the plot goes."""

    @property
    def watches(self) -> bool:
        """Whether somebody is there, who may hold the plotter for as long as they like."""

    def plotting(self) -> AbstractContextManager[Progress | None]:
        """A block in which a job is drawn: who is told how far it has come, if anybody wants to know."""

    def say(self, sentence: str) -> None:
        """Hear a sentence while the pen draws; never waits."""

    def do(self, request: str) -> None:
        """See `plotting.jobs.runner.Person`, as for the rest."""

    def try_again(self, error: DeviceError) -> bool:
        """See there."""

    def paused(self, pressed: Callable[[], bool]) -> None:
        """See there."""
