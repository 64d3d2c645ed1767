"""A conversation with a Marlin controller: numbered lines out, replies in, lines again that it asks for; connecting.

What makes it safe: Marlin takes a numbered line only if its number is the next one and its checksum is right, so what
is lost, damaged or sent twice is asked for again, and every line is executed once and in order.  Its ``ok`` says that
one more line has been worked through, and serves to keep no more lines under way than it has room for.  Where an ``ok``
may have been lost, a harmless numbered question tells both what it is missing and what it has worked through.

One gap is left, and it is why lines are sent one at a time where the connection is quick enough (`window` is 1): when
Marlin finds a damaged line it throws away what it has received, which may end in the middle of the next line, just
behind its number.  What comes after that is a command without a number, which Marlin obeys.

`meet_marlin` finds out whether it is there, checks what it receives, and what its own limits are.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec

from handout.errors import DeviceAlarm, DeviceHeld, DeviceSilent
from handout.plotting.dialects import Log
from handout.plotting.dialects.base import GLANCE, RESTARTED, Conversation, never_answered, silence_error, with_limits
from handout.plotting.dialects.marlin import protocol
from handout.plotting.dialects.marlin.protocol import Ok, Reply, Resend
from handout.plotting.ports import Port
from handout.profiles import Acceleration, Length, Plotter, Speed

WINDOW = 4  # commands that Marlin can hold (BUFSIZE), the one it works on included
_AGAIN = 1.0  # s between two questions
_BUSY = 2.5  # s without a word from a machine that says every 2 s that it is busy
_SETTLE = 0.05  # s without a word after which all that was under way has been judged
_STUCK = 4  # times the time-out that it may answer without getting on
_LONGEST = 600.0  # s that it may say that it is busy with one command, besides the time its moves take
_KEPT = 64  # lines that are remembered after they were worked through
_PATIENCE = 40  # times in a row that it may ask for the same line; one damaged line makes up to four
_MANY = 20  # lines sent again after which the user is told
_OPTIONAL = (b"M205", b"M220", b"M84", b"M503", b"M115", b"G21")  # commands that a controller may do without


class ProtocolLine(NamedTuple):
    """A line of the program or of the conversation; `command` program commands are executed when it is."""

    number: int
    data: bytes
    command: int
    framed: bytes


Worked = Callable[[ProtocolLine, Ok], None]


class MarlinConversation(Conversation[Reply]):
    """A port with a Marlin controller behind it.

    Its methods raise DeviceSilent when nothing is answered or nothing gets through; DeviceAlarm when the machine stops
    or does not know a command; PortError when the connection breaks.

    buffer : bytes the controller can receive before it reads them.
    worked : told every line that has been worked through, once and in order.

    window : lines that may be under way.
    echoes : whether an ``ok`` follows its request for a line, which acknowledges nothing.
    again : how many lines were sent more than once.
    grace : how long it may be silent besides `timeout` because it moves, s.
    struck : it has stopped by itself in the middle of what it had in hand; restarted : it has started anew.
    """

    def __init__(self, port: Port, buffer: int, timeout: float, log: Log, worked: Worked) -> None:
        super().__init__(port, timeout, log, protocol.reply)
        self.buffer, self._worked = buffer, worked
        self.window, self.echoes, self.again, self.grace = 1, True, 0, 0.0
        self.struck = self.restarted = False
        self._quiet = self._prodded = 0.0
        self._prods = 0
        self._waiting = False  # for a person
        self._settling = False  # what is under way has not all been judged
        self._listener: list[Reply] | None = None
        self.start(0)

    def start(self, number: int) -> None:
        """Count from here: the last line the controller knows is `number`."""
        self._lines: deque[ProtocolLine] = deque()
        self._last = self._done = self._reported = number  # written; worked through; told to `worked`
        self._next = number + 1  # the next to write; at most _last + 1, less when lines are sent again
        self._placed = False  # whether a question for its place was answered since anything else was written
        self._stuck = self._busy = self._paused = 0.0  # s since it got on: without a word of being busy; in all; paused
        self._skip = 0  # answers to come that acknowledge nothing
        self._asked, self._times = -1, 0

    @property
    def under_way(self) -> int:
        """Lines written and not known to be worked through."""
        return self._last - self._done

    def send(self, data: bytes, command: int) -> None:
        """Write a line as soon as the controller has room, after the lines that it asked for again."""
        while True:
            line = ProtocolLine(self._last + 1, data, command, protocol.frame_line(self._last + 1, data))
            if self._next > self._last and self._room(line):
                self._append(line)
                return
            self._proceed()

    def drain(self) -> None:
        """Wait until every line has been worked through."""
        while self.under_way:
            self._proceed()

    def ask(self, data: bytes) -> list[Reply]:
        """Send a line and wait until it was worked through; everything said until then."""
        replies: list[Reply] = []
        self._listener = replies
        try:
            self.send(data, self._lines[-1].command if self._lines else 0)
            self.drain()
        finally:
            self._listener = None
        return replies

    def _proceed(self) -> None:
        """Write the next line that it asked for again, or hear its answers."""
        if self._next <= self._last and self._room(self._line(self._next)):
            self._write(self._line(self._next))
            self.again += 1
            if self.again == _MANY:
                self.log(
                    f"What is sent arrives damaged now and then ({_MANY} lines were sent again so far); nothing is "
                    "lost, but a shorter or shielded cable would be faster."
                )
        else:
            self.hear()

    def _append(self, line: ProtocolLine) -> None:
        self._last = line.number
        self._lines.append(line)
        self._write(line)
        while self._lines[0].number < self._done - _KEPT:
            self._lines.popleft()

    def _write(self, line: ProtocolLine) -> None:
        self._next = line.number + 1
        self._placed &= line.data == protocol.WHERE
        self.port.write(line.framed)

    def _line(self, number: int) -> ProtocolLine:
        return self._lines[number - self._lines[0].number]

    def _room(self, line: ProtocolLine) -> bool:
        """Whether the controller surely has room for a line."""
        before = range(self._done + 1, line.number)
        if len(before) >= self.window:
            return False
        return not before or sum(len(self._line(n).framed) for n in before) + len(line.framed) <= self.buffer - 1

    def hear(self) -> None:
        """Hear the next answers.  A silent controller is asked; DeviceSilent if it stays silent."""
        glance, begun = self.glance, self.time
        while not (replies := self.replies(glance)):
            passed, begun = self.time - begun, self.time
            self._quiet += passed
            self._wait(passed)
            if self._are_questions_answered():
                self._up_to(self._last, Ok())
                return
            if self._quiet > self.timeout + self.grace:
                raise silence_error(f"{self._quiet:g}")
            if self._quiet >= self._prodded:
                self._prod()
                self._prodded = self._quiet + (glance if self._prods % 2 else _AGAIN)
        self._quiet, self._prodded, self._prods = 0.0, 0.0, 0
        if any(isinstance(reply, protocol.Busy) or reply == Resend(self._last + 1) for reply in replies):
            self._prodded = _BUSY  # it is well, and has all it was sent
        while replies:
            for reply in replies:
                self.take(reply)
            replies = self.replies(_SETTLE) if self._settling else []
        self._settling = False
        self._wait(self.time - begun)

    def _are_questions_answered(self) -> bool:
        """Whether only questions for its place are open and one was answered: then all were, since it is silent.

        They wait for nothing.  The ``ok`` of one was lost, or of a line before them; if one of themselves was lost, the
        controller will ask for it.
        """
        open_ = [line for line in self._lines if line.number > self._done]
        return self._placed and bool(open_) and all(line.data == protocol.WHERE for line in open_)

    def _wait(self, seconds: float) -> None:
        """Count time without progress; raises DeviceSilent or DeviceHeld when it is too long."""
        if self._waiting:
            self._paused += seconds
            if self._paused > self.patience:
                raise DeviceHeld(
                    f"The plotter has waited {self._paused:.0f} s for somebody to press its button, and nobody did."
                )
            return
        self._stuck, self._busy = self._stuck + seconds, self._busy + seconds
        if self._stuck > _STUCK * self.timeout + self.grace:
            raise DeviceSilent(
                f"The plotter answers but has not worked through what it was sent for {self._stuck:.0f} s: something "
                "was lost on the way; use a shorter or shielded cable."
            )
        if self._busy > _LONGEST + self.grace:
            raise DeviceSilent(f"The plotter has said for {self._busy:.0f} s that it is busy: switch it off and on.")

    def go_on(self) -> None:
        """Confirm a wait for its button, and wait for persons no longer than for an answer."""
        if self._waiting:
            self.port.write(b"\n" + protocol.GO_ON)
        self.patience, self._waiting, self._paused = self.timeout, False, 0.0

    def _prod(self) -> None:
        """End a line that may have lost its own end; and if that does not help, ask something harmless.

        The question has the next number.  If a line before it is missing, the controller asks for that; if not, its
        answer shows that all lines before were worked through, though an ``ok`` was lost.
        """
        self._prods += 1
        if self._prods % 2:
            self.port.write(b"\n")
        elif self._next <= self._last:
            self._write(self._line(self._next))
        elif self.under_way and self._lines[-1].data == protocol.WHERE and self._asked != self._last + 1:
            self._write(self._lines[-1])
        else:
            number, command = self._last + 1, self._lines[-1].command if self._lines else 0
            self._append(ProtocolLine(number, protocol.WHERE, command, protocol.frame_line(number, protocol.WHERE)))

    def take(self, reply: Reply) -> None:
        """Act on a reply: count what was worked through, go back to a line that is wanted again, stop at trouble."""
        if self._listener is not None:
            self._listener.append(reply)
        if isinstance(reply, Ok):
            if self._skip:
                self._skip -= 1
            else:
                self._up_to(self._done + 1 if reply.line is None else reply.line, reply)
        elif isinstance(reply, Resend):
            self._resend(reply.line)
        elif isinstance(reply, protocol.Position):
            asked = next(
                (each for each in self._lines if each.number > self._done and each.data == protocol.WHERE), None
            )
            if asked is not None:
                self._up_to(asked.number - 1, Ok())
                self._placed = True
        elif isinstance(reply, protocol.Unknown):
            self._unknown(reply)
        elif isinstance(reply, protocol.Busy):
            self._stuck = 0.0
            if reply.waits_for_person and not self._waiting:
                self.log("The plotter waits for somebody to press its button, and goes on then.")
            self._waiting = reply.waits_for_person
        else:
            self.struck |= isinstance(reply, protocol.Error | protocol.Struck | protocol.Start)
            self.restarted |= isinstance(reply, protocol.Start)
            _trouble(reply)

    def _up_to(self, number: int, reply: Ok) -> None:
        """Lines up to this number were worked through."""
        if not self._done < number < self._next:
            return
        self._waiting = False
        self._stuck = self._busy = self._paused = 0.0
        while self._done < number:
            self._done += 1
            if self._done > self._reported:
                self._reported = self._done
                self._worked(self._line(self._done), reply if self._done == number else Ok())

    def _resend(self, number: int) -> None:
        """Go back to the line it asks for, once everything that was under way has been judged."""
        self._times = self._times + 1 if number == self._asked and number <= self._last else 1
        self._asked = number
        if self._times > _PATIENCE:
            raise DeviceSilent(
                f"The plotter has asked {self._times} times in a row for the same line: what is sent to it arrives "
                "damaged; use a shorter or shielded cable, away from motors, or a lower baud."
            )
        self._skip, self._settling = int(self.echoes), True
        if self._lines and self._lines[0].number <= number <= self._last + 1:  # or the number itself was damaged
            self._next = number
            self._done = min(self._done, number - 1)

    def _unknown(self, reply: protocol.Unknown) -> None:
        text = reply.command.encode()
        waiting = [line for line in self._lines if line.number > self._done and text.startswith(line.data.strip())]
        if not waiting:  # a line that lost its number, or the rest of one
            self._skip, self._settling = 1, True
            self._next = self._done + 1
        elif not waiting[0].data.startswith(_OPTIONAL):
            raise DeviceAlarm(
                f"The plotter does not know {reply.command!r}: its firmware was built without it; check pen.lift and "
                "the commands of the profile."
            )


def _trouble(reply: Reply) -> None:
    """Raise DeviceAlarm for a reply that tells of trouble."""
    if isinstance(reply, protocol.Error):
        raise DeviceAlarm(f"The plotter reports {reply.description}.")
    if isinstance(reply, protocol.Unhomed):
        raise DeviceAlarm(
            "The plotter does not move before it has found its zero: set homing = true in the profile, or home it at "
            "its own panel."
        )
    if isinstance(reply, protocol.Struck):
        raise DeviceAlarm(
            f"The plotter hit a limit switch ({reply.text}) and no longer knows where it is: bring it back to its zero."
        )
    if isinstance(reply, protocol.Start):
        raise DeviceAlarm(RESTARTED)


# Numbers begin where no command has its own: a damaged N before 112 must not make M112.
_FIRST = 10_000
_TRY = 1.0  # s to wait for the answer to one attempt
_LONGER = 15  # bytes by which a line that draws is longer than one that asks
_QUICK = 0.6  # share of the time of a segment in which a line has to be answered if lines are to be sent one by one
_SLOW = 2.5  # times of a segment in which even several lines under way are too few


def meet_marlin(conversation: MarlinConversation, profile: Plotter, log: Log) -> tuple[Plotter, set[str]]:
    """Wake the controller, number the lines, read its settings; it does not move.

    Returns the profile with the machine's own limits, where `log` is told that they differ; and what the controller can
    do besides, by the names of ``M115``: EMERGENCY_PARSER …

    Raises DeviceSilent if nothing answers, or something that is not Marlin.
    """
    replies = _hear_greeting(conversation, profile.port.start_up)
    replies += number_lines(conversation, profile.port.start_up + profile.port.timeout, replies)
    _check_numbers(conversation, log)
    answers = conversation.ask(protocol.WHO)
    name = next((reply.name for reply in answers if isinstance(reply, protocol.Identity)), "")
    if name and "marlin" not in name.lower() and "prusa" not in name.lower():
        log(f"The plotter says that it runs {name!r}, which is not Marlin; it is spoken to as if it were.")
    answers += conversation.ask(protocol.SETTINGS)
    answers += conversation.ask(protocol.STANDING)
    able = {reply.name for reply in answers if isinstance(reply, protocol.Capability) and reply.able}
    profile = with_settings(profile, answers, log)
    room = [reply.commands + 1 for reply in answers if isinstance(reply, Ok) and reply.commands is not None]
    beat = _round_trip(conversation, profile)
    if beat * profile.segment_rate > _QUICK:
        conversation.window = max(room, default=WINDOW)
    if beat * profile.segment_rate > _SLOW:
        log(
            f"The plotter answers only after {beat * 1000:.0f} ms: it may pause in the middle of strokes; set the "
            "latency of its USB adapter to 1 ms, or lower segment_rate in the profile."
        )
    return profile, able


def _hear_greeting(conversation: MarlinConversation, start_up: float) -> list[Reply]:
    """What it says when its port is opened: a board may start anew then, and is deaf until it has greeted."""
    greeting = list[Reply]()
    for replies in conversation.listen(start_up):
        if not replies and any(isinstance(reply, protocol.Start) for reply in greeting):
            break
        greeting += replies
    return greeting


def number_lines(conversation: MarlinConversation, patience: float, before: Sequence[Reply] = ()) -> list[Reply]:
    """Set the number of the next line; returns all replies."""
    end, replies = conversation.time + patience, list[Reply]()
    while conversation.time < end:
        conversation.port.write(b"\n" + protocol.frame_line(_FIRST, protocol.NUMBER))
        answer = _answer(conversation, _TRY)
        replies += answer
        if any(isinstance(reply, Ok) for reply in answer) and not _is_damaged(answer):
            conversation.start(_FIRST)
            return replies
    garbage = any(isinstance(reply, protocol.Note | protocol.Error) for reply in [*before, *replies])
    raise never_answered("Marlin", patience, garbage)


def _is_damaged(answer: list[Reply]) -> bool:
    return any(isinstance(reply, Resend | protocol.Fault | protocol.Unknown | protocol.Error) for reply in answer)


def _answer(conversation: MarlinConversation, patience: float) -> list[Reply]:
    """All replies from the first, within `patience` s, to a silence."""
    answer = conversation.replies(patience)
    end = conversation.time + patience
    while replies := conversation.replies(GLANCE) if answer and conversation.time < end else []:
        answer += replies
    return answer


def _check_numbers(conversation: MarlinConversation, log: Log) -> None:
    """See that a line out of order is refused, and learn whether an ``ok`` follows the refusal.

    Some versions send an ``ok`` after their request for a line and some do not, and only a test can tell.
    """
    for _ in range(3):
        conversation.port.write(b"\n" + protocol.frame_line(_FIRST + 2, protocol.STANDING))
        answer = _answer(conversation, _TRY)
        asked = [at for at, reply in enumerate(answer) if isinstance(reply, Resend)]
        if asked:
            conversation.echoes = any(isinstance(reply, Ok) for reply in answer[asked[-1] :])
            return
        if any(isinstance(reply, Ok) for reply in answer) and not _is_damaged(answer):
            break
    log("The plotter does not check the numbers of its lines: what is damaged on the way to it will not be noticed.")


def _round_trip(conversation: MarlinConversation, profile: Plotter) -> float:
    """How long it takes from a line to the answer to it, s by the port's clock."""
    least = _TRY
    for _ in range(3):
        begun = conversation.time
        conversation.send(protocol.STANDING, 0)
        while conversation.under_way and conversation.time < begun + _TRY:
            for reply in conversation.replies(_TRY):
                conversation.take(reply)
        least = min(least, conversation.time - begun)
        conversation.drain()
    return least + _LONGER * 10 / profile.port.baud


def with_settings(profile: Plotter, replies: list[Reply], log: Log) -> Plotter:
    """The profile with what ``M503`` said; `log` is told about every difference that changes the motion.

    Speeds are the lesser of the two, all else is the machine's.  Moves without filament are Marlin's travel moves:
    their acceleration is the T of ``M204``, at most that of ``M201``.
    """
    settings: dict[str, float] = {}
    for reply in replies:
        if isinstance(reply, protocol.SettingsLine):
            settings |= {reply.code + letter: value for letter, value in reply.values.items()}
    limits = with_limits(profile, _own_limits(profile, settings), log)
    pen, port = profile.pen, profile.port
    if pen.lift == "z" and {"M203Z", "M201Z"} <= settings.keys():
        own_z = Acceleration(min(settings["M201Z"], settings.get("M204T", settings["M201Z"])))
        pen = msgspec.structs.replace(pen, z_speed=Speed(min(pen.z_speed, settings["M203Z"])), z_acceleration=own_z)
    room = [reply.moves for reply in replies if isinstance(reply, Ok) and reply.moves is not None]
    if room:
        port = msgspec.structs.replace(port, queue=max(room))
    return msgspec.structs.replace(profile, limits=limits, pen=pen, port=port)


def _own_limits(profile: Plotter, settings: dict[str, float]) -> dict[str, float]:
    """The machine's own values of keys of the profile's `limits`."""
    limits = profile.limits
    values: dict[str, float] = {}
    if {"M203X", "M203Y"} <= settings.keys():
        fastest = min(settings["M203X"], settings["M203Y"])
        values["draw_speed"] = Speed(min(limits.draw_speed, fastest))
        values["travel_speed"] = Speed(min(limits.travel_speed, fastest))
    if {"M201X", "M201Y"} <= settings.keys():
        travel = settings.get("M204T", settings.get("M204S", limits.acceleration))
        values["acceleration"] = Acceleration(min(settings["M201X"], settings["M201Y"], travel))
    if "M205J" in settings:
        values["junction_deviation"], values["jerk"] = Length(settings["M205J"]), Speed(0.0)
    elif {"M205X", "M205Y"} <= settings.keys():
        values["jerk"] = Speed(min(settings["M205X"], settings["M205Y"]))
    if "M92X" in settings:
        values["steps_per_mm"] = settings["M92X"]
    return values
