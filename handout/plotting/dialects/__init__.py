"""The languages of plotters: one package each, and the table that names them.

- `base`: what conversations and controllers of all dialects share; `gcode`: what those of G-code do.
- `grbl`, `marlin`, `ebb`, `hpgl`, `klipper`: in each, `protocol` (blocks → commands, bytes → replies; pure),
  `conversation` (flow control over one port), `controller` (a `dialect.Controller`); its module has a
  `dialect.Dialect` named `DIALECT`.

To add a dialect: a package with its `DIALECT`, its simulated controller (in `handout.simulated.plotter`), one line in
the table below, and the name among those that `profiles.Plotter.dialect` takes.
`tests/plotting/dialects/test_dialects.py` goes over the table and says what is missing.
"""

from __future__ import annotations

import importlib
from typing import cast

from handout.plotting.dialect import Dialect

# in the order in which an unknown machine is asked; files with a suffix of several are for the first
DIALECTS: dict[str, str] = {
    "grbl": "handout.plotting.dialects.grbl",  # GRBL 1.1, grblHAL, FluidNC
    "ebb": "handout.plotting.dialects.ebb",  # EiBotBoard: AxiDraw, iDraw
    "marlin": "handout.plotting.dialects.marlin",  # Marlin and its kin: 3D printers that carry a pen
    "hpgl": "handout.plotting.dialects.hpgl",  # pen plotters from 1977 on, over RS-232
    "klipper": "handout.plotting.dialects.klipper",  # Klipper and its kin, behind Moonraker
}


def dialect(name: str) -> Dialect:
    """The dialect of a profile, by its name; loaded when it is asked for."""
    return cast(Dialect, importlib.import_module(DIALECTS[name]).DIALECT)


def usual_devices() -> dict[str, str]:
    """Suffix of a file → the machine that it is for if none is named."""
    return {
        suffix: language.usual_device for language in map(dialect, reversed(DIALECTS)) for suffix in language.suffixes
    }
