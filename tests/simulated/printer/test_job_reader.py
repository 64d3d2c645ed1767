import numpy as np
import pytest

from handout.errors import InputError
from handout.inking.device_pixels import device_pixels
from handout.simulated import print_and_scan
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import Inkjet
from handout.sinks import picture_pdf
from handout.values import Page, Raster

DPI = 100


def job(path, *pages):
    with picture_pdf.document(path, {"seed": 1}) as document:
        for page, raster in pages:
            document.add(page, raster and device_pixels(raster))
    return path


def blot(width, height, at=(0.0, 0.0), dpi=DPI):
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :3] = np.random.default_rng(0).random((height, width, 3)) * 0.9
    return Raster(rgba, dpi, at)


def test_every_pixel_comes_back_where_it_was(tmp_path):
    page, raster = Page(101.6, 76.2), blot(60, 40, (25.4, 12.7))
    pages = list(
        print_and_scan.pages(job(tmp_path / "a.pdf", (page, raster), (page, None), (Page(50, 60), raster)), DPI)
    )
    assert [sheet.shape for _, sheet in pages] == [(300, 400, 3), (300, 400, 3), (236, 197, 3)]
    assert pages[0][0].width == pytest.approx(101.6) and pages[0][0].height == pytest.approx(76.2)
    wanted = np.full((300, 400, 3), 255)
    wanted[50:90, 100:160] = raster.rgba[..., :3]
    assert np.array_equal(pages[0][1], wanted) and (pages[1][1] == 255).all()


def test_ink_beyond_the_sheet_is_lost(tmp_path):
    ((_, sheet),) = print_and_scan.pages(job(tmp_path / "a.pdf", (Page(25.4, 25.4), blot(60, 40, (-2.54, 20.32)))), DPI)
    assert sheet.shape == (100, 100, 3)
    assert (
        (sheet[80:, :50] < 255).all(axis=2).mean() > 0.99 and (sheet[:80] == 255).all() and (sheet[:, 50:] == 255).all()
    )


def test_streams_that_look_like_objects_are_no_objects(tmp_path):
    # the words stand in the description of the file, outside of every stream, and in the picture
    path = tmp_path / "a.pdf"
    with picture_pdf.document(path, {"text": "endobj 7 0 obj /Type /Page stream"}) as document:
        document.add(Page(25.4, 25.4), device_pixels(blot(100, 100)))
    ((_, sheet),) = print_and_scan.pages(path, DPI)
    assert (sheet < 255).all(axis=2).all()


def test_a_page_of_another_resolution_is_refused(tmp_path):
    with pytest.raises(InputError, match="made for 100 dpi, and the printer has 300 dpi"):
        list(print_and_scan.pages(job(tmp_path / "a.pdf", (Page(50, 50), blot(60, 40))), 300))


@pytest.mark.parametrize("damage", [lambda data: b"%PDF-1.6\n", lambda data: data.replace(b"\x78\x9c", b"\x00\x00", 1)])
def test_what_handout_did_not_write_is_refused(tmp_path, damage):
    path = job(tmp_path / "a.pdf", (Page(50, 50), blot(60, 40)))
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=r"a\.pdf: (the simulated printer reads only|a picture in it cannot be read)"):
        list(print_and_scan.pages(path, DPI))


def test_a_missing_job_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match=r"none\.pdf: cannot be read: No such file"):
        list(print_and_scan.pages(tmp_path / "none.pdf", DPI))


def test_from_the_job_to_the_scan(tmp_path):
    """All the way: what was inked comes back from the scanner in its place, in the printer's colours."""
    page = Page(50.8, 25.4)
    rgba = np.zeros((30, 50, 4), dtype=np.float32)
    rgba[..., 2:] = 1  # blue
    ((_, pixels),) = print_and_scan.pages(job(tmp_path / "a.pdf", (page, Raster(rgba, DPI, (12.7, 5.08)))), DPI)
    printer = Inkjet("cream")
    scan = Flatbed.ideal().scan(printer.print_page(pixels, DPI), 2 * DPI, np.random.default_rng(0))
    paper, ink = np.rint(255 * printer.scan_patches([[1, 1, 1], [0, 0, 1]]))
    assert scan.shape == (200, 400, 3)
    assert (scan[45:95, 105:195] == ink).all() and (scan[2:35, 2:-2] == paper).all()
    assert (scan[2:-2, 205:-2] == paper).all()
