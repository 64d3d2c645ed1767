import ctypes
import ctypes.util
import os
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from handout.inking.device_pixels import device_pixels
from handout.printing import documents
from handout.values import Page, Raster

SHEET = Page(110, 220)


def unpacked(data, width, height):
    """The pixels of compressed lines, by the rule of PWG 5102.4: an independent reader."""
    rows, at = [], 0
    while len(rows) < height:
        repeats, line = data[at] + 1, b""
        at += 1
        while len(line) < 3 * width:
            count = data[at]
            assert count != 128
            if count < 128:
                line += data[at + 1 : at + 4] * (count + 1)
                at += 4
            else:
                size = 3 * (257 - count)
                line += data[at + 1 : at + 1 + size]
                at += 1 + size
        assert len(line) == 3 * width
        rows += [line] * repeats
    assert at == len(data) and len(rows) == height
    return np.frombuffer(b"".join(rows), np.uint8).reshape(height, width, 3)


# few colours, so that there are runs; wide enough for more than one run of the greatest length
PICTURES = st.tuples(st.integers(1, 9), st.integers(1, 300)).flatmap(
    lambda size: hnp.arrays(np.uint8, (*size, 3), elements=st.sampled_from([0, 7, 255]))
)


@given(PICTURES)
def test_lines_come_back(pixels):
    height, width = pixels.shape[:2]
    assert np.array_equal(unpacked(documents.pwg(pixels, 300, SHEET)[4 + 1796 :], width, height), pixels)
    assert np.array_equal(unpacked(documents.urf(pixels, 300)[12 + 32 :], width, height), pixels)


@pytest.mark.parametrize("width", [1, 2, 127, 128, 129, 256, 257, 300])
@pytest.mark.parametrize("height", [1, 255, 256, 257, 600])
def test_runs_of_every_length(width, height):
    row = np.random.default_rng(1).integers(0, 255, (1, width, 3), np.uint8)
    for pixels in (np.repeat(row, height, 0), np.full((height, width, 3), 255, np.uint8)):
        assert np.array_equal(unpacked(documents.pwg(pixels, 300, SHEET)[1800:], width, height), pixels)


def test_the_header_says_what_the_page_is():
    data = documents.pwg(np.zeros((20, 10, 3), np.uint8), 300, SHEET, "iso_dl_110x220mm")
    assert data[:4] == b"RaS2" and data[4:13] == b"PwgRaster"
    header = data[4:1800]
    numbers = {at: struct.unpack_from(">I", header, at)[0] for at in range(256, 516, 4)}
    assert (numbers[276], numbers[280], numbers[372], numbers[376]) == (300, 300, 10, 20)
    assert (numbers[352], numbers[356]) == (312, 624)  # points
    assert (numbers[384], numbers[388], numbers[392], numbers[396], numbers[400]) == (8, 24, 30, 0, 19)
    assert numbers[420] == 3 and header[1732:1749] == b"iso_dl_110x220mm\0"
    assert data[1800] == 19  # twenty equal lines are one
    assert len(documents.urf(np.zeros((20, 10, 3), np.uint8), 300)) == 12 + 32 + 1 + 4


def test_ink_lies_where_it_was_and_ends_at_the_edge():
    rgba = np.ones((10, 20, 4), np.float32)
    rgba[..., :3] = 0.2
    pixels = documents.page_pixels(Page(50.8, 25.4), device_pixels(Raster(rgba, 100, (12.7, 5.08))))
    assert pixels.shape == (100, 200, 3)
    dark = np.argwhere(pixels[..., 0] < 255)
    assert dark.min(0).tolist() == [20, 50] and dark.max(0).tolist() == [29, 69]
    beyond = documents.page_pixels(Page(50.8, 25.4), device_pixels(Raster(rgba, 100, (50.8 - 2.54, -1.27))))
    dark = np.argwhere(beyond[..., 0] < 255)
    assert dark.min(0).tolist() == [0, 190] and dark.max(0).tolist() == [4, 199]
    assert (documents.page_pixels(Page(50.8, 25.4), device_pixels(Raster(rgba, 100, (80, 80)))) == 255).all()
    assert (documents.page_pixels(Page(50.8, 25.4), device_pixels(Raster(rgba * 0, 100))) == 255).all()


class Header(ctypes.Structure):
    """As much of CUPS' page header as is looked at."""

    _fields_ = (("before", ctypes.c_char * 276), ("dpi", ctypes.c_uint * 2), ("more", ctypes.c_char * 1512))


@pytest.mark.parametrize("kind", ["pwg", "urf"])
def test_cups_own_reader_reads_it(tmp_path, kind):
    name = ctypes.util.find_library("cupsimage")
    if name is None:
        pytest.skip("CUPS' raster library (Debian: libcupsimage2) is not installed")
    library = ctypes.CDLL(name)
    library.cupsRasterOpen.restype = ctypes.c_void_p
    rng = np.random.default_rng(2)
    rgba = np.ones((150, 300, 4), np.float32)
    rgba[..., :3] = np.repeat(rng.random((150, 100, 3)), 3, axis=1)
    pixels = device_pixels(Raster(rgba, 300, (30, 40)))
    path = tmp_path / "page"
    path.write_bytes(documents.WRITERS[kind](SHEET, pixels, {}))
    expected = documents.page_pixels(SHEET, pixels)
    descriptor = os.open(path, os.O_RDONLY)
    try:
        stream = ctypes.c_void_p(library.cupsRasterOpen(descriptor, 0))
        header = Header()
        assert library.cupsRasterReadHeader2(stream, ctypes.byref(header)) == 1
        raw = bytes(header)
        width, height, _, _, bits, line = struct.unpack_from("=6I", raw, 372)
        assert (
            tuple(header.dpi) == (300, 300)
            and (height, width) == expected.shape[:2]
            and (bits, line) == (24, 3 * width)
        )
        buffer = ctypes.create_string_buffer(line)
        rows = []
        for _ in range(height):
            assert library.cupsRasterReadPixels(stream, buffer, line) == line
            rows.append(buffer.raw)
        library.cupsRasterClose(stream)
    finally:
        os.close(descriptor)
    assert np.array_equal(np.frombuffer(b"".join(rows), np.uint8).reshape(expected.shape), expected)
