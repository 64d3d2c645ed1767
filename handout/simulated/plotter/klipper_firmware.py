"""The simulated Klipper behind Moonraker: what it does with requests, and what it answers.

Source: Moonraker's documentation (printer administration, JSON-RPC notifications) and Klipper's (G-codes, status
reference; the words of its errors from its host program, read for facts): scripts are obeyed one after the other,
each answered when its last line has been taken, not when it has been drawn; questions are answered meanwhile. Its
place is worked out anew four times a second, what its board has said is counted once a second. Words and
codes are those of Moonraker 0.11 and of the host program Kalico 2026.10, run with a made-up board
(`benchmarks.moonraker`).
"""

from __future__ import annotations

import json
import re
from collections import deque
from collections.abc import Callable, Iterator
from math import inf
from typing import Any

from handout.profiles import Plotter
from handout.simulated.plotter.firmware import Firmware, Framing, Say, Wait, Wire
from handout.simulated.plotter.klipper_toolhead import Toolhead, ToolheadLimits
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper

_HOMING = 0.5  # s; how long the simulated machine looks for its switches; set by eye
_GOES, _RESTARTS = 0.5, 2.0  # s until it begins to start anew, and that it takes; as seen
_REFRESH = 0.25  # s between two places that it works out (STATUS_REFRESH_TIME)
_WORD = re.compile(r"([A-Z])\s*(-?(?:\d+\.?\d*|\.\d+))")
_PARAMETER = re.compile(r"([A-Z_]+)=(\S+)")
_IGNORED = ("G21", "M220", "SET_IDLE_TIMEOUT", "SET_VELOCITY_LIMIT", "M204", "SET_GCODE_OFFSET")
_STOPPED = "Shutdown due to webhooks request"
_LOST = "MCU 'mcu' shutdown: Timer too close"
_GONE, _NOTICES = "Lost communication with MCU 'mcu'", 5.0  # s until it notices that
_SHUT = """{}
Once the underlying issue is corrected, use the
"FIRMWARE_RESTART" command to reset the firmware, reload the
config, and restart the host software.
Printer is shutdown
"""
_NOT_THERE = "Klippy Disconnected"
_DEPTH = 150.0, 250.0  # mm that its axes reach beyond the bed to either side


class Refused(Exception):
    """A line that Klipper refuses; what was to come after it in its script is dropped."""


class KlipperFirmware(Firmware):
    """One machine; its settings say what the profile says, unless an option says otherwise.

    homed : axes whose place it knows.
    """

    acknowledgement = b'{"jsonrpc":"2.0","result"'
    obeys = frozenset({"error", "alarm", "reset", "lost-board"})

    @staticmethod
    def framing() -> Framing:
        """A message is a line (a text frame of its WebSocket)."""
        return Framing(b"\n")

    def __init__(self, profile: Plotter, options: SimulatorOptions, wire: Wire, paper: DrawnPaper, say: Say) -> None:
        self.profile, self.options, self.paper, self._say = profile, options, paper, say
        limits, pen = profile.limits, profile.pen
        speed = options.speed or max(limits.draw_speed, limits.travel_speed)
        acceleration = options.acceleration or float(limits.acceleration)
        corner = (limits.junction_deviation * acceleration / (2.0**0.5 - 1.0)) ** 0.5
        self._limits = ToolheadLimits(speed, acceleration, float(pen.z_speed), float(pen.z_acceleration), corner)
        self.toolhead = Toolhead(self._limits, paper.steps, lambda now, at: self._board(paper.move_to, now, at))
        self.read_time = float(profile.port.line_time)
        self.state, self.message = "ready", "Printer is ready"
        self._ready, self._goes = 0.0, inf
        self._gone = inf  # when its board was lost
        self._forget()

    def _forget(self) -> None:
        self.homed = ""
        self._scripts: deque[tuple[Any, list[str]]] = deque()
        self._work: Iterator[Wait] | None = None
        self._wait: Wait = 0.0
        self._wakes = inf
        self.relative, self.feed = False, 25.0
        self.base = [0.0, 0.0, 0.0]
        self._live, self._refreshed = (0.0, 0.0, 0.0), -1.0
        self._refuses = False

    # what the port asks of every firmware

    @property
    def now(self) -> float:
        """Its clock, s."""
        return self.toolhead.now

    @now.setter
    def now(self, now: float) -> None:
        self.toolhead.now = now

    @property
    def resting(self) -> bool:
        """Whether it stands still and has nothing left to do."""
        return self.toolhead.resting and not self._scripts

    @property
    def next_event(self) -> float:
        """When the toolhead, the end of a wait, or the end of its start is due, s."""
        starts = self._ready if self.state == "disconnected" else inf
        return min(self.toolhead.next_event, self._wakes, starts, self._goes, self._gone + _NOTICES)

    def step(self) -> None:
        """Do what is due of these."""
        if self._goes <= self.now:
            self.stop()
            self._start()
        if self.state == "disconnected" and self._ready <= self.now:
            self.state, self.message = "ready", "Printer is ready"
            self._notify("notify_klippy_ready")
        if self._gone + _NOTICES <= self.now:
            self._shut_down(_GONE)
        self.toolhead.step()
        if self._wakes <= self.now:
            self._wakes = inf
        self._obey_scripts()

    def ready(self, wait: str) -> bool:
        """Whether the toolhead has "room" for a move, or is at "rest"."""
        return not self.toolhead.full if wait == "room" else self.toolhead.resting

    def counts(self, line: bytes) -> bool:
        """A plot begins with its first move over the paper."""
        return bool(re.search(rb"gcode\.script.*G1[^\\]*[XY]", line))

    def start(self) -> None:
        """Power comes on: it knows no place before it has been homed or told, but for Z, which somebody has set."""
        self.paper.lift_pen(self.now)
        self._start()

    def _start(self) -> None:
        first = self._ready == 0.0 and self.now == 0.0
        self._forget()
        self._goes = self._gone = inf
        steps, z = self.paper.steps, self.paper.place[2]
        self.toolhead.at = (0.0, 0.0, z / steps[2])
        self.toolhead.forget()
        self.paper.believe((0, 0, z))
        if not first:
            self.state, self._ready = "disconnected", self.now + _RESTARTS
        elif not self.profile.homing and self.profile.bed.zero == "kept":
            self.homed = "xy"  # a macro of its own has told it so
        if self.profile.pen.lift == "z":
            self.homed += "z"

    def stop(self) -> None:
        """Power goes off."""
        self.toolhead.at = self.toolhead.live
        self.toolhead.forget()
        if self.profile.pen.lift == "servo":
            self.paper.pen(self.now, 0.0)
        self._notify("notify_gcode_response", "// Klipper state: Disconnect")
        self._fail(_NOT_THERE, 503)
        self._notify("notify_klippy_disconnected")
        self.state = "disconnected"

    def refuse(self) -> None:
        """The next line of a script is refused."""
        self._refuses = True

    def alarm(self) -> None:
        """Its board lost step with it, so everything stands."""
        self._shut_down(_LOST)

    def lose_board(self) -> None:
        """Lose its board: it goes on counting moves that nobody makes."""
        self._gone = self.now

    def _board(self, does: Callable[..., None], *what: object) -> None:
        """What its board does, if it is there."""
        if self.now <= self._gone:
            does(*what)

    def _shut_down(self, why: str) -> None:
        self.toolhead.at = self.toolhead.live
        self.toolhead.forget()
        self.homed, self._gone = "", inf
        self.state, self.message = "shutdown", _SHUT.format(why)
        self._notify("notify_gcode_response", "// Klipper state: Shutdown")
        self._fail(self.message, 400)
        self._notify("notify_klippy_shutdown")

    def _fail(self, message: str, code: int) -> None:
        """End all scripts with an error."""
        self._work, self._wakes = None, inf
        while self._scripts:
            self._error(self._scripts.popleft()[0], message, code)

    # requests

    def execute(self, line: bytes) -> Iterator[Wait]:
        """Take a request, and answer it unless it is a script that has to wait."""
        if not line.strip():
            return
        try:
            request = json.loads(line)
            number, method, parameters = request.get("id"), request["method"], request.get("params") or {}
        except (ValueError, KeyError, AttributeError):
            self._error(None, "Parse error", -32700)
            return
        yield 0.0
        if method.startswith("printer.") and self.state == "disconnected":
            self._error(number, "Method not found", -32601)
        elif method == "printer.gcode.script":
            if self.state != "ready":
                self._error(number, self.message, 400)
                return
            self._scripts.append((number, parameters.get("script", "").split("\n")))
            self._obey_scripts()
        elif method in ("printer.emergency_stop", "printer.firmware_restart", "printer.restart"):
            self._answer(number, "ok")
            if method == "printer.emergency_stop":
                self._shut_down(_STOPPED)
            else:
                self._goes = self.now + _GOES
        elif (handler := getattr(self, f"_{method.replace('.', '_')}", None)) is not None:
            self._answer(number, handler(parameters))
        else:
            self._error(number, "Method not found", -32601)

    def _server_info(self, parameters: dict[str, Any]) -> object:
        connected = self.state != "disconnected"
        return {"klippy_connected": connected, "klippy_state": self.state, "moonraker_version": "v0.11.0 (simulated)"}

    def _printer_info(self, parameters: dict[str, Any]) -> object:
        return {"state": self.state, "state_message": self.message, "software_version": "v0.12.0 (simulated)"}

    def _printer_objects_list(self, parameters: dict[str, Any]) -> object:
        usual = ["gcode", "webhooks", "configfile", "mcu", "gcode_move", "print_stats", "motion_report", "toolhead"]
        pen = self.profile.pen
        own = {"servo": [f"servo {pen.name}"], "stepper": [f"manual_stepper {pen.name}"]}.get(pen.lift, [])
        if pen.lift == "command":
            own = [f"gcode_macro {line.split()[0]}" for line in (*pen.up_command, *pen.down_command)]
        return {"objects": [*usual, *own]}

    def _printer_query_endstops_status(self, parameters: dict[str, Any]) -> object:
        return {"x": "open", "y": "open"} if self.now <= self._gone else "ok"

    def _printer_objects_query(self, parameters: dict[str, Any]) -> object:
        status = {name: self._object(name) for name in parameters.get("objects", {})}
        return {"eventtime": self.now, "status": status}

    def _object(self, name: str) -> dict[str, Any]:
        """What is told of one of its objects."""
        head, limits, bed = self.toolhead, self._limits, self.profile.bed
        if name == "webhooks":
            return {"state": self.state, "state_message": self.message}
        if name == "mcu":
            return {"last_stats": {"bytes_read": 1000 + 40 * int(min(self.now, self._gone))}}
        if name == "print_stats":
            return {"filename": "", "state": "standby", "message": ""}
        if name == "motion_report":
            if self.now >= self._refreshed + _REFRESH:
                self._refreshed, self._live = self.now, head.live
            return {"live_position": [*self._live, 0.0]}
        if name == "gcode_move":
            position = [at - base for at, base in zip(head.at, self.base, strict=True)]
            return {"position": [*head.at, 0.0], "gcode_position": [*position, 0.0]}
        if name == "configfile":
            rotation = 200 * 16 / self.profile.limits.steps_per_mm
            stepper = {"rotation_distance": rotation, "microsteps": 16, "full_steps_per_rotation": 200}
            return {"settings": {"stepper_x": stepper, "force_move": {"enable_force_move": True}}}
        if name != "toolhead":
            return {}
        least, most = ((-value for value in _DEPTH[:1] * 3), (bed.width + _DEPTH[1], bed.height + _DEPTH[1], 250.0))
        return {
            "homed_axes": self.homed, "print_time": head.print_time, "estimated_print_time": self.now,
            "position": [*head.at, 0.0], "max_velocity": limits.speed, "max_accel": limits.acceleration,
            "minimum_cruise_ratio": 0.5, "square_corner_velocity": limits.corner, "stalls": 0,
            "axis_minimum": [*least, 0.0], "axis_maximum": [*most, 0.0],
        }  # fmt: skip

    def _answer(self, number: Any, result: object) -> None:
        self._send({"jsonrpc": "2.0", "result": result, "id": number})

    def _error(self, number: Any, message: str, code: int) -> None:
        self._send({"jsonrpc": "2.0", "error": {"code": code, "message": message}, "id": number})

    def _notify(self, method: str, *parameters: object) -> None:
        self._send({"jsonrpc": "2.0", "method": method, "params": list(parameters)})

    def _send(self, message: dict[str, Any]) -> None:
        self._say(json.dumps(message, separators=(",", ":")).encode() + b"\n")

    # scripts

    def _obey_scripts(self) -> None:
        """Obey scripts as far as none has to wait."""
        while self._scripts:
            if self._work is None:
                self._work, self._wait = self._obey(self._scripts[0][1]), 0.0
            elif isinstance(self._wait, float):
                if self.now < self._wakes < inf:
                    return
            elif not self.ready(self._wait):
                return
            try:
                step = next(self._work, None)
            except Refused as error:
                self._work = None
                self._notify("notify_gcode_response", f"!! {error}")
                self._error(self._scripts.popleft()[0], str(error), 400)
                continue
            if step is None:
                self._work = None
                self._answer(self._scripts.popleft()[0], "ok")
            else:
                self._wait = step
                self._wakes = self.now + step if isinstance(step, float) else inf

    def _obey(self, lines: list[str]) -> Iterator[Wait]:
        for line in lines:
            if text := line.split(";")[0].strip().upper():
                yield from self._line(text)

    def _line(self, text: str) -> Iterator[Wait]:
        code = (re.match(r"[GM]\d+|[A-Z_]+", text) or re.match(r".*", text)).group()  # type: ignore[union-attr]
        numbers = {letter: float(value) for letter, value in _WORD.findall(text[len(code) :])}
        if code in ("G0", "G1"):
            yield "room"
            self._move(numbers, text)
        elif code == "G4":
            self.toolhead.dwell(numbers.get("P", 0.0) / 1000.0)
        elif code == "M400":
            self.toolhead.last_move_time()
            yield "rest"
        elif code == "G28":
            self.toolhead.last_move_time()
            yield "rest"
            yield _HOMING
            self.paper.find_zero(self.now)
            z = self.toolhead.at[2]
            self.toolhead.set_position((0.0, 0.0, z))
            self.paper.believe((0, 0, round(z * self.paper.steps[2])))
            self.homed, self.base[:2] = self.homed.replace("x", "").replace("y", "") + "xy", [0.0, 0.0]
        elif code in ("G90", "G91"):
            self.relative = code == "G91"
        elif code == "G92":
            for axis, letter in enumerate("XYZ"):
                if letter in numbers:
                    self.base[axis] = self.toolhead.at[axis] - numbers[letter]
        elif code in ("M84", "M18"):
            self.toolhead.dwell(0.1)
            self.homed = ""
        else:
            self._obey_extended(code, dict(_PARAMETER.findall(text)), text)

    def _obey_extended(self, code: str, values: dict[str, str], text: str) -> None:
        """Klipper's own commands, and macros."""
        pen = self.profile.pen
        macros = [line.split()[0].upper() for line in (*pen.up_command, *pen.down_command)]
        if code == "SET_SERVO" and pen.lift == "servo":
            self._check_name(values, "SERVO", code)
            angle = float(values["ANGLE"])
            self.toolhead.call_after(lambda now: self._board(self.paper.pen, now, angle))
        elif code == "MANUAL_STEPPER" and pen.lift == "stepper":
            self._check_name(values, "STEPPER", code)
            to, speed = float(values["MOVE"]), float(values["SPEED"])
            self.toolhead.dwell(abs(pen.up - pen.down) / speed)
            self.toolhead.call_after(lambda now: self._board(self.paper.pen, now, to))
        elif code in macros:
            value = pen.up if any(code == line.split()[0].upper() for line in pen.up_command) else pen.down
            self.toolhead.call_after(lambda now: self._board(self.paper.pen, now, value))
        elif code == "SET_KINEMATIC_POSITION":
            x, y, z = (float(values.get(letter, at)) for letter, at in zip("XYZ", self.toolhead.at, strict=True))
            self.toolhead.set_position((x, y, z))
            steps = [round(at * per) for at, per in zip((x, y, z), self.paper.steps, strict=True)]
            self.paper.believe((steps[0], steps[1], steps[2]))
            self.base, self.homed = [0.0, 0.0, 0.0], "xyz"
        elif code not in _IGNORED:
            self._notify("notify_gcode_response", f'// Unknown command:"{text.split()[0]}"')

    def _check_name(self, values: dict[str, str], key: str, code: str) -> None:
        if values.get(key, "").lower() != self.profile.pen.name:
            raise Refused(f"The value '{values.get(key)}' is not valid for {key}")

    def _move(self, words: dict[str, float], text: str) -> None:
        if words.get("F", 0.0) > 0:
            self.feed = words["F"] / 60.0
        head, target = self.toolhead, list(self.toolhead.at)
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                target[axis] = words[letter] + (head.at[axis] if self.relative else self.base[axis])
                if letter.lower() not in self.homed and target[axis] != head.at[axis]:
                    where = " ".join(f"{value:.3f}" for value in target)
                    raise Refused(f"Must home axis first: {where} [0.000]")
        bed = self.profile.bed
        beyond = abs(target[0]) > bed.width + _DEPTH[1] or abs(target[1]) > bed.height + _DEPTH[1]
        if self._refuses or beyond:
            self._refuses = False
            raise Refused("Move out of range: " + " ".join(f"{value:.3f}" for value in target) + " [0.000]")
        head.move((target[0], target[1], target[2]), self.feed)
