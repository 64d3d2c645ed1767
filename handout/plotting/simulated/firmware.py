"""The simulated controller: what GRBL 1.1 does with lines and real-time bytes, and what it answers.

The main program of the controller is a generator: it yields how long it is busy (s), or what it waits for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

from handout.plotting.simulated import parser
from handout.plotting.simulated.parser import Modes, Refused
from handout.plotting.simulated.queue import Axes, Queue, Steps
from handout.plotting.simulated.stepper import Stepper
from handout.plotting.simulated.wire import Wire
from handout.profiles import Plotter

Wait = float | Literal["line", "room", "rest"]

_STORED = 80
_UNLOCK = "[MSG:'$H'|'$X' to unlock]"
_HOMING = 0.5  # s; how long the simulated machine looks for its switches


class Firmware:
    """One controller.

    Parameters
    ----------
    wire : its receive buffer, of which it reports the size and the room.
    queue : moves it looks ahead (0: as the profile says).
    say : takes each line of its answers.
    """

    def __init__(self, profile: Plotter, axes: Axes, wire: Wire, queue: int, say: Callable[[str], None]) -> None:
        self.profile, self.axes, self.wire, self.say = profile, axes, wire, say
        self.queue = Queue(axes, queue or profile.port.queue)
        self.modes = Modes()
        self.now = 0.0
        self.at = (0.0, 0.0, profile.pen.up if profile.pen.lift == "z" else 0.0)
        self.queue.clear(self._steps())
        self.stepper = Stepper(self.queue)
        self.locked = profile.homing
        self.dead = False  # after a limit: deaf to all but a reset
        self.power: list[tuple[float, float]] = []  # when the spindle output changed, and to what (0: off)

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

    def power_cycle(self) -> None:
        """It was without power for a moment: where it stands now is its zero."""
        self.locked, self.dead, self.modes = self.profile.homing, False, Modes()
        self._stand_still()
        self.modes.offset = list(self.at)
        self._switch(0.0)
        self.banner()

    def _stand_still(self) -> None:
        self.stepper.stop()
        steps = self.stepper.position
        x, y, z = (count / per for count, per in zip(steps, self.axes.steps, strict=True))
        self.at = (x, y, z)
        self.queue.clear(steps)

    def realtime(self, byte: int) -> bool:
        """Act on a real-time byte; whether it asks for a reset."""
        if byte == 0x18:
            return True
        if not self.dead:
            if byte == ord("?"):
                self.say(self._status())
            elif byte == ord("!"):
                self.stepper.hold()
            elif byte == ord("~"):
                self.stepper.resume(self.now)
        return False

    def _status(self) -> str:
        x, y, z = (count / per for count, per in zip(self.stepper.position, self.axes.steps, strict=True))
        free = self.queue.size - len(self.queue.lines)
        feed = round(self.modes.feed) if self.stepper.moving else 0
        return f"<{self.state}|MPos:{x:.3f},{y:.3f},{z:.3f}|Bf:{free},{self.wire.room}|FS:{feed},0>"

    def execute(self, raw: str) -> Iterator[Wait]:
        """Read a line, do what it says as far as that makes the controller wait, and answer."""
        line = parser.strip(raw)
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
                self.alarm(1)
                return
            self.queue.add(request.target, float("inf") if request.rapid else self.modes.feed / 60.0)
            self.at = request.target
            self.stepper.replan()
            self.stepper.prepare()

    def _switch(self, power: float) -> None:
        self.power.append((self.now, power))

    def _beyond(self, target: tuple[float, float, float]) -> bool:
        """Whether a move would run into the end of an axis."""
        width, height = self.profile.bed.width + 1.0, self.profile.bed.height + 1.0
        return not (-width <= target[0] <= width and -height <= target[1] <= height)

    def alarm(self, number: int) -> None:
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
            self.stepper.position = self._steps()
            self.stepper.trace.append((self.now, self.stepper.position))
            self.queue.clear(self.stepper.position)
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
