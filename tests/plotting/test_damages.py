"""Bytes that come over wrong, either way: they are noticed, and then all ink that may be lacking is drawn again."""

import functools
import math

import pytest

from benchmarks import damages, faults
from benchmarks.damages import KINDS
from benchmarks.faults import MACHINES, SHORTLY, Desk, Run, profile_of
from handout.errors import DeviceHeld
from handout.plotting.dialects.grbl.controller import PositionTracking
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.journal import PlotJournal
from handout.plotting.jobs.places import DrawnPlace
from handout.simulated.plotter.options import SimulatorOptions
from handout_lab.ink_comparison import compare

short = functools.cache(lambda: faults.drawing(faults.SHORT))
extent = functools.cache(lambda machine: faults.undisturbed(machine, short()))
RUNS = [(MACHINES[(4 * n) % len(MACHINES)], KINDS[n % len(KINDS)], n) for n in range(21)]


@pytest.mark.slow
@pytest.mark.parametrize(("machine", "kind", "seed"), RUNS, ids=[f"{m.title} {k} {n}" for m, k, n in RUNS])
def test_no_ink_is_missing_when_a_damaged_plot_is_finished(machine, kind, seed):
    run = damages.damaged(machine, kind, seed, short(), extent(machine))
    assert damages.outcome(run) in ("right", "noticed, right", "noticed, wrong ink"), run


@pytest.mark.parametrize(
    ("machine", "step"),
    [(SHORTLY[0], 29), (SHORTLY[1], 6), (SHORTLY[2], 2), (SHORTLY[3], 2)],
    ids=lambda v: str(v)[:30],
)
def test_whatever_byte_of_the_handshake_is_lost_it_ends(machine, step):
    said = {damages.met(machine, "lost-answer", at, 0) for at in range(0, damages.answers(machine), step)}
    assert "endless" not in said and "connected" in said
    assert all(sentence == "connected" or sentence.endswith(".") for sentence in said)


@pytest.mark.slow
@pytest.mark.parametrize("machine", [MACHINES[12], MACHINES[14]], ids=lambda machine: machine.title)
def test_a_plotter_that_starts_anew_at_any_byte_draws_nothing_astray(machine):
    for at in range(60, extent(machine).bytes, 71):
        desk = Desk(profile_of(machine), SimulatorOptions(fault="reset", at=at))
        run = Run(machine, "reset", at)
        faults.perform(run, desk, short())
        assert faults.verdict(run) == "right" and run.stops, run


class Passer:
    """Nobody who can be asked; but somebody comes by and lets the plotter go on."""

    def __init__(self, desk, seconds):
        self.desk, self.seconds = desk, seconds

    def do(self, request):
        pass

    def try_again(self, error):
        return False


class Button(Desk):
    """A desk on which somebody presses the button after so many seconds on hold."""

    seconds = math.inf

    def read(self, timeout):
        if self.firmware.stepper.holding and self.now > self.seconds:
            self.firmware.urgent(b"~")
        return super().read(timeout)


def held(tmp_path, machine, patience, seconds=math.inf, after=None):
    after = extent(machine).lines // 2 if after is None else after
    desk, said = Button(profile_of(machine), SimulatorOptions(fault="hold", after=after)), []
    desk.seconds = seconds
    job = store.create([short()], desk.profile, store.JobOptions(overlap=10.0), place=tmp_path)
    with faults.journals(desk):
        try:
            runner.run_job(
                job, lambda: desk, Passer(desk, seconds), runner.RunOptions(patience=patience), log=said.append
            )
        except DeviceHeld as error:
            return desk, job, said, str(error)
    return desk, job, said, ""


def test_a_hold_that_nobody_ends_is_the_end_and_the_pen_is_lifted(tmp_path):
    desk, job, said, error = held(tmp_path, MACHINES[3], 60.0)
    assert "on hold" in error and not desk.pen_is_down and not job.standing().finished
    assert sum("on hold" in line for line in said) == 1 and desk.now < 90
    desk.replug()
    with faults.journals(desk):
        runner.run_job(job, lambda: desk, Passer(desk, 0.0))
    ink = compare(short(), desk.executed_drawing().strokes)
    assert job.standing().finished and not ink.missing and not ink.stray and ink.doubled < 0.5


def test_a_hold_that_somebody_ends_is_waited_for(tmp_path):
    desk, job, said, error = held(tmp_path, MACHINES[3], math.inf, seconds=200.0)
    assert not error and job.standing().finished and desk.now > 200
    assert sum("on hold" in line for line in said) == 1


def test_a_journal_goes_back_to_what_is_proven_when_a_command_came_over_wrong(tmp_path):
    with PlotJournal(tmp_path / "journal") as kept:
        kept.begin(0)
        kept.note_drawn(DrawnPlace(2, 1.5))
        kept.note_drawn(DrawnPlace(3, 0.5), proven=False)
        assert kept.standing.place == DrawnPlace(3, 0.5) and kept.standing.proven == DrawnPlace(2, 1.5)
        kept.note_drawn(DrawnPlace(3, 0.25))  # what is proven grows behind what is drawn
        assert kept.standing.place == DrawnPlace(3, 0.5) and kept.standing.proven == DrawnPlace(3, 0.25)
        kept.doubt()
        assert kept.standing.place == DrawnPlace(3, 0.25) and kept.standing.doubtful


def test_a_shift_along_the_way_proves_nothing():
    track = PositionTracking((0.0, 0.0, 0.0))
    for number, line in enumerate((b"G91X1\n", b"X1\n", b"X1\n", b"Y1\n", b"Y1\n")):
        track.send(number, line)
    for x in (0.5, 1.5, 2.5):
        track.certain((x, 0.0, 0.0), None, 5, 9)
    assert track.proven == 0
    assert track.certain((3.0, 0.5, 0.0), None, 5, 9) == 3 and track.proven == 2
    assert track.certain((3.2, 0.8, 0.0), None, 5, 9) is None
