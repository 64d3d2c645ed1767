import numpy as np
import pytest
from PIL import Image
from scribbles import page

from handout.errors import InputError
from handout.scanning.page import Scan
from handout.scanning.reading import read_page


def test_a_page_is_read(tmp_path):
    scan = page(4)
    path = tmp_path / "page.png"
    Image.fromarray(scan.rgb).save(path, dpi=(300, 300))
    read = read_page(path)
    assert len(read.rules.lines) == 4
    assert read.notes == ()
    assert read.density.values.shape == read.mask.ink.shape == read.matte.rgba.shape[:2] == scan.shape
    assert set(read.seconds) == {"scan", "paper", "density", "mask", "rules", "graph", "matte"}
    on = np.rint(read.graph.uv).astype(int)
    assert read.mask.ink[on[:, 1], on[:, 0]].mean() > 0.98
    again = read_page(path)
    assert np.array_equal(read.graph.xy, again.graph.xy)
    assert np.array_equal(read.matte.rgba, again.matte.rgba)


def test_the_files_resolution_is_doubted(tmp_path):
    path = tmp_path / "page.png"
    Image.fromarray(page(4).rgb).save(path, dpi=(1200, 1200))
    with pytest.raises(InputError, match=r"not the size of handwriting.*--dpi"):
        read_page(path)


def test_the_users_resolution_is_believed():
    read = read_page(Scan(page(4).rgb, 1200.0))
    assert "1200" in read.notes[0]


def test_blank_page_is_named():
    with pytest.raises(InputError, match="nothing but paper"):
        read_page(Scan(np.full((600, 500, 3), 250, dtype=np.uint8), 300.0))
