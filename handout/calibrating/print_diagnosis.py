"""Whether the print of a chart is one to calibrate with: against known printers, and against its own earlier ones.

Whether a printer laid down all of its ink is told by ratios of the densities of its strongest colours.  A scanner's
gamma multiplies all densities by the same number, so only ratios tell something about the printer: of one ink to the
others, of two inks over each other to each alone, of black to all.  Where all inks are weak, the cause may be the
printer or the scanner, and the message names both.

The bounds lie beyond what these printers have, as a scanner sees them: a photo inkjet with pigment inks (Canon
PRO-1000, measured by D. Gray 2020, scanned on an Epson V850), offset on coated and on uncoated paper (FOGRA39L,
FOGRA47L), and a model of a dye inkjet on plain, recycled and photo paper.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handout.calibrating import store
from handout.calibrating.pen_reference import FrameReference
from handout.calibrating.store import Calibration
from handout.colour.reading import ChartReading, ScanFinding
from handout.values import Array

INKS = ("cyan", "magenta", "yellow")
# density of the full inks, each in its own channel, of an inkjet on plain paper; other papers scale all three alike
_USUAL = np.array([0.98, 0.84, 0.66])
# an ink, another ink, and the name of both printed over each other
_PAIRS = (("C", "Y", "G"), ("C", "M", "B"), ("M", "Y", "R"), ("M", "C", "B"), ("Y", "M", "R"), ("Y", "C", "G"))


@dataclass(frozen=True)
class StrengthBounds:
    """Least and greatest ratios of densities; where sound printers stay well inside, the comment says how far."""

    gamma: float = 2.2  # what a scan's numbers are taken for; that of most scanners
    darkest: float = 0.004  # a level of 8 bits: what shows as 0 is no darker for sure
    one_ink: float = 0.75  # an ink against the weaker of the two others; known printers have 0.9 and more
    all_inks: float = 0.8  # the inks against `_USUAL`, on the mean; known printers have 0.95 and more
    black: float = 1.08  # `Solids.black`; known printers have 1.2 and more
    least_added: float = 0.7  # mean of `Solids.added_shares`; known printers have 0.77 and more
    most_added: float = 1.65  # greatest of `Solids.added_shares`; known printers have 1.2
    densest: float = 2.0  # beyond it a scanner sees nothing but its own noise
    of_before: float = 0.8  # an ink against what it was at the last calibration, both against the other inks
    other_tones: float = 0.06  # of the scale, by which the middle tone differs from the last calibration


BOUNDS = StrengthBounds()


@dataclass(frozen=True, eq=False)
class Solids:
    """Densities, −log₁₀ of light against the paper's, of a printer's strongest colours.

    named : of C, M, Y, R, G, B, K, each (3,) in red, green and blue.
    middle : mean of grey 128 between black and paper, 0–1, as scanned.
    """

    named: dict[str, Array]
    middle: float

    @property
    def inks(self) -> Array:
        """(3,) cyan, magenta, yellow, each in its own channel."""
        return np.array([self.named["C"][0], self.named["M"][1], self.named["Y"][2]])

    @property
    def added_shares(self) -> list[float]:
        """What each ink adds in its own channel to each other ink, as a share of what it has alone."""
        d = self.named
        return [
            float((d[both][_OWN[ink]] - d[other][_OWN[ink]]) / max(d[ink][_OWN[ink]], 0.05))
            for ink, other, both in _PAIRS
        ]

    @property
    def black(self) -> float:
        """Density of black as a share of that of the densest pair of inks."""
        return float(self.named["K"].mean() / max(max(self.named[name].mean() for name in "RGB"), 0.05))


_CORNERS = {
    "C": (0, 255, 255), "M": (255, 0, 255), "Y": (255, 255, 0), "R": (255, 0, 0), "G": (0, 255, 0), "B": (0, 0, 255),
    "K": (0, 0, 0), "W": (255, 255, 255), "grey": (128, 128, 128),
}  # fmt: skip
_OWN = {"C": 0, "M": 1, "Y": 2}


def without_tone(solids: Solids, power: float) -> Solids:
    """The solids as a scanner that does not multiply densities by `power` would show them."""
    named = {name: density / power for name, density in solids.named.items()}
    return Solids(named, solids.middle)


def solids_of(device: Array, scanned: Array) -> Solids | None:
    """The strongest colours among device RGB (n, 3) as they were scanned (n, 3); None if one is missing."""
    levels = np.rint(np.asarray(device) * 255).astype(int)
    means = {}
    for name, colour in _CORNERS.items():
        rows = (levels == colour).all(axis=1)
        if not rows.any():
            return None
        means[name] = np.asarray(scanned)[rows].mean(axis=0)
    white = np.maximum(means["W"], 0.05)
    named = {
        name: np.minimum(-BOUNDS.gamma * np.log10(np.maximum(means[name] / white, BOUNDS.darkest)), BOUNDS.densest)
        for name in _CORNERS
        if name not in ("W", "grey")
    }
    light, dark = float(means["W"].mean()), float(means["K"].mean())
    return Solids(named, (float(means["grey"].mean()) - dark) / max(light - dark, 0.05))


def check_strength(solids: Solids) -> ScanFinding | None:
    """The likeliest single fault in the amount of ink; None if there is none."""
    added = solids.added_shares
    if max(added) > BOUNDS.most_added:
        return _finding("managed", _MANAGED)
    within = float(np.mean(added))
    if within < BOUNDS.least_added:
        return _finding("ink-limit", _INK_LIMIT.format(share=within))
    if solids.black < BOUNDS.black:
        return _finding("no-black", _NO_BLACK.format(share=solids.black))
    strength = solids.inks / _USUAL
    weakest = int(strength.argmin())
    next_weakest = float(np.delete(strength, weakest).min())
    if strength[weakest] < BOUNDS.one_ink * next_weakest:
        return _finding("weak-ink", _WEAK_INK.format(ink=INKS[weakest], share=strength[weakest] / next_weakest))
    if strength.mean() < BOUNDS.all_inks:
        return _finding("weak-inks", _WEAK_INKS.format(share=strength.mean()))
    return None


def check_change(now: Solids, before: Solids, when: str) -> ScanFinding | None:
    """What differs from the last calibration of the same printer and paper; None if nothing does."""
    ratios = now.inks / np.maximum(before.inks, 0.05)
    weakest = int(ratios.argmin())
    others = float(np.delete(ratios, weakest).mean())
    if ratios[weakest] < BOUNDS.of_before * others:
        return _finding("weaker", _WEAKER_INK.format(ink=INKS[weakest], when=when, share=ratios[weakest] / others))
    if float(ratios.max()) < BOUNDS.of_before:
        return _finding("weaker", _WEAKER_ALL.format(when=when, share=float(ratios.mean())))
    if abs(now.middle - before.middle) > BOUNDS.other_tones:
        how = "darker" if now.middle < before.middle else "lighter"
        return _finding("other-tones", _TONES.format(how=how, when=when))
    return None


def _finding(code: str, sentence: str) -> ScanFinding:
    return ScanFinding(code, "refuse", sentence)


_ACCEPT = "If the printer is like that, say --accept."
_MANAGED = (
    "Colours that are sent as one ink are printed as mixtures, or one ink is laid down otherwise where it stands alone "
    "than in mixtures: the printer's driver manages colours. Switch colour management and all enhancements off in the "
    f"print dialogue, and print the chart again. {_ACCEPT}"
)
_NO_BLACK = (
    "Black is hardly darker than two inks over each other ({share:.0%} of their density; every printer we know has "
    "120 % and more): the black ink is empty or clogged, or the driver does not use it. Print a nozzle check, clean "
    f"the head, and print the chart again. {_ACCEPT}"
)
_INK_LIMIT = (
    "Where two inks lie over each other there is less of each than where it stands alone ({share:.0%}; every printer "
    "we know has 77 % and more): the driver limits the ink, as for another paper than is loaded. Choose the paper that "
    f"is in the printer, and print the chart again. {_ACCEPT}"
)
_WEAK_INK = (
    "The {ink} is weaker against the other inks than in any printer we know ({share:.0%} of what it should be): print "
    f"a nozzle check, clean the head, and print the chart again. {_ACCEPT}"
)
_WEAK_INKS = (
    "All inks are weaker than in any printer we know ({share:.0%} of the usual): the chart was printed in draft or "
    "economy quality, or the scanner lightens what it scans (gamma, automatic exposure). Print the chart in the "
    f"quality that you will print with, and scan it with the settings of the handwriting's scan. {_ACCEPT}"
)
_WEAKER_INK = (
    "The {ink} is weaker than on {when} against the other inks ({share:.0%} of what it was): print a nozzle check, "
    "clean the head, and print the chart again. If it is to stay like that, say --accept."
)
_WEAKER_ALL = (
    "All inks are weaker than on {when} ({share:.0%} of what they were): the chart was printed in another quality, or "
    "scanned with other settings. Print and scan as then. If it is to stay like that, say --accept."
)
_TONES = (
    "Middle tones are {how} than on {when}, while the full inks are not: the driver was told another paper or quality, "
    "or the scanner's settings are others. Print and scan as then. If it is to stay like that, say --accept."
)


# what is found wrong with the print as a whole; with a cause named, these are its effects
_EFFECTS = ("managed", "ramp", "identical", "tone")


def diagnose(
    reading: ChartReading, pen: FrameReference | None = None, before: Calibration | None = None, accept: bool = False
) -> ChartReading:
    """A reading with what is wrong with the print itself, its cause in the place of its effects.

    pen : what the pen in the chart's frame says of the scanner's settings.
    before : the calibration of this printer on this paper that was made last.
    accept : the user knows, and wants the calibration all the same: nothing is refused for it.
    """
    solids = solids_of(reading.device, reading.scanned)
    others = [finding for finding in reading.findings if finding.severity == "refuse" and finding.code not in _EFFECTS]
    if solids is None or others:
        return reading
    cause = _cause(solids, pen, before)
    if cause is None:
        return reading
    effects = [finding for finding in reading.findings if finding.code not in _EFFECTS]
    finding = replace(cause, severity="warn" if accept else "refuse")
    return replace(reading, findings=(*effects, finding))


def _cause(solids: Solids, pen: FrameReference | None, before: Calibration | None) -> ScanFinding | None:
    if pen is not None and pen.match is not None and not pen.match.scans_alike:
        solids = without_tone(solids, float(pen.match.tone.powers.mean()))
    if (finding := check_strength(solids)) is not None:
        return finding
    if before is None or before.patches_file is None or not before.patches_file.is_file():
        return None
    patches = store.read_patches(before.patches_file)
    earlier = solids_of(patches.device, patches.scanned)
    if earlier is None or check_strength(earlier) is not None:  # no measure, as after a weak ink that was accepted
        return None
    return check_change(solids, earlier, f"{before.date.day} {before.date:%B %Y}")
