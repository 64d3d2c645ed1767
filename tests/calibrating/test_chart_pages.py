"""Charts and strips on their way to a printer: every pixel arrives, turned as the printer is fed."""

from functools import partial

import msgspec
import numpy as np
import pytest
from PIL import Image

from handout.calibrating import pages
from handout.calibrating.pages import DevicePages
from handout.errors import InputError
from handout.printing.queue import FolderQueue
from handout.simulated import print_and_scan
from handout.values import Page

DPI = 72
SHEET = Page(50.8, 76.2)


@pytest.fixture
def made():
    drawn = np.random.default_rng(2).integers(0, 256, (2, 216, 144, 3), dtype=np.uint8)
    return DevicePages(SHEET, [partial(np.asarray, page) for page in drawn], DPI, {"chart": 1})


@pytest.mark.parametrize(
    ("feed", "turn", "quarters"), [("short", "left", 0), ("long", "left", 1), ("long", "right", -1)]
)
def test_what_is_sent_is_the_pixels(feed, turn, quarters, made, profile, tmp_path):
    fed = msgspec.structs.replace(profile, feed=feed, turn=turn)
    names = pages.send(made, fed, FolderQueue(tmp_path))
    assert names == ("chart-1", "chart-2")
    for name, draw in zip(names, made.pixels, strict=True):
        ((sheet, sent),) = print_and_scan.pages(tmp_path / f"{name}.pdf", DPI)
        assert np.array_equal(sent, np.rot90(draw(), quarters))
        assert (sheet.width > sheet.height) == bool(quarters)


def test_a_queue_that_takes_pictures(made, profile, tmp_path):
    pages.send(made, profile, FolderQueue(tmp_path, "png"))
    with Image.open(tmp_path / "chart-2.png") as sent:
        assert np.array_equal(np.asarray(sent), made.pixels[1]())


def test_files(made, tmp_path):
    assert [path.name for path in pages.write(made, tmp_path / "strip.png")] == ["strip-1.png", "strip-2.png"]
    (path,) = pages.write(made, tmp_path / "strip.pdf")
    for (_, sent), draw in zip(print_and_scan.pages(path, DPI), made.pixels, strict=True):
        assert np.array_equal(sent, draw())
    with pytest.raises(InputError, match=r"as \.pdf or \.png"):
        pages.write(made, tmp_path / "strip.svg")
