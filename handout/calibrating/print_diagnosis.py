"""Whether the print of a chart is one to calibrate with: against known printers, and against its own earlier ones."""

from __future__ import annotations

from dataclasses import replace

from handout.calibrating import store
from handout.calibrating.pen_reference import FrameReference
from handout.calibrating.store import Calibration
from handout.colour.reading import ChartReading, ScanFinding
from handout.colour.reading.solid_inks import Solids, check_change, check_strength, solids_of, without_tone

# what is found wrong with the print as a whole; with a cause named, these are its effects
_EFFECTS = ("managed", "ramp", "identical", "tone")


def diagnose(
    reading: ChartReading, pen: FrameReference | None = None, before: Calibration | None = None, accept: bool = False
) -> ChartReading:
    """A reading with what is wrong with the print itself, its cause in the place of its effects.

    Parameters
    ----------
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
