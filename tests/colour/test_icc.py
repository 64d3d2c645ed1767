"""Profiles for other programs: LittleCMS and ArgyllCMS read them and send what the table sends."""

from __future__ import annotations

import io
import shutil
import subprocess
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from formula_printers import dull
from PIL import Image, ImageCms

from handout.colour import conversions, icc
from handout.colour.models import inverse
from handout.colour.models.forward import Forward, lattice
from handout.colour.table import ColourTable

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow

MADE = datetime(2026, 11, 2, 10, 30)
PIXELS = np.rint(255 * dull(np.random.default_rng(5).random((2000, 3)))).astype(np.uint8)


@pytest.fixture(scope="module")
def table() -> ColourTable:
    grid = dull(lattice(33)).reshape(33, 33, 33, 3)
    nodes = inverse.invert(Forward(grid), lattice(33)).reshape(grid.shape)
    return ColourTable(nodes.astype(np.float32), grid.astype(np.float32))


@pytest.fixture(scope="module")
def output(table: ColourTable) -> bytes:
    return icc.output_profile(table, MADE, "epson/büro")


def opened(data: bytes) -> ImageCms.ImageCmsProfile:
    return ImageCms.ImageCmsProfile(io.BytesIO(data))


def through(one: object, other: object, intent: int, flags: int = 0) -> np.ndarray:
    """(n, 3) in 0–1, what LittleCMS makes of PIXELS."""
    way = ImageCms.buildTransform(one, other, "RGB", "RGB", ImageCms.Intent(intent), ImageCms.Flags(flags))
    return np.asarray(ImageCms.applyTransform(Image.fromarray(PIXELS[None]), way))[0] / 255


def off(sent: np.ndarray) -> np.ndarray:
    return conversions.delta_e(conversions.lab(dull(sent)), conversions.lab(PIXELS / 255))


def same() -> bytes:
    """A device link that changes nothing: LittleCMS takes a link only with another profile behind it."""
    ends = np.linspace(0, 1, 2)
    nodes = np.stack(np.meshgrid(ends, ends, ends, indexing="ij"), axis=-1)
    tags = {b"A2B0": icc.lut16(nodes, [ends] * 3), b"pseq": icc.sequence(("a", "b"))}
    return icc.profile(b"link", b"RGB ", MADE, "same", tags)


def test_a_device_link_sends_what_the_table_sends(table: ColourTable) -> None:
    link = opened(icc.device_link(table, MADE, "epson/plain"))
    exact = through(link, opened(same()), 0, ImageCms.Flags.NOOPTIMIZE)
    assert np.abs(exact - table(PIXELS / 255)).max() * 255 < 0.6
    resampled = through(link, opened(same()), 0)
    assert off(resampled).mean() < off(table(PIXELS / 255)).mean() + 0.15


def test_white_stays_bare_paper_in_a_device_link(table: ColourTable) -> None:
    way = ImageCms.buildTransform(opened(icc.device_link(table, MADE, "x")), opened(same()), "RGB", "RGB")
    assert ImageCms.applyTransform(Image.new("RGB", (1, 1), "white"), way).getpixel((0, 0)) == (255, 255, 255)


def test_the_absolute_intent_of_an_output_profile_gives_the_scan_again(table: ColourTable, output: bytes) -> None:
    srgb = ImageCms.createProfile("sRGB")
    own = off(np.rint(255 * table(PIXELS / 255)) / 255)
    exact = off(through(srgb, opened(output), ImageCms.Intent.ABSOLUTE_COLORIMETRIC, ImageCms.Flags.NOOPTIMIZE))
    assert exact.mean() < own.mean() + 0.1 and exact.max() < 1.5
    assert off(through(srgb, opened(output), ImageCms.Intent.ABSOLUTE_COLORIMETRIC)).mean() < own.mean() + 0.2


@pytest.mark.parametrize("intent", [0, 1, 2])
def test_relative_intents_leave_the_paper_bare(intent: int, output: bytes) -> None:
    way = ImageCms.buildTransform(ImageCms.createProfile("sRGB"), opened(output), "RGB", "RGB", ImageCms.Intent(intent))
    sent = ImageCms.applyTransform(Image.new("RGB", (1, 1), "white"), way).getpixel((0, 0))
    assert min(sent) >= 253


def test_an_output_profile_foretells_the_scan(output: bytes) -> None:
    way = ImageCms.buildTransform(
        opened(output), ImageCms.createProfile("sRGB"), "RGB", "RGB", ImageCms.Intent.ABSOLUTE_COLORIMETRIC,
        ImageCms.Flags.NOOPTIMIZE,
    )  # fmt: skip
    seen = np.asarray(ImageCms.applyTransform(Image.fromarray(PIXELS[None]), way))[0] / 255
    assert (
        conversions.delta_e(conversions.lab(seen), conversions.lab(dull(PIXELS / 255))).max() < 1.0
    )  # rounded to 8 bits twice


def test_a_profile_says_what_it_is(output: bytes) -> None:
    about = opened(output).profile
    assert (about.device_class, about.xcolor_space.strip(), about.connection_space.strip()) == ("prtr", "RGB", "Lab")
    assert about.version == pytest.approx(2.4) and about.creation_date == MADE
    assert about.profile_description in ("epson/b?ro", "epson/büro")
    assert int.from_bytes(output[:4], "big") == len(output)


def test_argyll_reads_both(table: ColourTable, output: bytes, tmp_path: Path) -> None:
    if shutil.which("iccdump") is None or shutil.which("xicclu") is None:
        pytest.skip("iccdump and xicclu of ArgyllCMS are not on PATH; install the package argyll")
    (tmp_path / "out.icc").write_bytes(output)
    (tmp_path / "link.icc").write_bytes(icc.device_link(table, MADE, "epson/plain"))

    def said(*command: str, given: str = "") -> str:
        done = subprocess.run(command, cwd=tmp_path, input=given, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stdout[-300:] + done.stderr
        return done.stdout

    for name, kind in (("out.icc", "Output"), ("link.icc", "Link")):
        assert f"Device Class = {kind}" in said("iccdump", "-v2", name)
    colours = np.random.default_rng(2).random((20, 3))
    lines = "\n".join(" ".join(f"{v:.6f}" for v in row) for row in colours)
    labs = said("xicclu", "-v0", "-ff", "-ia", "-pl", "out.icc", given=lines)
    back = said("xicclu", "-v0", "-fb", "-ia", "-pl", "out.icc", given=labs)
    found = np.array([[float(word) for word in line.split()[:3]] for line in back.splitlines() if line.strip()])
    assert conversions.delta_e(conversions.lab(dull(found)), conversions.lab(dull(colours))).max() < 1.5
