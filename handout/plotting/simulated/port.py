"""The simulated plotter as a port: a wire with a speed, a receive buffer that can overflow, a clock, and faults.

Time is virtual: it passes only while someone reads, as fast as the computer allows, unless `realtime` is set.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator

import numpy as np

from handout.errors import PortError
from handout.plotting.bed import Placement, place
from handout.plotting.simulated.firmware import Firmware, Wait
from handout.plotting.simulated.options import Options
from handout.plotting.simulated.queue import Axes
from handout.plotting.simulated.trace import strokes
from handout.profiles import Plotter
from handout.values import Drawing, Page

_REALTIME = frozenset(b"?!~\x18")


class SimulatedPlotter:
    """A GRBL 1.1 pen plotter behind a serial wire; a Port.

    Parameters
    ----------
    profile : the machine it is; its settings (``$$``) say what the profile says, unless an option says otherwise.
    options : what goes wrong, and when; see `Options`.

    Attributes
    ----------
    placement : how the page lies on it, so that `executed` can answer in page coordinates.
    lost : bytes that found the receive buffer full.
    now : s, its clock.
    """

    def __init__(self, profile: Plotter, options: Options | None = None) -> None:
        self.profile, self.options = profile, options or Options()
        self.placement: Placement = place(Page(profile.bed.width, profile.bed.height), profile)
        self.lost, self.now, self.closed = 0, 0.0, False
        self._byte = 10.0 / profile.port.baud
        self._wire: deque[tuple[float, bytes]] = deque()  # when the first byte of a piece has come in, and the piece
        self._wire_free = 0.0
        self._rx = bytearray()
        self._size = self.options.buffer or profile.port.buffer
        self._line = bytearray()
        self._out: deque[tuple[float, bytes]] = deque()
        self._late = 0.0
        self._read = 0  # lines read
        self._began: float | None = None
        self._ended = 0.0
        self._silent = False
        self._gone = False
        self._wall = time.monotonic()
        self.firmware = Firmware(profile, self._axes(), self._size, self._say)
        self.firmware.rx_free = lambda: self._size - len(self._rx)
        self.firmware.locked = profile.homing
        self.firmware.banner()
        self._boot()

    def _axes(self) -> Axes:
        limits, pen = self.profile.limits, self.profile.pen
        fastest = self.options.speed or max(limits.draw_speed, limits.travel_speed)
        acceleration = self.options.acceleration or limits.acceleration
        return Axes(
            steps=[limits.steps_per_mm, limits.steps_per_mm, 250.0],
            speed=[fastest, fastest, pen.z_speed],
            acceleration=[acceleration, acceleration, pen.z_acceleration],
            deviation=float(limits.junction_deviation),
        )

    # ---- the port ----

    def write(self, data: bytes) -> None:
        """Put bytes on the wire."""
        self._check_open()
        start = max(self._wire_free, self.now + self.options.latency)
        for piece in _pieces(data):
            self._wire.append((start + self._byte, piece))
            start += len(piece) * self._byte
        self._wire_free = start

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
        self.closed = True

    def _check_open(self) -> None:
        if self.closed or self._gone:
            raise PortError("The connection to the simulated plotter is lost: is it still plugged in and switched on?")

    # ---- what it did ----

    def executed(self) -> Drawing:
        """What the pen has drawn: strokes on the page, with the times at which they were executed."""
        firmware = self.firmware
        drawn = strokes(firmware.stepper.trace, firmware.power, firmware.axes.steps, self.profile.pen, self.placement)
        return Drawing(tuple(drawn), self.placement.page)

    @property
    def executed_s(self) -> float:
        """Seconds from the first line of G-code to the end of the last motion or pause."""
        return 0.0 if self._began is None else self._ended - self._began

    @property
    def pen_is_down(self) -> bool:
        """Whether the pen is on the paper, or on its way to it."""
        pen = self.profile.pen
        if pen.lift == "z":
            return self.firmware.stepper.position[2] / self.firmware.axes.steps[2] < 0.5 * (pen.up + pen.down)
        power = self.firmware.power[-1][1] if self.firmware.power else 0.0
        return power > 0 and abs(power - pen.down) < abs(power - pen.up)

    # ---- the clock ----

    def _advance(self, until: float) -> None:
        """Let time pass until something has been answered, at most until `until`."""
        while not self._gone:
            answer = self._out[0][0] if self._out else math.inf
            if answer <= self.now:
                return
            wire = self._wire_event()
            event = min(answer, wire, self.firmware.stepper.next_end, self._wake)
            if event > until or (self._silent and answer > until):
                break
            self._set_clock(event)
            self._deliver()
            if self.firmware.stepper.next_end <= self.now:
                self.firmware.stepper.finish_slice()
                self._ended = self.now
            self._step_main()
        self._set_clock(max(until, self.now))

    def _set_clock(self, now: float) -> None:
        self.now = self.firmware.now = now

    def _say(self, line: str) -> None:
        if not self._silent:
            data = (line + "\r\n").encode("ascii")
            late = self._late if line == "ok" else 0.0
            after = self._out[-1][0] if self._out else 0.0
            when = max(after, self.now + len(data) * self._byte + self.options.latency + late)
            self._out.append((when, data))
