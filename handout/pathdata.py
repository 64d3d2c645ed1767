"""The outlines of SVG: path data and basic shapes as cubic Béziers, and those as points.

Everything becomes cubics, since what an affine map does to a cubic is done to its points; a path of k of them is an
array (3 k + 1, 2): knot, handle, handle, knot, …

Kept by hand: `handout.sources.svg` says what svgelements lacks.

Source: SVG 1.1, §8.3 (path data), §9 (basic shapes), appendix F.6 (arcs).
"""

from __future__ import annotations

import math
import re
from itertools import groupby

import numpy as np

from handout.errors import InputError
from handout.values import Array

_COMMAND = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])([^MmZzLlHhVvCcSsQqTtAa]*)")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_FLAG, _BETWEEN = re.compile("[01]"), re.compile(r"[\s,]*")
_JOINED = "LlHhVvCcSsQqTt"
_MOST = 1_000_000  # commands
_TAKES = {"m": 2, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "z": 0}
_STRAIGHT, _ANCHOR = 1.0, 0.2  # mm: what is long and straight, and how near to its ends points are set
_ARC_STEP = math.pi / 4  # of an arc that one cubic follows: to 4e-6 of its radius


def cubics(data: str) -> list[Array]:
    """The subpaths of path data, each (3 k + 1, 2); a closed one ends where it began.

    Raises InputError: path data that cannot be read; the message says where.
    """
    pen = _PathPen()
    lead, *rest = _COMMAND.split(data.strip())
    if lead.strip() or (rest and rest[0] not in "Mm"):
        raise InputError(f"path data must begin with M, not with {data.strip()[:20]!r}")
    if len(rest) > 3 * _MOST:
        raise InputError(f"path data has more than {_MOST} commands")
    for command, group in groupby(zip(rest[::3], rest[1::3], strict=True), key=lambda pair: pair[0]):
        texts = [text for _, text in group]
        joined = [" ".join(texts)] if command in _JOINED else texts  # a million commands are read as one
        for text in joined:
            try:
                pen.apply_command(command, arc_numbers(text) if command in "Aa" else numbers(text))
            except ValueError as error:
                raise InputError(f"path data cannot be read at {(command + text)[:24]!r}: {error}") from error
    pen.finish()
    return pen.paths


def numbers(text: str) -> list[float]:
    """The numbers in a text, separated by blanks, commas or their signs. Raises ValueError: something else is in it."""
    if _NUMBER.sub("", text).strip(" \t\r\n\f,"):
        raise ValueError("there is something that is not a number")
    return [float(number) for number in _NUMBER.findall(text)]


def arc_numbers(text: str) -> list[float]:
    """The numbers of arcs, whose flags (the fourth and fifth of seven) need nothing between them.

    Raises ValueError: something else is in it.
    """
    found: list[float] = []
    at = _skip_match(_BETWEEN, text, 0)
    while at < len(text):
        match = (_FLAG if len(found) % 7 in (3, 4) else _NUMBER).match(text, at)
        if match is None:
            raise ValueError("an arc takes seven numbers, the fourth and fifth of them 0 or 1")
        found.append(float(match.group()))
        at = _skip_match(_BETWEEN, text, match.end())
    return found


def _skip_match(pattern: re.Pattern[str], text: str, at: int) -> int:
    match = pattern.match(text, at)
    return at if match is None else match.end()


class _PathPen:
    """Follows the commands of path data."""

    def __init__(self) -> None:
        self.at = self.start = np.zeros(2)
        self.handle: tuple[str, Array] | None = None  # the last handle, and whether of a cubic or a quadratic
        self.parts: list[Array] = []
        self.paths: list[Array] = []
        self.closed = False

    def apply_command(self, command: str, given: list[float]) -> None:
        kind, relative = command.lower(), command.islower()
        takes = 7 if kind == "a" else _TAKES[kind]
        if kind == "z":
            if given:
                raise ValueError("Z takes no numbers")
            self.close()
            return
        if not given or len(given) % takes:
            raise ValueError(f"{command} takes {takes} number{'s' if takes > 1 else ''}, or a multiple of that")
        if not all(map(math.isfinite, given)):
            raise ValueError("a number is too large")
        rows = np.array(given).reshape(-1, takes)
        if kind == "m":
            self.move(rows[0] + self.at if relative else rows[0])
            kind, rows = "l", rows[1:]
        if not len(rows):
            return
        if not self.parts:
            self.parts.append(self.at[None])
        self.closed = False
        getattr(self, f"_{kind}")(rows, relative)
        if kind not in "csqt":
            self.handle = None

    def move(self, to: Array) -> None:
        self.finish()
        self.at = self.start = to
        self.handle = None

    def close(self) -> None:
        if not self.parts:
            self.parts.append(self.at[None])
        if (self.at != self.start).any() or len(self.parts) == 1:
            self._l(self.start[None], False)
        self.finish()
        self.handle = None

    def finish(self) -> None:
        if len(self.parts) > 1:
            self.paths.append(np.concatenate(self.parts))
        self.parts = []

    def _add(self, first: Array, second: Array, ends: Array) -> None:
        """Cubics by their handles and ends, each (k, 2)."""
        self.parts.append(np.stack([first, second, ends], axis=1).reshape(-1, 2))
        self.at = ends[-1]

    def _l(self, ends: Array, relative: bool) -> None:
        ends = self.at + np.cumsum(ends, axis=0) if relative else ends
        starts = np.concatenate([self.at[None], ends[:-1]])
        self._add(starts + (ends - starts) / 3, starts + (ends - starts) * (2 / 3), ends)

    def _h(self, rows: Array, relative: bool) -> None:
        self._draw_along(0, rows[:, 0], relative)

    def _v(self, rows: Array, relative: bool) -> None:
        self._draw_along(1, rows[:, 0], relative)

    def _draw_along(self, axis: int, values: Array, relative: bool) -> None:
        ends = np.repeat(self.at[None], len(values), axis=0)
        ends[:, axis] = self.at[axis] + np.cumsum(values) if relative else values
        self._l(ends, False)

    def _c(self, rows: Array, relative: bool) -> None:
        points = rows.reshape(-1, 3, 2)
        if relative:
            ends = self.at + np.cumsum(points[:, 2], axis=0)
            points = points + np.concatenate([self.at[None], ends[:-1]])[:, None]
        self._add(points[:, 0], points[:, 1], points[:, 2])
        self.handle = ("c", points[-1, 1])

    def _s(self, rows: Array, relative: bool) -> None:
        for row in rows:
            second, end = (row.reshape(2, 2) + self.at) if relative else row.reshape(2, 2)
            first = self._mirror_handle("c")
            self._add(first[None], second[None], end[None])
            self.handle = ("c", second)

    def _q(self, rows: Array, relative: bool) -> None:
        for row in rows:
            middle, end = (row.reshape(2, 2) + self.at) if relative else row.reshape(2, 2)
            self._quadratic(middle, end)

    def _t(self, rows: Array, relative: bool) -> None:
        for row in rows:
            self._quadratic(self._mirror_handle("q"), row + self.at if relative else row)

    def _quadratic(self, middle: Array, end: Array) -> None:
        self._add((self.at + (middle - self.at) * (2 / 3))[None], (end + (middle - end) * (2 / 3))[None], end[None])
        self.handle = ("q", middle)

    def _mirror_handle(self, kind: str) -> Array:
        if self.handle is None or self.handle[0] != kind:
            return self.at
        return 2 * self.at - self.handle[1]

    def _a(self, rows: Array, relative: bool) -> None:
        for rx, ry, turn, large, sweep, x, y in rows.tolist():
            end = np.array([x, y]) + (self.at if relative else 0.0)
            bent = _arc(self.at, end, abs(rx), abs(ry), math.radians(turn), large > 0, sweep > 0)
            if bent is None:
                self._l(end[None], False)
            else:
                self._add(*bent)
                self.at = end


def _arc(
    start: Array, end: Array, rx: float, ry: float, turn: float, large: bool, sweep: bool
) -> tuple[Array, Array, Array] | None:
    """Handles and ends of the cubics of an elliptic arc; None where it is a straight line.

    Source: SVG 1.1, appendix F.6.
    """
    if rx == 0 or ry == 0 or (start == end).all():
        return None
    axes = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]) * (rx, ry)
    half = np.linalg.solve(axes, (start - end) / 2)  # on the unit circle from here on
    square = float(half @ half)
    if square > 1:
        axes, half, square = axes * math.sqrt(square), half / math.sqrt(square), 1.0
    away = math.sqrt(max(0.0, 1 / square - 1)) * (1 if large != sweep else -1)
    centre = away * np.array([half[1], -half[0]])
    begin = math.atan2(*(half - centre)[::-1])
    sweep_by = (math.atan2(*(-half - centre)[::-1]) - begin) % (2 * math.pi)
    if not sweep:
        sweep_by -= 2 * math.pi
    pieces = max(1, math.ceil(abs(sweep_by) / _ARC_STEP - 1e-9))
    angle = begin + sweep_by * np.arange(pieces + 1) / pieces
    reach = 4 / 3 * math.tan(sweep_by / pieces / 4)
    unit = np.column_stack([np.cos(angle), np.sin(angle)])
    ahead = reach * np.column_stack([-np.sin(angle), np.cos(angle)])
    first, second, ends = unit[:-1] + ahead[:-1], unit[1:] - ahead[1:], unit[1:]
    middle = (start + end) / 2 + axes @ centre
    found = first @ axes.T + middle, second @ axes.T + middle, ends @ axes.T + middle
    found[2][-1] = end
    return found


def polyline(points: Array, closed: bool = False) -> Array:
    """Straight lines through points (n, 2) as cubics."""
    points = np.concatenate([points, points[:1]]) if closed else points
    pen = _PathPen()
    pen.at, pen.parts = points[0], [points[:1]]
    pen._l(points[1:] if len(points) > 1 else points, False)
    return np.concatenate(pen.parts)


def ellipse(cx: float, cy: float, rx: float, ry: float) -> Array:
    """A whole ellipse, from its right on towards positive y."""
    data = f"M{cx + rx!r} {cy!r}A{rx!r} {ry!r} 0 0 1 {cx - rx!r} {cy!r}A{rx!r} {ry!r} 0 0 1 {cx + rx!r} {cy!r}"
    return cubics(data)[0]


def rectangle(x: float, y: float, width: float, height: float, rx: float, ry: float) -> Array:
    """A rectangle, its corners rounded by rx and ry, from the upper left on to the right."""
    if rx <= 0 or ry <= 0:
        corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
        return polyline(np.array(corners, dtype=float), closed=True)
    rx, ry = min(rx, width / 2), min(ry, height / 2)
    arc = f"a{rx!r} {ry!r} 0 0 1 "
    right, down = f"h{width - 2 * rx!r}", f"v{height - 2 * ry!r}"
    left, up = f"h{2 * rx - width!r}", f"v{2 * ry - height!r}"
    return cubics(
        f"M{x + rx!r} {y!r}{right}{arc}{rx!r} {ry!r}{down}{arc}{-rx!r} {ry!r}{left}{arc}{-rx!r} {-ry!r}{up}"
        f"{arc}{rx!r} {-ry!r}z"
    )[0]


def flatten_path(path: Array, tolerance: float) -> tuple[Array, Array]:
    """A path of cubics as points that stay within `tolerance` of it.

    Returns points : (n, 2) float.
        at : (n,) float: where on the path each point is: k + u on the cubic number k at its parameter u.

    Between two points at distance h in the parameter a curve departs from its chord by h²/8 of its greatest second
    derivative at most, and that of a cubic is greatest at one of its ends.
    """
    knots, first, second, ends = path[:-1:3], path[1::3], path[2::3], path[3::3]
    bend = np.maximum(np.hypot(*(knots - 2 * first + second).T), np.hypot(*(first - 2 * second + ends).T))
    pieces = np.maximum(np.ceil(np.sqrt(6 * bend / (8 * tolerance))), 1).astype(np.intp)
    cubic = np.repeat(np.arange(len(pieces)), pieces)
    count = np.arange(len(cubic)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1
    u = (count / pieces[cubic])[:, None]
    v = 1 - u
    points = v**3 * knots[cubic] + 3 * v**2 * u * first[cubic] + 3 * v * u**2 * second[cubic] + u**3 * ends[cubic]
    last = count == pieces[cubic]
    points[last] = ends
    return np.concatenate([path[:1], points]), np.concatenate([[0.0], cubic + u[:, 0]])


def points_needed(paths: list[Array], tolerance: float) -> float:
    """How many points `flatten_path` would give, roughly; asked before they are made."""
    total = 0.0
    for path in paths:
        a, b, c, d = path[:-1:3], path[1::3], path[2::3], path[3::3]
        bend = np.maximum(np.abs(a - 2 * b + c).sum(axis=1), np.abs(b - 2 * c + d).sum(axis=1))
        total += float(np.maximum(np.sqrt(6 * bend / (8 * tolerance)), 1).sum())
    return total


def anchor_ends(points: Array) -> Array:
    """A polyline (n, 2), mm, with more points on it, near both ends of all that is long and straight.

    What draws strokes as smooth curves takes samples for points of one, as a hand's are; so it keeps the corners.
    """
    step = np.diff(points, axis=0)
    size = np.hypot(*step.T)
    long = np.flatnonzero(size > _STRAIGHT)
    near = step[long] * (_ANCHOR / size[long])[:, None]
    where = np.repeat(long + 1, 2)
    more = np.stack([points[long] + near, points[long + 1] - near], axis=1).reshape(-1, 2)
    return np.asarray(np.insert(points, where, more, axis=0))
