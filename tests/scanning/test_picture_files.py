import sys

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageOps

from handout.errors import InputError
from handout.scanning import checks, picture_files
from handout.scanning.picture_files import count_pages, read_scan

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
    with pytest.raises(InputError, match=r"3 pages.*a\.tif:1"):
        read_scan(path)
    assert (read_scan(path, page=2).rgb == 20).all()
    with pytest.raises(InputError, match="pages 1–3"):
        read_scan(path, page=4)


def test_cmyk_without_a_profile_is_refused(tmp_path):
    with pytest.raises(InputError, match="CMYK"):
        read_scan(saved(tmp_path, Image.new("CMYK", (80, 60)), "a.jpg"), dpi=300)


def test_too_large_is_refused_before_decoding(tmp_path, monkeypatch):
    path = saved(tmp_path, Image.fromarray(RGB), "a.png")
    monkeypatch.setattr(checks, "MOST_PIXELS", 4000)
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


def test_a_program_in_a_picture_s_clothes_is_not_run(tmp_path):
    path = tmp_path / "scan.png"
    path.write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 99 99\n%%EndComments\nshowpage\n")
    with pytest.raises(InputError, match="PostScript"):
        read_scan(path)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_scan(tmp_path / "none.png", dpi=300)


def test_pdf_without_the_library(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pypdfium2", None)
    (tmp_path / "a.pdf").write_bytes(b"%PDF-1.7")
    with pytest.raises(InputError, match="pypdfium2"):
        read_scan(tmp_path / "a.pdf")


@pytest.fixture
def pdf(tmp_path):
    """Two pages of one colour each, at 300 dpi."""
    pytest.importorskip("pypdfium2")
    pages = [Image.new("RGB", (600, 900), (level, 0, 0)) for level in (60, 200)]
    pages[0].save(tmp_path / "a.pdf", save_all=True, append_images=pages[1:], resolution=300)
    return tmp_path / "a.pdf"


def test_page_of_a_pdf(pdf):
    scan = read_scan(pdf, page=2)
    assert scan.shape == (900, 600)
    assert scan.dpi == pytest.approx(300, rel=1e-3)
    assert abs(int(scan.rgb[400, 300, 0]) - 200) < 4
    assert scan.source == f"{pdf}:2" and count_pages(pdf) == 2


def test_a_pdf_is_known_by_its_head(pdf):
    other = pdf.rename(pdf.with_suffix(".scan"))
    assert read_scan(other, page=1).shape == (900, 600)


def test_a_locked_pdf_is_named(pdf):
    pikepdf = pytest.importorskip("pikepdf")
    with pikepdf.open(pdf) as document:
        document.save(pdf.with_name("locked.pdf"), encryption=pikepdf.Encryption(owner="a", user="b"))
    with pytest.raises(InputError, match=r"locked\.pdf: it is locked by a password; save a copy without one"):
        read_scan(pdf.with_name("locked.pdf"), page=1)


def test_a_pdf_without_a_picture_is_ink_only(tmp_path):
    pytest.importorskip("pypdfium2")
    from reportlab.pdfgen import canvas

    typed = canvas.Canvas(str(tmp_path / "typed.pdf"))
    typed.drawString(100, 700, "typed")
    typed.save()
    with pytest.raises(InputError, match=r"typed\.pdf holds no picture of a page.*save it as a PNG"):
        read_scan(tmp_path / "typed.pdf")


def test_a_damaged_pdf_is_named(pdf):
    pdf.write_bytes(pdf.read_bytes()[:400])
    with pytest.raises(InputError, match="it is damaged; scan it again"):
        read_scan(pdf, page=1)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif", "a.pdf"])
def test_an_empty_file_is_named(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(InputError, match=r"it is empty \(0 bytes\)"):
        read_scan(tmp_path / name, dpi=300)


@pytest.mark.parametrize("name", ["a.jpg", "a.tif"])
def test_files_that_are_cut_off(tmp_path, name):
    noise = Image.fromarray(np.tile(RGB, (5, 5, 1)))
    path = saved(tmp_path, noise, name, dpi=(300, 300))
    path.write_bytes(path.read_bytes()[:9000])
    with pytest.raises(InputError, match="damaged or cut off"):
        read_scan(path)


def test_a_tiff_cut_off_between_its_pages(tmp_path, recwarn, caplog):
    pages = [Image.fromarray(RGB), Image.fromarray(RGB[::-1].copy())]
    path = saved(tmp_path, pages[0], "a.tif", save_all=True, append_images=pages[1:], dpi=(300, 300))
    one = saved(tmp_path, pages[0], "one.tif", dpi=(300, 300))
    path.write_bytes(path.read_bytes()[: one.stat().st_size + 20])
    assert count_pages(path) == 2
    with pytest.raises(InputError, match="damaged or cut off"):
        read_scan(path, page=2)
    assert not [one for one in recwarn if one.category is not ResourceWarning] and not caplog.records


def test_a_phones_own_format_is_named(tmp_path):
    (tmp_path / "a.jpg").write_bytes(b"\0\0\0\x18ftypheic" + bytes(100))
    with pytest.raises(InputError, match="a HEIC photograph: save it as JPEG"):
        read_scan(tmp_path / "a.jpg", dpi=300)


def test_a_fax_is_named(tmp_path):
    with pytest.raises(InputError, match=r"204 dpi across and 98 down.*300 dpi both ways"):
        read_scan(saved(tmp_path, Image.fromarray(RGB), "a.tif", dpi=(204, 98)))


def test_a_photograph_is_asked_for_its_resolution(tmp_path):
    tags = Image.Exif()
    tags[271] = "Maker"
    tags.get_ifd(0x8769)[33434] = 0.01
    path = saved(tmp_path, Image.fromarray(RGB), "a.jpg", exif=tags, dpi=(72, 72))
    with pytest.raises(InputError, match=r"is a photograph and says 72 dpi.*--dpi"):
        read_scan(path)
    assert picture_files.read_picture(path).photographed


@pytest.mark.parametrize("turned", range(1, 9))
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_pictures_are_shown_as_their_tag_says(tmp_path, turned, depth):
    """Pillow reads 8 bits, tifffile 16; both turn alike."""
    values = RGB.astype(depth) * (257 if depth is np.uint16 else 1)
    tags = [(274, 3, 1, turned, True)]
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="rgb", extratags=tags)
    want = ImageOps.exif_transpose(Image.open(saved(tmp_path, Image.fromarray(RGB), "b.png", exif=_tag(turned))))
    assert np.array_equal(read_scan(tmp_path / "a.tif", dpi=300).rgb, np.asarray(want))


def _tag(turned):
    tags = Image.Exif()
    tags[274] = turned
    return tags


def test_scans_finer_than_needed_are_reduced(tmp_path):
    fine = Image.fromarray(np.repeat(np.repeat(RGB, 2, axis=0), 2, axis=1))
    scan = read_scan(saved(tmp_path, fine, "a.png", dpi=(1200, 1200)))
    assert scan.dpi == 600 and np.array_equal(scan.rgb, RGB)


def test_a_resolution_that_makes_a_poster_of_a_page(tmp_path):
    with pytest.raises(InputError, match=r"640 × 744 mm.*--dpi 100.*at most 610.*A4.*--dpi 300"):
        read_scan(saved(tmp_path, Image.new("L", (2520, 2930), 255), "a.png", dpi=(300, 300)), dpi=100)
