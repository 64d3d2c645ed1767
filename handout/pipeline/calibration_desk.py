"""One calibration as the studio's page attends to it: the wizard's steps one at a time, and what each shows.

Nothing is kept here: what was done lies with the wizard, so that it can be gone on with in the browser, at the terminal
(`pipeline.calibrating.calibrate`), and after either was killed.  Files and pictures are written into the folder of the
place.
"""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.calibrating import store, verification
from handout.calibrating.pen_reference import FrameReference
from handout.calibrating.store import Calibration
from handout.calibrating.wizard import ScansRefused, Step, Wizard
from handout.colour.ink_match import strokes_in
from handout.colour.reading import ChartReading, ScanFinding, Scribble, open_scans
from handout.colour.reading.patch_means import sample_grid
from handout.colour.reading.scan_files import ScanRefused
from handout.colour.report import grid_on
from handout.errors import InputError
from handout.libraries import cv2
from handout.pipeline import calibrating
from handout.pipeline.devices import list_devices
from handout.pipeline.options import CalibrationPlace
from handout.pipeline.results import SILENT, Facts, Listener
from handout.printing import printers
from handout.printing.printers import queues
from handout.values import Array

_LONG = 1400  # pixels, long side of the picture of a scan
_QUALITY = 85  # of pictures as JPEG, set by eye
_MOST_PICTURES = 4
_CORNERS = ((0, 0, 1, 1), (0, 1, 1, 0))  # of a patch, in their order around it


class StaleCalibration(InputError):
    """The calibration was gone on with elsewhere since it was looked at."""


def calibrations() -> Facts:
    """What is calibrated, the newest first, and what can be: printers, queues; papers and faults of the simulated."""
    from handout.simulated.printer import FLAWS, PAPERS

    known = [device for device in list_devices() if device.kind == "printer"]
    named: list[Facts] = [{"name": one.name.removeprefix("printer-"), "title": one.title} for one in known]
    with contextlib.suppress(InputError, OSError):
        named += [{"name": name, "title": f"queue {name}"} for name in queues()]
    return {
        "printers": named,
        "simulated": {"papers": list(PAPERS), "faults": FLAWS},
        "stored": [_calibration_facts(calibration) for calibration in store.list_stored()],
    }


def check_printer(name: str) -> None:
    """Raise InputError if a printer is not known here, or cannot be named in a page's address."""
    if not name.replace("-", "").replace("_", "").isalnum():
        raise InputError(f"{name}: on the page a printer is called by its name, not by a file or an address.")
    printers.resolve(name)


def _calibration_facts(calibration: Calibration) -> Facts:
    facts = {name: value for name, value in calibration.facts().items() if name not in ("folder", "verification")}
    verified = calibration.load_kept(store.VERIFICATION)
    return {
        **facts, "verified": None if verified is None else _figures(verified), "shades": _shades(calibration),
        "report": calibration.report is not None,
    }  # fmt: skip


def _shades(calibration: Calibration) -> list[Any]:
    """The colours of its strip, in words that a page understands."""
    return [[name, *([_hex(colour) for colour in row] for row in rows)]
            for name, rows in verification.kept_shades(calibration)]  # fmt: skip


def _figures(verified: Facts) -> Facts:
    names = ("before", "after", "ink_before", "ink_after", "grey_before", "grey_after", "verdict", "findings", "date")
    return {**{name: verified[name] for name in names}, "lines": verification.table_lines(verified)[-1:]}


def _hex(colour: Array) -> str:
    return "#" + bytes(np.rint(np.clip(colour, 0, 1) * 255).astype(np.uint8).tolist()).hex()


def open_calibration(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """What comes next of a calibration, which is begun, or gone on with.

    Raises InputError: no such printer or hand, or a chart that does not fit the printer.
    """
    return _state(_wizard(place))


def _wizard(place: CalibrationPlace) -> Wizard:
    wizard = calibrating.begin(place, printers.resolve(place.printer))
    if place.step and place.step != wizard.step:
        raise StaleCalibration(f"This calibration was gone on with elsewhere: what comes next is to {wizard.step}.")
    return wizard


def _state(wizard: Wizard) -> Facts:
    state, profile = wizard.state, wizard.task.profile
    steps = [str(step) for step in Step]
    return {
        "name": wizard.name,
        "step": str(wizard.step),
        "number": steps.index(wizard.step) + 1,
        "steps": list(steps[:-1]),
        "request": wizard.request,
        "resumed": wizard.resumed,
        "begun": state.begun,
        "pages": state.pages,
        "sheet": state.sheet,
        "kept": len(state.scans),
        "simulated": profile.simulated,
        "writes_files": profile.file and not profile.simulated,
        "report": wizard.report.is_file(),
    }


def print_page(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """Print the chart or the strip, whichever comes next, or write it as PDF into the folder.

    Raises InputError, PrinterError: as `Wizard.print_page`.
    """
    return _print_page(_wizard(place), place, place.to_printer)


def _print_page(wizard: Wizard, place: CalibrationPlace, to_printer: bool) -> Facts:
    output = place.folder / f"{'strip' if wizard.step is Step.STRIP else 'chart'}.pdf"
    simulated = wizard.task.profile.simulated
    files = wizard.print_page(None if to_printer or simulated else output)
    if simulated:
        shutil.copy2(files[0], output)
    return {**_state(wizard), "files": [str(output)] if output.is_file() else []}


def print_page_again(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """The PDF of what is to be scanned now, once more."""
    wizard = _wizard(place)
    wizard.check("Nothing is to be scanned", Step.SCAN, Step.VERIFY)
    wizard.go(Step.PRINT if wizard.step is Step.SCAN else Step.STRIP)
    return _print_page(wizard, place, to_printer=False)


def take_scans(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """Take scans of the chart or the strip, whichever is waited for; what is refused is told, and changes nothing.

    Where no scans are given, the page is scanned through SANE, and that of a simulated printer by its simulated
    scanner, with `options.faults`.

    Raises InputError: nothing is to be scanned now; a file that is no picture.
    """
    wizard, scans = _wizard(place), place.scans
    wizard.check("Nothing is to be scanned", Step.SCAN, Step.VERIFY)
    if not scans:
        listener.progress(0.0, "scanning")
        loop = calibrating.simulated_loop(place, wizard.task.profile)
        scans = tuple(calibrating.scan_page(wizard, place.options.scanner or "", loop))
    listener.progress(0.3, "reading the scan")
    return (_chart_scans if wizard.step is Step.SCAN else _strip_scans)(wizard, scans, place.folder)


def _chart_scans(wizard: Wizard, scans: Sequence[Path], folder: Path) -> Facts:
    said, reference = "", None
    try:
        taken = wizard.take_scans(scans)
        accepted, said, reference = True, taken.missing, taken.reference
    except ScansRefused:
        accepted = False
    reading = wizard.seen
    assert reading is not None
    pictures, files = _pictures(reading, scans, folder)
    pen = None if reading.scribble is None else _pen(reading.scribble, reference, folder)
    return {
        **_state(wizard), "accepted": accepted, "said": said, "findings": list(map(_finding_facts, reading.findings)),
        "pictures": pictures, "pen": pen, "files": [str(path) for path in (*files, *folder.glob("pen.png"))],
    }  # fmt: skip


def _finding_facts(finding: ScanFinding) -> Facts:
    """A finding without the folder of its scan."""
    where = Path(finding.where).name
    return {"code": finding.code, "severity": finding.severity, "sentence": finding.sentence, "where": where}


def _pictures(reading: ChartReading, scans: Sequence[Path], folder: Path) -> tuple[list[Facts], list[Path]]:
    """Scans with the grid that was found, and where their faults lie; those without a grid as they are."""
    pictures, files = list[Facts](), list[Path]()
    for sheet in reading.sheets[-_MOST_PICTURES:]:
        names, marks = {name: k for k, name in enumerate(sheet.page.names)}, sheet.page.marks
        files.append(_jpeg(drawn := grid_on(sheet, _LONG), folder / f"found-{len(files)}.jpg"))
        high, wide = sheet.scan.pixels.shape[:2]
        boxes = sample_grid(sheet.placement, np.array([0.0, 1.0]))[:, *_CORNERS] / (wide, high)
        faults = [
            {"code": one.code, "severity": one.severity, "at": boxes[names[name]].round(4).tolist()}
            for one in reading.findings
            if one.patches and one.where in ("", sheet.scan.source)
            for name in one.patches
            if name in names
        ]
        lost = np.setdiff1d(np.arange(len(marks)), sheet.placement.mark_indices)
        unread = [(sheet.placement.pixels(marks[k]) / (wide, high)).round(4).tolist() for k in lost]
        facts: Facts = {
            "label": sheet.page.label, "dpi": round(sheet.placement.dpi), "used": int(np.sum(sheet.used)),
            "patches": len(sheet.used), "marks": len(sheet.placement.mark_indices), "faults": faults, "unread": unread,
            "width": drawn.shape[1], "height": drawn.shape[0],
        }  # fmt: skip
        pictures.append(facts)
    if pictures:
        return pictures, files
    for path in scans[:_MOST_PICTURES]:
        with contextlib.suppress(ScanRefused):
            for scan in open_scans(path)[:1]:
                pixels = scan.pixels if scan.full == 255 else (scan.pixels >> 8).astype(np.uint8)
                scale = min(1.0, _LONG / max(pixels.shape[:2]))
                smaller = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
                plain = np.asarray(smaller, dtype=np.uint8)
                files.append(_jpeg(plain, folder / f"found-{len(files)}.jpg"))
                pictures.append({"label": "", "width": plain.shape[1], "height": plain.shape[0]})
    return pictures, files


def _jpeg(pixels: NDArray[np.uint8], path: Path) -> Path:
    from PIL import Image

    Image.fromarray(pixels).save(path, quality=_QUALITY)
    return path


def _pen(scribble: Scribble, reference: FrameReference | None, folder: Path) -> Facts:
    """What a pen wrote in the frame: its picture, its colour on its paper, and what it says of the hand."""
    _jpeg(np.rint(np.clip(scribble.picture, 0, 1) * 255).astype(np.uint8), folder / "pen.png")
    lines = strokes_in(scribble.density, scribble.dpi)
    facts: Facts = {"paper": _hex(scribble.paper)}
    if lines is not None:
        core = np.median(lines.rings[1], axis=0)
        facts |= {"colour": _hex(scribble.paper * np.exp(-core)), "length_mm": round(lines.length)}
    return facts if reference is None else {**facts, **reference.facts(), "doubtful": reference.doubtful}


def _strip_scans(wizard: Wizard, scans: Sequence[Path], folder: Path) -> Facts:
    if len(scans) != 1:
        raise InputError("The verification strip is one page: give one scan of it.")
    try:
        verified = wizard.take_strip(scans[0])
    except ScanRefused as error:
        unread = ChartReading(None, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), (error.finding,))
        pictures, files = _pictures(unread, scans, folder)
        refused: Facts = {"accepted": False, "findings": [_finding_facts(error.finding)], "pictures": pictures}
        return {**_state(wizard), **refused, "files": [str(path) for path in files]}
    said = [sentence.removeprefix(f"{scans[0]}: ") for sentence in verified.findings]
    warned = [{"code": "", "severity": "warn", "sentence": sentence, "where": scans[0].name} for sentence in said]
    return {
        **_state(wizard), "accepted": True, "helps": verified.helps, "verified": _figures(verified.facts()),
        "shades": _shades(store.load(wizard.built)), "findings": warned, "pictures": [], "files": [],
    }  # fmt: skip


def build_table(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """Build the table of the scans that were taken.

    Raises InputError: patches that contradict each other: then the chart has to be scanned again.
    """
    wizard = _wizard(place)
    listener.progress(0.0, "building the table")
    built = wizard.build(place.options.method)
    return {**_state(wizard), "misses": None if built.misses is None else round(built.misses, 3)}


def store_calibration(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """Store what was built, verified or not. Raises InputError: nothing was built yet, or it cannot be written."""
    wizard = _wizard(place)
    stored = wizard.store()
    return {**_state(wizard), "stored": _calibration_facts(stored), "said": f"Stored: {stored.describe()}."}


def scan_again(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """Forget the scans of the chart, and what was built of them."""
    wizard = _wizard(place)
    wizard.go_back()
    return _state(wizard)


def give_report(place: CalibrationPlace, *, listener: Listener = SILENT) -> Facts:
    """The report of a stored calibration, by when it was made, or of the one in progress.

    Raises InputError: there is none.
    """
    output = place.folder / "report.html"
    if place.made:
        kept = [
            one.report for one in store.list_stored(place.printer, place.paper) if one.facts()["made"] == place.made
        ]
        path = next((report for report in kept if report is not None), None)
    else:
        path = _wizard(place).report
    if path is None or not path.is_file():
        raise InputError("There is no report of that calibration.")
    shutil.copy2(path, output)
    return {"files": [str(output)]}
