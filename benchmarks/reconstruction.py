"""Reconstruction: how well plans of lognormal strokes explain recorded pens, against the published method.

The traces are those of a built-in hand; with the environment variable HANDOUT_DATA set, also the single letters of the
UNIPEN files in ``pen/unipen/data`` there.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

import handout
from benchmarks import berio_2017
from handout.errors import InputError
from handout.motion.reconstruction import LognormalPlan, from_recording, from_shape, recording_fit
from handout.motion.reconstruction.key_points import extent, resample_path, snr
from handout.motion.reconstruction.planned_page import sample_times
from handout.sources import read_drawing
from handout.values import Array, Stroke

_LEAST = 1.0  # mm
_MOST = 130  # traces
TEXT = "Goose xylem quartz fjord vamp bank"


def main() -> None:
    """Print the tables."""
    _tables("built-in hand, 4 mm", _house())
    if os.environ.get("HANDOUT_DATA"):
        _tables("recorded letters", _recorded(Path(os.environ["HANDOUT_DATA"]) / "pen" / "unipen" / "data"))


def _house() -> list[Stroke]:
    rng = np.random.default_rng(1)
    hand = handout.load("house-print")
    layout = handout.Layout(handout.page("A5"), margin=(15, 12, 15, 12), x_height=4.0)
    drawing = handout.trace(handout.compose(TEXT, hand, layout, rng)[0], hand, rng)
    return [stroke for stroke in drawing.strokes if extent(stroke.xy) > _LEAST]


def _recorded(folder: Path) -> list[Stroke]:
    """Single letters: files whose labels are of characters, a stroke each."""
    found: list[Stroke] = []
    for path in sorted(folder.rglob("*.dat")):
        try:
            drawing = read_drawing(path)
        except InputError:
            continue
        if len(drawing.strokes) <= 3 and any(s["level"] == "CHARACTER" for s in drawing.about.get("segments", [])):
            found += [s for s in drawing.strokes if extent(s.xy) > _LEAST and len(s.t) > 9]
    return found[:_MOST]


def _spread(values: list[float]) -> str:
    least, tenth, median = np.percentile(values, [0, 10, 50])
    return f"median {median:5.1f}, tenth {tenth:5.1f}, least {least:5.1f}"


def _shape_snr(stroke: Stroke, plan: LognormalPlan) -> float:
    t = np.linspace(float(plan.onset[0]) - 0.1, plan.end + 0.3, 1600)
    return snr(resample_path(stroke.xy, 400), resample_path(plan.position_at(t), 400))


def _tables(what: str, strokes: list[Stroke]) -> None:
    if not strokes:
        print(f"{what}: none found")
        return
    print(f"{what}: {len(strokes)} traces")
    began = time.process_time()
    plans = [from_shape(stroke.xy) for stroke in strokes]
    each = (time.process_time() - began) / len(strokes)
    ours = [_shape_snr(s, p) for s, p in zip(strokes, plans, strict=True)]
    began = time.process_time()
    published = [berio_2017.from_shape(stroke.xy) for stroke in strokes]
    each_published = (time.process_time() - began) / len(strokes)
    theirs = [_shape_snr(s, p) for s, p in zip(strokes, published, strict=True)]
    robust = [_shape_snr(s, berio_2017.from_shape(s.xy, robust=True)) for s in strokes]
    print(
        f"  from shape     ours {_spread(ours)} dB; {1000 * each:.0f} ms each, {each / each_published:.1f} x published"
    )
    print(f"                 published {_spread(theirs)}; with robust key points {_spread(robust)} dB")
    gain = float(np.median(np.array(ours) - np.array(theirs)))
    print(f"                 gain, median {gain:.1f} dB (goals: median 42, tenth 36, least 30, gain 15; 60 ms)")
    _timed(strokes)


def _timed(strokes: list[Stroke]) -> None:
    began = time.process_time()
    plans = [from_recording(s.t, s.xy) for s in strokes]
    each = (time.process_time() - began) / len(strokes)
    speeds, chords = [], []
    for stroke, plan in zip(strokes, plans, strict=True):
        recording = recording_fit.prepare_recording(stroke.t, stroke.xy)
        wanted: Array = np.column_stack([recording.velocity.real, recording.velocity.imag])
        speeds.append(snr(wanted, plan.velocity(recording.t), about_mean=False))
        chords.append(float(np.abs(plan.chords()).max()) / extent(stroke.xy))
    counts = [plan.strokes for plan in plans]
    enough = np.mean(np.array(speeds) >= recording_fit.ENOUGH)
    print(
        f"  with its times {_spread(speeds)} dB; {enough:.1%} at 25 dB or more; strokes median {np.median(counts):.0f}"
    )
    short = np.mean(np.array(chords) <= 3)
    print(f"                 chords within 3 extents {short:.1%}; {1000 * each:.0f} ms each (goals: 95 %, 8 strokes)")
    slowest = max(float(np.ptp(sample_times(plan))) for plan in plans)
    print(f"                 movements last up to {slowest:.1f} s")
