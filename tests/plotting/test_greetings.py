"""What controllers say when they start or are asked, as recorded in public sources, and who they are taken for."""

import pytest

from handout import profiles
from handout.errors import DeviceSilent
from handout.pipeline import devices
from handout.plotting import connections
from handout.plotting.greetings import recognise

EBB, GRBL = "axidraw-v3", "grbl-servo"
# what is said; the dialect ("": none of ours); the likeliest profile; where it was recorded
RECORDED = [
    ("Grbl 1.1f ['$' for help]", "grbl", GRBL, "gnea/grbl, wiki, Grbl v1.1 Interface"),
    ("Grbl 1.1h ['$' for help]", "grbl", GRBL, "gnea/grbl, config.h: version 1.1h"),
    ("[VER:1.1h.20190830:]\r\n[OPT:V,15,128]", "grbl", GRBL, "gnea/grbl, report.c, $I"),
    ("Grbl v1.1f ['$' for help]", "grbl", GRBL, "a GRBL-like wire cutter's sketch that greets so"),
    ("Grbl 1.1h DrawCore V2.09 ['$' for help]", "grbl", "idraw-2", "an owner's notes on an iDraw, read with tio"),
    ("DrawCore V2.09.20230318", "grbl", "idraw-2", "answer to v of an iDraw H, from a driver's comments"),
    ("DrawCore V2.17 (Uunatek)", "grbl", "idraw-2", "a plotter driver's list of firmwares"),
    ("GrblHAL 1.1f ['$' or '$HELP' for help]", "grbl", GRBL, "grblHAL/core, report.c"),
    (
        "[VER:1.1f.20220325:]\r\n[OPT:VNMZHSL,35,1024,3,0]\r\n[FIRMWARE:grblHAL]",
        "grbl",
        GRBL,
        "grblHAL/RP2040 issue 29",
    ),
    ("Grbl 3.4 [FluidNC v3.4.2 (wifi) '$' for help]", "grbl", GRBL, "Universal G-code Sender, tests of FluidNC"),
    ("Grbl 3.9 [FluidNC v3.9.9 (bt) '$' for help]", "grbl", GRBL, "a calibration plug-in's comments"),
    ("[VER:3.4 FluidNC v3.4.8:]\r\n[OPT:MPHS]", "grbl", GRBL, "FluidNC wiki, $Build/Info"),
    ("Grbl 1.3a ['$' for help]", "grbl", "midtbot", "bdring/Grbl_Esp32, Grbl.h: version 1.3a"),
    ("Grbl 0.9j ['$' for help]", "", "", "grbl/grbl 0.9j"),
    ("EBBv13_and_above EB Firmware Version 2.5.3", "ebb", EBB, "saxi, README"),
    ("EBBv13_and_above EB Firmware Version 2.4.2", "ebb", EBB, "an owner's Processing sketch"),
    ("EBBv13_and_above EB Firmware Version 2.8.1", "ebb", EBB, "evil-mad.github.io/EggBot/ebb.html, V"),
    ("EBBv13_and_above EB Firmware Version 3.0.3", "ebb", "nextdraw-8511", "alexrudd2/saxi issue 340, NextDraw 2234"),
    ("V,EBB Firmware Version 3.0.1", "ebb", "nextdraw-8511", "EBB 3 with CU,10,1"),
    (
        "FIRMWARE_NAME:Marlin 2.0.9.3 (Nov 10 2021) SOURCE_CODE_URL:x MACHINE_TYPE:Ender-3 EXTRUDER_COUNT:1",
        "marlin",
        "creality-ender-3",
        "Marlin, M115",
    ),
    ("FIRMWARE_NAME:Marlin 2.1.2 PROTOCOL_VERSION:1.0 MACHINE_TYPE:Ender-5 Plus", "marlin", "creality-ender-5", "M115"),
    ("FIRMWARE_NAME:Marlin 2.0.9.1 MACHINE_TYPE:Anet A8 EXTRUDER_COUNT:1", "marlin", "marlin-servo", "Marlin, M115"),
    (
        "FIRMWARE_NAME:Prusa-Firmware 3.14.1 based on Marlin MACHINE_TYPE:Prusa i3 MK3S EXTRUDER_COUNT:1",
        "marlin",
        "prusa-mk3",
        "prusa3d/Prusa-Firmware, Marlin_main.cpp",
    ),
    ("FIRMWARE_NAME:Prusa-Firmware-Buddy 4.3.4 (Github) MACHINE_TYPE:Prusa-mini", "marlin", "prusa-mk3", "M115"),
    ("FIRMWARE_NAME:Repetier_0.91 FIRMWARE_URL:z MACHINE_TYPE:Delta", "marlin", "marlin-servo", "Repetier, M115"),
    ("// Klipper state: Ready", "", "", "Klipper, STATUS"),
    ("ok FIRMWARE_VERSION:v0.12.0-60-g0665dc89 FIRMWARE_NAME:Klipper", "", "", "Klipper, M115"),
    (
        '{"jsonrpc": "2.0", "result": {"klippy_connected": true, "klippy_state": "ready", "moonraker_version": "v0"}}',
        "klipper",
        "klipper-servo",
        "Moonraker, documentation, server.info",
    ),
    ("FIRMWARE_NAME:Smoothieware, FIRMWARE_URL:http%3A//smoothieware.org, X-GRBL_MODE:0", "", "", "Smoothieware, M115"),
    ("Smoothie\r\nok", "", "", "Smoothieware, on its USB port"),
    (
        "FIRMWARE_NAME: RepRapFirmware for Duet 2 WiFi/Ethernet FIRMWARE_VERSION: 3.3",
        "",
        "",
        "Duet documentation, M115",
    ),
    ("FIRMWARE_NAME:Teacup FIRMWARE_URL:t PROTOCOL_VERSION:1.0 MACHINE_TYPE:Mendel", "", "", "Teacup, M115"),
    ('{"r":{"fv":0.970,"fb":440.20,"hp":1,"hv":8,"msg":"SYSTEM READY"},"f":[1,0,0,9991]}', "", "", "TinyG wiki"),
    ('{"r":{"fv":0.99,"fb":100.17,"hp":3,"hv":0,"msg":"SYSTEM READY"},"f":[1,0,1]}', "", "", "g2core, start"),
    ("7475A\r", "hpgl", "hp-7475a", "HP 7475A manual, OI"),
    ("7550A\r", "hpgl", "hp-7550a", "HP 7550A manual, OI"),
    ("7440A\r", "hpgl", "hpgl", "HP 7440A manual, OI"),
    ("DXY-1300\r", "hpgl", "roland-dxy-1300", "chiplotle, by which it knows the plotter"),
]


@pytest.mark.parametrize(("said", "dialect", "profile", "source"), RECORDED)
def test_who_it_is(said, dialect, profile, source):
    known = recognise(said)
    assert known is not None and known.dialect == dialect and source
    assert (known.profiles[:1] == (profile,)) if dialect else (not known.profiles and known.advice)
    assert all(profiles.find(name, "plotter").dialect == dialect for name in known.profiles)


@pytest.mark.parametrize("said", ["", "ok", "login:", "U-Boot 2021.04", "Welcome to minicom", "error:20"])
def test_others_are_nobody(said):
    assert recognise(said) is None


class Board:
    """Answers every question with the same words."""

    def __init__(self, words):
        self.words, self.asked = words, False

    def write(self, data):
        self.asked = True

    def read(self, timeout):
        asked, self.asked = self.asked, False
        return self.words if asked else b""

    def close(self):
        pass


def test_what_answers_a_question_without_speaking_the_dialect_is_named(monkeypatch):
    board = Board(b"FIRMWARE_NAME:Smoothieware, FIRMWARE_URL:http%3A//smoothieware.org\r\nok\r\n")
    answer = connections.identify("/dev/ttyACM0", lambda url, baud: board)
    assert answer.dialect == "" and answer.known.title == "Smoothieware"
    monkeypatch.setattr(connections, "identify", lambda port: answer)
    with pytest.raises(DeviceSilent, match=r"Smoothieware answers at /dev/ttyACM0 .*does not speak: export a file"):
        devices.probe("/dev/ttyACM0")


class Talker(Board):
    """Answers each question with words of its own; others with an error."""

    def __init__(self, **answers):
        super().__init__(b"")
        self.answers = answers

    def write(self, data):
        asked = {b"QT\r": "nickname", b"$$\n": "settings", b"V\r": "version", b"$I\n": "version"}
        words = next((self.answers.get(name, b"") for ask, name in asked.items() if data.endswith(ask)), b"")
        if b"printer.objects.list" in data:
            words = self.answers.get("settings", b"")
        elif b"server.info" in data:
            words = self.answers.get("version", b"")
        self.words, self.asked = words, True


V2, V3 = b"EBBv13_and_above EB Firmware Version 2.8.1\r\n", b"EBBv13_and_above EB Firmware Version 3.0.3\r\n"
H1, DRAWCORE = b"[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n", b"[VER:1.1h DrawCore V2.17 (Uunatek):]\r\nok\r\n"
MOON = b'{"jsonrpc": "2.0", "result": {"klippy_state": "ready", "moonraker_version": "v0.9.3"}, "id": 1}\n'
# what else it says; its USB chip; the profile it is taken for, or the two; what decided
NARROWED = [
    (V2, b"AxiDraw SE/A3\r\nOK\r\n", None, ("axidraw-se-a3",), "it is called 'AxiDraw SE/A3'"),
    (V2, b"MiniKit\r\nOK\r\n", None, ("axidraw-minikit",), "called"),
    (V2, b"\r\nOK\r\n", None, ("axidraw-v3", "axidraw-se-a3"), ""),
    (V2, b"Ada\r\nOK\r\n", None, ("axidraw-v3", "axidraw-se-a3"), ""),
    (V2, b"!8 Err: Unknown command 'QT'\r\n", None, ("axidraw-v3", "axidraw-se-a3"), ""),
    (V2, b"\r\nOK\r\n", (0x1A86, 0x7523), ("idraw-h-se-a3", "idraw-1"), "its USB chip (1a86:7523) is not that of"),
    (V2, b"\r\nOK\r\n", (0x04D8, 0xFD92), ("axidraw-v3", "axidraw-se-a3"), ""),
    (V3, b"QT,NextDraw 1117\r\n", None, ("nextdraw-1117",), "called"),
    (V3, b"QT,\r\n", None, ("nextdraw-8511", "nextdraw-1117"), ""),
    (H1, b"$100=80.000\r\n$130=255.000\r\n$131=180.000\r\nok\r\n", None, ("eleksdraw",), "255 × 180 mm"),
    (H1, b"$130=300.000\r\n$131=218.000\r\nok\r\n", None, ("grbl-servo", "grbl-z"), "300 × 218 mm"),
    (H1, b"$130=200.000\r\n$131=200.000\r\nok\r\n", None, ("grbl-servo", "eleksdraw"), ""),
    (DRAWCORE, b"$130=420.000\r\n$131=297.000\r\nok\r\n", None, ("uuna-tek-a3",), "by its own words"),
    (
        MOON,
        b'{"result": {"objects": ["gcode", "servo pen", "toolhead"]}, "id": 2}\n',
        None,
        ("klipper-servo",),
        "servo",
    ),
    (MOON, b'{"result": {"objects": ["manual_stepper pen"]}, "id": 2}\n', None, ("klipper-stepper",), "manual_stepper"),
    (MOON, b'{"result": {"objects": ["gcode", "toolhead"]}, "id": 2}\n', None, ("klipper-z",), "neither"),
]


@pytest.mark.parametrize(("version", "more", "usb", "profiles_", "why"), NARROWED)
def test_what_else_it_says_narrows_it_to_one_or_two(version, more, usb, profiles_, why, monkeypatch):
    url = "moonraker://x" if version is MOON else "/dev/ttyUSB0"
    rows = [connections.SerialDevice(url, "USB Serial", usb)]
    monkeypatch.setattr(connections, "serial_devices", lambda: rows)
    board = Talker(version=version, nickname=more, settings=more)
    answer = connections.identify(url, lambda url, baud: board)
    assert answer.fitting.profiles == profiles_ and why in answer.fitting.why and bool(why) == bool(answer.fitting.why)
    assert sorted((*profiles_, *answer.fitting.others)) == sorted(answer.known.profiles)


def test_profiles_that_fit_are_named(monkeypatch):
    board = Board(b"EBBv13_and_above EB Firmware Version 2.8.1\r\n")
    answer = connections.identify("/dev/ttyACM0", lambda url, baud: board)
    assert answer.firmware == "EBBv13_and_above EB Firmware Version 2.8.1"
    monkeypatch.setattr(connections, "identify", lambda port: answer)
    facts = devices.probe("/dev/ttyACM0")
    assert facts["profiles"] == ["axidraw-v3", "axidraw-se-a3"] and "axidraw-minikit" in facts["others"]
