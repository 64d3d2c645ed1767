"""The simulated Marlin: how it takes in numbered lines and asks for missing ones, what it does and says.

Source: Marlin's queue of commands, read for facts.
"""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Callable, Iterator

from handout.profiles import Plotter
from handout.simulated.plotter import firmware
from handout.simulated.plotter.firmware import Firmware, Say, Wait, Wire
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper
from handout.simulated.plotter.planner import MarlinAxes, MarlinQueue, Stepper, Steps

_BUFFER = 4  # commands it holds, the one under way included (BUFSIZE)
_KEPT = 95  # bytes of a line, the rest is lost silently (MAX_CMD_SIZE)
_URGENT = re.compile(rb"\s*(M108|M112|M410)\s*")


class MarlinFraming(firmware.Framing):
    """Lines; three of them may act on reception besides (EMERGENCY_PARSER), and are read later as all others."""

    def cut_pieces(self, data: bytes) -> Iterator[tuple[bytes, bool]]:
        """Pieces, each up to the end of a line."""
        for piece, _ in super().cut_pieces(data):
            if _URGENT.fullmatch(piece):
                yield piece, True
            yield piece, False


class Reception:
    """Lines received, judged, and not yet obeyed.

    say : takes the lines of its answers; flush : forgets the bytes that have been received.

    commands : in order; the first is under way.
    last : number of the last line that was taken.
    echoes : whether ``ok`` follows a request for a line, as it does in most versions.
    garbles : every line is judged damaged.
    """

    def __init__(self, say: Callable[[str], None], flush: Callable[[], None]) -> None:
        self._say, self._flush = say, flush
        self.commands: deque[str] = deque()
        self.last = 0
        self.echoes = True
        self.garbles = False

    @property
    def full(self) -> bool:
        """Whether no further line can be taken."""
        return len(self.commands) >= _BUFFER

    @property
    def room(self) -> int:
        """Commands that it can still take."""
        return _BUFFER - len(self.commands)

    def take(self, raw: bytes) -> str | None:
        """Judge a line; what it says if it was good and is now in the queue."""
        line = raw.rstrip(b"\r\n").split(b";")[0][:_KEPT].lstrip(b" ").decode("latin-1")
        if not line:
            return None
        if line.startswith("N") and not self._check_number(line):
            return None
        self.commands.append(line)
        return line

    def _check_number(self, line: str) -> bool:
        """Check a line that begins with its number."""
        number = _integer(line[1:])
        body, star, sum_text = line.rpartition("*")
        checksum = 0
        for char in body:
            checksum ^= ord(char)
        if number != self.last + 1 and "M110" not in line:
            return self._refuse("Line Number is not Last Line Number+1")
        if not star:
            return self._refuse("No Checksum with line number")
        if _integer(sum_text) != checksum or self.garbles:
            return self._refuse("checksum mismatch")
        self.last = number
        return True

    def _refuse(self, why: str) -> bool:
        """Throw away what has been received, and ask for the line after the last good one."""
        self._say(f"Error:{why}, Last Line: {self.last}")
        self._flush()
        self._say(f"Resend: {self.last + 1}")
        if self.echoes:
            self._say("ok")
        return False


def _integer(text: str) -> int:
    """The number at the beginning of a text; 0 if there is none."""
    match = re.match(r"\s*[-+]?\d+", text)
    return int(match.group()) if match else 0


_HOMING = 0.5  # s; how long the simulated machine looks for its switches; set by eye
_BUSY = 2.0  # s between two signs of life of a command that takes its time (DEFAULT_KEEPALIVE_INTERVAL)
_ENOUGH = 3  # blocks with which it begins to move
_PATIENT = 0.1  # s after which it begins with fewer (BLOCK_DELAY_FOR_1ST_MOVE)
_CLEANING = 1.0  # s after a quick stop in which it takes no moves
_WORD = re.compile(r"([A-Z])\s*(-?(?:\d+\.?\d*|\.\d+))?")
_KILLED = "Error:Printer halted. kill() called!"


class MarlinFirmware(Firmware):
    """One controller; its own settings say what the profile says, unless an option says otherwise.

    advanced : ADVANCED_OK: every ``ok`` says which line and how much room.
    emergency : EMERGENCY_PARSER: M108, M112 and M410 act on reception.
    """

    @staticmethod
    def framing() -> MarlinFraming:
        """Lines end with a line feed or a carriage return."""
        return MarlinFraming(b"\n\r")

    def __init__(self, profile: Plotter, options: SimulatorOptions, wire: Wire, paper: DrawnPaper, say: Say) -> None:
        self.profile, self.options, self.wire, self.paper, self._out = profile, options, firmware, paper, say
        limits, pen = profile.limits, profile.pen
        fastest = options.speed or max(limits.draw_speed, limits.travel_speed)
        travel = options.acceleration or float(limits.acceleration)
        self.axes = MarlinAxes(
            steps=paper.steps, speed=[fastest, fastest, float(pen.z_speed)],
            acceleration=[travel, travel, float(pen.z_acceleration)], travel=travel,
            deviation=float(limits.junction_deviation), jerk=float(limits.jerk),
        )  # fmt: skip
        self.planner = MarlinQueue(self.axes, options.queue or profile.port.queue)
        self.stepper = Stepper(self.planner, paper.move_to, ahead=1)
        self.read_time = float(profile.port.line_time)
        self.reception = Reception(self.say, wire.clear)
        self.advanced = self.emergency = False
        self._forget()

    def _forget(self) -> None:
        self.reception.commands.clear()
        self.reception.last = 0
        self.at = [0.0, 0.0, self.paper.place[2] / self.axes.steps[2]]  # where the last move leads to, mm
        self.offset = [0.0, 0.0, 0.0]
        self.relative, self.feed, self.percent = False, 25.0, 100.0
        self.axes.least_time = 0.02
        self.dead = False
        self._work: Iterator[Wait] | None = None
        self._wait: Wait = 0.0
        self._wakes = self._speaks = self._delivers = math.inf
        self._cleaning = -math.inf
        self._counted = 0
        self._paused = False  # until somebody presses its button

    def say(self, line: str) -> None:
        """Answer with a line."""
        self._out((line + "\n").encode("ascii", "replace"))

    # what the port asks of every firmware

    @property
    def deaf(self) -> bool:
        """Whether it reads no lines: killed."""
        return self.dead

    @property
    def resting(self) -> bool:
        """Whether it stands still and has nothing left to do."""
        return not (self.dead or self.reception.commands or self.stepper.moving or self.planner.lines)

    @property
    def next_event(self) -> float:
        """When the next step, the end of a wait, or a sign of life is due, s."""
        return min(self.stepper.next_end, self._wakes, self._speaks, self._delivers)

    def step(self) -> None:
        """Do what is due of these."""
        if self.stepper.next_end <= self.now:
            self.stepper.finish_slice()
        if self._delivers <= self.now:
            self._deliver()
        if self._speaks <= self.now:
            self._speaks = self.now + _BUSY
            self.say(f"echo:busy: {'paused for user' if self._paused else 'processing'}")
        if self._wakes <= self.now:
            self._wakes = math.inf
        self._obey_commands()

    def ready(self, wait: str) -> bool:
        """Whether its "button" was pressed, it has a "slot" for a command, "room" in its planner, or is at "rest"."""
        if wait == "button":
            return not self._paused
        if wait == "slot":
            return not self.reception.full
        if self.now < self._cleaning:
            return False
        if wait == "room":
            return self._planned_moves < self.planner.size
        return not (self.stepper.moving or self.planner.lines)

    def counts(self, line: bytes) -> bool:
        """A plot begins with its first move over the paper."""
        return bool(re.search(rb"G1.*[XY]", line))

    def execute(self, line: bytes) -> Iterator[Wait]:
        """Take a line in, as soon as there is a slot for it; it is obeyed in its turn."""
        if self.reception.full:
            yield "slot"
        self._counted += self.counts(line)
        self.reception.garbles = self.options.fault == "resend-loop" and self._counted > self.options.after
        command = self.reception.take(line)
        if command in ("M410", "M112") and not self.emergency:
            self._emergency(command)
        self._obey_commands()

    def urgent(self, data: bytes) -> bool:
        """M112 and M410 act on reception if it has been built so."""
        if self.emergency and data.strip() == b"M108":
            self._paused = False
        elif self.emergency:
            self._emergency(data.decode("ascii").strip())
        return False

    def _emergency(self, code: str) -> None:
        self._stand_still()
        if code == "M112":
            self.dead = True
            self.say(_KILLED)
        else:
            self._cleaning = self._wakes = self.now + _CLEANING

    def start(self) -> None:
        """Power comes on: where it stands is its zero, and a Z axis has been cranked up and set."""
        self.paper.lift_pen(self.now)
        self._forget()
        self._stand()
        for line in ("start", "Marlin 2.1.2.1", "", "echo: Last Updated: 2023-05-16 | Author: (handout)"):
            self.say(line)
        self.say("echo: Free Memory: 2731  PlannerBufferBytes: 1152")

    def stop(self) -> None:
        """Power goes off."""
        self._stand_still()
        self.paper.pen(self.now, 0.0)
        self.reception.commands.clear()
        self._work = None
        self._wakes = self._speaks = math.inf

    def refuse(self) -> None:
        """Something is wrong with it."""
        self.say("Error:Heating failed, system stopped! Heater_ID: E0")
        self._emergency("M112")

    def hold(self) -> None:
        """It waits for somebody to press its button before it obeys anything more."""
        self._paused = True

    def alarm(self) -> None:
        """A limit switch is hit: it stands."""
        self._stand_still()
        self.say(f"echo:endstops hit:  X:{self.at[0]:.2f}")

    # what it does

    @property
    def _planned_moves(self) -> int:
        """Moves in its planner, of which one is let go when it has been made."""
        return len(self.planner.lines) + self.stepper.ending

    def _stand(self) -> None:
        """Believe to stand where the last move leads to."""
        x, y, z = (round((v + o) * s) for v, o, s in zip(self.at, self.offset, self.axes.steps, strict=True))
        steps: Steps = (x, y, z)
        self.stepper.position = steps
        self.planner.clear(steps)
        self.paper.believe(steps)

    def _stand_still(self) -> None:
        if self.stepper.moving:
            self.stepper.position = self.paper.slip_steps(self.stepper.position)
        self.stepper.stop()
        steps = self.stepper.position
        self.at = [n / per - o for n, per, o in zip(steps, self.axes.steps, self.offset, strict=True)]
        self.planner.clear(steps)
        self._delivers = math.inf

    def _obey_commands(self) -> None:
        """Obey commands as far as none has to wait."""
        while not self.dead:
            if self._work is None:
                if not self.reception.commands:
                    return
                self._work, self._wait = self._obey(self.reception.commands[0]), 0.0
                self._speaks = self.now + _BUSY
            elif isinstance(self._wait, float):
                if self._wakes < math.inf and self._wakes > self.now:
                    return
            elif not self.ready(self._wait):
                return
            step = next(self._work, None)
            if step is None:
                self._work, self._speaks = None, math.inf
                self.reception.commands.popleft()
            else:
                self._wait = step
                self._wakes = self.now + step if isinstance(step, float) else math.inf

    def _obey(self, line: str) -> Iterator[Wait]:
        number = re.match(r"N\s*(-?\d+) *", line)
        text = line[number.end() if number else 0 :].split("*")[0].strip()
        words = {letter: float(value) if value else 0.0 for letter, value in _WORD.findall(text)}
        code = re.match(r"[GM]\d+", text)
        if self._paused:
            yield "button"
        handler = getattr(self, f"_{code.group().lower()}", None) if code else None
        if handler is None:
            self.say(f'echo:Unknown command: "{line[number.end() if number else 0 :]}"')
        else:
            yield from handler(words)
        if self.advanced:
            room = self.planner.size - self._planned_moves
            which = f" N{number.group(1)}" if number else ""
            self.say(f"ok{which} P{room} B{self.reception.room}")
        else:
            self.say("ok")

    def _g1(self, words: dict[str, float]) -> Iterator[Wait]:
        if words.get("F", 0.0) > 0:
            self.feed = words["F"] / 60.0
        target = list(self.at)
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                target[axis] = words[letter] + (self.at[axis] if self.relative else 0.0)
        if self._planned_moves >= self.planner.size or self.now < self._cleaning:
            yield "room"
        x, y, z = (value + shift for value, shift in zip(target, self.offset, strict=True))
        if abs(x) > self.profile.bed.width + 1.0 or abs(y) > self.profile.bed.height + 1.0:
            self.alarm()
            return
        self.at = target
        self.planner.add((x, y, z), self.feed * self.percent / 100.0)
        if self.stepper.moving:
            return
        if len(self.planner.lines) >= _ENOUGH:
            self._deliver()
        elif self.planner.lines and self._delivers == math.inf:
            self._delivers = self.now + _PATIENT

    _g0 = _g1

    def _deliver(self) -> None:
        self._delivers = math.inf
        self.stepper.start(self.now)

    def _g4(self, words: dict[str, float]) -> Iterator[Wait]:
        yield "rest"
        yield words["S"] if "S" in words else words.get("P", 0.0) / 1000.0

    def _g28(self, words: dict[str, float]) -> Iterator[Wait]:
        yield "rest"
        yield _HOMING
        self.at[:2], self.offset[:2] = [0.0, 0.0], [0.0, 0.0]
        self.paper.find_zero(self.now)
        self._stand()

    def _g92(self, words: dict[str, float]) -> Iterator[Wait]:
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                self.offset[axis] += self.at[axis] - words[letter]
                self.at[axis] = words[letter]
        yield from ()

    def _g90(self, words: dict[str, float]) -> Iterator[Wait]:
        self.relative = False
        yield from ()

    def _g91(self, words: dict[str, float]) -> Iterator[Wait]:
        self.relative = True
        yield from ()

    def _g21(self, words: dict[str, float]) -> Iterator[Wait]:
        yield from ()

    _m84 = _m110 = _m108 = _m410 = _g21

    def _m400(self, words: dict[str, float]) -> Iterator[Wait]:
        yield "rest"

    def _m280(self, words: dict[str, float]) -> Iterator[Wait]:
        """A servo acts at once, whatever still moves."""
        if words.get("P", 0.0) != 0.0:
            self.say(f"Error:Servo {words['P']:.0f} out of range")
        elif "S" in words:
            self.paper.pen(self.now, words["S"])
        yield from ()

    def _m220(self, words: dict[str, float]) -> Iterator[Wait]:
        self.percent = words.get("S", self.percent)
        yield from ()

    def _m205(self, words: dict[str, float]) -> Iterator[Wait]:
        self.axes.least_time = words.get("B", self.axes.least_time * 1e6) / 1e6
        yield from ()

    def _m114(self, words: dict[str, float]) -> Iterator[Wait]:
        counts = self.stepper.position
        position = " ".join(f"{letter}:{value:.2f}" for letter, value in zip("XYZ", self.at, strict=True))
        self.say(f"{position} E:0.00 Count X:{counts[0]} Y:{counts[1]} Z:{counts[2]}")
        yield from ()

    def _m115(self, words: dict[str, float]) -> Iterator[Wait]:
        self.say(
            "FIRMWARE_NAME:Marlin 2.1.2.1 (simulated) SOURCE_CODE_URL:none PROTOCOL_VERSION:1.0 "
            "MACHINE_TYPE:handout EXTRUDER_COUNT:1 UUID:cede2a2f-41a2-4748-9b12-c55c62f367ff"
        )
        for name, able in (("EEPROM", 1), ("AUTOREPORT_TEMP", 1), ("EMERGENCY_PARSER", int(self.emergency))):
            self.say(f"Cap:{name}:{able}")
        yield from ()

    def _m503(self, words: dict[str, float]) -> Iterator[Wait]:
        axes = self.axes
        corner = f"X{axes.jerk:.2f} Y{axes.jerk:.2f} Z0.30 E5.00" if axes.jerk else f"J{axes.deviation:.3f}"
        acceleration = f"P{axes.acceleration[0]:.2f} R500.00 T{axes.travel:.2f}"
        self.say("echo:; Linear Units:\necho:  G21 ; (mm)")
        for code, values in (("M92", axes.steps), ("M203", axes.speed), ("M201", axes.acceleration)):
            self.say(f"echo:  {code} X{values[0]:.2f} Y{values[1]:.2f} Z{values[2]:.2f} E93.00")
        self.say(f"echo:; Acceleration (units/s2):\necho:  M204 {acceleration}")
        self.say(f"echo:  M205 B{axes.least_time * 1e6:.2f} S0.00 T0.00 {corner}")
        yield from ()
