"""What the dialects of G-code share: numbers, the pen, and the comments that a file begins with."""

from __future__ import annotations

import unicodedata
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import ClassVar

from handout import units
from handout.plotting import pen_lift
from handout.plotting.dialects import Block, Command, MoveBlock, Pause, PenBlock, UserLines
from handout.plotting.planning.plan import Plan
from handout.profiles import PenLift as PenProfile
from handout.profiles import Plotter

_LONGEST = 69  # characters of a line; some senders and controllers count those of comments too


def header(plan: Plan, profile: Plotter) -> list[bytes]:
    """Lines of comments that say what a program is."""
    about, page = plan.drawing.about, plan.drawing.page
    facts = [("title", about.get("title")), ("hand", about.get("hand")), ("seed", about.get("seed"))]
    turned = f", turned: its top lies {plan.placement.turned}" if plan.placement.turned else ""
    facts += [
        ("page", f"{page.name} {page.width:g} x {page.height:g} mm{turned}"),
        ("machine", profile.name or profile.title),
        ("zero", f"{profile.bed.origin} of the page, pen lifted"),
        ("time", units.duration(plan.duration)),
        ("pen", f"{plan.pen_down / 1000:.2f} m drawn, {plan.pen_up / 1000:.2f} m travelled"),
    ]
    written = [f"; {name}: {comment(str(value))}"[:_LONGEST].rstrip() for name, value in facts if value is not None]
    return [b"; written by handout\n", *(line.encode("ascii") + b"\n" for line in written)]


def comment(text: str) -> str:
    """Text made fit for a comment: ASCII, one line, without the bytes that act even in comments.

    ``?``, ``!`` and ``~`` are real-time commands of GRBL even within a comment: "Dear all!" would hold the machine.
    """
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    characters = "".join(" " if char in "\r\n\t" else char for char in plain if char.isprintable() or char in "\r\n\t")
    return " ".join("".join(char for char in characters if char not in "?!~").split())


def number(value: float, digits: int = 3) -> str:
    """A number as short as it can be written."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def move(x: float, y: float, speed: float) -> bytes:
    """A straight move to a place, mm, at a speed in mm/s."""
    return f"G1X{number(x)}Y{number(y)}F{number(speed * 60, 1)}\n".encode()


def pause_ms(seconds: float) -> bytes:
    """Stand still when all motion is done, told in milliseconds."""
    return f"G4P{round(seconds * 1000)}\n".encode()


class Program(ABC):
    """The commands of a plan, from how numbers are meant to a stop that is answered when all motion is done.

    What a controller remembers is not repeated: an axis that does not change, the feed, the pen.

    standing : answered when all motion is done; modes : how numbers are meant, repeated after lines of the user's own
    words : what the controller remembers of the moves before, by letter.
    """

    standing: ClassVar[bytes] = b"M400\n"
    modes: ClassVar[tuple[bytes, ...]]

    def __init__(self, profile: Plotter, blocks: Sequence[Block]) -> None:
        self.profile, self.blocks = profile, blocks
        self.words: dict[str, str] = {}

    def commands(self) -> Iterator[Command]:
        """All commands; a block is done with the last of its own."""
        yield from (Command(line, 0) for line in self.open())
        down: bool | None = None
        for index, block in enumerate(self.blocks):
            if isinstance(block, PenBlock):
                lowered = pen_lift.lower_to(self.profile.pen, block.value)
                told = self.move_pen(block.down, lowered) if block.down != down else []
                down = block.down
            elif isinstance(block, Pause):
                told = [self.pause(block.seconds)]
            elif isinstance(block, UserLines):
                told = self.obey(block)
            else:
                assert isinstance(block, MoveBlock)  # timed moves are for machines that keep time
                told = self.move(block, index)
            yield from (Command(line, index + (at == len(told))) for at, line in enumerate(told, 1))
        yield from (Command(line, len(self.blocks)) for line in self.close())

    @abstractmethod
    def open(self) -> list[bytes]:
        """How numbers are meant, and the zero if it is where the pen stands."""

    @abstractmethod
    def move_pen(self, down: bool, profile: PenProfile) -> list[bytes]:
        """Lower or lift the pen and wait for it."""

    def pause(self, seconds: float) -> bytes:
        """Stand still when all motion is done."""
        return pause_ms(seconds)

    def obey(self, block: UserLines) -> list[bytes]:
        """Send the user's own lines once the machine stands; they may change all that it remembers."""
        self.words.clear()
        return [self.standing, *(f"{line}\n".encode("ascii") for line in block.lines), *self.modes]

    def move(self, block: MoveBlock, index: int) -> list[bytes]:
        """A straight move to a place."""
        return [self.line(block)]

    def line(self, block: MoveBlock) -> bytes:
        """The line of a move, with only the words that change something."""
        words = {"X": number(block.x), "Y": number(block.y)}
        words |= {} if block.z is None else {"Z": number(block.z)}
        words |= {"F": number(block.feed, 1)}
        changed = "".join(letter + value for letter, value in words.items() if self.words.get(letter) != value)
        self.words |= words
        return f"G1{changed}\n".encode()

    def close(self) -> list[bytes]:
        """Answered when all motion is done; motors stay powered, and the pen lifted."""
        return [self.standing]

    def forget_pen(self) -> None:
        """Forget what moving the pen has changed, or may have: everything, if the lines are the user's own."""
        for letter in {"command": "XYZF", "z": "ZF"}.get(self.profile.pen.lift, ""):
            self.words.pop(letter, None)


def pen(
    down: bool,
    profile: PenProfile,
    *,
    stand: bytes,
    servo: Callable[[float], bytes],
    pause: Callable[[float], bytes],
) -> list[bytes]:
    """Lower or lift the pen and wait for it.

    stand : answered when all motion is done, which lines of the user's own must wait for; servo : moves the servo.
    """
    if profile.lift == "command":
        lines = profile.down_command if down else profile.up_command
        rest = float(profile.down_time if down else profile.up_time)
        return [stand, *(f"{line}\n".encode("ascii") for line in lines), *([pause(rest)] if rest > 0 else [])]
    commands: list[bytes] = []
    speed = pen_lift.lowering_speed(profile) if down else profile.z_speed
    for value, wait in pen_lift.way(profile, down):
        z = f"G1Z{number(value)}F{number(speed * 60, 1)}\n".encode()
        commands += [z if profile.lift == "z" else servo(value), *([pause(wait)] if wait > 0 else [])]
    return commands
