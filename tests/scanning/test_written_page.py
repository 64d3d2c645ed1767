import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree
from scribbles import coverage, lines_of, page, scan_of

from handout.errors import InputError
from handout.scanning.density import pooled_scale
from handout.scanning.scan import Scan
from handout.scanning.written_page import find_ink, prepare, read_page


@pytest.mark.slow
def test_a_page_is_read(tmp_path):
    scan = page(4)
    path = tmp_path / "page.png"
    Image.fromarray(scan.rgb).save(path, dpi=(300, 300))
    read = read_page(path)
    assert len(read.text_lines.lines) == 4
    assert read.notes == ()
    assert read.density.values.shape == read.mask.ink.shape == read.matte.rgba.shape[:2] == scan.shape
    on = np.rint(read.graph.uv).astype(int)
    assert read.mask.ink[on[:, 1], on[:, 0]].mean() > 0.98
    again = read_page(path)
    assert np.array_equal(read.graph.xy, again.graph.xy)
    assert np.array_equal(read.matte.rgba, again.matte.rgba)


@pytest.mark.slow
def test_the_files_resolution_is_doubted(tmp_path):
    path = tmp_path / "page.png"
    Image.fromarray(page(4).rgb).save(path, dpi=(1200, 1200))
    with pytest.raises(InputError, match=r"not the size of handwriting.*--dpi"):
        read_page(path)


def test_the_users_resolution_is_doubted_too():
    with pytest.raises(InputError, match=r"at 1200 dpi.*not the size.*0\.8–9 mm.*--dpi is wrong.*perhaps 300"):
        read_page(Scan(page(4).rgb, 1200.0))


def test_thin_strokes_are_named():
    with pytest.raises(InputError, match=r"strokes are 1\.\d pixels wide, and need 2: scan at a higher resolution"):
        read_page(scan_of(coverage(lines_of(4, 100.0), 100.0, 48.0, 110.0, pen=0.3), 110.0))


@pytest.mark.slow
def test_a_fine_pen_at_300_dpi_is_read_enlarged():
    fine = [read_page(scan_of(coverage(lines_of(2, 100.0), 100.0, 30.0, dpi, pen=0.08), dpi)) for dpi in (300.0, 600.0)]
    assert "read enlarged to twice its size" in fine[0].notes[0] and not fine[1].notes
    assert [page.scan.dpi for page in fine] == [600, 600]
    away, _ = cKDTree(fine[1].graph.xy).query(fine[0].graph.xy)
    assert np.median(away) < 0.05 and np.percentile(away, 99) < 0.25  # mm
    assert abs(np.median(fine[0].graph.radius) / np.median(fine[1].graph.radius) - 1) < 0.35


@pytest.mark.slow
def test_pages_may_share_a_scale():
    own = [prepare(page(4)), prepare(page(3, colour=(0.6, 0.6, 0.7)))]
    scale = pooled_scale([one.scale for one in own])
    levels = np.linspace(0.1, 1.5, 9)
    found = [find_ink(one, scale=scale).density.scale.density(levels) for one in own]
    assert np.array_equal(*found)
    assert np.abs(find_ink(own[0]).density.scale.density(levels) - found[0]).max() > 0.005


@pytest.mark.slow
def test_a_page_can_be_turned():
    scan = page(4)
    lying = prepare(Scan(np.rot90(scan.rgb, -1), scan.dpi))
    assert len(find_ink(lying.turn_quarters(1)).text_lines.lines) == 4


def test_blank_page_is_named():
    with pytest.raises(InputError, match="nothing but paper"):
        read_page(Scan(np.full((600, 500, 3), 250, dtype=np.uint8), 300.0))
