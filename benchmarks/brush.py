"""How brushes paint: energy, seams, cover, paper and streaks, repeats and time, of a page of strokes, half kept out.

With HANDOUT_DATA, the page of twenty dry strokes (`strokes/drybrush/page.jpg`): twelve, drawn by lot, are painted along
their paths from the other eight; both lie beside each other in `brush-sheet.png` of the working folder, turned by
chance, on sides that `brush-sheet.txt` tells.  Without it only what needs no strokes kept out is measured.

Energy is that of the cheapest row over that of the seed's two passes, on the same costs; seams: squares of differences
across the borders of a stroke's joints, quilted over cut hard; cover: of the outline of a solid ribbon on a tight wave;
paper: share of the outline that is not covered; streaks: Kolmogorov-Smirnov distance of their lengths between painted
and real strokes, beside that of each real stroke from the others; repeats within eight segments; time of one thread.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.chains import viterbi
from handout.inking.brush import brushes
from handout.inking.brush.painting import Sized, bends, lay, spread_places
from handout.inking.brush.photographs import PhotographedStroke, find_strokes
from handout.inking.brush.ribbon import SEGMENTS, SPAN, Ribbon, straighten_stroke
from handout.inking.brush.synthesis import WITHIN, Library, SegmentChooser, count_since_same
from handout.scanning.picture_files import read_picture
from handout.values import Array, Indices

# in reading order, from 1: drawn by lot
KEPT_OUT = tuple(sorted((np.random.default_rng(21).permutation(20)[:12] + 1).tolist()))
_COLUMNS, _ROWS = 4, 5  # of the page
_FINEST = 400  # rows of a ribbon: as many as its photograph has pixels, for a sheet of their size
_HALF = 32.0  # pixels: half the width of timed strokes
_REPEATS = 40  # strokes whose repeats are counted, and whose energies and seams are averaged


def wave(length: float, width: float, bent: float = 1.0) -> Array:
    """Borders of the segments of a wave, (m + 1, 2) pixels."""
    x = np.linspace(0, length, 1000)
    line = np.stack([x, bent * 0.7 * width * np.sin(x / (1.6 * width))], axis=1) + 4 * width
    long = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    return spread_places(line, round(long / width * SEGMENTS))


def targets(library: Library, rng: np.random.Generator) -> list[Array]:
    """Costs of the segments of some strokes of many lengths."""
    lengths = rng.integers(10, 160, _REPEATS).tolist()
    guides = [library.ribbons[k] for k in rng.integers(0, len(library.ribbons), _REPEATS)]
    return [library.costs(library.target(np.zeros(m), guide)) for m, guide in zip(lengths, guides, strict=True)]


def two_pass(costs: Array, borders: Array) -> Indices:
    """(m,): the seed's own row: the best after what is there, and then each anew between its neighbours.

    Source: seed 004, §3.3.
    """
    row = [int(costs[0].argmin())]
    for here in costs[1:]:
        row.append(int((here + borders[row[-1]]).argmin()))
    for i, here in enumerate(costs):
        total = here + (borders[row[i - 1]] if i else 0) + (borders[:, row[i + 1]] if i + 1 < len(row) else 0)
        row[i] = int(total.argmin())
    return np.array(row, dtype=np.intp)


def energy(library: Library, costs: Sequence[Array]) -> tuple[float, float]:
    """Of the rows found over that of the two passes, and joints found for one of theirs."""
    sized = Sized(library, 2)
    rows = [(library.row(each), two_pass(each, library.borders)) for each in costs]
    sums = np.sum([[library.energy(row, each) for row in pair] for pair, each in zip(rows, costs, strict=True)], axis=0)
    joints = np.sum([[len(sized.joints(row)) for row in pair] for pair in rows], axis=0)
    return float(sums[0] / sums[1]), float(joints[0] / max(joints[1], 1))


def seams(library: Library, rows: Sequence[Indices]) -> float:
    """Squares of differences across joints, quilted over cut hard."""
    sized = Sized.fitting(library, 2 * _HALF)
    total = np.zeros(2)
    for row in rows:
        at = sized.joints(row) * sized.columns
        for k, ink in enumerate((sized.quilt_segments(row), sized.hard(row))):
            total[k] += float(((ink[:, at] - ink[:, at - 1]) ** 2).sum())
    return float(total[0] / total[1])


def cover() -> float:
    """Of the outline of a solid ribbon, on a wave with bends tighter than it is wide."""
    import cv2

    line = wave(600, 2 * _HALF, 2.5)
    canvas = np.zeros((800, 1000, 4), dtype=np.uint8)
    lay(canvas, np.ones((80, (len(line) - 1) * 8, 4), np.float32), line, np.full(len(line), _HALF))
    sheet = np.full(canvas.shape[:2], 255, dtype=np.uint8)
    cv2.polylines(sheet, [np.rint(line[6:-6]).astype(np.int32)], False, 0)
    outline = cv2.distanceTransform(sheet, cv2.DIST_L2, 5) < _HALF - 1
    return float((canvas[outline, 3] > 250).mean())


def paper(ribbon: NDArray[np.floating[Any]]) -> float:
    """Share of a ribbon's usual outline, (rows, columns) of alpha, that is paper."""
    edge = round(len(ribbon) * (1 - 1 / SPAN) / 2)
    return 1 - float(ribbon[edge : len(ribbon) - edge].mean())


def streaks(alpha: NDArray[np.floating[Any]], columns: int) -> Array:
    """Lengths of the runs of paper along a ribbon within its outline, in segments."""
    edge = round(len(alpha) * (1 - 0.8 / SPAN) / 2)
    runs = []
    for row in alpha[edge : len(alpha) - edge] < 0.5:
        steps = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(int)))
        runs.append(steps[1::2] - steps[::2])
    lengths = np.concatenate(runs) / columns
    return np.asarray(lengths[lengths > 0.1])


def apart(a: Array, b: Array) -> float:
    """Kolmogorov-Smirnov distance of two samples."""
    both = np.sort(np.concatenate([a, b]))
    shares = [np.searchsorted(np.sort(each), both, side="right") / max(len(each), 1) for each in (a, b)]
    return float(np.abs(shares[0] - shares[1]).max())


def timing(library: Library) -> tuple[float, float, float]:
    """ms for 1000 pixels of a stroke 64 pixels wide: choosing, quilting, laying; the least of some."""
    line = wave(900, 2 * _HALF)
    chooser, sized = SegmentChooser(library, np.random.default_rng(0)), Sized.fitting(library, 2 * _HALF)
    canvas = np.zeros((600, 1400, 4), dtype=np.uint8)
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    took = []
    for _ in range(9):
        clock = [time.process_time()]
        row = chooser.row(bends(line))
        clock.append(time.process_time())
        ink = sized.quilt_segments(row)
        clock.append(time.process_time())
        lay(canvas, ink, line, np.full(len(line), _HALF))
        took.append(np.diff([*clock, time.process_time()]))
    choose, quilt, put = (np.min(took[1:], axis=0) * 1e6 / length).tolist()
    return choose, quilt, put


def page_strokes(path: Path) -> dict[int, PhotographedStroke]:
    """The strokes of the page by their numbers, in reading order from 1."""
    picture = read_picture(path).rgb
    numbered = {}
    for found in find_strokes(picture, str(path)).strokes:
        x, y = found.spine.mean(axis=0) + found.corner
        row = int((y / picture.shape[0] - 0.03) * _ROWS / 0.93)
        numbered[1 + row * _COLUMNS + int(x / picture.shape[1] * _COLUMNS)] = found
    return numbered


def beside(
    found: PhotographedStroke, ribbon: Ribbon, painted: NDArray[np.uint8], rim: int, swap: bool, turned: int
) -> NDArray[np.uint8]:
    """A real stroke, without what else is on its page, and the painted one; turned, for who remembers the page."""
    alpha = found.density[..., None]
    usual = np.median(ribbon.rgba[ribbon.rgba[..., 3] > 230][:, :3], axis=0) / 255
    own = np.where(alpha > 0.5, 1 - (1 - found.light) / np.maximum(alpha, 0.5), usual)
    real = np.pad(255 * (1 - alpha * (1 - np.clip(own, 0, 1))), ((rim, rim), (rim, rim), (0, 0)), constant_values=255)
    other = 255.0 - painted[..., 3:] + painted[..., :3]
    pair = [np.rot90(each, turned)[:: -1 if turned > 1 else 1] for each in (real, other)]
    return np.hstack(pair[::-1] if swap else pair).astype(np.uint8)


def kept_out(found: dict[int, PhotographedStroke], library: Library) -> None:
    """The strokes that were kept out, painted from the others' library: paper, streaks and a sheet."""
    rng = np.random.default_rng()  # nobody knows the sides
    chooser = SegmentChooser(library, np.random.default_rng(18))
    real, made, tiles, key = list[tuple[float, Array]](), list[tuple[float, Array]](), list[NDArray[np.uint8]](), []
    for number in KEPT_OUT:
        ribbon, line, half = straighten_stroke(found[number])
        long = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
        places = spread_places(line, max(6, round(long / (2 * half) * SEGMENTS)))
        sized = Sized.fitting(library, 2 * half)
        ink = sized.quilt_segments(chooser.row(bends(places)))
        rim = round(half)  # so that no stroke ends at the border of its picture
        canvas = np.zeros((*(size + 2 * rim for size in found[number].density.shape), 4), dtype=np.uint8)
        lay(canvas, ink, places + rim, np.full(len(places), half))
        alpha = ribbon.premultiplied_ink[..., 3]
        real.append((paper(alpha), streaks(alpha, ribbon.columns)))
        made.append((paper(ink[..., 3]), streaks(ink[..., 3], sized.columns)))
        key.append(bool(rng.random() < 0.5))
        tiles.append(beside(found[number], ribbon, canvas, rim, key[-1], int(rng.integers(4))))
    sources = library.ribbons[::2]
    given = [(paper(a), streaks(a, r.columns)) for r in sources for a in [r.premultiplied_ink[..., 3]]]
    papers = [float(np.mean([each[0] for each in group])) for group in (made, given, real)]
    print(f"paper: painted {papers[0]:.3f}, strokes learned from {papers[1]:.3f}, kept out {papers[2]:.3f}")
    pooled = [np.concatenate([each[1] for each in group]) for group in (made, given, real)]
    everything = [*given, *real]
    own = [
        apart(each[1], np.concatenate([other[1] for other in everything if other is not each])) for each in everything
    ]
    far = [apart(pooled[0], each) for each in (np.concatenate(pooled[1:]), pooled[2])]
    print(f"streaks: painted from all real strokes {far[0]:.3f}, from those kept out {far[1]:.3f};")
    print(f"  a real stroke from the others {np.median(own):.3f} (median), {np.min(own):.3f} to {np.max(own):.3f}")
    show(tiles, key)


def show(tiles: Sequence[NDArray[np.uint8]], key: Sequence[bool]) -> None:
    """The pairs on one sheet, and on which side the painted stroke is, in a file of its own."""
    import cv2

    high, wide = (max(tile.shape[k] for tile in tiles) for k in (0, 1))
    padded = [
        np.pad(tile, ((0, high - tile.shape[0]), (0, wide - tile.shape[1]), (0, 0)), constant_values=255)
        for tile in tiles
    ]
    rows = [np.hstack(padded[k : k + 2]) for k in range(0, len(padded) - 1, 2)]
    cv2.imwrite("brush-sheet.png", np.vstack(rows)[..., ::-1])
    sides = [f"{n}: painted {'left' if left else 'right'}" for n, left in zip(KEPT_OUT, key, strict=True)]
    Path("brush-sheet.txt").write_text("\n".join(sides) + "\n", encoding="utf-8")
    print("wrote brush-sheet.png, and brush-sheet.txt, which tells the sides")


def report(library: Library) -> None:
    """What needs no strokes kept out."""
    rng = np.random.default_rng(3)
    costs = targets(library, rng)
    share, joints = energy(library, costs)
    print(f"segments {len(library.place) // 2}, and their mirror images")
    print(f"energy: {share:.3f} of two passes, with {joints:.3f} of their joints")
    steps = [[library.borders] * (len(each) - 1) for each in costs]
    exact = sum(library.energy(np.array(viterbi(list(c), s)), c) for c, s in zip(costs, steps, strict=True))
    passes = sum(library.energy(two_pass(each, library.borders), each) for each in costs)
    print(f"  {exact / passes:.3f} where what comes again costs nothing, as in the two passes")
    rows = [library.row(each) for each in costs]
    print(f"seams: quilted {seams(library, rows):.3f} of cut hard")
    chooser = SegmentChooser(library, np.random.default_rng(5))
    again = np.concatenate(
        [count_since_same(library.segment_numbers[chooser.row(np.zeros(len(row)))]) <= WITHIN for row in rows]
    )
    print(f"repeats within {WITHIN} segments: {again.mean():.4f}")
    print(f"cover of the outline: {cover():.5f}")
    choose, quilt, put = timing(library)
    print(f"ms for 1000 px: {choose + quilt + put:.1f} (choosing {choose:.1f}, quilting {quilt:.1f}, laying {put:.1f})")


def main() -> None:
    """Print the figures."""
    print("shipped dry brush")
    report(brushes.find("dry-brush").library)
    if "HANDOUT_DATA" in os.environ:
        found = page_strokes(Path(os.environ["HANDOUT_DATA"]) / "strokes" / "drybrush" / "page.jpg")
        learned = [straighten_stroke(stroke, _FINEST)[0] for n, stroke in found.items() if n not in KEPT_OUT]
        library = Library.from_ribbons(learned)
        print("eight strokes of the page")
        report(library)
        kept_out(found, library)
