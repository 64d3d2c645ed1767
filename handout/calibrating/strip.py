"""The page that verifies a calibration: it has every colour twice, sent as it is and sent through the table.

One scan of it shows what the calibration changes.  The colours are those of ink on this paper that the printer can
reach, shuffled; marks like the chart's tell a reading where they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.calibrating import calibrated_ink, pen_reference, store
from handout.calibrating.calibrated_ink import greys, lay_on, reach_on_paper
from handout.calibrating.pages import DevicePages, fine_enough
from handout.calibrating.store import Calibration
from handout.colour.chart import MARKS, PAPERS, ChartPage, grid_cells
from handout.colour.chart_files import render
from handout.colour.table import ColourTable, Reach, apply
from handout.errors import InputError
from handout.profiles import Printer
from handout.values import Array, Raster, readonly

FIRST_MARK = 112  # the numbers of its marks follow those of the chart's pages
_PITCH, _COLUMNS, _ROWS = 7.0, 24, 11
_TOP = 30.0  # mm from the upper edge to the patches
_WHITES = 8
_GREYS = 32
_REACHED = 1.0  # ΔE00: a colour that loses more is out of the printer's reach, and says nothing about the table
_USUAL = 200  # samples of usual inks
_LEAST = 8  # colours of ink that it takes


@dataclass(frozen=True, eq=False)
class VerificationStrip:
    """A verification strip, n patches of which the last are bare paper.

    wanted : (n, 3) scanned RGB that each patch should show.
    device : (n, 3) device RGB that is sent for it, whole 255ths.
    matched : (n,) bool, whether it was sent through the table.
    grey : (n,) bool, whether it is one of the greys.
    paper : name of the sheet's size.
    out : share of a page's ink that the printer cannot reach; lost : ΔE00 there, on the mean; whose : ink it is.
    """

    wanted: Array
    device: Array
    matched: NDArray[np.bool_]
    grey: NDArray[np.bool_]
    paper: str
    out: float
    lost: float
    whose: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "wanted", readonly(self.wanted, None, 3))
        object.__setattr__(self, "device", readonly(self.device, len(self.wanted), 3))

    @cached_property
    def page(self) -> ChartPage:
        """Where everything is; patches in the order of the arrays."""
        sheet = next((sheet for sheet in PAPERS if sheet.name.lower() == self.paper.lower()), None)
        if sheet is None:
            names = " and ".join(sheet.name for sheet in PAPERS)
            raise InputError(f"The strip is made for {names}, not for {self.paper!r}.")
        free, marks = grid_cells(_COLUMNS, _ROWS)
        order = np.random.default_rng(len(self.wanted)).permutation(len(free))[: len(self.wanted)]
        return ChartPage(
            1, sheet, 1, 1, _PITCH, ((sheet.width - _COLUMNS * _PITCH) / 2, _TOP), _COLUMNS, _ROWS, self.device,
            np.array(free)[order], FIRST_MARK + np.arange(MARKS), np.array(marks),
        )  # fmt: skip

    def facts(self) -> dict[str, Any]:
        """Everything, as JSON takes it."""
        return {
            "wanted": self.wanted.round(6).tolist(), "device": np.rint(self.device * 255).astype(int).tolist(),
            "matched": self.matched.tolist(), "grey": self.grey.tolist(), "paper": self.paper, "out": self.out,
            "lost": self.lost, "whose": self.whose,
        }  # fmt: skip


def from_facts(facts: Mapping[str, Any]) -> VerificationStrip:
    """The strip that `VerificationStrip.facts` describes. Raises InputError: it does not describe one."""
    try:
        return VerificationStrip(
            np.array(facts["wanted"]), np.array(facts["device"]) / 255, np.array(facts["matched"], dtype=bool),
            np.array(facts["grey"], dtype=bool), str(facts["paper"]), float(facts["out"]), float(facts["lost"]),
            str(facts.get("whose", "")),
        )  # fmt: skip
    except (KeyError, ValueError, TypeError) as error:
        raise InputError("What is stored of the verification strip cannot be read: print a new strip.") from error


def make(
    table: ColourTable, samples: Array, paper: str = "A4", page: Reach | None = None, whose: str = ""
) -> VerificationStrip:
    """A strip for a table, of samples of ink and of greys.

    page : what of a page's ink the printer reaches, where that is another than the samples'; whose : ink it is.

    Raises InputError: next to none of the ink can be printed.
    """
    white = np.asarray(table.paper, dtype=np.float64)
    cells = len(grid_cells(_COLUMNS, _ROWS)[0])
    reached = reach_on_paper(samples, table)
    room = (cells - _WHITES) // 2 - _GREYS
    ink = _evenly(samples[reached.lost < _REACHED], white, room)
    if len(ink) < _LEAST:
        raise InputError(
            f"The printer reaches only {1 - reached.share_out:.0%} of this ink, too little to verify anything with: "
            "verify with another hand, or with the usual inks."
        )
    shade = greys(2 * _GREYS)
    shade = _evenly(shade[reach_on_paper(shade, table).lost < _REACHED], white, _GREYS)
    rgba = np.concatenate([ink, shade])
    wanted = lay_on(rgba, white)
    grey = np.arange(len(rgba)) >= len(ink)
    bare = np.ones((_WHITES, 3))
    # the function that pages go through takes a raster
    matched = np.asarray(apply(Raster(np.rint(rgba[None] * 255).astype(np.uint8), 300), table).rgba[0]) / 255
    return VerificationStrip(
        np.concatenate([wanted, wanted, np.repeat(white[None], _WHITES, axis=0)]),
        np.concatenate([_lay_on_white(rgba), _lay_on_white(matched), bare]),
        np.repeat([False, True, False], [len(rgba), len(rgba), _WHITES]),
        np.concatenate([grey, grey, np.zeros(_WHITES, dtype=bool)]), paper, (page or reached).share_out,
        (page or reached).mean, whose,
    )  # fmt: skip


def prepare(calibration: Calibration, hand: str = "", paper: str = "A4") -> VerificationStrip:
    """A strip for a calibration, of a hand's own ink or of usual ones; it is remembered with the calibration.

    Raises InputError: no such hand, or an ink of which the printer reaches next to nothing.
    """
    reference = pen_reference.of_calibration(calibration, hand) if hand else None
    samples = (
        calibrated_ink.seen_by_chart(calibrated_ink.of_hand(hand), reference) if hand else calibrated_ink.usual(_USUAL)
    )
    table, whose = calibration.table(), hand or calibrated_ink.USUAL_HAND
    page = None if hand else calibrated_ink.reach_of(whose, table)
    strip = make(table, samples, paper, page, f"of {whose}")
    calibration.keep(store.STRIP, strip.facts())
    return strip


def pages_of(strip: VerificationStrip, calibration: Calibration, profile: Printer) -> DevicePages:
    """The strip as the printer's own pixels."""
    lines = (f"{calibration.name}   calibration of {calibration.date:%Y-%m-%d %H:%M}",)
    dpi, title = fine_enough(profile.dpi), "Verification strip: scan it like the chart, on the same paper"
    draw = partial(render, strip.page, dpi, lines, title)
    return DevicePages(strip.page.paper, [draw], dpi, {"verification": calibration.name})


def last_strip(calibration: Calibration) -> VerificationStrip:
    """The strip that was printed last for a calibration. Raises InputError: none was."""
    facts = calibration.load_kept(store.STRIP)
    if facts is None:
        raise InputError(
            f"No verification strip was printed for {calibration.name} yet: "
            f"handout calibrate verify --printer {calibration.printer} -o strip.pdf"
        )
    return from_facts(facts)


def _lay_on_white(rgba: Array) -> Array:
    """(n, 3) device RGB, whole 255ths, of ink (n, 4) on white, which sends nothing."""
    return np.asarray(np.rint(255 * (1 - rgba[:, 3:] * (1 - rgba[:, :3]))) / 255)


def _evenly(inks: Array, white: Array, count: int) -> Array:
    """At most `count`, from the lightest to the darkest."""
    order = np.argsort(lay_on(inks, white).sum(axis=1), kind="stable")
    if len(order) > count:
        order = order[np.linspace(0, len(order) - 1, count).round().astype(int)]
    return np.asarray(inks[order])
