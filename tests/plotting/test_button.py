"""The button of an EBB: it stops the plot, the pen is lifted, and the same button goes on; no ink is lost."""

import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import DeviceAlarm
from handout.plotting.dialects import ButtonPressed
from handout.plotting.dialects.ebb import DIALECT as ebb
from handout.plotting.driver import connect
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout_lab.ink_comparison import compare
from handout_lab.simulated import FaultyPlotter

AXIDRAW = profiles.find("axidraw-v3", "plotter")
DRAWING = page(words=2)


class Watching:
    """A person who presses the button on the machine alone, and notes what they see."""

    def __init__(self, plotter):
        self.plotter, self.seen = plotter, []

    def do(self, request):
        raise AssertionError(request)

    def try_again(self, error):
        return False

    def paused(self, pressed):
        at = tuple(self.plotter.paper.place[:2])
        self.seen.append((self.plotter.pen_is_down, self.plotter.now))
        while not pressed():
            assert not self.plotter.pen_is_down and tuple(self.plotter.paper.place[:2]) == at
        self.seen.append((self.plotter.pen_is_down, self.plotter.now))


@pytest.fixture(autouse=True)
def no_waiting_for_the_disk(monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "after"), [("2.4.5", 0), ("2.4.5", 90), ("2.8.1", 0), ("2.8.1", 40), ("3.0.0", 12), ("3.0.0", 10**6)]
)
def test_it_holds_and_goes_on(tmp_path, version, after):
    plotter = FaultyPlotter(AXIDRAW, Simulated(fault="button", after=after, firmware=version))
    job, person = store.create([DRAWING], AXIDRAW, JobOptions(overlap=6.0), place=tmp_path), Watching(plotter)
    runner.run_job(job, lambda: plotter, person)
    assert job.standing().finished and not plotter.pen_is_down
    if after == 10**6:
        assert person.seen == []
    else:
        (held, begun), (still, ended) = person.seen
        assert not held and not still and 15 < ended - begun < 25
    told = compare(DRAWING, plotter.executed_drawing().strokes)
    assert told.missing == 0 and told.dots == 0 and told.stray == 0 and told.deviation < 0.1 and told.gap <= 0.1
    assert told.doubled <= 1.0


def test_only_who_heeds_it_is_stopped():
    plotter = FaultyPlotter(AXIDRAW, Simulated())
    controller = connect(plotter, AXIDRAW, lambda _: None)
    plotter.firmware.press()
    controller.heed_button()  # what was pressed before does not count
    commands = [b"SM,10,5,5\r"] * 60
    for data in commands[:20]:
        controller.send(data)
    plotter.firmware.press()
    with pytest.raises(ButtonPressed):
        for data in commands:
            controller.send(data)
    assert not controller.was_button_pressed()
    careless = ebb.connect(FaultyPlotter(AXIDRAW, Simulated(fault="button", after=5)), AXIDRAW, lambda _: None)
    for data in commands:
        careless.send(data)
    careless.finish()
    assert careless.executed == len(commands) and np.allclose(careless.position(), careless.position())


def test_nobody_comes_to_press_it_again(tmp_path):
    plotter = FaultyPlotter(AXIDRAW, Simulated(fault="button", after=40))
    job, person = store.create([DRAWING], AXIDRAW, JobOptions(overlap=6.0), place=tmp_path), Watching(plotter)
    with pytest.raises(DeviceAlarm, match=r"nobody has pressed again for 5 s: the pen is lifted"):
        runner.run_job(job, lambda: plotter, person, runner.RunOptions(patience=5.0))
    assert not plotter.pen_is_down and not job.standing().finished
