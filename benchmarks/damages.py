"""Damage campaign: bytes that come over wrong, either way, on plotters of all dialects; what is noticed, and mended.

Every run damages one random byte of a plot, of all that is written or of all that is answered, handshake included: it
is lost, doubled, has a bit turned over or is any other byte.  Whoever is told of it goes on with ``--resume``.

630 runs (seeds 1000 to 1005): none unnoticed, none endless, no ink missing; wrong ink besides, noticed, in 51 (EBB 17,
GRBL 12, HP-GL 22).
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from multiprocessing.pool import Pool

import numpy as np

from benchmarks import faults
from benchmarks.faults import MACHINES, Desk, Endless, Extent, Machine, Run, profile_of
from handout.errors import HandoutError
from handout.plotting.driving.driver import connect
from handout.simulated.plotter.options import Options as Simulated
from handout.values import Drawing
from handout_lab.ink_comparison import SLACK

KINDS = (
    "lost-byte", "flipped-byte", "doubled-byte", "changed-byte", "lost-answer", "flipped-answer", "changed-answer",
)  # fmt: skip
SEEDS = range(1000, 1006)  # none of them was looked at while the program was made
HELD = 300.0  # s that a handshake may take
LOST = (("lost-answer", 0), ("changed-answer", ord("?")))
OUTCOMES = ("right", "noticed, right", "noticed, wrong ink", "noticed, ink missing", "not noticed, wrong ink",
            "not noticed, ink missing", "not finished", "endless")  # fmt: skip


def damaged(machine: Machine, kind: str, seed: int, whole: Drawing, extent: Extent) -> Run:
    """Plot with one byte damaged."""
    rng = np.random.default_rng([seed, 11, MACHINES.index(machine), KINDS.index(kind)])
    at = int(rng.integers(0, extent.said if kind.endswith("answer") else extent.bytes))
    bit, value = int(rng.integers(0, 8)), int(rng.integers(0, 256))
    run = Run(machine, kind, seed, where=f"byte {at}, bit {bit}, value {value}")
    options = Simulated(**dict(machine.options), fault=kind, at=at, bit=bit, value=value)
    faults.perform(run, Desk(profile_of(machine), options), whole)
    return run


def outcome(run: Run) -> str:
    """What became of a plot, one of `OUTCOMES`."""
    ink = run.inked
    if run.endless:
        return "endless"
    if not run.finished or ink is None:
        return "not finished"
    noticed = bool(run.stops) or any("counted other steps" in said for said in run.said)
    told = "noticed, " if noticed else "not noticed, "
    if ink.missing or ink.gap > SLACK or ink.dots:
        return told + "ink missing"
    if ink.deviation > SLACK or ink.stray:
        return told + "wrong ink"
    return "noticed, right" if noticed else "right"


def cases(seeds: Iterable[int]) -> list[tuple[Machine, str, int]]:
    """Every kind of damage with every machine, for every seed."""
    return [(machine, kind, seed) for seed in seeds for machine in MACHINES for kind in KINDS]


def one(machine: Machine, kind: str, seed: int) -> Run:
    """One run of the campaign."""
    whole = faults.drawing()
    return damaged(machine, kind, seed, whole, faults.extent_of(machine, whole))


def answers(machine: Machine) -> int:
    """Bytes that a machine says while it is met."""
    desk = Desk(profile_of(machine), Simulated(**dict(machine.options)))
    connect(desk, desk.profile, lambda _: None)
    return desk.faults.said


def met(machine: Machine, kind: str, at: int, value: int) -> str:
    """Meet a machine of whose answers one byte is damaged: "connected", what was said, or "endless"."""
    options = Simulated(**dict(machine.options), fault=kind, at=at, value=value)
    desk = Desk(profile_of(machine), options)
    desk.until = HELD
    try:
        connect(desk, desk.profile, lambda _: None)
    except HandoutError as error:  # settings that came over wrong can be such that no page fits
        return str(error)
    except Endless:
        return "endless"
    return "connected"


def tell(pool: Pool) -> None:
    """Print the tables of damage, and of handshakes in which one byte of the answers is lost or another."""
    told(pool.starmap(one, cases(SEEDS), chunksize=4))
    for machine in MACHINES:
        ways = [(machine, kind, at, value) for at in range(answers(machine)) for kind, value in LOST]
        found = Counter(
            said if said in ("connected", "endless") else "one sentence" for said in pool.starmap(met, ways)
        )
        print(f"answers of the handshake: {machine.title:<38} " + _counted(found))


def told(runs: Sequence[Run]) -> None:
    """A line for every dialect and way; the worst ink of those that were noticed, and of the others."""

    def group(run: Run) -> tuple[str, bool]:
        return profile_of(run.machine).dialect, run.fault.endswith("answer")

    for (dialect, answered), some in itertools.groupby(sorted(runs, key=group), group):
        of = list(some)
        worst = [run.inked for run in of if run.inked is not None]
        missing, doubled, stray = (max(getattr(ink, name) for ink in worst) for name in ("missing", "doubled", "stray"))
        print(
            f"{dialect:<6} {'answers' if answered else 'commands':<8} {len(of):>4} runs: "
            + _counted(Counter(map(outcome, of)))
            + f"; missing at most {missing:.1f} mm, twice {doubled:.1f} mm, astray {stray:.1f} mm"
        )


def _counted(found: Counter[str]) -> str:
    return ", ".join(f"{count} {what}" for what, count in found.most_common())
