"""Who a controller is by what it says: its greeting, and its answers to the questions of the dialects.

A dialect is not a machine: boards do not say which frame they move, so that several profiles may fit, the likeliest
first.  What else a board says narrows them (`narrow_profiles`): a name that somebody gave it, its travel, the chip of
its USB port.  And some firmwares answer a dialect's question without speaking it.  The words of each are in
greetings.toml, and where they were recorded in `tests/plotting/test_greetings.py`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, cast

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


@cache
def _words() -> dict[str, Any]:
    """What greetings.toml says."""
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def recognise(said: str) -> KnownFirmware | None:
    """The firmware that says these lines; None if no row has them."""
    for row in _words()["firmwares"]:
        if re.search(row["says"], said, re.IGNORECASE | re.MULTILINE):
            return KnownFirmware(
                row["title"], row.get("dialect", ""), (*row.get("profiles", ()),), row.get("advice", "")
            )
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


_OBJECTS = (('"servo ', "klipper-servo"), ('"manual_stepper ', "klipper-stepper"), ('"objects"', "klipper-z"))
_EBB_CHIP = (0x04D8, 0xFD92)  # its makers' documentation
# mm by which a travel may differ from the bed of a profile, which leaves out what a holder needs; set by eye
_FRAME = 12.0


def narrow_profiles(firmware: KnownFirmware, words: str, clues: Clues) -> Fitting:
    """The profile of a machine, or the two that it may have; `words` : its firmware, in its own words."""
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
        for pattern, name in _words()["names"]:
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
