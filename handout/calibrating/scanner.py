"""Scans through SANE's command scanimage, with every automatic correction off that the scanner lets one switch off."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

from handout import atomic
from handout.errors import DeviceError
from handout.values import Page

DPI = 300  # as the user is asked to scan
_PATIENCE = 600.0  # s; an A4 page at 300 dpi through USB 1 takes minutes
_INCH = 25.4
# options that correct colour, and the value that keeps them from it; asked for where the scanner has both
_PLAIN = {
    "--brightness": "0", "--contrast": "0", "--color-correction": "None", "--gamma-correction": "Default",
    "--custom-gamma": "no", "--auto-exposure": "no", "--autogain": "no", "--auto-levels": "no",
    "--color-enhancement": "no", "--auto-color": "no", "--swdeskew": "no", "--swdespeck": "no",
}  # fmt: skip
_OPTION = re.compile(r"^\s+(--[a-z-]+)[ =\[]*(\S*)", re.MULTILINE)
_WAY_OUT = "scan the page with any program at 300 dpi in colour, save it as TIFF or PNG, and give the file instead"


def scan(name: str, page: Page, to: Path, dpi: int = DPI) -> Path:
    """Scan one page to a TIFF.

    name : the scanner, as ``scanimage -L`` calls it; empty: the first there is.
    page : what lies on the glass, mm.
    to : the file.

    Raises DeviceError: ``scanimage`` is missing, finds no scanner, or fails; the message holds its own words.
    """
    if shutil.which("scanimage") is None:
        raise DeviceError(
            f"The command scanimage is not installed (on Debian it is in the package sane-utils): {_WAY_OUT}."
        )
    which = ["--device-name", name] if name else []
    offered = _run_scanimage(["scanimage", *which, "--all-options"]).decode(errors="replace")
    data = _run_scanimage(["scanimage", *which, *arguments(offered, page, dpi), "--format=tiff"])
    if data[:2] not in (b"II", b"MM"):
        raise DeviceError(f"The scanner {name or 'of this computer'} gave no picture: {_WAY_OUT}.")
    atomic.write(to, data)
    return to


def arguments(offered: str, page: Page, dpi: int) -> list[str]:
    """What scanimage is told, of what ``--all-options`` says that the scanner takes."""
    options = dict(_OPTION.findall(offered))
    settings = ["--mode=Color"] if "--mode" in options else []
    settings += [f"--resolution={dpi}"] if "--resolution" in options else []
    settings += ["--depth=8"] if "--depth" in options else []
    settings += [
        f"{name}={value}" for name, value in _PLAIN.items() if name in options and _takes(options[name], value)
    ]
    corners = {"-l": 0.0, "-t": 0.0, "-x": page.width, "-y": page.height}
    area = [part for side, mm in corners.items() if re.search(rf"^\s+{side} ", offered, re.MULTILINE)
            for part in (side, f"{mm:g}")]  # fmt: skip
    return [*settings, *area]


def _takes(values: str, value: str) -> bool:
    """Whether an option whose values are listed so takes a value; a range of numbers takes 0 in it."""
    bounds = re.match(r"(-?[\d.]+)\.\.(-?[\d.]+)", values)
    if bounds and value == "0":
        return float(bounds.group(1)) <= 0 <= float(bounds.group(2))
    return value.lower() in re.split(r"[|()\[\]=]", values.lower())


def _run_scanimage(command: list[str]) -> bytes:
    try:
        done = subprocess.run(command, capture_output=True, timeout=_PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise DeviceError(f"The scanner did not answer within {_PATIENCE:.0f} s: {_WAY_OUT}.") from error
    if done.returncode != 0:
        words = " ".join(done.stderr.decode(errors="replace").split())[-300:] or f"code {done.returncode}"
        raise DeviceError(f"The scanner could not be used ({words}): check its name with scanimage -L, or {_WAY_OUT}.")
    return done.stdout
