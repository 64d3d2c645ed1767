"""The test sheet of a machine: everything that a person has to see to set it up, on one page, and how it is read.

Its panels have lines and words of their own; each shows one thing that a person can set.  All take the scale at which
the sheet is drawn (1 on a page of A5), which changes room and letters but never what is measured: a side of 80 is 80 mm
long, a step of a vernier 0.05 mm.  They are packed on the page; their words are written by hands of the house.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from handout import __version__, page_sizes
from handout.errors import DoesNotFit
from handout.hand.library import load
from handout.motion.trace import trace
from handout.plotting import bed
from handout.plotting.dialects import dialect
from handout.profiles import Plotter
from handout.values import Array, Drawing, Line, Manuscript, Page, Placed, Stroke
from handout.writing.compose import compose
from handout.writing.layout import Layout


@dataclass(frozen=True)
class Caption:
    """Words on the sheet: x where they begin, y the line they stand on, mm; x_height: of the letters, mm."""

    text: str
    x: float
    y: float
    x_height: float


@dataclass(frozen=True, eq=False)
class Panel:
    """Lines in the order in which they have to be drawn, with words beside them; all in mm from its upper left corner.

    lines : each with a clock of its own.
    """

    name: str
    width: float
    height: float
    lines: tuple[Stroke, ...]
    captions: tuple[Caption, ...]


def line(points: Iterable[tuple[float, float]] | Array, speed: float, rest: float = 0.0) -> Stroke:
    """A line at a steady speed, mm/s; the pen rests so long on the paper, s, before it goes."""
    xy = np.asarray(list(points) if not isinstance(points, np.ndarray) else points, dtype=float)
    t = np.append(0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T))) / speed
    if rest > 0:
        t, xy = np.append(0.0, t + rest), np.concatenate([xy[:1], xy])
    return Stroke(t, xy)


def dot(x: float, y: float, rest: float) -> Stroke:
    """The pen comes down, stays so long, s, and goes up."""
    return Stroke(np.array([0.0, max(rest, 1e-3)]), np.array([[x, y], [x, y]]))


STEP = 0.05  # mm that a mark of the vernier stands for
_LOOSE = (-4, 12)  # marks of the vernier: play from -0.2 to 0.6 mm
_RESTS = (0, 50, 100, 200, 400)  # ms
_DOTS = (0, 20, 50, 100, 200, 400)  # ms
_TAILS = (10, 20, 50, 100, 200)  # ms
_ROWS = 6  # of the ladders
_EASY = 0.85  # of the speed that acceleration allows, so that what is written is what is drawn
_LETTERS = 1.5  # mm


def letters(scale: float) -> float:
    """x-height of the captions, mm."""
    return float(max(_LETTERS * scale, 0.9))


def pace(profile: Plotter) -> float:
    """Of all lines that do not test speed, mm/s."""
    return min(40.0, float(profile.limits.draw_speed))


def square(side: float, names: tuple[str, str], profile: Plotter, scale: float) -> Panel:
    """A square with its diagonals: sides to measure for steps/mm, diagonals for whether the axes are square."""
    size, speed = letters(scale), pace(profile)
    left, top = 0.0, 0.0
    right, bottom = left + side, top + side
    outline = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
    lines = (
        line(outline, speed),
        line([(left, top), (right, bottom)], speed),
        line([(right, top), (left, bottom)], speed),
    )
    captions = (
        Caption(f"{names[0]} {side:g} mm", left, bottom + 2.4 * size, size),
        Caption(f"{names[1]} {side:g}", left + size, top + side / 2 + size / 2, size),
        Caption(f"{side * math.sqrt(2):.1f}", right - 0.25 * side - 2 * size, bottom - 0.08 * side, size),
    )
    return Panel("square", side, side + 3.4 * size, lines, captions)


def vernier(along: int, name: str, profile: Plotter, scale: float) -> Panel:
    """Shows the play of an axis: marks drawn from one side, against marks from the other side 0.05 mm closer together.

    Where a pair of marks makes one straight line, its number is the play, mm.

    along : 0 for marks along x, 1 along y.
    """
    pitch, reach, size, speed = 2.6 * scale, 3.4 * scale, letters(scale), pace(profile)
    first, last = _LOOSE
    start = (1.5 - first) * pitch  # where mark 0 is
    middle = 1.35 * reach

    def mark(where: float, side: float, number: int) -> Array:
        length = reach * (1.3 if number % 4 == 0 else 1.0) * side
        points = np.array([[where, middle], [where, middle + length]])
        return points if along == 0 else points[:, ::-1]

    numbers = range(first, last + 1)
    lead = mark(start + (first - 1.2) * pitch, -0.4, 1), mark(start + (last + 1.2) * pitch, 0.4, 1)
    up = [mark(start + number * pitch, -1.0, number) for number in numbers]
    down = [mark(start + number * (pitch - STEP), 1.0, number) for number in reversed(numbers)]
    lines = tuple(line(points, speed) for points in [lead[0], *up, lead[1], *down])
    length, across = start + (last + 1.5) * pitch, middle + 1.3 * reach
    captions = []
    for number in range(0, last + 1, 4):
        text = f"{number * STEP:.1f}".replace("0.", ".", 1).replace("-.0", "0").replace(".0", "0")
        where = start + number * pitch
        x, y = (where - 0.6 * size, across + 2.3 * size) if along == 0 else (across + 0.8 * size, where + size / 2)
        captions.append(Caption(text, x, y, size))
    if along == 0:
        captions.append(Caption(f"{name} play", 0.0, across + 5.0 * size, size))
        return Panel(f"play {name}", length, across + 6.0 * size, lines, tuple(captions))
    captions.append(Caption(f"{name} play", 0.0, length + 2.6 * size, size))
    return Panel(f"play {name}", across + 5.0 * size, length + 3.6 * size, lines, tuple(captions))


def _ladder(greatest: float) -> list[float]:
    """Rising speeds up to a greatest, mm/s, as whole as they can be told."""
    whole = 5.0 if greatest >= 30 else 1.0
    greatest = max(math.floor(greatest / whole) * whole, whole)
    rungs = [whole * round(greatest * (row + 1) / _ROWS / whole) for row in range(_ROWS)]
    return sorted({max(rung, whole) for rung in rungs})


def straight(profile: Plotter, scale: float) -> Panel:
    """The same zigzag at rising speeds: where it gets rough is too fast (`limits.draw_speed`)."""
    size, length = letters(scale), 42.0 * scale
    limits, row = profile.limits, 3.1 * letters(scale)
    speeds = _ladder(min(float(limits.draw_speed), _EASY * math.sqrt(limits.acceleration * length)))
    x, top = 5.5 * size, 3.2 * size
    lines, captions = [], [Caption("mm/s", 0.0, 1.4 * size, size)]
    for number, speed in enumerate(speeds):
        y, step = top + number * row, row / 5
        zigzag = [(x, y), (x + length, y + step), (x, y + 2 * step), (x + length, y + 3 * step)]
        lines.append(line(zigzag, speed))
        captions.append(Caption(f"{speed:g}", 0.0, y + 1.4 * size, size))
    return Panel("straight", x + length, top + len(speeds) * row, tuple(lines), tuple(captions))


def loops(profile: Plotter, scale: float) -> Panel:
    """The same loops at rising speeds: where they get rough, acceleration is too great."""
    size, radius = letters(scale), 1.7 * scale
    speeds = _ladder(min(float(profile.limits.draw_speed), _EASY * math.sqrt(profile.limits.acceleration * radius)))
    x, top, row = 5.5 * size, 2.6 * size, 2.6 * radius
    turns, advance = 9, 2.0 * scale
    lines, captions = [], [Caption("mm/s", 0.0, 1.4 * size, size)]
    phi = np.linspace(0.0, 2 * math.pi * turns, 48 * turns)
    for number, speed in enumerate(speeds):
        y = top + number * row + 1.1 * radius
        xy = np.column_stack(
            [x + radius + advance * phi / (2 * math.pi) - radius * np.cos(phi), y + radius * np.sin(phi)]
        )
        lines.append(line(xy, speed))
        captions.append(Caption(f"{speed:g}", 0.0, y + size / 2, size))
    width = x + turns * advance + 2 * radius
    return Panel("loops", width, top + len(speeds) * row, tuple(lines), tuple(captions))


def starts(profile: Plotter, scale: float) -> Panel:
    """Lines that begin at a rule, with growing rests: the first that is whole says what `pen.down_time` lacks, ms."""
    size, speed = letters(scale), pace(profile)
    x, top, row = 6.5 * size, 4.6 * size, 3.0 * size
    bottom = top + (len(_RESTS) - 0.4) * row
    lines = [line([(x, top - 0.6 * row), (x, bottom)], speed)]
    captions = [Caption("start +ms", 0.0, 1.6 * size, size)]
    for number, rest in enumerate(_RESTS):
        y = top + number * row
        lines.append(line([(x, y), (x + 12 * scale, y)], speed, rest / 1000))
        captions.append(Caption(f"{rest}", 0.0, y + size / 2, size))
    return Panel("starts", max(x + 12 * scale, 9 * size), bottom, tuple(lines), tuple(captions))


def left_behind(seconds: float, profile: Plotter) -> float:
    """How far the pen is from where a line ended, mm, so long after it has set out for the next."""
    limits = profile.limits
    speeding = float(limits.travel_speed) / float(limits.acceleration)
    early = min(seconds, speeding)
    return float(limits.acceleration) * early**2 / 2 + float(limits.travel_speed) * (seconds - early)


def ends(profile: Plotter, scale: float) -> Panel:
    """Lines that end at a rule, others beyond a gap: how far a tail reaches says what `pen.up_time` lacks, ms."""
    size, speed = letters(scale), pace(profile)
    # the longest delays whose tails have room, two if their numbers do not run into each other: ms, and mm
    ways = [(ms, left_behind(ms / 1000, profile)) for ms in _TAILS]
    fitting = [tail for tail in ways if 0.8 < tail[1] < 8.0 * scale] or ways[:1]
    apart = [tail for tail in fitting[:-1] if fitting[-1][1] - tail[1] > 4.5 * size]
    shown = [*apart[-1:], fitting[-1]]
    first, top, row, count = 8.0 * scale, 7.6 * size, 3.0 * size, 4
    far = max(2.0 * shown[-1][1], 6.0 * scale)  # the pen gathers speed up to the middle of its way
    bottom = top + (count - 0.4) * row
    lines = [line([(first, top - 0.6 * row), (first, bottom)], speed)]
    captions = [Caption("end +ms", 0.0, 1.6 * size, size)]
    for ms, way in shown:
        lines.append(line([(first + way, top - 0.6 * row - 1.2 * size), (first + way, top - 0.6 * row)], speed))
        captions.append(Caption(f"{ms}", first + way - 0.7 * size, top - 0.6 * row - 1.6 * size, size))
    for number in range(count):
        y = top + number * row
        lines.append(line([(0.0, y), (first, y)], speed))
        lines.append(line([(first + far, y), (first + far + 3 * scale, y)], speed))
    return Panel("ends", max(first + far + 3 * scale, 8 * size), bottom, tuple(lines), tuple(captions))


def dots(profile: Plotter, scale: float) -> Panel:
    """Dots for which the pen rests longer and longer, ms: the first are missing, the last blot."""
    size, gap = letters(scale), 5.0 * letters(scale)
    lines = [dot(gap * (number + 0.3), 3.2 * size, rest / 1000) for number, rest in enumerate(_DOTS)]
    captions = [Caption(f"{rest}", gap * number, 6.2 * size, size) for number, rest in enumerate(_DOTS)]
    captions.append(Caption("dots ms", 0.0, 1.6 * size, size))
    return Panel("dots", gap * len(_DOTS), 7.0 * size, tuple(lines), tuple(captions))


def circles(profile: Plotter, scale: float) -> Panel:
    """A circle each way: flats at the quarters are play, an end that misses its start is a pen that is not held."""
    radius, size = 8.0 * scale, letters(scale)
    lines = []
    for way, share in ((1.0, 1.0), (-1.0, 0.72)):
        phi = np.linspace(0.0, way * 2 * math.pi, 181)
        lines.append(line(radius + share * radius * np.column_stack([np.sin(phi), -np.cos(phi)]), pace(profile)))
    return Panel("circles", 2 * radius, 2 * radius + size, tuple(lines), ())


def sample(scale: float) -> Panel:
    """A little writing by hand."""
    size = 2.2 * scale
    words = ("The quick brown fox", "jumps over 13 dogs.")
    captions = tuple(Caption(text, 0.0, (2.4 + 3.6 * number) * size, size) for number, text in enumerate(words))
    return Panel("sample", 24.0 * size, 7.6 * size, (), captions)


_SCALES = (1.0, 0.9, 0.8, 0.7, 0.62, 0.55, 0.48, 0.42)  # the largest that fits is taken; set by eye
_SIDES = (150, 120, 100, 80, 60, 50, 40, 30, 20)  # mm
_LEAST_SIDE = 40.0  # mm of the square at scale 1
_EDGE = 0.035  # of the shorter side that stays empty
_GAP = 3.2  # mm between parts at scale 1
_LIFT = 0.15  # s between two lines
_PRINT, _JOINED = "house-print", "house-joined"

Spot = tuple[float, float, Panel]


def usual_page(profile: Plotter) -> Page:
    """A5 where the machine reaches all of it, else its bed."""
    a5, size = page_sizes.page("a5"), profile.bed
    short, long = sorted((float(size.width), float(size.height)))
    return a5 if short >= a5.width and long >= a5.height else Page(float(size.width), float(size.height))


def test_sheet(profile: Plotter, page: Page, rng: np.random.Generator) -> Drawing:
    """Draw a page that tells what to set.

    A square with diagonals, verniers for the play of both axes, ladders of speed, beginnings and ends of lines, dots,
    circles both ways and a little writing.  What the machine does not let one set (the pen of HP-GL) is left out.

    Raises DoesNotFit: the page, or what the machine reaches of it, is too small for all that.
    """
    placement = bed.place(page, profile)
    corners = placement.to_page(np.array(bed.reach(profile)))  # of what the pen reaches, mm
    edge = _EDGE * float(min(page.width, page.height))
    left, top = (np.maximum(corners.min(axis=0), 0.0) + edge).tolist()
    right, bottom = (np.minimum(corners.max(axis=0), [page.width, page.height]) - edge).tolist()
    names = ("Y", "X") if placement.turn[0, 0] == 0 else ("X", "Y")
    # whose sheet this is, with what its pen was told
    called = "".join(char for char in profile.name.removeprefix("plotter-") if " " <= char <= "~") or "plotter"
    if profile.pen.lift not in ("own", "command"):
        called += f": up {profile.pen.up:g}, down {profile.pen.down:g}"
    for scale in _SCALES:
        head = Caption(called, 0.0, 2.0 * letters(scale), letters(scale))
        above = 3.6 * letters(scale)
        for side in (side for side in _SIDES if side >= _LEAST_SIDE * min(scale, 1.0)):
            parts = _panels(profile, names, side, scale)
            spots = _pack_panels(parts, right - left, bottom - top - above, _GAP * scale)
            if spots is not None:
                placed = [(left + x, top + above + y, panel) for x, y, panel in spots]
                title = Panel("title", 0.0, 0.0, (), (head,))
                return _draw_parts([(left, top, title), *placed], profile, page, rng)
    raise DoesNotFit(
        f"The test sheet does not fit into the {right - left:.4g} x {bottom - top:.4g} mm "
        f"that {profile.name or profile.title} reaches of a page of {page.width:g} x {page.height:g} mm: use a larger "
        "--page."
    )


def _panels(profile: Plotter, names: tuple[str, str], side: float, scale: float) -> list[Panel]:
    lifts_itself = profile.pen.lift == "own"
    timing = [] if lifts_itself else [starts(profile, scale), ends(profile, scale)]
    return [
        square(side, names, profile, scale),
        vernier(1, names[1], profile, scale),
        straight(profile, scale),
        loops(profile, scale),
        vernier(0, names[0], profile, scale),
        *timing,
        circles(profile, scale),
        sample(scale),
        dots(profile, scale),
    ]


def _pack_panels(panels: Sequence[Panel], width: float, height: float, gap: float) -> list[Spot] | None:
    """Where each part lies, as high up and then as far left as it goes; None if not all fit."""
    spots: list[Spot] = []
    for panel in panels:
        xs = sorted({0.0, *(x + other.width + gap for x, _, other in spots)})
        ys = sorted({0.0, *(y + other.height + gap for _, y, other in spots)})
        free = (
            (x, y)
            for y in ys
            for x in xs
            if x + panel.width <= width
            and y + panel.height <= height
            and not any(_meet((x, y, panel), other, gap) for other in spots)
        )
        if (spot := next(free, None)) is None:
            return None
        spots.append((*spot, panel))
    return spots


def _meet(first: Spot, second: Spot, gap: float) -> bool:
    (x, y, a), (u, v, b) = first, second
    return x < u + b.width + gap and u < x + a.width + gap and y < v + b.height + gap and v < y + a.height + gap


def _draw_parts(spots: Sequence[Spot], profile: Plotter, page: Page, rng: np.random.Generator) -> Drawing:
    """All parts on one clock: first what is tested, part by part, then the words."""
    strokes = [
        dataclasses.replace(stroke, xy=stroke.xy + np.array([x, y])) for x, y, panel in spots for stroke in panel.lines
    ]
    for hand, pace in ((_PRINT, 1.6), (_JOINED, 1.0)):
        captions = [
            dataclasses.replace(caption, x=caption.x + x, y=caption.y + y)
            for x, y, panel in spots
            if (panel.name == "sample") == (hand == _JOINED)
            for caption in panel.captions
        ]
        strokes += write_captions(captions, hand, page, rng, pace).strokes
    about = {"program": f"handout {__version__}", "title": "test sheet", "device": profile.name}
    clock, turns = 0.0, []
    for stroke in strokes:  # one after the other on one clock
        turns.append(dataclasses.replace(stroke, t=stroke.t - stroke.t[0] + clock, word=-1))
        clock = float(turns[-1].t[-1]) + _LIFT
    return Drawing(tuple(turns), page, about)


_WIDE = 400.0  # mm, more than any caption needs
_FURTHER = 30.0  # mm from one line to the next: they are moved to their places afterwards
_CALM = 0.5  # of a person's variation: captions have to be read


def write_captions(
    captions: Sequence[Caption], hand: str, page: Page, rng: np.random.Generator, speed: float
) -> Drawing:
    """All captions as timed strokes on a page, in their order.

    Raises MissingCharacters: the hand cannot write one of them.
    """
    if not captions:
        return Drawing((), page)
    writer = load(hand)
    size = captions[0].x_height
    sheet = Page(_WIDE, _FURTHER * (len(captions) + 2))
    layout = Layout(sheet, (10.0,) * 4, x_height=size, line_spacing=_FURTHER, align="left", jitter=_CALM)
    (composed,) = compose("\n".join(caption.text for caption in captions), writer, layout, rng, pages=1)
    pairs = zip(composed.lines, captions, strict=True)
    lines = [_move_line(line, caption, caption.x_height / size) for line, caption in pairs]
    return trace(Manuscript(tuple(lines), page, size), writer, rng, jitter=_CALM, speed=speed)


def _move_line(line: Line, caption: Caption, scale: float) -> Line:
    """A line where its caption is to stand."""
    left = min(float(stroke[:, 0].min()) for placed in line.placed for stroke in placed.strokes)
    base = np.array([left, line.baseline])

    def move_glyph(placed: Placed) -> Placed:
        strokes = tuple((stroke - base) * scale + [caption.x, caption.y] for stroke in placed.strokes)
        return dataclasses.replace(placed, strokes=strokes)

    return dataclasses.replace(line, placed=tuple(move_glyph(placed) for placed in line.placed), baseline=caption.y)


def how_to_read(profile: Plotter) -> list[str]:
    """One line for every part of the sheet."""
    lines = ["Square: measure its sides with a ruler; if they are off,"]
    if setting := dialect(profile.dialect).steps_setting:
        lines[0] += f" steps per mm ({setting}) = now x printed length / measured length."
    else:
        lines[0] += " the plotter's scale is set on itself (P1, P2)."
    lines[0] += " Unequal diagonals: the axes are not square."
    lines += [
        "Play: the number beside the pair of marks that makes one straight line is the backlash, mm; none is best. "
        "Tighten belts or screws.",
        "mm/s, zigzags: the last row that is not shaken is limits.draw_speed.",
        "mm/s, loops: if the last rows are shaken, lower limits.acceleration.",
        "Circles: flats at the quarters are play; ends that do not meet are a pen that is loose in its holder.",
    ]
    if profile.pen.lift != "own":
        lines += [
            "start: the first line that begins on the rule says how many ms to add to pen.down_time.",
            "end: a tail beyond the rule reaches about to the number of ms to add to pen.up_time.",
        ]
    return [*lines, "dots: all should be there, none should blot; pen.ramp lowers the pen more slowly."]
