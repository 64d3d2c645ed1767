"""Weak and wrong prints: the cause that is named, and healthy printers that are not accused."""

from datetime import datetime
from types import SimpleNamespace

import numpy as np
import pytest

from handout.calibrating import store
from handout.calibrating.print_diagnosis import check_change, check_strength, diagnose, solids_of, without_tone
from handout.calibrating.store import PATCHES, Calibration
from handout.colour.chart import chart
from handout.colour.reading import ChartReading, ScanFinding
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import PAPERS, Inkjet
from handout_lab.offset_press import Measured

DEVICE = chart("A4").colours
CAUSES = {
    "weak-cyan": "weak-ink", "weak-magenta": "weak-ink", "weak-yellow": "weak-ink", "no-black": "no-black",
    "draft": "weak-inks", "ink-limit": "ink-limit", "managed": "managed",
}  # fmt: skip


def seen(press, flatbed=None):
    shown = (flatbed or Flatbed.ideal()).see(press.reflectance(DEVICE))
    return shown + np.random.default_rng(0).normal(size=shown.shape) * 0.3 / 255


def solids(*faults, paper="white", **flatbed):
    return solids_of(DEVICE, seen(Inkjet(paper, faults=faults), Flatbed(**flatbed)))


@pytest.mark.parametrize("paper", PAPERS)
@pytest.mark.parametrize("fault", CAUSES)
def test_the_cause_is_named(paper, fault):
    found = check_strength(solids(fault, paper=paper))
    assert found.code == CAUSES[fault] and found.severity == "refuse" and "--accept" in found.sentence
    if fault.startswith("weak-"):
        assert found.sentence.startswith(f"The {fault.removeprefix('weak-')} is weaker")


@pytest.mark.parametrize("paper", PAPERS)
@pytest.mark.parametrize(("gain", "n"), [(None, 2.0), (0.1, 1.5), (0.22, 3.0)])
@pytest.mark.parametrize("flatbed", [{}, {"srgb": True}, {"crosstalk": 0.0}, {"crosstalk": 0.15}])
def test_healthy_printers_are_not_accused(paper, gain, n, flatbed):
    assert check_strength(solids_of(DEVICE, seen(Inkjet(paper, gain, n), Flatbed(**flatbed)))) is None


def test_a_press_without_black_is_not_accused():
    assert check_strength(solids_of(DEVICE, seen(Measured()))) is None
    assert check_strength(solids_of(DEVICE, seen(Measured(["weak-magenta"])))).code == "weak-ink"


def test_all_inks_are_weak_or_the_scanner_lightens():
    lighter = solids(gamma=2.2 / 0.75)
    found = check_strength(lighter)
    assert found.code == "weak-inks" and "scanner lightens" in found.sentence
    assert check_strength(without_tone(lighter, 0.75)) is None


def test_a_chart_without_a_corner_says_nothing():
    keep = ~(DEVICE == (1, 0, 1)).all(axis=1)
    assert solids_of(DEVICE[keep], np.zeros((int(keep.sum()), 3))) is None


@pytest.mark.parametrize(("fault", "code", "words"), [
    ("weak-cyan", "weaker", "cyan is weaker than on 2 November 2026"),
    ("draft", "weaker", "All inks are weaker than on 2 November 2026"),
    ("wrong-media", "other-tones", "darker than on 2 November 2026"),
])  # fmt: skip
def test_the_printers_earlier_chart_tells_more(fault, code, words):
    found = check_change(solids(fault), solids(), "2 November 2026")
    assert found.code == code and words in found.sentence


def test_the_same_print_scanned_again_has_not_changed():
    assert check_change(solids(), solids(), "today") is None


def test_the_cause_takes_the_place_of_its_effects_and_may_be_accepted():
    shown = seen(Inkjet("white", faults=["no-black"]))
    effect = ScanFinding("tone", "warn", "Middle tones are too light.")
    reading = ChartReading(chart("A4"), DEVICE, shown, np.full(len(DEVICE), 0.001), (effect,))
    refused = diagnose(reading)
    assert [(one.code, one.severity) for one in refused.findings] == [("no-black", "refuse")] and not refused.usable
    assert diagnose(reading, accept=True).usable
    cropped = ScanFinding("cropped", "refuse", "The upper edge is cut off.")
    other = ChartReading(chart("A4"), DEVICE, shown, np.full(len(DEVICE), 0.001), (cropped,))
    assert diagnose(other) is other


@pytest.mark.parametrize(("earlier", "fault", "usable"), [("weak-magenta", "", True), ("", "wrong-media", False)])
def test_a_chart_whose_weak_ink_was_accepted_is_no_measure_for_the_next(earlier, fault, usable, tmp_path, monkeypatch):
    (tmp_path / PATCHES).touch()
    before = Calibration(tmp_path, tmp_path / "table.npz", "sim", "white", datetime(2026, 11, 2))
    then, now = (seen(Inkjet("white", faults=[name] if name else [])) for name in (earlier, fault))
    monkeypatch.setattr(store, "read_patches", lambda _: SimpleNamespace(device=DEVICE, scanned=then))
    reading = ChartReading(chart("A4"), DEVICE, now, np.full(len(DEVICE), 0.001), ())
    assert diagnose(reading, before=before).usable == usable
