"""What is printed or punched on a sheet that is to be written on: lines, headings, signs, holes; what room is left.

The picture may be a scan or a photograph, unevenly lit, a little turned, or seen at an angle.  The page is cut into
narrow upright strips; a line is a chain of peaks from strip to strip, so that each line has a slope of its own.
Lines are rules, squares and margin lines; all else that is printed are areas to be kept clear of.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.peaks import peaks
from handout.values import Array, Indices


@dataclass(frozen=True)
class LineSearch:
    """What counts as a printed line; set by eye on pictures of lined, squared and plain paper."""

    scale: float = 6.0  # pixels a mm at which lines are looked for
    paper: float = 3.5  # mm whose median is the paper around a place: wider than any printed line
    along: float = 5.0  # mm that are averaged along a line
    beside: float = 0.7  # mm from the middle of a line to where there is paper again
    strips: int = 40  # that a page is cut into
    noise: float = 4.0  # standard deviations of a strip's profile above which a peak may be a line
    faintest: float = 0.006  # of the paper's light that a line takes at least, averaged over `_SEARCH.along`
    steepest: float = 0.12  # slope
    crooked: float = 1.0  # mm from a straight line: a chain that leaves it further has jumped to another line
    turn: float = 0.008  # greatest difference in slope from the lines beside it
    skipped: int = 6  # strips in a row in which a line may be hidden
    share: float = 0.5  # of the strips, in which a line must be seen
    near: float = 0.6  # mm from where a line is expected in the next strip
    pale: float = 0.4  # of the contrast of the strongest lines: paler lines are noise
    uneven: float = 0.22  # of the distance of lines: a line further from an even row does not belong to it
    fewest: int = 3  # lines in a row: two do not tell that distances are even
    seen: float = 0.75  # share of the strips, median of the rules: lines of writing are seen in 0.5 to 0.7 of them
    heavier: float = 1.35  # times the contrast of the fine lines between them
    pitches: tuple[float, float] = (4.5, 20.0)  # mm: what people write on
    other_colour: float = 0.12  # rad: least angle between the colours of a margin line and of the rest
    colour_spread: float = 4.0  # the same, times how much the colours of the rest differ
    stronger: float = 1.7  # times the contrast of the other lines: a margin line's


_SEARCH = LineSearch()


@dataclass(frozen=True, eq=False)
class PrintedLine:
    """One line, in the direction along which it is looked for.

    at, slope : where it crosses the middle of the page, mm, and how it leaves it (tangent).
    start, end : mm, from where to where it is seen.
    colour : (3,) float: share of the light that it takes, averaged along it.
    bend : mm that it leaves a straight line by, at most.
    seen : share of the page's strips that it is seen in.
    """

    at: float
    slope: float
    start: float
    end: float
    colour: Array
    bend: float
    seen: float

    @property
    def contrast(self) -> float:
        """How much light it takes."""
        return float(np.linalg.norm(self.colour))


@dataclass(frozen=True, eq=False)
class PrintedSheet:
    """What is printed on a sheet, mm from its upper left corner.

    rules : the lines to write on, from the top.
    pitch : distance of rules.
    fine : distance of the finest lines that run across: less than `pitch` where only every so many are heavy.
    columns : distance of lines that run down, of squared paper; None if there are none.
    left, right : margin lines, where they come furthest in; None without.
    across, down : all lines that it is made of: rules and the finer ones between them; columns and margin lines.
    """

    rules: tuple[PrintedLine, ...]
    pitch: float
    fine: float
    columns: float | None
    left: float | None
    right: float | None
    across: tuple[PrintedLine, ...] = ()
    down: tuple[PrintedLine, ...] = ()


def find_printed_lines(rgb: NDArray[np.uint8], width: float, height: float) -> PrintedSheet | None:
    """The lines of a sheet of `width` × `height` mm that fills a picture; None if it has no rules that can be told."""
    across = _lines(_light_taken(rgb, width, height), width)
    row = _evenly(_strong(across), _SEARCH.fewest)
    if row is None:
        return None
    rules, fine = _heavy(*row)
    if len(rules) < 2:
        return None
    pitch = _pitch(rules)
    least, most = _SEARCH.pitches
    if not least <= pitch <= most or float(np.median([rule.seen for rule in rules])) < _SEARCH.seen:
        return None
    down = _lines(_light_taken(np.ascontiguousarray(rgb.transpose(1, 0, 2)), height, width), height)
    columns, margins = _columns(down, rules)
    # where the margin lines come furthest in, left and right
    ends = [(line.at - abs(line.slope) * height / 2, line.at + abs(line.slope) * height / 2) for line in margins]
    left = max((high for (low, high) in ends if 0.03 * width < high < 0.35 * width), default=None)
    right = min((low for (low, high) in ends if 0.65 * width < low < 0.97 * width), default=None)
    distance = _pitch(columns) if columns else None
    return PrintedSheet(rules, pitch, fine, distance, left, right, (*row[0], *rules), (*columns, *margins))


def _light_taken(rgb: NDArray[np.uint8], width: float, height: float) -> NDArray[np.float32]:
    """(h, w, 3): the share of light that is missing in what runs across, against the paper above and below."""
    size = (max(8, round(width * _SEARCH.scale)), max(8, round(height * _SEARCH.scale)))
    kind = cv2.INTER_AREA if size[0] < rgb.shape[1] else cv2.INTER_LINEAR
    small = np.asarray(cv2.resize(rgb, size, interpolation=kind), dtype=np.uint8)
    paper = np.asarray(cv2.medianBlur(small, 2 * round(_SEARCH.paper * _SEARCH.scale / 2) + 1), dtype=np.float32)
    absorbed = np.clip(1 - small.astype(np.float32) / np.maximum(paper, 16), -0.3, 0.3)
    along = 2 * round(_SEARCH.along * _SEARCH.scale / 2) + 1
    absorbed = np.asarray(cv2.blur(absorbed, (along, 1)), dtype=np.float32)
    off = round(_SEARCH.beside * _SEARCH.scale)
    beside = (np.roll(absorbed, off, axis=0) + np.roll(absorbed, -off, axis=0)) / 2
    return np.asarray(absorbed - beside, dtype=np.float32)


def _lines(absorbed: NDArray[np.float32], length: float) -> list[PrintedLine]:
    """All lines that run across a page `length` mm wide."""
    strips = np.array_split(np.arange(absorbed.shape[1]), _SEARCH.strips)
    middles = np.array([strip.mean() + 0.5 for strip in strips]) / _SEARCH.scale
    profiles = np.stack([absorbed[:, strip].mean(axis=1) for strip in strips])  # (strips, h, 3)
    heights = [_peaks(profile) for profile in profiles]
    # the slope at which most peaks of neighbouring strips follow each other
    slopes = np.linspace(-_SEARCH.steepest, _SEARCH.steepest, 97)
    votes = np.zeros(len(slopes))
    for apart in (3, 6):
        for a, b in ((i, i + apart) for i in range(_SEARCH.strips - apart)):
            step = middles[b] - middles[a]
            slopes_between = (heights[b][None, :] - heights[a][:, None]).ravel() / step
            votes += (np.abs(slopes_between[:, None] - slopes) < 0.15 / step).sum(axis=0)
    best = np.flatnonzero(votes >= 0.98 * votes.max())
    slope = float(slopes[best].mean()) if votes.max() > 0 else 0.0
    free = [np.ones(len(peaks), dtype=bool) for peaks in heights]
    # what is seen in half of the strips is seen in one of these
    seed_strips = range(_SEARCH.strips // 4, 3 * _SEARCH.strips // 4, 2)
    from_middle = sorted(seed_strips, key=lambda s: abs(s - _SEARCH.strips // 2))
    seeds = [(s, k) for s in from_middle for k in range(len(heights[s]))]
    lines = []
    for s, k in seeds:
        if free[s][k]:
            chain = _follow_chain(s, k, heights, free, middles, slope)
            for strip, peak in chain:
                free[strip][peak] = False
            line = _fit_line(chain, heights, middles, profiles, length)
            if line is not None:
                lines.append(line)
    return _parallel(sorted(lines, key=lambda line: line.at))


def _parallel(lines: list[PrintedLine]) -> list[PrintedLine]:
    """The lines that slope as their neighbours do: a line that runs out of the picture is measured badly."""
    slope = np.array([line.slope for line in lines])
    if len(lines) < 2 * _SEARCH.fewest:  # a margin line and the sheet's edge say nothing of each other
        return lines
    near = [np.median(np.delete(slope, k)[max(0, k - 3) : k + 3]) for k in range(len(slope))]
    return [line for line, usual in zip(lines, near, strict=True) if abs(line.slope - usual) < _SEARCH.turn]


def _peaks(profile: NDArray[np.float32]) -> Array:
    """Heights, mm, at which a strip's profile (h, 3) has lines."""
    total = np.linalg.norm(np.maximum(profile, 0), axis=1)
    # most of a profile is paper, whose noise the middle of its values tells
    spread = 1.4826 * float(np.median(np.abs(total - np.median(total))))
    floor = max(float(np.median(total)) + _SEARCH.noise * spread, _SEARCH.faintest)
    at = peaks(total.astype(np.float64), prominence=0.5 * floor, apart=3)
    at = at[(total[at] > floor) & (at > 1) & (at < len(total) - 2)]
    before, middle, after = total[at - 1], total[at], total[at + 1]
    curve = np.maximum(2 * middle - before - after, 1e-9)
    return np.asarray((at + 0.5 + 0.5 * (after - before) / curve) / _SEARCH.scale)


def _follow_chain(
    s: int, k: int, heights: list[Array], free: list[NDArray[np.bool_]], middles: Array, slope: float
) -> list[tuple[int, int]]:
    """The chain of peaks through one peak, to both sides: (strip, number) of each."""
    chain = [(s, k)]
    for direction in (1, -1):
        links, tilt, skipped = [(s, k)], slope, 0
        for strip in range(s + direction, _SEARCH.strips if direction > 0 else -1, direction):
            last, number = links[-1]
            if len(links) > 4:
                x0, n0 = links[max(0, len(links) - 9)]
                tilt = float((heights[last][number] - heights[x0][n0]) / (middles[last] - middles[x0]))
            expected = heights[last][number] + tilt * (middles[strip] - middles[last])
            off = np.where(free[strip], np.abs(heights[strip] - expected), np.inf)
            if len(off) and off.min() < _SEARCH.near:
                links.append((strip, int(off.argmin())))
                skipped = 0
            else:
                skipped += 1
                if skipped > _SEARCH.skipped:
                    break
        chain += links[1:]
    return chain


def _fit_line(
    chain: list[tuple[int, int]], heights: list[Array], middles: Array, profiles: NDArray[np.float32], length: float
) -> PrintedLine | None:
    """The straight line through the peaks that belong together, if there are enough of them."""
    if len(chain) < _SEARCH.share * _SEARCH.strips:
        return None
    strips = np.array([strip for strip, _ in chain], dtype=np.intp)
    x, y = middles[strips], np.array([heights[strip][peak] for strip, peak in chain])
    inliers = np.ones(len(x), dtype=bool)
    for _ in range(3):
        slope, start = np.polyfit(x[inliers], y[inliers], 1)
        residuals = np.abs(y - start - slope * x)
        inliers = residuals <= max(3 * float(np.median(residuals)), 0.1)
    rows = np.clip((y * _SEARCH.scale - 0.5).round().astype(np.intp), 0, profiles.shape[1] - 1)
    colour = np.median(profiles[strips, rows], axis=0).astype(np.float64)
    half = 0.5 * (middles[1] - middles[0])
    at = float(start + slope * 0.5 * length)
    bend = float(np.percentile(residuals, 90))
    if bend > _SEARCH.crooked:
        return None
    return PrintedLine(at, float(slope), x.min() - half, x.max() + half, colour, bend, len(x) / _SEARCH.strips)


def _strong(lines: list[PrintedLine]) -> list[PrintedLine]:
    """The lines without those that are far paler than the strongest."""
    if not lines:
        return []
    most = float(np.percentile([line.contrast for line in lines], 90))
    return [line for line in lines if line.contrast > _SEARCH.pale * most]


def _evenly(lines: list[PrintedLine], fewest: int) -> tuple[list[PrintedLine], Indices] | None:
    """The lines that stand in one row of even, or evenly growing, distances, and the place of each in it."""
    if len(lines) < fewest:
        return None
    at = np.array([line.at for line in lines])
    best: tuple[float, list[PrintedLine], Indices] | None = None
    for pitch in np.unique(np.round(np.diff(at), 1)):
        if pitch < 0.9:
            continue
        place, standing = _places(at, float(pitch))
        if standing.sum() < fewest:
            continue
        span = int(np.ptp(place[standing])) + 1
        worth = standing.sum() * min(1.0, standing.sum() / (0.75 * span))
        if best is None or worth > best[0] + 0.5:
            row = [line for line, in_row in zip(lines, standing, strict=True) if in_row]
            best = (float(worth), row, place[standing])
    return None if best is None or best[0] < fewest else best[1:]


def _places(at: Array, pitch: float) -> tuple[Indices, NDArray[np.bool_]]:
    """Place (n,) of each line in a row of about that distance, and whether it stands in it."""
    best: tuple[int, Indices, NDArray[np.bool_]] = (0, np.zeros(len(at), dtype=np.intp), np.zeros(len(at), dtype=bool))
    for first in range(len(at)):
        # from one line to the next, so that distances may grow as they do at an angle
        place, last, standing, step = np.zeros(len(at), dtype=np.intp), at[first], np.zeros(len(at), dtype=bool), pitch
        standing[first], number = True, 0
        for k in range(first + 1, len(at)):
            parts = (at[k] - last) / step
            if parts >= 0.7 and abs(parts - round(parts)) < _SEARCH.uneven:
                number += round(parts)
                place[k], standing[k] = number, True
                step = 0.7 * step + 0.3 * (at[k] - last) / round(parts)
                last = at[k]
        if standing.sum() > best[0]:
            best = (int(standing.sum()), place, standing)
    return best[1], best[2]


def _heavy(lines: list[PrintedLine], place: Indices) -> tuple[tuple[PrintedLine, ...], float]:
    """The lines to write on, all or those every few that are heavier, none missing; and the finest distance."""
    fine = float(np.median(np.diff([line.at for line in lines]) / np.diff(place)))
    contrast = np.array([line.contrast for line in lines])
    # which lines may be those to write on: every so many, from one on, the closest first
    apart = [every for every in range(2, 11) if _SEARCH.pitches[0] <= every * fine <= _SEARCH.pitches[1]]
    classes = [(every, first) for every in apart if np.ptp(place) >= 2 * every for first in range(every)]
    ratios = {(every, first): _ratio(contrast, place % every == first) for every, first in classes}
    best = max(ratios.values(), default=0.0)
    # every second one of the heavy lines is as heavy as all of them
    every, first = next((c for c, ratio in ratios.items() if ratio > max(_SEARCH.heavier, 0.8 * best)), (1, 0))
    heavy_lines = place % every == first
    if every > 1:  # without what has the place of a heavy line but is none
        heavy_lines &= contrast > np.sqrt(np.median(contrast[heavy_lines]) * np.median(contrast[~heavy_lines]))
    line_at = {int(p): line for p, line, heavy in zip(place, lines, heavy_lines, strict=True) if heavy}
    return _fill_row(line_at, every), fine


def _ratio(contrast: Array, among: NDArray[np.bool_]) -> float:
    """How many times the contrast of the rest some lines have; 0 where many of the rest have as much."""
    if among.sum() < _SEARCH.fewest - 1 or among.all():
        return 0.0
    heavy, others = float(np.median(contrast[among])), contrast[~among]
    return heavy / max(float(np.median(others)), 1e-9) if heavy > 1.1 * np.percentile(others, 80) else 0.0


def _fill_row(seen_lines: dict[int, PrintedLine], every: int) -> tuple[PrintedLine, ...]:
    """The lines of a row, with those between two that were not seen."""
    places = np.array(sorted(seen_lines))
    interpolated = partial(np.interp, xp=places)
    names = ("at", "slope", "start", "end", "bend", "seen")
    values = [[getattr(seen_lines[int(p)], name) for p in places] for name in names]
    lines = []
    for place in range(int(places[0]), int(places[-1]) + 1, every):
        if place in seen_lines:
            lines.append(seen_lines[place])
            continue
        at, slope, start, end, bend, visible = (float(interpolated(place, fp=row)) for row in values)
        lines.append(PrintedLine(at, slope, start, end, np.zeros(3), bend, visible))
    return tuple(lines)


def _pitch(rules: tuple[PrintedLine, ...]) -> float:
    return float(np.median(np.diff([rule.at for rule in rules])))


def _columns(
    down: list[PrintedLine], rules: tuple[PrintedLine, ...]
) -> tuple[tuple[PrintedLine, ...], list[PrintedLine]]:
    """The lines that run down evenly, if there are any, and those that are margin lines."""
    down = _strong(down)
    row = _evenly(down, 5)
    usual = [line.colour for line in row[0]] if row else [rule.colour for rule in rules if rule.contrast > 0]
    direction = np.median(usual, axis=0)
    direction = direction / max(float(np.linalg.norm(direction)), 1e-9)
    strength = float(np.median([np.linalg.norm(colour) for colour in usual]))
    turned = [float(np.arccos(np.clip(line.colour @ direction / max(line.contrast, 1e-9), -1, 1))) for line in down]
    least = max(_SEARCH.other_colour, _SEARCH.colour_spread * float(np.median(turned))) if row else 0.0
    margins = [
        line
        for line, angle in zip(down, turned, strict=True)
        if (angle > least or line.contrast > _SEARCH.stronger * strength) and line.seen >= _SEARCH.seen
    ]
    return (tuple(row[0]) if row else ()), margins


Area = tuple[float, float, float, float]  # left, top, right, bottom, mm


@dataclass(frozen=True)
class AreaSearch:
    """What counts as print; set by eye on letterheads, forms and punched sheets, scanned and photographed."""

    scale: float = 4.0  # pixels a mm at which print is looked for
    coarse: float = 1.0  # pixels a mm at which the paper is
    grain: float = 7.0  # mm: print that is narrower hides no paper
    paper: float = 61.0  # mm whose median is the paper around a place: wider than any sign
    dark: float = 0.14  # share of light, in any channel, that print or a hole takes
    bright: float = 0.3  # share by which a hole over something white is brighter than tinted paper
    rim: float = 1.5  # mm along the edges of the sheet, where shadows and the ground lie
    beside_line: float = 0.5  # mm on either side of a line that is to be written on
    apart: float = 3.0  # mm: what is closer is one area
    least: float = 2.5  # mm, of an area's longer side: less is a speck
    least_ink: float = 2.0  # mm² of ink in it
    stray: tuple[float, float] = (3.0, 1.2)  # mm: length at least and width at most of what is left of a sheet's lines
    beside: int = 3  # mm left free beside print
    above: int = 2  # mm left free above and below it
    room: float = 0.2  # of the sheet inside its margins that has to be left; else it is printed all over


_AREA_SEARCH = AreaSearch()


def find_print(
    rgb: NDArray[np.uint8], width: float, height: float, lines: PrintedSheet | None = None
) -> NDArray[np.bool_]:
    """(height, width), a cell a mm: where a sheet is printed on, or punched; `lines` of it are to be written on."""
    size = (max(8, round(width * _AREA_SEARCH.scale)), max(8, round(height * _AREA_SEARCH.scale)))
    small = np.asarray(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    # (h, w, 3): the bare sheet, as it is lit
    coarse = (max(8, round(width * _AREA_SEARCH.coarse)), max(8, round(height * _AREA_SEARCH.coarse)))
    image = cv2.resize(rgb, coarse, interpolation=cv2.INTER_AREA)
    grain = 2 * round(_AREA_SEARCH.grain * _AREA_SEARCH.coarse / 2) + 1
    bare = cv2.morphologyEx(image, cv2.MORPH_CLOSE, np.ones((grain, grain), np.uint8))
    window = 2 * round(_AREA_SEARCH.paper * _AREA_SEARCH.coarse / 2) + 1
    bare = cv2.medianBlur(np.asarray(bare, dtype=np.uint8), window)
    light = small / np.maximum(np.asarray(cv2.resize(bare, size, interpolation=cv2.INTER_LINEAR), dtype=np.float32), 16)
    ink = (light.min(axis=2) < 1 - _AREA_SEARCH.dark) | (light.min(axis=2) > 1 + _AREA_SEARCH.bright)
    if lines is not None:
        # (h, w): where the lines of the sheet are
        on = np.zeros(size[::-1], dtype=bool)
        _mark(on, lines.across)
        _mark(on.T, lines.down)
        ink &= ~(on | _stray_lines(ink))
    rim = round(_AREA_SEARCH.rim * _AREA_SEARCH.scale)
    ink[:rim] = ink[-rim:] = False
    ink[:, :rim] = ink[:, -rim:] = False
    reach = 2 * round(_AREA_SEARCH.apart * _AREA_SEARCH.scale / 2) + 1
    joined = cv2.morphologyEx(ink.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((reach, reach), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(np.asarray(joined), connectivity=8)
    inked = np.bincount(labels[ink], minlength=count) / _AREA_SEARCH.scale**2
    found = (inked > _AREA_SEARCH.least_ink) & (stats[:, 2:4].max(axis=1) > _AREA_SEARCH.least * _AREA_SEARCH.scale)
    found[0] = False
    cells = (max(1, round(width)), max(1, round(height)))
    printed = cv2.resize(found[labels].astype(np.float32), cells, interpolation=cv2.INTER_AREA)
    return np.asarray(printed > 0)


def _stray_lines(ink: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(h, w): thin level and upright lines, such as are left of squares that bend with their sheet."""
    long, thick = (2 * round(side * _AREA_SEARCH.scale / 2) + 1 for side in _AREA_SEARCH.stray)
    pixels = ink.astype(np.uint8)

    def open_mask(shape: tuple[int, int]) -> NDArray[np.bool_]:
        return np.asarray(cv2.morphologyEx(pixels, cv2.MORPH_OPEN, np.ones(shape, np.uint8)) > 0)

    return (open_mask((1, long)) | open_mask((long, 1))) & ~open_mask((thick, thick))


def _mark(on: NDArray[np.bool_], lines: Sequence[PrintedLine]) -> None:
    """Mark lines that run along the second axis."""
    along = (np.arange(on.shape[1]) + 0.5) / _AREA_SEARCH.scale
    rows = (np.arange(on.shape[0])[:, None] + 0.5) / _AREA_SEARCH.scale
    for line in lines:
        at = line.at + line.slope * (along - 0.5 * on.shape[1] / _AREA_SEARCH.scale)
        reach = _AREA_SEARCH.beside_line + line.bend
        first, last = (round(float(side) * _AREA_SEARCH.scale) for side in (at.min() - reach - 1, at.max() + reach + 1))
        part = slice(max(first, 0), max(last, 0))
        on[part] |= np.abs(rows[part] - at) < reach


def free_area(printed: NDArray[np.bool_], within: Area) -> Area | None:
    """The rectangle within another that keeps clear of print and has most room; None where hardly any is left.

    Of two as large the wider has more room: its height times the square of its width is compared.

    printed : as `find_print` gives it.

    Rectangles of ones are found from the heights of the columns of ones over each row: on a stack of rising
    heights every rectangle that cannot be widened is met once.
    """
    left, top, right, bottom = within
    clear = np.ones((2 * _AREA_SEARCH.above + 1, 2 * _AREA_SEARCH.beside + 1), np.uint8)
    free = cv2.dilate(printed.astype(np.uint8), clear)[round(top) : round(bottom), round(left) : round(right)] == 0
    if free.all():
        return within
    best, answer = 0.0, None
    heights = np.zeros(free.shape[1], dtype=np.int64)
    for row, cells in enumerate(free):
        heights = np.where(cells, heights + 1, 0)
        stack: list[tuple[int, int]] = []  # where a column of at least some height begins, and the height
        for column, height in enumerate([*heights.tolist(), 0]):
            begin = column
            while stack and stack[-1][1] >= height:
                begin, tall = stack.pop()
                if tall * (column - begin) ** 2 > best and tall * (column - begin) > _AREA_SEARCH.room * free.size:
                    best = tall * (column - begin) ** 2
                    answer = (left + begin, top + row + 1 - tall, left + column, top + row + 1)
            stack.append((begin, height))
    return answer
