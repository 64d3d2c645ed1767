"""ArgyllCMS' profile of a printer, for comparison: `colprof -qm` of a chart, looked up by `xicclu`.

The scan's numbers are taken for sRGB and adapted to D50, as the project's .ti3 has them, on both sides of a profile.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from handout.colour import cgats, chart_files, conversions
from handout.colour.models.forward import Patches
from handout.values import Array

INVERSES = {"B2A table": "b", "A2B inverted": "if"}  # of a profile, as xicclu calls them
_LIGHT = conversions.xyz_d50(np.eye(3))  # XYZ of red, green and blue at full
_WHITE = _LIGHT.sum(axis=0)
_EPSILON, _KAPPA = 216 / 24389, 24389 / 27


def found() -> bool:
    """Whether both programs are there."""
    return all(shutil.which(name) for name in ("colprof", "xicclu"))


@contextmanager
def profiled(patches: Patches) -> Iterator[Path]:
    """The profile of a chart, in a folder that goes again."""
    with tempfile.TemporaryDirectory() as folder:
        chart = Path(folder) / "chart"
        cgats.write(chart.with_suffix(".ti3"), chart_files.ti3(patches))
        subprocess.run(["colprof", "-qm", chart], check=True, capture_output=True, stdin=subprocess.DEVNULL)
        yield chart.with_suffix(".icc")


def seen(profile: Path, device: Array) -> Array:
    """(n, 3) scanned RGB that a profile foretells of (n, 3) device RGB."""
    light = np.linalg.solve(_LIGHT.T, 100 * _looked_up(profile, ["-ff", "-px"], device).T).T
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def sent(profile: Path, scanned: Array, inverse: str) -> Array:
    """(n, 3) device RGB that gives (n, 3) scanned RGB by one of `INVERSES`."""
    return _looked_up(profile, [f"-f{INVERSES[inverse]}", "-pl"], _lab(conversions.xyz_d50(scanned)))


def _lab(xyz: Array) -> Array:
    ratio = xyz / _WHITE
    f = np.where(ratio > _EPSILON, np.cbrt(ratio), (_KAPPA * ratio + 16) / 116)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


def _looked_up(profile: Path, how: list[str], values: Array) -> Array:
    """Absolute colorimetric."""
    lines = "\n".join(" ".join(f"{value:.6f}" for value in row) for row in values.tolist()) + "\n"
    command = ["xicclu", "-v0", "-ia", *how, str(profile)]
    done = subprocess.run(command, input=lines, check=True, capture_output=True, text=True)
    return np.array([[float(word) for word in line.split()[:3]] for line in done.stdout.splitlines() if line.strip()])
