"""Which letter every sample of the pen's path and every inked pixel belongs to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import regex
from numpy.typing import NDArray

from handout.motion.trace import STEPS
from handout.simulated.flatbed import GlassPlacement
from handout.values import Array, Drawing, Indices, Manuscript
from handout_lab.author.truth import Letter, Path, Split

_STEP = 0.4  # pixels between two places of a path as it is drawn
_APART = 1.5  # widths of the line along it, from which on nearness is no mere continuation
_REACH = 1.5  # mm from its path that ink may lie
_ROWS = 1024
_GRAPHEME = regex.compile(r"\X")


def paths(drawing: Drawing, of: Sequence[Indices], place: GlassPlacement, line: float) -> tuple[Path, ...]:
    """The pen's path, in pixels of the picture, with the letter of each sample.

    of : what `motion.trace.letters_of_samples` says of its strokes; line : pixels, width of the pen's line.
    """
    pen_paths = []
    for stroke, letters in zip(drawing.strokes, of, strict=True):
        xy = place.pixels(stroke.xy)
        pen_paths.append(Path(xy, parted(xy, letters, line), _ligature(letters)))
    return tuple(pen_paths)


def _ligature(of: Indices) -> NDArray[np.bool_]:
    """Samples between the last point of a letter and the first of the next: half an interval on either side."""
    flags = np.zeros(len(of), dtype=bool)
    for change in np.flatnonzero(np.diff(of)) + 1:
        flags[change - STEPS // 2 : change + STEPS // 2] = True
    return flags


def parted(xy: Array, of: Indices, line: float) -> Indices:
    """(n,) letter of each sample of a path, with the border between joined letters where it can be seen.

    By time, the border is halfway between two letters; the pen may be on a stem there that it is about to retrace, so
    that nobody sees a border.  What is seen is the stretch from where the pen leaves the line of the first letter to
    where it first meets the line of the second: the border is put into the middle of that stretch.

    xy : (n, 2) float, pixels; of : (n,) int; line : pixels, within which two ways make one line.
    """
    owners = np.array(of)
    far = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))]
    changes = [0, *(np.flatnonzero(np.diff(of)) + 1).tolist(), len(of)]
    for before, change, after in zip(changes, changes[1:], changes[2:], strict=False):
        first, last = max(change - STEPS // 2, before), min(change + STEPS // 2, after)
        meets = _on(xy, far, slice(before, last), slice(last, after), line)
        stays = _on(xy, far, slice(first, after), slice(before, first), line)
        # the latter backwards, so that one rule does for both
        end = before + _first_met(meets, first - before)
        begin = after - _first_met(stays[::-1], after - last)
        middle = (begin + end) // 2
        if begin > end:  # all of the way lies on one of the letters, or on both
            middle = end if begin == first else begin if end == last else change
        middle = min(max(middle, before + 1), after - 1)
        owners[middle:change], owners[change:middle] = of[change], of[change - 1]
    return owners


def _on(xy: Array, far: Array, way: slice, letter: slice, line: float) -> NDArray[np.bool_]:
    """Which samples of a way lie on a letter's line; the stretch that merely continues the letter is left out."""
    from scipy.spatial.distance import cdist

    between = np.abs(far[way, None] - far[None, letter])
    return np.asarray(((cdist(xy[way], xy[letter]) < line) & (between > _APART * line)).any(axis=1))


def _first_met(met: NDArray[np.bool_], begin: int) -> int:
    """Index of the first sample from `begin` on that is met; where `begin` itself is, of the first of its run."""
    places = np.flatnonzero(met[begin:])
    if not len(places):
        return len(met)
    if places[0]:
        return begin + int(places[0])
    free = np.flatnonzero(~met[:begin])
    return int(free[-1]) + 1 if len(free) else begin


def splits(paths: Sequence[Path]) -> tuple[Split, ...]:
    """Where the letters of joined paths part (see `parted`)."""
    return tuple(
        Split(
            (float(path.xy[i : i + 2, 0].mean()), float(path.xy[i : i + 2, 1].mean())),
            int(path.of[i]),
            int(path.of[i + 1]),
        )
        for path in paths
        for i in np.flatnonzero(np.diff(path.of))
    )


def labels(paths: Sequence[Path], inked: NDArray[np.bool_], pixel: float) -> NDArray[np.int32]:
    """(h, w): 1 + index in the text of the letter whose path is nearest, 0 where `inked` (h, w) is not.

    Distances are those of a chamfer, a few hundredths of a pixel from straight.
    """
    height = len(inked)
    owned = np.zeros(inked.shape, dtype=np.int32)
    place, letter = _drawn(paths, inked.shape)
    halo = max(2, round(_REACH / pixel))
    for start in range(0, height, _ROWS):
        stop = min(start + _ROWS, height)
        top, bottom = max(0, start - halo), min(height, stop + halo)
        here = (place[:, 1] >= top) & (place[:, 1] < bottom)
        if not here.any():
            continue
        near = _nearest(place[here] - (0, top), letter[here], (bottom - top, inked.shape[1]), halo)
        owned[start:stop] = np.where(inked[start:stop], near[start - top : stop - top], 0)
    return owned


def _nearest(place: Indices, letter: Indices, shape: tuple[int, int], reach: float) -> NDArray[np.int32]:
    """(h, w) int32: 1 + the letter drawn nearest to every pixel; 0 beyond the reach."""
    import cv2

    canvas = np.zeros(shape, dtype=np.int32)
    canvas[place[:, 1], place[:, 0]] = letter + 1
    away, seed = cv2.distanceTransformWithLabels(
        (canvas == 0).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    drawn = canvas > 0
    table = np.zeros(int(seed.max()) + 1, dtype=np.int32)
    table[seed[drawn]] = canvas[drawn]
    return np.asarray(np.where(away <= reach, table[seed], 0), dtype=np.int32)


def _drawn(paths: Sequence[Path], shape: tuple[int, ...]) -> tuple[Indices, Indices]:
    """Pixels (n, 2) that the paths go through, in the order of writing, and the index of the letter at each."""
    places, letters = [np.zeros((0, 2))], [np.zeros(0, dtype=np.intp)]
    for path in paths:
        at = evenly(path.xy, _STEP)
        index = np.arange(len(path.xy))
        places.append(np.column_stack([np.interp(at, index, path.xy[:, k]) for k in (0, 1)]))
        letters.append(path.of[np.rint(at).astype(np.intp)])
    place, letter = np.rint(np.concatenate(places)).astype(np.intp), np.concatenate(letters)
    inside = ((place >= 0) & (place < (shape[1], shape[0]))).all(axis=1)
    return place[inside], letter[inside]


def evenly(xy: Array, step: float) -> Array:
    """Fractional indices (k,) of places along a path (n, 2) that are at most `step` apart; both ends are in."""
    if len(xy) < 2:
        return np.zeros(len(xy))
    far = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))]
    count = max(1, int(np.ceil(far[-1] / step)))
    # a pen at rest still moves on by a hair, so that the index is a function of the way
    return np.interp(np.linspace(0, far[-1], count + 1), far + np.arange(len(far)) * 1e-12, np.arange(len(far)))


def letters(manuscript: Manuscript, owned: NDArray[np.int32]) -> tuple[Letter, ...]:
    """Every letter of the page with the box of its ink (`owned`: its labels), each index of the text once."""
    from scipy.ndimage import find_objects

    boxes = find_objects(owned)
    by_index: dict[int, Letter] = {}
    for text, at, line, word in _spelt(manuscript):
        before = by_index.get(at)
        box = boxes[at] if at < len(boxes) else None
        corners = None if box is None else (box[1].start, box[0].start, box[1].stop, box[0].stop)
        # a borrowed form may take several letters for one grapheme
        by_index[at] = Letter(before.text + text if before else text, at, line, word, corners)
    return tuple(by_index.values())


def _spelt(manuscript: Manuscript) -> Iterator[tuple[str, int, int, int]]:
    """(grapheme, index in the text, line, word) of everything placed on the page."""
    for number, line in enumerate(manuscript.lines):
        graphemes = [g for g in _GRAPHEME.findall(line.text) if not g.isspace()]
        for grapheme, placed in zip(graphemes, line.placed, strict=True):
            yield grapheme, placed.at, number, placed.word


def baselines(manuscript: Manuscript, place: GlassPlacement) -> tuple[Array, ...]:
    """For each line (n, 2) pixels, every 2 mm from its first letter to its last."""
    lines = []
    for line in manuscript.lines:
        points = [stroke[:, 0] for placed in line.placed for stroke in placed.strokes]
        left, right = min(p.min() for p in points), max(p.max() for p in points)
        x = np.linspace(left, right, max(2, round((right - left) / 2)))
        lines.append(place.pixels(np.column_stack([x, line.height_at(x)])))
    return tuple(lines)


def rule(manuscript: Manuscript) -> float:
    """Distance of two lines, mm."""
    spacing = manuscript.about.get("line_spacing")
    if isinstance(spacing, float):
        return spacing
    heights = [line.baseline for line in manuscript.lines]
    return float(np.median([b - a for a, b in pairwise(heights)])) if len(heights) > 1 else 4 * manuscript.x_height
