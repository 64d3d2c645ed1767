import sys

import numpy as np
import pytest
import tifffile
from PIL import Image

from handout.errors import InputError
from handout.scanning import page
from handout.scanning.page import read_scan

RNG = np.random.default_rng(3)
RGB = RNG.integers(0, 256, (60, 80, 3), dtype=np.uint8)


def saved(tmp_path, image, name, **options):
    path = tmp_path / name
    image.save(path, **options)
    return path


def test_png_rgb(tmp_path):
    scan = read_scan(saved(tmp_path, Image.fromarray(RGB), "a.png", dpi=(300, 300)))
    assert np.array_equal(scan.rgb, RGB)
    assert scan.dpi == pytest.approx(300, abs=0.01)
    assert not scan.told
    assert not scan.rgb.flags.writeable


def test_dpi_of_the_argument_wins(tmp_path):
    scan = read_scan(saved(tmp_path, Image.fromarray(RGB), "a.png", dpi=(300, 300)), dpi=600)
    assert (scan.dpi, scan.told) == (600, True)


@pytest.mark.parametrize("options", [{}, {"dpi": (72, 72)}])
def test_no_plausible_resolution_is_a_question(tmp_path, options):
    with pytest.raises(InputError, match="--dpi"):
        read_scan(saved(tmp_path, Image.fromarray(RGB), "a.png", **options))


def test_the_question_guesses_a_sheet(tmp_path):
    with pytest.raises(InputError, match=r"A4.*--dpi 200"):
        read_scan(saved(tmp_path, Image.new("L", (1654, 2339), 255), "a.png"))


def test_nonsense_dpi(tmp_path):
    with pytest.raises(InputError, match="100–2400"):
        read_scan(saved(tmp_path, Image.fromarray(RGB), "a.png"), dpi=30)


@pytest.mark.parametrize("mode", ["L", "1", "P", "LA", "RGBA"])
def test_other_modes(tmp_path, mode):
    image = Image.new("RGB", (80, 60), (255, 255, 255))
    image.paste((0, 0, 0), (10, 10, 40, 40))
    scan = read_scan(saved(tmp_path, image.convert(mode), "a.png"), dpi=300)
    assert scan.rgb[20, 20].tolist() == [0, 0, 0]
    assert scan.rgb[50, 60].tolist() == [255, 255, 255]


def test_transparent_is_white(tmp_path):
    clear = np.zeros((60, 80, 4), dtype=np.uint8)
    assert (read_scan(saved(tmp_path, Image.fromarray(clear), "a.png"), dpi=300).rgb == 255).all()


def test_sixteen_bit_grey(tmp_path):
    values = RNG.integers(0, 65536, (60, 80), dtype=np.uint16)
    scan = read_scan(saved(tmp_path, Image.fromarray(values), "a.png"), dpi=300)
    assert np.array_equal(scan.rgb[:, :, 1], values >> 8)


@pytest.mark.parametrize("planes", ["contig", "separate"])
@pytest.mark.parametrize("packing", [None, "zlib"])
def test_sixteen_bit_colour_tiff(tmp_path, planes, packing):
    values = RNG.integers(0, 65536, (60, 80, 3), dtype=np.uint16)
    data = values if planes == "contig" else np.ascontiguousarray(np.moveaxis(values, -1, 0))
    options = {"photometric": "rgb", "planarconfig": planes, "compression": packing}
    tifffile.imwrite(tmp_path / "a.tif", data, resolution=(400, 400), resolutionunit=2, **options)
    scan = read_scan(tmp_path / "a.tif")
    assert np.array_equal(scan.rgb, values >> 8)
    assert scan.dpi == pytest.approx(400)


def test_several_pages(tmp_path):
    pages = [Image.new("L", (80, 60), level) for level in (10, 20, 30)]
    path = saved(tmp_path, pages[0], "a.tif", save_all=True, append_images=pages[1:], dpi=(300, 300))
    with pytest.raises(InputError, match=r"3 pages.*--page 1"):
        read_scan(path)
    assert (read_scan(path, page=2).rgb == 20).all()
    with pytest.raises(InputError, match="1–3"):
        read_scan(path, page=4)


def test_cmyk_without_a_profile_is_refused(tmp_path):
    with pytest.raises(InputError, match="CMYK"):
        read_scan(saved(tmp_path, Image.new("CMYK", (80, 60)), "a.jpg"), dpi=300)


def test_too_large_is_refused_before_decoding(tmp_path, monkeypatch):
    path = saved(tmp_path, Image.fromarray(RGB), "a.png")
    monkeypatch.setattr(page, "MOST_PIXELS", 4000)
    monkeypatch.setattr(Image.Image, "load", lambda self: pytest.fail("decoded"))
    with pytest.raises(InputError, match="megapixels"):
        read_scan(path, dpi=300)


@pytest.mark.parametrize("name", ["a.png", "a.tif", "a.jpg"])
def test_not_an_image(tmp_path, name):
    (tmp_path / name).write_bytes(b"these are no pixels")
    with pytest.raises(InputError, match="Cannot read"):
        read_scan(tmp_path / name, dpi=300)


def test_cut_off_file(tmp_path):
    path = saved(tmp_path, Image.fromarray(RGB), "a.png")
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(InputError, match="Cannot read"):
        read_scan(path, dpi=300)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_scan(tmp_path / "none.png", dpi=300)


def test_pdf_without_the_library(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pypdfium2", None)
    with pytest.raises(InputError, match="pypdfium2"):
        read_scan(tmp_path / "a.pdf")


def test_page_of_a_pdf(tmp_path):
    pytest.importorskip("pypdfium2")
    pages = [Image.new("RGB", (600, 900), (level, 0, 0)) for level in (60, 200)]
    pages[0].save(tmp_path / "a.pdf", save_all=True, append_images=pages[1:], resolution=300)
    scan = read_scan(tmp_path / "a.pdf", page=2)
    assert scan.shape == (900, 600)
    assert scan.dpi == pytest.approx(300, rel=1e-3)
    assert abs(int(scan.rgb[400, 300, 0]) - 200) < 4
