"""The chart, and what was read from its scan, as .ti1, .ti2 and .ti3 tables that ArgyllCMS takes.

A scanner measures no colour: the XYZ in a .ti3 takes the scan's numbers for sRGB (IEC 61966-2-1), adapted to D50.
That is near enough to look at the table with other programs, and no basis for a profile of the printer.  The numbers
of the scan themselves are in SCAN_R, SCAN_G and SCAN_B, percent of full scale, and their standard error in SCAN_SE.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

import handout
from handout.colour import cgats
from handout.colour.chart import Chart
from handout.errors import InputError
from handout.values import Array, readonly

if TYPE_CHECKING:
    from handout.colour.patches import Patches
    from handout.colour.reading import Reading

DEVICE, XYZ = ("RGB_R", "RGB_G", "RGB_B"), ("XYZ_X", "XYZ_Y", "XYZ_Z")
SCANNED, ERROR = ("SCAN_R", "SCAN_G", "SCAN_B"), "SCAN_SE"
# device colours of which further tables of a .ti1 tell what is expected: ArgyllCMS' printtarg refuses one without
_CORNERS = np.array([[1, 1, 1], [0, 1, 1], [1, 0, 1], [0, 0, 1], [1, 1, 0], [0, 1, 0], [1, 0, 0], [0, 0, 0]], float)
_EXTREMES = {"DENSITY_EXTREME_VALUES": _CORNERS, "DEVICE_COMBINATION_VALUES": np.vstack([_CORNERS, [[0.5] * 3]])}
_DESCRIPTOR = "Argyll Calibration Target chart information"
_ORIGINATOR = f"handout {handout.__version__}"
# linear sRGB to XYZ under D50: IEC 61966-2-1 with Bradford adaptation
_TO_XYZ = np.array([
    [0.4360747, 0.3850649, 0.1430804], [0.2225045, 0.7168786, 0.0606169], [0.0139322, 0.0971045, 0.7141733],
])  # fmt: skip


def ti1(chart: Chart) -> tuple[cgats.Table, ...]:
    """The different colours of a chart, with what is to be expected of them on a printer that prints sRGB."""
    columns = {"SAMPLE_ID": _ids(len(chart.colours)), **_foretold(chart.colours)}
    said = {"DESCRIPTOR": f"{_DESCRIPTOR} 1", "ORIGINATOR": _ORIGINATOR}
    further = [
        cgats.table("CTI1", said | {name: str(len(device))}, {"INDEX": _ids(len(device), 0), **_foretold(device)})
        for name, device in _EXTREMES.items()
    ]
    return (cgats.table("CTI1", _about("1", "iRGB", _expected()), columns), *further)


def ti2(chart: Chart) -> tuple[cgats.Table, ...]:
    """Every patch of a chart and its place: page number, column and row."""
    pages = chart.pages
    device = np.vstack([page.device for page in pages])
    several = len(pages) > 1
    names = [f"{page.number}-{name}" if several else name for page in pages for name in page.names]
    columns = {
        "SAMPLE_ID": _ids(len(device)),
        "SAMPLE_LOC": names,
        **_foretold(device),
    }
    about = _expected() | {"STEPS_IN_PASS": str(pages[0].rows), "PASSES_IN_STRIPS2": str(pages[0].columns)}
    return (cgats.table("CTI2", _about("2", "iRGB", about), columns),)


def ti3(reading: Reading | Patches, about: Mapping[str, str] | None = None) -> tuple[cgats.Table, ...]:
    """What was read: a set for each colour.

    Parameters
    ----------
    reading : Reading or Patches
    about : mapping, optional
        Further keywords: printer, paper, scanner.
    """
    columns = {
        "SAMPLE_ID": _ids(len(reading.device)),
        **_columns(DEVICE, reading.device * 100),
        **_columns(XYZ, srgb_to_xyz(reading.scanned)),
        **_columns(SCANNED, reading.scanned * 100),
        **_columns((ERROR,), reading.deviation[:, None] * 100),
    }
    said = {"DEVICE_CLASS": "OUTPUT", "TARGET_INSTRUMENT": "flatbed scanner, taken for sRGB", **(about or {})}
    return (cgats.table("CTI3", _about("3", "iRGB_XYZ", said), columns),)


def from_ti3(tables: tuple[cgats.Table, ...]) -> tuple[Array, Array, Array]:
    """What `ti3` stored: device (n, 3), scanned (n, 3) and deviation (n,), all in 0–1.

    Raises
    ------
    InputError
        The table is none of a scan.
    """
    one = tables[0]
    if SCANNED[0] not in one.fields:
        raise InputError(
            "The table holds no numbers of a scan (SCAN_R, SCAN_G, SCAN_B): it was measured by an instrument, and a "
            "calibration needs the chart as the scanner of the handwriting sees it. Scan the chart."
        )
    device, scanned, deviation = (one.numbers(*names) / 100 for names in (DEVICE, SCANNED, (ERROR,)))
    return readonly(device, None, 3), readonly(scanned, None, 3), readonly(deviation[:, 0], None)


def srgb_to_xyz(rgb: Array) -> Array:
    """(n, 3) sRGB in 0–1 to XYZ under D50, white Y = 100.

    Source: IEC 61966-2-1.
    """
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((np.maximum(rgb, 0) + 0.055) / 1.055) ** 2.4)
    return np.asarray(100 * linear @ _TO_XYZ.T)


def _about(number: str, representation: str, more: Mapping[str, str]) -> dict[str, str]:
    return {
        "DESCRIPTOR": f"{_DESCRIPTOR} {number}",
        "ORIGINATOR": _ORIGINATOR,
        "COLOR_REP": representation,
        **more,
    }


def _expected() -> dict[str, str]:
    white = srgb_to_xyz(np.ones((1, 3)))[0]
    return {"APPROX_WHITE_POINT": " ".join(f"{v:.6f}" for v in white)}


def _foretold(device: Array) -> dict[str, list[str]]:
    return {**_columns(DEVICE, device * 100), **_columns(XYZ, srgb_to_xyz(device))}


def _ids(count: int, first: int = 1) -> list[str]:
    return [str(first + i) for i in range(count)]


def _columns(names: tuple[str, ...], values: Array) -> dict[str, list[str]]:
    """Columns of numbers, in so many figures that the same number is read again."""
    return {name: [repr(float(v)) for v in values[:, k]] for k, name in enumerate(names)}
