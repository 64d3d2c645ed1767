"""The wizard's whole way on simulated devices, and every bad scan: named rightly, nothing stored, nothing lost."""

import cv2
import numpy as np
import pytest
import tifffile
from PIL import Image

from handout.calibrating import store
from handout.calibrating.wizard import CalibrationTask, ScansRefused, Step, Wizard, remove
from handout.errors import InputError
from handout.simulated import print_and_scan as loop
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import Inkjet

DPI = 80


@pytest.mark.slow
def test_the_whole_way(with_table, profile, tmp_path):
    wizard, printer = with_table, loop.make_loop(profile, "white")
    printer.dpi, printer.flatbed = 150, Flatbed(shading=0.0)
    (document,) = wizard.print_page()
    verified = wizard.take_strip(printer.scan(document, tmp_path / "strip.tif")[0])
    assert verified.after.mean <= 0.5
    assert verified.before.mean > 5
    assert verified.grey_after.mean <= 0.5 and verified.ink_after.count > 40
    assert "the eye sees no difference" in verified.verdict and verified.findings == ()
    assert store.list_stored() == []
    kept = wizard.store()
    assert wizard.step is Step.DONE
    assert store.newest("sim").date == kept.date
    assert kept.load_kept(store.VERIFICATION)["after"]["mean"] == verified.after.mean
    assert not wizard.folder.exists()


def test_the_table_is_built_of_the_scan(wizard, scan, patches):
    assert wizard.take_scans([scan]).findings == ()
    assert wizard.step is Step.BUILD
    kept = store.read_patches(wizard.patches)
    assert np.allclose(kept.scanned, patches.scanned, atol=1e-12)
    assert np.allclose(kept.deviation, patches.deviation, atol=1e-12)


def test_a_run_that_was_left_is_gone_on_with(wizard, scan, profile):
    wizard.take_scans([scan])
    again = Wizard(CalibrationTask(profile, "sim", "white"))
    assert again.resumed and again.step is Step.BUILD
    assert not Wizard(CalibrationTask(profile, "sim", "cream")).resumed
    afresh = Wizard(CalibrationTask(profile, "sim", "white"), afresh=True)
    assert not afresh.resumed and afresh.step is Step.PRINT and not again.folder.exists()


def test_of_a_session_whose_deletion_is_broken_off_nothing_is_gone_on_with(wizard, scan, profile, monkeypatch):
    wizard.take_scans([scan])
    left = wizard.scans[0]
    with monkeypatch.context() as patch:
        patch.setattr("shutil.rmtree", lambda *_, **__: None)
        remove(wizard.folder)
    assert left.is_file()
    assert not Wizard(CalibrationTask(profile, "sim", "white")).resumed and not left.exists()


@pytest.mark.slow
def test_a_chart_of_two_pages_waits_for_the_other(profile, tmp_path):
    wizard = Wizard(CalibrationTask(profile, "sim", "white", pages=2))
    document, *_ = wizard.print_page()
    printer = loop.make_loop(profile, "white")
    printer.dpi = DPI
    first, second = printer.scan(document, tmp_path / "chart.tif")
    assert "Page 1" in wizard.take_scans([second]).missing
    assert wizard.step is Step.SCAN and len(wizard.scans) == 1
    blank = tmp_path / "blank.png"
    Image.new("RGB", (827, 1169), "white").save(blank, dpi=(DPI, DPI))
    with pytest.raises(ScansRefused, match="The 1 good scan from before is kept"):
        wizard.take_scans([blank])
    assert wizard.take_scans([first]).missing == ""
    assert wizard.step is Step.BUILD


def test_nothing_is_stored_before_its_time(wizard):
    with pytest.raises(InputError, match="scan the chart"):
        wizard.store()


def places(picture):
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    return y / picture.shape[0], x / picture.shape[1]


def cropped(picture):
    return picture[: -round(60 / 25.4 * DPI)]


def glare(picture):
    y, x = places(picture)
    light = 90 * np.exp(-(((y - 0.45) / 0.05) ** 2 + ((x - 0.5) / 0.1) ** 2))
    return np.clip(picture + light[..., None], 0, 255).astype(np.uint8)


def shading(picture):
    y, _ = places(picture)
    return (picture * (1 - 0.25 * y[..., None])).astype(np.uint8)


def stretched(picture):
    return cv2.resize(picture, None, fx=1.0, fy=1.03, interpolation=cv2.INTER_AREA)


def linear(picture):
    return np.rint(255 * (picture / 255.0) ** 2.2).astype(np.uint8)


def clipped_blacks(picture):
    return np.clip((picture.astype(np.float64) - 110) * 1.3, 0, 255).astype(np.uint8)


BAD = {
    "no-marks": lambda p: np.full_like(p, 235),
    "cropped": cropped,
    "low-dpi": lambda p: cv2.resize(p, None, fx=0.34, fy=0.34, interpolation=cv2.INTER_AREA),
    "clipped-whites": lambda p: np.clip(p * 1.25, 0, 255).astype(np.uint8),
    "clipped-blacks": clipped_blacks,
    "grey": lambda p: np.repeat(p.mean(axis=2, keepdims=True), 3, axis=2).astype(np.uint8),
}
DOUBTFUL = {
    "mirrored": lambda p: p[:, ::-1],
    "stretched": stretched,
    "blemish": glare,
    "shading": shading,
    "tone": linear,
}


def refused(wizard, path):
    """The codes of what was refused; nothing has changed by it."""
    with pytest.raises(ScansRefused) as caught:
        wizard.take_scans([path])
    assert wizard.step is Step.SCAN and wizard.scans == [] and store.list_stored() == []
    assert not wizard.patches.exists()
    return {one.code for one in caught.value.findings if one.severity == "refuse"}


@pytest.mark.slow
@pytest.mark.parametrize("code", BAD)
def test_a_bad_scan_is_named(code, wizard, picture, tmp_path):
    path = tmp_path / "scan.tif"
    pixels = np.ascontiguousarray(BAD[code](picture))
    loop.write(pixels, DPI * (0.34 if code == "low-dpi" else 1), path)
    found = refused(wizard, path)
    assert code in found or (code == "low-dpi" and found & {"few-marks", "no-marks"})


@pytest.mark.slow
@pytest.mark.parametrize("code", DOUBTFUL)
def test_a_doubtful_scan_is_taken_with_a_word(code, wizard, picture, tmp_path):
    path = tmp_path / "scan.tif"
    loop.write(np.ascontiguousarray(DOUBTFUL[code](picture)), DPI, path)
    try:
        found = wizard.take_scans([path]).findings
    except ScansRefused as error:
        found = error.findings
    assert code in {one.code for one in found}
    assert store.list_stored() == []


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "code"), [("clogged", "banding"), ("fit-to-page", "scaled")])
def test_a_bad_print_is_named(fault, code, wizard, profile, chart_pixels, tmp_path):
    sheet = Inkjet("white", faults=[fault]).print_page(chart_pixels, profile.dpi, profile.margins)
    path = tmp_path / "scan.tif"
    loop.write(Flatbed(shading=0.0).scan(sheet, DPI, np.random.default_rng(4)), DPI, path)
    try:
        found = wizard.take_scans([path]).findings
    except ScansRefused as error:
        found = error.findings
    assert code in {one.code for one in found}
    assert store.list_stored() == []


@pytest.mark.slow
def test_other_settings_than_the_hands_are_named(profile, scan, monkeypatch):
    from handout.calibrating import calibrated_ink

    monkeypatch.setattr(calibrated_ink, "writer_of", lambda name: ("", [0.80, 0.95, 0.97]))
    wizard = Wizard(CalibrationTask(profile, "sim", "white", hand="house-joined-ballpoint"))
    wizard.go(Step.SCAN)
    (found,) = wizard.take_scans([scan]).findings
    assert found.code == "settings-differ" and "lighter in red" in found.sentence


def test_another_chart_is_named(profile, scan):
    wizard = Wizard(CalibrationTask(profile, "sim", "white", sheet="letter"))
    wizard.go(Step.SCAN)
    assert refused(wizard, scan) == {"another-chart"}


def test_files_that_hold_no_colours(wizard, picture, tmp_path):
    small = Image.fromarray(picture)
    small.quantize(64).save(tmp_path / "palette.png")
    small.convert("CMYK").save(tmp_path / "ink.tif")
    small.convert("1").save(tmp_path / "bits.png")
    assert refused(wizard, tmp_path / "palette.png") == {"palette"}
    assert refused(wizard, tmp_path / "ink.tif") == {"not-rgb"}
    assert "grey" in refused(wizard, tmp_path / "bits.png")


def test_a_heavy_jpeg(wizard, picture, tmp_path):
    Image.fromarray(picture).save(tmp_path / "scan.jpg", quality=12, dpi=(DPI, DPI))
    assert "jpeg" in refused(wizard, tmp_path / "scan.jpg")


def test_deep_scans_without_a_resolution_are_good(wizard, picture, tmp_path):
    tifffile.imwrite(tmp_path / "deep.tif", picture.astype(np.uint16) * 257, photometric="rgb")
    assert {one.code for one in wizard.take_scans([tmp_path / "deep.tif"]).findings} == {"no-dpi"}
