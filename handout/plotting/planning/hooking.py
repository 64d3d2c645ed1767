"""Where hooks come in a drawing: what is done before and after it and its strokes, and before which strokes to dip.

A dip falls between two strokes, since a pen cannot be lifted within one unseen; a stroke that needs more ink than there
is between two dips is parted first (`part_strokes`), where the pen is slowest.  Of all ways to dip often enough the one
is taken that dips within the fewest strokes, then within the fewest words, then least often, and of these the one that
loads the pen most evenly: a shortest path over the strokes.

Source: own method.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from handout import hooks, units
from handout.hooks import Steps
from handout.plotting import bed
from handout.plotting.planning.segments import distance_to_lines
from handout.profiles import HOOKS, Plotter
from handout.values import Array, Drawing, Stroke

# what a dip costs, each more than all that there can be of the next on a page of thousands of strokes
_WITHIN_STROKE, _WITHIN_WORD, _DIP, _UNEVEN = 1e9, 1e5, 1.0, 1e-5
_ROOM = 4.0  # mm, about a letter, within which a place is looked for to part a stroke at; set by eye
_TOUCH = 1e-6  # mm between the parts of a stroke
_POT = 1.0  # mm around the ways of a pen in its pot: steps, and a place that is not quite where it should be


@dataclass(frozen=True)
class Hooking:
    """What is done besides drawing, and the strokes before which the pen is dipped."""

    before_page: Steps = ()
    after_page: Steps = ()
    before_stroke: Steps = ()
    after_stroke: Steps = ()
    dip: Steps = ()
    dips: frozenset[int] = frozenset()


NONE = Hooking()


def hooking(drawing: Drawing, profile: Plotter, whole: tuple[bool, bool]) -> Hooking:
    """The hooks of a machine on a drawing whose strokes are parted (`part_strokes`).

    whole : whether the page begins with the drawing, and ends with it.

    Raises DoesNotFit: a hook goes to a place outside the bed.
    """
    told = profile.hooks
    check(profile)
    return Hooking(
        told.steps("before_page") if whole[0] else (),
        told.steps("after_page") if whole[1] else (),
        told.steps("before_stroke"),
        told.steps("after_stroke"),
        told.steps("dip"),
        dips(drawing.strokes, told.dip_every) if told.dip else frozenset(),
    )


def check(profile: Plotter) -> None:
    """Raise DoesNotFit for a place of a hook outside the bed."""
    for name in HOOKS:
        if places := hooks.goes(profile.hooks.steps(name)):
            bed.check(np.array(places), profile, f"another place in hooks.{name}")


def dips(strokes: Sequence[Stroke], every: float) -> frozenset[int]:
    """The strokes before which the pen is dipped: between two dips it draws at most `every` mm.

    A stroke that is longer by itself has a load of its own.
    """
    ink = np.append(0.0, np.cumsum([stroke.length for stroke in strokes]))
    costs = np.zeros(len(strokes))
    for at in range(1, len(strokes)):
        within_word = 0 <= strokes[at].word == strokes[at - 1].word
        costs[at] = _WITHIN_STROKE if is_join(strokes, at) else _DIP + (_WITHIN_WORD if within_word else 0.0)
    firsts = np.searchsorted(ink, ink - every - _TOUCH)
    best, before = np.zeros(len(ink)), np.zeros(len(ink), dtype=np.intp)
    for end in range(1, len(ink)):
        first = min(int(firsts[end]), end - 1)
        all_of = best[first:end] + costs[first:end] + _UNEVEN * ((ink[end] - ink[first:end]) / every) ** 2
        before[end] = first + int(np.argmin(all_of))
        best[end] = all_of[before[end] - first]
    chosen, at = set[int](), len(strokes)
    while at > 0:
        at = int(before[at])
        chosen.add(at)
    return frozenset(chosen)


def is_join(strokes: Sequence[Stroke], at: int) -> bool:
    """Whether a stroke begins where the stroke before it ended: both are parts of one line."""
    return at > 0 and bool(np.abs(strokes[at - 1].xy[-1] - strokes[at].xy[0]).max() <= _TOUCH)


def part_strokes(drawing: Drawing, every: float) -> Drawing:
    """The drawing with all strokes longer than `every` mm parted where the pen is slowest; every: 0 for never."""
    if every <= 0 or all(stroke.length <= every + _TOUCH for stroke in drawing.strokes):
        return drawing
    strokes = tuple(piece for stroke in drawing.strokes for piece in _pieces(stroke, every))
    return dataclasses.replace(drawing, strokes=strokes)


def tell_hooks(drawings: Sequence[Drawing], profile: Plotter) -> list[str]:
    """What is to be said of the hooks on pages whose strokes are parted, in sentences."""
    sentences = [sentence for drawing in drawings for sentence in _tell_page_hooks(drawing, profile)]
    return list(dict.fromkeys(sentences))


def _tell_page_hooks(drawing: Drawing, profile: Plotter) -> Iterator[str]:
    every = float(profile.hooks.dip_every)
    within = [at for at in sorted(dips(drawing.strokes, every)) if is_join(drawing.strokes, at)] if every else []
    if within:
        words = drawing.about.get("words") or []
        named = dict.fromkeys(str(words[word]) for at in within if 0 <= (word := drawing.strokes[at].word) < len(words))
        where = f", in: {', '.join([*named][: units.MOST_NAMED])}" if named else ""
        yield (
            f"{'A stroke is' if len(within) == 1 else 'Some strokes are'} longer than the {every:g} mm between two "
            f"dips: the pen is lifted within, where it is slowest, {units.count(len(within), 'time')}{where}."
        )
    size = np.array([drawing.page.width, drawing.page.height])
    placed = bed.place(drawing.page, profile)
    for name in HOOKS:
        places = np.array(hooks.goes(profile.hooks.steps(name))).reshape(-1, 2)
        at = placed.to_page(places)
        for x, y in places[((at > 0) & (at < size)).all(axis=1)]:
            yield f"hooks.{name} goes to {x:g}, {y:g} mm, which lies on the sheet."


def _pieces(stroke: Stroke, every: float) -> Iterator[Stroke]:
    """The stroke in parts of at most `every` mm, about equal, each but the first begun where it is slowest nearby."""
    length = stroke.length
    if length <= every + _TOUCH:
        yield stroke
        return
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(stroke.xy, axis=0).T)))
    many = math.ceil(length / (every - min(_ROOM, 0.2 * every)))
    reach = 0.5 * (every - length / many)  # two that are as far apart as can be leave no part too long
    begin = float(stroke.t[0])
    for number in range(1, many):
        about = number * length / many
        inside = np.flatnonzero(np.abs(along - about) <= reach)
        if len(inside):  # where it is slowest; of equally slow places at the nearest
            best = np.lexsort((np.abs(along[inside] - about), np.round(stroke.speed[inside], 3)))[0]
            end = float(stroke.t[inside[best]])
        else:
            end = float(np.interp(about, along, stroke.t))
        yield piece(stroke, begin, end)
        begin = end
    yield piece(stroke, begin, float(stroke.t[-1]))


_CHANNELS = ("pressure", "tilt", "azimuth", "rotation", "width")
_ANGLES = ("azimuth", "rotation")  # these come round again


def piece(stroke: Stroke, begin: float, end: float) -> Stroke:
    """The stroke between two times, s: its own samples, interpolated only at the ends; begin < end."""
    within = stroke.t[(stroke.t > begin) & (stroke.t < end)]
    t = np.concatenate([[begin], within, [end]])
    xy = np.stack([np.interp(t, stroke.t, stroke.xy[:, axis]) for axis in (0, 1)], axis=1)
    channels: dict[str, Any] = {}
    at = np.minimum(np.searchsorted(stroke.t, t), len(stroke.t) - 1)
    for name in _CHANNELS:
        if (values := getattr(stroke, name)) is not None:  # samples stay as they are, to the last digit
            between = np.interp(t, stroke.t, np.unwrap(values) if name in _ANGLES else values)
            channels[name] = np.where(stroke.t[at] == t, values[at], between)
    return dataclasses.replace(stroke, t=t, xy=xy, **channels)


def detours(profile: Plotter) -> list[Array]:
    """(n, 2) float, mm, machine coordinates, for each: the places the pen may go to between two strokes, in order."""
    page, _, before, after, dip = (hooks.goes(profile.hooks.steps(name)) for name in HOOKS)
    ways = {tuple(after + dip + before), tuple(after + before), (*page, (0.0, 0.0), *dip, *before) if page else ()}
    return [np.array(way) for way in sorted(ways) if way]


def without_pots(drawing: Drawing, profile: Plotter) -> Drawing:
    """What was executed, without what a pen did in its pot: strokes that stay near the ways of hooks."""
    to_page = bed.place(drawing.page, profile).to_page
    ways = [to_page(np.array(places)) for name in HOOKS if (places := hooks.goes(profile.hooks.steps(name)))]
    kept = []
    for stroke in drawing.strokes:
        off = [
            np.min([distance_to_lines(stroke.xy, a[None], b[None]) for a, b in pairwise([way[0], *way])], axis=0)
            for way in ways
        ]
        if not any((each <= _POT).all() for each in off):  # near one way with all of its path
            kept.append(stroke)
    return dataclasses.replace(drawing, strokes=tuple(kept))
