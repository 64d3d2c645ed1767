"""A Marlin controller that is connected: commands out, counts in, halt and home."""

from __future__ import annotations

import math
import re
from collections import deque
from typing import NamedTuple

from handout import signals
from handout.errors import DeviceSilent
from handout.plotting.dialects import Log, MoveBlock, PenBlock, StateReport
from handout.plotting.dialects.base import BaseController
from handout.plotting.dialects.marlin import conversation, protocol
from handout.plotting.dialects.marlin.conversation import MarlinConversation, ProtocolLine, number_lines
from handout.plotting.dialects.marlin.protocol import Ok, Position
from handout.plotting.ports import Port
from handout.profiles import Plotter

_HOMING = 180.0  # s a machine may take to find its switches, even one that does not say that it is busy
_MOMENT = 0.05  # s between two questions how much room it has
_DROPS = 1.05  # s after M410 in which it takes no moves
_NOTICED = 1.0  # s of motion to come that a person who stops it is told of
_LEAST = 6  # steps of a move that is queued at all (MIN_STEPS_PER_SEGMENT)
_WORD = re.compile(rb"([A-Z])(-?[\d.]+)")
_WAITS = (b"M400", b"G4", b"G28")  # answered when all motion before them is done
_SLOWEST = 0.1  # mm/s assumed of a move without a feed


class _Block(NamedTuple):
    """A move in the queue: the first command that makes its way, and how long it takes at its feed, s."""

    first: int
    seconds: float


class PlannerQueue:
    """What Marlin has worked through but may not yet have executed; a lower bound of what was executed.

    Source: Marlin's planner, read for facts: a command is answered when its move is in the queue, of `queue` moves at
    most; a move of fewer than six steps makes no block, and its way is made together with the next.

    queue : moves the planner can hold.
    steps : steps/mm; at : where the machine stands, mm.
    """

    def __init__(self, queue: int, steps: float, at: tuple[float, float, float] | None = None) -> None:
        self.queue, self.steps = queue, steps
        self._blocks: deque[_Block] = deque()
        # where the last queued move ends, as far as it is known
        self._at: dict[bytes, float] = {} if at is None else dict(zip((b"X", b"Y", b"Z"), at, strict=True))
        self._feed = 0.0  # mm/s
        self._short: int | None = None  # first command whose way is not made yet since it was too short
        self._worked = 0

    def note_worked(self, data: bytes, command: int) -> None:
        """Take note of a command that was worked through; `command` are executed when its move is done."""
        words = dict(_WORD.findall(data))
        if data.startswith(_WAITS):
            self._blocks.clear()
            self._short = None
            if data.startswith(b"G28"):
                self._at.clear()
        elif data.startswith((b"G1", b"G0")):
            self._move({axis: float(words[axis]) for axis in (b"X", b"Y", b"Z") if axis in words}, words, command)
        elif data.startswith((b"G91", b"G92")):
            self._at.clear()
        self._worked = command

    def _move(self, target: dict[bytes, float], words: dict[bytes, bytes], command: int) -> None:
        self._feed = float(words[b"F"]) / 60 if b"F" in words else self._feed
        way = [to - self._at.get(axis, math.inf) for axis, to in target.items()]
        first = command if self._short is None else self._short
        if not way or max(map(abs, way)) * self.steps < _LEAST - 0.5:
            self._short = first
            return
        distances = [part for part in way if math.isfinite(part)]
        self._blocks.append(_Block(first, math.hypot(*distances) / max(self._feed, _SLOWEST)))
        self._short = None
        self._at |= target
        self.at_most(self.queue)

    def at_most(self, moves: int) -> None:
        """The queue holds no more than so many moves."""
        while len(self._blocks) > moves:
            self._blocks.popleft()

    @property
    def executed_count(self) -> int:
        """How many commands have certainly been executed."""
        if self._blocks:
            return self._blocks[0].first - 1
        return self._worked if self._short is None else self._short - 1

    @property
    def seconds(self) -> float:
        """How long the moves in the queue take at the least."""
        return sum(block.seconds for block in self._blocks)


class MarlinController(BaseController):
    """A Marlin machine; the docstrings of `dialects.Controller` say what its methods do."""

    conversation: MarlinConversation
    hurry = 2.0  # it speaks every 2 s when it is busy

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        super().__init__(profile, log)
        self._moves = False  # the last command was a move over the paper
        self._planner_queue = PlannerQueue(profile.port.queue, profile.limits.steps_per_mm)
        self._dead = False  # it stopped or was stopped dead: its place is lost, and what it had in hand
        self.conversation = MarlinConversation(port, profile.port.buffer, profile.port.timeout, log, self._note_worked)
        self.profile, self.able = conversation.meet_marlin(self.conversation, profile, log)
        self._planner_queue = PlannerQueue(
            self.profile.port.queue, self.profile.limits.steps_per_mm, self._ask_position()
        )

    def _ask_position(self) -> Position | None:
        return next((reply for reply in self.conversation.ask(protocol.WHERE) if isinstance(reply, Position)), None)

    def send(self, data: bytes) -> None:
        """Write a command as soon as it has room for one more.

        Moves over the paper are never under way together with anything else, such as a pen being lifted: see `link`.
        """
        moves = data.startswith(b"G1") and (b"X" in data or b"Y" in data)
        if not (moves and self._moves):
            self.conversation.drain()
        self._moves = moves
        self.conversation.send(data, self.sent + 1)
        self.sent += 1

    def _note_worked(self, line: ProtocolLine, reply: Ok) -> None:
        self.taken = max(self.taken, line.command)
        self.sent = max(self.sent, self.taken)  # an interrupt may have come between sending and counting
        self._planner_queue.note_worked(line.data, line.command)
        if reply.moves is not None:
            self.queued = max(self.profile.port.queue - reply.moves, 0)
            self._planner_queue.at_most(self.queued)
        if not (self._dead or self.conversation.struck):
            self.executed = max(self.executed, min(self._planner_queue.executed_count, self.taken))
        self.conversation.grace = self._planner_queue.seconds
        self.listener(StateReport(self.taken, self.executed, self.queued))

    @property
    def proven(self) -> int:
        """All executed commands: every line has its number and its checksum."""
        return self.executed

    def wait(self) -> None:
        """Hear what it says next.

        When it has answered everything its queue runs empty, since no more is sent; where it says how many moves it has
        it is asked for that, and elsewhere for an answer when all of them are done.
        """
        if self.conversation.under_way:
            self.conversation.hear()
        elif self.queued is not None:
            self.conversation.replies(_MOMENT)
            self.conversation.ask(protocol.WHERE)
        else:
            self.conversation.ask(protocol.STANDING)

    def finish(self) -> None:
        """Wait until the machine stands and the last command has been executed."""
        self.conversation.ask(protocol.STANDING)

    def position(self) -> tuple[float, float] | None:
        """Machine coordinates, mm, once it stands."""
        self.finish()
        place = self._ask_position()
        return None if place is None or self._dead else (place.x, place.y)

    def _stop_and_lift(self) -> None:
        """Send nothing more, let it finish the little that it has in hand, and lift the pen.

        Marlin has no feed hold, and its quick stop (M410) forgets the moves in its planner but not the commands behind
        them: these would be drawn from wherever it stands.  So M410 is for someone who interrupts a second time; it
        acts when it is received (EMERGENCY_PARSER) or when it is read.
        """
        conversation = self.conversation
        conversation.go_on()
        self._come_to_rest()
        self._ask_all([*protocol.MODES[:2], *protocol.pen(False, self.profile.pen), protocol.STANDING])
        if self._dead:
            conversation.ask(protocol.HERE)  # one that stands in its zero is not believed to know where it is

    def _come_to_rest(self) -> None:
        conversation = self.conversation
        if not conversation.struck and self._runs_out():
            return
        self._dead = True
        for _ in range(0 if conversation.restarted else 2):  # again for the commands that waited behind
            conversation.port.write(b"\n" + protocol.STOP_DEAD)
            deque(conversation.listen(_DROPS, _MOMENT), maxlen=0)
        # what waits or is wanted again would be drawn beside its place
        number_lines(conversation, conversation.timeout)

    def _runs_out(self) -> bool:
        """Let it finish, unless somebody interrupts again."""
        if (left := self._planner_queue.seconds) > _NOTICED:
            self.log(f"The plotter finishes what it has in hand, about {left:.0f} s; interrupt again to stop it dead.")
        try:
            with signals.heed_signals():
                self.conversation.ask(protocol.STANDING)
        except KeyboardInterrupt:
            when = "at once" if "EMERGENCY_PARSER" in self.able else "as soon as it reads that"
            self.log(f"The plotter is stopped dead, {when}; it no longer knows where it is.")
            return False
        return True

    def home(self) -> None:
        """Lift the pen, and find the zero of X and Y by the switches."""
        self.log("Homing: the plotter looks for its zero.")
        for line in protocol.homing(self.profile):
            self.conversation.grace = _HOMING
            self.conversation.ask(line)

    def zero(self) -> None:
        """``G92``, which it forgets with the next reset."""
        self.conversation.ask(protocol.HERE)

    def level(self) -> None:
        """``G92`` as well."""
        self.conversation.ask(protocol.LEVEL)

    def go(self, x: float, y: float) -> None:
        """Travel as at the beginning of a program."""
        way = (PenBlock(down=False), MoveBlock(x, y, float(self.profile.limits.travel_speed) * 60))
        for command in protocol.program(way, self.profile):
            if command.data != protocol.HERE:  # where it stands is no zero
                self.conversation.ask(command.data)

    def pen(self, down: bool) -> None:
        """Move the pen as between two strokes."""
        self._ask_all([*protocol.MODES[:2], *protocol.pen(down, self.profile.pen), protocol.STANDING])

    def jog(self, dx: float, dy: float) -> None:
        """Travel relative to the place that it reports, homed or not."""
        if (place := self._ask_position()) is None:
            raise DeviceSilent("The plotter did not say where it stands: something was lost on the way.")
        self.go(place.x + dx, place.y + dy)

    def release(self) -> None:
        """``M84``; its place is set to zero, which nobody takes for a known place."""
        self._ask_all([protocol.STANDING, protocol.RELEASE, protocol.HERE])
