"""The chart as a PDF: its pixels reach the printer unchanged."""

import io
import zlib
from datetime import date

import numpy as np
import pikepdf
import pytest

import handout
from handout import profiles
from handout.calibrating import pages
from handout.calibrating.pages import chart_for
from handout.colour import cgats
from handout.colour.chart import chart
from handout.colour.chart_files import render
from handout.errors import DoesNotFit, InputError
from handout.profiles import Length, Margins, Printer


@pytest.fixture(scope="module")
def printer():
    return Printer(kind="printer", title="X", dpi=360, margins=Margins())


@pytest.mark.slow
def test_one_picture_a_page_pixel_for_pixel(printer, tmp_path):
    made = chart("letter", pages=2)
    printed = pages.chart_pages(made, printer, "x/plain")
    paths = pages.write(printed, tmp_path / "chart.pdf")
    assert [path.name for path in paths] == ["chart.pdf", "chart.ti1", "chart.ti2"]
    with pikepdf.open(paths[0]) as document:
        assert len(document.pages) == 2
        for page, drawn in zip(document.pages, made.pages, strict=True):
            (image,) = page.Resources.XObject.values()
            assert str(image.ColorSpace) == "/DeviceRGB"
            assert [float(v) for v in page.MediaBox] == pytest.approx([0, 0, 612, 792], abs=1e-4)
            wanted = render(drawn, 360, (f"x/plain   {date.today()}   handout {handout.__version__}",))
            assert (int(image.Height), int(image.Width)) == wanted.shape[:2]
            data = np.frombuffer(zlib.decompress(io.BytesIO(image.read_raw_bytes()).read()), dtype=np.uint8)
            assert np.array_equal(data.reshape(wanted.shape), wanted)


def test_tables_beside_it(printer, tmp_path):
    made = chart("A4")
    _, first, second = pages.write(pages.chart_pages(made, printer, "x/plain"), tmp_path / "c.pdf")
    (ti1, extremes, combinations), (ti2,) = cgats.read_tables(first), cgats.read_tables(second)
    assert (len(extremes.rows), len(combinations.rows)) == (8, 9)
    assert (ti1.kind, len(ti1.rows), ti1.get("COLOR_REP")) == ("CTI1", 760, "iRGB")
    assert (ti2.kind, len(ti2.rows)) == ("CTI2", 935)
    sent = ti2.numbers("RGB_R", "RGB_G", "RGB_B")
    assert np.array_equal(sent / 100, made.pages[0].device) or np.allclose(sent / 100, made.pages[0].device, atol=1e-15)
    assert ti2.rows[0][ti2.fields.index("SAMPLE_LOC")] == made.pages[0].names[0]


def test_the_same_chart_gives_the_same_bytes(printer, tmp_path):
    for name in ("a.pdf", "b.pdf"):
        pages.write(pages.chart_pages(chart("A4"), printer, "x/plain"), tmp_path / name)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


def test_every_printer_gets_a_chart_within_its_margins():
    for name in profiles.names("printer"):
        printer = profiles.find(name, "printer")
        for paper in ("A4", "letter"):
            left, top, right, bottom = (made := chart_for(printer, paper)).pages[0].bounds
            assert left >= printer.margins.left and top >= printer.margins.top
            assert made.paper.width - right >= printer.margins.right
            assert made.paper.height - bottom >= printer.margins.bottom


def test_margins_decide_how_many_pages():
    def printer(mm):
        return Printer(kind="printer", title="X", dpi=600, margins=Margins(bottom=Length(mm)))

    # what is left under the frame for the pen
    assert [len(chart_for(printer(mm)).pages) for mm in (5, 10.2, 10.3, 23.7)] == [1, 1, 2, 2]
    with pytest.raises(DoesNotFit, match=r"bottom of A4 .* cannot print on 60.0 mm"):
        chart_for(printer(60))
    with pytest.raises(DoesNotFit, match="or the chart in 2 pages"):
        chart_for(printer(23.7), pages=1)


def test_a_file_of_another_kind(printer, tmp_path):
    with pytest.raises(InputError, match=r"as \.pdf or \.png"):
        pages.write(pages.chart_pages(chart("A4"), printer, "x/plain"), tmp_path / "chart.tif")
    assert list(tmp_path.iterdir()) == []
