"""A plot that breaks off anywhere and is gone on with: all ink is on the paper, and hardly any twice."""

import msgspec
import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import DeviceError, InputError
from handout.plotting.bed import place as placed
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.places import START, DrawnPlace, Milestones, find_place, take_drawn
from handout.plotting.jobs.store import JobOptions
from handout.plotting.planning.planner import plan
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout_lab.ink_comparison import compare
from handout_lab.simulated import FaultyPlotter

PROFILE, ON_Z = profiles.find("simulated", "plotter"), profiles.find("grbl-z", "plotter")
HOMING = msgspec.structs.replace(PROFILE, homing=True)
HERE = msgspec.structs.replace(PROFILE, bed=msgspec.structs.replace(PROFILE.bed, zero="here"))
DRAWING, LONGER = page(words=3), page(words=8)
OVERLAP = 6.0


class Somebody:
    """A person who does what is asked, and does not try again."""

    def __init__(self, plotter=None):
        self.plotter, self.asked = plotter, []

    def do(self, request):
        self.asked.append(request)
        if self.plotter is not None and "push it above" in request:
            self.plotter.stand_at_zero()

    def try_again(self, error):
        return False


@pytest.fixture(autouse=True)
def no_waiting_for_the_disk(monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)


def made(tmp_path, profile=PROFILE, drawings=(DRAWING,), **options):
    return store.create(drawings, profile, JobOptions(overlap=OVERLAP, **options), place=tmp_path)


def again(plotter, person=None, log=None):
    """An `open_port` for a plotter that is plugged in again after a while."""

    def opened():
        plotter.replug()
        return plotter

    return opened


def judged(plotter, times, exact=False, drawing=DRAWING, off=0.1):
    told = compare(drawing, plotter.executed_drawing().strokes)
    assert told.missing == 0 and told.gap <= 0.1 and told.dots == 0, told
    assert told.deviation < off and told.stray == 0, told
    assert told.doubled <= (0.5 if exact else OVERLAP) * times, told


class Stop:
    """A progress that interrupts as Ctrl-C does."""

    def __init__(self, share):
        self.share = share

    def __call__(self, done, left):
        if done >= self.share:
            self.share = np.inf
            raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize("profile", [PROFILE, ON_Z, HOMING, HERE], ids=["servo", "z", "homing", "here"])
@pytest.mark.parametrize("share", [0.05, 0.3, 0.6])
def test_ctrl_c_loses_nothing_and_draws_nothing_twice(tmp_path, profile, share):
    job, plotter, person, words = made(tmp_path, profile), FaultyPlotter(profile), Somebody(), []
    with pytest.raises(KeyboardInterrupt):
        runner.run_job(job, lambda: plotter, person, progress=Stop(share))
    assert not plotter.pen_is_down and job.standing().stopped == "it was interrupted"
    runner.run_job(job, again(plotter), person, log=words.append)
    judged(plotter, 1, exact=True)
    assert person.asked == []
    assert any("kept its place" in word for word in words) == (profile is not HOMING)
    assert job.standing().finished


@pytest.mark.slow
@pytest.mark.parametrize("profile", [PROFILE, ON_Z, HERE], ids=["servo", "z", "here"])
@pytest.mark.parametrize("after", [9, 60, 130, 200])
def test_the_cable_is_pulled_and_the_machine_goes_on_with_what_it_has(tmp_path, profile, after):
    plotter = FaultyPlotter(profile, Simulated(fault="unplugged", after=after))
    job, person, words = made(tmp_path, profile), Somebody(), []
    with pytest.raises(DeviceError):
        runner.run_job(job, lambda: plotter, person)
    runner.run_job(job, again(plotter), person, log=words.append)
    judged(plotter, 1, exact=True)


# every fault at each way to a zero: early in a job at two of them, late at the others
@pytest.mark.slow
@pytest.mark.parametrize("fault", ["reset", "power-cut", "alarm", "jam", "error", "lost-byte"])
@pytest.mark.parametrize(
    ("profile", "after"), [(PROFILE, 40), (ON_Z, 170), (HOMING, 40), (HERE, 170)], ids=["servo", "z", "homing", "here"]
)
def test_a_machine_that_forgot_its_place_is_asked_about(tmp_path, fault, profile, after):
    plotter = FaultyPlotter(profile, Simulated(fault=fault, after=after))
    job, person = made(tmp_path, profile), Somebody(plotter)
    with pytest.raises(DeviceError):
        runner.run_job(job, lambda: plotter, person)

    def switched_on():
        plotter.power_on()
        return plotter

    runner.run_job(job, switched_on, person)
    judged(plotter, 1, off=0.3 if fault == "lost-byte" else 0.1)  # a line may have come over wrong before it is noticed
    assert len(person.asked) == (0 if profile is HOMING else 1)


@pytest.mark.parametrize("fault", ["unplugged", "power-cut", "lost-byte"])
def test_a_plotter_of_vectors_finds_its_zero_by_itself(tmp_path, fault):
    profile = profiles.find("hp-7475a", "plotter")
    plotter, person = FaultyPlotter(profile, Simulated(fault=fault, after=60)), Somebody()
    job = made(tmp_path, profile)
    with pytest.raises((DeviceError, KeyboardInterrupt)):
        runner.run_job(job, lambda: plotter, person, progress=Stop(0.9))

    def opened():
        plotter.power_on() if fault == "power-cut" else plotter.replug()
        return plotter

    runner.run_job(job, opened, person)
    judged(plotter, 1)
    assert person.asked == []


# moves of another program, which has counted from a zero of its own before
ELSEWHERE = {
    "simulated": (b"G92X0Y0\n", b"G1X70Y-40F3000\n"),
    "grbl-z": (b"G92X0Y0\n", b"G1X70Y-40F3000\n"),
    "marlin-servo": (b"G92 X0 Y0\n", b"G1 X-37 Y-190 F3000\n"),
    "axidraw-v3": (b"CS\r", b"SM,4000,8000,4000\r"),
}


@pytest.mark.parametrize("name", ELSEWHERE)
def test_a_place_where_the_plot_has_not_led_is_not_believed(tmp_path, name):
    profile = msgspec.structs.replace(profiles.find(name, "plotter"), homing=False)
    plotter, words = FaultyPlotter(profile), []
    job, person = made(tmp_path, profile), Somebody(plotter)
    with pytest.raises(KeyboardInterrupt):
        runner.run_job(job, lambda: plotter, person, progress=Stop(0.4))
    plotter.replug()
    for line in ELSEWHERE[name]:
        plotter.write(line)
        plotter.read(5.0)
    runner.run_job(job, again(plotter), person, log=words.append)
    judged(plotter, 1)
    assert len(person.asked) == 1 and any("where this plot has not led it" in word for word in words)


@pytest.mark.parametrize("name", ["simulated", "marlin-servo"])
def test_homing_forgets_what_another_program_counts_from(tmp_path, name):
    profile = msgspec.structs.replace(profiles.find(name, "plotter"), homing=True)
    plotter = FaultyPlotter(profile)
    job, person = made(tmp_path, profile), Somebody(plotter)
    with pytest.raises(KeyboardInterrupt):
        runner.run_job(job, lambda: plotter, person, progress=Stop(0.4))
    plotter.replug()
    for line in ELSEWHERE[name]:
        plotter.write(line)
        plotter.read(5.0)
    runner.run_job(job, again(plotter), person)
    judged(plotter, 1)
    assert person.asked == []


@pytest.mark.parametrize("profile", [PROFILE, profiles.find("axidraw-v3", "plotter")], ids=lambda p: p.name)
def test_on_its_way_back_to_zero_a_plotter_is_believed(tmp_path, profile):
    plotter, person, words = FaultyPlotter(profile), Somebody(), []
    job = made(tmp_path, profile)
    with pytest.raises(KeyboardInterrupt):
        runner.run_job(job, lambda: plotter, person, progress=Stop(0.4))
    read, there = plotter.read, np.array(plotter.paper.place[:2], dtype=float)

    def interrupted(timeout):
        if 0.2 < np.hypot(*plotter.paper.place[:2]) / np.hypot(*there) < 0.8:
            plotter.read = read
            raise KeyboardInterrupt
        return read(timeout)

    plotter.read = interrupted
    with pytest.raises(KeyboardInterrupt):
        runner.run_job(job, again(plotter), person)
    assert plotter.read == read and plotter.at_rest, "it has been stopped"
    runner.run_job(job, again(plotter), person, log=words.append)
    judged(plotter, 1, exact=True)
    assert person.asked == [] and any("kept its place" in word for word in words)


@pytest.mark.slow
def test_again_and_again(tmp_path):
    plotter, person = FaultyPlotter(PROFILE), Somebody()
    job = made(tmp_path, drawings=(LONGER,))
    for share in (0.1, 0.12, 0.3, 0.5, 0.51, 0.9, 0.97):
        with pytest.raises(KeyboardInterrupt):
            runner.run_job(job, again(plotter), person, progress=Stop(share))
    runner.run_job(job, again(plotter), person)
    judged(plotter, 7, exact=True, drawing=LONGER)
    assert len(job.standing().runs) == 8


def test_a_person_puts_it_right_and_the_same_program_goes_on(tmp_path):
    plotter = FaultyPlotter(PROFILE, Simulated(fault="unplugged", after=100))

    class Patient(Somebody):
        def try_again(self, error):
            self.asked.append(str(error))
            return True

    person = Patient()
    runner.run_job(made(tmp_path), again(plotter), person)
    judged(plotter, 1, exact=True)
    assert len(person.asked) == 1 and "connection" in person.asked[0]


def test_nobody_is_there_to_push_the_pen_to_its_zero(tmp_path):
    plotter = FaultyPlotter(PROFILE, Simulated(fault="power-cut", after=100))
    job = made(tmp_path)
    with pytest.raises(DeviceError):
        runner.run_job(job, lambda: plotter, Somebody())
    plotter.power_on()

    class Nobody(Somebody):
        def do(self, request):
            raise InputError(request)

    before = len(plotter.paper.trace)
    with pytest.raises(InputError, match="push it above the plotter's zero, the lower left corner"):
        runner.run_job(job, lambda: plotter, Nobody())
    assert len(plotter.paper.trace) == before, "nothing may move"
    plotter.stand_at_zero()
    runner.run_job(job, again(plotter), Nobody(), runner.RunOptions(at_zero=True))
    judged(plotter, 1)


def test_a_stop_is_found_on_the_way():
    stroke = DRAWING.strokes[0]
    for at in range(3, len(stroke.t) - 1, 17):
        place = find_place(DRAWING, START, stroke.xy[at] + [0.0, 0.01], 1e3)
        assert place is not None and place.stroke == 0 and place.time <= stroke.t[at] + 0.02
        certain = DrawnPlace(0, stroke.t[max(at - 9, 0)])
        place = find_place(DRAWING, certain, stroke.xy[at], 20.0)
        assert abs(place.time - stroke.t[at]) < 0.02
    assert find_place(DRAWING, START, np.array([0.0, 0.0]), 1e3) is None
    between = (stroke.xy[-1] + DRAWING.strokes[1].xy[0]) / 2
    assert find_place(DRAWING, DrawnPlace(0, stroke.t[-2]), between, 20.0) == DrawnPlace(1)


def test_a_machine_that_did_all_it_had_is_found_at_its_last_command_wherever_lines_cross():
    made = plan(LONGER, PROFILE)
    reached, to_page = Milestones(made), placed(LONGER.page, PROFILE).to_page
    twice = []
    for done, (block, row) in enumerate(made.toolpath.instructions, 1):
        if block is not None or not made.toolpath.draws[row] or done % 3:
            continue
        at = to_page(np.round(made.toolpath.points[row + 1][None, :2], 2))[0]  # as coarsely as machines say it
        sure = reached.place(int(np.searchsorted(reached.ink, reached.ink[done] - 6.0)))
        found, right = find_place(LONGER, sure, at, 8.0), reached.place(done)
        twice.append(take_drawn(LONGER, right).pen_down - take_drawn(LONGER, found).pen_down)
    assert len(twice) > 400 and min(twice) > -0.1
    assert np.mean(np.array(twice) > 1.0) <= 0.003  # where the first line that passes by counts, twice as many
