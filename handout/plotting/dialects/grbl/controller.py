"""A GRBL controller that is connected: commands out, counts in, its place watched; hold, halt and home.

GRBL has no checksums: a digit that comes over wrong is still a place to go to.  So every report of its place is held
against the way of the commands under way (`PositionTracking`); and since the place lies on the way of the command that
is being executed, all before the first command whose way leads past it have been executed.

Places are told each from the one before, so a command that came over wrong shifts all that follow.  A shift along the
way is not seen as long as that is straight: what was executed is proven when the machine has been seen on two ways
since that lead across each other.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import deque
from typing import NamedTuple

import numpy as np

from handout import signals
from handout.errors import DeviceGarbled, DeviceSilent
from handout.plotting.dialects import Log, StateReport, gcode
from handout.plotting.dialects.base import BaseController
from handout.plotting.dialects.grbl import conversation, protocol
from handout.plotting.dialects.grbl.conversation import GrblConversation, Sent
from handout.plotting.dialects.grbl.protocol import Status
from handout.plotting.planning.segments import distance_to_lines
from handout.plotting.ports import Port
from handout.profiles import Plotter

Place = tuple[float, float, float]

_NEAR = 0.03  # mm; what rounding to steps and to three digits makes of a place on the way
FAR = 0.1  # mm from the way at which something is wrong
_ACROSS = 0.5  # sine of the angle between two ways, from which a shift along one of them is seen from the other
_REMEMBERED = 200  # looks
_WORD = re.compile(rb"([GMXYZS])(-?\d*\.?\d+)")


class TrackedMove(NamedTuple):
    """A command: its number, the straight way it leads, and the spindle's value before and after it; and whether it
    certainly takes a place in the machine's queue."""

    number: int
    begin: Place
    end: Place
    power: tuple[float, float]
    moves: bool


class PositionTracking:
    """The ways of the commands that have been sent and not certainly executed.

    at : where the machine stands, mm, in the coordinates of the program.
    span : least and greatest value of the spindle other than 0 (``$31``, ``$30``).

    proven : how many commands have been executed and found right.
    """

    def __init__(self, at: Place, span: tuple[float, float] = (0.0, 1000.0)) -> None:
        self.at, self._span = at, span
        self._power, self._on, self._relative = 0.0, False, False
        self._ways: deque[TrackedMove] = deque()
        self._power_is_told = False
        self.proven = 0
        self._seen: deque[tuple[int, float, float]] = deque(maxlen=_REMEMBERED)  # commands executed; direction

    def send(self, number: int, line: bytes) -> bool:
        """A command is sent; whether it moves the pen."""
        letters = {match.group(1): float(match.group(2)) for match in _WORD.finditer(line)}
        codes = {match.group(0) for match in _WORD.finditer(line) if match.group(1) in b"GM"}
        before, power = self.at, self._reported_value()
        self._relative = (self._relative or b"G91" in codes) and b"G90" not in codes
        if b"G4" not in codes:
            axes = zip((b"X", b"Y", b"Z"), before, strict=True)
            x, y, z = (letters.get(axis, 0.0 if self._relative else at) + at * self._relative for axis, at in axes)
            self.at = (x, y, z)
        if b"G92" in codes:  # the same place has another name
            before = self.at
        self._on = (self._on or b"M3" in codes) and b"M5" not in codes
        self._power = letters.get(b"S", self._power)
        moves = max(abs(a - b) for a, b in zip(before, self.at, strict=True)) > _NEAR
        self._ways.append(TrackedMove(number, before, self.at, (power, self._reported_value()), moves))
        return power != self._reported_value() or before[2] != self.at[2]

    def _reported_value(self) -> float:
        """The value of the spindle as it is reported."""
        least, greatest = self._span
        return float(round(min(max(self._power, least), greatest))) if self._on and self._power > 0 else 0.0

    def forget(self, executed: int) -> None:
        """Commands before this number have been executed."""
        while self._ways and self._ways[0].number < executed:
            self._ways.popleft()

    def moves(self, first: int, end: int) -> int:
        """How many of the commands from one number to before another move."""
        return sum(way.moves for way in self._ways if first <= way.number < end)

    def _count_executed(self, taken: int, in_hand: int) -> int:
        """How many commands have been executed, if of those taken at most so many moves are still in its hands."""
        moves = 0
        for way in reversed(self._ways):
            if way.number < taken:
                moves += way.moves
                if moves > in_hand:
                    return way.number + 1
        return self._ways[0].number if self._ways else taken

    def certain(self, place: Place, power: float | None, taken: int, in_hand: int) -> int | None:
        """How many commands have been executed for certain, if the machine is at a place.

        in_hand : moves of those taken that may not have been executed yet, at most.

        None: it has strayed from the way of all commands under way, or its spindle has a value none of them gives it.
        """
        if not self._ways:
            return None if math.dist(place, self.at) > FAR else taken
        begin, end = (np.array(ends) for ends in zip(*((way.begin, way.end) for way in self._ways), strict=True))
        off = distance_to_lines(np.array(place), begin, end)
        near = off <= _NEAR
        if off.min() > FAR or self._wrong_power(near, power):
            return None
        if not near.any():  # the beginning of a stray way, perhaps
            return self._ways[0].number
        first = self._ways[int(np.argmax(near))]
        executed = max(first.number, self._count_executed(taken, in_hand))
        self._prove(executed, first)
        return executed

    def _prove(self, executed: int, way: TrackedMove) -> None:
        """It was seen on a way when so many commands were executed."""
        x, y = way.end[0] - way.begin[0], way.end[1] - way.begin[1]
        length = math.hypot(x, y)
        if length <= _NEAR:
            return
        x, y = x / length, y / length
        across = [before for before, a, b in self._seen if abs(a * y - b * x) >= _ACROSS]
        if across:
            self.proven = max(self.proven, across[-1])
            while self._seen and self._seen[0][0] <= self.proven:
                self._seen.popleft()
        self._seen.append((executed, x, y))

    def _wrong_power(self, near: np.ndarray, power: float | None) -> bool:
        """Whether the spindle differs from what it has on every way nearby; only once it has been seen to be told."""
        if power is None or not near.any():
            return False
        powers = {value for way, is_near in zip(self._ways, near, strict=True) if is_near for value in way.power}
        if power in powers:
            self._power_is_told |= power > 0
            return False
        return self._power_is_told


_AHEAD = 6  # moves that GRBL has taken out of its queue and not yet executed, at most; five segments and one under way
_AHEAD_OF_KIN = 12  # of its relatives; grblHAL has ten segments
_OFTEN = 8  # commands between two questions for its state
_SOON = 0.05  # s without a word after which it is asked, if the plot has to wait for it
_MOMENT = 0.02  # s between two looks at a machine that brakes
_BRAKES = 10.0  # s that a machine may take to come to a stand


class GrblController(BaseController):
    """A GRBL machine; the docstrings of `dialects.Controller` say what its methods do."""

    conversation: GrblConversation
    hurry = 1.0

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        self.conversation, machine, self.info = conversation.connect_grbl(port, profile, log)
        super().__init__(machine, log)
        self._ahead = _AHEAD if self.info.version.startswith("1.1h") else _AHEAD_OF_KIN
        self._knows = self.info.uninterrupted and not self.info.locked  # its place, as far as it can tell
        self._offset = self.info.offset
        self._tracking: PositionTracking | None = None
        self._tells = False  # where it is; still known after a halt
        self._heard = 0  # commands that it had acknowledged when it was asked while nothing could be sent
        self._looks: deque[int] = deque()  # commands of the program that the machine is asked after where it is
        self.conversation.on_status = self._look

    def send(self, data: bytes) -> None:
        """Write a line as soon as the receive buffer has room for it."""
        if self._tracking is None:
            if (place := self._place(self.conversation.status())) is not None:
                settings = self.info.settings
                self._tracking = PositionTracking(place, (settings.get(31, 0.0), settings.get(30, 1000.0)))
            self._tells = self._tracking is not None
        if self._tracking is not None and self._tracking.send(self.sent, data):
            self._looks.append(self.sent - 1)  # the pen moves: what it did until then must have been seen
        self._knows = True  # whoever begins a plot vouches for its zero
        self.sent += 1
        self.conversation.send(Sent(self.sent - 1, data), self._note_acknowledged)
        if self.sent % _OFTEN == 0:
            self.conversation.ask_status()

    @property
    def proven(self) -> int:
        """Commands that its reports of its place prove right; all executed ones if it reports no place."""
        return self._proven if self._tells else self.executed

    def wait(self) -> None:
        """Hear the next reply; one that only acknowledges, or is silent, is asked for its status: place and queue."""
        if self.taken >= self._heard + _OFTEN:
            self._heard = self.taken
            self.conversation.ask_status()
        self.conversation.hear(self._note_acknowledged, _SOON)

    def finish(self) -> None:
        """Wait until the last line is acknowledged and the machine reports that it stands in the right place."""
        self.conversation.drain(self._note_acknowledged)
        while self.executed < self.taken:
            self.wait()

    def _note_acknowledged(self, sent: Sent) -> None:
        self.taken = sent.number + 1
        if self._looks and self._looks[0] <= sent.number:
            self._looks.popleft()
            self.conversation.ask_status()

    def _place(self, status: Status) -> Place | None:
        """The place that it reports, mm, in the coordinates of the program."""
        scale = self.info.scale
        work, machine, offset = (tuple(v * scale for v in status.field(name)) for name in ("WPos", "MPos", "WCO"))
        self._offset = offset or self._offset
        if not work and len(machine) == len(self._offset):
            work = tuple(at - by for at, by in zip(machine, self._offset, strict=True))
        return (work[0], work[1], work[2]) if len(work) >= 3 else None

    def _look(self, status: Status) -> None:
        """Count the commands that are certainly executed, by its place and by the length of its queue."""
        free = status.field("Bf")
        size = self.profile.port.queue
        self.queued = max(size - int(free[0]), 0) if free else None
        in_hand = (self.queued if self.queued is not None else size) + self._ahead
        resting = status.state == "Idle" and self.taken == self.sent and not self.queued
        place, tracking = self._place(status), self._tracking
        if tracking is None or place is None:  # all that its queue can hold may still be waiting
            self.executed = self.taken if resting else max(self.executed, self.taken - in_hand)
            self.listener(StateReport(self.taken, self.executed, self.queued))
            return
        power = status.field("FS")
        certain = tracking.certain(place, power[1] if len(power) == 2 else None, self.taken, in_hand)
        if certain is None or (resting and math.dist(place, tracking.at) > FAR):
            raise DeviceGarbled(
                f"The plotter is at {place[0]:.1f}, {place[1]:.1f} mm and not on its way, or its pen is not as it "
                "should be: a command came over wrong. Use a shorter or shielded cable, and keep it away from the "
                "motors' cables."
            )
        if self.queued is None:
            self.queued = tracking.moves(certain, self.taken)
        self.executed = max(self.executed, min(self.taken if resting else certain, self.taken))
        self._proven = self.taken if resting else max(self._proven, min(tracking.proven, self.executed))
        tracking.forget(self.executed)
        self.listener(StateReport(self.taken, self.executed, self.queued, place[:2]))

    def position(self) -> tuple[float, float] | None:
        """In the coordinates of the program, mm; None after a restart or an alarm until it is homed or told."""
        place = self._place(self.conversation.status()) if self._knows else None
        return None if place is None else place[:2]

    def zero(self) -> None:
        """``G92``, which it forgets with the next reset."""
        self.conversation.ask(b"G92X0Y0\n")
        self._read_offsets()

    def level(self) -> None:
        """``G92`` as well."""
        self.conversation.ask(b"G92Z0\n")
        self._read_offsets()

    def home(self) -> None:
        """``$H``, and no passing offset of another program (``G92.1``), which homing leaves as it is.

        A servo is lifted before, since it may have been left on the paper (a Z axis is homed first).
        """
        if self.profile.pen.lift != "z":
            self._unlock()
            self._ask_all([*protocol.MODES, *protocol.pen(False, self.profile.pen)])
        self.conversation.home()
        self.conversation.ask(b"G92.1\n")
        self._read_offsets()

    def _read_offsets(self) -> None:
        """Read its offsets again, which have changed."""
        self.info.note(self.conversation.ask(b"$G\n") + self.conversation.ask(b"$#\n"))
        self._offset, self._knows, self._tracking = self.info.offset, True, None

    def go(self, x: float, y: float) -> None:
        """Lift the pen and travel."""
        speed = float(self.profile.limits.travel_speed)
        lift = protocol.pen(False, self.profile.pen)
        self._ask_all([*protocol.MODES, *lift, gcode.move(x, y, speed), protocol.STANDING])
        self._tracking = None

    def pen(self, down: bool) -> None:
        """Unlock a machine that has not been homed: it may move its pen."""
        self._unlock()
        self._ask_all([*protocol.MODES, *protocol.pen(down, self.profile.pen), protocol.STANDING])
        self._tracking = None

    def jog(self, dx: float, dy: float) -> None:
        """Travel from the place that the machine reports, even if it is wrong or was never homed."""
        self._unlock()
        place = self._place(self.conversation.status())
        if place is None:
            raise DeviceSilent("The plotter does not say where it stands: set $10=1, and try again.")
        self.go(place[0] + dx, place[1] + dy)

    def _unlock(self) -> None:
        if self.conversation.status().state == "Alarm":
            self._knows = False
            self.conversation.ask(b"$X\n")

    def release(self) -> None:
        """``$SLP``; only a reset wakes it, and its place is lost then."""
        self._knows = False
        self.conversation.ask(protocol.SLEEP)

    def _stop_and_lift(self) -> None:
        """Hold, wait until it stands, reset, lift.  A second interrupt resets at once."""
        self.conversation.stopping = True
        try:
            with signals.heed_signals():
                place = self._hold()
        except KeyboardInterrupt:
            place, self._knows = None, False
        self._lift(place)

    def _pen_not_lifted(self) -> None:
        self._knows = False
        super()._pen_not_lifted()

    def _hold(self) -> Place | None:
        """Brake, wait until the machine stands, and return its place, which a reset in motion would lose."""
        conversation = self.conversation
        conversation.port.write(protocol.HOLD)
        conversation.forget()
        try:
            end = conversation.time + _BRAKES
            while conversation.time < end:
                conversation.port.write(protocol.STATUS)
                for reply in conversation.attend():
                    if not isinstance(reply, Status) or reply.state == "Run" or reply.detail == "1":
                        continue
                    return self._count_executed(reply)
                conversation.replies(_MOMENT)
        except DeviceSilent:  # after an alarm it hears nothing but the reset
            self._knows = False
        return None

    def _count_executed(self, status: Status) -> Place | None:
        """Count the executed commands when the machine stands; returns its place if it still knows it."""
        self._knows &= status.state in ("Hold", "Idle") and not self.conversation.restarted
        place = self._place(status) if self._knows else None
        if place is not None and self._tracking is not None:
            certain = self._tracking.certain(place, None, self.taken, self.profile.port.queue + self._ahead)
            self.spoilt |= certain is None
            self._knows &= certain is not None
            self.executed = max(self.executed, min(certain or 0, self.taken))
        return place

    def _lift(self, place: Place | None) -> None:
        """Reset it, which empties its queue, lift the pen, and set its coordinates again if its place is known."""
        conversation = self.conversation
        conversation.reset(self.hurry)
        self._unlock()
        offset = self._offset
        self.info.note(conversation.ask(b"$#\n"))
        self._offset = self.info.offset
        pairs = itertools.zip_longest(offset, self._offset, fillvalue=math.inf)
        moved = place is not None and any(abs(a - b) > 1e-4 for a, b in pairs)
        again = [protocol.set_place(place)] if place is not None and moved else []
        mark = [protocol.MARK] if self._knows else []
        lift = protocol.pen(False, self.profile.pen)
        self._ask_all([*protocol.MODES, *again, *lift, *mark, protocol.STANDING])
        if not self._knows:  # the way of a pen on a Z axis leaves a mark too
            conversation.reset(self.hurry)
        if again:
            self._offset = offset
        self._tracking = None
