import io
import json

import numpy as np
import pikepdf
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout import page_sizes
from handout.errors import InputError
from handout.inking.device_pixels import device_pixels
from handout.printing import media
from handout.sinks import picture_pdf as pdf
from handout.values import Page, Raster


def inked(width, height, dpi, origin, seed=0):
    """Pixels of which each is darker than paper, so that nothing of it can be cropped."""
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :3] = np.random.default_rng(seed).integers(0, 250, (height, width, 3)) / 255
    return device_pixels(Raster(rgba, dpi, origin))


def written(*pages, about=None):
    stream = io.BytesIO()
    writer = pdf.PdfWriter(stream, about)
    for page, raster in pages:
        writer.add(page, device_pixels(raster) if isinstance(raster, Raster) else raster)
    writer.finish()
    return stream.getvalue()


def pictures(page):
    return list(page.Resources.get("/XObject", {}).values())


def placing(page):
    """(left, top, width, height) of the page's one picture, in pt from the top left."""
    ((operands, _),) = [(o, op) for o, op in pikepdf.parse_content_stream(page) if str(op) == "cm"]
    a, b, c, d, e, f = map(float, operands)
    assert b == c == 0
    return e, float(page.mediabox[3]) - f - d, a, d


@pytest.mark.parametrize("name", sorted(page_sizes.NAMES))
@pytest.mark.parametrize("turn", ["", "left"])
def test_a_page_for_a_printer(name, turn):
    page, dpi = page_sizes.page(name), 600
    fed = media.turned_pixels(inked(30, 20, dpi, (37.31, 21.87)), page, turn)
    sheet = media.turned_page(page, turn)
    with pikepdf.open(io.BytesIO(written((sheet, fed)))) as document:
        assert document.Root.ViewerPreferences.PrintScaling == "/None"
        (found,) = document.pages
        assert list(map(float, found.mediabox)) == pytest.approx(
            [0, 0, sheet.width * 72 / 25.4, sheet.height * 72 / 25.4], abs=1e-5
        )
        assert set(found.Resources.keys()) == {"/XObject"} and len(pictures(found)) == 1
        (image,) = pictures(found)
        assert image.ColorSpace == "/DeviceRGB" and image.BitsPerComponent == 8
        kinds = {str(o.get("/Type")) for o in document.objects if isinstance(o, pikepdf.Dictionary)}
        assert not kinds & {"/Font", "/OutputIntent"}
        pixels = np.asarray(pikepdf.PdfImage(image).as_pil_image())
        assert np.array_equal(pixels, fed.rgb)
        left, top, width, height = (value * dpi / 72 for value in placing(found))
    assert (width, height) == pytest.approx((pixels.shape[1], pixels.shape[0]), abs=0.01)
    assert (left, top) == pytest.approx((round(left), round(top)), abs=0.01), "on the grid of the printer's pixels"
    assert (left / dpi * 25.4, top / dpi * 25.4) == pytest.approx(fed.origin, abs=0.51 * 25.4 / dpi)


@given(
    st.sampled_from([300, 360, 600, 720]),
    st.tuples(st.integers(0, 40), st.integers(0, 40), st.integers(1, 20), st.integers(1, 20)),
)
def test_only_the_ink_is_stored_and_it_lies_where_it_was(dpi, box):
    x, y, width, height = box
    rgba = np.zeros((64, 64, 4), dtype=np.float32)
    rgba[y : y + height, x : x + width, 3] = 1
    with pikepdf.open(io.BytesIO(written((Page(100, 60), Raster(rgba, dpi, (12.7, 25.4)))))) as document:
        (image,) = pictures(document.pages[0])
        left, top, *_ = placing(document.pages[0])
    assert (image.Width, image.Height) == (width, height)
    assert (left * dpi / 72, top * dpi / 72) == pytest.approx((0.5 * dpi + x, dpi + y), abs=0.01)


def test_transparency_is_mixed_with_white():
    rgba = np.zeros((1, 2, 4), dtype=np.float32)
    rgba[0, 0] = (0, 0, 0, 1)
    rgba[0, 1] = (1, 0, 0, 0.5)
    with pikepdf.open(io.BytesIO(written((Page(50, 50), Raster(rgba, 300))))) as document:
        (image,) = pictures(document.pages[0])
        assert image.read_bytes() == bytes([0, 0, 0, 255, 127, 127])


@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_a_page_without_ink_has_no_picture(alpha):
    white = Raster(np.full((9, 9, 4), (1, 1, 1, alpha), dtype=np.float32), 300)
    for raster in (white, None):
        with pikepdf.open(io.BytesIO(written((Page(50, 50), raster)))) as document:
            assert len(document.pages) == 1 and not pictures(document.pages[0])


def test_the_same_pages_give_the_same_bytes_and_keep_what_they_are_about():
    about = {"seed": 7, "hand": "hause (\\alt) é"}
    pages = [(page_sizes.page("dl"), inked(20, 10, 300, (50, 50), seed)) for seed in range(3)]
    first, second = (written(*pages, about=about) for _ in range(2))
    assert first == second
    with pikepdf.open(io.BytesIO(first)) as document:
        assert len(document.pages) == 3
        assert json.loads(str(document.docinfo["/Subject"])) == about
        assert "/CreationDate" not in document.docinfo and "/ID" not in document.trailer


def test_the_file_is_sound(tmp_path):
    path = tmp_path / "a.pdf"
    with pdf.document(path) as document:
        for n in range(12):
            document.add(page_sizes.page("c6"), inked(8, 8, 300, (20 + n, 20), n))
    with pikepdf.open(path) as found:
        assert found.check_pdf_syntax() == [] and len(found.pages) == 12


def test_nothing_is_left_of_a_file_that_was_not_finished(tmp_path):
    with pytest.raises(KeyboardInterrupt), pdf.document(tmp_path / "a.pdf") as document:
        document.add(page_sizes.page("c6"), inked(8, 8, 300, (20, 20)))
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match="Cannot write"), pdf.document(tmp_path / "none" / "a.pdf"):
        pass
