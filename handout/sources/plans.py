"""Reads pages of plans in JSON, as `sinks.plans` writes and describes them, changed by hand or not; and targets alone.

Targets are thrown on a page by hand or by a program::

    {"targets": [[10, 30], [14, 12], [20, 30], …],                 mm, y down; at least one
     "covariances": [[[4, 0], [0, 1]], …],                         mm², one a target: its ellipse; optional
     "pen_up": [2, 5],                                             targets, from 0, where the pen is lifted; optional
     "references": [{"targets": …, "covariances": …,               more of them, each for the same targets in a frame of
                     "frame": {"origin": [50, 20],                 its own: mm, an angle as it is seen, and a factor;
                               "angle": "30deg", "scale": 1.5}}],  optional
     "page": {"width": 148, "height": 105}}                        mm; optional: as large as the targets need
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec
import numpy as np

from handout import units
from handout.errors import InputError
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.planned_page import PlannedPage, PlannedStroke
from handout.motion.styles.target_plans import TargetPlan, TargetReference, fuse_references
from handout.sources.drawing_json import JsonPage, decode
from handout.sources.recorded import refuse_far
from handout.values import Page


class _PlanStroke(msgspec.Struct, forbid_unknown_fields=True):
    onset: float
    duration: float
    asymmetry: float
    theta: float


class _PlanMovement(msgspec.Struct, forbid_unknown_fields=True):
    start: float
    end: float
    targets: list[tuple[float, float]]
    strokes: list[_PlanStroke]
    place_db: float | None = None
    speed_db: float | None = None
    word: int = -1


class _PlansFile(msgspec.Struct, forbid_unknown_fields=True):
    format: Literal["handout-plans"]
    version: Literal[1]
    page: JsonPage
    timed: bool
    about: dict[str, Any]
    movements: list[_PlanMovement]


def from_json(data: bytes) -> PlannedPage:
    """Read what `sinks.plans.to_json` wrote.

    Raises InputError: not JSON, not of this form (the message says where), or plans that cannot be.
    """
    file = decode(data, _PlansFile, "a page of plans")
    page = file.page.page()
    fits = tuple(_read_movement(movement, number) for number, movement in enumerate(file.movements, 1))
    return PlannedPage(fits, page, file.timed, file.about)


def _read_movement(movement: _PlanMovement, number: int) -> PlannedStroke:
    columns = np.array([(s.onset, s.duration, s.asymmetry, s.theta) for s in movement.strokes]).reshape(-1, 4).T
    if (columns[1] <= 0).any():
        raise InputError(f"Movement {number} has a stroke whose duration is not above 0 s.")
    targets = np.array(movement.targets, dtype=np.float64).reshape(-1, 2)
    onset, duration, asymmetry, theta = columns
    refuse_far(f"Movement {number}", targets, [movement.start, movement.end], asymmetry=asymmetry, theta=theta)
    refuse_far(f"Movement {number}", targets, np.concatenate([onset, onset + duration]))
    try:
        plan = LognormalPlan(targets, onset, duration, asymmetry, theta, movement.start, movement.end)
    except ValueError as error:
        raise InputError(
            f"Movement {number} cannot be used: {error} (it needs one target more than strokes)."
        ) from error
    place = np.inf if movement.place_db is None else movement.place_db
    return PlannedStroke(plan, place, movement.speed_db, movement.word)


_MARGIN = 0.15  # of the extent of the targets, around them
_MOST = 5000  # targets
Pair = tuple[float, float]


class _TargetFrame(msgspec.Struct, forbid_unknown_fields=True):
    origin: Pair = (0.0, 0.0)
    angle: str = "0deg"
    scale: float = 1.0


class _Reference(msgspec.Struct, forbid_unknown_fields=True):
    targets: list[Pair]
    covariances: list[tuple[Pair, Pair]] | None = None
    frame: _TargetFrame | None = None


class _TargetsFile(msgspec.Struct, forbid_unknown_fields=True):
    targets: list[Pair]
    covariances: list[tuple[Pair, Pair]] | None = None
    pen_up: list[int] = []
    references: list[_Reference] = []
    page: JsonPage | None = None


def look_like_targets(data: bytes) -> bool:
    """Whether a file in JSON is of targets alone."""
    try:
        known = msgspec.json.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return False
    return isinstance(known, dict) and "targets" in known and "movements" not in known


def read_targets(data: bytes) -> TargetPlan:
    """Read a file of the form described at the top.

    Raises InputError: not JSON, not of this form, no targets or too many, or ellipses that are none; the message says
    where.
    """
    file = decode(data, _TargetsFile, "a plan of targets")
    if not 1 <= len(file.targets) <= _MOST:
        raise InputError(f"This plan has {len(file.targets)} targets; it needs 1 to {_MOST}.")
    wrong = [at for at in file.pen_up if not 0 <= at < len(file.targets)]
    if wrong:
        raise InputError(f"pen_up: {wrong[0]} is no target; they are numbered 0 to {len(file.targets) - 1}.")
    first = _Reference(file.targets, file.covariances)
    references = tuple(_read_reference(each, number) for number, each in enumerate([first, *file.references]))
    try:
        places, _ = fuse_references(references)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise InputError(f"This plan cannot be used: {error}.") from error
    refuse_far("This plan", places)
    low, high = places.min(axis=0), places.max(axis=0)
    reach = float((high - low).max()) or 1.0
    if file.page is not None:
        return TargetPlan(references, file.page.page(), tuple(file.pen_up))
    around = _MARGIN * reach
    shift = np.maximum(around - low, 0.0)
    moved = tuple(
        TargetReference(r.targets, r.covariances, r.axes, (np.zeros(2) if r.origin is None else r.origin) + shift)
        for r in references
    )
    width, height = (high + shift + around).tolist()
    return TargetPlan(moved, Page(max(width, 1.0), max(height, 1.0)), tuple(file.pen_up))


def _read_reference(reference: _Reference, number: int) -> TargetReference:
    where = "" if number == 0 else f"Reference {number}: "
    targets = np.array(reference.targets, dtype=np.float64).reshape(-1, 2)
    spreads = None if reference.covariances is None else np.array(reference.covariances, dtype=np.float64)
    if spreads is not None and len(spreads) != len(targets):
        raise InputError(f"{where}There are {len(spreads)} covariances for {len(targets)} targets; each needs one.")
    frame = reference.frame or _TargetFrame()
    if not frame.scale > 0:
        raise InputError(f"{where}scale = {frame.scale:g} is not above 0.")
    with np.errstate(over="ignore", invalid="ignore"):
        refuse_far(f"{where}A target", targets * frame.scale + frame.origin)
        if spreads is not None:
            refuse_far(f"{where}The ellipse of a target", np.sqrt(np.abs(spreads)).reshape(-1, 2) * frame.scale)
    angle = -units.parse(frame.angle, "angle", "angle", default="deg")  # as seen: y is down
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    read = TargetReference(targets, spreads, frame.scale * turn, np.array(frame.origin))
    try:
        read.on_page()
    except ValueError as error:
        raise InputError(f"{where}{error}.") from error
    return read
