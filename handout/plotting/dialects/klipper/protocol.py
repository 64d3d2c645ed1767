"""The protocol of Klipper behind Moonraker: blocks → lines of G-code; messages of JSON-RPC, one a line, both ways.

Nothing here waits or remembers.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from handout.plotting import pen_lift
from handout.plotting.dialects import Block, Command, gcode
from handout.plotting.dialects.gcode import number
from handout.profiles import PenLift as PenProfile
from handout.profiles import Plotter

STANDING = b"M400\n"  # answered when all motion is done
# Millimetres, absolute; no percentage from the panel; motors stay powered while a person changes a pen, or their place
# would be lost.
MODES = (b"G21\n", b"G90\n", b"M220S100\n", b"SET_IDLE_TIMEOUT TIMEOUT=86400\n")
HERE = (b"SET_KINEMATIC_POSITION X=0 Y=0 SET_HOMED=XY\n", b"G92X0Y0\n")  # the pen stands at zero
LEVEL = b"G92Z0\n"  # and its Z axis
RELEASE = b"M84\n"  # motors off
# Speeds that a move has no room for are not lowered further: the plan has done so (both names, the old one first).
PEAKS = b"SET_VELOCITY_LIMIT ACCEL_TO_DECEL=%d\nSET_VELOCITY_LIMIT MINIMUM_CRUISE_RATIO=0\n"
ASKED = {
    "webhooks": ["state", "state_message"],
    "toolhead": ["homed_axes", "print_time", "estimated_print_time"],
    "motion_report": ["live_position"],
    "gcode_move": ["position", "gcode_position"],
    "mcu": ["last_stats"],
}


class Answer(NamedTuple):
    """The result of a request."""

    number: int
    result: Any


class Failure(NamedTuple):
    """A request that ended with an error."""

    number: int | None
    text: str


class Notice(NamedTuple):
    """Something it says by itself: "shutdown", "disconnected" or "ready" of Klipper, "response" to G-code, …"""

    kind: str
    text: str


class Status(NamedTuple):
    """How Klipper is.

    state : "ready", "shutdown", "startup", "error"; message : about that.
    homed : axes whose place it knows.
    print_time, now : s, when all that it has settled is done, and its board's clock.
    live, end : mm, where the carriage is, as of a quarter of a second ago at most, and where the last move leads to, in
        the coordinates of the program; None: not said.
    heard : bytes that its board has said, counted anew about once a second; None: not said.
    """

    state: str
    message: str
    homed: str = ""
    print_time: float = math.inf
    now: float = 0.0
    live: tuple[float, float] | None = None
    end: tuple[float, float] | None = None
    heard: int | None = None


Reply = Answer | Failure | Notice


def request(identity: int, method: str, parameters: dict[str, Any] | None = None) -> bytes:
    """A request, as it is sent."""
    message = {"jsonrpc": "2.0", "method": method, "id": identity} | ({"params": parameters} if parameters else {})
    return json.dumps(message, separators=(",", ":")).encode("ascii") + b"\n"


def reply(line: bytes) -> Reply:
    """What a message means."""
    try:
        message = json.loads(line)
    except ValueError:
        message = None
    if not isinstance(message, dict):
        return Notice("garbage", line.decode("utf-8", "replace").strip())
    if "method" in message:
        said = message.get("params") or [""]
        kind = str(message["method"]).removeprefix("notify_").removeprefix("klippy_").removeprefix("gcode_")
        return Notice(kind, str(said[0]))
    number = message.get("id")
    if isinstance(error := message.get("error"), dict):
        return Failure(number, str(error.get("message", error)))
    return Answer(number if isinstance(number, int) else -1, message.get("result"))


def status(result: Any) -> Status:
    """The answer to a question for `ASKED`."""
    found = result.get("status", {}) if isinstance(result, dict) else {}
    hooks, head, move = (found.get(name, {}) for name in ("webhooks", "toolhead", "gcode_move"))
    live, at, told = _place(found.get("motion_report", {}).get("live_position")), None, None
    if "position" in move and "gcode_position" in move:
        at, told = _place(move["position"]), _place(move["gcode_position"])
    if live is not None and at is not None and told is not None:
        live = live[0] - at[0] + told[0], live[1] - at[1] + told[1]
    return Status(
        state=str(hooks.get("state", "startup")),
        message=str(hooks.get("state_message", "")),
        homed=str(head.get("homed_axes", "")),
        print_time=float(head.get("print_time", math.inf)),
        now=float(head.get("estimated_print_time", 0.0)),
        live=live,
        end=told,
        heard=found.get("mcu", {}).get("last_stats", {}).get("bytes_read"),
    )


def _place(values: Any) -> tuple[float, float] | None:
    return (float(values[0]), float(values[1])) if isinstance(values, list) and len(values) >= 2 else None


def pen(down: bool, profile: PenProfile) -> list[bytes]:
    """Lower or lift the pen and wait for it.

    All of these wait for their turn among the moves by themselves; the pause after them makes the carriage stand.
    """
    if profile.lift == "command":
        lines = profile.down_command if down else profile.up_command
        rest = float(profile.down_time if down else profile.up_time)
        return [*(f"{line}\n".encode("ascii") for line in lines), gcode.pause_ms(rest)]
    ((value, wait),) = pen_lift.way(profile, down)
    speed = pen_lift.lowering_speed(profile) if down else float(profile.z_speed)
    if profile.lift == "z":
        return [f"G1Z{number(value)}F{number(speed * 60, 1)}\n".encode(), *([gcode.pause_ms(wait)] if wait > 0 else [])]
    if profile.lift == "stepper":
        moved = f"MANUAL_STEPPER STEPPER={profile.name} MOVE={number(value)} SPEED={number(speed)}\n"
        return [moved.encode("ascii"), gcode.pause_ms(wait)]
    return [f"SET_SERVO SERVO={profile.name} ANGLE={number(value)}\n".encode("ascii"), gcode.pause_ms(wait)]


def set_pen(profile: PenProfile, value: float) -> list[bytes]:
    """The pen goes to a value or a height; see `dialects.Dialect`."""
    return [*MODES[:2], *pen(True, pen_lift.lower_at_once(profile, value)), STANDING]


def homing(profile: Plotter) -> list[bytes]:
    """Lift the pen and find the zero of X and Y; Z, which a pen makes reach lower than its switch, is left alone."""
    return [*MODES, *pen(False, profile.pen), b"G28 X Y\n"]


def program(blocks: Sequence[Block], profile: Plotter) -> Iterator[Command]:
    """The commands of a plan; see `gcode.Program`."""
    return _Program(profile, blocks).commands()


class _Program(gcode.Program):
    modes = MODES

    def open(self) -> list[bytes]:
        return [*MODES, *(HERE if self.profile.bed.zero == "here" else ())]

    def move_pen(self, down: bool, profile: PenProfile) -> list[bytes]:
        self.forget_pen()
        return pen(down, profile)
