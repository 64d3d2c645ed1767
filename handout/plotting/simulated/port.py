"""The simulated plotter as a port: a wire, a controller, a clock, and faults on demand.

Time is virtual: it passes only while someone reads, as fast as the computer allows, unless `realtime` is set.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator

from handout.errors import PortError
from handout.plotting.bed import Placement, place
from handout.plotting.simulated.firmware import Firmware, Wait
from handout.plotting.simulated.options import Options
from handout.plotting.simulated.queue import Axes
from handout.plotting.simulated.trace import strokes
from handout.plotting.simulated.wire import Wire
from handout.profiles import Plotter
from handout.values import Drawing, Page

_Z_STEPS = 250.0


def _axes(profile: Plotter, options: Options) -> Axes:
    limits, pen = profile.limits, profile.pen
    fastest = options.speed or max(limits.draw_speed, limits.travel_speed)
    acceleration = options.acceleration or limits.acceleration
    return Axes(
        steps=[limits.steps_per_mm, limits.steps_per_mm, _Z_STEPS],
        speed=[fastest, fastest, pen.z_speed],
        acceleration=[acceleration, acceleration, pen.z_acceleration],
        deviation=float(limits.junction_deviation),
    )


class SimulatedPlotter:
    """A GRBL 1.1 pen plotter behind a serial wire; a Port.

    Parameters
    ----------
    profile : the machine it is; its own settings (``$$``) say what the profile says, unless an option says otherwise.
    options : what is different, what goes wrong, and when.

    Attributes
    ----------
    placement : how the page lies on it, so that `executed` can answer in page coordinates.
    page : the page that lies on it.
    now : s, its clock.
    """

    def __init__(self, profile: Plotter, options: Options | None = None) -> None:
        self.profile, self.options = profile, options or Options()
        self.page = Page(profile.bed.width, profile.bed.height)
        self.placement: Placement = place(self.page, profile)
        self.now = 0.0
        self._closed = self._gone = self._silent = False
        self._out: deque[tuple[float, bytes]] = deque()  # when it can be read, and what
        self._lines = 0  # lines of G-code read
        self._began: float | None = None
        self._ended = 0.0
        self._struck = False
        self._wall = time.monotonic()
        cut = self.options.after if self.options.fault == "lost-byte" else -1
        self._wire = Wire(self.options.buffer or profile.port.buffer, 10.0 / profile.port.baud, cut)
        self.firmware = Firmware(profile, _axes(profile, self.options), self._wire, self.options.queue, self._say)
        self._program: Iterator[Wait] = self._main()
        self._waits: Wait = "line"
        self._wakes = 0.0
        self.firmware.banner()

    @property
    def lost(self) -> int:
        """Bytes that found the receive buffer full."""
        return self._wire.lost

    def lay(self, page: Page, placement: Placement) -> None:
        """Lay a fresh sheet on the bed: what was drawn before is gone with the last one, and the time starts anew."""
        self.page, self.placement = page, placement
        self._began, self._ended = None, self.now
        stepper = self.firmware.stepper
        stepper.trace[:] = [(self.now, stepper.position)]
        del self.firmware.power[:-1]

    def write(self, data: bytes) -> None:
        """Put bytes on the wire."""
        self._check_open()
        self._wire.put(data, self.now + self.options.latency)

    def read(self, timeout: float) -> bytes:
        """What has been answered by now; if nothing has, what is answered next, within `timeout` seconds."""
        self._check_open()
        self._advance(self.now + timeout)
        self._check_open()
        if self.options.realtime:
            time.sleep(max(0.0, self.now - (time.monotonic() - self._wall)))
        answered = []
        while self._out and self._out[0][0] <= self.now:
            answered.append(self._out.popleft()[1])
        return b"".join(answered)

    def close(self) -> None:
        """Nothing more comes or goes."""
        self._closed = True

    def _check_open(self) -> None:
        if self._closed or self._gone:
            raise PortError("The connection to the simulated plotter is lost: is it still plugged in and switched on?")

    def executed(self) -> Drawing:
        """What the pen has drawn: strokes on the page, with the times at which they were executed."""
        firmware = self.firmware
        drawn = strokes(firmware.stepper.trace, firmware.power, firmware.axes.steps, self.profile.pen, self.placement)
        return Drawing(tuple(drawn), self.page)

    @property
    def executed_s(self) -> float:
        """Seconds from the first line of G-code to the end of the last motion or pause."""
        return 0.0 if self._began is None else self._ended - self._began

    @property
    def pen_is_down(self) -> bool:
        """Whether the pen is on the paper, or was last told to go there."""
        pen = self.profile.pen
        if pen.lift == "z":
            return self.firmware.stepper.position[2] / _Z_STEPS < 0.5 * (pen.up + pen.down)
        power = self.firmware.power[-1][1] if self.firmware.power else 0.0
        return power > 0 and abs(power - pen.down) < abs(power - pen.up)

    def _advance(self, until: float) -> None:
        """Let time pass until something has been answered, at most until `until`."""
        while not self._gone:
            answer = self._out[0][0] if self._out else math.inf
            event = min(answer, self._next_event())
            if answer <= self.now or event > until:
                break
            self._at(event)
            if self._silent:
                continue
            self._receive()
            if self.firmware.stepper.next_end <= self.now:
                self.firmware.stepper.finish_slice()
                self._ended = self.now
            self._run_program()
        if not self._out or self._out[0][0] > self.now:
            self._at(max(until, self.now))

    def _next_event(self) -> float:
        if self._silent:
            return math.inf
        wakes = self._wakes if isinstance(self._waits, float) else math.inf
        return min(self._wire.next, self.firmware.stepper.next_end, wakes)

    def _at(self, now: float) -> None:
        self.now = self.firmware.now = now

    def _say(self, line: str) -> None:
        if self._silent or (line == "ok" and self._strikes("lost-ok")):
            return
        late = self.options.late if line == "ok" and self._past("late") else 0.0
        data = (line + "\r\n").encode("ascii")
        soonest = self.now + self.options.latency + len(data) * self._wire.byte + late
        self._out.append((max(soonest, self._out[-1][0] if self._out else 0.0), data))

    def _receive(self) -> None:
        for byte in self._wire.receive(self.now):
            if self.firmware.realtime(byte):
                self._restart()
                self.firmware.reset()

    def _restart(self) -> None:
        self._wire.clear()
        self._program, self._waits = self._main(), "line"

    def _main(self) -> Iterator[Wait]:
        """The controller's main program: read a line, obey, answer; begin to move when nothing is left to read."""
        while True:
            line = self._wire.line()
            if line is None or self.firmware.dead:
                self.firmware.stepper.start(self.now)
                yield "line"
                continue
            if self._began is None and not line.startswith(b"$") and line.strip():
                self._began = self.now
            yield float(self.profile.port.line_time)
            self._lines += self._began is not None
            if not self._fails():
                yield from self.firmware.execute(line.decode("latin-1").strip())
                self._ended = self.now

    def _run_program(self) -> None:
        """Let the main program run as long as it need not wait."""
        firmware = self.firmware
        while not self._silent:
            waits = self._waits
            if isinstance(waits, float):
                if self._wakes > self.now:
                    return
            elif waits == "line":
                if not self._wire.has_line:
                    return
            else:
                firmware.stepper.start(self.now)
                if firmware.queue.full if waits == "room" else (firmware.stepper.moving or firmware.queue.lines):
                    return
            self._waits = next(self._program)
            if isinstance(self._waits, float):
                self._wakes = self.now + self._waits

    def _past(self, fault: str) -> bool:
        return self.options.fault == fault and self._lines > self.options.after

    def _strikes(self, fault: str) -> bool:
        """Whether the fault happens now; it happens once."""
        if self._struck or not self._past(fault):
            return False
        self._struck = True
        return True

    def _fails(self) -> bool:
        """Let the fault that was asked for happen in its time; whether the line just read is lost to it."""
        if self._strikes("jam"):
            self._silent = True
        elif self._strikes("unplugged"):
            self._gone = True
        elif self._strikes("error"):
            self._say("error:33")
        elif self._strikes("alarm"):
            self.firmware.alarm(1)
        elif self._strikes("reset"):
            self.firmware.power_cycle()
            self._wire.clear()
        else:
            return False
        return True
