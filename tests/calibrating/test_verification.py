"""The strip: its colours, its way through print and scan, and scans that are none of it."""

import dataclasses
import shutil

import numpy as np
import pytest
from PIL import Image

from handout.calibrating import calibrated_ink, store, strip, verification
from handout.colour import conversions
from handout.colour.models.forward import look_up
from handout.colour.reading import ChartScan, ScanRefused
from handout.errors import InputError
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import Inkjet

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def prepared(built, tmp_path_factory):
    """A strip for the calibration, and what it is remembered by."""
    folder = tmp_path_factory.mktemp("prepared") / "one"
    shutil.copytree(built.folder, folder)
    calibration = dataclasses.replace(built, folder=folder)
    return strip.prepare(calibration), calibration.load_kept(store.STRIP)


@pytest.fixture
def made(stored, prepared):
    """The strip, remembered by the stored calibration."""
    stored.keep(store.STRIP, prepared[1])
    return prepared[0]


def scanned(made, stored, profile, paper="white", dpi=100, **flatbed):
    pixels = strip.pages_of(made, stored, profile).pixels[0]()
    sheet = Inkjet(paper).print_page(pixels, profile.dpi, profile.margins)
    return ChartScan(Flatbed(shading=0.0, **flatbed).scan(sheet, dpi, np.random.default_rng(1)), (dpi, dpi))


def test_the_strip_is_remembered(made, stored):
    again = strip.last_strip(stored)
    assert np.array_equal(again.device, made.device) and np.array_equal(again.page.cells, made.page.cells)
    assert np.allclose(again.wanted, made.wanted, atol=1e-6)
    assert np.array_equal(again.matched, made.matched) and again.paper == "A4"


def test_every_colour_comes_twice_and_the_model_reaches_it(made, stored):
    assert np.allclose(made.wanted[made.matched], made.wanted[: made.matched.sum()])
    table = stored.table()
    seen = look_up(table.scanned, made.device[made.matched])
    lost = conversions.delta_e(conversions.lab(seen), conversions.lab(made.wanted[made.matched]))
    assert lost.mean() < 0.5
    assert made.grey[made.matched].sum() > 20


def test_the_strip_keeps_to_a_small_sheet_and_marks_of_its_own(made):
    left, top, right, bottom = made.page.bounds
    assert right - left < 180 and bottom - top < 100
    from handout.colour.chart import page_of_marks

    assert all(page_of_marks(number) is None for number in made.page.ids.tolist())


def test_nothing_was_printed(stored):
    with pytest.raises(InputError, match="No verification strip was printed"):
        verification.verify(stored, [])


def test_a_chart_is_no_strip(made, stored, scan):
    with pytest.raises(ScanRefused, match="no scan of a verification strip"):
        verification.verify(stored, [scan])
    assert stored.load_kept(store.VERIFICATION) is None


def test_a_strip_of_other_colours_is_refused(made, stored, profile):
    other = strip.VerificationStrip(made.wanted, made.device[::-1], made.matched, made.grey, made.paper, 0.0, 0.0)
    with pytest.raises(ScanRefused, match="not those of the strip"):
        verification.verify(stored, [scanned(other, stored, profile)])


def test_another_paper_is_said_and_called_poor(made, stored, profile):
    found = verification.verify(stored, [scanned(made, stored, profile, paper="recycled")])
    assert "another paper" in found.findings[0]
    assert found.after.mean > 4 and "sees no difference" not in found.verdict
    assert stored.load_kept(store.VERIFICATION)["verdict"] == found.verdict


def test_the_ink_of_a_hand(stored):
    drawn = calibrated_ink.of_hand("house-print")
    assert len(drawn) > 500
    made = strip.prepare(stored, "house-print", "letter")
    assert made.paper == "letter" and made.page.paper.name == "letter"
    assert 0 <= made.out <= 1


def test_the_paper_of_a_hand():
    name, paper = calibrated_ink.writer_of("house-joined-ballpoint")
    assert name == "house-joined-ballpoint" and len(paper) == 3 and 0.8 < min(paper) <= max(paper) <= 1
    assert calibrated_ink.writer_of("house-print") == calibrated_ink.writer_of("") == ("", None)


def test_ink_on_paper():
    some = np.array([[0.2, 0.1, 0.4, 0.0], [0.2, 0.1, 0.4, 1.0], [0.0, 0.0, 0.0, 0.5]])
    seen = calibrated_ink.lay_on(some, np.array([0.8, 0.9, 1.0]))
    assert np.allclose(seen, [[0.8, 0.9, 1.0], [0.2, 0.1, 0.4], [0.4, 0.45, 0.5]])


def test_two_pictures_are_one_too_many(made, stored, tmp_path):
    path = tmp_path / "white.png"
    Image.new("RGB", (400, 400), "white").save(path)
    with pytest.raises(InputError, match="one page, and 2 were given"):
        verification.verify(stored, [path, path])
    assert store.list_stored()[0].load_kept(store.VERIFICATION) is None
