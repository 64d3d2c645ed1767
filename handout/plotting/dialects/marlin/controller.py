"""A Marlin controller that is connected: commands out, counts in, halt and home."""

from __future__ import annotations

from collections.abc import Callable

from handout.errors import DeviceError, DeviceSilent
from handout.plotting.dialect import Buttonless, Heard, Log, unheard
from handout.plotting.dialects.marlin import connecting, words
from handout.plotting.dialects.marlin.held import Held
from handout.plotting.dialects.marlin.link import Line, Link
from handout.plotting.dialects.marlin.words import Ok, Position
from handout.plotting.planning.blocks import Move, Pen
from handout.plotting.ports import Port
from handout.profiles import Plotter

_HOMING = 180.0  # s a machine may take to find its switches, even one that does not say that it is busy
_HURRY = 2.0  # s to wait for an answer when something has gone wrong already; it speaks every 2 s when it is busy
_MOMENT = 0.05  # s between two questions how much room it has
_DROPS = 1.05  # s after M410 in which it takes no moves
_NOTICED = 1.0  # s of motion to come that a person who stops it is told of


class Marlin(Buttonless):
    """The conversation with one machine; a `dialect.Controller`, whose words say what its methods do."""

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        self.log, self.profile = log, profile
        self.sent = self.taken = self.executed = 0
        self.queued: int | None = None
        self.listener: Callable[[Heard], None] = unheard
        self.silent = ""
        self.spoilt = False
        self._moves = False  # the last command was a move over the paper
        self._held = Held(profile.port.queue, profile.limits.steps_per_mm)
        self._dead = False  # it stopped or was stopped dead: its place is lost, and what it had in hand
        self.link = Link(port, profile.port.buffer, profile.port.timeout, log, self._worked)
        self.profile, self.able = connecting.meet(self.link, profile, log)
        place = next((reply for reply in self.link.ask(words.WHERE) if isinstance(reply, Position)), None)
        self._held = Held(self.profile.port.queue, self.profile.limits.steps_per_mm, place)

    def send(self, data: bytes) -> None:
        """Write a command as soon as it has room for one more.

        Moves over the paper are never under way together with anything else, such as a pen being lifted: see `link`.
        """
        moves = data.startswith(b"G1") and (b"X" in data or b"Y" in data)
        if not (moves and self._moves):
            self.link.drain()
        self._moves = moves
        self.link.send(data, self.sent + 1)
        self.sent += 1

    def _worked(self, line: Line, reply: Ok) -> None:
        self.taken = max(self.taken, line.command)
        self.sent = max(self.sent, self.taken)  # an interrupt may have come between sending and counting
        self._held.worked(line.data, line.command)
        if reply.moves is not None:
            self.queued = max(self.profile.port.queue - reply.moves, 0)
            self._held.at_most(self.queued)
        if not (self._dead or self.link.struck):
            self.executed = max(self.executed, min(self._held.executed, self.taken))
        self.link.grace = self._held.seconds
        self.listener(Heard(self.taken, self.executed, self.queued))

    @property
    def patience(self) -> float:
        """As the link has it."""
        return self.link.patience

    @patience.setter
    def patience(self, seconds: float) -> None:
        self.link.patience = seconds

    @property
    def proven(self) -> int:
        """All that is executed: every line has its number and its check sum."""
        return self.executed

    def wait(self) -> None:
        """Hear what it says next.

        When it has answered everything its queue runs empty, since no more is sent; where it says how many moves it has
        it is asked for that, and elsewhere for an answer when all of them are done.
        """
        if self.link.under_way:
            self.link.hear()
        elif self.queued is not None:
            self.link.replies(_MOMENT)
            self.link.ask(words.WHERE)
        else:
            self.link.ask(words.STANDING)

    def finish(self) -> None:
        """Wait until the machine stands and the last command has been executed."""
        self.link.ask(words.STANDING)

    def position(self) -> tuple[float, float] | None:
        """Machine coordinates, mm, once it stands."""
        self.finish()
        for reply in self.link.ask(words.WHERE):
            if isinstance(reply, Position) and not self._dead:
                return reply.x, reply.y
        return None

    def halt(self) -> None:
        """Send nothing more, let it finish the little that it has in hand, and lift the pen.

        Marlin has no feed hold, and its quick stop (M410) forgets the moves in its planner but not the commands behind
        them: these would be drawn from wherever it stands.  So M410 is for someone who interrupts a second time; it
        acts when it is received (EMERGENCY_PARSER) or when it is read.
        """
        link = self.link
        link.timeout = min(link.timeout, _HURRY)
        link.go_on()
        try:
            self._come_to_rest()
            for line in [*words.MODES[:2], *words.pen(False, self.profile.pen), *words.closing()]:
                link.ask(line)
            if self._dead:
                link.ask(words.HERE)  # one that stands in its zero is not believed to know where it is
        except DeviceError:
            self.log("The pen could not be lifted and may stand on the paper: lift it by hand.")

    def _come_to_rest(self) -> None:
        link = self.link
        if not link.struck and self._runs_out():
            return
        self._dead = True
        if not link.restarted:
            self._stop_dead()
        connecting.number(link, link.timeout)  # what waits or is wanted again would be drawn beside its place

    def _runs_out(self) -> bool:
        """Let it finish, unless somebody interrupts again."""
        if (left := self._held.seconds) > _NOTICED:
            self.log(f"The plotter finishes what it has in hand, about {left:.0f} s; interrupt again to stop it dead.")
        try:
            self.link.ask(words.STANDING)
        except KeyboardInterrupt:
            when = "at once" if "EMERGENCY_PARSER" in self.able else "as soon as it reads that"
            self.log(f"The plotter is stopped dead, {when}; it no longer knows where it is.")
            return False
        return True

    def _stop_dead(self) -> None:
        """Stop at once; and once more as it begins what stood behind, a second later, before that moves far."""
        for _ in range(2):
            self.link.port.write(b"\n" + words.STOP_DEAD)
            waited = 0.0
            while waited < _DROPS:
                waited += 0.0 if self.link.replies(_MOMENT) else _MOMENT

    def home(self) -> None:
        """Lift the pen, and find the zero of X and Y by the switches."""
        self.log("Homing: the plotter looks for its zero.")
        for line in words.homing(self.profile):
            self.link.grace = _HOMING
            self.link.ask(line)

    def zero(self) -> None:
        """``G92``, which it forgets with the next reset."""
        self.link.ask(words.HERE)

    def level(self) -> None:
        """``G92`` as well."""
        self.link.ask(words.LEVEL)

    def go(self, x: float, y: float) -> None:
        """As the beginning of a program would."""
        way = (Pen(down=False), Move(x, y, float(self.profile.limits.travel_speed) * 60))
        for command in words.program(way, self.profile):
            if command.data != words.HERE:  # where it stands is no zero
                self.link.ask(command.data)

    def pen(self, down: bool) -> None:
        """As between two strokes."""
        for line in [*words.MODES[:2], *words.pen(down, self.profile.pen), *words.closing()]:
            self.link.ask(line)

    def jog(self, dx: float, dy: float) -> None:
        """From where it says that it is, homed or not."""
        place = next((reply for reply in self.link.ask(words.WHERE) if isinstance(reply, Position)), None)
        if place is None:
            raise DeviceSilent("The plotter did not say where it stands: something was lost on the way.")
        self.go(place.x + dx, place.y + dy)

    def release(self) -> None:
        """``M84``; it is left in its zero, where it is not believed to know where it is."""
        for line in (words.STANDING, words.RELEASE, words.HERE):
            self.link.ask(line)
