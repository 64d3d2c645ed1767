"""An EBB that is connected: commands out, answers in, position, stop."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable

import numpy as np

from handout.errors import DeviceAlarm, DeviceError, DeviceGarbled, DeviceSilent
from handout.plotting import literal
from handout.plotting.dialect import Heard, Log, unheard
from handout.plotting.dialects.ebb import connecting, words
from handout.plotting.dialects.ebb.counting import Counted
from handout.plotting.dialects.ebb.stepping import Motors, mixing
from handout.plotting.dialects.ebb.talk import Asked, Talk
from handout.plotting.dialects.ebb.version import CURRENT, MOTION, POSITION, STOP, Version
from handout.plotting.dialects.ebb.words import About
from handout.plotting.ports import Port
from handout.profiles import Plotter

# Commands sent and not answered.  The board reads no further than the one that waits for its queue; the others wait in
# the USB connection, which holds them back, and are there when this program is late for some hundredths of a second.
_OPEN = 8
_LOOK = 16  # commands between two questions whether the queue ran empty
_FEEL = 512  # commands between two questions whether the motors still have power
_ASTRAY = 2  # steps by which a board may count otherwise than was worked out for it
_WRONG = 0.1  # mm by which it may do so between two looks
_LOWER = b"SP,0"
_HURRY = 1.0  # s to wait for an answer when something has gone wrong already


class Ebb:
    """The conversation with one machine; a `dialect.Controller`, whose words say what its methods do.

    The board answers a motion when that goes into its queue; so all but the last few that were answered, as many as
    the queue holds and the one under way, have certainly been executed.
    """

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        self.log = log
        self.talk = Talk(port, profile.port.timeout, self._answered)
        self.sent = self.taken = self.executed = 0
        self.queued: int | None = None
        self.listener: Callable[[Heard], None] = unheard
        self.silent = ""
        self._moves: deque[int] = deque(maxlen=connecting.QUEUE + 2)  # numbers of motions that were answered
        self._stopped = False
        self._proven, self._off = 0, [0, 0]  # commands before the last look at its count, and by how much that was off
        self._held = connecting.QUEUE + 1  # commands that may be answered and not executed
        self.profile = connecting.meet(self.talk, profile)
        self.version = Version.of(self.profile.firmware)
        self._counted = Counted(self.version)
        connecting.ask_power(self.talk, self.version)
        connecting.settle(self.talk, self.version)
        self._rested = connecting.rested(self.talk, self.version)
        self._lost = self._rested  # where its zero is
        self._held = connecting.lengthen(self.talk, self.version) + 1
        self.queued = None  # what it said while it was met does not count

    def send(self, data: bytes) -> None:
        """Write a command as soon as few enough are unanswered."""
        self._wake()
        if data.startswith(_LOWER) and self.version >= POSITION:
            self._prove()
        while len(self.talk.open) >= _OPEN:
            self.talk.hear()
        self._counted.send(data)
        self.talk.put(data, self.sent)
        self.sent += 1
        if self.version >= MOTION and self.sent % _LOOK == 0:
            self.talk.put(b"QM\r")
        if self.version >= CURRENT and self.sent % _FEEL == 0:
            self.talk.put(b"QC\r")

    def wait(self) -> None:
        """Hear what it says next; where nothing is left to be said it is asked what it is doing."""
        if not self.talk.open:
            self.talk.put(b"QM\r" if self.version >= MOTION else connecting.NOTHING)
        self.talk.hear()

    def finish(self) -> None:
        """Wait until everything is answered and executed."""
        while self.talk.open or self.executed < self.sent:
            self.wait()
        if self.sent and self.version >= POSITION:
            self._prove()
            self._check_return(self._steps())

    def _prove(self) -> None:
        """See that it has counted the steps that it was told, while it stands with the pen lifted.

        A stop drops what moves but not the pen that waits to be lowered behind it: another reason to let it stand.
        """
        self.talk.drain()
        connecting.settle(self.talk, self.version)
        off = [said - told for said, told in zip(self._steps(), self._counted.steps, strict=True)]
        more = max(abs(now - before) for now, before in zip(off, self._off, strict=True))
        if more > _WRONG * self.profile.limits.steps_per_mm:
            self.executed = self._proven
            raise DeviceGarbled(
                f"The plotter has made {more} steps that it was not told, or has not made them: a command came over "
                "wrong, and what it drew last may be wrong. Use a shorter cable, and no hub."
            )
        self._off, self._proven = off, self.sent
        self.queued = None  # that it is empty now says nothing about a stroke

    def _check_return(self, steps: tuple[int, int]) -> None:
        """Every program ends where it began, at zero; the board's own count must say so too."""
        x, y = np.linalg.solve(mixing(self.profile), np.array(steps, dtype=float)).tolist()
        if max(map(abs, steps)) > _ASTRAY:
            self.log(
                f"The plotter has counted other steps than it was told: it stands {x:.2f}, {y:.2f} mm from its zero. "
                "Look whether the lines are where they should be."
            )

    def _answered(self, asked: Asked, numbers: tuple[int, ...]) -> None:
        if asked.name == "QC":
            connecting.check_power(numbers)
        elif asked.name == "QM" and len(numbers) == 4:
            self._look(busy=numbers[0] != 0, waiting=numbers[3] != 0)
        elif asked.number >= 0 or asked.data == connecting.NOTHING:
            self.taken = max(self.taken, asked.number + 1)
            if asked.name in words.QUEUED:
                self._moves.append(asked.number if asked.number >= 0 else self.taken)
                if len(self._moves) >= self._held:
                    self.executed = max(self.executed, self._moves[-self._held])
                    self.listener(Heard(self.taken, self.executed))

    def _look(self, busy: bool, waiting: bool) -> None:
        """It was asked after all that is taken was in its queue."""
        self.queued = int(busy) + int(waiting)
        if self._stopped:  # what waited has been dropped
            return
        if not busy:
            self.executed = self.taken
        elif not waiting and self._moves:
            self.executed = max(self.executed, self._moves[-1])
        self.listener(Heard(self.taken, self.executed, self.queued))

    def _wake(self) -> None:
        """Switch the motors on, with steps of a sixteenth, before the first motion after they have been off."""
        if self._rested:
            self._rested = self._lost = False
            self.talk.ask(b"EM,1,1\r")
            if self.version >= POSITION:
                self.talk.ask(b"CS\r")
            self._counted.send(b"CS\r")

    def position(self) -> tuple[float, float] | None:
        """Machine coordinates, mm, from the board's own count of steps."""
        if self.version < POSITION or self._lost:
            return None
        x, y = np.linalg.solve(mixing(self.profile), np.array(self._steps(), dtype=float)).tolist()
        return x, y

    def _steps(self) -> tuple[int, int]:
        numbers = self.talk.ask(b"QS\r")
        if len(numbers) != 2:
            raise DeviceSilent("The plotter did not say where it stands: something was lost on the way.")
        return numbers[0], numbers[1]

    def zero(self) -> None:
        """Its counters begin here."""
        self._lost = False
        if self.version >= POSITION:
            self.talk.ask(b"CS\r")

    def level(self) -> None:
        """It has no Z axis."""

    def go(self, x: float, y: float) -> None:
        """Lift the pen and travel; how far that is, its counters tell."""
        if self._lost or self.version < POSITION:
            raise DeviceAlarm(
                "The plotter no longer knows where it stands: stand its pen above its zero, and start again."
            )
        self._wake()
        for data in words.lifted(self.profile.pen):
            self.talk.ask(data)
        motors = Motors(self.profile, self._steps())
        for _, data in motors.run(literal.travel(motors.place, np.array([x, y]), self.profile)):
            while len(self.talk.open) >= _OPEN:
                self.talk.hear()
            self.talk.put(data)
        self.talk.drain()
        connecting.settle(self.talk, self.version)

    def halt(self) -> None:
        """Stop, and lift the pen."""
        talk, self._stopped = self.talk, True
        talk.timeout = min(talk.timeout, _HURRY)
        stop = b"ES\r" if self.version >= STOP else b""
        try:
            talk.port.write(b"".join([stop, *words.lifted(self.profile.pen), b"V\r"]))
            self._until_about(talk.timeout + sum(asked.seconds for asked in talk.open) + self.profile.pen.up_time)
            talk.open.clear()
            with contextlib.suppress(DeviceAlarm):
                connecting.settle(talk, self.version)
                if talk.struck:
                    self._forget()
        except DeviceError:
            self.log("The pen could not be lifted and may stand on the paper: lift it by hand.")

    def _forget(self) -> None:
        """Leave it so that nobody believes that it knows where it is: motors off, counters zero."""
        self._lost = True
        self.talk.ask(b"EM,0,0\r")
        if self.version >= POSITION:
            self.talk.ask(b"CS\r")

    def _until_about(self, patience: float) -> None:
        """Pass over all answers until the one to V."""
        waited = 0.0
        while waited < patience:
            heard = self.talk.replies(_HURRY / 4)
            if any(isinstance(reply, About) for reply in heard):
                return
            waited += 0.0 if heard else _HURRY / 4
        raise DeviceSilent("The plotter does not answer any more.")

    def home(self) -> None:
        """It has no switches; its counters know the way back to where its motors were switched on."""
        if not self._rested:
            self.go(0.0, 0.0)
