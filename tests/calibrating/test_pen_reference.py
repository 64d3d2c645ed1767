"""The pen in the chart's frame: settings of the scanner that differ from those of the hand's scan."""

import numpy as np
import pytest

from handout.calibrating import calibrated_ink, pen_reference, store, strip
from handout.calibrating.pen_reference import Kind
from handout.colour.chart import chart
from handout.colour.reading import ChartScan, Scribble, read_scans
from handout.colour.reading.pen_field import load, save
from handout.errors import InputError
from handout.hand.library import find
from handout.simulated import print_and_scan as loop
from handout.simulated.flatbed import SETTINGS, Flatbed
from handout.simulated.printer import Inkjet
from handout.simulated.spectra import SimulatedSheet
from handout.values import Raster

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow

HAND = "house-joined-ballpoint"
DPI = 300


@pytest.fixture(scope="session")
def scribbles(profile):
    """A line of the hand's own writing, scanned with the settings of the hand's scan, and with another gamma."""
    frame = (1.0, 1.0, 121.0, 11.0)
    bare = np.zeros((round(12 / 25.4 * DPI), round(122 / 25.4 * DPI)), dtype=np.int32)
    sheet = SimulatedSheet(np.zeros((1, 4)), bare, Inkjet("white").spectra, DPI)
    sheet = loop.make_loop(profile, "white", hand=HAND)._write_sheet(sheet, frame)
    found = {}
    for name, settings in {"same": {}, "scanner-gamma": SETTINGS["scanner-gamma"]}.items():
        flatbed = Flatbed(shading=0.0, rotation=0.0, offset=(0.0, 0.0), **settings)
        picture = flatbed.scan(sheet, DPI, np.random.default_rng(4)).astype(np.float32) / 255
        found[name] = Scribble(picture, np.median(picture.reshape(-1, 3), axis=0), DPI)
    return found


@pytest.fixture
def with_pen(stored, scribbles, tmp_path):
    """A calibration whose chart was scanned with another gamma."""
    save(scribbles["scanner-gamma"], tmp_path / "pen.npz")
    stored.keep_scribble(tmp_path / "pen.npz", HAND)
    return stored


def test_settings_that_differ_are_named(scribbles):
    known = pen_reference.compare_scribble(scribbles["scanner-gamma"], HAND)
    assert known.kind is Kind.CORRECTED and known.doubtful and known.facts()["difference"] > 4
    assert "lighter than the hand's own scan" in known.sentence and "the scanner's settings differ" in known.sentence


def test_words_in_the_frame_are_found(sheet, profile):
    words = loop.make_loop(profile, "white", hand=HAND)._write_sheet(sheet, chart("A4").pages[0].scribble_field)
    picture = Flatbed().scan(words, 120, np.random.default_rng(1))
    reading = read_scans([ChartScan(picture, (120, 120))])
    assert reading.findings == () and reading.scribble.density.max() > 0.5
    known = pen_reference.compare_scribble(reading.scribble, HAND)
    assert known.kind is Kind.COARSE and "The chart was scanned at only 120 dpi" in known.sentence


def test_without_words_nothing_is_known_and_that_is_said(patches, scan):
    assert read_scans([scan]).scribble is None
    known = pen_reference.compare_scribble(None, HAND)
    assert known.kind is Kind.NOTHING and known.doubtful and known.match is None
    assert "cannot be known" in known.sentence and "in the frame" in known.sentence


def test_whose_pen_it_is(scribbles):
    some = scribbles["same"]
    assert pen_reference.compare_scribble(some, "").kind is Kind.KEPT
    assert pen_reference.compare_scribble(some, "house-print").kind is Kind.DRAWN
    other = pen_reference.compare_scribble(some, HAND, "somebody")
    assert other.kind is Kind.OTHER_HAND and other.match is None and "somebody" in other.sentence


def test_another_pen_is_not_taken_for_settings(scribbles):
    some = scribbles["same"]
    red = type(some)(some.paper * np.exp(-some.density * np.array([0.1, 1.5, 1.0])), some.paper, some.dpi)
    known = pen_reference.compare_scribble(red.__class__(red.picture.astype(np.float32), red.paper, red.dpi), HAND)
    assert known.kind is Kind.OTHER_PEN and known.match is None and "another pen" in known.sentence


def test_a_page_is_printed_in_the_pens_colour(with_pen):
    said = []
    known = calibrated_ink.pen_of(with_pen, HAND, said.append)
    assert len(said) == 1 and "corrected" in said[0] and not said[0].startswith("warning")
    rgba = np.tile(np.array([0.3, 0.35, 0.6, 0.8], dtype=np.float32), (4, 4, 1))
    made = calibrated_ink.CalibratedInk(with_pen, known, HAND)
    plain = calibrated_ink.CalibratedInk(with_pen)
    page = Raster(rgba, 300)
    lighter, darker = (
        1 - share[3] * (1 - share[:3]) for share in (one(page).rgba[0, 0] / 255 for one in (made, plain))
    )
    assert lighter.mean() > darker.mean() + 0.05
    assert made.facts()["pen"]["kind"] == "corrected"


def test_the_strip_is_of_the_pens_colour(with_pen):
    made = strip.prepare(with_pen, HAND)
    page = calibrated_ink.reach_of(HAND, with_pen.table(), pen_reference.of_calibration(with_pen, HAND))
    assert (made.out, made.lost, made.whose) == (page.share_out, page.mean, f"of {HAND}")


def test_one_figure_on_ink_out_of_reach(stored):
    made_strip = strip.prepare(stored)
    rgba = np.full((3, 3, 4), 0.5, dtype=np.float32)
    made = calibrated_ink.CalibratedInk(stored, None, calibrated_ink.USUAL_HAND)
    made(Raster(rgba, 300))
    assert made.facts()["out_of_reach"] == round(made_strip.out, 4) and made.facts()["lost"] == round(
        made_strip.lost, 2
    )
    from handout.colour.table import tell_loss

    assert tell_loss(made_strip.out, made_strip.lost, made_strip.whose) in made.tell_reach()


def test_what_the_pen_wrote_is_kept(with_pen, scribbles, tmp_path):
    kept = with_pen.scribble()
    assert np.allclose(kept.picture, np.clip(scribbles["scanner-gamma"].picture, 0, 1), atol=1e-4)
    assert with_pen.facts()["pen"] == {"written": True, "hand": HAND}
    again = store.add(with_pen)
    assert again.pen_of() == HAND and again.scribble() is not None
    bad = tmp_path / "bad.npz"
    bad.write_bytes(b"no")
    with pytest.raises(InputError, match="cannot be read"):
        load(bad)


def test_writing_of_a_hand_is_on_its_own_paper():
    density, paper, dpi = pen_reference.writing(find(HAND))
    assert 100 <= dpi <= 1200 and np.allclose(paper, calibrated_ink.writer_of(HAND)[1])
    assert abs(float(np.median(density))) < 0.02 and density.max() > 0.5
    assert pen_reference.at_dpi(density, dpi, dpi / 2).shape[0] == pytest.approx(density.shape[0] / 2, abs=1)
