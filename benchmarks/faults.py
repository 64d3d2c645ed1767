"""Fault campaign: plots that break off anywhere, on all dialects, and what is on the paper in the end.

720 random runs (15 machines, 16 faults, overlap 10 mm).  Of the 603 in which no damaged byte can pass for a command,
none misses ink; 599 are right to 0.1 mm, four have ink that is up to 0.11 mm off (an instruction that an EBB or a GRBL
refuses; an EBB that hits a limit switch, whose simulator moved on then: since it does not, 48 runs are right to 0.02
mm); at most 9.4 mm are drawn twice, but 29 mm where an EBB refused an instruction.  Of 117 runs with damaged commands:
EBB 26 right, 10 spoilt and noticed; GRBL 42 right, 3 spoilt and noticed; HP-GL 25 right, 11 spoilt and noticed; none
unnoticed.  Power cut at every byte of a job of one letter: GRBL 893, Marlin 1529, EBB 3219, HP-GL 624 runs, all right.

136 random runs of GRBL over a network (FluidNC and grblHAL, TCP and WebSocket, 10 ms each way): of the 112 without
damaged bytes all are right to 0.04 mm, at most 9.9 mm drawn twice; of 24 with damaged commands 21 right, 3 spoilt and
noticed.

128 of the newest profiles (NextDraw, iDraw H SE, UUNA TEK, Bachin): of the 104 without damaged bytes all are right to
0.02 mm, at most 6.9 mm drawn twice (15.5 mm where an EBB refused an instruction); of 24 with damaged commands 22 right,
2 spoilt and noticed.

240 runs of Klipper behind Moonraker (12 faults, four of five machines without a socket): all right to 0.021 mm, at most
38.5 mm drawn twice, no more at a break than is drawn in four seconds.

224 runs with a dip every 25 mm and other hooks (seven machines): of the 192 without damaged bytes none misses ink and
no load is too long; 189 are right, one draws 18 mm again (an instruction that an EBB refused), two are 0.13 and 0.29 mm
off (one that a GRBL refused, a limit switch of an EBB); of 32 with damaged commands 27 right, 5 spoilt and noticed.

288 more at random (240 of the 15 machines, 48 of GRBL over a network; numbers from 9000): of the 245 whose commands are
whole none misses ink; 241 are right, in three an instruction that was refused makes 12 to 31 mm drawn twice, in one a
GRBL with a z axis that restarts leaves 0.1 mm of a mark; of 43 with damaged commands 34 right, 9 spoilt and noticed.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import multiprocessing
import os
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol
from unittest.mock import patch

import msgspec
import numpy as np

import handout
from handout import profiles, signals
from handout.errors import DeviceError
from handout.plotting import overlap, plan
from handout.plotting.dialects import dialect
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions as JobOptions
from handout.plotting.planning.hooking import without_pots
from handout.profiles import Hooks, Length, Plotter
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout.simulated.plotter.port import Clock
from handout.values import Drawing
from handout_lab.ink_comparison import SLACK, InkComparison, compare
from handout_lab.simulated import FaultyPlotter, NetworkedPlotter
from handout_lab.simulated.faults import ANSWER_FAULTS, BYTE_FAULTS, Faults

OVERLAP = 10.0  # mm
_TRIES = 12  # times that a person goes on with a job
_WAITS = 60.0  # s until the cable is back
_HELD = 120.0  # s that a plotter may stand on hold
_ENDLESS = 1800.0  # s of a plot of half a minute; whatever takes longer would never end


@dataclass(frozen=True)
class Machine:
    """A machine: its profile, what is different about it, and the dialect it is counted under."""

    profile: str
    changes: tuple[tuple[str, Any], ...] = field(default=(), hash=False)  # places of hooks have none
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def title(self) -> str:
        changes = [name if name == "hooks" else f"{name}={value}" for name, value in (*self.changes, *self.options)]
        return " ".join([self.profile, *changes])


MACHINES = (
    Machine("simulated"),
    Machine("simulated", (("homing", True),)),
    Machine("simulated", (("zero", "here"),)),
    Machine("grbl-z"),
    Machine("grbl-corexy"),
    Machine("marlin-servo"),
    Machine("creality-ender-3"),
    Machine("marlin-servo", (("homing", False),)),
    Machine("axidraw-v3"),
    Machine("axidraw-v3", options=(("firmware", "3.0.2"),)),
    Machine("axidraw-v3", options=(("firmware", "2.6.5"),)),
    Machine("axidraw-v3", options=(("firmware", "2.4.5"),)),
    Machine("hp-7475a"),
    Machine("hp-7550a"),
    Machine("roland-dxy-1300"),
)
NETWORK = tuple(
    Machine("simulated", options=(("network", network), ("variant", variant), ("latency", 0.01)))
    for network in ("tcp", "ws")
    for variant in ("fluidnc", "grblhal")
)  # a millisecond or two on a wire, ten over a busy radio
NEWEST = (
    Machine("nextdraw-8511", options=(("firmware", "3.0.3"),)),
    Machine("idraw-h-se-a3", options=(("firmware", "2.6.5"),)),
    Machine("uuna-tek-a3"),
    Machine("bachin-t-a4"),
)
KLIPPER = (
    Machine("klipper-servo"),
    Machine("klipper-stepper"),
    Machine("klipper-z"),
    Machine("klipper-servo", (("homing", False), ("zero", "here"))),
    Machine("klipper-servo", options=(("network", "ws"), ("latency", 0.01))),
)
EVERY = 25.0  # mm of ink between two dips
_DIP = ("go 110mm 30mm", "down", "go 114mm 30mm", "up")
HOOKS = Hooks(
    dip=_DIP,
    dip_every=Length(EVERY),
    before_page=("go 100mm 10mm",),
    after_page=("go 110mm 12mm", "down", "go 118mm 12mm"),
    after_stroke=("go 100mm 20mm",),
)
HOOKED = tuple(
    Machine(name, (("hooks", HOOKS),), options)
    for name, options in (
        ("simulated", ()),
        ("grbl-z", ()),
        ("marlin-servo", ()),
        ("creality-ender-3", ()),
        ("axidraw-v3", ()),
        ("axidraw-v3", (("firmware", "2.4.5"),)),
        ("hp-7475a", ()),
    )
)
FAULTS = (
    "lost-byte", "flipped-byte", "doubled-byte", "small-buffer", "late", "lost-ok", "resend-loop", "error",
    "alarm", "reset", "jam", "unplugged", "power-cut", "ctrl-c", "ctrl-c twice", "crash",
)  # fmt: skip
# further ones: what is damaged on the way back, a person at the machine and at the keyboard, another program
MORE_FAULTS = (
    "changed-byte", "lost-answer", "flipped-answer", "changed-answer", "hold", "stall", "ctrl-c storm", "other zero",
    "trickle",
)  # fmt: skip

NETWORK_FAULTS = (*FAULTS, "stall")
# no byte is damaged on the way to Moonraker, and what it answers is not lost: the network sees to that
KLIPPER_FAULTS = (
    "late", "error", "alarm", "reset", "lost-board", "jam", "unplugged", "power-cut", "ctrl-c", "ctrl-c twice", "crash",
    "stall",
)  # fmt: skip
DAMAGES = ("lost-byte", "flipped-byte", "doubled-byte", "changed-byte")
RUNS, NETWORK_RUNS, NEWEST_RUNS, HOOKED_RUNS, KLIPPER_RUNS = 720, 136, 128, 224, 240
SHORT = "i"
# another program counts from where the pen stands, and moves it
_OTHER_ZERO = {
    "grbl": (b"G92X0Y0\n", b"G1X30Y-20F3000\n"),
    "marlin": (b"G92 X0 Y0\n", b"G1 X3 Y-2 F3000\n"),
    "ebb": (b"CS\r", b"SM,2000,2400,1200\r"),
    "hpgl": (b"PU;PR400,400;PA;",),
    "klipper": (),
}
SHORTLY = (MACHINES[0], MACHINES[5], MACHINES[8], MACHINES[12])
_STEPS = 0.2  # mm by which a place may be known too early: steps, and points of what is compared


class Crash(BaseException):
    """The computer has no power any more."""


class Endless(BaseException):
    """The plot waits for something that will not happen."""


class Crashable(Protocol):
    """What stands beside a computer; crashed : that has died."""

    crashed: bool


class Desk(FaultyPlotter):
    """A simulated plotter on a desk, with somebody at the keyboard who interrupts.

    calls : reads and writes so far; interrupts : at which of them Ctrl-C is pressed; crash : at which the computer
        dies; crashed : it has, and its disk keeps nothing more.
    trickles : what it says comes byte by byte.
    """

    trickles = False
    _rest = b""

    def __init__(self, profile: Plotter, options: Simulated, clock: Clock | None = None) -> None:
        self.calls, self.interrupts, self.crash, self.crashed = 0, set[int](), -1, False
        self.until = _ENDLESS
        super().__init__(profile, options, clock)

    def write(self, data: bytes) -> None:
        self._count()
        super().write(data)

    def read(self, timeout: float) -> bytes:
        self._count()
        if not self.trickles:
            return super().read(timeout)
        said = self._rest or super().read(timeout)
        self._rest = said[1:]
        return said[:1]

    def replug(self, seconds: float = 60.0) -> None:
        """What it had said is lost."""
        self._rest = b""
        super().replug(seconds)

    def _count(self) -> None:
        self.calls += 1
        if self.now > self.until:
            raise Endless
        if 0 <= self.crash <= self.calls:
            self.crashed = True
            raise Crash
        if self.calls in self.interrupts:
            signals.interrupt(threading.get_ident())


class NetworkedDesk(Desk, NetworkedPlotter):
    """The same with a plotter on a network."""


def desk(machine: Machine, options: Simulated) -> Desk:
    """The machine, on its desk."""
    return (NetworkedDesk if options.network else Desk)(profile_of(machine), options)


class Somebody:
    """Does what is asked, and does not try again without looking."""

    def __init__(self, plotter: FaultyPlotter) -> None:
        self.plotter, self.asked = plotter, 0

    def do(self, request: str) -> None:
        self.asked += 1
        if "push it above" in request:
            self.plotter.stand_at_zero()

    def try_again(self, error: DeviceError) -> bool:
        return False

    def paused(self, pressed: Callable[[], bool]) -> None:
        """Goes on at once."""


@dataclass
class Run:
    """What became of one plot.

    stops : why it broke off, each time; noticed : whether anything was said about it.
    load : mm of ink at most between two dips.
    """

    machine: Machine
    fault: str
    seed: int
    where: str = ""
    stops: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    inked: InkComparison | None = None
    overlap: float = OVERLAP  # mm that may be drawn twice at a break
    load: float = 0.0
    finished: bool = False
    endless: bool = False


def profile_of(machine: Machine) -> Plotter:
    """The profile of a machine, with its changes."""
    profile = profiles.find(machine.profile, "plotter")
    assert isinstance(profile, Plotter)
    for name, value in machine.changes:
        if name == "zero":
            profile = msgspec.structs.replace(profile, bed=msgspec.structs.replace(profile.bed, zero=value))
        else:
            profile = msgspec.structs.replace(profile, **{name: value})
    return profile


def drawing(words: str = "it's me") -> Drawing:
    """A word or two of handwriting on a small page."""
    rng = np.random.default_rng(1)
    hand = handout.load("house-joined")
    layout = handout.Layout(handout.page("60x40mm"), margin=(16, 12, 8, 16), x_height=3.0)
    drawn: Drawing = handout.trace(handout.compose(words, hand, layout, rng)[0], hand, rng)
    return drawn


@contextlib.contextmanager
def journals(desks: Crashable | Sequence[Crashable]) -> Iterator[dict[Path, int]]:
    """Without waiting for the disk; how much of every journal was on it when it was waited for last.

    Files are told apart by their paths (Linux): the number of a file that is deleted soon is another's.
    """
    every = desks if isinstance(desks, Sequence) else [desks]
    safe: dict[Path, int] = {}

    def noted(handle: int) -> None:
        if not any(desk.crashed for desk in every):
            safe[Path(f"/proc/self/fd/{handle}").resolve()] = os.fstat(handle).st_size

    with patch.object(os, "fsync", noted):
        yield safe


@dataclass(frozen=True)
class Extent:
    """Of an undisturbed plot: instructions, bytes written and said, reads and writes, and how long it took, s."""

    lines: int
    bytes: int
    said: int
    calls: int
    seconds: float


def undisturbed(machine: Machine, whole: Drawing) -> Extent:
    """Plot without a fault."""
    run = Run(machine, "", 0)
    plotter = desk(machine, Simulated(**dict(machine.options)))
    perform(run, plotter, whole)
    faults = plotter.faults
    return Extent(faults.lines, faults.written, faults.said, plotter.calls, plotter.executed_s)


def disturbed(machine: Machine, fault: str, seed: int, whole: Drawing, extent: Extent) -> Run:
    """Plot with a fault at a random place."""
    rng = np.random.default_rng([seed, 7])
    run = Run(machine, fault, seed)
    options: dict[str, Any] = dict(machine.options)
    interrupts: set[int] = set()
    crash = -1
    if fault in ("ctrl-c", "ctrl-c twice", "ctrl-c storm", "other zero", "trickle"):
        first = int(rng.integers(0, extent.calls)) + 1
        interrupts = {first}
        if fault == "ctrl-c twice":
            interrupts.add(first + int(rng.integers(1, 12)))
        elif fault == "ctrl-c storm":
            interrupts = set(range(first, first + int(rng.integers(20, 200))))
        run.where = f"calls {sorted(interrupts)[:3]}"
    elif fault == "crash":
        crash = int(rng.integers(0, extent.calls))
        run.where = f"call {crash}"
    elif fault == "small-buffer":
        options["buffer"] = int(rng.integers(*((96, 160) if profile_of(machine).dialect == "hpgl" else (48, 128))))
        run.where = f"buffer {options['buffer']}"
    else:
        options["fault"] = fault
        if fault in ANSWER_FAULTS:
            options |= {"at": int(rng.integers(0, extent.said)), "bit": int(rng.integers(0, 8))}
            options["value"] = int(rng.integers(0, 256))
            run.where = f"byte {options['at']} of what it says, bit {options['bit']}, as {options['value']}"
        elif fault in BYTE_FAULTS and rng.random() < 0.8:
            options["at"], options["bit"] = int(rng.integers(0, extent.bytes)), int(rng.integers(0, 8))
            options["value"] = int(rng.integers(0, 256))
            run.where = f"byte {options['at']}, bit {options['bit']}"
        else:
            options["after"] = int(rng.integers(0, extent.lines))
            run.where = f"after {options['after']}"
    plotter = desk(machine, Simulated(**options))
    plotter.interrupts, plotter.crash, plotter.trickles = interrupts, crash, fault == "trickle"
    perform(run, plotter, whole)
    return run


def perform(run: Run, plotter: Desk, whole: Drawing) -> None:
    """Plot a job to its end, however often it breaks off."""
    with tempfile.TemporaryDirectory() as folder, journals(plotter) as safe:
        job = store.create([whole], plotter.profile, JobOptions(overlap=OVERLAP), place=Path(folder))
        person = Somebody(plotter)
        for _ in range(_TRIES):
            plotter.until = plotter.now + _ENDLESS
            try:
                runner.run_job(job, lambda: plotter, person, runner.RunOptions(patience=_HELD), log=run.said.append)
            except (DeviceError, KeyboardInterrupt) as error:
                run.stops.append(str(error) or type(error).__name__)
                mend(run, plotter)
            except Endless:
                run.endless = True
                break
            except Crash:
                run.stops.append("crash")
                plotter.crash, plotter.crashed = -1, False
                path = job.folder / "journal"
                os.truncate(path, safe.get(path.resolve(), 0))
                plotter.replug(_WAITS)
            if job.standing().finished:
                break
        run.finished = job.standing().finished
    drawn = plotter.executed_drawing()
    inked = without_pots(drawn, plotter.profile)
    run.inked, run.load = compare(whole, inked.strokes), load(drawn, inked)
    run.overlap = max(OVERLAP, drawn_in(whole, plotter.profile, dialect(plotter.profile.dialect).in_hand))


def drawn_in(whole: Drawing, profile: Plotter, seconds: float) -> float:
    """mm of ink at most that a plot draws in some seconds."""
    made = plan(whole, profile)
    ink = np.append(0.0, np.cumsum(overlap.ink(made)))
    clock = np.append(made.begins, made.duration)
    return float((ink - np.interp(clock - seconds, clock, ink)).max())


def load(drawn: Drawing, inked: Drawing) -> float:
    """mm of ink at most between two strokes that are none: in the pot."""
    ink, most, loads = {id(stroke) for stroke in inked.strokes}, 0.0, 0.0
    for stroke in drawn.strokes:
        loads = loads + stroke.length if id(stroke) in ink else 0.0
        most = max(most, loads)
    return most


def mend(run: Run, plotter: Desk) -> None:
    """What a person does before going on: puts back the plug, or switches the machine off and on."""
    fault = run.fault
    tries = run.seed % 2 == 0 and len(run.stops) == 1  # whether it goes without
    if fault == "ctrl-c storm":  # until the program has ended
        plotter.interrupts.clear()
    if fault == "other zero":
        plotter.replug(_WAITS)
        for line in _OTHER_ZERO[profile_of(run.machine).dialect]:
            plotter.write(line)
            plotter.read(5.0)
    if fault in ("power-cut", "jam", "hold") or (fault in ("alarm", "error", "resend-loop") and not tries):
        plotter.power_on()
    else:
        plotter.replug(_WAITS)
    if fault in ("resend-loop", "small-buffer"):  # another cable
        calm = msgspec.structs.replace(plotter.options, fault="", buffer=0)
        plotter.options = plotter.firmware.options = calm
        plotter.faults = Faults(calm)


def cut(machine: Machine, at: int, whole: Drawing) -> Run:
    """Plot, and cut the power of the plotter at one byte of all that is sent to it."""
    run = Run(machine, "power-cut", at, where=f"byte {at}")
    plotter = desk(machine, Simulated(**dict(machine.options), fault="power-cut", at=at))
    perform(run, plotter, whole)
    return run


def cases(
    count: int, machines: Sequence[Machine] = MACHINES, faults: Sequence[str] = FAULTS
) -> list[tuple[Machine, str, int]]:
    """Every fault with every machine, over and over."""
    all_of = [(machine, fault) for fault in faults for machine in machines]
    return [(*all_of[number % len(all_of)], number) for number in range(count)]


def spoils(run: Run) -> bool:
    """Whether the ink may be wrong: a damaged byte makes another command, and the dialect has no check sums."""
    language = profile_of(run.machine).dialect
    return (language != "marlin" and run.fault in DAMAGES) or (language, run.fault) == ("hpgl", "error")


def verdict(run: Run) -> str:
    """What has become of a plot, "right" or what is wrong."""
    ink = run.inked
    if not run.finished or ink is None:
        return "not finished"
    if ink.missing or ink.gap > SLACK or ink.dots:
        return "missing"
    if ink.deviation > SLACK or ink.stray:
        return "wrong ink"
    every = profile_of(run.machine).hooks.dip_every
    if every and run.load > every + _STEPS + 0.02 * every:  # steps of a motor are longer than a line
        return "dry"
    return "right" if ink.doubled <= run.overlap * len(run.stops) + _STEPS else "twice"


def main() -> None:
    """Print all tables."""
    from benchmarks import damages

    with multiprocessing.get_context("fork").Pool(2) as pool:
        damages.tell(pool)
        damages.tell_journals(pool)
        runs = pool.starmap(_one, cases(RUNS), chunksize=4)
        told(runs)
        print("GRBL over a network:")
        told(pool.starmap(_one, cases(NETWORK_RUNS, NETWORK, NETWORK_FAULTS), chunksize=4))
        print("Klipper behind Moonraker:")
        told(pool.starmap(_one, cases(KLIPPER_RUNS, KLIPPER, KLIPPER_FAULTS), chunksize=4))
        print("The newest profiles:")
        told(pool.starmap(_one, cases(NEWEST_RUNS, NEWEST), chunksize=4))
        print("With dips and other hooks:")
        told(pool.starmap(_one, cases(HOOKED_RUNS, HOOKED), chunksize=4))
        whole = drawing(SHORT)
        for machine in SHORTLY:
            places = range(undisturbed(machine, whole).bytes)
            tell(
                f"power cut at every byte: {machine.title}", pool.starmap(cut, ((machine, at, whole) for at in places))
            )


def _one(machine: Machine, fault: str, seed: int) -> Run:
    whole = drawing()
    return disturbed(machine, fault, seed, whole, extent_of(machine, whole))


@functools.cache
def extent_of(machine: Machine, whole: Drawing) -> Extent:
    return undisturbed(machine, whole)


def told(runs: Sequence[Run]) -> None:
    """Print a line for every dialect and fault; damaged bytes apart."""
    by_dialect = sorted(runs, key=lambda run: (spoils(run), profile_of(run.machine).dialect))
    for (spoilt, language), group in itertools.groupby(
        by_dialect, lambda run: (spoils(run), profile_of(run.machine).dialect)
    ):
        of_dialect = list(group)
        for fault in (*dict.fromkeys((*NETWORK_FAULTS, "lost-board", *MORE_FAULTS)),):
            if some := [run for run in of_dialect if run.fault == fault]:
                tell(f"{language:<7} {fault}", some, spoilt)


def tell(title: str, runs: Sequence[Run], spoilt: bool = False) -> None:
    """One line of a table: how many runs, how many broke off, and the worst of what is on the paper."""
    inks = [run.inked for run in runs if run.inked is not None]
    found = Counter(_spoilt(run) if spoilt else verdict(run) for run in runs)
    worst = max(ink.deviation for ink in inks), sum(ink.missing for ink in inks), max(ink.doubled for ink in inks)
    print(
        f"{title:<28} {len(runs):>4} runs, {sum(bool(run.stops) for run in runs):>4} broke off; off {worst[0]:.3f} mm, "
        f"missing {worst[1]:.1f} mm, twice at most {worst[2]:.1f} mm: "
        + ", ".join(f"{count} {what}" for what, count in sorted(found.items()))
    )


def _spoilt(run: Run) -> str:
    """Of a plot with wrong ink on it: whether it was noticed, and whether all that was meant is there as well."""
    found = verdict(run)
    if found in ("right", "twice"):
        return "right"
    if not (run.stops or any("counted other steps" in said for said in run.said)):
        return "spoilt, not noticed"
    return "spoilt, noticed" if found == "wrong ink" else f"spoilt, noticed, {found}"
