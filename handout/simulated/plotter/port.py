"""The simulated plotter as a port: a wire, a controller, a clock, and a sheet of paper.

Time is virtual: it passes only while someone reads, as fast as the computer allows.  With `realtime` it is the clock of
the computer: the controller goes on with what it has received whether or not anybody writes or reads.  What it did in
the meantime is worked out when it is written to or read from, at the moments at which it happened.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator
from typing import Any, Protocol

from handout import signals
from handout.errors import PortError
from handout.plotting.bed import BedPlacement, place
from handout.plotting.ports import InstrumentedPort
from handout.profiles import Plotter
from handout.simulated.plotter.firmware import Wait, Wire, firmware_of
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper
from handout.values import Drawing, Page

_HANDS = 5.0  # s a person takes to push the carriage somewhere; set by eye
_Z_STEPS = 250.0  # of a Z axis; no profile says how fine it is, this is GRBL's default ($102)


class Clock(Protocol):
    """Time that passes by itself."""

    def monotonic(self) -> float:
        """Seconds since some moment."""

    def sleep(self, seconds: float) -> None:
        """Wait."""


class SimulatedPlotter(InstrumentedPort):
    """A pen plotter behind a wire, whose controller speaks the profile's dialect; a Port.

    profile : the machine it is.
    options : what is different, what goes wrong, and when.
    clock : the real clock, if it is to live by one; the computer's with `SimulatorOptions.realtime`.

    firmware : its controller.
    paper : what the pen stands over.
    placement : how the page lies on it, so that `executed` can answer in page coordinates.
    page : the page that lies on it.
    now : s, its clock.
    """

    def __init__(self, profile: Plotter, options: SimulatorOptions | None = None, clock: Clock | None = None) -> None:
        self.profile, self.options = profile, options or SimulatorOptions()
        self.page = Page(profile.bed.width, profile.bed.height)
        self.placement: BedPlacement = place(self.page, profile)
        self.now = 0.0
        self._closed = self._gone = self._silent = False
        self._out: deque[tuple[float, bytes]] = deque()  # when it can be read, and what
        self._began: float | None = None
        self._ended = 0.0
        self._clock: Clock | None = clock or (time if self.options.realtime else None)
        self._epoch = 0.0 if self._clock is None else self._clock.monotonic()  # on the real clock
        kind = firmware_of(profile)
        self._wire = Wire(self.options.buffer or profile.port.buffer, 10.0 / profile.port.baud, kind.framing())
        self.paper = DrawnPaper(profile, [profile.limits.steps_per_mm, profile.limits.steps_per_mm, _Z_STEPS])
        # of the dialect's own kind, which tests and tools of that dialect look into
        self.firmware: Any = kind(profile, self.options, self._wire, self.paper, self._say)
        self._program: Iterator[Wait] = self._main()
        self._waits: Wait = "line"
        self._wakes = 0.0
        self.firmware.start()

    @property
    def keeps_real_time(self) -> bool:
        """Whether its time passes while nobody reads."""
        return self._clock is not None

    @property
    def time(self) -> float:
        """What its clock would show now, s."""
        return self.now if self._clock is None else self._clock.monotonic() - self._epoch

    def _catch_up(self) -> None:
        """Let happen, by the real clock, what is due since it was looked at last."""
        if self._clock is not None:
            self._advance(self._clock.monotonic() - self._epoch, heard=False)

    @property
    def lost_bytes(self) -> int:
        """Bytes that found the receive buffer full."""
        return self._wire.lost

    def lay(self, page: Page, placement: BedPlacement) -> None:
        """Lay a fresh sheet on the bed: what was drawn before is gone with the last one, and the time starts anew."""
        self.page, self.placement = page, placement
        self._began, self._ended = None, self.now
        self.paper.fresh(self.now)

    def write(self, data: bytes) -> None:
        """Put bytes on the wire."""
        self._catch_up()
        self._check_open()
        self.transmit(data)

    def transmit(self, data: bytes) -> None:
        """Send bytes off on the wire, all as they are."""
        self._wire.send_bytes(data, self.now + self.options.latency)

    def read(self, timeout: float) -> bytes:
        """What has been answered by now; if nothing has, what is answered next, within `timeout` seconds."""
        self._catch_up()
        self._check_open()
        self._advance(self.now + timeout)
        self._check_open()
        if self._clock is not None:
            self._clock.sleep(max(0.0, self.now - (self._clock.monotonic() - self._epoch)))
        answered = []
        while self._out and self._out[0][0] <= self.now:
            answered.append(self._out.popleft()[1])
        return b"".join(answered)

    def close(self) -> None:
        """Close the port: nothing more is sent or received."""
        self._closed = True

    def replug(self, seconds: float = 60.0) -> None:
        """Open the port anew, or put its cable back after so many seconds, in which it went on with what it had.

        Paper and carriage are as they were left; what it said meanwhile is lost.
        """
        self._pass(seconds)
        self._closed = self._gone = False

    def _pass(self, seconds: float) -> None:
        """Let time pass with nobody listening; on a real clock, as if it had passed."""
        self._catch_up()
        self._advance(self.now + seconds, heard=False)
        self._out.clear()
        self._epoch -= seconds

    def power_on(self) -> None:
        """Switch it off, and on again; paper and carriage are as they were left, the controller starts anew."""
        self.cut_power()
        self._wire.lose()
        self._out.clear()
        self._silent = self._closed = self._gone = False
        self.firmware.start()

    def stand_at_zero(self) -> None:
        """A person lifts the pen and pushes the carriage to the machine's zero; the controller does not notice."""
        self.paper.lift_pen(self.now)
        self._pass(_HANDS)
        self.paper.push_to_zero(self.now)

    def cut_power(self) -> None:
        """Its power goes: it stands and is silent."""
        self._silent = True
        self.firmware.stop()
        self._restart()

    def _check_open(self) -> None:
        if self._closed or self._gone:
            raise PortError("The connection to the simulated plotter is lost: is it still plugged in and switched on?")

    def executed_drawing(self) -> Drawing:
        """What the pen has drawn: strokes on the page, with the times at which they were executed."""
        return Drawing(tuple(self.paper.read_strokes(self.placement)), self.page)

    @property
    def executed_s(self) -> float:
        """Seconds from the first instruction of the plot to the end of the last motion or pause."""
        return 0.0 if self._began is None else self._ended - self._began

    @property
    def pen_is_down(self) -> bool:
        """Whether the pen is on the paper, or was last told to go there."""
        return self.paper.pen_is_down

    @property
    def at_rest(self) -> bool:
        """Whether it stands still, ready for more, with nothing left to do."""
        return bool(self.firmware.resting)

    def _advance(self, until: float, heard: bool = True) -> None:
        """Let time pass until `until`, or only until something has been answered if that is `heard`."""
        with signals.defer_signals():  # a machine hears nothing of them: its step is done first
            self._run_until(until, heard)

    def _run_until(self, until: float, heard: bool) -> None:
        while True:
            answer = self._out[0][0] if self._out and heard else math.inf
            event = min(answer, self._next_event())
            if answer <= self.now or event > until:
                break
            self._set_clock(max(event, self.now))
            self.befall()
            if self._silent:
                continue
            for piece in self._wire.receive(self.now):
                if self.firmware.urgent(piece):
                    self._restart()
            if self.firmware.next_event <= self.now:
                self.firmware.step()
                self._ended = self.now
            self._run_program()
        if not heard or not self._out or self._out[0][0] > self.now:
            self._set_clock(max(until, self.now))

    def _next_event(self) -> float:
        if self._silent:
            return math.inf
        wakes = self._wakes if isinstance(self._waits, float) else math.inf
        return min(self._wire.next_arrival, float(self.firmware.next_event), wakes)

    def _set_clock(self, now: float) -> None:
        self.now = self.firmware.now = now

    def _say(self, data: bytes) -> None:
        if not self._silent:
            soonest = self.now + self.options.latency + len(data) * self._wire.byte
            self._out.append((max(soonest, self._out[-1][0] if self._out else 0.0), data))

    def befall(self) -> None:
        """What befalls it by now: nothing, if it has no faults."""

    def is_struck(self) -> bool:
        """Whether a fault strikes while an instruction is read, which is lost."""
        return False

    def _restart(self) -> None:
        self._wire.clear()
        self._program, self._waits = self._main(), "line"

    def _main(self) -> Iterator[Wait]:
        """The controller's main program: read an instruction, obey, answer; do something else when none is there."""
        while True:
            line = self._wire.line()
            if line is None or self.firmware.deaf:
                self.firmware.idle()
                yield "line"
                continue
            if self._began is None and self.firmware.counts(line):
                self._began = self.now
            yield float(self.firmware.read_time)
            if not self.is_struck():
                yield from self.firmware.execute(line)
                self._ended = self.now

    def _run_program(self) -> None:
        """Let the main program run as long as it need not wait."""
        while not self._silent:
            waits = self._waits
            if isinstance(waits, float):
                if self._wakes > self.now:
                    return
            elif not (self._wire.has_line if waits == "line" else self.firmware.ready(waits)):
                return
            try:
                self._waits = next(self._program)
            except BaseException:  # Ctrl-C within a thread ends the program, and the machine is no more
                self._gone = True
                raise
            if isinstance(self._waits, float):
                self._wakes = self.now + self._waits
