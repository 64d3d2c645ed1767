"""The simulated GRBL 1.1: what it does with lines and real-time bytes, and what it answers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

from handout.profiles import Plotter
from handout.simulated.plotter import grbl_parser
from handout.simulated.plotter.firmware import Firmware, Framing, Say, Wait, Wire
from handout.simulated.plotter.grbl_parser import Modes, Refused, Settings
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper
from handout.simulated.plotter.planner import MoveQueue, Stepper, Steps

_STORED = 80  # characters of a line that GRBL keeps, blanks and comments left out (LINE_BUFFER_SIZE)
_UNLOCK = "[MSG:'$H'|'$X' to unlock]"
_WRITING = 0.004  # s it is deaf while it writes into its memory
_SELDOM = 10  # answers to ? between two that tell the offset (REPORT_WCO_REFRESH_IDLE_COUNT)
_BANNERS = {
    "": "Grbl 1.1h ['$' for help]",
    "grblhal": "GrblHAL 1.1f ['$' or '$HELP' for help]",
    "fluidnc": "Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]",
}
# by how many hundredths a byte changes the share of feed and spindle; 0: back to all
_FEEDS = {b"\x90": 0, b"\x91": 10, b"\x92": -10, b"\x93": 1, b"\x94": -1}
_SPINDLES = {b"\x99": 0, b"\x9a": 10, b"\x9b": -10, b"\x9c": 1, b"\x9d": -1}
_RAPIDS = {b"\x95": 100, b"\x96": 50, b"\x97": 25}
_DOOR = b"\x84"
_HOMING = 0.5  # s; how long the simulated machine looks for its switches; set by eye


class GrblFirmware(Firmware):
    """One controller; its own settings (``$$``) say what the profile says, unless an option says otherwise."""

    @staticmethod
    def framing() -> Framing:
        """Lines end with LF or CR; all that is beyond ASCII acts on reception, or is dropped."""
        return Framing(b"\n\r", b"?!~\x18" + bytes(range(128, 256)))

    def __init__(self, profile: Plotter, options: SimulatorOptions, wire: Wire, paper: DrawnPaper, say: Say) -> None:
        self.profile, self.wire, self.paper, self._out = profile, wire, paper, say
        self.settings = Settings(profile, options)
        self.axes = self.settings.axes
        paper.steps[:2] = self.axes.steps[:2]
        self.queue = MoveQueue(self.axes, options.queue or profile.port.queue)
        self.read_time = float(profile.port.line_time)
        self._own = {grbl_parser.strip(line) for line in (*profile.pen.up_command, *profile.pen.down_command)}
        self.variant, self.blank = options.variant, options.blank
        self.modes = Modes()
        self._output = 0.0  # of the spindle
        self._untold = 0  # answers to ? until one tells the offset
        self.reports_itself = False  # its state while it moves (FluidNC)
        self.at = (0.0, 0.0, profile.pen.up if profile.pen.lift == "z" else 0.0)
        self.queue.clear(self._steps())
        self.stepper = Stepper(self.queue, paper.move_to)
        self.locked = self.settings.homes
        self.dead = False  # after a limit, or asleep: deaf to all but a reset
        self.asleep = False  # its motors are off
        self._begin()

    def _begin(self) -> None:
        """Set what every start sets: nothing is held, feed and spindle run at their full shares."""
        self.paused = self.door = False  # by M0, by the safety door
        self.shares = {"feed": 100, "rapid": 100, "spindle": 100}

    def say(self, line: str) -> None:
        """Answer with a line."""
        self._out((line + "\r\n").encode("ascii"))

    @property
    def deaf(self) -> bool:
        """Whether it reads no lines."""
        return self.dead

    @property
    def resting(self) -> bool:
        """Whether it stands still and has nothing left to do."""
        return self.state == "Idle" and not self.queue.lines

    @property
    def next_event(self) -> float:
        """When the slice under way ends, s."""
        return self.stepper.next_end

    def step(self) -> None:
        """The slice under way ends."""
        self.stepper.finish_slice()

    def idle(self) -> None:
        """Begin to move, since nothing is left to read."""
        self.stepper.start(self.now)

    def ready(self, wait: str) -> bool:
        """Whether the queue has "room", the machine is at "rest", or "still" in a hold, or M0 has been "resumed"."""
        if wait == "still":
            return not self.stepper.moving
        if wait == "resumed":
            return not self.paused
        self.stepper.start(self.now)
        return not (self.queue.full if wait == "room" else (self.stepper.moving or self.queue.lines))

    def counts(self, line: bytes) -> bool:
        """G-code counts, questions and settings do not."""
        return not line.startswith(b"$") and bool(line.strip())

    def _steps(self) -> Steps:
        x, y, z = (round(v * s) for v, s in zip(self.at, self.axes.steps, strict=True))
        return x, y, z

    @property
    def state(self) -> str:
        if self.asleep:
            return "Sleep"
        if self.locked:
            return "Alarm"
        if self.door:
            return "Door:2" if self.stepper.moving else "Door:0"
        if self.stepper.holding or self.paused:
            return "Hold:1" if self.stepper.moving else "Hold:0"
        return "Run" if self.stepper.moving else "Idle"

    def banner(self) -> None:
        """What it says when it starts."""
        self.say("")
        if self.blank:
            self.say("error:7")
            self._tell_settings()
        self.say(_BANNERS[self.variant])
        if self.locked:
            self.say(_UNLOCK)

    def reset(self) -> None:
        """A soft reset: forgets what is queued; if it moved, it no longer knows where it is."""
        if self.stepper.moving:
            self.say("ALARM:3")
            self.locked = True
        self._stand_still()
        self.modes, self._untold = Modes(work=self.modes.work), 0
        self._begin()
        self._switch(0.0)
        self.dead = self.asleep = False
        self.banner()

    def stop(self) -> None:
        """Power goes off."""
        self._stand_still()
        self._switch(0.0)

    def start(self) -> None:
        """Power comes on: where it stands is its zero, and a Z axis has been cranked up and set."""
        self.locked, self.dead, self.asleep = self.settings.homes, False, False
        self.modes = Modes(work=self.modes.work)
        self._begin()
        self.paper.lift_pen(self.now)
        self.at = (0.0, 0.0, self.paper.place[2] / self.axes.steps[2])
        self._stand(self._steps())
        self.banner()

    def _stand_still(self) -> None:
        if self.stepper.moving:
            self.stepper.position = self.paper.slip_steps(self.stepper.position)
        self.stepper.stop()
        steps = self.stepper.position
        x, y, z = (count / per for count, per in zip(steps, self.axes.steps, strict=True))
        self.at = (x, y, z)
        self.queue.clear(steps)

    def _stand(self, steps: Steps) -> None:
        """Take a place for the one where it stands."""
        self.stepper.position = steps
        self.queue.clear(steps)
        self.paper.believe(steps)

    def urgent(self, data: bytes) -> bool:
        """Act on a real-time byte; whether it was a reset."""
        if data == b"\x18":
            self.reset()
            return True
        if not self.dead or self.asleep:
            if data == b"?":
                self.say(self._status())
            elif data == b"!":
                self.stepper.hold()
            elif data == b"~":
                if self.door:
                    self._spin()
                self.paused = self.door = False
                self.stepper.resume(self.now)
            elif data == _DOOR:
                self.door = True
                self.stepper.hold()
                self._switch(0.0)
            else:
                # a byte that changes the share of what it is told; new moves obey
                for name, table in (("feed", _FEEDS), ("spindle", _SPINDLES)):
                    if data in table:
                        by = table[data]
                        self.shares[name] = min(max(self.shares[name] + by, 10), 200) if by else 100
                        self._spin()
                self.shares["rapid"] = _RAPIDS.get(data, self.shares["rapid"])
        return False

    def hold(self) -> None:
        """Do what its feed-hold button does."""
        self.urgent(b"!")

    def _spin(self) -> None:
        """Turn the spindle as it is told, by the share that is set."""
        power = self.modes.power if self.modes.spindle else 0.0
        if self._output or power:
            self._switch(power * self.shares["spindle"] / 100)

    def _status(self) -> str:
        place = [count / per for count, per in zip(self.stepper.position, self.axes.steps, strict=True)]
        shift, machine = self.modes.shift, self.settings.report % 2 == 1
        position = place if machine else [at - by for at, by in zip(place, shift, strict=True)]
        fields = [f"{'M' if machine else 'W'}Pos:" + self._format_place(position)]
        if self.settings.report & 2:
            fields.append(f"Bf:{self.queue.size - len(self.queue.lines)},{self.wire.room}")
        fields.append(f"FS:{round(self.modes.feed) if self.stepper.moving else 0},{self._output:.0f}")
        if not self._untold:
            fields.append("WCO:" + self._format_place(shift))
        elif self._untold == 1:
            fields.append("Ov:{feed},{rapid},{spindle}".format(**self.shares))
        self._untold = (self._untold + 1) % _SELDOM
        return f"<{self.state}|{'|'.join(fields)}>"

    def execute(self, line: bytes) -> Iterator[Wait]:
        """Read a line, do what it says as far as that makes the controller wait, and answer."""
        yield from self._execute(grbl_parser.strip(line.decode("latin-1").strip()))

    def _execute(self, line: str) -> Iterator[Wait]:
        try:
            if len(line) > _STORED:
                raise Refused(11)
            if line.startswith("$"):
                yield from self._system(line)
            elif line and self.locked:
                raise Refused(9)
            elif line in self._own:
                yield from self._lift(line)
            elif line:
                yield from self._code(line)
            if not self.dead:
                self.say("ok")
        except Refused as refusal:
            self.say(f"error:{refusal.number}")

    def _code(self, line: str) -> Iterator[Wait]:
        request = grbl_parser.read_request(line, self.modes, self.at)
        if "G92" in line or request.writes:
            self._untold = 0
        if request.writes:
            yield "rest"
            yield from self._write()
        if request.spindle:
            yield "rest"
            self._switch((self.modes.power if self.modes.spindle else 0.0) * self.shares["spindle"] / 100)
        if request.dwell is not None:
            yield "rest"
            yield request.dwell
        if request.target is not None:
            if self.queue.full:
                yield "room"
            in_plane = enumerate(request.target[:2])  # machine space is negative
            if self.settings.has_soft_limits and not all(
                -self.settings.value(130 + a) <= at <= 0.0 for a, at in in_plane
            ):
                self.stepper.hold()
                yield "still"
                self.alarm(2)
                return
            if self._is_beyond(request.target):
                self.alarm()
                return
            self.queue.add(
                request.target, math.inf if request.rapid else self.modes.feed / 60.0 * self.shares["feed"] / 100
            )
            self.at = request.target
            self.stepper.replan()
            self.stepper.prepare()
        if request.stops:
            yield "rest"
            self.paused = True
            yield "resumed"

    def _lift(self, line: str) -> Iterator[Wait]:
        """A line that means nothing to it but moves the pen."""
        pen = self.profile.pen
        yield "rest"
        for command, value in ((pen.up_command, pen.up), (pen.down_command, pen.down)):
            if command and line == grbl_parser.strip(command[-1]):
                self.paper.pen(self.now, value)

    def _switch(self, power: float) -> None:
        if self.profile.pen.lift == "command":
            return
        least, greatest = self.settings.power
        self._output = min(max(power, least), greatest) if power > 0 else 0.0
        self.paper.pen(self.now, self._output)

    def _write(self) -> Iterator[Wait]:
        """Write into its memory, and lose what comes in meanwhile."""
        self.wire.deaf_until = self.now + _WRITING
        yield _WRITING

    def _is_beyond(self, target: tuple[float, float, float]) -> bool:
        """Whether a move would run into the end of an axis."""
        width, height = self.profile.bed.width + 1.0, self.profile.bed.height + 1.0
        x, y, _ = (at + by / per for at, by, per in zip(target, self.paper.shift, self.axes.steps, strict=True))
        return not (-width <= x <= width and -height <= y <= height)

    def refuse(self) -> None:
        """Refuse a line that was understood."""
        self.say("error:33")

    def alarm(self, number: int = 1) -> None:
        """Stop dead, and hear nothing but a reset."""
        self._stand_still()
        self.locked = self.dead = True
        self.say(f"ALARM:{number}")
        self.say("[MSG:Reset to continue]")

    def _system(self, line: str) -> Iterator[Wait]:
        if line == "$X":
            if self.locked:
                self.locked = False
                self.say("[MSG:Caution: Unlocked]")
        elif line == "$H":
            if not self.settings.homes:
                raise Refused(5)
            yield "rest"
            yield _HOMING
            self.locked, self.at = False, (0.0, 0.0, self.at[2])
            self.paper.find_zero(self.now)
            self._stand(self._steps())
        elif self.stepper.moving:
            raise Refused(8)
        elif line == "$SLP":
            self.asleep = self.dead = True
            self.say("ok")
            self.say("[MSG:Sleeping]")
        elif line == "$$":
            self._tell_settings()
        elif line == "$RI=0" and self.variant == "fluidnc":
            self.reports_itself = False
        elif line == "$G":
            self.say(f"[GC:{self.modes.words()}]")
        elif line == "$#":
            self.say(f"[G54:{self._format_place(self.modes.work)}]")
            self.say(f"[G92:{self._format_place(self.modes.offset)}]")
        elif line == "$I":
            self._introduce()
        elif match := re.fullmatch(r"\$(\d+)=(-?\d+\.?\d*)", line):
            self.settings.change(int(match.group(1)), float(match.group(2)))
            yield from self._write()
        else:
            raise Refused(3)

    def _introduce(self) -> None:
        version = {"": "1.1h.20190830", "grblhal": "1.1f.20230101", "fluidnc": "3.7 FluidNC v3.7.8"}[self.variant]
        self.say(f"[VER:{version}:handout]")
        sizes = f"V,{self.queue.size},{self.wire.size}{',3,0' if self.variant else ''}"
        self.say(f"[OPT:{'MPHS' if self.variant == 'fluidnc' else sizes}]")

    def _tell_settings(self) -> None:
        for number, value in sorted(self.settings.table.items()):
            self.say(f"${number}={value}")

    def _format_place(self, place: Sequence[float]) -> str:
        """Format a place as a report has it: in mm with three digits, or in inches with four."""
        if self.settings.value(13):
            return ",".join(f"{value / 25.4:.4f}" for value in place)
        return ",".join(f"{value:.3f}" for value in place)
