"""A Marlin controller that is connected: commands out, counts in, halt and home."""

from __future__ import annotations

from collections.abc import Callable

from handout.errors import DeviceError, DeviceSilent
from handout.plotting.dialect import Buttonless, Log, StateReport, ignore_report
from handout.plotting.dialects.marlin import connection, protocol
from handout.plotting.dialects.marlin.conversation import Line, MarlinConversation
from handout.plotting.dialects.marlin.planner_queue import PlannerQueue
from handout.plotting.dialects.marlin.protocol import Ok, Position
from handout.plotting.planning.blocks import Move, Pen
from handout.plotting.ports import Port
from handout.profiles import Plotter

_HOMING = 180.0  # s a machine may take to find its switches, even one that does not say that it is busy
_HURRY = 2.0  # s to wait for an answer when something has gone wrong already; it speaks every 2 s when it is busy
_MOMENT = 0.05  # s between two questions how much room it has
_DROPS = 1.05  # s after M410 in which it takes no moves
_NOTICED = 1.0  # s of motion to come that a person who stops it is told of


class MarlinController(Buttonless):
    """The conversation with one machine; a `dialect.Controller`, whose words say what its methods do."""

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        self.log, self.profile = log, profile
        self.sent = self.taken = self.executed = 0
        self.queued: int | None = None
        self.listener: Callable[[StateReport], None] = ignore_report
        self.silent = ""
        self.spoilt = False
        self._moves = False  # the last command was a move over the paper
        self._planner_queue = PlannerQueue(profile.port.queue, profile.limits.steps_per_mm)
        self._dead = False  # it stopped or was stopped dead: its place is lost, and what it had in hand
        self.conversation = MarlinConversation(port, profile.port.buffer, profile.port.timeout, log, self._worked)
        self.profile, self.able = connection.meet(self.conversation, profile, log)
        place = next((reply for reply in self.conversation.ask(protocol.WHERE) if isinstance(reply, Position)), None)
        self._planner_queue = PlannerQueue(self.profile.port.queue, self.profile.limits.steps_per_mm, place)

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

    def _worked(self, line: Line, reply: Ok) -> None:
        self.taken = max(self.taken, line.command)
        self.sent = max(self.sent, self.taken)  # an interrupt may have come between sending and counting
        self._planner_queue.worked(line.data, line.command)
        if reply.moves is not None:
            self.queued = max(self.profile.port.queue - reply.moves, 0)
            self._planner_queue.at_most(self.queued)
        if not (self._dead or self.conversation.struck):
            self.executed = max(self.executed, min(self._planner_queue.executed, self.taken))
        self.conversation.grace = self._planner_queue.seconds
        self.listener(StateReport(self.taken, self.executed, self.queued))

    @property
    def patience(self) -> float:
        """As the link has it."""
        return self.conversation.patience

    @patience.setter
    def patience(self, seconds: float) -> None:
        self.conversation.patience = seconds

    @property
    def proven(self) -> int:
        """All that is executed: every line has its number and its check sum."""
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
        for reply in self.conversation.ask(protocol.WHERE):
            if isinstance(reply, Position) and not self._dead:
                return reply.x, reply.y
        return None

    def halt(self) -> None:
        """Send nothing more, let it finish the little that it has in hand, and lift the pen.

        Marlin has no feed hold, and its quick stop (M410) forgets the moves in its planner but not the commands behind
        them: these would be drawn from wherever it stands.  So M410 is for someone who interrupts a second time; it
        acts when it is received (EMERGENCY_PARSER) or when it is read.
        """
        conversation = self.conversation
        conversation.timeout = min(conversation.timeout, _HURRY)
        conversation.go_on()
        try:
            self._come_to_rest()
            for line in [*protocol.MODES[:2], *protocol.pen(False, self.profile.pen), *protocol.closing()]:
                conversation.ask(line)
            if self._dead:
                conversation.ask(protocol.HERE)  # one that stands in its zero is not believed to know where it is
        except DeviceError:
            self.log("The pen could not be lifted and may stand on the paper: lift it by hand.")

    def _come_to_rest(self) -> None:
        conversation = self.conversation
        if not conversation.struck and self._runs_out():
            return
        self._dead = True
        if not conversation.restarted:
            self._stop_dead()
        connection.number(
            conversation, conversation.timeout
        )  # what waits or is wanted again would be drawn beside its place

    def _runs_out(self) -> bool:
        """Let it finish, unless somebody interrupts again."""
        if (left := self._planner_queue.seconds) > _NOTICED:
            self.log(f"The plotter finishes what it has in hand, about {left:.0f} s; interrupt again to stop it dead.")
        try:
            self.conversation.ask(protocol.STANDING)
        except KeyboardInterrupt:
            when = "at once" if "EMERGENCY_PARSER" in self.able else "as soon as it reads that"
            self.log(f"The plotter is stopped dead, {when}; it no longer knows where it is.")
            return False
        return True

    def _stop_dead(self) -> None:
        """Stop at once; and once more as it begins what stood behind, a second later, before that moves far."""
        for _ in range(2):
            self.conversation.port.write(b"\n" + protocol.STOP_DEAD)
            waited = 0.0
            while waited < _DROPS:
                waited += 0.0 if self.conversation.replies(_MOMENT) else _MOMENT

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
        """As the beginning of a program would."""
        way = (Pen(down=False), Move(x, y, float(self.profile.limits.travel_speed) * 60))
        for command in protocol.program(way, self.profile):
            if command.data != protocol.HERE:  # where it stands is no zero
                self.conversation.ask(command.data)

    def pen(self, down: bool) -> None:
        """As between two strokes."""
        for line in [*protocol.MODES[:2], *protocol.pen(down, self.profile.pen), *protocol.closing()]:
            self.conversation.ask(line)

    def jog(self, dx: float, dy: float) -> None:
        """From where it says that it is, homed or not."""
        place = next((reply for reply in self.conversation.ask(protocol.WHERE) if isinstance(reply, Position)), None)
        if place is None:
            raise DeviceSilent("The plotter did not say where it stands: something was lost on the way.")
        self.go(place.x + dx, place.y + dy)

    def release(self) -> None:
        """``M84``; it is left in its zero, where it is not believed to know where it is."""
        for line in (protocol.STANDING, protocol.RELEASE, protocol.HERE):
            self.conversation.ask(line)
