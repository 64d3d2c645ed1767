"""Finding how high a pen has to be lifted and how low it has to be let down, with a person who looks.

Nothing moves before the person has said so.  The pen is lowered step by step until it touches; then it draws a few
short rows, each a little lower than the one before, and the person chooses the lightest that is whole.  A pen that
gives way then draws deeper rows, for how deep it may go at full pressure.  What was found is kept in a copy of the
profile, whose comments and all else stay as they are; and a plotter can be moved by hand.
"""

from __future__ import annotations

import contextlib
import math
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple, Protocol

import msgspec
import numpy as np

from handout import atomic, profiles, shipped
from handout.errors import DeviceAlarm, DoesNotFit, InputError, reported
from handout.plotting import bed, pen_lift
from handout.plotting.dialects import Controller, Log, dialect
from handout.plotting.driver import Monitor, draw, halting
from handout.plotting.planning.planner import plan
from handout.plotting.ports import Port
from handout.plotting.setup_sheet import line
from handout.profiles import PenLift, Plotter
from handout.values import Array, Drawing, Page, Stroke

ROWS = 5  # that are drawn to choose from: as many as fit on `_PAGE`
_PAGE = Page(70.0, 50.0)  # mm that the rows need
_SPEED = 30.0  # mm/s
_GO = 0.15  # s between two strokes
_STEPS_Z = (1.0, 0.25, 0.05)  # mm
_SHARES = (1 / 8, 1 / 25, 1 / 100)  # of the way between up and down: the steps of a servo
_ROW_Z, _ROW_SHARE = 0.1, 1 / 25  # from one row to the next
_ANY_HEIGHT = (-1000.0, 1000.0)  # mm


class PenSetter(Protocol):
    """Whoever stands at the plotter."""

    def do(self, request: str) -> None:
        """Ask for something, and wait until it is done; InputError if there is nobody to ask."""

    def answer(self, question: str, answers: Mapping[str, str]) -> str:
        """One of the answers, which are told with what they mean."""


class Heights(NamedTuple):
    """What the pen is told, as in the profile: servo values or mm; pressed: None, it was not asked for."""

    up: float
    down: float
    pressed: float | None = None


def check(profile: Plotter) -> None:
    """Raise InputError unless the pen has heights that can be set."""
    pen_lift.lower_at_once(profile.pen, profile.pen.down)


def replace_heights(profile: Plotter, up: float | None, down: float | None) -> Plotter:
    """The profile with other heights of its pen; the range by which a pen follows pressure stays.

    Raises InputError: there are no heights to set, or such as its servo or its Z axis cannot be told.
    """
    check(profile)
    pen = profile.pen
    new_up, new_down = pen.up if up is None else up, pen.down if down is None else down
    steps = Steps(profile)
    for name, value in (("pen up", new_up), ("pen down", new_down)):
        if not steps.least <= value <= steps.greatest:
            raise InputError(
                f"{name}: {in_words(value, profile)} is outside {in_words(steps.least, profile)} to "
                f"{in_words(steps.greatest, profile)} of {profile.title}."
            )
    if new_up == new_down or (steps.lift_z and (new_down > new_up) != (pen.down > pen.up)):
        raise InputError(
            f"The pen would not be lifted: up {in_words(new_up, profile)}, down {in_words(new_down, profile)}; the "
            f"profile has {in_words(pen.up, profile)} and {in_words(pen.down, profile)}."
        )
    pressed = None if pen.pressed is None else round(pen.pressed + new_down - pen.down, 3)
    changed = msgspec.structs.replace(pen, up=new_up, down=new_down, pressed=pressed)
    return msgspec.structs.replace(profile, pen=changed)


def in_words(value: float, profile: Plotter) -> str:
    """A value or a height as a person reads it."""
    if profile.pen.in_mm:
        return f"{value:g} mm"
    values = dialect(profile.dialect).pen_values
    return f"{value:g}" if values is None else values.written(value)


def begin(controller: Controller, port: Port, person: PenSetter, log: Log) -> Bench:
    """Have the machine made ready; it moves only after that."""
    profile = controller.profile
    finds = "It looks for its zero first, then" if profile.homing else "Then"
    where = "" if profile.homing else f" Its carriage has to stand in its zero ({bed.CORNERS[profile.bed.origin]})."
    person.do(
        f"Lay a sheet under the pen, the tip a few mm above it.{where} {finds} the pen goes to "
        f"{in_words(profile.pen.up, profile)}: keep a hand on the switch,"
    )
    return Bench(controller, port, person, log)


class Bench:
    """A machine that is being set up."""

    def __init__(self, controller: Controller, port: Port, person: PenSetter, log: Log) -> None:
        self.controller, self.port, self.person, self.log = controller, port, person, log
        self.at = controller.profile.pen.up
        self._drawn = 0

    @property
    def pen(self) -> PenLift:
        return self.controller.profile.pen

    @contextlib.contextmanager
    def working(self) -> Iterator[None]:
        """Homes; whatever happens, the pen is lifted in the end."""
        controller = self.controller
        with halting(controller):
            if controller.profile.homing:
                controller.home()
            elif controller.profile.bed.zero == "here":
                controller.zero()
            self.go(self.pen.up)
            yield
            self.go(self.pen.up)

    def go(self, value: float) -> None:
        """The pen goes to a value or a height."""
        for data in dialect(self.controller.profile.dialect).set_pen(self.pen, value):
            self.controller.send(data)
        self.controller.finish()
        self.at = value

    def take(self, **heights: float) -> None:
        """From now on the pen is lifted and lowered to these."""
        pen = msgspec.structs.replace(self.pen, pressed=None, **heights)
        self.controller.profile = msgspec.structs.replace(self.controller.profile, pen=pen)

    def row(self, number: int, heights: Heights) -> None:
        """Draw one row at heights to be tried, with as many marks behind it as its number."""
        self.take(up=heights.up, down=heights.down)
        profile = self.controller.profile
        planned = plan(Drawing(tuple(_strokes(number)), _PAGE), profile, whole=(False, False))
        draw(planned, self.controller, self.port, profile, Monitor(log=self.log), fresh=not self._drawn)
        self._drawn += 1
        self.at = heights.up


def _strokes(number: int) -> Iterator[Stroke]:
    """A wave, and marks behind it; times on one clock."""
    y = 4.0 + 8.0 * number
    x = np.linspace(0.0, 34.0, 120)
    wave = np.column_stack([8.0 + x, y + 1.5 * np.sin(x * 2 * math.pi / 8.5)])
    marks = [np.array([[46.0 + 3.0 * mark, y - 1.5], [46.0 + 3.0 * mark, y + 1.5]]) for mark in range(number)]
    clock = 0.0
    for points in [wave, *marks]:
        stroke = line(points, _SPEED)
        yield Stroke(stroke.t + clock, stroke.xy)
        clock += float(stroke.t[-1]) + _GO


class Steps:
    """How far the pen goes at a time, in which direction, and where that ends."""

    def __init__(self, profile: Plotter) -> None:
        pen, span = profile.pen, abs(profile.pen.down - profile.pen.up)
        self.lift_z = pen.lift == "z"
        self.follows = profile.can_press
        self.sign = 1.0 if pen.down > pen.up else -1.0  # of what is nearer to the paper
        self.sizes = _STEPS_Z if pen.in_mm else tuple(dict.fromkeys(max(round(share * span), 1) for share in _SHARES))
        self.row = _ROW_Z if pen.in_mm else max(float(round(_ROW_SHARE * span)), 1.0)
        values = None if pen.in_mm else dialect(profile.dialect).pen_values
        least, greatest = _ANY_HEIGHT if values is None else (values.least, values.greatest)
        self.least, self.greatest = min(least, pen.up, pen.down), max(greatest, pen.up, pen.down)
        self.chosen = 0

    @property
    def size(self) -> float:
        return self.sizes[self.chosen]

    def lower_from(self, value: float, lower: float) -> float | None:
        """A value that is so much lower; None if there is none."""
        value = round(value + self.sign * lower, 3)
        return value if self.least <= value <= self.greatest else None

    def rows(self, first: float) -> Array:
        """(ROWS,) values to draw rows at, the first the lightest."""
        values = first + self.sign * self.row * np.arange(ROWS)
        return np.asarray(np.round(np.clip(values, self.least, self.greatest), 3))


def find(bench: Bench) -> Heights:
    """Find both heights; the pen is lifted in the end."""
    profile = bench.controller.profile
    steps, way = Steps(profile), abs(profile.pen.down - profile.pen.up)
    with bench.working():
        touching = _ask_height(bench, steps, "t", "the pen just touches the paper", may_turn=not steps.lift_z)
        if steps.lift_z:
            bench.log(
                f"The paper is at {touching:g} mm. A Z axis that finds its zero by a switch will find it there again; "
                "one that has none forgets it when it is switched off."
            )
            answers = {"y": "yes: it has no switch, or does not use it", "n": "no"}
            if bench.person.answer("Call this height 0 until it is switched off?", answers) == "y":
                bench.controller.level()
                touching = bench.at = 0.0
        above = steps.lower_from(touching, -way)
        up = (steps.least if steps.sign > 0 else steps.greatest) if above is None else above
        bench.take(up=up, down=touching)
        bench.go(up)
        bench.log("Now how high it is lifted: clear of the paper everywhere, and no higher than it needs.")
        up = _ask_height(bench, steps, "o", "that is right", may_turn=False)
        bench.take(up=up)
        down = _choose_height(bench, steps, touching, up, "Which row is the lightest that is whole?")
        return Heights(up, down, _find_pressed_height(bench, steps, down, up) if steps.follows else None)


def _ask_height(bench: Bench, steps: Steps, done: str, means: str, *, may_turn: bool) -> float:
    """Lower and lift the pen as the person says; where it is when all is well."""
    answers = {"d": "down", "u": "up", "f": "finer steps", "c": "coarser steps", done: means}
    answers |= {"x": "it goes the wrong way round"} if may_turn else {}
    profile = bench.controller.profile
    while True:
        answer = bench.person.answer(f"Pen at {in_words(bench.at, profile)}, steps of {steps.size:g}", answers)
        if answer == done:
            return bench.at
        if answer in ("f", "c"):
            steps.chosen = min(max(steps.chosen + (1 if answer == "f" else -1), 0), len(steps.sizes) - 1)
        elif answer == "x":
            steps.sign = -steps.sign
        elif (there := steps.lower_from(bench.at, steps.size if answer == "d" else -steps.size)) is None:
            bench.log(f"It goes no further than {steps.least:g} to {steps.greatest:g}.")
        else:
            bench.go(there)


def _find_pressed_height(bench: Bench, steps: Steps, down: float, up: float) -> float:
    """How deep the pen goes at full pressure; `down` where nothing gives way."""
    bench.log(
        "Where the pen gives way (a spring in its holder, a soft tip), it can be pressed by going deeper, as a hand "
        "presses. A pen that is clamped hard would be bent; one that lies on the paper by its weight goes no deeper."
    )
    answers = {"s": "it gives way: find how deep it may go", "h": "no, or it goes no deeper"}
    if bench.person.answer("Does the pen give way when it is pushed up?", answers) == "h":
        return down
    first = steps.lower_from(down, steps.row)
    asked = "Which row is as bold as a line at full pressure should be?"
    return down if first is None else _choose_height(bench, steps, first, up, asked)


def _choose_height(bench: Bench, steps: Steps, first: float, up: float, question: str) -> float:
    """Let the person choose from rows, each lower than the one before."""
    answers = {str(n): f"the row with {n} mark{'s'[: n > 1]}" for n in range(1, ROWS + 1)}
    answers |= {"0": "none: press harder", "a": "draw them again"}
    while True:
        values = steps.rows(first)
        bench.person.do(f"{ROWS} rows will be drawn, from {values[0]:g} down to {values[-1]:g}: put in a fresh sheet")
        for number, value in enumerate(values.tolist(), 1):
            bench.row(number, Heights(up, value))
        answer = bench.person.answer(question, answers)
        if answer in "12345":
            return float(values[int(answer) - 1])
        if answer == "0":
            first = float(values[-1])


def draw_trial(bench: Bench, heights: Heights) -> None:
    """Draw one row at heights that are given."""
    bench.take(up=heights.up, down=heights.down)
    with bench.working():
        bench.row(1, heights)


Place = tuple[float, float]
_ZERO = 0.02  # mm; a machine that says it stands in its zero may just have been switched on


def home(controller: Controller) -> None:
    """Lift the pen and go to zero: by its switches, or as it knows the way.

    Raises DeviceAlarm: it has no switches, and does not know where it stands.
    """
    if controller.profile.homing:
        controller.home()
        controller.go(0.0, 0.0)  # some know their zero without going there
    elif controller.position() is None:
        corner = bed.CORNERS[controller.profile.bed.origin]
        raise DeviceAlarm(
            "The plotter does not know where it stands, since it was switched on or has restarted: push its pen above "
            f"its zero by hand, the {corner}."
        )
    else:
        controller.go(0.0, 0.0)


def jog(controller: Controller, dx: float, dy: float) -> None:
    """Lift the pen and travel so far along the machine's axes, mm.

    Raises DoesNotFit: that would leave its bed; of a machine that may not know where it stands, that is longer than its
    bed.
    """
    profile, at = controller.profile, controller.position()
    for way, most, axis in ((dx, profile.bed.width, "x"), (dy, profile.bed.height, "y")):
        if abs(way) > most:
            raise DoesNotFit(f"jog: {way:g} mm along {axis} is more than the bed of {profile.title}, {most:g} mm.")
    if at is not None and max(map(abs, at)) > _ZERO:
        bed.check(np.array([[at[0] + dx, at[1] + dy]]), profile, "a shorter way")
    controller.jog(dx, dy)


def move_and_locate(controller: Controller, move: Callable[[Controller], None]) -> Place | None:
    """Make a move; returns its place then, mm, None if unknown.  If anything goes wrong the pen is lifted."""
    with halting(controller, harmless=(InputError,)):
        move(controller)
    return controller.position()


_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,60}")
_FOUND = "found with: handout pen heights"


def find_copy(name: str, again: bool) -> Path:
    """Where the user's own profile of that name lies.

    Raises InputError: a name that is none, or of a file that is there and may not be replaced.
    """
    if not _NAME.fullmatch(name):
        raise InputError(f"{name!r} cannot name a profile: use letters, digits, - and _, such as my-plotter.")
    path = shipped.user_folder("devices") / f"plotter-{name.removeprefix('plotter-')}.toml"
    if path.exists() and not again:
        raise InputError(f"{path} is there already: give another name, or --again to replace it.")
    return path


def list_changes(heights: Heights, profile: Plotter) -> dict[str, float]:
    """The keys of the group ``[pen]`` that change.

    A pen that follows pressure presses as much deeper as it did, unless that was found, too.
    """
    pen = profile.pen
    keys = {"up": heights.up, "down": heights.down}
    if heights.pressed is not None:
        keys["pressed"] = heights.pressed
    elif pen.pressed is not None:
        keys["pressed"] = round(heights.down + pen.pressed - pen.down, 3)
    return keys


def edit_profile(text: str, keys: dict[str, float]) -> str:
    """A profile's text with other numbers in ``[pen]``; the comments of these lines say where they are from."""
    group, rows = "", list[str]()
    for row in text.splitlines():
        if heading := re.match(r"\s*\[([^\]]*)\]", row):
            group = heading.group(1).strip()
        match = re.match(r"(\s*)(\w+)(\s*=\s*)([-+.\w]+)\s*(?:#\s*(.*))?$", row)
        if group == "pen" and match and match.group(2) in keys:
            was = f"{match.group(4)} before" + (f": {match.group(5)}" if match.group(5) else "")
            number = f"{match.group(1)}{match.group(2)}{match.group(3)}{keys[match.group(2)]:g}"
            row = f"{number:<24} # {_FOUND}; {was}"
        rows.append(row)
        if group == "pen" and match and match.group(2) == "down" and not re.search(r"(?m)^\s*pressed\s*=", text):
            rows += [f"{f'pressed = {keys[name]:g}':<24} # {_FOUND}" for name in keys if name == "pressed"]
    return "\n".join(rows) + "\n"


def check_copy(source: Path, keys: dict[str, float]) -> None:
    """Raise InputError unless a profile can have these numbers, before anything is tried with them."""
    try:
        _try_profile(edit_profile(source.read_text(encoding="utf-8"), keys), source, source, keys)
    except InputError as error:
        raise InputError(str(error).replace(f"{source}: ", "", 1)) from error


def save_copy(source: Path, path: Path, keys: dict[str, float]) -> None:
    """Write the copy, whole and valid, or nothing.

    Raises InputError: the numbers are none that a profile can have, or the file cannot be written.
    """
    text = edit_profile(source.read_text(encoding="utf-8"), keys)
    _try_profile(text, source, path, keys)
    with reported(f"write {path}"):
        path.parent.mkdir(parents=True, exist_ok=True)
    atomic.write(path, text.encode("utf-8"))


def _try_profile(text: str, source: Path, path: Path, keys: dict[str, float]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / path.name
        trial.write_text(text, encoding="utf-8")
        try:
            profile = profiles.read_profile(trial)
        except InputError as error:
            raise InputError(str(error).replace(str(trial), str(path))) from error
    if not isinstance(profile, Plotter) or any(getattr(profile.pen, key) != value for key, value in keys.items()):
        wanted = ", ".join(f"{key} = {value:g}" for key, value in keys.items())
        raise InputError(
            f"{source}: its group [pen] is written in a way that is not understood; write {wanted} by hand."
        )
