"""The test sheet of a machine: everything that a person has to see to set it up, on one page, and how it is read.

The parts are those of `panels`, packed on the page; their words are written by hands of the house.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from handout import __version__, page_sizes
from handout.errors import DoesNotFit
from handout.hand.library import load
from handout.motion.trace import trace
from handout.plotting import bed
from handout.plotting.dialects import dialect
from handout.plotting.setup import panels
from handout.plotting.setup.panels import Caption, Panel
from handout.profiles import Plotter
from handout.values import Drawing, Line, Manuscript, Page, Placed
from handout.writing.compose import compose
from handout.writing.layout import Layout

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

    Raises
    ------
    DoesNotFit
        The page, or what the machine reaches of it, is too small for all that.
    """
    placement = bed.place(page, profile)
    corners = placement.to_page(np.array(bed.reach(profile)))  # of what the pen reaches, mm
    edge = _EDGE * float(min(page.width, page.height))
    left, top = (np.maximum(corners.min(axis=0), 0.0) + edge).tolist()
    right, bottom = (np.minimum(corners.max(axis=0), [page.width, page.height]) - edge).tolist()
    names = ("Y", "X") if placement.turned else ("X", "Y")
    for scale in _SCALES:
        head = Caption(_title(profile), 0.0, 2.0 * panels.letters(scale), panels.letters(scale))
        above = 3.6 * panels.letters(scale)
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


def _title(profile: Plotter) -> str:
    """Whose sheet this is, with what its pen was told."""
    name = "".join(char for char in profile.name.removeprefix("plotter-") if " " <= char <= "~") or "plotter"
    pen = profile.pen
    return name if pen.lift in ("own", "command") else f"{name}: up {pen.up:g}, down {pen.down:g}"


def _panels(profile: Plotter, names: tuple[str, str], side: float, scale: float) -> list[Panel]:
    lifts_itself = profile.pen.lift == "own"
    timing = [] if lifts_itself else [panels.starts(profile, scale), panels.ends(profile, scale)]
    return [
        panels.square(side, names, profile, scale),
        panels.vernier(1, names[1], profile, scale),
        panels.straight(profile, scale),
        panels.loops(profile, scale),
        panels.vernier(0, names[0], profile, scale),
        *timing,
        panels.circles(profile, scale),
        panels.sample(scale),
        panels.dots(profile, scale),
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

    Raises
    ------
    MissingCharacters
        The hand cannot write one of them.
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
