"""Plots that break off anywhere, on every dialect: all ink is on the paper, hardly any twice."""

import functools

import pytest

from benchmarks import faults
from benchmarks.faults import FAULTS, MACHINES, SHORTLY, cut, disturbed, drawing, spoils, undisturbed, verdict

extent = functools.cache(lambda machine: undisturbed(machine, short()))


@functools.cache
def short():
    return drawing(faults.SHORT)


# a prime number of machines and one of faults meet differently every time
RUNS = [(MACHINES[(7 * n) % len(MACHINES)], fault, 3000 + n) for n, fault in enumerate(FAULTS * 3)]


@pytest.mark.slow
@pytest.mark.parametrize(("machine", "fault", "seed"), RUNS, ids=[f"{m.title} {f} {n}" for m, f, n in RUNS])
def test_whatever_goes_wrong_everything_is_drawn_once(machine, fault, seed):
    run = disturbed(machine, fault, seed, short(), extent(machine))
    assert run.finished, run
    if spoils(run):  # wrong ink cannot be prevented there; all that was meant must be there too if it was noticed
        assert verdict(run) != "missing" or not run.stops, run
    else:
        assert verdict(run) == "right", run


@pytest.mark.slow
@pytest.mark.parametrize("machine", SHORTLY, ids=lambda machine: machine.title)
@pytest.mark.parametrize("part", [0, 1, 2])
def test_the_power_is_cut_at_any_byte(machine, part):
    places = range(20 + part, extent(machine).bytes, extent(machine).bytes // 5)
    for at in places:
        run = cut(machine, at, short())
        assert verdict(run) == "right" and run.stops, run


def test_the_judge_can_say_no():
    run = disturbed(MACHINES[0], "power-cut", 5, short(), extent(MACHINES[0]))
    assert verdict(run) == "right"
    missing = faults.compare(drawing("is"), ())
    assert verdict(faults.Run(MACHINES[0], "", 0, inked=missing, finished=True)) == "missing"
