"""A drawing in another handstyle: targets are found from its lines and moved through anew.

Source: seed 003, §4.1 (stylisations of an input trace; targets beside a join are removed where their angle exceeds a
threshold) and §4.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from msgspec.structs import replace as replaced
from numpy.typing import NDArray

from handout.errors import InputError
from handout.motion.styles import broken_script, targets
from handout.motion.styles.movement import join_poses, move, move_around, pose_along, pose_at_targets, vector, widths
from handout.motion.styles.style import Style
from handout.motion.styles.word_paths import ReadingOf, WordReading
from handout.motion.tracker import Guide
from handout.values import POSE, Array, Drawing, Indices, Stroke

_LIFT = 1.2  # intervals from the end of one stroke to the start of the next, and as many more for each
_AIR = 0.6  # root of its distance in heights
_FLICKED = 0.3  # of the distance of its ends that a stroke is lengthened by at most
_ARM = 5  # samples of a path that are a stroke's tip
_COLLAPSED = 0.8  # of the lines' length; with less, letters lose their loops and arches
_READ = math.log(2)  # nat: with more, something else is likelier to be read in a letter's place
_EDGE = 1.0  # strength of the guide along the strokes of a broken path


@dataclass(frozen=True, eq=False)
class TargetSequence:
    """Targets of one movement.

    points : (m, 2) float, mm.
    corner : (m,) bool: at which of them the letter has a corner.
    ring : whether the first follows the last.
    word, layer, colour : as in `Stroke`.
    channels : what the pen recorded, by the names of `Stroke`'s channels, (m,) each.
    spreads : (m, 2, 2), covariances of the targets of a movement that is no ring, instead of the style's.
    """

    points: Array
    corner: NDArray[np.bool_]
    ring: bool = False
    word: int = -1
    layer: str = ""
    colour: str = ""
    channels: Mapping[str, Array] = field(default_factory=dict)
    spreads: Array | None = None


def restyle(
    drawing: Drawing,
    style: Style,
    rng: np.random.Generator,
    height: float | None = None,
    reading: ReadingOf | None = None,
) -> Drawing:
    """The drawing, its strokes in a handstyle, with the times of the new movements.

    height : mm of a letter, by which the style's lengths are measured; default: as `targets.letter_height` finds it.
    reading : who reads the word of a number, None where nobody can: of strokes (n, 2), mm; each letter then has as much
        of a learned style as leaves it legible.

    Raises InputError: no strokes.
    """
    if not drawing.strokes:
        raise InputError("There is no stroke to restyle.")
    tall = targets.letter_height(drawing) if height is None else height
    about = {key: value for key, value in drawing.about.items() if key != "timing"} | {"style": style.name}
    middles, form = _middles(drawing.strokes), _form(style)
    middle_of = {stroke.word: middle for stroke, middle in zip(drawing.strokes, middles, strict=True)}

    def read_upright(number: int) -> Callable[[Sequence[Array]], WordReading] | None:
        """Who reads a word of the new drawing, as it would be without the style's lean and stretch."""
        read, middle, back = reading and reading(number), middle_of[number], np.linalg.inv(form)
        return read and (lambda strokes: read([middle + (xy - middle) @ back for xy in strokes]))

    if style.model is not None:
        from handout.motion.styles.learned_movement import move_drawing

        lines = zip(drawing.strokes, middles, strict=True)
        formed = tuple(replace(stroke, xy=middle + (stroke.xy - middle) @ form) for stroke, middle in lines)
        strokes = move_drawing(replace(drawing, strokes=formed), style, rng, tall, read_upright)
    else:
        lines = zip(drawing.strokes, middles, strict=True)
        sequences = [_sequence(stroke, style, tall, middle) for stroke, middle in lines]
        strokes = draw_sequences(_join_sequences(sequences, style, tall), style, tall, rng)
    hard = [] if reading is None else _find_hard(drawing.strokes, reading, strokes, read_upright)
    return Drawing(_fit_page(strokes, drawing), drawing.page, about | ({"hard_to_read": hard} if hard else {}))


def _find_hard(
    before: Sequence[Stroke], reading: ReadingOf, after: Sequence[Stroke], reading_after: ReadingOf
) -> list[dict[str, Any]]:
    """The words with letters that were read before and are not now: their numbers, and places of these letters."""
    hard = list[dict[str, Any]]()
    for number in sorted({stroke.word for stroke in after if stroke.word >= 0}):
        read, then = reading(number), reading_after(number)
        if read is None or then is None:
            continue
        was, now = (
            each([stroke.xy for stroke in strokes if stroke.word == number]).nats.mean(axis=1)
            for each, strokes in ((read, before), (then, after))
        )
        if letters := np.flatnonzero((was <= _READ) & (now > _READ)).tolist():
            hard.append({"word": number, "letters": letters})
    return hard


def _form(style: Style) -> Array:
    """(2, 2): multiplied by this, places lean and stretch as the style wants it."""
    return np.array([[style.form.stretch, 0.0], [-math.tan(style.form.shear), 1.0]])


def draw_sequences(
    sequences: Iterable[TargetSequence], style: Style, height: float, rng: np.random.Generator
) -> tuple[Stroke, ...]:
    """Timed strokes of target sequences in a style."""
    clock, before, strokes = 0.0, None, []
    for sequence in sequences:
        if before is not None:
            way = float(np.linalg.norm(sequence.points[0] - before)) / height
            clock += style.movement.interval * (_LIFT + _AIR * math.sqrt(way))
        guide = None
        if style.breaking.directions and len(sequence.points) > 1:  # along the lines from each target to the next
            step = np.diff(sequence.points, axis=0)
            size = np.linalg.norm(step, axis=1, keepdims=True)
            direction = np.where(size > 0, step / np.maximum(size, 1e-300), [1.0, 0.0])
            guide = Guide(np.concatenate([direction, direction[-1:]]), _EDGE)
        if sequence.ring:
            t, xy = move_around(sequence.points, sequence.corner, style, height, rng, guide)
        else:
            t, xy = move(sequence.points, sequence.corner, style, height, rng, guide, sequence.spreads)
        width = widths(t, xy, style, height, tapered=not sequence.ring)
        carried = pose_along(sequence.channels, len(t), free=style.movement.end == "free", ring=sequence.ring)
        nib = style.brush.kind == "nib"
        if nib:
            carried["rotation"] = np.full(len(t), -style.brush.angle)
        strokes.append(
            Stroke(
                clock + t,
                xy,
                **carried,
                width=width,
                nib=style.brush.width * height if nib else 0.0,
                word=sequence.word,
                layer=sequence.layer,
                colour=sequence.colour,
            )
        )
        clock += float(t[-1])
        before = xy[-1]
    return tuple(strokes)


def losses(before: Drawing, after: Drawing, style: Style) -> list[str]:
    """What a drawing lost by being restyled, in sentences: recorded channels, and letters rounded away."""
    notes = []
    nib = any(stroke.nib > 0 for stroke in after.strokes)
    for name in POSE:
        had = sum(getattr(stroke, name) is not None for stroke in before.strokes)
        has = sum(getattr(stroke, name) is not None for stroke in after.strokes)
        if had and name == "rotation" and nib:
            notes.append("The recorded rotation is left out: the style's flat nib keeps its own angle.")
        elif (had == len(before.strokes) > 0 and has < len(after.strokes)) or 0 < had < len(before.strokes):
            notes.append(f"Only {has} of {len(after.strokes)} strokes have a {name}: not all that was recorded has it.")
    share = _share_kept(before, after, style)
    if share < _COLLAPSED:
        notes.append(
            f"smooth = {style.movement.smooth:g} rounds the letters away: {share:.0%} of the length of their lines is "
            f"left, and they may be hard to read; {style.movement.drawn_at:g} keeps them as they were drawn."
        )
    return notes


def _share_kept(before: Drawing, after: Drawing, style: Style) -> float:
    """Length of the restyled lines, as a share of that at the smoothing at which letters keep their form."""
    movement = style.movement
    if movement.smooth <= movement.drawn_at or style.model is not None:
        return 1.0
    through = replaced(style, movement=replaced(movement, smooth=movement.drawn_at))
    whole = restyle(before, through, np.random.default_rng(0))
    return sum(s.length for s in after.strokes) / max(sum(s.length for s in whole.strokes), 1e-9)


def _middles(strokes: Sequence[Stroke]) -> Array:
    """(n, 2) mm: the fixed point of the stretch and slant of each stroke.

    Across it is the middle of the drawing, so that a page keeps its margins; down it is the middle of the stroke's
    word, or of its row where strokes have no words.
    """
    across = 0.5 * (min(s.xy[:, 0].min() for s in strokes) + max(s.xy[:, 0].max() for s in strokes))
    top, foot = (np.array([side(s.xy[:, 1]) for s in strokes]) for side in (np.min, np.max))
    group = np.array([s.word for s in strokes])
    loose = np.flatnonzero(group < 0)
    order = loose[np.argsort(top[loose])]
    # strokes without a word are in one row with those above whose heights they share
    row, lowest = -1, -np.inf
    for at in order.tolist():
        row, lowest = (row - 1, foot[at]) if top[at] > lowest else (row, max(lowest, foot[at]))
        group[at] = row
    middles = {
        number: 0.5 * (top[group == number].min() + foot[group == number].max()) for number in np.unique(group).tolist()
    }
    return np.array([(across, middles[number]) for number in group.tolist()])


def _fit_page(strokes: tuple[Stroke, ...], before: Drawing) -> tuple[Stroke, ...]:
    """The strokes, made smaller about the middle of the page if they leave it and the original strokes did not."""
    page = np.array([before.page.width, before.page.height])
    was = np.concatenate([stroke.xy for stroke in before.strokes])
    widths = [0.0 if stroke.width is None else float(stroke.width.max()) for stroke in strokes]
    reaches = [max(stroke.nib, width) / 2 for stroke, width in zip(strokes, widths, strict=True)]
    sides = ((stroke, side) for stroke, reach in zip(strokes, reaches, strict=True) for side in (-reach, reach))
    now = np.concatenate([stroke.xy + side for stroke, side in sides])
    if (was < 0).any() or (was > page).any() or not ((now < 0).any() or (now > page).any()):
        return strokes
    share = float((0.5 * page / np.maximum(np.abs(now - 0.5 * page).max(axis=0), 1e-9)).min())
    return scale_strokes(strokes, share, 0.5 * (1 - share) * page)


def scale_strokes(strokes: Sequence[Stroke], scale: float, away: Array) -> tuple[Stroke, ...]:
    """The strokes, widths and nibs included, times `scale` and then moved by `away` (2,), mm."""
    return tuple(
        replace(
            stroke,
            xy=scale * stroke.xy + away,
            width=None if stroke.width is None else scale * stroke.width,
            nib=scale * stroke.nib,
        )
        for stroke in strokes
    )


def _sequence(stroke: Stroke, style: Style, height: float, middle: Array) -> TargetSequence:
    """A stroke's targets in the form that the style gives it."""
    motif = targets.find(stroke.xy, height)
    form = _form(style)
    # channels are looked up by share of the recorded line's length, which the form hardly changes
    formed = replace(stroke, xy=middle + (stroke.xy - middle) @ form)
    channels = partial(pose_at_targets, formed)
    # the motif is found before the slant: the extremes of a leaning curve are not where its strokes turn
    motif = replace(motif, path=middle + (motif.path - middle) @ form, points=middle + (motif.points - middle) @ form)
    sequence = TargetSequence(motif.points, motif.corner, motif.ring, stroke.word, stroke.layer, stroke.colour)
    sequence = replace(sequence, channels=channels(sequence.points, ring=motif.ring))
    if len(motif.points) == 1:
        return sequence
    if style.breaking.directions:
        path, bends = motif.path, motif.bends
        if motif.ring:  # it begins at its top, where broken scripts have a corner
            top = int(path[:, 1].argmin())
            path = np.concatenate([path[top:-1], path[: top + 1]])
            bends = np.sort((bends - top) % (len(path) - 1))
        points, corner = break_targets(path, bends, style, height, footed=not motif.ring)
        return replace(sequence, points=points, corner=corner, ring=False, channels=channels(points, ring=motif.ring))
    if motif.ring:
        return sequence
    arm = min(_ARM, len(motif.path) - 1)
    tips = motif.path[0] - motif.path[arm], motif.path[-1] - motif.path[-1 - arm]
    return replace(sequence, points=add_flicks(motif.points, tips, style, height))


def add_flicks(points: Array, tips: tuple[Array, Array], style: Style, height: float) -> Array:
    """Targets, the first and the last moved outwards in the directions of a stroke's tips, as far as the style says."""
    moved = points.copy()
    longest = _FLICKED * float(np.linalg.norm(points[-1] - points[0]))
    for at, way, reach in ((0, tips[0], style.flick.entry), (-1, tips[1], style.flick.exit)):
        size = float(np.linalg.norm(way))
        if size > 0:
            moved[at] += min(reach * height, longest) / size * way
    return moved


def break_targets(
    path: Array, bends: Indices, style: Style, height: float, *, footed: bool = True
) -> tuple[Array, NDArray[np.bool_]]:
    """Points and corners of a path (n, 2), mm, broken into the strokes of a style; `bends`: samples of its own corners.

    footed : whether uprights at its ends get feet.
    """
    rule = style.breaking
    directions = np.array([vector(angle) for angle in rule.directions])
    corners = broken_script.break_path(path, bends, directions, rule.least * height)
    if rule.foot > 0 and footed:
        corners = broken_script.add_feet(corners, rule.foot * height, vector(rule.step))
    return corners, np.ones(len(corners), dtype=bool)


def _join_sequences(sequences: Sequence[TargetSequence], style: Style, height: float) -> Iterator[TargetSequence]:
    """The sequences, those that follow within the reach of the style's ligatures joined into one."""
    reach = style.ligature.reach * height
    group: list[TargetSequence] = []
    for sequence in sequences:
        if group and not _joins(group[-1], sequence, reach):
            yield _merge_group(group, style.ligature.turn)
            group = []
        group.append(sequence)
    if group:
        yield _merge_group(group, style.ligature.turn)


def _merge_group(group: Sequence[TargetSequence], turn: float) -> TargetSequence:
    if len(group) == 1:
        return group[0]
    opened = [_open_ring(part) for part in group]
    points, remaining = join_targets([part.points for part in opened], turn)
    channels = join_poses([part.channels for part in opened], [len(part.points) for part in opened], remaining)
    corner = np.concatenate([part.corner for part in opened])[remaining]
    return replace(opened[0], points=points, corner=corner, channels=channels)


def _open_ring(sequence: TargetSequence) -> TargetSequence:
    """Open a ring: a sequence that ends with the target where it begins."""
    if not sequence.ring:
        return sequence
    points, corner = (
        np.concatenate([sequence.points, sequence.points[:1]]),
        np.concatenate([sequence.corner, sequence.corner[:1]]),
    )
    channels = {name: np.append(values, values[:1]) for name, values in sequence.channels.items()}
    return replace(sequence, points=points, corner=corner, ring=False, channels=channels)


def _joins(a: TargetSequence, b: TargetSequence, reach: float) -> bool:
    if not reach > 0 or (a.word, a.layer, a.colour) != (b.word, b.layer, b.colour):
        return False
    if min(len(a.points), len(b.points)) < 2:
        return False
    return float(np.linalg.norm(b.points[0] - a.points[0 if a.ring else -1])) <= reach


def join_targets(parts: Sequence[Array], turn: float) -> tuple[Array, NDArray[np.bool_]]:
    """Targets of strokes as one sequence; near a join, those on a nearly straight way are left out.

    parts : of (m, 2) float arrays
    turn : rad: a target beside a join goes where the angle that it forms with its neighbours is larger.

    Returns points : (n, 2) float
        remaining : bool, for each of the targets of all parts: which of them these are.
    """
    points = np.concatenate(parts)
    remaining = np.ones(len(points), dtype=bool)
    for join in np.cumsum([len(part) for part in parts])[:-1].tolist():
        for at in (join - 1, join):
            before = at - 1
            while before >= 0 and not remaining[before]:
                before -= 1
            if before >= 0 and at < len(points) - 1 and angle(points[before], points[at], points[at + 1]) > turn:
                remaining[at] = False
    return points[remaining], remaining


def angle(before: Array, at: Array, after: Array) -> float:
    """rad, 0 to π: the angle at a target between its neighbours; π on a straight way, or where two coincide."""
    to, on = before - at, after - at
    size = float(np.linalg.norm(to) * np.linalg.norm(on))
    return float(np.pi if size == 0 else np.arccos(np.clip(to @ on / size, -1.0, 1.0)))
