from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from sample_drawings import CARD, loops

from handout.inking import plain
from handout.inking.outline import areas
from handout.sinks.eps import outlines_eps, to_eps
from handout.values import Array, Drawing, Raster

GHOSTSCRIPT = shutil.which("gs")
needs_ghostscript = pytest.mark.skipif(GHOSTSCRIPT is None, reason="the program gs (Ghostscript) is not installed")


def box(text: str) -> list[float]:
    found = re.search(r"%%HiResBoundingBox: (.*)", text)
    assert found is not None
    return [float(side) for side in found[1].split()]


def ghostscript(data: bytes, folder: Path, *options: str) -> str:
    assert GHOSTSCRIPT is not None
    (folder / "page.eps").write_bytes(data)
    call = [GHOSTSCRIPT, "-q", "-dNOPAUSE", "-dBATCH", "-dSAFER", *options, str(folder / "page.eps")]
    done = subprocess.run(call, capture_output=True, text=True, timeout=60, check=True)
    return done.stderr


@needs_ghostscript
@pytest.mark.parametrize("varied", [False, True])
def test_ghostscript_finds_the_ink_where_the_file_says(tmp_path: Path, varied: bool) -> None:
    drawing = loops(2)
    if varied:
        strokes = tuple(replace(s, width=np.linspace(0.3, 1.5, len(s.t))) for s in drawing.strokes)
        drawing = replace(drawing, strokes=strokes)
    data = to_eps(drawing, pen_width=0.6, show_travel=True)
    assert box(data.decode()) == pytest.approx(box(ghostscript(data, tmp_path, "-sDEVICE=bbox")), abs=0.15)


@needs_ghostscript
def test_it_looks_as_the_picture_does(tmp_path: Path) -> None:
    drawing, dpi = loops(3), 300
    width, height = round(90 / 25.4 * dpi), round(40 / 25.4 * dpi)
    shown = tmp_path / "page.png"
    even = ("-sDEVICE=pnggray", f"-r{dpi}", f"-g{width}x{height}", "-dGraphicsAlphaBits=4", f"-sOutputFile={shown}")
    ghostscript(to_eps(drawing, pen_width=0.6, colour="#000000"), tmp_path, *even)
    there, here = 1 - np.asarray(Image.open(shown)) / 255, plain.coverage(drawing, dpi, width=0.6) / 255
    assert there.sum() == pytest.approx(here.sum(), rel=0.05)
    assert np.abs(there - here[:height, :width]).mean() < 0.1 * here.mean()


def test_travel_by_a_pot_is_drawn_and_within_the_box() -> None:
    drawing = loops(2)
    way = {
        "name": "dip",
        "stroke": 1,
        "way": [[10.0, 10.0], [88.0, 2.0], [85.0, 2.0], [20.0, 20.0]],
        "down": [[88.0, 2.0]],
    }
    text = to_eps(replace(drawing, about={"hooks": [way]}), show_travel=True).decode()
    assert "10 10 m 88 2 l 85 2 l 20 20 l S" in text
    _, _, right, top = box(text)
    assert [right, top] == pytest.approx([88 * 72 / 25.4, (CARD.height - 2) * 72 / 25.4], abs=0.01)


def test_head_and_lines_are_as_the_conventions_have_them() -> None:
    drawing = replace(loops(6), about={"title": "Grüße (an \\ Ada) 你"})
    text = to_eps(drawing).decode("ascii")
    assert text.startswith("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: ") and text.endswith("%%EOF\n")
    assert "%%Title: (Gr\\374\\337e \\050an \\134 Ada\\051 ?)\n" in text
    assert max(map(len, text.splitlines())) <= 255
    whole = re.search(r"%%BoundingBox: (-?\d+) (-?\d+) (-?\d+) (-?\d+)\n", text)
    assert whole is not None
    around = [int(side) for side in whole.groups()]
    assert (
        np.abs(np.subtract(around, box(text))).max() < 1
        and (np.subtract(around, box(text)) * [1, 1, -1, -1] <= 0).all()
    )
    assert "%%BoundingBox: 0 0 0 0" in to_eps(Drawing((), CARD)).decode()


def ring(alpha: float, colour: tuple[float, float, float], at: tuple[float, float]) -> Array:
    """(200, 400, 4): a ring of radius 3 mm, a line of 0.5 mm, at 10 pixels a mm, with soft edges."""
    y, x = np.mgrid[:200, :400] / 10 + 0.05
    off = np.abs(np.hypot(x - at[0], y - at[1]) - 3)
    cover = np.clip((0.25 - off) / 0.1 + 0.5, 0, 1) * alpha
    return np.dstack([*(np.full(off.shape, part) for part in colour), cover])


def test_scanned_ink_becomes_outlines_with_holes_by_their_inks(tmp_path: Path) -> None:
    dark, pale = ring(0.9, (0.1, 0.1, 0.9), (6, 8)), ring(0.3, (0.9, 0.1, 0.1), (25, 8))
    both = np.where((dark[..., 3:] > pale[..., 3:]), dark, pale).astype(np.float32)
    both[150:190, 50:350] = (0.1, 0.1, 0.9, 1.0)
    (blue, (*blues, block)), (red, reds) = areas(Raster(both, 254.0, (1.0, 2.0)))
    assert [block.min(axis=0), block.max(axis=0)] == [
        pytest.approx([6, 17], abs=0.06),
        pytest.approx([36, 21], abs=0.06),
    ]
    for outlines, middle in ((blues, (7, 10)), (reds, (26, 10))):
        radii = [np.hypot(*(outline - middle).T) for outline in outlines]
        assert sorted(radius.mean() for radius in radii) == pytest.approx([2.75, 3.25], abs=0.02)
        assert all(np.ptp(radius) < 0.05 for radius in radii)
        turns = [np.sign(np.linalg.det(np.stack([o[:-1] - middle, np.diff(o, axis=0)], 1)).sum()) for o in outlines]
        assert sorted(turns) == [-1, 1]
    assert int(blue[5:], 16) > int(blue[1:3], 16) and int(red[1:3], 16) > int(red[5:], 16)
    assert areas(Raster(np.zeros((5, 5, 4), np.float32), 254.0)) == []
    if GHOSTSCRIPT:
        data = outlines_eps(loops(), [(blue, blues), (red, reds)])
        assert box(data.decode()) == pytest.approx(box(ghostscript(data, tmp_path, "-sDEVICE=bbox")), abs=0.15)
