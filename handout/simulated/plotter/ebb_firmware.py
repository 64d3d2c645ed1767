"""The simulated EBB: what it does with commands, and what it answers, by the version of its firmware."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from handout.profiles import Plotter
from handout.simulated.plotter.ebb_engine import (
    Accumulators,
    Engine,
    Move,
    QueuedCommand,
    by_steps,
    by_time,
    constant_rate,
)
from handout.simulated.plotter.firmware import Firmware, Framing, Say, Wait, Wire
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper

_DEFAULT = (2, 8, 1)  # if no other version is asked for
# since when each command is known; all others are of the first versions
_SINCE = {
    "XM": (2, 3, 0), "LM": (2, 5, 3), "LT": (2, 7, 0), "HM": (2, 6, 2), "QM": (2, 4, 4), "ES": (2, 2, 7),
    "QS": (2, 4, 3), "CS": (2, 4, 3), "SR": (2, 6, 0), "QC": (2, 2, 3), "QG": (2, 6, 1), "QE": (2, 8, 0),
    "QB": (1, 9, 2), "S2": (2, 2, 0),
}  # fmt: skip
_MOTION = ("SM", "XM", "LM", "LT", "HM")
_PLOTS = frozenset({*_MOTION, "SP", "S2"})
_MODES = {1: 16, 2: 8, 3: 4, 4: 2, 5: 1}
_LONGEST_FIFO = 32  # commands (CU,4), by the board's documentation
_PRESSED_AGAIN = 20.0  # s


class Refused(Exception):
    """A command the board answers with an error."""


class EbbFirmware(Firmware):
    """One board.

    version : of its firmware, by the option `firmware`; uniform : whether answers are in one form (``CU,10,1``).
    """

    @staticmethod
    def framing() -> Framing:
        """Commands end with CR; USB makes the sender wait while the board does not read."""
        return Framing(b"\r", blocks=True)

    def __init__(self, profile: Plotter, options: SimulatorOptions, wire: Wire, paper: DrawnPaper, say: Say) -> None:
        self.profile, self._say = profile, say
        self.version = _DEFAULT
        if options.firmware:
            major, minor, patch = (int(part) for part in (options.firmware + ".0.0").split(".")[:3])
            self.version = major, minor, patch
        paper.steps[0] *= 2  # motors that are mixed stand in half steps
        paper.steps[1] *= 2
        old = self.version < (2, 7, 0)
        self.engine = Engine(profile, paper, 1, 1 if old else 0, options.motors)
        self.powered = options.motors
        self.read_time = 0.0003
        self.uniform = False
        self._until_pressed = options.after if options.fault == "button" else -1
        self._presses: list[float] = []  # when its button is pressed and nobody has heard of it yet
        self._settings: dict[int, int] = {}
        self._mode = 1
        self._moves: dict[str, Callable[[list[int]], QueuedCommand]] = {
            "SM": self._sm, "XM": self._xm, "LM": self._lm, "LT": self._lt, "HM": self._hm
        }  # fmt: skip
        self._answers: dict[str, Callable[[list[int]], str]] = {
            "QC": lambda _: f"0394,{'0300' if self.powered else '0150'}",
            "QS": lambda _: "{},{}".format(*self.engine.count_steps(self.now)),
            "QE": lambda _: "{},{}".format(*(_MODES[self._mode] * on for on in self.engine.enabled)),
            "QP": lambda _: str(int(self.engine.told_up)),
            "QB": lambda _: str(int(self._was_pressed())),
            "ES": self._es,
        }

    def start(self) -> None:
        """Power comes on."""
        self.engine.begin(self.now)
        self._limited = False  # it has stopped at a limit switch
        self.engine.depth, self.uniform, self._mode = 1, False, 1
        self._settings = {4: 12000, 5: 16000, 8: 8, 11: 0, 12: 0}
        self.engine.channels = 8
        self.engine.servo = 12000

    def stop(self) -> None:
        """Power goes off."""
        self.engine.stop(self.now, True)

    def counts(self, line: bytes) -> bool:
        """Whether it moves carriage or pen."""
        return line[:2].decode("latin-1").upper() in _PLOTS

    @property
    def resting(self) -> bool:
        return not self.engine.busy

    @property
    def next_event(self) -> float:
        return self.engine.ends

    def step(self) -> None:
        """The command under way ends."""
        self.engine.finish()

    def ready(self, wait: str) -> bool:
        """Whether the queue has "room", or the motors are at "rest"."""
        return self.engine.room if wait == "room" else not self.engine.busy

    def press(self) -> None:
        """Someone presses its button, and again after a while."""
        self._presses = [self.now, self.now + _PRESSED_AGAIN]

    def _was_pressed(self) -> bool:
        """Whether it has been pressed since it was asked last."""
        before, self._presses = self._presses, [at for at in self._presses if at > self.now]
        return len(self._presses) < len(before)

    def refuse(self) -> None:
        """A step rate it cannot make."""
        self._error("", "!0 Err: <axis1> step rate > 25K steps/second.")

    def alarm(self) -> None:
        """A limit switch is hit (which boards have since 3.0): motion is ignored until that is cleared."""
        if self.engine.stop(self.now, True):
            self.engine.slip()
        self._limited = True
        self._say_text("Limit switch triggered. PortB=0E\n")

    def execute(self, line: bytes) -> Iterator[Wait]:
        """Obey a command and answer."""
        text = line.decode("latin-1").strip().upper()
        if not text:
            return
        name, *fields = text.split(",")
        # somebody presses the button after so many commands that move something
        if name in _PLOTS and self._until_pressed >= 0:
            self._until_pressed -= 1
            if self._until_pressed < 0:
                self.press()
        try:
            numbers = [_number(field) for field in fields]
            if self.version < _SINCE.get(name, (0, 0, 0)):
                raise Refused(_unknown(name))
            yield from self._obey(name, numbers)
        except Refused as refusal:
            self._error(name, str(refusal))

    def _obey(self, name: str, numbers: list[int]) -> Iterator[Wait]:
        if name in self._moves and self._limited:
            yield self._parsing(name)
        elif name in self._moves:
            yield self._parsing(name)
            job = self._moves[name](numbers)
            if name == "HM":
                yield "rest"
                job = self._hm(numbers)
            yield "room"
            self.engine.add(job, self.now)
        elif name in ("SP", "S2"):
            yield "room"
            self.engine.add((self._sp if name == "SP" else self._s2)(numbers), self.now)
        elif name == "CU" and numbers[:1] == [4] and self.version >= (3, 0, 0):
            yield "rest"
            self.engine.depth = min(max(numbers[1], 1), _LONGEST_FIFO)
        elif name == "EM" and self.version >= (2, 8, 0):
            yield "room"
            self.engine.add(QueuedCommand(enable=self._em(numbers)), self.now)
        else:
            self._at_once(name, numbers)
            return
        self._ok(name)

    def _parsing(self, name: str) -> float:
        """How long it takes to work out a move, s: the shortest moves that can follow on each other without a gap."""
        if self.version < (2, 7, 0):
            return 0.004
        return 0.003 if self.version < (3, 0, 0) else (0.002 if name in ("SM", "XM") else 0.004)

    def _at_once(self, name: str, numbers: list[int]) -> None:
        """What does not go through the queue."""
        if name in self._answers:
            answer = self._answers[name](numbers)
            if self.uniform:
                self._say_text(f"{name},{answer}\n")
            else:
                self._say_text(answer + ("\r\n" if name in ("QC", "QE") else "\n\r") + "OK\r\n")
        elif name == "V":
            version = ".".join(map(str, self.version))
            self._say_text(
                ("V," if self.uniform else "") + f"EBBv13_and_above EB Firmware Version {version}" + self._end
            )
        elif name == "QM":
            self._say_text("QM,{},{},{},{}".format(*self._flags()) + ("\n" if self.uniform else "\n\r"))
        elif name == "QG":
            command, first, second, queue = self._flags()
            byte = self._was_pressed() << 5 | self.engine.pen_up << 4 | command << 3 | first << 2 | second << 1 | queue
            self._say_text(("QG," if self.uniform else "") + f"{byte:02X}" + self._end)
        elif name in ("SC", "CU", "EM", "CS", "SR"):
            self._set_values(name, numbers)
            self._ok(name)
        else:
            raise Refused(_unknown(name))

    def _set_values(self, name: str, numbers: list[int]) -> None:
        if name != "CS" and len(numbers) < (1 if name in ("EM", "SR") else 2):
            raise Refused("!4 Err: Missing parameter(s)")
        if name == "SC":
            self._settings[numbers[0]] = numbers[1]
            self.engine.channels = self._settings[8]
            if numbers[0] == 10:
                self._settings[11] = self._settings[12] = numbers[1]
        elif name == "CU" and numbers == [51, 0]:
            self._limited = False
        elif name == "CU" and numbers[0] == 10 and self.version >= (3, 0, 0):
            self.uniform = numbers[1] == 1
        elif name == "CS":
            self.engine.clear()
        elif name == "EM":
            self.engine.switch(self._em(numbers))

    @property
    def _end(self) -> str:
        return "\n" if self.uniform else "\r\n"

    def _say_text(self, text: str) -> None:
        self._say(text.encode("latin-1"))

    def _ok(self, name: str) -> None:
        self._say_text(name + "\n" if self.uniform else "OK\r\n")

    def _error(self, name: str, text: str) -> None:
        if self.uniform:
            self._say_text((f"{name}," if name else "") + text + "\n")
        else:
            self._say_text(text + ("\r\nOK\r\n" if self.version >= (3, 0, 0) else "\n\r"))

    def _flags(self) -> tuple[int, int, int, int]:
        """Whether a command, motor 1, motor 2 are at work, and whether commands wait."""
        first, second = self.engine.moving(self.now)
        return int(self.engine.busy), int(first), int(second), int(bool(self.engine.queue))

    def _es(self, numbers: list[int]) -> str:
        was = self.engine.stop(self.now, self.version >= (3, 0, 0))
        if numbers[:1] == [1] and self.version >= (2, 8, 0):
            self.engine.switch((0, 0))
        short = self.version < (2, 2, 9) or self.version >= (3, 0, 0)
        return f"{int(was)}" if short else f"{int(was)},0,0,0,0"

    def _em(self, numbers: list[int]) -> tuple[int, int]:
        self._limited = False
        mode = numbers[0]
        two = numbers[1] if len(numbers) > 1 else int(self.engine.enabled[1])
        self._mode = mode if mode in _MODES else self._mode
        if self.version >= (2, 6, 2):
            self.engine.clear()
        if self.version >= (2, 7, 0):
            self.engine.accumulators.clear(3)
        return mode, two

    def _sp(self, numbers: list[int]) -> QueuedCommand:
        if not numbers:
            raise Refused("!4 Err: Missing parameter(s)")
        up = numbers[0] != 0
        place, rate = self._settings[4 if up else 5], self._settings[11 if up else 12]
        port = numbers[2] if len(numbers) > 2 else 1
        moves = port == (2 if self.profile.pen.servo == "brushless" else 1)
        return QueuedCommand(
            ticks=25 * (numbers[1] if len(numbers) > 1 else 0), servo=(place, rate) if moves else None, lifts=up
        )

    def _s2(self, numbers: list[int]) -> QueuedCommand:
        if len(numbers) < 2:
            raise Refused("!4 Err: Missing parameter(s)")
        place, pin, rate, delay = (*numbers, 0, 0)[:4]
        if not 0 <= pin <= 24:
            raise Refused("!6 Err: Invalid parameter value")
        pen = 5 if self.profile.pen.servo == "brushless" else 4  # another servo than the pen's moves nothing here
        return QueuedCommand(ticks=25 * delay, servo=(place, rate) if pin == pen else None, lifts=self.engine.told_up)

    def _sm(self, numbers: list[int]) -> QueuedCommand:
        if len(numbers) < 2:
            raise Refused("!4 Err: Missing parameter(s)")
        ms, first, second = (*numbers, 0)[:3]
        if ms <= 0:
            raise Refused("!6 Err: Invalid parameter value")
        if first == second == 0:
            return QueuedCommand(ticks=25 * ms)
        if self.version < (3, 0, 0):
            for axis, steps in (("axis1", abs(first)), ("axis2", abs(second))):
                if steps // ms > 25:
                    raise Refused(f"!0 Err: <{axis}> step rate > 25K steps/second.")
                if steps and ms // 1311 >= steps:
                    raise Refused(f"!0 Err: <{axis}> step rate < 1.31Hz.")
        exact = self.version >= (3, 0, 0)
        rates = (constant_rate(abs(first), ms, exact), constant_rate(abs(second), ms, exact))
        clear = numbers[3] if len(numbers) > 3 and exact else 0
        return self._steps((first, second), rates, (0, 0), clear)

    def _xm(self, numbers: list[int]) -> QueuedCommand:
        if len(numbers) < 3:
            raise Refused("!4 Err: Missing parameter(s)")
        ms, a, b = numbers[:3]
        return self._sm([ms, a + b, a - b])

    def _hm(self, numbers: list[int]) -> QueuedCommand:
        if not numbers or not 2 <= numbers[0] <= 25000:
            raise Refused("!6 Err: Invalid parameter value")
        there = numbers[1:3] if len(numbers) >= 3 else [0, 0]
        first, second = (goal - at for goal, at in zip(there, self.engine.count_steps(self.now), strict=True))
        ms = max(10, 1000 * max(abs(first), abs(second)) // numbers[0])
        return self._sm([ms, first, second]) if first or second else QueuedCommand()

    def _lm(self, numbers: list[int]) -> QueuedCommand:
        if len(numbers) < 6:
            raise Refused("!4 Err: Missing parameter(s)")
        r1, s1, a1, r2, s2, a2 = numbers[:6]
        clear = numbers[6] if len(numbers) > 6 and self.version >= (2, 7, 0) else 0
        return self._steps((s1, s2), (r1, r2), (a1, a2), clear)

    def _steps(
        self, steps: tuple[int, int], rates: tuple[int, int], gains: tuple[int, int], clear: int
    ) -> QueuedCommand:
        def motion(accumulators: Accumulators) -> Move:
            accumulators.clear(clear)
            return by_steps(steps, rates, gains, accumulators.left, self.version >= (2, 7, 0))

        return QueuedCommand(motion)

    def _lt(self, numbers: list[int]) -> QueuedCommand:
        if len(numbers) < 5:
            raise Refused("!4 Err: Missing parameter(s)")
        ticks, r1, a1, r2, a2 = numbers[:5]
        clear, signed = (numbers[5] if len(numbers) > 5 else 0), self.version >= (3, 0, 0)
        falling = (signed and _falls(r1, a1), signed and _falls(r2, a2))

        def motion(accumulators: Accumulators) -> Move:
            accumulators.clear(clear, falling)
            return by_time(ticks, (r1, r2), (a1, a2), accumulators.left, signed)

        return QueuedCommand(motion) if ticks else QueuedCommand()


def _falls(rate: int, gain: int) -> bool:
    """Whether a motor counts down at first."""
    return rate < 0 or (rate == 0 and gain < 0)


def _number(field: str) -> int:
    if not field:
        raise Refused("!4 Err: Missing parameter(s)")
    digits = field[1:] if field[0] in "+-" else field
    stray = next((char for char in digits if char not in "0123456789"), None)
    if stray is not None or not digits:
        raise Refused(f"!5 Err: Need comma next, found: '{stray}'")
    if not -(2**31) <= int(field) < 2**32:
        raise Refused("!6 Err: Invalid parameter value")
    return int(field)


def _unknown(name: str) -> str:
    return f"!8 Err: Unknown command '{name[:2]}:{name[:2].encode('latin-1').hex().upper()}'"
