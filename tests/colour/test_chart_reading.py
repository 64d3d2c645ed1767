"""Good scans, of every kind of file, angle and resolution, give the same colours."""

import re

import cv2
import numpy as np
import pytest
import tifffile
from charts import paper, printed, scanned
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from handout.colour.chart import chart
from handout.colour.chart_files import render
from handout.colour.reading import ChartScan, read_scans
from handout.colour.reading.registration import place
from handout.colour.report import grid_on, report, write_report
from handout.errors import InputError

PAGE = chart("letter").pages[0]


@pytest.fixture(scope="module")
def sheet():
    return paper(render(PAGE, 300))


@pytest.fixture(scope="module")
def good(sheet):
    return scanned(sheet, 100.0)[0]


def far(reading):
    return float(np.abs(reading.scanned - printed(reading.device)).max()) * 255


@pytest.mark.slow
@settings(max_examples=7, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    angle=st.floats(0, 360), dpi=st.floats(50, 130), size=st.floats(0.95, 1.05), warp=st.floats(0, 2.0),
    seed=st.integers(0, 99), flip=st.booleans(),
)  # fmt: skip
def test_any_angle_size_and_resolution_gives_the_same(sheet, angle, dpi, size, warp, seed, flip):
    pixels, at = scanned(sheet, dpi, angle=angle, size=size, warp=warp, noise=1.0, seed=seed)
    if flip:
        pixels = np.ascontiguousarray(pixels[::-1])
    reading = read_scans([ChartScan(pixels, (dpi, dpi))])
    assert reading.usable, reading.findings
    assert len(reading.device) == 760
    # noise of a patch's mean, and what a neighbour spills over at the lowest resolutions
    assert far(reading) < 0.4 + 150 / dpi
    middles = (PAGE.boxes[:, :2] + PAGE.boxes[:, 2:]) / 2
    found, true = reading.sheets[0].placement.pixels(middles), at(middles)
    if flip:
        true = np.column_stack([true[:, 0], len(pixels) - 1 - true[:, 1]])
    assert np.linalg.norm(found - true, axis=1).max() * 25.4 / dpi < 0.2 + 80 / dpi


@pytest.mark.slow
def test_1200_dpi(sheet):
    # the upper part of the page, so that the picture stays small: the rest is cropped, and said so
    part = np.rint(sheet[: len(sheet) * 11 // 25] * 255).astype(np.uint8)
    reading = read_scans(
        [ChartScan(cv2.resize(part, None, fx=4, fy=4, interpolation=cv2.INTER_LINEAR), (1200.0, 1200.0))]
    )
    assert reading.sheets[0].placement.dpi == pytest.approx(1200, rel=0.002)
    assert len(reading.device) > 250
    assert far(reading) < 1.0
    assert [finding.code for finding in reading.findings if finding.severity == "refuse"] == ["cropped"]


@pytest.mark.slow
def test_a_warped_page_is_followed(sheet):
    pixels, at = scanned(sheet, 150.0, warp=2.0, angle=-17)
    found = place(ChartScan(pixels, (150.0, 150.0)))
    middles = (PAGE.boxes[:, :2] + PAGE.boxes[:, 2:]) / 2
    off = np.linalg.norm(found.pixels(middles) - at(middles), axis=1) * 25.4 / 150
    assert off.max() < 0.25
    # one homography alone would be off by more
    flat = np.column_stack([middles, np.ones(len(middles))]) @ found.to_pixels.T
    flat = flat[:, :2] / flat[:, 2:]
    assert np.linalg.norm(flat - at(middles), axis=1).max() * 25.4 / 150 > 0.5


def deep(pixels):
    return pixels.astype(np.uint16) * 257


FILES = {
    "8.tif": lambda p, x: tifffile.imwrite(p, x, resolution=(100, 100), resolutionunit="inch", photometric="rgb"),
    "16.tif": lambda p, x: tifffile.imwrite(
        p, deep(x), resolution=(100, 100), resolutionunit="inch", photometric="rgb"
    ),
    "planes.tif": lambda p, x: tifffile.imwrite(
        p, np.moveaxis(x, -1, 0), resolution=(100, 100), resolutionunit="inch", photometric="rgb", planarconfig=2
    ),
    "lzw.tif": lambda p, x: Image.fromarray(x).save(p, compression="tiff_lzw", dpi=(100, 100)),
    "lzw-16.tif": lambda p, x: cv2.imwrite(
        str(p),
        deep(x)[..., ::-1],
        [cv2.IMWRITE_TIFF_COMPRESSION, 5, cv2.IMWRITE_TIFF_XDPI, 100, cv2.IMWRITE_TIFF_YDPI, 100],
    ),
    "deflate.tif": lambda p, x: Image.fromarray(x).save(p, compression="tiff_adobe_deflate", dpi=(100, 100)),
    "8.png": lambda p, x: Image.fromarray(x).save(p, dpi=(100, 100)),
    "95.jpg": lambda p, x: Image.fromarray(x).save(p, quality=95, subsampling=0, dpi=(100, 100)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_files(tmp_path, good, name):
    FILES[name](tmp_path / name, good)
    reading = read_scans([tmp_path / name])
    assert reading.findings == ()
    assert far(reading) < 1.5
    assert reading.sheets[0].scan.full == (65535 if "16" in name else 255)


def test_png_of_16_bits(tmp_path, good):
    cv2.imwrite(str(tmp_path / "16.png"), deep(good)[..., ::-1])
    reading = read_scans([tmp_path / "16.png"])
    assert [finding.code for finding in reading.findings] == ["no-dpi"]
    assert reading.sheets[0].scan.full == 65535
    assert far(reading) < 1.5


@pytest.mark.slow
def test_pages_of_a_file_are_scans(tmp_path, sheet, good):
    again = scanned(sheet, 100.0, seed=1)[0]
    pages = [good[:1100, :850], again[:1100, :850]]
    with tifffile.TiffWriter(tmp_path / "two.tif") as file:
        for page in pages:
            file.write(page, resolution=(100, 100), resolutionunit="inch", photometric="rgb")
    reading = read_scans([tmp_path / "two.tif"])
    assert [sheet.scan.source[-2:] for sheet in reading.sheets] == [":1", ":2"]
    one = read_scans([ChartScan(pages[0], (100.0, 100.0))])
    error = [np.square(r.scanned - printed(r.device)).mean() for r in (one, reading)]
    assert error[1] < 0.8 * error[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "suffix", "code", "severity"),
    [
        ("CMYK", "tif", "not-rgb", "refuse"),
        ("CMYK", "jpg", "not-rgb", "refuse"),
        ("P", "tif", "palette", "refuse"),
        ("P", "png", "palette", "refuse"),
        ("RGBA", "tif", "alpha", "warn"),
        ("RGBA", "png", "alpha", "warn"),
    ],
)
def test_kinds_of_pixels(tmp_path, good, mode, suffix, code, severity):
    image = Image.fromarray(good).convert(mode)
    if mode == "RGBA":
        image.paste((0, 0, 0, 0), (0, 0, 20, 20))
    path = tmp_path / f"x.{suffix}"
    image.save(path, dpi=(100, 100))
    found = {finding.code: finding.severity for finding in read_scans([path]).findings}
    assert found.get(code) == severity


@pytest.mark.slow
def test_resolution_that_differs_both_ways(tmp_path, good):
    Image.fromarray(good).save(tmp_path / "x.png", dpi=(100, 200))
    codes = [finding.code for finding in read_scans([tmp_path / "x.png"]).findings]
    assert "dpi-differs" in codes


@pytest.mark.parametrize(
    ("data", "said"),
    [(b"", "no TIFF, PNG or JPEG"), (b"II*\0\xff\xff\xff\xff", "damaged or cut off"), (b"%PDF-1.7", "is a PDF")],
)
def test_files_that_cannot_be_opened(tmp_path, data, said):
    path = tmp_path / "scan.bin"
    path.write_bytes(data)
    with pytest.raises(InputError, match=said):
        read_scans([path])
    with pytest.raises(InputError, match="no such file"):
        read_scans([tmp_path / "none.png"])


def test_ink_only():
    reading = read_scans([])
    assert [finding.code for finding in reading.findings] == ["no-scan"]
    assert not reading.usable


@pytest.mark.slow
def test_two_pages(sheet):
    made = chart("A4", pages=2)
    scans = [ChartScan(scanned(paper(render(page, 300)), 100.0, seed=page.number)[0], (100.0, 100.0), f"p{page.number}")
             for page in made.pages]  # fmt: skip
    reading = read_scans(scans[::-1])
    assert reading.findings == ()
    assert (reading.chart, len(reading.device)) == (made, 760)
    assert far(reading) < 1.5
    half = read_scans(scans[:1])
    assert (
        "Page 2 of the chart's 2 pages is missing" in next(f for f in half.findings if f.severity == "refuse").sentence
    )
    assert len(half.device) > 380


def test_standard_errors_are_those_of_the_noise(sheet):
    pixels, _ = scanned(sheet, 150.0, noise=6.0, blur=0.0)
    reading = read_scans([ChartScan(pixels, (150.0, 150.0))])
    true = np.sqrt(np.square(reading.scanned - printed(reading.device)).mean(axis=1))
    assert np.median(reading.deviation) == pytest.approx(np.sqrt(np.mean(true**2)), rel=0.35)
    white = (reading.device == 1).all(axis=1)
    assert reading.deviation[white] < 0.5 * np.median(reading.deviation)


def test_the_report_stands_alone(tmp_path, good):
    covered = good.copy()
    covered[500:540, 300:340] = 250
    reading = read_scans([ChartScan(covered, (100.0, 100.0), "<scan> & co")])
    write_report(tmp_path / "report.html", reading)
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == report(reading)
    text = report(reading, "Printer <X>")
    assert "Printer &lt;X&gt;" in text and "<scan>" not in text
    assert not re.search(r"(src|href)=\"(?!data:)", text)
    for finding in reading.findings:
        assert finding.code in text
    assert text.count("<svg") == 4 and text.count("<img") == 1
    assert "Before and after" in report(reading, more=[("Before and after", "<p>…</p>")])


def test_the_grid_is_drawn_where_patches_are(good):
    reading = read_scans([ChartScan(good, (100.0, 100.0))])
    drawn = grid_on(reading.sheets[0], 2000)
    assert drawn.shape == good.shape
    changed = (drawn != good).any(axis=2)
    middles = reading.sheets[0].placement.pixels((PAGE.boxes[:, :2] + PAGE.boxes[:, 2:]) / 2)
    x, y = np.rint(middles).astype(int).T
    assert not changed[y, x].any()
    assert 0.02 < changed.mean() < 0.35


def test_a_report_of_nothing():
    assert "Nothing could be read" in report(read_scans([]))
