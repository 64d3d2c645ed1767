"""Who a controller is by what it says: its greeting, and its answers to the questions of the dialects.

A dialect is not a machine: boards do not say which frame they move, so that several profiles may fit, the likeliest
first; and some firmwares answer a dialect's question without speaking it.  Each row's own words stand, with where they
were recorded, in `tests/plotting/test_greetings.py`.
"""

from __future__ import annotations

import re
from typing import NamedTuple


class Firmware(NamedTuple):
    """A firmware that is known.

    title : for people.  dialect : that it speaks, "" if handout speaks none of its.  profiles : which fit it, the
    likeliest first.  advice : what to do where it cannot be driven.
    """

    title: str
    dialect: str = ""
    profiles: tuple[str, ...] = ()
    advice: str = ""


_EBB_FRAMES = ("axidraw-v3", "axidraw-se-a3", "axidraw-v3-brushless", "axidraw-minikit", "idraw-h-se-a3", "idraw-1")
_NEXTDRAWS = ("nextdraw-8511", "nextdraw-1117", "nextdraw-2234")
_GRBL_FRAMES = ("grbl-servo", "grbl-z", "grbl-corexy")

# the first row that is found counts: relatives stand before those whose words they share
_KNOWN: tuple[tuple[str, Firmware], ...] = (
    (r"DrawCore V?[2-9]", Firmware("DrawCore 2 (iDraw 2.0 and H, UUNA TEK)", "grbl", ("idraw-2", "uuna-tek-a3"))),
    (r"EBB\S* .*Version [3-9]\.", Firmware("EiBotBoard, firmware 3", "ebb", (*_NEXTDRAWS, *_EBB_FRAMES))),
    (r"EBB", Firmware("EiBotBoard, firmware 2 or older", "ebb", _EBB_FRAMES)),
    (r"FluidNC", Firmware("FluidNC", "grbl", _GRBL_FRAMES)),
    (r"GrblHAL|FIRMWARE:grblHAL", Firmware("grblHAL", "grbl", _GRBL_FRAMES)),
    (r"Grbl 1\.[23]\w|\[VER:1\.[23]\w", Firmware("Grbl_ESP32", "grbl", ("midtbot", *_GRBL_FRAMES))),
    (
        r"Grbl 0\.|^\[0\.\d",
        Firmware("GRBL before 1.1", advice="put GRBL 1.1 on its board: older ones do not tell enough"),
    ),
    (r"Grbl v?1\.1|\[VER:1\.1", Firmware("GRBL 1.1", "grbl", ("grbl-servo", "eleksdraw", "grbl-z", "grbl-corexy"))),
    (
        r'"fv":|tinyg \[|"fb":',
        Firmware(
            "TinyG or g2core",
            advice="its JSON is not spoken: export a file for another sender (handout export -o page.gcode)",
        ),
    ),
    (
        r"Smoothie",
        Firmware("Smoothieware", advice="export a file and play it from its card (handout export -o page.gcode)"),
    ),
    (
        r"FIRMWARE_NAME:\s*Klipper|Klipper state",
        Firmware("Klipper", advice="reach it through Moonraker (--port moonraker://its-name.local)"),
    ),
    (
        r'"klippy_state"',
        Firmware("Klipper behind Moonraker", "klipper", ("klipper-servo", "klipper-stepper", "klipper-z")),
    ),
    (
        r"RepRapFirmware",
        Firmware(
            "RepRapFirmware (Duet)", advice="export a file and run it from its card (handout export -o page.gcode)"
        ),
    ),
    (
        r"FIRMWARE_NAME:\s*Teacup",
        Firmware("Teacup", advice="export a file and run it from its card (handout export -o page.gcode)"),
    ),
    (r"FIRMWARE_NAME:\s*Repetier", Firmware("Repetier", "marlin", ("marlin-servo",))),
    (r"MACHINE_TYPE:\s*Ender-?3", Firmware("Marlin on a Creality Ender-3", "marlin", ("creality-ender-3",))),
    (r"MACHINE_TYPE:\s*Ender-?5", Firmware("Marlin on a Creality Ender-5", "marlin", ("creality-ender-5",))),
    (r"MACHINE_TYPE:\s*Prusa.i3.MK3", Firmware("Prusa's Marlin on an i3 MK3", "marlin", ("prusa-mk3",))),
    (
        r"FIRMWARE_NAME:\s*Prusa-Firmware-Buddy",
        Firmware("Prusa's Buddy firmware", "marlin", ("prusa-mk3", "marlin-servo")),
    ),
    (
        r"FIRMWARE_NAME:\s*Marlin|^Marlin \d",
        Firmware("Marlin", "marlin", ("marlin-servo", "creality-ender-3", "creality-ender-5")),
    ),
    (r"^(HP)?7475A", Firmware("HP 7475A", "hpgl", ("hp-7475a",))),
    (r"^(HP)?7550[AP]?", Firmware("HP 7550", "hpgl", ("hp-7550a",))),
    (r"^DXY-1[1-3]00|^DXY-9?\d\d0?", Firmware("Roland DXY", "hpgl", ("roland-dxy-1300", "hpgl"))),
    (r"^(HP)?7[0-9]{3}[AB]?\s*$", Firmware("HP pen plotter", "hpgl", ("hpgl", "hp-7475a"))),
)


def recognise(said: str) -> Firmware | None:
    """The firmware that says these lines; None if no row has them."""
    for pattern, firmware in _KNOWN:
        if re.search(pattern, said, re.IGNORECASE | re.MULTILINE):
            return firmware
    return None
