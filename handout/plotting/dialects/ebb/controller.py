"""An EBB that is connected: commands out, answers in, position, stop."""

from __future__ import annotations

import contextlib
from collections import deque

import numpy as np

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent
from handout.plotting.dialects import BUTTON_LOOK, ButtonPressed, Log, StateReport
from handout.plotting.dialects.base import BaseController
from handout.plotting.dialects.ebb import protocol
from handout.plotting.dialects.ebb.conversation import QUEUE, REST, Asked, EbbConversation, check_power
from handout.plotting.dialects.ebb.protocol import About
from handout.plotting.dialects.ebb.stepping import (
    BUTTON,
    CURRENT,
    FLAGS,
    MOTION,
    POSITION,
    STOP,
    TIME,
    Motors,
    StepCounter,
    mixing,
)  # fmt: skip
from handout.plotting.planning import time_slices
from handout.plotting.planning.segments import distance_to_lines
from handout.plotting.ports import Port
from handout.profiles import Plotter
from handout.values import Array

# Commands sent and not answered.  The board reads no further than the one that waits for its queue; the others wait in
# the USB connection, which holds them back, and are there when this program is late for some hundredths of a second.
# Boards before LT go on with what waits there when they have been stopped: for them it is little.
_OPEN, _OPEN_OLD = 8, 3
_LOOK = 16  # commands between two questions whether the queue ran empty
_TOUCH = 64  # commands between two questions for the button of an old board, about a second of writing
_FEEL = 512  # commands between two questions whether the motors still have power
_ASTRAY = 2  # steps by which a board may count otherwise than was worked out for it
_WRONG = 0.1  # mm by which it may do so between two looks
_LOWER, _LIFT = b"SP,0", b"SP,1"
_BESIDE = 0.2  # mm; a command need not lead quite straight


class EbbController(BaseController):
    """A machine with an EBB; the docstrings of `dialects.Controller` say what its methods do.  It cannot be held.

    The board answers a motion when that goes into its queue; so all but the last few that were answered, as many as
    the queue holds and the one under way, have certainly been executed.
    """

    conversation: EbbConversation
    hurry = 1.0

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        super().__init__(profile, log)
        self.conversation = EbbConversation(port, profile.port.timeout, log, self._note_answer)
        self._moves: deque[int] = deque(maxlen=QUEUE + 2)  # numbers of motions that were answered
        self._stopped = False
        self._watches_button = self._pressed = False
        self._look_at = b"QM\r"  # what it is doing
        self._off = [0, 0]  # steps by which its count was off at the last look
        self._in_hand = QUEUE + 1  # commands that may be answered and not executed
        self.profile = self.conversation.meet(profile)
        self.version = self.conversation.version
        self._open = _OPEN if self.version >= TIME else _OPEN_OLD
        self._step_counter = StepCounter(self.version)
        self._way: deque[tuple[int, int]] = deque([(0, 0)], maxlen=_OPEN + QUEUE + 3)  # steps, by command
        self._since_pen = 0  # commands since the pen was told to move
        self._up: bool | None = None  # the pen, as it was told last
        self._pens: deque[bool] = deque()  # what it has to answer when it is asked whether the pen is up
        self.conversation.ask_power()
        self.conversation.settle()
        self._rested = self.conversation.has_rested()
        self._lost = self._rested  # where its zero is
        self._in_hand = self.conversation.lengthen_queue() + 1
        self.queued = None  # what it said while it was met does not count

    def send(self, data: bytes) -> None:
        """Write a command as soon as few enough are unanswered."""
        self._wake()
        if data.startswith(_LOWER) and self.version >= POSITION:
            self._check_steps()
        if not protocol.is_own(data):  # lines of the user's own act at once, whatever waits in the queue
            self.conversation.drain()
            self.conversation.settle()
        if data.startswith(_LIFT) and self._since_pen >= self._in_hand:
            self._ask_pen()
        while len(self.conversation.open) >= self._open:
            self.conversation.hear()
        self._step_counter.send(data)
        self._way.append((self._step_counter.steps[0], self._step_counter.steps[1]))
        self._since_pen += 1
        if data.startswith((_LOWER, _LIFT)):
            self._since_pen, self._up = 0, data.startswith(_LIFT)
        self.conversation.send_request(data, self.sent)
        self.sent += 1
        if self.version >= MOTION and self.sent % _LOOK == 0:
            self.conversation.send_request(self._look_at)
        if self.version >= CURRENT and self.sent % _FEEL == 0:
            self.conversation.send_request(b"QC\r")
        self._check_button(self.sent % _TOUCH == 0)

    @property
    def proven(self) -> int:
        """Commands before the last comparison of its count of steps; all executed ones if it tells no count."""
        return self._proven if self.version >= POSITION else self.executed

    def wait(self) -> None:
        """Hear the next answer; if none is open, ask what the board is doing."""
        if not self.conversation.open:
            self.conversation.send_request(self._look_at if self.version >= MOTION else REST)
        self._check_button(False)
        self.conversation.hear()

    def heed_button(self) -> None:
        """Ask by ``QG``, which answers what ``QM`` and ``QB`` do: motion, and presses since the last question.

        What was pressed before does not count.
        """
        self._watches_button = self.version >= BUTTON
        self._look_at = b"QG\r" if self.version >= FLAGS else b"QM\r"
        self.was_button_pressed()

    def _check_button(self, ask: bool) -> None:
        """Look at the button, now and then."""
        if self._watches_button and ask and self.version < FLAGS:
            self.conversation.send_request(b"QB\r")
        if self._watches_button and self._pressed:
            self._pressed = False
            raise ButtonPressed

    def was_button_pressed(self) -> bool:
        """Whether it was pressed; asked a moment after the last answer, for a person takes longer than that."""
        if self.version < BUTTON:
            return False
        self.conversation.drain()
        self.conversation.replies(BUTTON_LOOK)
        self.conversation.ask(b"QB\r")
        pressed, self._pressed = self._pressed, False
        return pressed

    def finish(self) -> None:
        """Wait until everything is answered and executed."""
        while self.conversation.open or self.executed < self.sent:
            self.wait()
        if self.sent and self.version >= POSITION:
            self._check_steps()
            # every program ends where it began, at zero; the board's own count must say so too
            steps = self._steps()
            x, y = np.linalg.solve(mixing(self.profile), np.array(steps, dtype=float)).tolist()
            if max(map(abs, steps)) > _ASTRAY:
                self.log(
                    f"The plotter has counted other steps than it was told: it stands {x:.2f}, {y:.2f} mm from its "
                    "zero. Look whether the lines are where they should be."
                )

    def _check_steps(self) -> None:
        """Compare its count of steps with the steps that were sent, while it stands with the pen lifted.

        A stop drops what moves but not the pen that waits to be lowered behind it: another reason to let it stand.
        """
        self.conversation.drain()
        self.conversation.settle()
        self._ask_pen()
        off = [counted - expected for counted, expected in zip(self._steps(), self._step_counter.steps, strict=True)]
        more = max(abs(now - before) for now, before in zip(off, self._off, strict=True))
        if more > _WRONG * self.profile.limits.steps_per_mm:
            raise DeviceGarbled(
                f"The plotter has made {more} steps that it was not told, or has not made them: a command came over "
                "wrong, and what it drew last may be wrong. Use a shorter cable, and no hub."
            )
        self._off, self._proven = off, self.sent
        self.queued = None  # that it is empty now says nothing about a stroke

    def _ask_pen(self) -> None:
        """Ask for the pen's state; the answer is that of the last pen command that has been begun."""
        if self.version >= POSITION and self._up is not None:
            self._pens.append(self._up)
            self.conversation.send_request(b"QP\r")

    def _note_answer(self, asked: Asked, numbers: tuple[int, ...]) -> None:
        """Note an answer; anything but a question is a command of the program, or a rest that asked."""
        if asked.name == "QB":
            self._pressed |= numbers[:1] == (1,)
        elif asked.name == "QC":
            check_power(numbers)
        elif asked.name == "QG" and len(numbers) == 1:
            self._pressed |= bool(numbers[0] & protocol.PRESSED)
            self._look(busy=bool(numbers[0] & protocol.BUSY), waiting=bool(numbers[0] & protocol.WAITING))
        elif asked.name == "QM" and len(numbers) == 4:
            self._look(busy=numbers[0] != 0, waiting=numbers[3] != 0)
        elif asked.name == "QP":
            self._check_pen(up=numbers[:1] == (1,))
        elif asked.number >= 0 or asked.data == REST:
            self.taken = max(self.taken, asked.number + 1)
            if asked.name in protocol.QUEUED:
                self._moves.append(asked.number if asked.number >= 0 else self.taken)
                if len(self._moves) >= self._in_hand:
                    self.executed = max(self.executed, self._moves[-self._in_hand])
                    self.listener(StateReport(self.taken, self.executed))

    def _check_pen(self, up: bool) -> None:
        if self._pens and self._pens.popleft() != up:
            raise DeviceGarbled(
                f"The plotter's pen is {'lifted' if up else 'down'} and should not be: a command came "
                "over wrong, and what it drew last may be wrong. Use a shorter cable, and no hub."
            )

    def _look(self, busy: bool, waiting: bool) -> None:
        """Count what has been executed: the question was answered after all taken commands were in the queue."""
        self.queued = int(busy) + int(waiting)
        if self._stopped:  # what waited has been dropped
            return
        if not busy:
            self.executed = self.taken
        elif not waiting and self._moves:
            self.executed = max(self.executed, self._moves[-1])
        self.listener(StateReport(self.taken, self.executed, self.queued))

    def _wake(self) -> None:
        """Switch the motors on, with steps of a sixteenth, before the first motion after they have been off."""
        if self._rested:
            self._rested = self._lost = False
            self.conversation.ask(b"EM,1,1\r")
            if self.conversation.has_other_steps():  # it came over wrong
                self.conversation.ask(b"EM,1,1\r")
            if self.version >= POSITION:
                self.conversation.ask(b"CS\r")
            self._step_counter.send(b"CS\r")

    def position(self) -> tuple[float, float] | None:
        """Machine coordinates, mm, from the board's own count of steps."""
        if self.version < POSITION or self._lost:
            return None
        x, y = np.linalg.solve(mixing(self.profile), np.array(self._steps(), dtype=float)).tolist()
        return x, y

    def _steps(self) -> tuple[int, int]:
        numbers = self.conversation.ask(b"QS\r")
        if len(numbers) != 2:
            raise DeviceSilent("The plotter did not say where it stands: something was lost on the way.")
        return numbers[0], numbers[1]

    def zero(self) -> None:
        """Its counters begin here."""
        self._lost = False
        if self.version >= POSITION:
            self.conversation.ask(b"CS\r")

    def go(self, x: float, y: float) -> None:
        """Lift the pen and travel by what its counters say is missing."""
        if self._lost or self.version < POSITION:
            raise DeviceAlarm(
                "The plotter no longer knows where it stands: stand its pen above its zero, and start again."
            )
        self._wake()
        self._travel(Motors(self.profile, self._steps()), np.array([x, y]))

    def _travel(self, motors: Motors, there: Array) -> None:
        self._ask_all(protocol.prepare_pen(self.profile.pen))
        for _, data in motors.command_moves(time_slices.travel(motors.place, there, self.profile)):
            while len(self.conversation.open) >= self._open:
                self.conversation.hear()
            self.conversation.send_request(data)
        self.conversation.drain()
        self.conversation.settle()

    def pen(self, down: bool) -> None:
        """Send the profile's heights first, since a board forgets them."""
        self._ask_all([*protocol.reach(self.profile.pen), protocol.pen(down, self.profile.pen)])
        self.conversation.settle()

    def jog(self, dx: float, dy: float) -> None:
        """Travel so far; motions of an EBB are relative anyway."""
        self._wake()
        motors = Motors(self.profile, self._steps() if self.version >= POSITION else (0, 0))
        self._travel(motors, motors.place + np.array([dx, dy]))

    def release(self) -> None:
        """``EM,0,0``."""
        self._forget()

    def _stop_and_lift(self) -> None:
        conversation, self._stopped = self.conversation, True
        stop = b"ES\r" if self.version >= STOP else b""
        conversation.port.write(b"".join([stop, *protocol.prepare_pen(self.profile.pen), b"V\r"]))
        patience = conversation.timeout + sum(asked.seconds for asked in conversation.open) + self.profile.pen.up_time
        for replies in conversation.listen(patience):  # all answers up to the one to V are passed over
            if any(isinstance(reply, About) for reply in replies):
                break
        else:
            raise DeviceSilent("The plotter does not answer any more.")
        conversation.open.clear()
        self._pens.clear()
        with contextlib.suppress(DeviceAlarm):
            conversation.settle()
            if conversation.struck:
                self._forget()
            elif self.version >= POSITION:
                # spoilt where it has stopped away from the paths of all commands that may have been under way
                way = np.array(self._way, dtype=float)
                place = np.array(self._steps(), dtype=float) - np.array(self._off)
                off = distance_to_lines(place, way[:-1], way[1:])
                self.spoilt = len(off) > 0 and bool(off.min() > _BESIDE * self.profile.limits.steps_per_mm)

    def _forget(self) -> None:
        """Switch motors off and clear the counters: the next to connect will know that its place is lost."""
        self._lost = True
        self.conversation.ask(b"EM,0,0\r")
        if self.version >= POSITION:
            self.conversation.ask(b"CS\r")

    def home(self) -> None:
        """It has no switches; its counters know the way back to where its motors were switched on."""
        if not self._rested:
            self.go(0.0, 0.0)
