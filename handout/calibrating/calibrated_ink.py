"""Pages through a calibration on their way to the printer, what is said of it, and samples of ink that it is judged by.

Samples are a hand's own, or what pens usually leave, and greys: (n, 4) float in 0–1, on a transparent sheet: scanned
RGB of the ink, and how much of the paper it covers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from handout.calibrating import store
from handout.calibrating.pen_reference import FrameReference, Kind, of_calibration
from handout.calibrating.store import Calibration
from handout.colour.table import ColourTable, Reach, apply, reach, tell_loss
from handout.errors import InputError
from handout.hand.drawn import Hand
from handout.hand.scanned import ScannedHand
from handout.inking.pen import Pen
from handout.values import Array, Drawing, Raster

USUAL_HAND = "house-joined"  # whose ink is looked at where no hand is named: that of pages without --hand

_TEXT = "the quick brown fox jumps over a lazy dog and thinks it had been a river"
_PAGE = "150x40mm"
_DPI = 150  # a line of a pen has some pixels
_LEAST = 0.05  # cover below which ink is not looked at
_DENSITIES = (0.12, 2.0)  # of a pen's usual ink: hardly seen, to two lines over each other
_MOST = 20_000  # samples: more tell the same


def lay_on(samples: Array, paper: Array) -> Array:
    """(n, 3) what is seen of samples on paper of scanned RGB (3,)."""
    cover = samples[:, 3:]
    return np.asarray(paper * (1 - cover) + cover * samples[:, :3])


def reach_on_paper(samples: Array, table: ColourTable) -> Reach:
    """What of some samples the printer of a table reaches."""
    return reach(np.clip(lay_on(samples, np.asarray(table.paper, dtype=np.float64)), 0, 1), table)


def seen_by_chart(samples: Array, reference: FrameReference | None) -> Array:
    """Samples of a hand's ink as a chart's scan shows that ink, as far as its frame tells; None: of no hand."""
    if reference is None or reference.match is None:
        return samples
    return np.asarray(reference.match.inks(samples), dtype=np.float64)


def of_raster(raster: Raster, most: int = _MOST) -> Array:
    """Samples, evenly over the pixels of a raster that have ink."""
    pixels = raster.rgba.reshape(-1, 4)
    inked = np.flatnonzero(pixels[:, 3] > _LEAST * 255)
    step = max(1, -(-len(inked) // most))
    return np.asarray(pixels[inked[::step]] / 255)


def usual(count: int) -> Array:
    """`count` samples of the program's own pens, from hardly any ink to thick ink.

    Light passes through ink as through a filter (the law of Beer and Lambert).
    """
    from handout.inking.pen import TEXTURED, rgb
    from handout.inking.pen import usual as pen

    each = -(-count // len(TEXTURED))
    density = np.geomspace(*_DENSITIES, each)[:, None]
    light = np.concatenate([np.asarray(rgb(pen(name).colour)) ** density for name in TEXTURED])[:count]
    clear = light.min(axis=1, keepdims=True)
    return np.hstack([(light - clear) / (1 - clear), 1 - clear])


def greys(count: int) -> Array:
    """`count` samples of black ink that covers from little to all of the paper: greys of the paper's own hue."""
    cover = np.linspace(0.04, 1.0, count)[:, None]
    return np.hstack([np.zeros((count, 3)), cover])


def of_hand(name: str, pen: Pen | None = None) -> Array:
    """Samples of the ink of a page in a hand: always the same page, so that its figures are the same everywhere.

    name : of the hand, drawn or scanned.
    pen : of a drawn hand; None: a ballpoint, which pages are drawn with unless another is asked for.

    Raises InputError: no such hand.
    """
    from handout.hand.library import find

    drawing = _write_sample(find(name), np.random.default_rng([0]))
    if drawing.ink is not None:
        return of_raster(drawing.ink(_DPI))
    from handout.inking import pens
    from handout.inking.pen import usual as usual_pen

    return of_raster(pens.ink(drawing, _DPI, pen or usual_pen("ballpoint"), pens.noise({"seed": 0})))


def reach_of(name: str, table: ColourTable, reference: FrameReference | None = None, pen: Pen | None = None) -> Reach:
    """What of the ink of a page in a hand the printer of a table reaches; `reference` and `pen`: see `of_hand`.

    Every figure on ink out of reach is made here.  Raises InputError: no such hand.
    """
    return reach_on_paper(seen_by_chart(of_hand(name, pen), reference), table)


def writer_of(name: str) -> tuple[str, list[float] | None]:
    """What a scanned hand calls itself, and scanned RGB in 0–1 of the paper that it was written on.

    "" and None for a drawn hand, and where no hand is named.

    Raises InputError: no such hand.
    """
    from handout.hand.library import find

    hand = find(name) if name else None
    if hand is None or hand.pages is None:
        return "", None
    paper = np.median([np.median(page.paper, axis=(0, 1)) for page in hand.pages], axis=0) / 255
    return hand.name, paper.tolist()


def _write_sample(hand: Hand | ScannedHand, rng: np.random.Generator) -> Drawing:
    from handout.page_sizes import page
    from handout.writing.compose import compose
    from handout.writing.layout import Layout

    text = "".join(letter for letter in _TEXT if letter == " " or letter in hand.letters)
    layout = Layout(page(_PAGE), (5.0, 5.0, 5.0, 5.0), x_height=hand.x_height, fit=True)
    manuscript = compose(text, hand, layout, rng, pages=1, fallback=True)[0]
    if hand.pages is not None:
        from handout.inking.pen_replacement import ink_drawing

        return ink_drawing(manuscript, hand)
    from handout.motion.trace import trace

    return trace(manuscript, hand, rng)


NONE = "none"
_OLD = 365  # days
_SAMPLED = 1500  # pixels of ink looked at, a page
_PAGES = 8  # pages looked at


def choose(printer: str, paper: str = "", asked: str = "") -> tuple[Calibration | None, list[str]]:
    """The calibration that pages go through, and what has to be said against it.

    paper : what is in the printer; empty: nobody knows.
    asked : "none", a ``printer/paper``, or a file or folder of a calibration; empty: the printer's newest.

    Raises InputError: what was asked for is not there.
    """
    if asked == NONE:
        return None, []
    calibration = _find_calibration(asked) if asked else store.newest(printer, paper) or store.newest(printer)
    return calibration, _collect_doubts(calibration, printer, paper) if calibration is not None else []


def pen_of(calibration: Calibration, hand: str, say: Callable[[str], object]) -> FrameReference:
    """What the frame of a calibration's chart says of a hand; what concerns its pages is said."""
    reference = of_calibration(calibration, hand)
    if reference.kind is not Kind.DRAWN:
        say(f"{'warning: ' if reference.doubtful and reference.kind is not Kind.CORRECTED else ''}{reference.sentence}")
    return reference


def _find_calibration(asked: str) -> Calibration:
    path = Path(asked)
    if path.exists():
        return store.load(path)
    printer, slash, paper = asked.partition("/")
    if path.suffix or not slash:
        raise InputError(
            f"calibration: {asked!r} is neither a file, nor none, nor one of the stored ones, such as epson/plain "
            "(see: handout calibrate show)."
        )
    return store.find_wanted(printer, paper)


def _collect_doubts(calibration: Calibration, printer: str, paper: str) -> list[str]:
    doubts, calibrated = [], calibration.printer
    if calibrated != store.key(printer):
        doubts.append(f"The calibration is of {calibrated}, and this is {store.key(printer)}: colours may be far off.")
    if paper and calibration.paper != store.key(paper):
        loaded = store.key(paper)
        doubts.append(
            f"The calibration was made on {calibration.paper}, and {loaded} is in the printer: colours are off by as "
            f"much as these papers differ. Calibrate it: handout calibrate wizard --printer {calibrated} "
            f"--paper {loaded}"
        )
    if (days := calibration.age()) > _OLD:
        doubts.append(
            f"The calibration is {days} days old; inks and print heads change: verify it (handout calibrate verify "
            f"--printer {calibration.printer}), or make a new one."
        )
    return doubts


@dataclass
class CalibratedInk:
    """Sends the ink of pages through a calibration (an `inking.device_pixels.Calibrate`), and keeps samples of it.

    reference : what the pen in the chart's frame says of the hand; None: nothing is known.
    hand, pen : whose ink is said to be in reach or out of it; an empty hand: that of the pages themselves.
    """

    calibration: Calibration
    reference: FrameReference | None = None
    hand: str = ""
    pen: Pen | None = None
    _seen: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._table = self.calibration.table()

    def __call__(self, raster: Raster) -> Raster:
        """The ink in device RGB; paper stays transparent."""
        if self.reference is not None and self.reference.match is not None:
            raster = self.reference.match.raster(raster)
        if len(self._seen) < _PAGES:
            samples = of_raster(raster, _SAMPLED)
            if len(samples):
                self._seen.append(samples)
        return apply(raster, self._table)

    def facts(self) -> dict[str, object]:
        """What ``--json`` prints: the calibration and what it cannot reach."""
        reach = self._reach
        return {
            "name": self.calibration.name, "made": self.calibration.date.isoformat(timespec="seconds"),
            "age_days": self.calibration.age(), "out_of_reach": round(reach.share_out, 4) if reach else 0.0,
            "lost": round(reach.mean, 2) if reach else 0.0,
            "pen": self.reference.facts() if self.reference is not None else None,
        }  # fmt: skip

    def tell_reach(self) -> str:
        """One sentence about the calibration, and how much of the ink it cannot reach."""
        reach = self._reach
        if reach is None:
            return f"{self.calibration.describe()}."
        whose = f"of {self.hand}" if self.hand else ""
        return f"{self.calibration.describe()}. {tell_loss(reach.share_out, reach.mean, whose)}"

    @cached_property
    def _reach(self) -> Reach | None:
        if self.hand:
            return reach_of(self.hand, self._table, self.reference, self.pen)
        if not self._seen:
            return None
        return reach_on_paper(np.concatenate(self._seen), self._table)
