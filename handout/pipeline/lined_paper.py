"""Lined paper that is written on: which lines carry text, how far apart, how large, and what the user is told of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median
from typing import TYPE_CHECKING

from handout.inking import papers
from handout.inking.papers import Paper
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.results import Fact
from handout.writing.layout import ASCENT, DESCENT, FOOT_ABOVE_RULE, Ruling

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from handout.hand.protocol import AnyHand
    from handout.scanning.page_layout import GivenSheet
    from handout.scanning.printed_lines import PrintedLine, PrintedSheet
    from handout.writing.layout import Layout


@dataclass(frozen=True)
class LinedPaperSettings:
    """When lines of paper are followed and what is told of them; set by eye where nothing else is said."""

    # height of small letters as a share of the distance of lines, where it is not given.  People's median is 2.7 mm
    # (20 pages of CVL and CSAFE), a third of the usual 8 mm; on every second line of 5 mm squares .265 to .29 of 10 mm
    # (Peraire)
    x_height_on_rules: float = 1 / 3
    x_height_on_squares: float = 0.28
    largest_x_height: float = 0.6  # share of the distance: larger letters take every second rule, or third
    least_pitch: float = 5.5  # mm: of rules closer together some are left out
    same_pitch: float = 0.02  # share by which two distances may differ and are still the same
    head: float = 12.0  # mm: a first rule further down has the printed head of the sheet over it, which is left free
    beside_margin: float = 2.0  # mm from a margin line to the text
    under_print: float = 6.0  # mm more under a heading where no rule says where the text begins
    # tangent of the rules, unevenness of their distances (share), bend (mm), and stretch of the picture (share) over
    # which the user is told
    level: float = 0.005
    uneven: float = 0.08
    bent: float = 0.5
    stretched: float = 0.03
    straightened: float = 0.12  # the same of a sheet that was seen at an angle, which hides its true sides
    sheet_sides: tuple[float, float] = (50.0, 610.0)  # mm: what a picture's own resolution may give a sheet
    squares: float = 5.0  # mm, of squared paper: the usual school paper
    pitches: tuple[float, float] = (2.0, 100.0)  # mm: rules outside these are drawn, and not written on


SETTINGS = LinedPaperSettings()


@dataclass(frozen=True)
class LinedPaper:
    """A layout with its baselines on the lines of its paper.

    paper : as pictures show it, where its lines depend on the layout; None: as it was asked for.
    notes : sentences for the user.
    facts : what `--json` says of the lines; None where the paper has none.
    """

    layout: Layout
    paper: Paper | None = None
    notes: tuple[str, ...] = ()
    facts: Mapping[str, Fact] | None = None


def page_name(sheet: SheetOptions, picture: PictureOptions) -> str:
    """The page to write on: that of --page, or else a scanned sheet's own size, or else the usual one."""
    if sheet.page is not None or picture.paper in papers.PAPERS:
        return sheet.page_name
    from handout.scanning.page_layout import read_sheet, sheet_file

    size = None if sheet_file(picture.paper) is None else read_sheet(picture.paper).size
    if size is None:
        return sheet.page_name
    least, most = SETTINGS.sheet_sides
    return f"{size[0]:.2f}x{size[1]:.2f}mm" if least <= min(size) and max(size) <= most else sheet.page_name


@dataclass(frozen=True)
class _Request:
    """What lines are looked for: the layout and the hand, and the options that may overrule the paper."""

    layout: Layout
    hand: AnyHand
    writing: WritingOptions
    sheet: SheetOptions


def lined_paper(
    layout: Layout, hand: AnyHand, writing: WritingOptions, sheet: SheetOptions, paper: Paper
) -> LinedPaper:
    """A layout with its lines on those of the paper that is asked for; as it is where that has none.

    Raises InputError: no such sheet, a distance of lines that cannot be, or lines that leave no room.
    """
    request = _Request(layout, hand, writing, sheet)
    if paper.name in ("ruled", "squared"):
        return _use_drawn_rules(request, paper)
    return LinedPaper(layout) if paper.name in ("plain", "laid") else _use_found_rules(request, paper.name)


def _use_drawn_rules(request: _Request, paper: Paper) -> LinedPaper:
    """Write on rules or squares that pictures show under the writing, or that the sheet in the plotter has."""
    layout, squares = request.layout, paper.name == "squared"
    usual = SETTINGS.squares if squares else layout.line_spacing or request.hand.pitch * layout.x_height
    pitch = paper.pitch or usual
    if not SETTINGS.pitches[0] <= pitch <= SETTINGS.pitches[1]:
        return LinedPaper(layout)
    every, notes = _count_rules(request, pitch, squares=squares)
    if every == 0:
        return LinedPaper(layout, None, notes)
    if paper.pitch or squares:
        layout = _set_size(request, every * pitch, squares=squares)
    first = paper.first
    if first is None:
        first = layout.margin[0] + ASCENT * layout.x_height + FOOT_ABOVE_RULE
        if squares:
            first = pitch * math.ceil(first / pitch - 1e-6)
    count = max(1, math.floor((layout.page.height - first) / (every * pitch)) + 1)
    rules = tuple((first + k * every * pitch, 0.0) for k in range(count))
    ruling, lowest = Ruling(rules), layout.page.height - layout.margin[2] - DESCENT * layout.x_height
    layout = replace(layout, ruling=ruling)
    used = ruling.rules_within(_first_room(layout) + FOOT_ABOVE_RULE, lowest + FOOT_ABOVE_RULE, 0.0)
    upper = next((height for height, _ in used), first)
    ordinal = {2: "nd", 3: "rd"}.get(every, "th")
    left_out = "" if every == 1 else f" (every {every}{ordinal} rule of {_mm(pitch)})"
    sentence = (
        f"Lines {_mm(every * pitch)} apart{left_out}, the upper one {_mm(upper)} below the edge of the sheet; "
        f"small letters {_mm(layout.x_height)} tall."
    )
    facts = {"line_spacing_mm": every * pitch, "pitch_mm": pitch, "first_mm": round(upper, 2)}
    drawn = replace(paper, pitch=pitch, first=first, head=paper.first)
    return LinedPaper(layout, drawn, (*notes, sentence), facts)


def _use_found_rules(request: _Request, name: str) -> LinedPaper:
    """Write on the lines that are found in the picture of a sheet, clear of what is printed on it."""
    from handout.scanning.page_layout import read_sheet
    from handout.scanning.printed_lines import find_print, find_printed_lines

    sheet, page = read_sheet(name), request.layout.page
    lines = find_printed_lines(sheet.rgb, page.width, page.height)
    printed = find_print(sheet.rgb, page.width, page.height, lines)
    notes = _sheet_notes(sheet, page.width / page.height)
    if lines is None:
        sentence = f"{sheet.name}: no rules were found on it; lines lie as on plain paper."
        layout, print_notes, clear = _clear(request, request.layout, printed, sheet.name)
        return LinedPaper(layout, None, (*notes, sentence, *print_notes), {"rules": 0, **clear})
    squares = lines.columns is not None and lines.fine == lines.pitch
    every, more = _count_rules(request, lines.pitch, squares=squares)
    notes += more
    facts: dict[str, Fact] = {
        "rules": len(lines.rules),
        "pitch_mm": round(lines.pitch, 2),
        "margin_mm": None if lines.left is None else round(lines.left, 2),
        "right_margin_mm": None if lines.right is None else round(lines.right, 2),
        "slope": round(_slope(lines.rules), 4),
    }
    sentence = f"{sheet.name}: lines {_mm(lines.pitch)} apart" + (", squares" if squares else "")
    sentence += "" if lines.left is None else f", margin at {_mm(lines.left)}"
    sentence += "" if lines.right is None else f", right margin at {_mm(lines.right)}"
    if every == 0:
        layout, print_notes, clear = _clear(request, request.layout, printed, sheet.name)
        return LinedPaper(layout, None, (*notes, f"{sentence}.", *print_notes), {**facts, **clear})
    layout = _set_size(request, every * lines.pitch, squares=squares)
    layout, crossed = _inside(layout, lines, request.sheet)
    layout, print_notes, clear = _clear(request, layout, printed, sheet.name, lines)
    rules = tuple((rule.at, rule.slope) for rule in lines.rules)
    start = next((k for k, rule in enumerate(rules) if rule[0] >= _first_room(layout)), 0)
    layout = replace(layout, ruling=Ruling(rules[start::every]))
    sentence += f"; written {_mm(every * lines.pitch)} apart" if every > 1 else ""
    sentence += f"; small letters {_mm(layout.x_height)} tall."
    facts |= {"line_spacing_mm": round(every * lines.pitch, 2), **clear}
    return LinedPaper(layout, None, (*notes, sentence, *crossed, *print_notes, *_flaws(sheet.name, lines)), facts)


def _clear(
    request: _Request, layout: Layout, printed: NDArray[np.bool_], name: str, lines: PrintedSheet | None = None
) -> tuple[Layout, tuple[str, ...], dict[str, Fact]]:
    """The layout beside what is printed or punched on its sheet; notes, and a fact where it had to give way."""
    from handout.scanning.printed_lines import free_area

    top, right, bottom, left = layout.margin
    width, height = layout.page.width, layout.page.height
    if lines is not None:  # where there are no rules nothing can be written
        top = max(top, lines.rules[0].at - ASCENT * layout.x_height - 1)
        bottom = max(bottom, height - lines.rules[-1].at - DESCENT * layout.x_height - 1)
    within = (left, top, width - right, height - bottom)
    area = free_area(printed, within)
    if area == within:
        return layout, (), {}
    if area is None or request.sheet.margin:
        why = "--margin is followed" if request.sheet.margin else "it is printed all over"
        return layout, (f"{name}: {why}, so that the text may lie on what is printed there.",), {}
    if lines is None and area[1] > top:
        area = (area[0], min(area[1] + SETTINGS.under_print, area[3] - 5), area[2], area[3])
    sentence = (
        f"{name}: what is printed or punched on it is left free: the text stands {_mm(area[0])} to {_mm(area[2])} from "
        f"its left edge, {_mm(area[1])} to {_mm(area[3])} from its top."
    )
    margin = (area[1], width - area[2], height - area[3], area[0])
    return replace(layout, margin=margin), (sentence,), {"text_mm": [round(side, 1) for side in area]}


def _count_rules(request: _Request, pitch: float, *, squares: bool) -> tuple[int, tuple[str, ...]]:
    """How many rules there are to a line of writing; 0 where the line distance that is asked for fits no rules."""
    layout, asked = request.layout, request.layout.line_spacing
    if asked is not None:
        every = max(1, round(asked / pitch))
        if abs(asked - every * pitch) <= SETTINGS.same_pitch * asked:
            return every, ()
        return 0, (
            f"--line-spacing {request.writing.line_spacing} is followed, and lines leave the paper's rules, which are "
            f"{_mm(pitch)} apart: leave it out to write on them.",
        )
    if squares or pitch < SETTINGS.least_pitch:
        return max(1, round(request.hand.pitch * layout.x_height / pitch)), ()
    if not request.writing.x_height:
        return 1, ()
    return max(1, math.ceil(layout.x_height / (SETTINGS.largest_x_height * pitch))), ()


def _set_size(request: _Request, spacing: float, *, squares: bool) -> Layout:
    """Set the line distance, mm, and make the letters as tall as people do on such lines."""
    if request.writing.x_height:
        return replace(request.layout, line_spacing=spacing)
    usual = SETTINGS.x_height_on_squares if squares else SETTINGS.x_height_on_rules
    size = request.hand.x_height_on(spacing, usual)
    return replace(request.layout, x_height=max(size, 0.3), line_spacing=spacing)


def _inside(layout: Layout, lines: PrintedSheet, sheet: SheetOptions) -> tuple[Layout, tuple[str, ...]]:
    """Keep the layout inside the margin lines of its sheet, unless margins are given; and a note."""
    top, right, bottom, left = layout.margin
    page, first, last = layout.page, lines.rules[0], lines.rules[-1]
    if sheet.margin:
        crossed = lines.left is not None and left < lines.left
        return layout, ("The text begins left of the sheet's margin line, as --margin says.",) if crossed else ()
    beside = SETTINGS.beside_margin
    # rules of a sheet begin and end alike: some that are seen less far are hidden there
    start, end = median(rule.start for rule in lines.rules), median(rule.end for rule in lines.rules)
    left = max(left, start + beside if start > beside else 0) if lines.left is None else lines.left + beside
    edge = page.width - right if lines.right is None else lines.right - beside
    edge = min(edge, end - beside) if end < page.width - beside else edge
    reach = max(page.width / 2 - left, edge - page.width / 2)
    room_above = first.at - abs(first.slope) * reach - ASCENT * layout.x_height - 0.2
    room_below = page.height - last.at - abs(last.slope) * reach - DESCENT * layout.x_height - 0.2
    if first.at > SETTINGS.head:
        top = min(top, max(0.0, room_above))
    if page.height - last.at > SETTINGS.head:
        bottom = min(bottom, max(0.0, room_below))
    return replace(layout, margin=(top, page.width - edge, bottom, left)), ()


def _first_room(layout: Layout) -> float:
    """The height of the first rule over which there is room, mm."""
    return layout.margin[0] + ASCENT * layout.x_height


def _flaws(name: str, lines: PrintedSheet) -> list[str]:
    """Notes on rules that are not level, not even or not straight."""
    notes, slope = [], _slope(lines.rules)
    gaps = [b.at - a.at for a, b in pairwise(lines.rules)]
    parts = max(1, len(gaps) // 4)
    above, below = sum(gaps[:parts]) / parts, sum(gaps[-parts:]) / parts
    if max(abs(rule.slope) for rule in lines.rules) > SETTINGS.level:
        way = "fall" if slope > 0 else "rise"
        notes.append(f"{name}: its rules {way} to the right by {math.degrees(abs(slope)):.1f}°; lines follow them.")
    if abs(above - below) > SETTINGS.uneven * lines.pitch:
        notes.append(
            f"{name}: its rules are {_mm(above)} apart above and {_mm(below)} below, as seen at an angle; lines "
            "follow them, letters are of one size."
        )
    bend = sorted(rule.bend for rule in lines.rules)[len(lines.rules) // 2]
    if bend > SETTINGS.bent:
        notes.append(f"{name}: its rules are bent, by up to {_mm(bend)}; lines are written straight.")
    return notes


def _slope(rules: Sequence[PrintedLine]) -> float:
    """The median tangent of some rules."""
    return sorted(rule.slope for rule in rules)[len(rules) // 2]


def _sheet_notes(sheet: GivenSheet, wanted: float) -> tuple[str, ...]:
    """Notes on how the sheet was taken from its file; `wanted` is the width of the page by its height."""
    ratio, notes = sheet.rgb.shape[1] / sheet.rgb.shape[0], []
    if sheet.pages > 1:
        notes.append(f"{sheet.name} is the first of {sheet.pages} pages; {sheet.name}:2 is the second.")
    if sheet.straightened:
        notes.append(f"{sheet.name}: the sheet is cut out of its picture along its outline, and straightened.")
    if abs(ratio / wanted - 1) > (SETTINGS.straightened if sheet.straightened else SETTINGS.stretched):
        notes.append(
            f"{sheet.name} is stretched to fill the page: its sides are as 1 to {1 / ratio:.2f}, the page's as 1 to "
            f"{1 / wanted:.2f}; give its size with --page."
        )
    return tuple(notes)


def _mm(length: float) -> str:
    return f"{round(length, 1):g} mm"
