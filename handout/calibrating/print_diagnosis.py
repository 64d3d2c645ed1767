"""Whether the print of a chart is one to calibrate with: against known printers, and against its own earlier ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from handout.calibrating import store
from handout.calibrating.pen_reference import Reference
from handout.calibrating.store import Calibration
from handout.colour.reading import Finding, Reading
from handout.colour.reading.solid_inks import Solids, of_change, of_strength, solids_of, without_tone

# what is found wrong with the print as a whole; with a cause named, these are its effects
_EFFECTS = ("managed", "ramp", "identical", "tone")


def diagnose(
    reading: Reading, known: Reference | None = None, before: Calibration | None = None, accept: bool = False
) -> Reading:
    """A reading with what is wrong with the print itself, its cause in the place of its effects.

    Parameters
    ----------
    known : what the pen in the chart's frame says of the scanner's settings.
    before : the calibration of this printer on this paper that was made last.
    accept : the user knows, and wants the calibration all the same: nothing is refused for it.
    """
    solids = solids_of(reading.device, reading.scanned)
    others = [one for one in reading.findings if one.severity == "refuse" and one.code not in _EFFECTS]
    if solids is None or others:
        return reading
    found = _cause(solids, known, before)
    if found is None:
        return reading
    effects = [one for one in reading.findings if one.code not in _EFFECTS]
    made = replace(found, severity="warn" if accept else "refuse")
    return replace(reading, findings=(*effects, made))


def _cause(solids: Solids, known: Reference | None, before: Calibration | None) -> Finding | None:
    if known is not None and known.match is not None and not known.match.alike:
        solids = without_tone(solids, float(known.match.tone.powers.mean()))
    if (found := of_strength(solids)) is not None:
        return found
    earlier = None if before is None else _earlier(before)
    if before is None or earlier is None:
        return None
    return of_change(solids, earlier, f"{before.made.day} {before.made:%B %Y}")


def _earlier(before: Calibration) -> Solids | None:
    """What an earlier chart's inks were like; None if that is no measure, as after a weak ink that was accepted."""
    if before.patches_file is None or not before.patches_file.is_file():
        return None
    patches = store.read_patches(before.patches_file)
    solids = solids_of(patches.device, patches.scanned)
    return None if solids is None or of_strength(solids) is not None else solids


def last(printer: str, paper: str, scanner: str) -> Calibration | None:
    """The calibration of a printer on a paper that the same scanner made last; None if there is none."""
    same = [one for one in store.every() if one.printer == store.key(printer) and one.paper == store.key(paper)]
    return next((one for one in same if one.scanner == scanner), None)


def warned(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Those that are no reason to refuse."""
    return tuple(one for one in findings if one.severity == "warn")
