"""Lined paper that is written on: which lines, how far apart, how large, and what is said of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedHand
    from handout.inking.papers import Paper
    from handout.scanning.printed_lines import PrintedLine, PrintedSheet
    from handout.values import Hand
    from handout.writing.layout import Layout

# of the distance of lines, the height of small letters that is not given.  People's median is 2.7 mm (20 pages of CVL
# and CSAFE), a third of the usual 8 mm; on every second line of 5 mm squares .265 to .29 of 10 mm (Peraire)
_ON_RULES, _ON_SQUARES = 1 / 3, 0.28
_OWN = (0.25, 0.4)  # between these a scanned hand keeps its own size
_LARGEST = 0.6  # of the distance of rules: larger letters take every second one, or third
_WIDE_ENOUGH = 5.5  # mm: rules closer together are not all written on
_SAME = 0.02  # of a distance: by so much two may differ and are still the same
_HEAD = 12.0  # mm: a first rule further down has the head of the sheet over it, which is left free as it is printed
_BESIDE = 2.0  # mm from a margin line to the text
_LEVEL, _UNEVEN, _BENT = (
    0.005,
    0.08,
    0.5,
)  # tangent, share of the distance, mm: above, it is said
_STRETCHED = 0.03
_SHEET = (50.0, 610.0)  # mm: sides that a picture's own resolution may give a sheet


@dataclass(frozen=True)
class Lined:
    """A layout on its paper.

    paper : as pictures show it, with its lines where they are written on.
    notes : sentences to show the user.
    facts : what `--json` says of the lines.
    """

    layout: Layout
    paper: Paper | None = None
    notes: tuple[str, ...] = ()
    facts: Mapping[str, Any] | None = None


def page_name(given: Mapping[str, Any], chosen: bool) -> str:
    """The page to write on: that of --page, or, where that was not `chosen`, a scanned sheet's own size."""
    name: str = given["page_name"]
    path = Path(given["paper"])
    if chosen or not path.is_file():
        return name
    from handout.scanning.checks import LEAST_DPI, MOST_DPI
    from handout.scanning.picture_files import read_picture

    picture = read_picture(path)
    if picture.own is None or not LEAST_DPI - 1 <= picture.own <= MOST_DPI or picture.photographed:
        return name
    height, width = (side / picture.own * 25.4 for side in picture.rgb.shape[:2])
    fits = _SHEET[0] <= min(width, height) and max(width, height) <= _SHEET[1]
    return f"{width:.2f}x{height:.2f}mm" if fits else name


def lined(given: Mapping[str, Any], layout: Layout, hand: Hand | ScannedHand) -> Lined:
    """A layout with its lines on those of the paper that is asked for; as it is where that has none.

    Raises
    ------
    InputError
        No such paper, a distance of lines that cannot be, or lines that leave no room.
    """
    from handout.cli.options import paper as named

    if given.get("paper", "none") == "none":
        return Lined(layout)
    paper = named(given)
    if paper.name in ("ruled", "squared"):
        return _printed(given, layout, hand, paper)
    return Lined(layout) if paper.name in ("plain", "laid") else _pictured(given, layout, hand, Path(paper.name))


def _printed(given: Mapping[str, Any], layout: Layout, hand: Hand | ScannedHand, paper: Paper) -> Lined:
    """Rules or squares that are drawn under the writing, or that the sheet in a plotter has."""
    from handout.writing.ruling import ABOVE, Ruling
    from handout.writing.sheets import ASCENT

    own = layout.line_spacing or hand.pitch * layout.x_height
    pitch = paper.pitch or (own if paper.name == "ruled" else 5.0)
    if not 2 <= pitch <= 100:
        return Lined(layout)
    every, notes = _every(given, layout, hand, pitch, squares=paper.name == "squared")
    if every == 0:
        return Lined(layout, None, notes)
    if paper.pitch or paper.name == "squared":
        layout = _sized(given, layout, hand, every * pitch, squares=paper.name == "squared")
    first = paper.first
    if first is None:
        first = layout.margin[0] + ASCENT * layout.x_height + ABOVE
        if paper.name == "squared":
            first = pitch * math.ceil(first / pitch - 1e-6)
    count = max(1, math.floor((layout.page.height - first) / (every * pitch)) + 1)
    rules = tuple((first + k * every * pitch, 0.0) for k in range(count))
    layout = replace(layout, ruling=Ruling(rules))
    upper = next(iter(_used(layout)), first)
    said = (
        f"Lines {_mm(every * pitch)} apart{_of(every, pitch)}, the upper one {_mm(upper)} below the edge of the sheet; "
        f"small letters {_mm(layout.x_height)} tall."
    )
    head = paper.first if paper.first is not None else None
    facts = {"line_spacing_mm": every * pitch, "pitch_mm": pitch, "first_mm": round(upper, 2)}
    return Lined(layout, replace(paper, pitch=pitch, first=first, head=head), (*notes, said), facts)


def _pictured(given: Mapping[str, Any], layout: Layout, hand: Hand | ScannedHand, path: Path) -> Lined:
    """A picture of a sheet, whose lines are looked for."""
    from handout.scanning.picture_files import read_picture
    from handout.scanning.printed_lines import find_printed_lines
    from handout.writing.ruling import Ruling

    rgb, page = read_picture(path).rgb, layout.page
    notes = _stretched(path, rgb.shape[1] / rgb.shape[0], page.width / page.height)
    found = find_printed_lines(rgb, page.width, page.height)
    if found is None:
        said = f"{path.name}: no rules were found on it; lines lie as on plain paper."
        return Lined(layout, None, (*notes, said), {"rules": 0})
    squares = found.columns is not None and found.fine == found.pitch
    every, more = _every(given, layout, hand, found.pitch, squares=squares)
    notes += more
    facts = {"rules": len(found.rules), "pitch_mm": round(found.pitch, 2), "margin_mm": _rounded(found.left)}
    facts |= {"right_margin_mm": _rounded(found.right), "slope": round(_slope(found.rules), 4)}
    said = f"{path.name}: lines {_mm(found.pitch)} apart" + (", squares" if squares else "")
    said += "" if found.left is None else f", margin at {_mm(found.left)}"
    said += "" if found.right is None else f", right margin at {_mm(found.right)}"
    if every == 0:
        return Lined(layout, None, (*notes, f"{said}."), facts)
    layout = _sized(given, layout, hand, every * found.pitch, squares=squares)
    layout, kept = _inside(given, layout, found)
    rules = tuple((rule.at, rule.slope) for rule in found.rules)
    start = next((k for k, rule in enumerate(rules) if rule[0] >= _used_from(layout)), 0)
    layout = replace(layout, ruling=Ruling(rules[start::every]))
    said += f"; written {_mm(every * found.pitch)} apart" if every > 1 else ""
    said += f"; small letters {_mm(layout.x_height)} tall."
    facts["line_spacing_mm"] = round(every * found.pitch, 2)
    return Lined(layout, None, (*notes, said, *kept, *_angle(path, found)), facts)


def _every(
    given: Mapping[str, Any], layout: Layout, hand: Hand | ScannedHand, pitch: float, *, squares: bool
) -> tuple[int, tuple[str, ...]]:
    """Every how many of some rules there is a line of writing; 0 where the line distance asked for fits none."""
    asked = layout.line_spacing
    if asked is not None:
        every = max(1, round(asked / pitch))
        if abs(asked - every * pitch) <= _SAME * asked:
            return every, ()
        return 0, (
            f"--line-spacing {given['line_spacing']} is followed, and lines leave the paper's rules, which are "
            f"{_mm(pitch)} apart: leave it out to write on them.",
        )
    if squares or pitch < _WIDE_ENOUGH:
        return max(1, round(hand.pitch * layout.x_height / pitch)), ()
    return (max(1, math.ceil(layout.x_height / (_LARGEST * pitch))) if given["x_height"] else 1), ()


def _sized(
    given: Mapping[str, Any], layout: Layout, hand: Hand | ScannedHand, spacing: float, *, squares: bool
) -> Layout:
    """The layout with lines that far apart, mm, and letters as tall as people make them there."""
    from handout.values import Hand

    if given["x_height"]:
        return replace(layout, line_spacing=spacing)
    if isinstance(hand, Hand):
        size = (_ON_SQUARES if squares else _ON_RULES) * spacing
    else:
        size = min(max(hand.x_height, _OWN[0] * spacing), _OWN[1] * spacing)
    return replace(layout, x_height=max(size, 0.3), line_spacing=spacing)


def _inside(given: Mapping[str, Any], layout: Layout, found: PrintedSheet) -> tuple[Layout, tuple[str, ...]]:
    """The layout inside the margin lines of its sheet, where its own margins are not given; and what is said."""
    from handout.writing.sheets import ASCENT, DESCENT

    top, right, bottom, left = layout.margin
    page, first, last = layout.page, found.rules[0], found.rules[-1]
    if given["margin"]:
        crossed = found.left is not None and left < found.left
        return layout, ("The text begins left of the sheet's margin line, as --margin says.",) if crossed else ()
    start, end = max(rule.start for rule in found.rules), min(rule.end for rule in found.rules)
    left = max(left, start + _BESIDE if start > _BESIDE else 0) if found.left is None else found.left + _BESIDE
    edge = page.width - right if found.right is None else found.right - _BESIDE
    edge = min(edge, end - _BESIDE) if end < page.width - _BESIDE else edge
    reach = max(page.width / 2 - left, edge - page.width / 2)
    if first.at > _HEAD:
        top = min(top, max(0.0, first.at - abs(first.slope) * reach - ASCENT * layout.x_height - 0.2))
    if page.height - last.at > _HEAD:
        bottom = min(
            bottom, max(0.0, page.height - last.at - abs(last.slope) * reach - DESCENT * layout.x_height - 0.2)
        )
    return replace(layout, margin=(top, page.width - edge, bottom, left)), ()


def _used_from(layout: Layout) -> float:
    """The height of the first rule over which there is room, mm."""
    from handout.writing.sheets import ASCENT

    return layout.margin[0] + ASCENT * layout.x_height


def _used(layout: Layout) -> list[float]:
    """The heights of the rules that are written on."""
    from handout.writing.ruling import ABOVE
    from handout.writing.sheets import DESCENT

    assert layout.ruling is not None
    lower = layout.page.height - layout.margin[2] - DESCENT * layout.x_height
    return [height for height, _ in layout.ruling.within(_used_from(layout) + ABOVE, lower + ABOVE, 0.0)]


def _angle(path: Path, found: PrintedSheet) -> list[str]:
    """What is said of rules that are not level, not even or not straight."""
    notes, slope = [], _slope(found.rules)
    heights = [rule.at for rule in found.rules]
    gaps = [b - a for a, b in pairwise(heights)]
    parts = max(1, len(gaps) // 4)
    above, below = sum(gaps[:parts]) / parts, sum(gaps[-parts:]) / parts
    if max(abs(rule.slope) for rule in found.rules) > _LEVEL:
        way = "fall" if slope > 0 else "rise"
        notes.append(
            f"{path.name}: its rules {way} to the right by {math.degrees(abs(slope)):.1f}°; lines follow them."
        )
    if abs(above - below) > _UNEVEN * found.pitch:
        notes.append(
            f"{path.name}: its rules are {_mm(above)} apart above and {_mm(below)} below, as seen at an angle; lines "
            "follow them, letters are of one size."
        )
    bend = sorted(rule.bend for rule in found.rules)[len(found.rules) // 2]
    if bend > _BENT:
        notes.append(f"{path.name}: its rules are bent, by up to {_mm(bend)}; lines are written straight.")
    return notes


def _slope(rules: tuple[PrintedLine, ...]) -> float:
    return sorted(rule.slope for rule in rules)[len(rules) // 2]


def _stretched(path: Path, own: float, wanted: float) -> tuple[str, ...]:
    if abs(own / wanted - 1) <= _STRETCHED:
        return ()
    return (
        f"{path.name} is stretched to fill the page: its sides are as 1 to {1 / own:.2f}, the page's as 1 to "
        f"{1 / wanted:.2f}; give its size with --page.",
    )


def _of(every: int, pitch: float) -> str:
    return (
        ""
        if every == 1
        else f" (every {every}{'nd' if every == 2 else 'rd' if every == 3 else 'th'} rule of {_mm(pitch)})"
    )


def _mm(length: float) -> str:
    return f"{round(length, 1):g} mm"


def _rounded(length: float | None) -> float | None:
    return None if length is None else round(length, 2)
