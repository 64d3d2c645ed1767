"""The simulated GRBL 1.1: what it does with lines and real-time bytes, and what it answers."""

from __future__ import annotations

import math
from collections.abc import Iterator

from handout.plotting.simulated.firmware import Say, Wait
from handout.plotting.simulated.grbl import parser
from handout.plotting.simulated.grbl.parser import Modes, Refused
from handout.plotting.simulated.options import Options
from handout.plotting.simulated.paper import Paper
from handout.plotting.simulated.queue import Axes, Queue, Steps
from handout.plotting.simulated.stepper import Stepper
from handout.plotting.simulated.wire import Wire
from handout.profiles import Plotter

_STORED = 80
_UNLOCK = "[MSG:'$H'|'$X' to unlock]"
_HOMING = 0.5  # s; how long the simulated machine looks for its switches


def _axes(profile: Plotter, options: Options, steps: list[float]) -> Axes:
    limits, pen = profile.limits, profile.pen
    fastest = options.speed or max(limits.draw_speed, limits.travel_speed)
    acceleration = options.acceleration or limits.acceleration
    return Axes(
        steps=steps,
        speed=[fastest, fastest, pen.z_speed],
        acceleration=[acceleration, acceleration, pen.z_acceleration],
        deviation=float(limits.junction_deviation),
    )


class Firmware:
    """One controller; its own settings (``$$``) say what the profile says, unless an option says otherwise."""

    def __init__(self, profile: Plotter, options: Options, wire: Wire, paper: Paper, say: Say) -> None:
        self.profile, self.wire, self.paper, self._out = profile, wire, paper, say
        self.axes = _axes(profile, options, paper.steps)
        self.queue = Queue(self.axes, options.queue or profile.port.queue)
        self.read_time = float(profile.port.line_time)
        self.modes = Modes()
        self.now = 0.0
        self.at = (0.0, 0.0, profile.pen.up if profile.pen.lift == "z" else 0.0)
        self.queue.clear(self._steps())
        self.stepper = Stepper(self.queue, paper.moved)
        self.locked = profile.homing
        self.dead = False  # after a limit: deaf to all but a reset

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
    def next(self) -> float:
        """When the slice under way ends, s."""
        return self.stepper.next_end

    def step(self) -> None:
        """The slice under way ends."""
        self.stepper.finish_slice()

    def idle(self) -> None:
        """Nothing is left to read: begin to move."""
        self.stepper.start(self.now)

    def ready(self, wait: str) -> bool:
        """Whether the queue has "room", or the machine is at "rest"."""
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
        if self.locked:
            return "Alarm"
        if self.stepper.holding:
            return "Hold:1" if self.stepper.moving else "Hold:0"
        return "Run" if self.stepper.moving else "Idle"

    def banner(self) -> None:
        """What it says when it starts."""
        self.say("")
        self.say("Grbl 1.1h ['$' for help]")
        if self.locked:
            self.say(_UNLOCK)

    def reset(self) -> None:
        """A soft reset: forgets what is queued; if it moved, it no longer knows where it is."""
        if self.stepper.moving:
            self.say("ALARM:3")
            self.locked = True
        self._stand_still()
        self.modes = Modes()
        self._switch(0.0)
        self.dead = False
        self.banner()

    def stop(self) -> None:
        """Power goes off."""
        self._stand_still()
        self._switch(0.0)

    def start(self) -> None:
        """Power comes on: where it stands is its zero, and a Z axis has been cranked up and set."""
        self.locked, self.dead, self.modes = self.profile.homing, False, Modes()
        self.paper.lifted(self.now)
        self.at = (0.0, 0.0, self.paper.at[2] / self.axes.steps[2])
        self._stand(self._steps())
        self.banner()

    def _stand_still(self) -> None:
        self.stepper.stop()
        steps = self.stepper.position
        x, y, z = (count / per for count, per in zip(steps, self.axes.steps, strict=True))
        self.at = (x, y, z)
        self.queue.clear(steps)

    def _stand(self, steps: Steps) -> None:
        """Believe to stand there."""
        self.stepper.position = steps
        self.queue.clear(steps)
        self.paper.believe(steps)

    def urgent(self, data: bytes) -> bool:
        """Act on a real-time byte; whether it was a reset."""
        if data == b"\x18":
            self.reset()
            return True
        if not self.dead:
            if data == b"?":
                self.say(self._status())
            elif data == b"!":
                self.stepper.hold()
            elif data == b"~":
                self.stepper.resume(self.now)
        return False

    def _status(self) -> str:
        x, y, z = (count / per for count, per in zip(self.stepper.position, self.axes.steps, strict=True))
        free = self.queue.size - len(self.queue.lines)
        feed = round(self.modes.feed) if self.stepper.moving else 0
        return f"<{self.state}|MPos:{x:.3f},{y:.3f},{z:.3f}|Bf:{free},{self.wire.room}|FS:{feed},0>"

    def execute(self, line: bytes) -> Iterator[Wait]:
        """Read a line, do what it says as far as that makes the controller wait, and answer."""
        yield from self._execute(parser.strip(line.decode("latin-1").strip()))

    def _execute(self, line: str) -> Iterator[Wait]:
        try:
            if len(line) > _STORED:
                raise Refused(11)
            if line.startswith("$"):
                yield from self._system(line)
            elif line and self.locked:
                raise Refused(9)
            elif line:
                yield from self._code(line)
            if not self.dead:
                self.say("ok")
        except Refused as refusal:
            self.say(f"error:{refusal.number}")

    def _code(self, line: str) -> Iterator[Wait]:
        request = parser.read(line, self.modes, self.at)
        if request.spindle:
            yield "rest"
            self._switch(self.modes.power if self.modes.spindle else 0.0)
        if request.dwell is not None:
            yield "rest"
            yield request.dwell
        if request.target is not None:
            if self.queue.full:
                yield "room"
            if self._beyond(request.target):
                self.alarm()
                return
            self.queue.add(request.target, math.inf if request.rapid else self.modes.feed / 60.0)
            self.at = request.target
            self.stepper.replan()
            self.stepper.prepare()

    def _switch(self, power: float) -> None:
        self.paper.pen(self.now, power)

    def _beyond(self, target: tuple[float, float, float]) -> bool:
        """Whether a move would run into the end of an axis."""
        width, height = self.profile.bed.width + 1.0, self.profile.bed.height + 1.0
        return not (-width <= target[0] <= width and -height <= target[1] <= height)

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
            if not self.profile.homing:
                raise Refused(5)
            yield "rest"
            yield _HOMING
            self.locked, self.at = False, (0.0, 0.0, self.at[2])
            self.paper.homed(self.now)
            self._stand(self._steps())
        elif self.stepper.moving:
            raise Refused(8)
        elif line == "$$":
            for number, value in self._settings():
                self.say(f"${number}={value}")
        elif line == "$I":
            self.say("[VER:1.1h.20190830:handout]")
            self.say(f"[OPT:V,{self.queue.size},{self.wire.size}]")
        else:
            raise Refused(3)

    def _settings(self) -> list[tuple[int, str]]:
        axes, bed = self.axes, self.profile.bed
        homing = int(self.profile.homing)
        table = [(10, "1"), (11, f"{axes.deviation:.3f}"), (13, "0"), (20, "0"), (21, "1"), (22, str(homing))]
        table += [(30, "1000"), (31, "0"), (32, "0")]
        table += [(100 + axis, f"{axes.steps[axis]:.3f}") for axis in range(3)]
        table += [(110 + axis, f"{axes.speed[axis] * 60:.3f}") for axis in range(3)]
        table += [(120 + axis, f"{axes.acceleration[axis]:.3f}") for axis in range(3)]
        return [*table, (130, f"{bed.width:.3f}"), (131, f"{bed.height:.3f}"), (132, "50.000")]
