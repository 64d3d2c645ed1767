"""Pose of the pen: the experiments of seed 001, on the paper's own recordings and those of its demonstration.

Recordings are read from the folder in HANDOUT_DATA (``pose/helpinghand``); nothing of them is kept.  Correlations are
Pearson's r of the channels over patches of 25 samples of 0.1 mm (a two-thousandth of the tablet), each patch with the
most similar one, farther pairs than the mean left out, averaged as Fisher's z.  The costs were set on writers b and c;
n and s were kept out.  Pictures go into the folder ``pose-pictures``.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from handout.inking.pen import usual
from handout.motion import POSE_METHODS
from handout.motion.pose.features import FEATURES, resample_path, velocities
from handout.motion.pose.library import PoseLibrary, join_strokes, learn, level_pose
from handout.motion.pose.posing import anchors, pose_drawing, shape_stroke
from handout.motion.pose.synthesis import PoseModel, segments
from handout.motion.styles.targets import letter_height
from handout.sinks import Look, write_drawings
from handout.sources import read_drawing
from handout.values import TURNS, Array, Drawing, Indices, Page, Stroke

_STEP = 0.1  # mm between the samples of patches
_HALF = 12  # samples on either side of a patch's middle; the paper's
_EVERY = 6  # patches of which one is a query
_TUNED, _KEPT_OUT = (("b1", "b2"), ("c1", "c2")), (("n1", "n2"), ("s1", "s2"))
_OTHER = {"b": "c1", "c": "b1", "n": "s1", "s": "n1"}  # another writer's library
_PICTURES = Path("pose-pictures")
_CLIP = 0.999  # of r, before Fisher's z


def folder() -> Path:
    return Path(os.environ.get("HANDOUT_DATA", "data")) / "pose" / "helpinghand"


@cache
def page(name: str) -> Drawing:
    return read_drawing(folder() / f"{name}.cyn")


@cache
def library(name: str) -> PoseLibrary:
    return learn([page(name)], name).library


@cache
def model(name: str, features: str = "velocities") -> PoseModel:
    return PoseModel(library(name), features)


@dataclass(frozen=True, eq=False)
class Patches:
    """Pieces of strokes.

    shape : (n, d), what they are compared by.
    pose : (n, 4, 25), pressure, lean in x and y, rotation.
    of : (n,) numbers of their strokes.
    """

    shape: Array
    pose: Array
    of: Indices


def patches(drawing: Drawing) -> Patches:
    size, shapes, poses, of = 2 * _HALF + 1, [], [], []
    for number, stroke in enumerate(drawing.strokes):
        xy, at = resample_path(stroke.xy, _STEP)
        if len(xy) < size:
            continue
        ends = np.minimum(1, np.sqrt(np.column_stack([np.arange(len(xy)), np.arange(len(xy))[::-1]]) / _HALF))
        windows = np.lib.stride_tricks.sliding_window_view
        tangents = windows(velocities(xy), size, axis=0).reshape(len(xy) - size + 1, -1)
        shapes.append(np.column_stack([ends[_HALF:-_HALF], tangents]))
        poses.append(windows(_channels(stroke, at), size, axis=0))
        of.append(np.full(len(shapes[-1]), number))
    return Patches(np.concatenate(shapes).astype(np.float32), np.concatenate(poses), np.concatenate(of))


def _channels(stroke: Stroke, at: Array) -> Array:
    """(n, 4): NaN for what is not known."""
    n, unknown = np.arange(len(stroke.t)), np.full(len(at), np.nan)
    known = {k: np.interp(at, n, np.unwrap(v) if k in TURNS else v) for k, v in stroke.pose.items()}
    lean = known.get("tilt", unknown), known.get("azimuth", unknown)
    along = [lean[0] * turned(lean[1]) for turned in (np.cos, np.sin)]
    return np.column_stack([known.get("pressure", unknown), *along, known.get("rotation", unknown)])


def nearest(query: Patches, known: Patches, apart: bool) -> tuple[Array, Indices]:
    """Distances of the most similar patches and their numbers; `apart`: of other strokes only."""
    distance, number = [], []
    norm = (known.shape**2).sum(axis=1)
    for a in range(0, len(query.shape), 512):
        part = query.shape[a : a + 512]
        square = norm - 2 * part @ known.shape.T
        if apart:
            square[query.of[a : a + 512, None] == known.of] = np.inf
        best = square.argmin(axis=1)
        number.append(best)
        distance.append(square[np.arange(len(best)), best] + (part**2).sum(axis=1))
    return np.sqrt(np.maximum(np.concatenate(distance), 0)), np.concatenate(number)


def correlation(a: Array, b: Array) -> float:
    """Of the channels of patches (n, 4, 25); those that stand still in either are left out."""
    a, b = (v - v.mean(axis=2, keepdims=True) for v in (a, b))
    size = np.sqrt((a**2).sum(axis=2) * (b**2).sum(axis=2))
    r = (a * b).sum(axis=2)[size > 1e-10] / size[size > 1e-10]
    return float(np.tanh(np.arctanh(np.clip(r, -_CLIP, _CLIP)).mean()))


def thinned(all_: Patches) -> Patches:
    return Patches(all_.shape[::_EVERY], all_.pose[::_EVERY], all_.of[::_EVERY])


def matched(query: Patches, known: Patches, apart: bool = False) -> tuple[Indices, Indices]:
    """Numbers of patches whose most similar one is nearer than the mean, and of these."""
    distance, number = nearest(query, known, apart)
    near = np.flatnonzero(distance <= distance.mean())
    return near, number[near]


def distinctiveness() -> None:
    """§3.1: matched patches within and between libraries, against random pairs."""
    names = ["b1", "b2", "c1", "c2", "n1", "n2", "s1", "s2"]
    known = {name: patches(page(name)) for name in names}
    table = np.zeros((len(names), len(names)))
    for i, a in enumerate(names):
        query = thinned(known[a])
        for j, b in enumerate(names):
            near, number = matched(query, known[b], a == b)
            table[i, j] = correlation(query.pose[near], known[b].pose[number])
    writer = np.arange(len(names)) // 2
    same = writer[:, None] == writer
    diagonal = np.eye(len(names), dtype=bool)
    rng = np.random.default_rng(0)
    chance = [correlation(*(known[n].pose[rng.integers(len(known[n].pose), size=4000)] for _ in "ab")) for n in names]
    print(f"matched patches: same page {table[diagonal].mean():.3f}, same writer's other page "
          f"{table[same & ~diagonal].mean():.3f}, other writer {table[~same].mean():.3f}, random pairs "
          f"{np.mean(chance):.3f}; same - other {table[same].mean() - table[~same].mean():.3f}")  # fmt: skip
    _charted(table, [float(v) for v in (table[diagonal].mean(), table[same & ~diagonal].mean(), table[~same].mean(),
                                        np.mean(chance))])  # fmt: skip
    print("      " + " ".join(f"{name:>5}" for name in names))
    for name, row in zip(names, table, strict=True):
        print(f"  {name:<3} " + " ".join(f"{v:5.2f}" for v in row))


def _charted(table: Array, bars: Sequence[float]) -> None:
    """The matrix, darker for a higher r, and the bars (same page, same writer, other writer, chance), as a picture."""
    from PIL import Image, ImageDraw

    cell, high = 48, 48 * len(table)
    picture = Image.new("L", (high + cell * (2 * len(bars) + 2), high), 255)
    draw = ImageDraw.Draw(picture)
    for (i, j), r in np.ndenumerate(table):
        draw.rectangle((j * cell, i * cell, (j + 1) * cell - 2, (i + 1) * cell - 2), fill=round(255 * (1 - r)))
    for k, bar in enumerate(bars):
        left = high + cell * (2 * k + 1)
        draw.rectangle((left, round(high * (1 - bar)), left + cell, high), fill=60)
    _PICTURES.mkdir(exist_ok=True)
    picture.save(_PICTURES / "matrix.png")


def synthesis(pairs: Sequence[tuple[str, str]], title: str) -> None:
    """§5.1: what is synthesised on one page of a writer with another page as the library."""
    rows = [{**_judged(a, b), **_strange(a, b)} for a, b in pairs]
    print(f"{title}: " + ", ".join(f"{a} for {b}" for a, b in pairs))
    for name in rows[0]:
        values = [row[name] for row in rows]
        print(f"  {name:<28} {np.mean(values):6.3f}   " + " ".join(f"{v:6.3f}" for v in values))


def _judged(known: str, asked: str) -> dict[str, float]:
    """r with the library and with the truth, by each method; steps against the truth's; time."""
    truth, stock = patches(page(asked)), patches(page(known))
    query = thinned(truth)
    near, number = matched(query, stock)
    row = {"truth, with the library": correlation(query.pose[near], stock.pose[number])}
    samples = sum(len(resample_path(s.xy, letter_height(page(asked)) / 20)[0]) for s in page(asked).strokes)
    model(known).nearest(np.zeros((2, 2)))  # the tree is grown once for a library
    for method in POSE_METHODS:
        begun = time.process_time()
        made = pose_drawing(page(asked), model(known), method)
        seconds = time.process_time() - begun
        pose = thinned(patches(made)).pose
        row[f"{method}, with the library"] = correlation(pose[near], stock.pose[number])
        row[f"{method}, with the truth"] = correlation(pose, query.pose)
        row[f"{method}, rms step / truth's"] = _step(pose) / _step(query.pose)
        row[f"{method}, ms a sample"] = 1e3 * seconds / samples
    return row


def _step(pose: Array) -> float:
    known = np.isfinite(pose).all(axis=(0, 2))
    return float(np.sqrt((np.diff(pose[:, known], axis=2) ** 2).mean()))


def _strange(_: str, asked: str) -> dict[str, float]:
    """With another writer's library, against the truth."""
    made = thinned(patches(pose_drawing(page(asked), model(_OTHER[asked[0]]))))
    return {"other's library, with the truth": correlation(made.pose, thinned(patches(page(asked))).pose)}


def _quality(made_by: PoseModel, asked: str) -> tuple[float, float, float]:
    """r with the truth, samples in a segment, ms a sample."""
    unit = letter_height(page(asked)) / 20
    paths = [resample_path(stroke.xy, unit)[0] for stroke in page(asked).strokes]
    samples = sum(map(len, paths))
    made_by.nearest(paths[0])
    begun = time.process_time()
    made = pose_drawing(page(asked), made_by)
    seconds = time.process_time() - begun
    parts = sum(len(segments(made_by.sequence(made_by.nearest(xy)), made_by.library)) for xy in paths[::4])
    r = correlation(thinned(patches(made)).pose, thinned(patches(page(asked))).pose)
    return r, sum(map(len, paths[::4])) / parts, 1e3 * seconds / samples


def sizes() -> None:
    """§5: libraries of 10 to 1000 strokes, enriched by strokes half as large and half as large again; time."""
    many = learn([page(name) for name in ("n1", "n3", "n4")], "n").library
    parts = many.strokes()
    larger = [(xy * scale, ch) for scale in (0.5, 1.5) for xy, ch in parts]
    enriched = join_strokes([*parts, *((r[0], {k: np.interp(r[1], np.arange(len(v)), v) for k, v in ch.items()})
                                 for r, ch in ((resample_path(xy, 1.0), ch) for xy, ch in larger))], many)  # fmt: skip
    for count in (10, 150, len(parts), 1000):
        stock = (
            join_strokes(parts[:count], many)
            if count <= len(parts)
            else join_strokes(enriched.strokes()[: min(count, 1000)], enriched)
        )
        r, length, ms = _quality(PoseModel(stock), "n2")
        note = "" if count <= len(parts) else " (enriched by scaled ones)"
        print(f"  {len(stock.lengths):4} strokes{note}, {len(stock.xy):6} samples: r with the truth {r:.3f}, "
              f"{length:.0f} samples a segment, {ms:.3f} ms a sample")  # fmt: skip


def features() -> None:
    """§6: filtered velocities against shape contexts."""
    for name in FEATURES:
        rows = [_quality(model(a, name), b) for a, b in (*_TUNED, *_KEPT_OUT)]
        r, length, ms = np.mean(rows, axis=0)
        print(f"  {name:<14}: r with the truth {r:.3f}, {length:.0f} samples a segment, {ms:.3f} ms a sample")


def trend() -> None:
    """§3.2: how much of the spread of each channel goes with the place on the page."""
    for name in ("b1", "s1"):
        before, after = library(name).channels, level_pose(library(name)).channels
        spreads = (f"{k} {np.std(v):.3f} to {np.std(after[k]):.3f}" for k, v in before.items())
        print(f"  {name}: " + ", ".join(spreads))


def pictures(place: Path) -> None:
    """§4, §5: matching, the shape optimisation, line drawings, vector art, mouse input; with a brush pen."""
    place.mkdir(exist_ok=True)
    look = Look(usual("brushpen", 1.2), 150, footprint=True)
    queries: dict[str, Callable[[], Drawing]] = {
        "truth": lambda: page("b2"),
        "own-library": lambda: pose_drawing(page("b2"), model("b1")),
        "average": lambda: pose_drawing(page("b2"), model("b1"), "average"),
        "closest": lambda: pose_drawing(page("b2"), model("b1"), "closest"),
        "other-library": lambda: pose_drawing(page("b2"), model("s1")),
        "drawing": lambda: pose_drawing(page("query-catAndFish"), model("b-flower")),
        "mouse": lambda: _bare(page("query-straightEnglish")),
        "mouse-neatened": lambda: pose_drawing(page("query-straightEnglish"), model("b1"), passes=2),
        "mouse-one-pass": lambda: pose_drawing(page("query-straightEnglish"), model("b1"), passes=1),
        "vector-art": lambda: pose_drawing(_spiral(), model("b1"), height=20.0),
    }
    for name, made in queries.items():
        write_drawings([made()], [place / f"{name}.png"], look)
    write_drawings([_matching("b1", "b2")], [place / "matching.png"], Look(usual("fineliner", 0.8), 150))
    for name, held in (("drift", False), ("shaped", True)):
        write_drawings(
            [_stylised("b1", "query-houses", held)], [place / f"{name}.png"], Look(usual("fineliner", 0.5), 150)
        )


def _bare(drawing: Drawing) -> Drawing:
    return replace(drawing, strokes=tuple(Stroke(s.t, s.xy, pressure=np.full(len(s.t), 0.4)) for s in drawing.strokes))


def _spiral() -> Drawing:
    """Lines as a program draws them."""
    angle = np.linspace(0, 8 * np.pi, 400)
    turns = np.column_stack([np.cos(angle), np.sin(angle)]) * angle[:, None] * 1.6 + 60
    box = np.array([[10, 125], [110, 125], [110, 145], [10, 145], [10, 125.0]])
    return Drawing((Stroke(angle, turns), Stroke(angle[-1] + 1 + np.arange(5.0), box)), Page(120, 155))


def _matching(known: str, asked: str) -> Drawing:
    """Every other segment in another colour."""
    unit, colours, strokes = letter_height(page(asked)) / 20, ("#c03020", "#2050c0"), list[Stroke]()
    for stroke in page(asked).strokes:
        xy, _ = resample_path(stroke.xy, unit)
        parts = segments(model(known).sequence(model(known).nearest(xy)), library(known))
        for number, part in enumerate(parts):
            place = xy[part.start : part.stop + 1] * unit
            strokes.append(
                Stroke(np.arange(float(len(place))) + 10_000 * len(strokes), place, colour=colours[number % 2])
            )
    return Drawing(tuple(strokes), page(asked).page)


def _stylised(known: str, asked: str, held: bool) -> Drawing:
    """Velocities of a library added up, held at the anchors or not."""
    unit, strokes = letter_height(page(asked)) / 20, list[Stroke]()
    for stroke in page(asked).strokes:
        xy, _ = resample_path(stroke.xy, unit)
        moved = model(known).movement(xy)
        drawn = shape_stroke(xy, moved, anchors(xy)) if held else xy[:1] + np.cumsum(moved, axis=0) - moved[:1]
        strokes.append(Stroke(np.arange(float(len(xy))) + 10_000 * len(strokes), drawn * unit))
    return Drawing(tuple(strokes), page(asked).page)


def main() -> None:
    if not folder().is_dir():
        print(f"No recordings in {folder()}: name the folder of the data in HANDOUT_DATA.")
        return
    distinctiveness()
    synthesis(_TUNED, "set on")
    synthesis(_KEPT_OUT, "kept out")
    print("sizes of libraries, writer n:")
    sizes()
    print("features, mean of b, c, n, s:")
    features()
    print("standard deviations before and after the trend over the page is taken out:")
    trend()
    pictures(_PICTURES)
    print("pictures: pose-pictures")
