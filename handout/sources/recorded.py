"""What formats of drawings share: the bounds of what is read; raw strokes in mm and s become a drawing on a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from handout.errors import InputError
from handout.values import Array, Drawing, Page, Stroke

MOST = 1_000_000  # samples
LARGEST = 10_000.0  # mm, of a page, and from its corner to anything on it; set by eye, as those below
_LONGEST = 1e5  # s that a stroke may take: more than a day
# greatest values of the channels: of the clock, s, of the width of a mark, mm, of shares and of angles, rad
_GREATEST = {"t": 1e13, "width": 1000.0, "nib": 1000.0}
_GREATEST_TURN = 1e4  # set by eye
RATE = 100.0  # samples a second where the file says nothing
PACE = 50.0  # mm/s, of strokes without times
LIFT = 0.1  # s between strokes whose clocks do not follow on each other
MARGIN = 5.0  # mm around writing whose page is not known


@dataclass(frozen=True, eq=False)
class Raw:
    """A movement of a pen on paper, as the file has it.

    xy : (n, 2) float, mm, y down.
    t : (n,) float, s, on the clock of the file, or None.
    channels : further ones of `Stroke`, each (n,) float.
    word, layer, colour : as those of `Stroke`.
    start : s, when it began, if the file says that, as some do that know no more.
    """

    xy: Array
    t: Array | None
    channels: Mapping[str, Array]
    word: int = -1
    layer: str = ""
    colour: str = ""
    start: float | None = None


def make_drawing(raw: Sequence[Raw], what: str, about: Mapping[str, Any], *, fit: bool = True) -> Drawing:
    """A drawing of raw strokes.

    Samples at which the clock stands still are left out, since devices report a resting pen again and again; where no
    clock runs, there are 100 samples a second, `about["timing"]` says so, and unless the file knows when strokes began
    the drawing is not `timed`.

    what : the format, for messages.
    fit : move the writing to the corner of a page that is as large as it needs; otherwise only what lies left of the
        page or above it is moved.

    Raises InputError: no movement of a pen that is down, more than a million samples, or a value that `refuse_far` does
    not take.
    """
    raw = [stroke for stroke in raw if len(stroke.xy)]
    if not raw:
        raise InputError(f"This {what} has no movement of a pen on paper.")
    refuse_many(sum(len(stroke.xy) for stroke in raw), what)
    points = np.concatenate([stroke.xy for stroke in raw])
    low, high = points.min(axis=0), points.max(axis=0)
    shift = MARGIN - low if fit else np.where(low < 0, MARGIN - low, 0.0)
    width, height = (high + shift + np.minimum(low + shift, MARGIN)).tolist()
    page = Page(max(width, 1.0), max(height, 1.0))
    for number, stroke in enumerate(raw, 1):
        t = stroke.start if stroke.t is None else stroke.t
        refuse_far(f"Stroke {number} of this {what}", stroke.xy + shift, t, **stroke.channels)
    clocked = _has_clock(raw)
    timing = {} if clocked else {"timing": f"assumed: {RATE:g} samples a second"}
    first = raw[0]
    origin = float(first.t[0]) if first.t is not None and clocked else first.start or 0.0
    strokes: list[Stroke] = []
    for stroke in raw:
        t = _stroke_times(stroke, origin, clocked, float(strokes[-1].t[-1]) if strokes else None)
        # samples that are later than all before them
        going = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]])
        channels: dict[str, Any] = {name: values[going] for name, values in stroke.channels.items()}
        notes: dict[str, Any] = {"word": stroke.word, "layer": stroke.layer, "colour": stroke.colour}
        strokes.append(Stroke(t[going], stroke.xy[going] + shift, **channels, **notes))
    return Drawing(tuple(strokes), page, {**about, **timing}, timed=clocked or first.start is not None)


def _stroke_times(stroke: Raw, origin: float, clocked: bool, end: float | None) -> Array:
    """(n,) s: times of a stroke after the end of the one before, if any; assumed where no clock runs."""
    if clocked and stroke.t is not None:
        t = stroke.t - origin
    else:
        begin = 0.0 if end is None else end + LIFT
        t = (begin if stroke.start is None else stroke.start - origin) + np.arange(len(stroke.xy)) / RATE
    if end is not None and t[0] <= end:  # each stroke has a clock of its own
        t = t - t[0] + end + LIFT
    return t


def refuse_many(samples: int, what: str) -> None:
    """Raise InputError for more samples than are read."""
    if samples > MOST:
        raise InputError(f"This {what} has {samples} samples; at most {MOST} are read: split it.")


def refuse_far(what: str, xy: Array, t: ArrayLike | None = None, **channels: ArrayLike | None) -> None:
    """Raise InputError for what no pen on a page has done; `what` has it.

    xy : (n, 2) mm, none further from the page's corner than `LARGEST` on either axis.
    t, channels : as those of `Stroke`, finite and within the bounds at the top of this file; a stroke takes no longer
        than `_LONGEST`.
    """
    for name, values in {"xy": xy, "t": t, **channels}.items():
        if values is None or not np.size(values):
            continue
        least, greatest = float(np.min(values)), float(np.max(values))
        if not (np.isfinite(least) and np.isfinite(greatest)):
            raise InputError(f"{what} has a value that is not a finite number.")
        if name == "xy" and max(-least, greatest) > LARGEST:
            x, y = xy[np.abs(xy).max(axis=1).argmax()]
            raise InputError(
                f"{what} runs to {x:.4g}, {y:.4g} mm; no page is larger than {LARGEST:g} mm: "
                "scale it down, or put right its units."
            )
        bound = _GREATEST.get(name, _GREATEST_TURN)
        if name != "xy" and max(-least, greatest) > bound:
            worst = least if -least > greatest else greatest
            raise InputError(f"{what} has {worst:.4g} as its {name}; what is beyond {bound:g} is no pen's.")
        if name == "t" and greatest - least > _LONGEST:
            raise InputError(f"{what} takes {greatest - least:.4g} s; at most {_LONGEST:g} s are read.")


def _has_clock(raw: Sequence[Raw]) -> bool:
    """Whether the samples have times that mean something."""
    steps = [np.diff(stroke.t) > 0 for stroke in raw if stroke.t is not None]
    if len(steps) != len(raw):
        return False
    return 2 * sum(int(step.sum()) for step in steps) >= sum(len(step) for step in steps)


def lean(tilt_x: Array, tilt_y: Array) -> tuple[Array, Array]:
    """(n,) rad each: tilt from the vertical and azimuth, of tilts along the axes."""
    x, y = np.tan(tilt_x), np.tan(tilt_y)
    return np.arctan(np.hypot(x, y)), np.arctan2(y, x)


def full_pressure(most: float) -> float:
    """Full pressure of a device: the least usual range that holds the greatest that was measured."""
    usual = (1.0, 63.0, 127.0, 255.0, 511.0, 1023.0, 2047.0, 4095.0, 8191.0)
    return next((full for full in usual if most <= full), most if np.isfinite(most) else 1.0)
