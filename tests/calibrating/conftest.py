"""One chart printed and scanned by the simulated devices, and one calibration of it, for all tests of the room."""

import shutil
from functools import cache, partial

import msgspec
import numpy as np
import pytest

from handout import profiles
from handout.calibrating import calibrated_ink, pen_reference, store
from handout.calibrating.pages import chart_pages
from handout.calibrating.wizard import CalibrationTask, Step, Wizard
from handout.colour import table
from handout.colour.chart import chart
from handout.colour.models.forward import Patches
from handout.colour.reading import read_scans
from handout.simulated import print_and_scan as loop
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import Inkjet

DPI = 80


_of_hand, _writing, _match = cache(calibrated_ink.of_hand), pen_reference.writing, pen_reference.match
_written = {}  # by the hand's name: no test here keeps a hand of its own
_matched = {}  # by what was compared


@pytest.fixture(autouse=True)
def ink_of_hands(monkeypatch):
    """What is measured of the hands that ship, and compared with them, is so once: it takes a second each time."""

    def writing(hand):
        if hand.name not in _written:
            _written[hand.name] = _writing(hand)
        return _written[hand.name]

    def match(*compared):
        key = tuple(np.asarray(one).tobytes() for one in compared)
        if key not in _matched:
            _matched[key] = _match(*compared)
        return _matched[key]

    monkeypatch.setattr(pen_reference, "match", match)
    monkeypatch.setattr(calibrated_ink, "of_hand", _of_hand)
    monkeypatch.setattr(pen_reference, "writing", writing)


@pytest.fixture(autouse=True)
def own_folders(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture(scope="session")
def profile():
    """The simulated printer, coarser than it is."""
    return msgspec.structs.replace(profiles.find("simulated", "printer"), dpi=300)


@pytest.fixture(scope="session")
def chart_pixels(profile):
    """The one page of the chart as it is sent."""
    return chart_pages(chart("A4"), profile, "simulated/white").pixels[0]()


@pytest.fixture(scope="session")
def sheet(profile, chart_pixels):
    """The chart on white paper."""
    return Inkjet("white").print_page(chart_pixels, profile.dpi, profile.margins)


@pytest.fixture(scope="session")
def picture(sheet):
    """A good scan of it."""
    return Flatbed(shading=0.0).scan(sheet, DPI, np.random.default_rng(3))


@pytest.fixture(scope="session")
def scan(picture, tmp_path_factory):
    """The same as a file."""
    path = tmp_path_factory.mktemp("chart") / "scan.tif"
    loop.write(picture, DPI, path)
    return path


@pytest.fixture(scope="session")
def patches(scan):
    """What the chart shows."""
    reading = read_scans([scan])
    assert reading.usable, reading.findings
    return Patches(reading.device, reading.scanned, reading.deviation)


@pytest.fixture(scope="session")
def built(patches, tmp_path_factory):
    """A calibration that is not stored, whose table is coarser than usual, and sooner built."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(table, "build", partial(table.build, size=33))
        return store.build(tmp_path_factory.mktemp("built") / "one", patches, "simulated", "white", "flatbed")


@pytest.fixture
def stored(built, own_folders):
    """The same among the user's own."""
    return store.add(built)


@pytest.fixture
def wizard(profile):
    """A wizard whose chart was printed."""
    made = Wizard(CalibrationTask(profile, "sim", "white"))
    made.go(Step.SCAN)
    return made


@pytest.fixture
def with_table(wizard, scan, built):
    """A wizard that has a table."""
    wizard.take_scans([scan])
    shutil.copytree(built.folder, wizard.built)
    wizard.go(Step.STRIP)
    return wizard
