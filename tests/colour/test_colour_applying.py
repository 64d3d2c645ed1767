from __future__ import annotations

import numpy as np
import pytest
from formula_printers import dull, dull_table, identical, scanned

from handout.colour.models import fit
from handout.colour.table import ColourTable, apply, build
from handout.values import Raster

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow

RNG = np.random.default_rng(9)


@pytest.fixture(scope="module")
def table() -> ColourTable:
    return dull_table(33)


@pytest.fixture(scope="module")
def same() -> ColourTable:
    return build(fit(scanned(identical)), size=33)


def ink(share: float = 0.3) -> Raster:
    rgba = RNG.random((40, 60, 4)).astype(np.float32)
    rgba[..., :3] = 0.25 + 0.4 * rgba[..., :3]
    rgba[..., 3] *= RNG.random((40, 60)) < share
    return Raster(rgba, 300, (1.5, 2.5))


def on_white(rgba: np.ndarray) -> np.ndarray:
    return np.asarray(1 - rgba[..., 3:] * (1 - rgba[..., :3]))


def test_cover_is_kept_and_bare_pixels_are_not_touched(same: ColourTable) -> None:
    raster = ink()
    done = apply(raster, same)
    bare = raster.rgba[..., 3] == 0
    np.testing.assert_array_equal(done.rgba[bare], raster.rgba[bare])
    np.testing.assert_array_equal(done.rgba[..., 3], raster.rgba[..., 3])
    np.testing.assert_allclose(on_white(done.rgba / 255), on_white(raster.rgba / 255), atol=3e-3 + 0.5 / 255)
    assert (done.dpi, done.origin) == (raster.dpi, raster.origin)


def test_print_scans_as_the_ink_laid_on_the_paper(table: ColourTable) -> None:
    raster = ink()
    done = apply(raster, table)
    inked = raster.rgba[..., 3] > 0
    assert (done.rgba[..., 3] >= raster.rgba[..., 3]).all()
    rgba = raster.rgba[inked] / 255
    wanted = table.paper + rgba[:, 3:] * (rgba[:, :3] - table.paper)
    shown = dull(on_white(done.rgba[inked] / 255))
    assert np.abs(shown - wanted).mean() < 0.5 / 255 and np.abs(shown - wanted).max() < 4 / 255
    plain = dull(on_white(rgba))
    assert np.abs(plain - wanted).mean() > 5 / 255


def test_next_to_no_ink_prints_next_to_nothing(table: ColourTable) -> None:
    rgba = np.zeros((1, 50, 4), dtype=np.float32)
    rgba[0, :, 3] = np.geomspace(1e-6, 0.02, 50)
    sent = on_white(apply(Raster(rgba, 300), table).rgba / 255)
    assert 1 - sent[0, 0].min() < 1e-5
    assert (np.diff(sent[0], axis=0) <= 1e-6).all()


def test_an_empty_page_stays(table: ColourTable) -> None:
    raster = Raster(np.zeros((5, 4, 4), dtype=np.float32), 300)
    np.testing.assert_array_equal(apply(raster, table).rgba, raster.rgba)
