"""Machines as TOML files: `devices/*.toml` read into frozen, validated structs.

An unknown key, a missing unit or a value out of its bounds is an error that names the file, the key and the bound.
The fields are documented for people who do not program in `devices/README.md`.
"""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from handout import hooks, shipped, tables
from handout.errors import InputError, ProfileError
from handout.tables import Acceleration as Acceleration
from handout.tables import Length as Length
from handout.tables import Speed as Speed
from handout.tables import Table
from handout.tables import Time as Time


class Bed(Table, frozen=True):
    """Where the pen can go.

    width, height: of the area the pen reaches; origin: the corner (or the middle) where the machine's zero is, in
    which the same corner (or the middle) of the page is laid; y: whether Y grows away from the reader ("up") or
    towards; zero: "kept", the zero the machine has, or "here", wherever the pen stands when a plot begins; gantry:
    "cartesian", each motor moves one axis, or "corexy", one moves x + y and the other x − y (only where that is not
    left to the controller: EBB); inset_x, inset_y: how far the zero lies inside the page's corner, on machines that
    cannot reach the edge of a sheet.
    """

    width: Length
    height: Length
    origin: Literal["bottom-left", "top-left", "centre"] = "bottom-left"
    y: Literal["up", "down"] = "up"
    zero: Literal["kept", "here"] = "kept"
    gantry: Literal["cartesian", "corexy"] = "cartesian"
    inset_x: Length = Length(0.0)
    inset_y: Length = Length(0.0)


class LaidSheet(Table, frozen=True):
    """How somebody laid the sheets of a plot on the bed: of a plot that is kept, not of a machine's file.

    quarters: turned to the left, None: as they fit best; x, y: how far from their usual place along the machine's axes.
    """

    quarters: Literal[0, 1, 2, 3] | None = None
    x: Length = Length(0.0)
    y: Length = Length(0.0)


class Limits(Table, frozen=True):
    """What the machine can do; its own settings, read when it is connected, win over these.

    travel_speed: pen up; draw_speed: greatest with the pen down; junction_deviation as in GRBL's ``$11``; jerk: of a
    Marlin that uses it in place of junction deviation, 0 for none.
    """

    draw_speed: Speed
    travel_speed: Speed
    acceleration: Acceleration
    junction_deviation: Length = Length(0.01)
    jerk: Speed = Speed(0.0)
    steps_per_mm: float = 80.0


class PenLift(Table, frozen=True):
    """How the pen is lifted: by a servo (``M3 S…``), by the Z axis, by a stepper motor of its own (Klipper), by
    commands of the user's own, or by a plotter that has words for it.

    up, down: servo values, or heights in mm for ``lift = "z"`` and ``"stepper"``; pressed: the same at full pressure,
    to which a Z axis or the servo of an EBB follows the pressure of a stroke (no number: it does not); up_time,
    down_time: how long to wait for the pen after the command; ramp: how long the pen is on its way down; up_command,
    down_command: lines for ``lift = "command"``; servo: of an EBB, the standard one, or a brushless one on a pin of
    its own; z: whether the Z axis counts upwards; z_speed, z_acceleration: of the Z axis, or of the stepper; name:
    what a Klipper calls the servo or the stepper; width: of the pen's line.
    """

    lift: Literal["servo", "z", "stepper", "command", "own"]
    up: float
    down: float
    up_time: Time
    down_time: Time
    pressed: float | None = None
    ramp: Time = Time(0.0)
    up_command: tuple[str, ...] = ()
    down_command: tuple[str, ...] = ()
    servo: Literal["standard", "brushless"] = "standard"
    z: Literal["up", "down"] = "up"
    z_speed: Speed = Speed(20.0)
    z_acceleration: Acceleration = Acceleration(200.0)
    name: str = "pen"
    width: Length = Length(0.4)

    @property
    def in_mm(self) -> bool:
        """Whether `up` and `down` are heights, mm."""
        return self.lift in ("z", "stepper")


class PenTurn(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What draws a layer, in the order of the turns; layers without one come behind these, in the drawing's order.

    speed : times that of the plot; pen : what the person calls it, who changes none between layers that share one.
    out : whether the layer is left out.
    """

    layer: Annotated[str, msgspec.Meta(max_length=200)]
    speed: Annotated[float, msgspec.Meta(ge=0.05, le=20)] = 1.0
    pen: Annotated[str, msgspec.Meta(max_length=60)] = ""
    out: bool = False


class Hpgl(Table, frozen=True):
    """What differs between plotters that speak HP-GL.

    rotation: of the coordinates, in degrees (``RO``); speed_step: of ``VS``; pens: in the carousel; pen: the one to
    write with; pen_time: what fetching or putting away a pen takes.
    """

    rotation: Literal[0, 90, 180, 270] = 0
    speed_step: Speed = Speed(10.0)
    pens: int = 1
    pen: int = 1
    pen_time: Time = Time(0.0)


class PortSettings(Table, frozen=True):
    """How the machine is reached, and what its controller can take.

    baud: bits a second; buffer: bytes it receives before it reads them; queue: moves it looks ahead; line_time: how
    long it takes to read one line; timeout: silence before giving up; start_up: wait after opening the port.
    """

    baud: int = 115200
    buffer: int = 128
    queue: int = 15
    line_time: Time = Time(0.0035)
    timeout: Time = Time(5.0)
    start_up: Time = Time(2.0)


class Feeder(Table, frozen=True):
    """What puts a new sheet under the pen by itself: lines that the plotter is told between two sheets of a batch.

    command: the lines, in the words of its dialect; no lines: a person is asked.  They leave the pen where the plotter
    finds its zero, or where that is taken to be.
    """

    command: tuple[str, ...] = ()


class Hooks(Table, frozen=True):
    """What the machine does besides drawing, in the steps of `hooks`.

    before_page, after_page: with the pen at zero; before_stroke, after_stroke: with the pen lifted above its beginning,
    its end; dip: before the first stroke, and again so that no more ink than `dip_every` is drawn between two; places:
    name → "X Y", machine coordinates.
    """

    before_page: tuple[str, ...] = ()
    after_page: tuple[str, ...] = ()
    before_stroke: tuple[str, ...] = ()
    after_stroke: tuple[str, ...] = ()
    dip: tuple[str, ...] = ()
    dip_every: Length = Length(0.0)
    places: dict[str, str] = msgspec.field(default_factory=dict)

    def steps(self, name: str) -> hooks.Steps:
        """The steps of a hook; InputError: see `hooks.read_steps`."""
        return hooks.read_steps(getattr(self, name), self.places, f"hooks.{name}")


HOOKS = ("before_page", "after_page", "before_stroke", "after_stroke", "dip")
LEAST_DIP = 10.0  # mm between two dips; a letter or two


def check_hooks(plotter: Plotter) -> None:
    """Check that steps can be read, and are such as the machine's dialect knows.

    Raises InputError: what cannot be done, and where it stands.
    """
    told = plotter.hooks
    for name in HOOKS:
        for step in told.steps(name):
            if isinstance(step, hooks.Wait) and plotter.dialect == "hpgl":
                raise InputError(
                    f"hooks.{name}: HP-GL has no instruction to wait: go a little way with the pen down instead."
                )
            if isinstance(step, hooks.Lower) and step.value is not None and plotter.pen.lift in ("own", "command"):
                raise InputError(f"hooks.{name}: down {step.value:g}: this plotter's pen has no heights; write: down.")
    if bool(told.dip) != (told.dip_every > 0):
        raise InputError("hooks.dip and hooks.dip_every belong together: what a dip is, and after how much ink.")
    if 0 < told.dip_every < LEAST_DIP:
        raise InputError(f"hooks.dip_every: {told.dip_every:g} mm of ink is less than {LEAST_DIP:g} mm.")


class Prices(Table, frozen=True):
    """What a machine's work costs, as far as it is known; of money in one currency.

    sheet, envelope: of one; ink: of a millilitre; ink_load: millilitres on a square metre that is covered with ink;
    pen: of a pen; pen_length: metres of line that it writes; hour: of the machine.
    """

    currency: str = ""
    sheet: float | None = None
    envelope: float | None = None
    ink: float | None = None
    ink_load: float | None = None
    pen: float | None = None
    pen_length: float | None = None
    hour: float | None = None


class Plotter(Table, frozen=True):
    """A pen plotter.

    homing: whether it finds its zero by itself (``$H``); segment_rate: straight segments a second of pen time.
    firmware: its version, where a dialect depends on it (EBB); "": not known, what every version understands is used.
    name: the name of its file, without ``.toml``; laid: how the sheets of a plot lie on it.
    """

    kind: Literal["plotter"]
    title: str
    dialect: Literal["grbl", "marlin", "ebb", "hpgl", "klipper"]
    bed: Bed
    limits: Limits
    pen: PenLift
    port: PortSettings = PortSettings()
    hpgl: Hpgl = Hpgl()
    feeder: Feeder = Feeder()
    hooks: Hooks = Hooks()
    prices: Prices = Prices()
    laid: LaidSheet = LaidSheet()
    homing: bool = False
    segment_rate: float = 100.0
    firmware: str = ""
    notes: str = ""
    name: str = ""

    @property
    def can_press(self) -> bool:
        """Whether the pen can be pressed more and less while it draws: on a Z axis, or by the servo of an EBB."""
        return self.pen.lift == "z" or self.dialect == "ebb"


class Margins(Table, frozen=True):
    """What the printer cannot print on, from each edge of the sheet as it is fed."""

    top: Length = Length(0.0)
    right: Length = Length(0.0)
    bottom: Length = Length(0.0)
    left: Length = Length(0.0)


class Nudge(Table, frozen=True):
    """How far the writing is moved on the sheet as it is read: x to the right, y down."""

    x: Length = Length(0.0)
    y: Length = Length(0.0)


class Envelope(Table, frozen=True):
    """What differs when a printer is fed with envelopes: its margins, and the tray they lie in."""

    margins: Margins | None = None
    source: str = ""


class Printer(Table, frozen=True):
    """An inkjet or a file that stands for one.

    queue: name of the CUPS queue, or the printer's address, ``ipp://…`` (empty: `--queue` or the system's default);
    format: what the pages are sent as (empty: the best that the printer takes); dpi: of the raster that is sent;
    margins: unprintable edge; sources: names of the trays; source: the tray to feed from (empty: the printer's own
    choice); options: further ``lp -o`` options or attributes of IPP, sent as they are; feed: the edge of the sheet
    that goes in first; turn: the way a page is turned to lie in that direction; flap: where the sheet's upper edge
    (an envelope's flap) is as it is fed, leading edge up, which wins over `turn`; nudge: what the printer is out by;
    file: pages are written to a file instead of being sent; simulated: jobs are written into a folder, as a queue would
    receive them; envelope: what differs for envelopes.
    """

    kind: Literal["printer"]
    title: str
    dpi: int
    queue: str = ""
    file: bool = False
    margins: Margins = Margins()
    sources: tuple[str, ...] = ()
    source: str = ""
    options: dict[str, str] = msgspec.field(default_factory=dict)
    feed: Literal["short", "long"] = "short"
    turn: Literal["left", "right"] = "left"
    flap: Literal["", "left", "right", "leading", "trailing"] = ""
    nudge: Nudge = Nudge()
    format: Literal["", "pdf", "pwg", "urf", "png"] = ""
    simulated: bool = False
    envelope: Envelope = Envelope()
    prices: Prices = Prices()
    notes: str = ""


Profile = Plotter | Printer
KINDS: dict[str, type[Profile]] = {"plotter": Plotter, "printer": Printer}

# key path → (least, greatest); a number outside is an error
_BOUNDS: dict[str, tuple[float, float]] = {
    "bed.width": (10, 5000), "bed.height": (10, 5000), "bed.inset_x": (0, 100), "bed.inset_y": (0, 100),
    "hpgl.speed_step": (0.1, 100), "hpgl.pens": (1, 16), "hpgl.pen": (1, 16), "hpgl.pen_time": (0, 60),
    "limits.draw_speed": (0.1, 2000), "limits.travel_speed": (0.1, 2000), "limits.acceleration": (1, 100_000),
    "limits.junction_deviation": (0, 1), "limits.jerk": (0, 100), "limits.steps_per_mm": (1, 10000),
    "pen.up": (-1000, 65535), "pen.down": (-1000, 65535), "pen.up_time": (0, 5), "pen.down_time": (0, 5),
    "pen.pressed": (-1000, 65535), "pen.ramp": (0, 2),
    "pen.z_speed": (0.1, 500), "pen.z_acceleration": (1, 50000), "pen.width": (0.02, 20),
    "port.baud": (300, 4_000_000), "port.buffer": (32, 65536), "port.queue": (2, 2000), "port.line_time": (0, 0.1),
    "port.timeout": (0.05, 600), "port.start_up": (0, 30), "segment_rate": (5, 1000), "dpi": (72, 2400),
    "nudge.x": (-50, 50), "nudge.y": (-50, 50),
    "margins.top": (0, 100), "margins.right": (0, 100), "margins.bottom": (0, 100), "margins.left": (0, 100),
    "envelope.margins.top": (0, 100), "envelope.margins.right": (0, 100), "envelope.margins.bottom": (0, 100),
    "envelope.margins.left": (0, 100),
    "prices.sheet": (0, 1e6), "prices.envelope": (0, 1e6), "prices.ink": (0, 1e6), "prices.ink_load": (0.01, 1000),
    "prices.pen": (0, 1e6), "prices.pen_length": (0.1, 1e6), "prices.hour": (0, 1e6),
}  # fmt: skip


def read_profile(path: Path) -> Profile:
    """Read and check a machine's TOML file.

    Raises ProfileError: not TOML, an unknown key, a missing unit, a value out of bounds; the message names file and
    key.
    """
    table = tables.load_table(path, "a device file", ProfileError)
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ProfileError(f'{path}: kind = {kind!r} must be "plotter" or "printer".')
    if "name" in table:
        raise ProfileError(f"{path}: name cannot be set; a machine is called as its file is.")
    if "laid" in table:
        raise ProfileError(f"{path}: laid cannot be set; how its sheets lie is said of each plot.")
    if isinstance(pen := table.get("pen"), dict) and pen.get("lift") == "command":
        table["pen"] = {"up": 1.0, "down": 2.0} | pen  # numbers that nobody is told
    try:
        profile: Profile = tables.convert_table(table, KINDS[kind])
        tables.check_bounds(profile, _BOUNDS)
    except ValueError as error:
        raise ProfileError(f"{path}: {error}") from error
    if isinstance(profile, Plotter):
        _check_pen(profile.pen, profile.dialect, path)
        _check_dialect(profile, path)
        _check_hpgl(profile, path)
        try:
            check_hooks(profile)
        except InputError as error:
            raise ProfileError(f"{path}: {error}") from error
        profile = msgspec.structs.replace(profile, name=path.stem)
    else:
        for key, tray in (("source", profile.source), ("envelope.source", profile.envelope.source)):
            if tray and profile.sources and tray not in profile.sources:
                raise ProfileError(f"{path}: {key} = {tray!r} is none of its sources: {', '.join(profile.sources)}.")
    return profile


def _check_dialect(profile: Plotter, path: Path) -> None:
    """What a dialect cannot do must not be asked of it."""
    pen = profile.pen
    if pen.lift == "stepper" and profile.dialect != "klipper":
        raise ProfileError(f'{path}: pen.lift = "stepper" is known to Klipper only.')
    if not re.fullmatch(r"[a-z0-9_]{1,40}", pen.name):
        raise ProfileError(f"{path}: pen.name = {pen.name!r} is not a name of small letters, digits and underscores.")
    if profile.dialect == "klipper" and pen.lift == "servo" and pen.ramp > 0:
        raise ProfileError(f"{path}: pen.ramp = {pen.ramp:g} s, but Klipper tells a servo ten values a second at most.")
    if profile.dialect != "ebb":
        if profile.bed.gantry != "cartesian":
            raise ProfileError(
                f'{path}: bed.gantry = "{profile.bed.gantry}" is left to the controller unless it is an EBB.'
            )
        return
    if profile.pen.lift != "servo":
        raise ProfileError(f'{path}: pen.lift = "{profile.pen.lift}" is not known to an EBB, whose pen has a servo.')
    if not (1 <= profile.pen.up <= 65535 and 1 <= profile.pen.down <= 65535):
        raise ProfileError(
            f"{path}: pen.up and pen.down of an EBB are lengths of pulses, 1 to 65535 in units of 83.3 ns."
        )
    if profile.homing:
        raise ProfileError(f"{path}: homing = true, but an EBB has no switches to find its zero by.")
    if not re.fullmatch(r"|\d{1,3}(\.\d{1,3}){1,2}", profile.firmware, re.ASCII):
        raise ProfileError(f'{path}: firmware = {profile.firmware!r} is not a version such as "2.8.1".')


def _check_pen(pen: PenLift, dialect: str, path: Path) -> None:
    sign = 1 if pen.z == "up" else -1
    if pen.lift == "z" and sign * pen.up <= sign * pen.down:
        raise ProfileError(
            f"{path}: pen.up = {pen.up:g} must be higher than pen.down = {pen.down:g} (mm of the Z axis, which counts "
            f'{pen.z}wards: pen.z = "{pen.z}").'
        )
    deeper = pen.pressed is None or (pen.pressed - pen.down) * (pen.down - pen.up) >= 0
    if pen.pressed is not None and (not deeper or pen.lift != ("servo" if dialect == "ebb" else "z")):
        raise ProfileError(
            f'{path}: pen.pressed = {pen.pressed:g} needs lift = "z" or the servo of an EBB, and must not be '
            f"higher than pen.down = {pen.down:g}."
        )
    _check_commands(pen, path)
    if pen.up == pen.down:
        raise ProfileError(f"{path}: pen.up and pen.down are both {pen.up:g}; the pen would never leave the paper.")


def _check_hpgl(plotter: Plotter, path: Path) -> None:
    if (plotter.pen.lift == "own") != (plotter.dialect == "hpgl"):
        raise ProfileError(f'{path}: pen.lift = "own" and dialect = "hpgl" belong together.')
    if plotter.dialect == "hpgl" and plotter.bed.zero != "kept":
        raise ProfileError(
            f'{path}: bed.zero = {plotter.bed.zero!r} must be "kept": the zero of HP-GL is on its sheet.'
        )
    if plotter.hpgl.pen > plotter.hpgl.pens:
        raise ProfileError(f"{path}: hpgl.pen = {plotter.hpgl.pen} is beyond hpgl.pens = {plotter.hpgl.pens}.")


def _check_commands(pen: PenLift, path: Path) -> None:
    """Commands of the user's own must be lines that a controller reads, and none that act out of turn."""
    for name, lines in (("up_command", pen.up_command), ("down_command", pen.down_command)):
        if (pen.lift == "command") != bool(lines):
            raise ProfileError(f'{path}: pen.{name} and lift = "command" belong together.')
        for line in lines:
            try:
                hooks.line(line, f"pen.{name}")
            except InputError as error:
                raise ProfileError(f"{path}: {error}") from error


def names(kind: str | None = None) -> list[str]:
    """Names of all known machines, the user's own included; `kind` is ``"plotter"``, ``"printer"`` or None."""
    return sorted(n for n in shipped.files("devices", "*.toml") if kind is None or n.startswith(f"{kind}-"))


def full(name: str) -> str:
    """The name of a machine that goes by a shorter one too: ``sim`` is ``simulated``."""
    return "simulated" if name == "sim" else name


def locate(name: str, kind: str | None = None) -> Path:
    """The file of a machine: a path to a TOML file, a full name, or a name without its ``plotter-`` / ``printer-``.

    Raises ProfileError: unknown; the message lists the nearest.
    """
    if name.endswith(".toml"):
        return Path(name)
    files = shipped.files("devices", "*.toml")
    kinds = [kind] if kind else list(KINDS)
    for candidate in (name, *(f"{each}-{full(name)}" for each in kinds)):
        if candidate in files:
            return files[candidate]
    for other in KINDS:
        if f"{other}-{full(name)}" in files:
            raise ProfileError(f"{name} is a {other}, not a {kind} (see: handout devices list).")
    choices = names(kind)
    wanted = [f"{each}-{name}" for each in kinds if not name.startswith(f"{each}-")] or [name]
    near = [one for each in wanted for one in difflib.get_close_matches(each, choices, 3, 0.6)][:3]
    hint = f"; the nearest: {', '.join(near)}" if near else ""
    raise ProfileError(f"No {kind or 'machine'} is called {name!r}{hint} (see: handout devices list).")


def find(name: str, kind: str) -> Profile:
    """Read the machine `name`, as `locate` finds it.

    Raises ProfileError: unknown (the message lists the nearest), not valid, or of another kind.
    """
    profile = read_profile(locate(name, kind))
    if profile.kind != kind:
        raise ProfileError(f"{name} is a {profile.kind}, not a {kind}.")
    return profile
