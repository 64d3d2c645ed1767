"""A Klipper that is connected: lines out in scripts, counts in by the place that it reports, halt and home.

What is drawn is known by `live_position`, where the carriage is by Klipper's own reckoning, and by ``M400``, which is
answered when all motion is done.  Both are worked out by its host program, which notices only after some five seconds
that its board is gone: so what was executed counts as proven when the board has been heard later (`Executed`).  Klipper
has two seconds of motion in hand that nothing short of an emergency stop takes back; after one, or after any other
shutdown, its place is lost.
"""

from __future__ import annotations

import math
import re
from collections import deque
from typing import NamedTuple

import numpy as np

from handout import signals
from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent
from handout.plotting.dialects import Log, StateReport, gcode
from handout.plotting.dialects.base import BaseController
from handout.plotting.dialects.klipper import conversation, protocol
from handout.plotting.dialects.klipper.conversation import MoonrakerConversation
from handout.plotting.dialects.klipper.protocol import Status
from handout.plotting.planning.segments import distance_to_lines
from handout.plotting.ports import Port
from handout.profiles import Plotter

_MOST = 40  # lines of a script: four tenths of a second at the usual rate, so that little is under way at a break
_MOMENT = 0.1  # s between two questions how far it is; it works its place out four times a second
_NEAR = 0.02  # mm; what rounding to three digits makes of a place on the way
_FAR = 0.1  # mm from the way at which something is wrong
_PROOF = 15.0  # s in which a board must be heard of, or Klipper would have shut down

Place = tuple[float, float]


# what leads nowhere but where it says; lines of the user's own may lead anywhere
_OURS = (b"G1", b"G4", b"M400", b"G21", b"G90", b"M220", b"SET_", b"MANUAL_STEPPER", b"G92")
_AXES = re.compile(rb"([XY])\s*([-+]?\d*\.?\d+)")  # of a move


class _Way(NamedTuple):
    """A command and the straight way it leads; free : it may lead elsewhere."""

    number: int
    begin: Place
    end: Place
    free: bool


class Executed:
    """How many commands the board has certainly executed, since it was heard of after them.

    Klipper counts about once a second how many bytes its board has said.  A board that has said something after a
    count was alive then, and has done what was due by then, or else it would have shut down.

    proven : so many commands; waits : whether any are not proven yet.
    """

    def __init__(self) -> None:
        self.proven = self._before = self._by_then = 0
        self._heard: int | None = None

    def note(self, executed: int, heard: int | None) -> None:
        """So many commands count as executed; so many bytes has the board said, by the last count (None: unknown)."""
        if heard is None:
            self.proven = executed
        elif heard != self._heard:
            self.proven = max(self.proven, self._by_then)  # it may have been asked since
            self._by_then, self._heard = self._before, heard
        self._before = executed


class KlipperController(BaseController):
    """A Klipper machine; the docstrings of `dialects.Controller` say what its methods do."""

    conversation: MoonrakerConversation
    hurry = 5.0
    silent = "Klipper says where it is four times a second, too seldom for a rest."

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        super().__init__(profile, log)
        self.conversation = MoonrakerConversation(port, float(profile.port.timeout), log)
        self.profile, self._acceleration = conversation.meet_klipper(self.conversation, profile, log)
        self._batch: list[bytes] = []
        self._sent = self._answered = 0  # commands in scripts that were sent; that were answered
        self._ways: deque[_Way] | None = None
        self._at: Place = (0.0, 0.0)  # where the last command leads to
        self._idle = self._astray = False
        self._asked = False
        self._proof = Executed()

    def send(self, data: bytes) -> None:
        """Add a line to the next script, which is sent when the one before is answered."""
        if self._ways is None:
            self._begin()
        assert self._ways is not None
        words = dict(_AXES.findall(data.split(b";")[0])) if data.startswith(b"G1") else {}
        to = float(words.get(b"X", self._at[0])), float(words.get(b"Y", self._at[1]))
        self._astray = free = self._astray or not data.startswith(_OURS)
        if len(words) == 2:
            self._astray = False
        if data.startswith(protocol.HERE[0]):
            self._at = to = (0.0, 0.0)
        self._ways.append(_Way(self.sent, self._at, to, free))
        self._at = to
        self._batch.append(data)
        self.sent += 1
        self._pass_on()
        while len(self._batch) >= _MOST:
            self._hear(self.conversation.glance)

    def _begin(self) -> None:
        """See where it is before the first line of a program."""
        told = self.conversation.status()
        if not {"x", "y"} <= set(told.homed) and self.profile.bed.zero != "here":
            raise DeviceAlarm(
                "Klipper does not know where X and Y are and moves neither: home it (handout pen home), or set "
                "homing = true in its profile."
            )
        if self.profile.pen.lift == "z" and "z" not in told.homed:
            raise DeviceAlarm(
                "Klipper does not know where Z is and does not move it: home Z at its page in the browser, the pen out."
            )
        self.conversation.ask(protocol.PEAKS % round(self._acceleration))
        self._ways, self._at = deque(), told.end or (0.0, 0.0)

    def _pass_on(self) -> None:
        """Send what has been collected, unless a script is under way."""
        if self._batch and not self.conversation.script:
            lines, self._batch = self._batch, []
            self._sent, self._idle = self.sent, False
            self.conversation.send(b"".join(lines))

    def _hear(self, patience: float) -> None:
        """Heed what it says next."""
        told = self.conversation.hear(patience)
        if not self.conversation.script and self.taken < self._sent:
            self.taken = self._answered = self._sent
            self.listener(StateReport(self.taken, self.executed))
        for status in told:
            self._asked = False
            self._look(status)
        self._pass_on()

    def _look(self, status: Status) -> None:
        """Count the commands that are certainly executed, by its place."""
        self._proof.note(self.executed, status.heard)
        self._idle = status.now >= status.print_time
        place, ways = status.live, self._ways
        if place is None or not ways:
            return
        begin, end = (np.array(ends) for ends in zip(*((way.begin, way.end) for way in ways), strict=True))
        off = distance_to_lines(np.array(place), begin, end)
        if off.min() > _FAR and not any(way.free for way in ways):
            raise _stray_error(place)
        near = np.flatnonzero(off <= _NEAR)
        self._count(ways[int(near[0])].number if len(near) else ways[0].number)
        self.listener(StateReport(self.taken, self.executed, None, place))

    def _count(self, executed: int) -> None:
        """Commands before this number have been executed."""
        self.executed = max(self.executed, executed)
        while self._ways and self._ways[0].number < self.executed - 1:  # it may still stand at the end of the last
            self._ways.popleft()

    @property
    def proven(self) -> int:
        """What the board has certainly done; what is damaged on a network does not arrive."""
        return self._proof.proven

    def wait(self) -> None:
        """Hear the next answer; one that has nothing to do is asked for an answer when it stands."""
        self._pass_on()
        if self._idle and not self.conversation.script:
            self.finish()
            return
        if not self._asked:
            self._hear(_MOMENT)
            self.conversation.ask_status()
            self._asked = True
        self._hear(self.conversation.glance)

    def finish(self) -> None:
        """Wait until it has taken everything and stands."""
        while self._batch or self.conversation.script:
            self._hear(self.conversation.glance)
        for told in self.conversation.ask(protocol.STANDING):
            self._look(told)
        place = self.conversation.status().end  # the other one may be a quarter of a second old
        if place is not None and self._ways and not self._astray and math.dist(place, self._at) > _FAR:
            raise _stray_error(place)
        self._count(self.sent)
        self._prove()
        self.listener(StateReport(self.taken, self.executed))

    def _prove(self) -> None:
        """Check that the board still answers when it stands: ask for its switches, or wait for a message.

        One that comes back after Klipper has given it up answers too.
        """
        switches = self.conversation.result("printer.query_endstops.status", patience=_PROOF)
        told, end = self.conversation.status(), self.conversation.time + _PROOF
        if isinstance(switches, dict) and switches:  # a machine without any asks no board
            self._proof.proven = self.executed
        while self.proven < self.executed:
            if self.conversation.time > end:
                raise DeviceSilent("Klipper has not heard of its board for some time: look at its cable.")
            for replies in self.conversation.listen(_MOMENT, _MOMENT):
                del replies
            self._proof.note(self.executed, told.heard)
            told = self.conversation.status()

    def position(self) -> tuple[float, float] | None:
        """In the coordinates of the program, mm, once it stands; None until it is homed or told."""
        self.conversation.ask(protocol.STANDING)
        told = self.conversation.status()
        return told.end if {"x", "y"} <= set(told.homed) else None

    def _obey_lines(self, lines: list[bytes]) -> None:
        """Have lines obeyed that are no part of a program, and wait until it stands."""
        self.conversation.ask(b"".join([*lines, protocol.STANDING]))
        self._ways = None

    def zero(self) -> None:
        """``SET_KINEMATIC_POSITION``, which it forgets when it starts anew."""
        self._obey_lines(list(protocol.HERE))

    def level(self) -> None:
        """``G92``, which it forgets when it starts anew or is homed."""
        self._obey_lines([protocol.LEVEL])

    def home(self) -> None:
        """Lift the pen, and find the zero of X and Y by the switches."""
        self.log("Homing: the plotter looks for its zero.")
        self._obey_lines(protocol.homing(self.profile))

    def go(self, x: float, y: float) -> None:
        """Lift the pen and travel."""
        move = gcode.move(x, y, float(self.profile.limits.travel_speed))
        self._obey_lines([*protocol.MODES, *protocol.pen(False, self.profile.pen), move])

    def pen(self, down: bool) -> None:
        """Move the pen as between two strokes."""
        self._obey_lines([*protocol.MODES[:2], *protocol.pen(down, self.profile.pen)])

    def jog(self, dx: float, dy: float) -> None:
        """Travel from its place; Klipper moves no axis whose place it does not know."""
        place = self.position()
        if place is None:
            raise DeviceAlarm("Klipper moves no axis before it is homed: home it first (handout pen home).")
        self.go(place[0] + dx, place[1] + dy)

    def release(self) -> None:
        """``M84``; it no longer knows its place then."""
        self._obey_lines([protocol.RELEASE])

    def halt(self) -> None:
        """As of any; what Klipper had in hand when it fell is lost."""
        super().halt()
        self.spoilt |= self.conversation.fallen and self.proven < self.executed

    def _stop_and_lift(self) -> None:
        """Send nothing more, let it finish the two seconds that it has in hand, and lift the pen.

        Klipper has no hold for what is streamed to it.  Whoever interrupts a second time has it shut down at once.
        """
        self._batch = []
        if self.conversation.fallen:
            raise DeviceAlarm("Klipper has stopped.")
        if self._runs_out():
            self._obey_lines([*protocol.MODES[:2], *protocol.pen(False, self.profile.pen)])

    def _runs_out(self) -> bool:
        """Let it finish and count what it has drawn; False if somebody interrupts again, which shuts it down."""
        refused = False
        try:
            self.log("The plotter finishes what it has in hand, about two seconds; interrupt again to stop it dead.")
            with signals.heed_signals():
                try:
                    self.conversation.finish_script()
                except DeviceAlarm:
                    refused = True
                    if self.conversation.fallen:
                        raise
                self.conversation.ask(protocol.STANDING)
        except KeyboardInterrupt:
            self.log("The plotter is stopped dead and no longer knows where it is; Klipper is started anew.")
            self.conversation.result("printer.emergency_stop")
            conversation.restart(self.conversation)
            if self.profile.pen.lift in ("servo", "command"):
                self.conversation.fallen, self.conversation.script = False, 0
                self.conversation.ask(b"".join(protocol.pen(False, self.profile.pen)))
            else:
                self._pen_not_lifted()
            return False
        if refused or self._answered < self._sent:  # of the script that was refused, the lines before that
            try:
                self._look(self.conversation.status())
            except DeviceGarbled:  # refused for where it led: another program has it move relatively (G91)
                self.spoilt = True
        else:
            self.taken = self._sent
            self._count(self._sent)
        return True


def _stray_error(place: Place) -> DeviceGarbled:
    return DeviceGarbled(
        f"Klipper is at {place[0]:.1f}, {place[1]:.1f} mm and not on its way: another program has moved it or has made "
        "its coordinates relative (G91), or it corrects skew (SET_SKEW CLEAR=1)."
    )
