from __future__ import annotations

import warnings

import numpy as np
import pytest
from formula_printers import dull, dull_table, identical, scanned
from PIL import Image

from handout.colour import conversions, exports
from handout.colour.models import fit
from handout.colour.models.forward import lattice
from handout.colour.table import ColourTable, build, load, save
from handout.errors import InputError

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow

RNG = np.random.default_rng(8)


@pytest.fixture(scope="module")
def table() -> ColourTable:
    return dull_table()


def test_an_identical_printer_has_the_identical_table() -> None:
    made = build(fit(scanned(identical)), size=17)
    np.testing.assert_allclose(made.nodes.reshape(-1, 3), lattice(17), atol=3e-3)
    colours = RNG.random((500, 3))
    np.testing.assert_allclose(made(colours), colours, atol=3e-3)


def test_wanted_colours_come_out_through_the_table(table: ColourTable) -> None:
    sent = RNG.random((1000, 3))
    off = conversions.delta_e(conversions.lab(dull(table(dull(sent)))), conversions.lab(dull(sent)))
    assert off.mean() < 0.2 and np.percentile(off, 95) < 0.5
    greys = dull(np.repeat(np.linspace(0, 1, 200)[:, None], 3, axis=1))
    off = conversions.delta_e(conversions.lab(dull(table(greys))), conversions.lab(greys))
    assert np.percentile(off, 95) < 0.4


def test_grey_ramps_rise_and_nodes_are_not_clamped(table: ColourTable) -> None:
    ramp = dull(np.repeat(np.linspace(0, 1, 256)[:, None], 3, axis=1))
    assert (np.diff(table.interpolate(ramp), axis=0) > 0).all()
    assert table.nodes.min() < -0.01 and table.nodes.max() > 1.01
    assert table(lattice(9)).min() == 0 and table(lattice(9)).max() == 1
    np.testing.assert_allclose(table.paper, [0.95, 0.93, 0.86], atol=2e-3)


def test_saved_and_read_again(table: ColourTable, tmp_path) -> None:
    path = tmp_path / "epson.table"
    save(table, path)
    first = path.read_bytes()
    again = load(path)
    np.testing.assert_array_equal(again.nodes, table.nodes)
    np.testing.assert_array_equal(again.scanned, table.scanned)
    assert again.about == table.about and again.about["method"] == "forward" and again.about["version"]
    save(again, path)
    assert path.read_bytes() == first
    assert [file.name for file in tmp_path.iterdir()] == ["epson.table"]


@pytest.mark.parametrize("content", [b"", b"not a table", b"PK\x03\x04 broken"])
def test_other_files_are_refused(content: bytes, tmp_path) -> None:
    path = tmp_path / "other"
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a colour table"):
        load(path)


def test_missing_cut_short_newer_or_foreign_files_are_refused(table: ColourTable, tmp_path) -> None:
    with pytest.raises(InputError, match="No such file"):
        load(tmp_path / "nothing")
    path = tmp_path / "t"
    save(table, path)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(InputError, match="not a colour table"):
        load(path)
    for about, message in ((b'{"format": 9}', "of format 9"), (b"[1]", "not a colour table"), (b"{", "not a colour")):
        with path.open("wb") as stream:
            np.savez(stream, nodes=table.nodes, seen=table.scanned, about=np.frombuffer(about, dtype=np.uint8))
        with pytest.raises(InputError, match=message):
            load(path)
    with path.open("wb") as stream:
        np.savez(stream, nodes=table.nodes)
    with pytest.raises(InputError, match="not a colour table"):
        load(path)
    with pytest.raises(InputError, match="numbers from -10 to 10"):
        ColourTable(table.nodes, table.scanned * np.float32(1e30))
    with pytest.raises(InputError, match="Cannot write"):
        save(table, tmp_path / "no" / "folder")


def test_wrong_arrays_and_sizes_are_refused(table: ColourTable) -> None:
    with pytest.raises(InputError, match="nodes must be numbers"):
        ColourTable(table.nodes[:-1], table.scanned)
    with pytest.raises(InputError, match="scanned must be numbers"):
        ColourTable(table.nodes, np.full_like(table.scanned, np.nan))
    with pytest.raises(InputError, match="200 nodes a side"):
        build(fit(scanned(identical)), size=200)


def test_cube_as_colour_science_reads_it(table: ColourTable, tmp_path) -> None:
    path = tmp_path / "table.cube"
    path.write_bytes(exports.cube(table))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
        from colour.algebra import table_interpolation_tetrahedral

        lut = colour.read_LUT(str(path))
    np.testing.assert_allclose(lut.table, table.nodes, atol=1e-6)
    wanted = dull(RNG.random((50, 3)))
    theirs = lut.apply(wanted, interpolator=table_interpolation_tetrahedral)
    np.testing.assert_allclose(table.interpolate(wanted), theirs, atol=1e-5)


def test_picture_shows_wanted_over_sent(table: ColourTable, tmp_path) -> None:
    sheet = exports.picture(table)
    assert sheet.shape == (5 * 100, 11 * 51, 3)
    np.testing.assert_array_equal(sheet[48, 48], [255, 255, 0])
    np.testing.assert_array_equal(sheet[49 + 20, 20], np.rint(255 * np.clip(table.nodes[20, 20, 0], 0, 1)))
    (tmp_path / "t.png").write_bytes(exports.png(table))
    assert Image.open(tmp_path / "t.png").size == (11 * 51 * 4, 5 * 100 * 4)
