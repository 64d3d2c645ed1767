"""A simulated pen plotter of the eighties: HP-GL over RS-232, a small buffer, a pen carousel, a front panel.

Source: Hewlett-Packard 1983, HP 7475A, and the same of the 7470A: instructions and errors, the answers to OA, OE, OH,
OI, OS, the bits of OS and ESC.O, ESC.K dropping what is buffered, pens lifted where a line leaves the hard-clip limits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator

from handout.profiles import Plotter
from handout.simulated.plotter.firmware import Firmware, Framing, Say, Wait, Wire
from handout.simulated.plotter.hpgl_carriage import Carriage, CarriageLimits, Point
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.paper import DrawnPaper

_NAME = re.compile(r"[A-Za-z]{2}")
_REST = re.compile(r"[^A-Za-z;]*")
_SIGNED = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)")
_GREATEST = 32767  # of a coordinate, by the manuals


class Wrong(Exception):
    """What the plotter keeps as its last error: 1 unknown, 2 number of parameters, 3 out of range."""

    def __init__(self, number: int) -> None:
        super().__init__(str(number))
        self.number = number


def split_instructions(data: bytes) -> list[tuple[str, str]]:
    """Split bytes into instructions, each with name and parameters; what is no instruction has the name ""."""
    text = data.decode("latin-1").replace("\r", "").replace("\n", "")
    instructions, at = [], 0
    while at < len(text):
        if text[at] in "; ":
            at += 1
            continue
        name = _NAME.match(text, at)
        if name is None:
            instructions.append(("", text[at]))
            at += 1
            continue
        rest = _REST.match(text, name.end())
        assert rest is not None
        instructions.append((name.group().upper(), rest.group()))
        at = rest.end()
    return instructions


def values(text: str) -> list[float]:
    """Parameters as numbers; raises `Wrong`."""
    parts = [part.strip() for part in text.replace(" ", ",").split(",") if part.strip()]
    if not all(_SIGNED.fullmatch(part) for part in parts):
        raise Wrong(1)
    numbers = [float(part) for part in parts]
    if any(abs(number) > _GREATEST for number in numbers):
        raise Wrong(3)
    return numbers


def read_places(numbers: list[float]) -> tuple[list[tuple[int, int]], bool]:
    """Coordinates in whole units, and whether one was left over."""
    whole = [math.floor(number) for number in numbers]
    return list(zip(whole[::2], whole[1::2], strict=False)), len(whole) % 2 == 1


_ESCAPE = 0x1B  # of device control instructions
_WITH_PARAMETERS = frozenset(b"@HIMN")
_PARAMETER = frozenset(b"0123456789;")


class Escapes(Framing):
    """Instructions end with a semicolon; ``ESC .`` and a letter, some with parameters up to a colon, never wait."""

    def __init__(self) -> None:
        super().__init__(b";")
        self._held = b""  # of a device control instruction that is not complete

    def cut_pieces(self, data: bytes) -> Iterator[tuple[bytes, bool]]:
        plain = b""
        for value in data:
            byte = bytes([value])
            if self._held:
                self._held += byte
                if _complete(self._held):
                    yield self._held, True
                    self._held = b""
            elif value == _ESCAPE:
                if plain:
                    yield plain, False
                plain, self._held = b"", byte
            else:
                plain += byte
                if byte == b";":
                    yield plain, False
                    plain = b""
        if plain:
            yield plain, False


def _complete(control: bytes) -> bool:
    """Whether a device control instruction ends with the last of these bytes, rightly or not."""
    if len(control) == 2:
        return control[1:] != b"."
    if len(control) == 3:
        return control[2] not in _WITH_PARAMETERS
    return control[-1] not in _PARAMETER


_MODEL = "7475A"
_DOWN, _INITIALISED, _READY, _WRONG = 1, 8, 16, 32  # bits of OS
_EMPTY, _VIEWING, _LEVER = 8, 16, 32  # bits of ESC.O
_VIEWED = 3.0  # s that VIEW is pressed


class HpglFirmware(Firmware):
    """One plotter.

    error, line_error : the last error of the language and of the line, 0 for none.
    lever : whether the paper lever is raised, so that nothing is drawn.
    viewing : until when VIEW is pressed, s.
    """

    acknowledgement = b""  # there is no ok: a plotter says nothing but what it is asked

    @staticmethod
    def framing() -> Framing:
        """How it cuts what it receives into instructions."""
        return Escapes()

    def __init__(self, profile: Plotter, options: SimulatorOptions, wire: Wire, paper: DrawnPaper, say: Say) -> None:
        self.profile, self.wire, self.paper, self._out = profile, wire, paper, say
        per_mm = paper.steps[0]
        push = (options.acceleration or profile.limits.acceleration) * per_mm
        cut = profile.limits.junction_deviation * per_mm
        queue = options.queue or profile.port.queue
        self.carriage = Carriage(push, cut, queue)
        self.limits = CarriageLimits(profile, per_mm)
        self.read_time = float(profile.port.line_time)
        self.error = self.line_error = 0
        self.lever = False
        self.viewing = -math.inf
        self._lost = self._obeyed = 0
        self._viewed = options.after if options.fault == "view" else -1
        self._fastest = options.speed or float(profile.limits.draw_speed)
        self._asked: Point = (0, 0)  # where it was told to go, which may be out of reach
        self._initialised = True
        self._ending = b"\r"  # of answers
        self._lifts = 0.0  # s that it is at its pen before it reads the first instruction
        self._controls: dict[bytes, Callable[[bytes], None]] = {  # of the device control instructions
            b"B": lambda _: self._say(self.wire.room - 1),
            b"L": lambda _: self._say(self.wire.size - 1),
            b"E": lambda _: self._say_line_error(),
            b"O": lambda _: self._say_state(),
            b"M": self._end_answers,
            b"R": lambda _: self._end_answers(b""),
        }
        self._defaults()
        self._pen_down = False

    def _defaults(self) -> None:
        self._relative, self._speed, self._wants_down, self._pen = False, self._fastest, False, 0
        self._rotate(0)

    def start(self) -> None:
        """It finds its zero on the paper by itself when it is switched on, and the pen is lifted."""
        self._defaults()
        self._lift(False)
        self._lifts = float(self.profile.pen.up_time)
        self._ending = b"\r"
        self.error, self.line_error, self._initialised, self.lever = 0, 0, True, False

    def stop(self) -> None:
        """Power goes off."""
        self.carriage.stop()

    def counts(self, line: bytes) -> bool:
        """Questions are no part of a plot."""
        return any(not name.startswith("O") for name, _ in split_instructions(line))

    @property
    def resting(self) -> bool:
        """Whether it stands still."""
        return not self.carriage.moving and not self.carriage.waiting

    @property
    def next_event(self) -> float:
        """When the carriage gets to the next place, or VIEW is released, s."""
        return min(self.carriage.next_event, self.viewing if self.viewing > self.now else math.inf)

    def step(self) -> None:
        """The carriage gets to the next place, or VIEW is released."""
        if self.carriage.next_event <= self.now:
            self.carriage.arrive()
            self._mark()

    def _mark(self) -> None:
        """The paper remembers where the carriage is now."""
        x, y = self.limits.bare(self.carriage.at)
        self.paper.move_to(self.now, (x, y, self.paper.place[2]))

    def ready(self, wait: str) -> bool:
        """Whether there is room for a vector, the carriage stands, or plotting may go on."""
        if wait == "going":
            return self.viewing <= self.now and not self.lever
        return not self.carriage.full if wait == "room" else self.resting

    def refuse(self) -> None:
        """Answer an instruction that it does not know."""
        self.error = 1

    def alarm(self) -> None:
        """Someone raises the paper lever."""
        self.lever = True

    def view(self, seconds: float = _VIEWED) -> None:
        """Someone presses VIEW, and again after a while."""
        self.viewing = self.now + seconds

    def hold(self) -> None:
        """VIEW is pressed, and not again."""
        self.view(math.inf)

    def urgent(self, data: bytes) -> bool:
        """Obey device control; ESC.K drops the buffer and what is left of the instruction under way."""
        if len(data) < 3 or data[1:2] != b".":
            self.line_error = 11
            return False
        letter, parameters = data[2:3], data[3:]
        if parameters and not parameters.endswith(b":"):
            self.line_error = 12
        if self.wire.lost > self._lost:
            self._lost, self.line_error = self.wire.lost, 16
        if letter in self._controls:
            self._controls[letter](parameters)
        elif letter not in b"K@HIJN()YZ":
            self.line_error = 11
        return letter == b"K"

    def _say_line_error(self) -> None:
        self._say(self.line_error)
        self.line_error = 0

    def _say_state(self) -> None:
        empty = _EMPTY if self.wire.room == self.wire.size else 0
        self._say(empty + _VIEWING * (self.viewing > self.now) + _LEVER * self.lever)

    def _end_answers(self, parameters: bytes) -> None:
        """ESC.M: the fourth parameter is the byte that ends an answer."""
        ending = b"".join(parameters.rstrip(b":").split(b";")[3:4]) or b"13"
        if ending.isdigit() and int(ending) < 256:
            self._ending = bytes([int(ending)])
        else:
            self.line_error = 12

    def _say(self, *numbers: int) -> None:
        self._out(",".join(map(str, numbers)).encode("ascii") + self._ending)

    def execute(self, line: bytes) -> Iterator[Wait]:
        """Obey all instructions up to a semicolon."""
        if self._lifts:
            wait, self._lifts = self._lifts, 0.0
            yield wait
        self._obeyed += 1
        if self._viewed == self._obeyed:
            self.view()
        for name, text in split_instructions(line):
            yield "going"
            try:
                yield from self._obey(name, values(text))
            except Wrong as wrong:
                self.error = wrong.number

    def _obey(self, name: str, values: list[float]) -> Iterator[Wait]:
        if name in ("PU", "PD", "PA", "PR"):
            yield from self._plot(name, values)
        elif name == "VS":
            if values and not 0 <= values[0] < 128:
                raise Wrong(3)
            step = float(self.profile.hpgl.speed_step)  # it has whole steps of velocity
            wanted = max(round(values[0] * 10.0 / step), 1) * step if values else self._fastest
            self._speed = min(wanted, self._fastest)
        elif name == "SP":
            yield "rest"
            yield from self._lower(False)
            if int(values[0] if values else 0) != self._pen:
                self._pen = int(values[0] if values else 0)
                yield float(self.profile.hpgl.pen_time)
        elif name in ("IN", "DF"):
            yield "rest"
            yield from self._lower(False)
            pen = self._pen
            self._defaults()
            self._pen, self.error, self._initialised = pen, 0, True
        elif name == "RO":
            yield "rest"
            self._rotate(int(values[0]) if values else 0)
        elif name in ("OA", "OC", "OE", "OH", "OI", "OS"):
            yield "rest"
            self._answer(name)
        elif name not in ("IP", "IW", "SC", "CA", "CS", "LT", "PT", "AS", "FS"):
            raise Wrong(1)

    def _rotate(self, degrees: int) -> None:
        if degrees not in (0, 90, 180, 270):
            raise Wrong(3)
        bare = self.limits.bare(self.carriage.at)
        self.limits.rotate(degrees)
        self.carriage.at = self._asked = self.limits.turn_back(bare)

    def _answer(self, name: str) -> None:
        x, y = self.carriage.at
        if name == "OA":
            self._say(x, y, int(self._pen_down))
        elif name == "OC":
            self._say(*self._asked, int(self._wants_down))
        elif name == "OE":
            self._say(self.error)
            self.error = 0
        elif name == "OH":
            self._say(*self.limits.corners)
        elif name == "OS":
            wrong = _WRONG * bool(self.error)
            self._say(_DOWN * self._pen_down + _INITIALISED * self._initialised + _READY + wrong)
            self._initialised = False
        else:
            self._out(_MODEL.encode() + self._ending)

    def _plot(self, name: str, values: list[float]) -> Iterator[Wait]:
        if name in ("PU", "PD"):
            self._wants_down = name == "PD"
            if self._wants_down != self._pen_down:
                yield "rest"
                if not self._wants_down or self.limits.inside(self._asked):
                    yield from self._lower(self._wants_down)
        else:
            self._relative = name == "PR"
        places, odd = read_places(values)
        for x, y in places:
            target = (self._asked[0] + x, self._asked[1] + y) if self._relative else (x, y)
            yield "going"
            yield from self._line(target)
        if odd:
            raise Wrong(2)

    def _line(self, target: Point) -> Iterator[Wait]:
        """Draw or go to a place, with the pen lifted and the carriage at rest where the way leads out of reach."""
        before, self._asked = self._asked, target
        visible = self.limits.clip_line(before, target)
        if visible is None:
            return
        enters, leaves = visible
        if enters != self.carriage.end:
            yield "rest"
            yield from self._lower(False)
            self._go(enters)
        if self._wants_down and not self._pen_down:
            yield "rest"
            yield from self._lower(True)
        if self.carriage.full:
            yield "room"
        self._go(leaves)
        if leaves != target and self._pen_down:
            yield "rest"
            yield from self._lower(False)

    def _go(self, place: Point) -> None:
        speed = self._speed if self._pen_down else float(self.profile.limits.travel_speed)
        if not self.carriage.moving:
            self._mark()
        self.carriage.add(place, speed * self.paper.steps[0])
        self.carriage.start(self.now)

    def _lower(self, down: bool) -> Iterator[Wait]:
        """Move the pen, if it is not there, and wait for it."""
        if down != self._pen_down:
            self._lift(down)
            yield float(self.profile.pen.down_time if down else self.profile.pen.up_time)

    def _lift(self, down: bool) -> None:
        self._pen_down = down
        self.paper.pen(self.now, self.profile.pen.down if down else self.profile.pen.up)
