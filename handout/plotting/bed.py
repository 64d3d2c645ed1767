"""Where a page lies on the machine: the only place that turns page coordinates into machine coordinates.

The page's corner that is nearest to the machine's zero lies in the zero: the lower left for ``origin = "bottom-left"``,
the upper left for ``"top-left"``; for ``"centre"`` the middle of the page lies in it.  A page that does not fit the bed
upright is turned a quarter to the left if more of it fits then: its top edge lies along the left edge of the bed.
A plot may say otherwise (`profiles.LaidSheet`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from handout.errors import DoesNotFit
from handout.profiles import Bed, Length, Plotter
from handout.summary import one_line
from handout.values import Array, Drawing, Page, readonly

_SLACK = 0.05  # mm beyond the bed that no machine notices
_LEAST = 10.0  # mm of travel that make a bed
# where the zero of a machine is, as a person sees it
TOPS = ("", "to the left", "towards the reader", "to the right")  # by quarters that a page is turned to the left
CORNERS = {"bottom-left": "lower left corner", "top-left": "upper left corner", "centre": "middle"}


@dataclass(frozen=True, eq=False)
class BedPlacement:
    """A page on a bed.

    turn : (2, 2) float, page to machine; an isometry, so its transpose leads back.
    shift : (2,) float, mm, machine coordinates of the page's top left corner.
    turned : where its top lies, if not away from the reader: one of `TOPS`.
    """

    turn: Array
    shift: Array
    turned: str

    __repr__ = one_line

    def to_machine(self, xy: Array) -> Array:
        """(n, 2) mm, page → machine."""
        return xy @ self.turn.T + self.shift

    def to_page(self, xy: Array) -> Array:
        """(n, 2) mm, machine → page."""
        return (xy - self.shift) @ self.turn


def place(page: Page, profile: Plotter) -> BedPlacement:
    """How a page lies on the bed of a machine."""
    upright, sideways = (page.width, page.height), (page.height, page.width)
    quarters, moved = profile.laid.quarters, np.array([profile.laid.x, profile.laid.y], dtype=float)
    if quarters is None:
        quarters = 1 if _measure_cover(profile, *sideways) > _measure_cover(profile, *upright) + _SLACK else 0
    width, height = sideways if quarters % 2 else upright
    # page → sheet as it lies, origin at its upper left, y towards the reader
    turn = np.linalg.matrix_power(np.array([[0.0, 1.0], [-1.0, 0.0]]), quarters)
    shift = 0.0 - np.minimum(turn @ np.array(upright), 0.0)
    left, above = {"bottom-left": (0.0, height), "top-left": (0.0, 0.0), "centre": (width / 2, height / 2)}[
        profile.bed.origin
    ]
    away = -1.0 if profile.bed.y == "up" else 1.0
    flip = np.array([1.0, away])
    corner = flip * (shift - [left, above]) - _inset(profile) + moved
    return BedPlacement(readonly(flip[:, None] * turn, 2, 2), readonly(corner, 2), TOPS[quarters])


def _inset(profile: Plotter) -> Array:
    """Machine coordinates of the machine's zero if the page's corner were zero: (2,) float, mm."""
    bed = profile.bed
    if bed.origin == "centre":
        return np.zeros(2)
    ahead = (bed.origin == "bottom-left") == (bed.y == "up")
    return np.array([bed.inset_x, bed.inset_y if ahead else -bed.inset_y], dtype=float)


def _measure_cover(profile: Plotter, width: float, height: float) -> float:
    """Area of a sheet that lies on the bed, mm²."""
    return min(width, profile.bed.width) * min(height, profile.bed.height)


def reach(profile: Plotter) -> tuple[Array, Array]:
    """Least and greatest machine coordinates of the bed: two (2,) float, mm."""
    size = np.array([profile.bed.width, profile.bed.height], dtype=float)
    if profile.bed.origin == "centre":
        return -size / 2, size / 2
    zero_in_corner_ahead = (profile.bed.origin == "bottom-left") == (profile.bed.y == "up")
    return (np.zeros(2), size) if zero_in_corner_ahead else (np.array([0.0, -size[1]]), np.array([size[0], 0.0]))


def narrow(profile: Plotter, ends: Sequence[tuple[float, float]], refusals: Sequence[str]) -> Bed:
    """The part of the bed that a machine's own travel leaves.

    ends : (least, greatest) of x and y that it reaches, mm, in the coordinates of a program.
    refusals : of x and of y, the sentence of the error, with a place ``{}`` for what is left.

    Raises DoesNotFit: less than `_LEAST` is left, or not where a page would be laid.
    """
    sizes = []
    for name, (low, high), refusal, least, greatest in zip("xy", ends, refusals, *reach(profile), strict=True):
        low, high = max(low, float(least)), min(high, float(greatest))
        size = 2 * min(-low, high) if profile.bed.origin == "centre" else high - low
        if size < _LEAST or not low <= _SLACK or not high >= -_SLACK:
            raise DoesNotFit(refusal.format(f"{name} from {low:.4g} to {high:.4g} mm"))
        sizes.append(Length(size))
    return msgspec.structs.replace(profile.bed, width=sizes[0], height=sizes[1])


def check(xy: Array, profile: Plotter, way_out: str = "--fit or a larger bed") -> None:
    """Raise DoesNotFit for the machine coordinate, (n, 2) mm, that is farthest outside the bed."""
    least, greatest = reach(profile)
    for axis, name in enumerate("xy"):
        low, high = xy[:, axis].min(), xy[:, axis].max()
        value = low if least[axis] - low > high - greatest[axis] else high
        if value < least[axis] - _SLACK or value > greatest[axis] + _SLACK:
            raise DoesNotFit(
                f"{name} = {value:.4g} mm is outside the bed {least[axis]:g}–{greatest[axis]:g} mm of "
                f"{profile.name or profile.title}: use {way_out}."
            )


def beyond_paper(drawing: Drawing) -> str | None:
    """What hangs off the paper, in a sentence that names the stroke that is farthest out; None if nothing does."""
    worst, warning = _SLACK, None
    size = np.array([drawing.page.width, drawing.page.height])
    for number, stroke in enumerate(drawing.strokes, 1):
        out = np.concatenate([-stroke.xy.min(axis=0), stroke.xy.max(axis=0) - size])
        side = int(np.argmax(out))
        if out[side] > worst:
            worst, where = float(out[side]), ("left", "upper", "right", "lower")[side]
            word = f" (of word {stroke.word + 1})" if stroke.word >= 0 else ""
            warning = (
                f"Stroke {number}{word} reaches {worst:.3g} mm beyond the {where} edge of the paper "
                f"({size[0]:g} x {size[1]:g} mm): the pen will write on what lies under it."
            )
    return warning


def fit_to_bed(drawing: Drawing, profile: Plotter) -> Drawing:
    """The drawing, made smaller with its page if it does not fit the bed of the machine; times stay as they are.

    What hangs over the edge of the page counts as part of the page.  `about["shrunk"]`: its size, as a share of that
    which was asked for.
    """
    if drawing.bounds is None:
        return drawing
    try:
        placed = place(drawing.page, profile)
        check(np.concatenate([placed.to_machine(stroke.xy) for stroke in drawing.strokes]), profile)
        return drawing
    except DoesNotFit:
        pass
    left, top, right, bottom = drawing.bounds
    corner = np.array([min(left, 0.0), min(top, 0.0)])
    width, height = np.array([max(right, drawing.page.width), max(bottom, drawing.page.height)]) - corner
    bed = profile.bed
    straight, turned = min(bed.width / width, bed.height / height), min(bed.width / height, bed.height / width)
    scale = min(1.0, max(straight, turned))
    edge = np.abs(_inset(profile))  # the sheet is larger than what the machine reaches, by so much all around
    edge = edge if straight >= turned else edge[::-1]
    strokes = []
    for stroke in drawing.strokes:
        pen_width = None if stroke.width is None else stroke.width * scale
        xy = (stroke.xy - (corner - edge / scale)) * scale
        strokes.append(dataclasses.replace(stroke, xy=xy, width=pen_width))
    page = Page(width * scale + 2 * edge[0], height * scale + 2 * edge[1], drawing.page.name)
    shrunk = [round(share * float(scale), 2) for share in drawing.about.get("shrunk", [1.0])]
    about = {**drawing.about, "shrunk": shrunk} if scale < 1 else drawing.about
    return dataclasses.replace(drawing, strokes=tuple(strokes), page=page, about=about)
