"""Pages through a calibration: which one, what is said of it, and what is sent."""

import json
import shutil
from datetime import timedelta

import numpy as np
import pytest

from handout.calibrating import calibrated_ink, store
from handout.colour import conversions
from handout.colour.models.forward import look_up
from handout.errors import InputError
from handout.values import Raster

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow


def aged(calibration, days, paper=None):
    """The same calibration as if it were made so many days ago, on another paper."""
    path = calibration.folder / "about.json"
    about = json.loads(path.read_text())
    about["made"] = (calibration.date - timedelta(days=days)).isoformat()
    about["paper"] = paper or about["paper"]
    path.write_text(json.dumps(about))
    return store.load(calibration.folder)


def page(rgba):
    return Raster(np.array(rgba, dtype=np.float32), 300)


def test_what_is_sent_prints_as_the_ink_should_look(stored):
    rgb = np.random.default_rng(0).uniform(0.35, 0.6, (8, 8, 3))
    rgba = np.concatenate([rgb, np.full((8, 8, 1), 0.8)], axis=2)
    rgba[:, :3] = 0
    sent = calibrated_ink.CalibratedInk(stored)(page(rgba)).rgba / 255
    table = stored.table()
    assert not sent[:, :3].any()  # paper stays paper
    plain, ink = rgba[:, 3:].reshape(-1, 4), sent[:, 3:].reshape(-1, 4)
    wanted = table.paper * (1 - plain[:, 3:]) + plain[:, 3:] * plain[:, :3]
    printed = look_up(table.scanned, 1 - ink[:, 3:] * (1 - ink[:, :3]))
    as_it_was = look_up(table.scanned, 1 - plain[:, 3:] * (1 - plain[:, :3]))
    lost, before = (conversions.delta_e(conversions.lab(one), conversions.lab(wanted)) for one in (printed, as_it_was))
    assert lost.mean() < 0.3 and before.mean() > 3


def test_ink_out_of_reach_is_counted(stored):
    rgba = np.zeros((10, 10, 4))
    rgba[:5] = (0.5, 0.5, 0.5, 1.0)
    rgba[5:8] = (0.0, 0.0, 0.6, 1.0)
    made = calibrated_ink.CalibratedInk(stored)
    made(page(rgba))
    facts = made.facts()
    assert facts["out_of_reach"] == pytest.approx(0.375) and facts["lost"] > 5
    assert made.tell_reach().startswith(
        f"calibration simulated/white of {stored.date:%Y-%m-%d} (made today). This printer cannot print 38% of the ink"
    )


def test_a_blank_page_says_nothing_of_reach(stored):
    made = calibrated_ink.CalibratedInk(stored)
    assert not made(page(np.zeros((4, 4, 4)))).rgba.any()
    assert "reach" not in made.tell_reach()


def test_the_newest_of_a_paper_is_used(stored, built):
    old = aged(stored, 400)
    found, doubts = calibrated_ink.choose("printer-simulated")
    assert found == old and len(doubts) == 1 and "400 days old" in doubts[0]
    new = store.add(built)
    assert calibrated_ink.choose("sim") == (new, [])
    assert store.add(built).folder == new.folder, "one that is stored is not stored twice"
    cream = aged(store.add(built), 0, "cream")
    assert [one.folder for one in store.list_stored()] and calibrated_ink.choose("sim", "cream")[
        0
    ].folder == cream.folder
    assert calibrated_ink.choose("sim", asked="simulated/white")[0].paper == "white"


def test_another_paper_and_another_printer_are_doubted(stored):
    _, doubts = calibrated_ink.choose("sim", "recycled")
    assert len(doubts) == 1 and "made on white, and recycled is in the printer" in doubts[0]
    _, doubts = calibrated_ink.choose("epson", asked="simulated/white")
    assert "is of simulated, and this is epson" in doubts[0]


def test_a_table_as_a_file(stored, tmp_path):
    path = tmp_path / "mine.npz"
    shutil.copy(stored.table_file, path)
    found, _ = calibrated_ink.choose("sim", asked=str(path))
    assert found.folder is None and found.paper == "white" and found.date == stored.date
    with pytest.raises(InputError, match="a table by itself"):
        found.keep(store.STRIP, {})


def test_none_and_what_is_not_there(stored):
    assert calibrated_ink.choose("sim", asked="none") == (None, [])
    assert calibrated_ink.choose("epson") == (None, [])
    for asked in ("nothing", "no.npz"):
        with pytest.raises(InputError, match="neither a file, nor none"):
            calibrated_ink.choose("sim", asked=asked)
    with pytest.raises(
        InputError, match="no calibration for simulated/blue; there are calibrations for simulated/white"
    ):
        calibrated_ink.choose("sim", asked="sim/blue")


def test_folders_that_are_no_calibration_are_passed_over(stored):
    shutil.copytree(stored.folder, stored.folder.parent / ".new-left")
    other = stored.folder.parent / "2020-01-01T000000"
    other.mkdir()
    (other / "about.json").write_text("{")
    assert store.list_stored() == [stored]


def test_a_build_that_fails_leaves_nothing(patches, tmp_path):
    with pytest.raises(InputError, match="no method"):
        store.build(tmp_path / "new" / "one", patches, "sim", "white", method="magic")
    assert not (tmp_path / "new").exists() or not any((tmp_path / "new").iterdir())


@pytest.mark.parametrize(("name", "key"), [
    ("printer-epson", "epson"), ("ipp://192.168.1.7/ipp/print", "ipp-192.168.1.7-ipp-print"), ("sim", "simulated"),
    ("mine/printer-x.toml", "x"), ("Büro 2", "b-ro-2"),
])  # fmt: skip
def test_names(name, key):
    assert store.key(name) == key


def test_a_name_of_nothing():
    with pytest.raises(InputError, match="letters and digits"):
        store.key("…")
