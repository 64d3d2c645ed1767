"""Every bad scan is made from a good one, and named rightly."""

import re
from functools import lru_cache

import cv2
import numpy as np
import pytest
from charts import inked, paper, printed, scanned
from PIL import Image

from handout.colour.chart import chart
from handout.colour.chart_files import render
from handout.colour.reading import ChartScan, read_scans

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow

DPI = 100.0
PAGE = chart("A4").pages[0]


@lru_cache(maxsize=1)
def sent():
    """The different colours of the page as it is sent to the printer, and which of them each pixel has."""
    return inked(render(PAGE, 300))


@pytest.fixture(scope="module")
def sheet():
    """The printed page."""
    colours, back = sent()
    return np.take(printed(colours / 255).astype(np.float32), back, axis=0)


@pytest.fixture(scope="module")
def good(sheet):
    """A good scan of it, and where points of the page are in it."""
    return scanned(sheet, DPI, angle=1.5)


def of(pixels, dpi=(DPI, DPI)):
    return read_scans([ChartScan(pixels, dpi)])


def codes(reading):
    return {finding.code: finding.severity for finding in reading.findings}


def only(reading, code, severity):
    """The finding of that code, which must be there, with nothing worse beside it."""
    found = codes(reading)
    assert found.get(code) == severity, reading.findings
    assert severity == "refuse" or reading.usable, reading.findings
    return next(finding for finding in reading.findings if finding.code == code)


def reprinted(change, **how):
    """A scan of the chart printed by a printer that gets other colours: change((n, 3) device 0–1) → (n, 3)."""
    colours, back = sent()
    got = np.rint(np.clip(change(colours / 255), 0, 1) * 255)
    return scanned(np.take(printed(got / 255).astype(np.float32), back, axis=0), DPI, **how)[0]


def blended(pixels, mask, colour):
    """Something laid over a scan: mask (h, w) 0–1."""
    mask = mask[..., None]
    return np.clip(pixels * (1 - mask) + mask * np.asarray(colour) * 255, 0, 255).astype(np.uint8)


def spot(shape, at, sigma):
    """A round blot in a picture (h, w), 1 in its middle; sigma in pixels of 150 dpi."""
    sigma = sigma * DPI / 150
    y, x = np.ogrid[: shape[0], : shape[1]]
    return np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2 * sigma**2))


def test_a_good_scan_has_no_finding(good):
    reading = of(good[0])
    assert reading.findings == ()
    assert np.abs(reading.scanned - printed(reading.device)).max() < 0.5 / 255
    assert len(reading.device) == 760


def test_no_marks(good):
    finding = only(of(np.full_like(good[0], 230)), "no-marks", "refuse")
    assert "16 square marks" in finding.sentence


def test_too_few_marks(good):
    pixels, at = good[0].copy(), good[1]
    for corners in at(PAGE.marks.reshape(-1, 2)).reshape(-1, 4, 2)[:12]:
        cv2.fillPoly(pixels, [corners.astype(np.int32)], (250, 250, 250))
    finding = only(of(pixels), "few-marks", "refuse")
    assert "Only 4 of" in finding.sentence


def test_hidden_marks_are_said_and_do_no_harm(good):
    pixels, at = good[0].copy(), good[1]
    for corners in at(PAGE.marks.reshape(-1, 2)).reshape(-1, 4, 2)[[1, 6]]:
        cv2.fillPoly(pixels, [corners.astype(np.int32)], (250, 250, 250))
    assert "2 of the chart's 16" in only(of(pixels), "marks-hidden", "warn").sentence


@pytest.mark.parametrize("axis", [0, 1])
def test_mirrored(good, axis):
    reading = of(np.ascontiguousarray(np.flip(good[0], axis)))
    only(reading, "mirrored", "warn")
    assert np.abs(reading.scanned - printed(reading.device)).max() < 0.5 / 255


def test_another_chart(sheet, good):
    reading = read_scans([ChartScan(good[0], (DPI, DPI))], chart("letter"))
    assert "letter" in only(reading, "another-chart", "refuse").sentence
    assert len(reading.device) == 0


def test_two_charts_in_one_picture(good):
    other = chart("letter")
    pixels, _ = scanned(paper(render(other.pages[0], 300)), DPI)
    height = max(len(pixels), len(good[0]))
    both = [np.pad(p, ((0, height - len(p)), (0, 0), (0, 0)), constant_values=240) for p in (pixels, good[0])]
    assert "two charts" in only(of(np.hstack(both)), "another-chart", "refuse").sentence


@pytest.mark.parametrize(("turn", "edge"), [(0, "upper edge"), (1, "right edge"), (2, "lower edge"), (3, "left edge")])
def test_cropped_by_60_mm(good, turn, edge):
    pixels = np.ascontiguousarray(np.rot90(good[0], turn)[round(60 / 25.4 * DPI) :])
    reading = of(pixels)
    finding = only(reading, "cropped", "refuse")
    assert edge in finding.sentence
    missing = dict(zip(PAGE.names, PAGE.cells.tolist(), strict=True))
    cells = np.array([missing[name] for name in finding.patches])
    side = {"upper edge": cells[:, 1] < 19, "lower edge": cells[:, 1] > 17, "left edge": cells[:, 0] < 14,
            "right edge": cells[:, 0] > 12}[edge]  # fmt: skip
    assert side.all()
    assert np.abs(reading.scanned - printed(reading.device)).max() < 0.6 / 255  # what was seen is kept, and right


def test_low_resolution(sheet):
    pixels, _ = scanned(sheet, 34.0, blur=0.3)
    found = codes(of(pixels, (34.0, 34.0)))
    assert found.keys() & {"low-dpi", "few-marks", "no-marks"}
    assert "refuse" in found.values()


def test_patches_of_fewer_than_ten_pixels(sheet):
    pixels, _ = scanned(sheet, 36.0, blur=0.0, noise=0.0)
    reading = of(pixels, (36.0, 36.0))
    if reading.sheets:
        assert "9.9 pixels" in only(reading, "low-dpi", "refuse").sentence


@pytest.mark.parametrize("size", [0.94, 0.97, 1.03])
def test_printed_scaled(sheet, size):
    finding = only(of(scanned(sheet, DPI, size=size)[0]), "scaled", "warn")
    assert f"{size:.1%}" in finding.sentence


@pytest.mark.parametrize(("stretch", "angle"), [(1.03, 0), (0.97, 90)])
def test_stretched(sheet, stretch, angle):
    finding = only(of(scanned(sheet, DPI, stretch=stretch, angle=angle)[0]), "stretched", "warn")
    assert "3." in finding.sentence


def test_warped(sheet):
    reading = of(scanned(sheet, DPI, warp=2.0)[0])
    only(reading, "warped", "warn")
    assert np.abs(reading.scanned - printed(reading.device)).max() < 0.5 / 255


def test_crumpled(sheet):
    pixels, _ = scanned(sheet, DPI)
    height, width = pixels.shape[:2]
    y, x = np.mgrid[:height, :width].astype(np.float32)
    wave = 5 / 25.4 * DPI * np.sin(2 * np.pi * y / height * 2.6) * np.sin(2 * np.pi * x / width * 2.1)
    pixels = cv2.remap(pixels, x + wave.astype(np.float32), y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    found = codes(of(pixels))
    assert "refuse" in found.values()
    assert found.keys() & {"warped", "uneven", "few-marks"}


@pytest.mark.parametrize(("quality", "severity"), [(15, "refuse"), (60, "warn"), (92, None)])
def test_jpeg(tmp_path, good, quality, severity):
    path = tmp_path / "scan.jpg"
    Image.fromarray(good[0]).save(path, quality=quality, dpi=(DPI, DPI))
    reading = read_scans([path])
    assert codes(reading).get("jpeg") == severity
    if severity:
        sentence = next(f for f in reading.findings if f.code == "jpeg").sentence
        assert abs(int(re.search(r"quality about (\d+)", sentence)[1]) - quality) <= 3


def test_jpeg_saved_again_as_png(tmp_path, good):
    path = tmp_path / "scan.jpg"
    Image.fromarray(good[0]).save(path, quality=45, dpi=(DPI, DPI))
    only(of(np.asarray(Image.open(path))), "jpeg", "warn")


def test_clipped_whites(good):
    only(of(np.clip(good[0] * 1.12, 0, 255).astype(np.uint8)), "clipped-whites", "refuse")


def test_clipped_blacks(good):
    only(of(np.clip(good[0].astype(np.int16) - 22, 0, 255).astype(np.uint8)), "clipped-blacks", "refuse")


def test_automatic_contrast(good):
    stretched = np.rint(np.clip((good[0] / 255 - 0.047) / 0.886, 0, 1) * 255).astype(np.uint8)
    assert "by itself" in only(of(stretched), "automatic", "refuse").sentence


@pytest.mark.parametrize("gamma", [0.33, 2.4])
def test_automatic_gamma(good, gamma):
    # deep, so that the tones are whole: only their place is wrong
    pixels = np.rint(65535 * (good[0] / 255 + 0.002) ** gamma / 1.01).astype(np.uint16)
    only(of(pixels), "tone", "warn")


def test_scan_that_was_edited(good):
    table = np.rint(255 * (np.arange(256) / 255) ** 0.6).astype(np.uint8)
    only(of(table[good[0]]), "edited", "warn")


def test_automatic_colour_between_two_scans(sheet, good):
    other = np.clip(scanned(sheet, DPI, seed=1)[0] * [1.03, 1.0, 0.97], 0, 255).astype(np.uint8)
    reading = read_scans([ChartScan(good[0], (DPI, DPI), "one"), ChartScan(other, (DPI, DPI), "two")])
    assert "one and two differ" in only(reading, "settings-differ", "refuse").sentence


def test_settings_other_than_the_handwriting(good):
    same = printed(np.ones(3))
    assert read_scans([ChartScan(good[0], (DPI, DPI))], paper=same).findings == ()
    reading = read_scans([ChartScan(good[0], (DPI, DPI))], paper=same * [1, 1, 0.85])
    assert "lighter in blue" in only(reading, "settings-differ", "warn").sentence


def test_grey(good, tmp_path):
    grey = cv2.cvtColor(good[0], cv2.COLOR_RGB2GRAY)
    only(of(np.repeat(grey[..., None], 3, axis=2)), "grey", "refuse")
    Image.fromarray(grey).save(tmp_path / "grey.png", dpi=(DPI, DPI))
    assert "grey" in only(read_scans([tmp_path / "grey.png"]), "grey", "refuse").sentence


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_one_bit(good, tmp_path, suffix):
    path = tmp_path / f"line.{suffix}"
    Image.fromarray(good[0]).convert("1", dither=Image.Dither.NONE).save(path, dpi=(DPI, DPI))
    assert "black and white only" in only(read_scans([path]), "grey", "refuse").sentence


def test_glare(good):
    at = good[1](np.array([[100.0, 150.0]]))[0]
    reading = of(blended(good[0], 0.6 * spot(good[0].shape, at, 55), (1, 1, 1)))
    finding = only(reading, "blemish", "warn")
    assert "glare" in finding.sentence
    middles = (PAGE.boxes[:, :2] + PAGE.boxes[:, 2:]) / 2
    near = np.linalg.norm(middles - (100, 150), axis=1)
    named = np.array([name in finding.patches for name in PAGE.names])
    assert named.sum() > 10
    assert near[named].max() < 40
    assert np.abs(reading.scanned - printed(reading.device)).max() < 9 / 255


def test_dust(good):
    name = PAGE.names[400]
    at = good[1]((PAGE.boxes[400, :2] + PAGE.boxes[400, 2:])[None] / 2)[0]
    pixels = blended(good[0], (spot(good[0].shape, at, 3.5) > 0.3).astype(float), (0.5, 0.5, 0.45))
    reading = of(pixels)
    finding = only(reading, "blemish", "warn")
    assert finding.patches == (name,)
    assert np.abs(reading.scanned - printed(reading.device)).max() < 2 / 255


def test_fold(good):
    ends = good[1](np.array([[5.0, 120.0], [205.0, 123.0]]))
    line = cv2.line(np.zeros(good[0].shape[:2]), *(tuple(map(int, end)) for end in ends), 1.0, round(3.7 * DPI / 25.4))
    finding = only(of(blended(good[0], 0.35 * line, (0.1, 0.1, 0.1))), "blemish", "warn")
    assert "fold" in finding.sentence
    assert len(finding.patches) >= 8


def test_covered_quarter(good):
    pixels = good[0].copy()
    y, x = (slice(round(a * DPI / 25.4), round(b * DPI / 25.4)) for a, b in ((118, 169), (85, 152)))  # mm
    pixels[y, x] = 240
    assert "look unlike" in only(of(pixels), "blemish", "refuse").sentence


def test_shading(sheet):
    reading = of(scanned(sheet, DPI, shade=0.15)[0])
    assert "right" in only(reading, "shading", "warn").sentence
    ratio = reading.scanned / printed(reading.device)
    assert np.ptp(ratio[printed(reading.device).min(axis=1) > 0.2]) < 0.02


def test_too_much_shading(sheet):
    only(of(scanned(sheet, DPI, shade=0.5)[0]), "shading", "refuse")


def test_banding(sheet):
    rows = 1 + 0.05 * (np.sin(np.arange(len(sheet)) / 300 * 25.4 * 2 * np.pi / 9.3) > 0.92)
    striped = sheet * rows[:, None, None].astype(np.float32)
    assert "stripes across" in only(of(scanned(striped, DPI)[0]), "banding", "warn").sentence


def test_clogged_nozzle(good):
    reading = of(reprinted(lambda rgb: np.where([True, False, False], 1.0, rgb)))
    assert "cyan" in only(reading, "clogged", "refuse").sentence


def test_shadows_that_the_driver_cuts_off():
    reading = of(reprinted(lambda rgb: np.where(rgb < 0.25, 0.0, rgb)))
    ramp = next(finding for finding in reading.findings if finding.code == "ramp")
    assert "Greys 0 to " in ramp.sentence


def managed(rgb):
    """A driver that takes colours for sRGB, and clips those out of the ink's reach."""
    grey = rgb.mean(axis=1, keepdims=True)
    return np.clip(grey + 1.9 * (rgb - grey), 0.0, 1.0)


def test_printed_through_colour_management():
    found = only(of(reprinted(managed)), "managed", "refuse")
    assert "colour management" in found.sentence


def test_identical_patches():
    found = codes(of(reprinted(lambda rgb: np.minimum(rgb, 0.9))))
    assert "identical" in found


def test_another_print_of_the_chart():
    assert not of(reprinted(lambda rgb: rgb[:, ::-1])).usable
