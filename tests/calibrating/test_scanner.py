"""Scans through scanimage, or something that stands for it."""

import stat

import pytest

from handout.calibrating import scanner
from handout.errors import DeviceError
from handout.values import Page

OFFERED = """
All options specific to device `epson2:libusb:001:004':
  Scan Mode:
    --mode Lineart|Gray|Color [Color]
    --depth 8|16 [8]
    --resolution 50..1200dpi [50]
    --brightness -4..3 [0]
    --color-correction None|Built in CCT profile [Built in CCT profile]
    --auto-exposure[=(yes|no)] [yes]
    --threshold 0..255 [inactive]
  Geometry:
    -l 0..215.9mm [0]
    -t 0..297.18mm [0]
    -x 0..215.9mm [215.9]
    -y 0..297.18mm [297.18]
"""


def test_corrections_are_switched_off_where_they_can_be():
    said = scanner.arguments(OFFERED, Page(210, 297), 300)
    assert said[:3] == ["--mode=Color", "--resolution=300", "--depth=8"]
    assert {"--brightness=0", "--color-correction=None", "--auto-exposure=no"} <= set(said)
    assert not any(part.startswith(("--contrast", "--threshold")) for part in said)
    assert said[-8:] == ["-l", "0", "-t", "0", "-x", "210", "-y", "297"]


def test_without_scanimage(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(DeviceError, match="scanimage is not installed"):
        scanner.scan("any", Page(210, 297), tmp_path / "scan.tif")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def fake(monkeypatch, tmp_path):
    """A scanimage that says and gives what it is told to."""

    def make(picture, code=0):
        folder = tmp_path / "bin"
        folder.mkdir()
        program = folder / "scanimage"
        program.write_text(
            f"#!/bin/sh\ncase \"$*\" in *--all-options*) echo '    --mode Gray|Color [Gray]';; "
            f"*) echo open failed >&2; printf '{picture}'; exit {code};; esac\n"
        )
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")

    return make


def test_a_scan_is_written_whole(fake, tmp_path):
    fake("II*picture")
    path = scanner.scan("any", Page(210, 297), tmp_path / "scan.tif")
    assert path.read_bytes() == b"II*picture"


def test_a_scanner_that_fails(fake, tmp_path):
    fake("", code=7)
    with pytest.raises(DeviceError, match=r"open failed.*scanimage -L"):
        scanner.scan("any", Page(210, 297), tmp_path / "scan.tif")
    assert not (tmp_path / "scan.tif").exists()


def test_a_scanner_that_gives_nothing(fake, tmp_path):
    fake("")
    with pytest.raises(DeviceError, match="gave no picture"):
        scanner.scan("any", Page(210, 297), tmp_path / "scan.tif")
