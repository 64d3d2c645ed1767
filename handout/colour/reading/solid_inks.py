"""Whether a printer laid down all of its ink: its strongest colours against each other and against known printers'.

A scanner's gamma multiplies all densities by one number, so that densities are compared with each other: an ink with
the other inks, two inks over each other with each of them alone, black with all.  Where all inks are weak, printer and
scanner cannot be told apart by that, and the sentence says so.

The bounds lie beyond what these printers have, as a scanner sees them: a photo inkjet with pigment inks (Canon
PRO-1000, measured by D. Gray 2020, scanned on an Epson V850), offset on coated and on uncoated paper (FOGRA39L,
FOGRA47L), and a model of a dye inkjet on plain, recycled and photo paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.colour.reading.findings import Finding
from handout.values import Array

INKS = ("cyan", "magenta", "yellow")
_GAMMA = 2.2  # what a scan's numbers are taken for; that of most scanners
_DARKEST = 0.004  # a level of 8 bits: what shows as 0 is no darker for sure
# density of the full inks, each in its own channel, of an inkjet on plain paper; others have all of them by a factor
_USUAL = np.array([0.98, 0.84, 0.66])
_WEAK = 0.75  # of the weaker of the other two: an ink by itself; known printers have 0.9 and more
_WEAK_ALL = 0.8  # of the usual: all inks; known printers have 0.95 and more
_BLACK = 1.08  # of the densest pair of inks: black; known printers have 1.2 and more
_LIMIT = 0.7  # of an ink alone: what it adds to another ink, on the mean; known printers have 0.77 and more
_MIXED = 1.65  # of an ink alone: what it adds to another ink, at most; known printers have 1.2
# what is added to what: an ink, the ink under or over it, and both together
_PAIRS = (("C", "Y", "G"), ("C", "M", "B"), ("M", "Y", "R"), ("M", "C", "B"), ("Y", "M", "R"), ("Y", "C", "G"))
_DENSEST = 2.0  # beyond it a scanner sees nothing but its own noise
_WEAKER = 0.8  # of what the same printer had, against its other inks
_OTHER_TONES = 0.06  # of the scale: middle tones against what they were


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
    def added(self) -> list[float]:
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
    """The same as a scanner shows it whose densities are not multiplied by `power`."""
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
        name: np.minimum(-_GAMMA * np.log10(np.maximum(means[name] / white, _DARKEST)), _DENSEST)
        for name in _CORNERS
        if name not in ("W", "grey")
    }
    light, dark = float(means["W"].mean()), float(means["K"].mean())
    return Solids(named, (float(means["grey"].mean()) - dark) / max(light - dark, 0.05))


def of_strength(solids: Solids) -> Finding | None:
    """What is wrong with the amount of ink, the likeliest cause alone; None if nothing is."""
    added = solids.added
    if max(added) > _MIXED:
        return _finding("managed", _MANAGED)
    within = float(np.mean(added))
    if within < _LIMIT:
        return _finding("ink-limit", _INK_LIMIT.format(share=within))
    if solids.black < _BLACK:
        return _finding("no-black", _NO_BLACK.format(share=solids.black))
    strength = solids.inks / _USUAL
    weakest = int(strength.argmin())
    next_weakest = float(np.delete(strength, weakest).min())
    if strength[weakest] < _WEAK * next_weakest:
        return _finding("weak-ink", _WEAK_INK.format(ink=INKS[weakest], share=strength[weakest] / next_weakest))
    if strength.mean() < _WEAK_ALL:
        return _finding("weak-inks", _WEAK_INKS.format(share=strength.mean()))
    return None


def of_change(now: Solids, before: Solids, when: str) -> Finding | None:
    """What has become weaker since the same printer was calibrated on the same paper; None if nothing has."""
    ratios = now.inks / np.maximum(before.inks, 0.05)
    weakest = int(ratios.argmin())
    others = float(np.delete(ratios, weakest).mean())
    if ratios[weakest] < _WEAKER * others:
        return _finding("weaker", _WEAKER_INK.format(ink=INKS[weakest], when=when, share=ratios[weakest] / others))
    if float(ratios.max()) < _WEAKER:
        return _finding("weaker", _WEAKER_ALL.format(when=when, share=float(ratios.mean())))
    if abs(now.middle - before.middle) > _OTHER_TONES:
        how = "darker" if now.middle < before.middle else "lighter"
        return _finding("other-tones", _TONES.format(how=how, when=when))
    return None


def _finding(code: str, sentence: str) -> Finding:
    return Finding(code, "refuse", sentence)


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
