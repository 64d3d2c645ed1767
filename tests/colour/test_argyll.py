"""ArgyllCMS takes the tables of the chart and of its scan."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from formula_printers import chart as sheet
from formula_printers import dull
from PIL import Image

from handout.colour import cgats, conversions
from handout.colour.chart import ChartPage, chart
from handout.colour.chart_files import DEVICE, XYZ, render, ti1, ti2, ti3
from handout.colour.models.forward import Patches

DPI = 100


def run(folder: Path, name: str, *arguments: str, given: str = "") -> str:
    """What a program of ArgyllCMS says, in a folder."""
    if shutil.which(name) is None:
        pytest.skip(f"{name} of ArgyllCMS is not on PATH; install the package argyll")
    done = subprocess.run([name, *arguments], cwd=folder, input=given, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout[-500:] + done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_colprof_makes_a_profile_of_our_ti3(tmp_path) -> None:
    patches = Patches(sheet(), dull(sheet()), np.full(len(sheet()), np.nan))
    cgats.write(tmp_path / "scan.ti3", ti3(patches, {"PRINTER": 'a "formula"', "PAPER": "cream"}))
    said = run(tmp_path, "colprof", "-v", "-ql", "-bn", "scan")
    assert f"No of test patches = {len(patches)}" in said
    found = re.search(r"peak err = ([\d.]+), avg err = ([\d.]+)", said)
    assert found is not None and float(found[1]) < 5 and float(found[2]) < 1, said[-300:]
    white = run(tmp_path, "xicclu", "-v0", "-ff", "-ia", "-pX", "scan.icc", given="1 1 1\n")
    np.testing.assert_allclose(
        [float(v) for v in white.split()[:3]], conversions.xyz_d50(dull(np.ones((1, 3))))[0], atol=1.5
    )


@pytest.mark.parametrize("pages", [1, 2])
def test_printtarg_lays_out_our_ti1(pages: int, tmp_path) -> None:
    made = chart(pages=pages)
    cgats.write(tmp_path / "chart.ti1", ti1(made))
    run(tmp_path, "printtarg", "-i", "SS", "-r", "-p", "A4", "chart")
    laid = cgats.read_tables(tmp_path / "chart.ti2")[0]
    colours = laid.numbers(*DEVICE) / 100
    assert len(colours) >= len(made.colours)
    away = np.abs(made.colours[:, None] - colours[None]).max(axis=2).min(axis=1)
    assert away.max() < 1e-4


def recognition(page: ChartPage) -> str:
    """Where scanin finds each patch of an upright page, in pixels, as a .cht."""
    x0, y0, x1, y1 = page.bounds
    corners = " ".join(f"{v * DPI / 25.4:.3f}" for v in (x0, y0, x1, y0, x1, y1, x0, y1))
    lines = [f"BOXES {len(page.names)}", f"  F _ _ {corners}"]
    for name, box in zip(page.names, page.boxes * DPI / 25.4, strict=True):
        left, top, right, bottom = box
        lines.append(f"  X {name} {name} _ _ {right - left:.3f} {bottom - top:.3f} {left:.3f} {top:.3f} 0 0")
    edges = [line for axis in "XY" for line in (f"{axis}LIST 1", "  0.0 1.0 1.0", "")]
    return "\n".join([*lines, "", "BOX_SHRINK 8.0", "", "REF_ROTATION 0.0", "", *edges])


@pytest.mark.slow
def test_scanin_reads_a_page_by_our_ti2(tmp_path) -> None:
    made = chart()
    (page,) = made.pages
    cgats.write(tmp_path / "chart.ti2", ti2(made))
    Image.fromarray(render(page, 3 * DPI)[1::3, 1::3]).save(tmp_path / "scan.tif", dpi=(DPI, DPI))
    (tmp_path / "scan.cht").write_text(recognition(page))
    same = Patches(sheet(), sheet(), np.full(len(sheet()), np.nan))
    cgats.write(tmp_path / "srgb.ti3", ti3(same, {"DEVICE_CLASS": "DISPLAY", "COLOR_REP": "RGB_XYZ"}))
    run(tmp_path, "colprof", "-ql", "-as", "srgb")
    x0, y0, x1, y1 = (v * DPI / 25.4 for v in page.bounds)
    marks = ",".join(f"{v:.3f}" for v in (x0, y0, x1, y0, x1, y1, x0, y1))
    run(tmp_path, "scanin", "-c", "-F", marks, "scan.tif", "scan.cht", "srgb.icc", "chart")
    (read,) = cgats.read_tables(tmp_path / "chart.ti3")
    device = read.numbers(*DEVICE) / 100
    np.testing.assert_allclose(device, page.device, atol=1e-4)
    np.testing.assert_allclose(read.numbers(*XYZ), conversions.xyz_d50(page.device), atol=0.6)
