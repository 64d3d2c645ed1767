"""An HP-GL plotter that is connected: instructions out as there is room for them, and how far it must be.

A plotter acknowledges nothing.  It says at any time how many bytes of its buffer are free (ESC.B), and acts on such a
question when it arrives, behind all that was sent before.  So at the moment of the answer everything sent has arrived,
and what is not in the buffer any more has been read: all of it has been executed but for the last few vectors.

Two answers must never be under way at once: the plotter takes that for an error and ignores the second question.
Instructions are written whole, and no question comes between their bytes.

Source: Hewlett-Packard 1983, interfacing and programming of the HP 7475A, and the same of the 7470A (device control,
software checking handshake).
"""

from __future__ import annotations

import contextlib
import re
from collections import deque

import msgspec
import numpy as np

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceHeld, DeviceSilent, InputError
from handout.plotting import bed
from handout.plotting.dialects import Log
from handout.plotting.dialects.base import GLANCE, BaseController, Conversation
from handout.plotting.dialects.hpgl import protocol
from handout.plotting.ports import Port
from handout.profiles import Length, Plotter

_DREG = 0.05  # s between two moments in which old answers are listened for
_DREGS = 2.0  # s that old answers are listened for at most
_ANSWER = 80  # bytes that no answer has
_NO_PLOTTER = "Something answers, but not as an HP-GL plotter does: check baud, parity and dialect in the profile."
STARTED = "The plotter was switched off and on in between: load its paper as it was, and check its power."
_STATE = re.compile(rb"(?<![\d,])(\d+)[\r\n]")  # a number alone on its line
_END = re.compile(rb"[\r\n]")


class HpglConversation(Conversation[bytes]):
    """A port with a plotter behind it that speaks only when it is asked.

    restarted : whether it was off since its last plot; held : whether it is on hold.
    """

    def __init__(self, port: Port, timeout: float, log: Log) -> None:
        super().__init__(port, timeout, log, bytes)
        self.restarted = self.held = False
        self._stood = 0.0  # s that it has been on hold
        self._marked = False  # whether its answers end in a way that it forgets when it is switched off

    def ask(self, question: bytes, patience: float = 0.0, count: int = 1) -> tuple[float, ...]:
        """Ask for `count` numbers."""
        numbers = protocol.numbers(self.hear(question, patience))
        if numbers is None or len(numbers) != count:
            raise DeviceSilent(_NO_PLOTTER)
        return numbers

    def hear(self, question: bytes, patience: float = 0.0) -> bytes:
        """Ask, and wait for the answer, without its end."""
        self.port.write(question)
        begun, patience = self.time, patience or self.timeout
        while not (end := _END.search(self._partial)):
            waited = self.time - begun
            if len(self._partial) > _ANSWER or (waited > patience and self._partial):
                raise DeviceSilent(_NO_PLOTTER)
            if waited > patience and question.startswith(b"O") and self._is_held():
                self.pass_time(waited)
                begun = self.time
            elif waited > patience:
                raise DeviceSilent(
                    f"The plotter has not answered for {patience:g} s: check its cable and its power, that it listens "
                    "to this port, and its baud rate."
                )
            self._partial = (self._partial + self.read(GLANCE)).lstrip(b"\r\n")
        answer, self._partial = self._partial[: end.start()], self._partial[end.end() :].lstrip(b"\r\n")
        if self._marked and end.group() == b"\r":
            self.restarted, self._marked = True, False
            raise DeviceAlarm(STARTED)
        self._marked |= question == protocol.STATE and end.group() == b"\n"
        return answer.strip()

    def _is_held(self) -> bool:
        """Whether it is on hold; an answer that it still owes may come before the one to this question."""
        self.port.write(protocol.STATE)
        end = self.time + self.timeout
        while self.time < end:
            self._partial += self.read(GLANCE)
            if match := _STATE.search(self._partial):
                self._partial = self._partial[: match.start()] + self._partial[match.end() :]
                self._note_hold(bool(int(match.group(1)) & protocol.VIEWING))
                return self.held
        return False

    def check_state(self) -> None:
        """Ask whether the lever is raised (DeviceAlarm) or VIEW is pressed."""
        state = int(self.ask(protocol.STATE)[0])
        if state & protocol.LEVER:
            raise DeviceAlarm(
                "The paper lever of the plotter is raised, and the sheet may have moved: load it as it was, and lower "
                "the lever."
            )
        self._note_hold(bool(state & protocol.VIEWING))

    def _note_hold(self, held: bool) -> None:
        if held and not self.held:
            self.log("The plotter is on hold; it goes on when VIEW (or PAUSE) is pressed again.")
        self.held = held

    def check_line(self) -> None:
        """Whether something was lost on the way."""
        number = int(self.ask(protocol.LINE_ERROR)[0])
        if number in (15, 16):
            raise DeviceGarbled(f"Something was lost on the way to the plotter: {protocol.line_error(number)}.")
        if number:
            self.log(f"The plotter reports {protocol.line_error(number)}.")

    def pass_time(self, seconds: float) -> None:
        """Count time on hold; DeviceHeld if it was too long."""
        self._stood = self._stood + seconds if self.held else 0.0
        if self._stood > self.patience:
            raise DeviceHeld(
                f"The plotter has been on hold for {self._stood:.0f} s, and nobody pressed VIEW (or PAUSE) again."
            )

    def forget(self) -> None:
        """Discard answers to earlier questions."""
        end = self.time + _DREGS
        while self.read(_DREG) and self.time < end:
            pass
        self._partial = b""


_FITS = 60  # bytes that the smallest buffer can take when it is empty
_PARTS = 4  # of what is on its way, the part that is worth going on for
_RESERVE = 128  # bytes of the buffer that stay free, for plotters that count their room too high
_MOMENT = 0.05  # s between two questions when nothing has changed
_LAST_LINE = 2.0  # s that the last line may take
_LONGEST = 15.0  # s that one instruction may take, at the least velocity
_CHECKED = 16  # questions for room between two for errors of the line

_NEAR = 1.5  # plotter units; rounding may leave it one beside


class PenPosition:
    """Follows the instructions; at : plotter units, None as long as it has not been sent to a place."""

    def __init__(self) -> None:
        self.at: tuple[int, int] | None = None

    def send(self, data: bytes) -> None:
        """Follow instructions that are sent; relative places continue from the last one."""
        for instruction in protocol.read_instructions(data):
            for x, y in instruction.points if instruction.name in ("PA", "PU", "PD", "PR") else []:
                before = self.at if instruction.name == "PR" and self.at is not None else (0, 0)
                self.at = round(before[0] + x), round(before[1] + y)

    def is_missed(self, x: float, y: float) -> bool:
        """Whether the plotter stands elsewhere than it was sent, by more than rounding explains."""
        return self.at is not None and max(abs(x - self.at[0]), abs(y - self.at[1])) > _NEAR


class HpglController(BaseController):
    """An HP-GL plotter; the docstrings of `dialects.Controller` say what its methods do.

    size : bytes its buffer holds; model : what it calls itself.
    """

    conversation: HpglConversation
    hurry = 3.0
    silent = "An HP-GL plotter says how much it has read, not what it has drawn of that."

    def __init__(self, port: Port, profile: Plotter, log: Log) -> None:
        super().__init__(profile, log)
        self.conversation = HpglConversation(port, float(profile.port.timeout), log)
        self.port, self.size, self.model = port, profile.port.buffer, ""
        self._pen_position = PenPosition()
        self._room = 0  # bytes that may be written before it is asked again
        self._bytes = self._read = 0  # written; certainly taken out of its buffer
        self._ends: deque[tuple[int, int]] = deque()  # of what may be in its buffer: all bytes up to its end, its moves
        self._read_moves: deque[int] = deque()  # of what was read but is not certainly executed
        self._asked = 0
        self._still = 0.0  # s in which it has taken nothing out of its buffer
        self._meet()

    def _meet(self) -> None:
        """Wake the plotter, empty its buffer, ask for its name and its reach; it does not move.

        Raises DeviceSilent (nothing answers, or something that is no HP-GL plotter) or DeviceAlarm (it has no paper).
        """
        conversation = self.conversation
        self.port.write(protocol.LISTEN + protocol.MARKED)
        conversation.read(_MOMENT)  # what it says by itself when it is switched on
        conversation.check_state()
        self.drop()
        self.size = int(conversation.ask(protocol.SIZE)[0])
        conversation.ask(protocol.ERROR)
        self.model = conversation.hear(protocol.WHO).decode("ascii", "replace")
        self.port.write(b"".join(protocol.rotate(self.profile)))
        self.profile = _limit_profile(self.profile, conversation.ask(protocol.LIMITS, count=4), self.size, self.log)
        self.clear_start()
        self.drop()

    def send(self, data: bytes) -> None:
        """Write an instruction as soon as there is room for it."""
        if data.startswith(protocol.PEN_DOWN):
            self.finish()  # it stands with its pen lifted: what was drawn before is proven, and it has not started anew
        while self._room < len(data):
            self.wait()
        self._pen_position.send(data)
        self.port.write(data)
        self.sent += 1
        self._bytes += len(data)
        self._room -= len(data)
        self._ends.append(
            (self._bytes, sum(len(instruction.points) for instruction in protocol.read_instructions(data)))
        )
        if data == protocol.START:
            self.clear_start()
            self.conversation.restarted = False
        elif data.startswith(protocol.PEN_DOWN):
            self._look()  # while it is lowered: one that starts anew between the two draws no more than it has

    def wait(self) -> None:
        """Ask how far it is; if that is hardly farther than before, wait a moment."""
        enough = self.executed + (self.sent - self.executed) // _PARTS
        self._look()
        if self.executed <= enough:
            self._rest()
            if not self._ends and self.executed < self.sent:
                self._place(self._patience)
                self._count_all()

    def finish(self) -> None:
        """Wait until its buffer is empty and it stands, then ask whether it understood every command."""
        while self._ends:
            self._look()
            if len(self._ends) <= 1:  # the question that follows waits for the last one by itself
                break
            self._rest()
        self._check_place()
        self._count_all()
        self._proven = self.sent

    def _check_place(self) -> None:
        """Check, while it stands with its pen lifted, that it understood every command and stands where they lead."""
        x, y, down = self._place(self._patience + _LONGEST)
        status = int(self.conversation.ask(protocol.STATUS)[0])
        if status & protocol.STARTED:
            self.conversation.restarted = True
            raise DeviceAlarm(STARTED)
        if status & protocol.WRONG:
            error = protocol.error(int(self.conversation.ask(protocol.ERROR)[0]))
            raise DeviceGarbled(
                f"The plotter reports {error}: something was damaged on the way, and what it drew last may be wrong; "
                "check the cable."
            )
        if down or self._pen_position.is_missed(x, y):
            raise DeviceGarbled(
                f"The plotter stands at {x:.0f}, {y:.0f} units{' with its pen down' if down else ''} and not as it was "
                "told: a command came over wrong, and what it drew last may be wrong; check the cable."
            )

    def _rest(self) -> None:
        """Wait a moment when nothing has changed, and see whether somebody holds it."""
        before = self.conversation.time
        self.conversation.read(_MOMENT)
        self.conversation.check_state()
        passed = self.conversation.time - before
        self._still = 0.0 if self.conversation.held else self._still + passed
        self.conversation.pass_time(passed)
        if self._still > self._patience + _LONGEST:
            raise DeviceSilent(
                f"The plotter answers but has not drawn for {self._still:.0f} s: is its paper loaded, is it remote?"
            )

    def _count_all(self) -> None:
        """Count everything as executed: it stands with nothing left to do."""
        self._ends.clear()
        self._read = self._bytes
        self._read_moves.clear()
        self.executed = self.taken = self.sent
        self.queued = 0

    def position(self) -> tuple[float, float] | None:
        """Where it stands once the vector under way is done, machine coordinates, mm; None if it was switched off."""
        if self.conversation.restarted:
            return None
        x, y, _ = self._place(self._patience)
        per_mm = self.profile.limits.steps_per_mm
        return x / per_mm, y / per_mm

    def _stop_and_lift(self) -> None:
        """Drop what waits in its buffer and lift the pen; the vector under way is drawn to its end."""
        self.conversation.patience = min(self.conversation.patience, self.hurry)  # on hold its pen is lifted
        with contextlib.suppress(DeviceSilent):
            self.drop()
        self.port.write(protocol.PEN_UP)
        if self._place(self._patience)[2]:
            self._pen_not_lifted()
            return
        wrong = self.conversation.ask(protocol.ERROR) != (0,)
        self.spoilt = wrong and not self.conversation.restarted  # which leaves half an instruction
        if self.conversation.restarted:
            self.port.write(protocol.START)  # whoever asks next is to hear of it too

    def home(self) -> None:
        """A plotter knows its zero from the moment its paper is loaded."""

    def zero(self) -> None:
        """Its zero is on its paper and cannot be elsewhere."""

    def go(self, x: float, y: float) -> None:
        """Travel in absolute coordinates, which a stroke that was stopped has left switched off."""
        self.port.write(protocol.PEN_UP + protocol.ABSOLUTE + protocol.travel(x, y, self.profile))
        self._place(self._patience)
        self.conversation.restarted = False

    def pen(self, down: bool) -> None:
        """Fetch a pen before it is lowered."""
        self.port.write(protocol.fetch_pen(self.profile) + protocol.PEN_DOWN if down else protocol.PEN_UP)
        self._place(self._patience)

    def jog(self, dx: float, dy: float) -> None:
        """Travel relative to where it stands, which it always knows."""
        x, y, _ = self._place(self._patience)
        per_mm = self.profile.limits.steps_per_mm
        there = (x / per_mm + dx, y / per_mm + dy)
        bed.check(np.array([there]), self.profile, "a shorter way")  # it would stop at its edge, without a word
        self.go(*there)

    def release(self) -> None:
        """InputError: there is no instruction for it."""
        raise InputError("An HP-GL plotter has no command that switches its motors off: use its own switch.")

    def clear_start(self) -> None:
        """Clear the sign of a start: a plotter that shows it again has been off in between."""
        self.conversation.restarted = bool(int(self.conversation.ask(protocol.STATUS)[0]) & protocol.STARTED)

    def drop(self) -> None:
        """Empty its buffer."""
        self.port.write(protocol.ABORT)
        self._ends.clear()
        self.conversation.forget()
        self._room = int(self.conversation.ask(protocol.SPACE)[0]) - self._reserve

    def _look(self) -> None:
        """Ask for the free bytes, and now and then whether some were lost."""
        self._asked += 1
        if self._asked % _CHECKED == 0:
            self.conversation.check_line()
        free = int(self.conversation.ask(protocol.SPACE)[0])
        read, self._read = self._read, max(self._read, self._bytes - max(self.size - free, 0))
        self._still = self._still if read == self._read else 0.0
        while self._ends and self._ends[0][0] <= self._read:
            self._read_moves.append(self._ends.popleft()[1])
        # of the instructions that were read the last may be under way; those before it are read to their ends, and of
        # their moves one may be under way and `port.queue` may wait
        while sum([*self._read_moves][1:-1]) > self.profile.port.queue:
            self._read_moves.popleft()
        self.taken, self.queued = self.sent, sum(moves for _, moves in self._ends)
        self.executed = self.sent - len(self._ends) - len(self._read_moves)
        self._room = free - self._reserve if self._ends else max(free - self._reserve, min(free, _FITS))

    def _place(self, patience: float) -> tuple[float, ...]:
        """Answer of OA: x, y in plotter units and whether the pen is down; it may have to finish a line before."""
        return self.conversation.ask(protocol.POSITION, patience, 3)

    @property
    def _patience(self) -> float:
        """How long to wait for an answer that comes when it stands, s; it may fetch a pen first."""
        return self.conversation.timeout + float(self.profile.hpgl.pen_time) + _LAST_LINE

    @property
    def _reserve(self) -> int:
        return min(_RESERVE, self.size // 4)


def _limit_profile(profile: Plotter, limits: tuple[float, ...], size: int, log: Log) -> Plotter:
    """The profile with the size of the plotter's buffer, and its bed where that is smaller."""
    bed = profile.bed
    per_mm = profile.limits.steps_per_mm
    left, low, right, high = (limit / per_mm for limit in limits)
    centred = bed.origin == "centre"
    width, height = (right - left, high - low) if centred else (right, high)
    if width < bed.width - 0.5 or height < bed.height - 0.5:
        log(f"The plotter reaches {width:.0f} × {height:.0f} mm, less than the profile says: is this its paper?")
        lengths = {"width": Length(min(width, bed.width)), "height": Length(min(height, bed.height))}
        bed = msgspec.structs.replace(bed, **lengths)
    return msgspec.structs.replace(profile, bed=bed, port=msgspec.structs.replace(profile.port, buffer=size))
