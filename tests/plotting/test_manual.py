"""A plotter moved by hand: pen, zero, a little way, motors, in every dialect."""

import msgspec
import pytest

from handout import profiles
from handout.errors import DeviceAlarm, DoesNotFit, InputError
from handout.plotting import pen_heights
from handout.plotting.driver import connect, park
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout_lab.simulated import FaultyPlotter

MACHINES = ["simulated", "grbl-z", "axidraw-v3", "marlin-servo", "prusa-mk3", "hp-7475a", "midtbot"]


@pytest.fixture
def machine(request):
    profile = profiles.find(request.param, "plotter")
    return FaultyPlotter(profile, Simulated())


def again(plotter):
    """Another program connects; the machine stays as it is."""
    return connect(plotter, plotter.profile, lambda _: None)


def at(plotter):
    """mm, where its carriage really stands."""
    return tuple(steps / per for steps, per in zip(plotter.paper.place[:2], plotter.paper.steps[:2], strict=True))


@pytest.mark.parametrize("machine", MACHINES, indirect=True)
def test_the_pen_goes_down_and_up(machine):
    pen_heights.move_and_locate(again(machine), lambda controller: controller.pen(True))
    assert machine.pen_is_down
    pen_heights.move_and_locate(again(machine), lambda controller: controller.pen(False))
    assert not machine.pen_is_down and at(machine) == (0, 0)


@pytest.mark.parametrize("machine", MACHINES, indirect=True)
def test_the_carriage_goes_a_way_and_home_with_the_pen_lifted(machine):
    pen_heights.move_and_locate(again(machine), lambda controller: controller.pen(True))
    controller = again(machine)
    before = at(machine)
    place = pen_heights.move_and_locate(controller, lambda machine: pen_heights.jog(machine, 12.0, 7.5))
    assert not machine.pen_is_down and all(stroke.length == 0 for stroke in machine.executed_drawing().strokes)
    if machine.profile.dialect not in ("ebb",):  # whose motors are mixed
        assert [a - b for a, b in zip(at(machine), before, strict=True)] == pytest.approx([12.0, 7.5], abs=0.05)
    if place is not None:
        assert place == pytest.approx((12.0, 7.5), abs=0.05)
    if machine.profile.homing or controller.position() is not None:
        assert pen_heights.move_and_locate(controller, pen_heights.home) == pytest.approx((0.0, 0.0), abs=0.02)
        assert at(machine) == pytest.approx((0.0, 0.0), abs=0.05)
    else:
        with pytest.raises(DeviceAlarm, match="push its pen above its zero by hand"):
            pen_heights.home(controller)


@pytest.mark.parametrize("machine", MACHINES, indirect=True)
def test_motors_off_means_that_the_place_is_forgotten(machine):
    controller = again(machine)
    pen_heights.jog(controller, 10.0, 10.0)
    if machine.profile.dialect == "hpgl":
        with pytest.raises(InputError, match="no command that switches its motors off"):
            controller.release()
        return
    controller.release()
    later = again(machine).position()
    assert later is None or max(map(abs, later)) < 0.02  # which is not believed either
    pen_heights.move_and_locate(again(machine), lambda controller: controller.pen(True))  # it wakes up
    assert machine.pen_is_down


@pytest.mark.parametrize("machine", ["simulated", "marlin-servo", "hp-7475a"], indirect=True)
def test_a_way_out_of_the_bed_is_refused(machine):
    controller = again(machine)
    with pytest.raises(DoesNotFit, match="more than the bed"):
        pen_heights.jog(controller, 1000.0, 0.0)
    pen_heights.jog(controller, 20.0, 20.0)
    if controller.position() is not None:
        with pytest.raises(DoesNotFit, match="outside the bed"):
            pen_heights.jog(controller, -30.0, 0.0)
    assert at(machine)[0] > 19


def test_a_machine_that_stays_where_it_is_keeps_its_zero():
    """Going somewhere must not call that place zero, even where zero is where the pen stands at the beginning."""
    profile = profiles.find("marlin-servo", "plotter")
    here = msgspec.structs.replace(profile, bed=msgspec.structs.replace(profile.bed, zero="here"))
    plotter = FaultyPlotter(here, Simulated())
    controller = again(plotter)
    controller.zero()
    controller.go(30.0, 20.0)
    park(controller)
    assert at(plotter) == pytest.approx((0.0, 0.0), abs=0.02)


class Nobody:
    def do(self, request):
        raise AssertionError(request)

    def try_again(self, error):
        return False


@pytest.mark.parametrize("name", ["simulated", "axidraw-v3", "marlin-servo", "hp-7475a"])
@pytest.mark.parametrize("home_after", [True, False])
def test_home_after_an_interrupt(tmp_path, monkeypatch, name, home_after):
    from cursive import page

    monkeypatch.setattr("os.fsync", lambda handle: None)
    plotter = FaultyPlotter(profiles.find(name, "plotter"), Simulated())
    job = store.create([page(words=2)], plotter.profile, JobOptions(overlap=6.0), place=tmp_path)

    def stop(share, left):
        if share > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runner.run_job(job, lambda: plotter, Nobody(), runner.RunOptions(home_after=home_after), progress=stop)
    assert not plotter.pen_is_down and not job.standing().finished
    assert (max(map(abs, at(plotter))) < 0.05) == home_after


def test_other_heights_of_the_pen():
    servo, z, own = (profiles.find(name, "plotter") for name in ("axidraw-v3", "grbl-z", "hp-7475a"))
    pen = pen_heights.replace_heights(servo, 14000.0, None).pen
    assert (pen.up, pen.down) == (14000.0, servo.pen.down)
    follows = msgspec.structs.replace(z, pen=msgspec.structs.replace(z.pen, pressed=z.pen.down - 0.5))
    pen = pen_heights.replace_heights(follows, None, z.pen.down - 0.2).pen
    assert pen.pressed == pytest.approx(z.pen.down - 0.7)
    for profile, up, down, says in (
        (servo, 50.0, None, "outside 5400"),
        (servo, 14000.0, 14000.0, "would not be lifted"),
        (z, z.pen.down, z.pen.up, "would not be lifted"),
        (z, 1e6, None, "outside"),
        (z, float("nan"), None, "outside"),
        (own, 1.0, None, "no heights to set"),
    ):
        with pytest.raises(InputError, match=says):
            pen_heights.replace_heights(profile, up, down)


def test_a_plotter_that_was_stopped_within_relative_vectors_goes_where_it_is_told():
    plotter = FaultyPlotter(profiles.find("hp-7475a", "plotter"), Simulated())
    controller = again(plotter)
    controller.go(30.0, 20.0)
    plotter.write(b"PR40,40;")
    controller.go(10.0, 5.0)
    assert at(plotter) == pytest.approx((10.0, 5.0), abs=0.03)
