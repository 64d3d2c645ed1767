"""Who a controller is by what it says: its greeting, and its answers to the questions of the dialects.

A dialect is not a machine: boards do not say which frame they move, so that several profiles may fit, the likeliest
first.  What else a board says narrows them (`narrow_profiles`): a name that somebody gave it, its travel, the chip of
its USB port.  And some firmwares answer a dialect's question without speaking it.  Each row's own words stand, with
where they were recorded, in `tests/plotting/test_greetings.py`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, cast

from handout import profiles
from handout.profiles import Plotter


class KnownFirmware(NamedTuple):
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
_KNOWN: tuple[tuple[str, KnownFirmware], ...] = (
    (r"DrawCore V?[2-9]", KnownFirmware("DrawCore 2 (iDraw 2.0 and H, UUNA TEK)", "grbl", ("idraw-2", "uuna-tek-a3"))),
    (r"EBB\S* .*Version [3-9]\.", KnownFirmware("EiBotBoard, firmware 3", "ebb", (*_NEXTDRAWS, *_EBB_FRAMES))),
    (r"EBB", KnownFirmware("EiBotBoard, firmware 2 or older", "ebb", _EBB_FRAMES)),
    (r"FluidNC", KnownFirmware("FluidNC", "grbl", _GRBL_FRAMES)),
    (r"GrblHAL|FIRMWARE:grblHAL", KnownFirmware("grblHAL", "grbl", _GRBL_FRAMES)),
    (r"Grbl 1\.[23]\w|\[VER:1\.[23]\w", KnownFirmware("Grbl_ESP32", "grbl", ("midtbot", *_GRBL_FRAMES))),
    (
        r"Grbl 0\.|^\[0\.\d",
        KnownFirmware("GRBL before 1.1", advice="put GRBL 1.1 on its board: older ones do not tell enough"),
    ),
    (
        r"Grbl v?1\.1|\[VER:1\.1",
        KnownFirmware("GRBL 1.1", "grbl", ("grbl-servo", "eleksdraw", "grbl-z", "grbl-corexy")),
    ),
    (
        r'"fv":|tinyg \[|"fb":',
        KnownFirmware(
            "TinyG or g2core",
            advice="its JSON is not spoken: export a file for another sender (handout export -o page.gcode)",
        ),
    ),
    (
        r"Smoothie",
        KnownFirmware("Smoothieware", advice="export a file and play it from its card (handout export -o page.gcode)"),
    ),
    (
        r"FIRMWARE_NAME:\s*Klipper|Klipper state",
        KnownFirmware("Klipper", advice="reach it through Moonraker (--port moonraker://its-name.local)"),
    ),
    (
        r'"klippy_state"',
        KnownFirmware("Klipper behind Moonraker", "klipper", ("klipper-servo", "klipper-stepper", "klipper-z")),
    ),
    (
        r"RepRapFirmware",
        KnownFirmware(
            "RepRapFirmware (Duet)", advice="export a file and run it from its card (handout export -o page.gcode)"
        ),
    ),
    (
        r"FIRMWARE_NAME:\s*Teacup",
        KnownFirmware("Teacup", advice="export a file and run it from its card (handout export -o page.gcode)"),
    ),
    (r"FIRMWARE_NAME:\s*Repetier", KnownFirmware("Repetier", "marlin", ("marlin-servo",))),
    (r"MACHINE_TYPE:\s*Ender-?3", KnownFirmware("Marlin on a Creality Ender-3", "marlin", ("creality-ender-3",))),
    (r"MACHINE_TYPE:\s*Ender-?5", KnownFirmware("Marlin on a Creality Ender-5", "marlin", ("creality-ender-5",))),
    (r"MACHINE_TYPE:\s*Prusa.i3.MK3", KnownFirmware("Prusa's Marlin on an i3 MK3", "marlin", ("prusa-mk3",))),
    (
        r"FIRMWARE_NAME:\s*Prusa-Firmware-Buddy",
        KnownFirmware("Prusa's Buddy firmware", "marlin", ("prusa-mk3", "marlin-servo")),
    ),
    (
        r"FIRMWARE_NAME:\s*Marlin|^Marlin \d",
        KnownFirmware("Marlin", "marlin", ("marlin-servo", "creality-ender-3", "creality-ender-5")),
    ),
    (r"^(HP)?7475A", KnownFirmware("HP 7475A", "hpgl", ("hp-7475a",))),
    (r"^(HP)?7550[AP]?", KnownFirmware("HP 7550", "hpgl", ("hp-7550a",))),
    (r"^DXY-1[1-3]00|^DXY-9?\d\d0?", KnownFirmware("Roland DXY", "hpgl", ("roland-dxy-1300", "hpgl"))),
    (r"^(HP)?7[0-9]{3}[AB]?\s*$", KnownFirmware("HP pen plotter", "hpgl", ("hpgl", "hp-7475a"))),
)


def recognise(said: str) -> KnownFirmware | None:
    """The firmware that says these lines; None if no row has them."""
    for pattern, firmware in _KNOWN:
        if re.search(pattern, said, re.IGNORECASE | re.MULTILINE):
            return firmware
    return None


class Clues(NamedTuple):
    """What is known of a machine besides its firmware.

    said : answers to the `clues` of its dialect; title : of its USB device; usb : id of that, None if it is on none.
    """

    said: str = ""
    title: str = ""
    usb: tuple[int, int] | None = None


class Fitting(NamedTuple):
    """Profiles that fit a machine.

    profiles : the one that it is, or the two that it could be, the likeliest first.  others : of its kind, less likely.
    why : what decided, in a sentence; "" if nothing did.
    """

    profiles: tuple[str, ...]
    others: tuple[str, ...] = ()
    why: str = ""


# in names that people or makers gave a board → which frame it moves; the closest first
_NAMED = (
    (r"nextdraw\W*1117|\b1117\b", "nextdraw-1117"),
    (r"nextdraw\W*2234|\b2234\b", "nextdraw-2234"),
    (r"nextdraw", "nextdraw-8511"),
    (r"mini", "axidraw-minikit"),
    (r"idraw.*h.*se", "idraw-h-se-a3"),
    (r"brushless", "axidraw-v3-brushless"),
    (r"se\W*/?\W*a3", "axidraw-se-a3"),
    (r"v3\W*/?\W*a3|axidraw.*a3", "axidraw-v3-a3"),
    (r"axidraw", "axidraw-v3"),
    (r"uuna", "uuna-tek-a3"),
    (r"idraw\W*1|idraw", "idraw-1"),
    (r"eleks", "eleksdraw"),
    (r"bachin", "bachin-t-a4"),
)
_OBJECTS = (('"servo ', "klipper-servo"), ('"manual_stepper ', "klipper-stepper"), ('"objects"', "klipper-z"))
_EBB_CHIP = (0x04D8, 0xFD92)  # its makers' documentation
# mm by which a travel may differ from the bed of a profile, which leaves out what a holder needs; set by eye
_FRAME = 12.0


def narrow_profiles(firmware: KnownFirmware, words: str, clues: Clues) -> Fitting:
    """The profile of a machine, or the two that it may have.

    words : its firmware, in its own words.
    """
    candidates = firmware.profiles
    for find in (_by_name, _by_objects, _by_travel, _by_chip):
        found, why = find(candidates, words, clues)
        if found:
            candidates = (*found, *(name for name in candidates if name not in found))
            return Fitting(found[:2], candidates[len(found[:2]) :], why)
    return Fitting(candidates[:2], candidates[2:])


def _by_name(candidates: Sequence[str], words: str, clues: Clues) -> tuple[tuple[str, ...], str]:
    called = nickname(clues.said)
    for text, what in ((called, f"it is called {called!r}"), (f"{words} {clues.title}", "by its own words")):
        for pattern, name in _NAMED:
            if name in candidates and re.search(pattern, text, re.IGNORECASE):
                return (name,), what
    return (), ""


def nickname(said: str) -> str:
    """The name that was given to an EBB, in its answer to ``QT``; "" if it has none."""
    lines = [line.strip().removeprefix("QT,") for line in re.split(r"[\r\n]+", said)]
    named = [line for line in lines if re.fullmatch(r"[\x20-\x7e]{1,16}", line) and line not in ("OK", "QT", "ok")]
    return named[0] if named and not named[0].startswith(("!", "$", "{", "[")) else ""


def _by_objects(candidates: Sequence[str], words: str, clues: Clues) -> tuple[tuple[str, ...], str]:
    """What a Klipper has in its printer.cfg."""
    for text, name in _OBJECTS:
        if name in candidates and text in clues.said:
            return (name,), f"its printer.cfg has a {text.strip(chr(34) + ' ')}" if text[
                -1
            ] == " " else "it has neither"
    return (), ""


def _by_travel(candidates: Sequence[str], words: str, clues: Clues) -> tuple[tuple[str, ...], str]:
    """The travel of a GRBL (``$130``, ``$131``)."""
    found = [re.search(rf"^\${number}=([\d.]+)", clues.said, re.MULTILINE) for number in (130, 131)]
    if not all(found):
        return (), ""
    x, y = (float(match.group(1)) for match in found if match)
    fits = []
    for name in candidates:
        bed = cast(Plotter, profiles.find(name, "plotter")).bed
        if abs(bed.width - x) <= _FRAME and abs(bed.height - y) <= _FRAME:
            fits.append(name)
    return tuple(fits), f"its travel is {x:g} × {y:g} mm ($130, $131)"


def _by_chip(candidates: Sequence[str], words: str, clues: Clues) -> tuple[tuple[str, ...], str]:
    """An AxiDraw or NextDraw has an EBB, whose processor is on USB itself; behind another chip it is an iDraw."""
    boards = [name for name in candidates if name.startswith("idraw-")]
    if clues.usb is None or clues.usb == _EBB_CHIP or not boards or "axidraw-v3" not in candidates:
        return (), ""
    return tuple(boards), f"its USB chip ({clues.usb[0]:04x}:{clues.usb[1]:04x}) is not that of an EBB"
