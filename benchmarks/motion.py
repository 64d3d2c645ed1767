"""Both motor engines: against a Riccati recursion, dense solutions, and the length of what is written."""

from __future__ import annotations

import importlib.util
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.motion import optimal_control, sigma_lognormal
from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.tracker import mean
from handout.values import ActionPlan

Array = NDArray[np.float64]
SMOOTH, STEPS = 0.25, 25


def main() -> None:
    tracking()
    length()
    pulses()
    writing()


def tracking() -> None:
    """One chain of 60 Gaussian targets, N = 1500, order 4, two dimensions, one covariance a target."""
    reference = _references()
    targets, covariances = _chain(60)
    banded, ours = _timed(lambda: mean(targets, covariances, smooth=SMOOTH, steps=STEPS, ends="fixed"), 15)
    recursion, theirs = _timed(lambda: reference.riccati(targets, covariances, SMOOTH, STEPS, 4), 5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # scipy says, rightly, that the dense matrix is singular to its precision
        batch, dense = _timed(lambda: reference.dense_batch(targets, covariances, SMOOTH, STEPS, 4), 1)
    extent = float(np.ptp(targets, axis=0).max())
    print(f"optimal control, 60 targets, 1500 samples: {banded * 1e3:.2f} ms")
    print(f"  Riccati recursion {recursion * 1e3:.0f} ms: {_ratio(recursion / banded, 25)}")
    print(f"  dense batch {batch:.2f} s: {_ratio(batch / banded, 500)}")
    print(
        f"  off the Riccati path, in extents: banded {_off(ours, theirs, extent)}, dense {_off(dense, theirs, extent)}"
    )


def length() -> None:
    """Time over the number of targets, and the exponent of the power law through it."""
    counts = [60, 200, 600, 2000, 6000]
    times = []
    for count in counts:
        targets, covariances = _chain(count)
        times.append(_timed(partial(mean, targets, covariances, smooth=SMOOTH, steps=STEPS), 5)[0])
    exponent = float(np.polyfit(np.log(counts), np.log(times), 1)[0])
    figures = ", ".join(f"{count}: {t * 1e3:.1f} ms" for count, t in zip(counts, times, strict=True))
    print(f"optimal control by number of targets: {figures}")
    print(f"  time grows with the power {exponent:.2f} (goal ≤ 1.15{'' if exponent <= 1.15 else ', missed'})")


def pulses() -> None:
    """59 overlapping lognormal pulses at 1801 times: each over its own window, or all of them everywhere."""
    rng = np.random.default_rng(0)
    duration = np.full(59, 0.3)
    begun = lognormal.onsets(np.full(59, 0.5), duration)
    these = lognormal.pulses(duration, np.full(59, 0.1), rng.uniform(-1.5, 1.5, 59), begun)
    chords = rng.normal(size=59) + 1j * rng.normal(size=59)
    start, end = these.span
    t = np.linspace(start, end, 1801)
    windowed, ours = _timed(lambda: lognormal.path(these, chords, start, (end - start) / 1800, 1801), 20)
    dense, theirs = _timed(lambda: lognormal.position(these, chords, t), 10)
    extent = float(max(np.ptp(theirs.real), np.ptp(theirs.imag)))
    print(f"sigma-lognormal, 59 pulses, 1801 samples: {windowed * 1e3:.2f} ms (goal ≤ 1 ms)")
    print(f"  all pulses at all times {dense * 1e3:.1f} ms: {dense / windowed:.0f} times")
    print(f"  off it by {_off(ours, theirs, extent)} extents; end point off by {abs(ours[-1] - chords.sum()):.0e}")


def writing() -> None:
    """Some 1000 characters: 400 components of 3 to 37 points, 20 samples a point."""
    rng = np.random.default_rng(0)
    plans = [ActionPlan(rng.normal(size=(m, 2)).cumsum(axis=0), 0.1, 0.32) for m in rng.integers(3, 38, 400)]
    points = sum(len(plan.points) for plan in plans)
    for name, follow, goal in (
        ("optimal control", optimal_control.follow, 0.4),
        ("sigma-lognormal", sigma_lognormal.follow, 0.6),
    ):
        write = partial(_each, follow, plans)
        first, _ = _timed(write, 1)
        again, _ = _timed(write, 3)
        print(f"{name}, a page of 1000 characters ({points} points): {first:.2f} s at first, {again:.2f} s again")
        print(f"  (goal ≤ {goal} s{'' if first <= goal else ', missed'})")


def _each(follow: Callable[[ActionPlan], Any], plans: list[ActionPlan]) -> None:
    for plan in plans:
        follow(plan)


def _chain(count: int) -> tuple[Array, Array]:
    """Targets (count, 2) one step apart, with a covariance each."""
    rng = np.random.default_rng(count)
    shape = 0.1 * rng.normal(size=(count, 2, 2))
    return rng.normal(size=(count, 2)).cumsum(axis=0), shape @ np.swapaxes(shape, 1, 2) + 0.01 * np.eye(2)


def _timed(work: Callable[[], Any], rounds: int) -> tuple[float, Any]:
    """The least time of some rounds, s, and what the last one returned; processor time is counted too coarsely."""
    best, result = float("inf"), None
    for _ in range(rounds):
        before = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - before)
    return best, result


def _ratio(found: float, goal: float) -> str:
    return f"{found:.0f} times as long (goal ≥ {goal:.0f}{'' if found >= goal else ', missed'})"


def _off(path: NDArray[Any], reference: NDArray[Any], extent: float) -> str:
    return f"{float(np.abs(path - reference).max()) / extent:.0e}"


def _references() -> ModuleType:
    """The slow solutions that the tests compare with."""
    path = Path(__file__).resolve().parent.parent / "tests" / "motion" / "references.py"
    spec = importlib.util.spec_from_file_location("references", path)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
