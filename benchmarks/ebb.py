"""EBB: how much of the hand's speed each firmware keeps, what was announced against executed, the queue."""

from __future__ import annotations

import msgspec
import numpy as np

from benchmarks.plot import HANDS, TEXT, written
from handout import profiles
from handout.plotting import observation, open_port, plan, run
from handout.plotting.dialects import Timed
from handout.profiles import Acceleration, Plotter
from handout.values import Array, Drawing
from handout_lab.simulated import FaultyPlotter

# how motion is told, the firmware that is told so, slices a second
WAYS = (
    ("SM 25 ms", "2.4.5", 40.0),
    ("SM 10 ms", "2.4.5", 100.0),
    ("LM 10 ms", "2.6.5", 100.0),
    ("LT 10 ms", "2.8.1", 100.0),
    ("LT 10 ms, fw 3", "3.0.2", 100.0),
)
ACCELERATIONS = (1524, 2000, 5000)
_WINDOW = 0.005  # s, half of what speeds are means over
_LAGS = np.arange(-0.03, 0.0301, 0.0005)


def main() -> None:
    """Print the comparison."""
    print("speeds against the hand's, at the same time: rms of peak and correlation; in place: rms; deviation, mm;")
    print("time of the strokes over the hand's; executed over announced; fewest moves in hand; moves a second")
    for acceleration in ACCELERATIONS:
        for hand in HANDS:
            drawing = written(hand, TEXT)
            print(f"{hand}, {acceleration} mm/s², peak {max(s.speed.max() for s in drawing.strokes):.0f} mm/s")
            for name, firmware, rate in WAYS:
                print(f"  {name:<15} {_line(drawing, machine(acceleration, rate), firmware)}")


def machine(acceleration: float, rate: float) -> Plotter:
    """The AxiDraw V3 with another acceleration, mm/s², and so many slices a second."""
    profile = profiles.find("axidraw-v3", "plotter")
    assert isinstance(profile, Plotter)
    limits = msgspec.structs.replace(profile.limits, acceleration=Acceleration(acceleration))
    return msgspec.structs.replace(profile, limits=limits, segment_rate=rate)


def _line(drawing: Drawing, profile: Plotter, firmware: str) -> str:
    made = plan(drawing, profile)
    port = open_port(f"sim:?firmware={firmware}", profile)
    assert isinstance(port, FaultyPlotter)
    report = run(made, port, profile)
    executed = port.executed_drawing()
    found, (rms, correlation) = observation.compare_strokes(drawing, executed), in_time(drawing, executed)
    slices = [block.seconds for block in made.blocks if isinstance(block, Timed)]
    return (
        f"{rms:6.2%} {correlation:.4f} | {found.rms:6.2%} | {found.deviation:.3f} | {made.stretched:.3f} | "
        f"{report.executed_s / report.announced_s:.4f} | {report.min_queue} | {len(slices) / sum(slices):.0f}/s"
    )


def in_time(drawing: Drawing, executed: Drawing) -> tuple[float, float]:
    """Rms, as a share of the peak, and correlation of the speeds at the same times; each stroke on its own clock.

    A stroke is found on the machine's clock where it fits best, for its first step may come a moment late.
    """
    want, have = [], []
    for a, b in zip(drawing.strokes, executed.strokes, strict=True):
        t = np.arange(a.t[0] + _WINDOW, a.t[-1] - _WINDOW, 0.001) - a.t[0]
        if a.length == 0 or len(t) < 5 or len(b.t) < 3:
            continue
        meant = _speeds(a.xy, a.t - a.t[0], t)
        shifted = [_speeds(b.xy, b.t - b.t[0], t + lag) for lag in _LAGS]
        want.append(meant)
        have.append(min(shifted, key=lambda speeds: float(((speeds - meant) ** 2).sum())))
    x, y = np.concatenate(want), np.concatenate(have)
    return float(np.sqrt(np.mean((x - y) ** 2)) / x.max()), float(np.corrcoef(x, y)[0, 1])


def _speeds(xy: Array, clock: Array, t: Array) -> Array:
    """(n,) mm/s: mean speeds over a hundredth of a second around times t, as the crow flies."""
    early, late = np.clip(t - _WINDOW, clock[0], clock[-1]), np.clip(t + _WINDOW, clock[0], clock[-1])
    way = [np.interp(late, clock, xy[:, axis]) - np.interp(early, clock, xy[:, axis]) for axis in (0, 1)]
    return np.asarray(np.hypot(*way) / np.maximum(late - early, 1e-9))
