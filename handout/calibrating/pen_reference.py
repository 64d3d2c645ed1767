"""Compares the pen in the frame of a chart with the pen in the scan of a hand, and says how the hand's ink changes.

A printer's table holds for one scanner with its settings.  How a hand's ink looks under these settings is seen only
where its pen wrote in the frame of the chart.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.calibrating.store import Calibration
from handout.colour.ink_match import InkMatch, density_of, match
from handout.colour.reading import Scribble
from handout.hand.scanned import ScannedHand
from handout.libraries import cv2
from handout.values import Array

_MOST = 2400  # pixels a side of the writing that is looked at
_SURE = 4.0  # ΔE00 by which lines of one pen do not differ of themselves
LEAST_DPI = 180.0  # under which lines of a pen have no core that could be compared
_GAMMA = 2.2  # in which pixels are averaged


class Kind(StrEnum):
    """What is known of a hand's ink in a chart's scan."""

    NOTHING = "nothing written"
    KEPT = "no hand named"
    DRAWN = "drawn hand"
    OTHER_HAND = "another hand"
    OTHER_PEN = "another pen"
    FAINT = "no lines"
    COARSE = "too few dpi"
    ALIKE = "alike"
    CORRECTED = "corrected"


@dataclass(frozen=True, eq=False)
class FrameReference:
    """What the frame of a chart says of a hand.

    kind : in a word; sentence : in full.
    match : what the hand's ink becomes in the chart's scan; None where that is not known, or must not be used.
    """

    kind: Kind
    sentence: str
    match: InkMatch | None = None

    @property
    def doubtful(self) -> bool:
        """Whether something has to be warned of."""
        return self.kind not in (Kind.KEPT, Kind.DRAWN, Kind.ALIKE)

    def as_message(self) -> str:
        """The sentence, marked as a warning if it is one."""
        return f"{'warning: ' if self.doubtful else ''}{self.sentence}"

    def facts(self) -> dict[str, Any]:
        """What ``--json`` prints of it."""
        difference = None if self.match is None else round(self.match.difference, 2)
        return {"kind": str(self.kind), "said": self.sentence, "difference": difference}


def of_calibration(calibration: Calibration, name: str) -> FrameReference:
    """What the frame of a calibration's chart says of the hand `name`; empty: of none.

    Raises InputError: no such hand, or a file of the calibration that cannot be read.
    """
    return compare_scribble(calibration.scribble(), name, calibration.pen_of())


def compare_scribble(scribble: Scribble | None, name: str, writer: str = "") -> FrameReference:
    """What was written in a chart's frame against the hand `name`.

    scribble : what was written there; None: nothing.
    name : of the hand; empty: none.
    writer : the hand whose pen wrote there; empty: nobody said.

    Raises InputError: no such hand.
    """
    from handout.hand.library import find

    hand = find(name) if name else None
    if hand is not None and hand.pages is None:
        sentence = (
            f"The hand {hand.name} is drawn: there is no scan of its ink, and its pen's colour is taken as it stands."
        )
        return FrameReference(Kind.DRAWN, sentence)
    if scribble is None:
        return FrameReference(Kind.NOTHING, _NOTHING)
    if hand is None:
        return FrameReference(Kind.KEPT, _KEPT)
    if writer and writer != hand.name:
        return FrameReference(Kind.OTHER_HAND, _OTHER_HAND.format(writer=writer, hand=hand.name))
    density, paper, dpi = writing(hand)
    common = min(dpi, scribble.dpi)
    if common < LEAST_DPI:
        coarse = "The chart was" if scribble.dpi <= dpi else f"The pages of {hand.name} were"
        return FrameReference(Kind.COARSE, _COARSE.format(what=coarse, dpi=common))
    ink = match(
        at_dpi(density, dpi, common), paper, at_dpi(scribble.density, scribble.dpi, common), scribble.paper, common,
        scribble.contrast,
    )  # fmt: skip
    return _judge_match(ink, hand.name)


_UNKNOWN = (
    "whether the scanner's settings are those of the handwriting's scan cannot be known, and the verification strip "
    "cannot show it, because the same scanner reads it"
)
_AGAIN = "write some words in the frame of the chart with the pen of the handwriting, and scan it again"
_NOTHING = (
    f"Nothing is written in the frame under the patches: {_UNKNOWN}. With other settings ink is off by ΔE00 2 to 10. "
    f"To be sure, {_AGAIN}."
)
_KEPT = (
    "The words in the frame are kept: the ink of a scanned hand is matched with them when it is printed. Name the hand "
    "with --hand to hear how far its scan differs from this one."
)
_OTHER_HAND = (
    "The words in the chart's frame were written with the pen of {writer}, and this hand is {hand}: "
    f"for it {_UNKNOWN}."
)
_OTHER_PEN = (
    "The ink in the chart's frame differs from that of {hand} by more than settings of a scanner explain: it seems to "
    f"be another pen's, and is not used. Thus {_UNKNOWN}: {_AGAIN}."
)
_FAINT = f"No lines that can be compared are in the chart's frame or in the scan of {{hand}}: {_UNKNOWN}; {_AGAIN}."
_COARSE = f"{{what}} scanned at only {{dpi:.0f}} dpi, too few to compare lines of a pen: {_UNKNOWN}. Scan at 300 dpi."
_ALIKE = "The pen in the frame looks as in the scan of {hand} (ΔE00 {off:.1f} on the mean): both were scanned alike."
_CORRECTED = (
    "The chart's scan shows the pen of {hand} {how} than the hand's own scan (ΔE00 {off:.1f} on the mean, L* "
    "{lighter:+.1f}): {why}. The ink is corrected for that; it becomes that of the pen in the "
    "chart's frame."
)


def _judge_match(ink: InkMatch | None, hand: str) -> FrameReference:
    if ink is None:
        return FrameReference(Kind.FAINT, _FAINT.format(hand=hand))
    if not ink.same_ink:
        return FrameReference(Kind.OTHER_PEN, _OTHER_PEN.format(hand=hand))
    if ink.scans_alike:
        return FrameReference(Kind.ALIKE, _ALIKE.format(hand=hand, off=ink.difference), ink)
    how = "lighter" if ink.lighter > 1 else "darker" if ink.lighter < -1 else "in other colours"
    why = "the scanner's settings or the pen's pressure differ"
    if ink.contrast_differs:
        why = "the chart's scan has an S-shaped contrast curve that the hand's has not, as its patches and the pen show"
    elif ink.difference > _SURE:
        why = "the scanner's settings differ"
    sentence = _CORRECTED.format(hand=hand, how=how, off=ink.difference, lighter=ink.lighter, why=why)
    return FrameReference(Kind.CORRECTED, sentence, ink)


def writing(hand: ScannedHand) -> tuple[NDArray[np.float32], Array, float]:
    """Some writing of a hand: (h, w, 3) densities against its paper, (3,) that paper, 0–1, and pixels an inch."""
    page = max(hand.pages, key=lambda scanned_page: scanned_page.texture.shape[0] * scanned_page.texture.shape[1])
    height, width = page.texture.shape
    down, across = (max(0, (side - _MOST) // 2) for side in (height, width))
    part = np.s_[down : down + _MOST, across : across + _MOST]
    rgba = page.texture.rgba[part].astype(np.float32) / 255
    # the bare paper (h, w, 3) behind the page's ink
    whole = cv2.resize(page.paper.astype(np.float32) / 255, page.shape[::-1], interpolation=cv2.INTER_LINEAR)
    x, y = page.texture.corner
    paper = np.asarray(whole[y : y + page.texture.shape[0], x : x + page.texture.shape[1]])[part]
    cover = rgba[..., 3:]
    density = density_of(cover * rgba[..., :3] + (1 - cover) * paper, np.maximum(paper, 1e-3))
    usual = np.median([np.median(scanned_page.paper, axis=(0, 1)) for scanned_page in hand.pages], axis=0) / 255
    return density, np.asarray(usual), page.dpi


def at_dpi(density: NDArray[Any], dpi: float, wanted: float) -> NDArray[np.float32]:
    """Densities (h, w, 3) of a picture at fewer pixels an inch; light is averaged."""
    if wanted >= 0.98 * dpi:
        return np.asarray(density, dtype=np.float32)
    size = (max(1, round(density.shape[1] * wanted / dpi)), max(1, round(density.shape[0] * wanted / dpi)))
    light = cv2.resize(np.exp(-_GAMMA * density), size, interpolation=cv2.INTER_AREA)
    return np.asarray(-np.log(np.maximum(light, 1e-4)) / _GAMMA, dtype=np.float32)
