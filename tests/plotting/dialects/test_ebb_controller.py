"""The conversation with an EBB: flow, what is certainly executed, stops, positions, and what can go wrong."""

import msgspec
import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent, PortError
from handout.plotting import observation, open_port, plan, run
from handout.plotting.dialects.ebb import DIALECT as ebb
from handout.plotting.dialects.ebb import protocol
from handout.plotting.driver import Monitor, connect, draw

PROFILE = profiles.find("axidraw-v3", "plotter")
VERSIONS = ["2.2.7", "2.4.5", "2.6.5", "2.8.1", "3.0.0"]
DRAWING = page(words=3)


def machine(acceleration=5000):
    limits = msgspec.structs.replace(PROFILE.limits, acceleration=profiles.Acceleration(acceleration))
    return msgspec.structs.replace(PROFILE, limits=limits)


def opened(query=""):
    return open_port(f"sim:?{query}", PROFILE)


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_a_page_is_drawn_as_it_was_announced(version):
    profile = machine()
    made, port, said = plan(DRAWING, profile), open_port(f"sim:?firmware={version}", profile), []
    report = run(made, port, profile, log=said.append)
    found = observation.compare_strokes(DRAWING, port.executed_drawing())
    port.read(0.01)  # old boards are told to rest a moment to find out that all is done
    assert report.executed_s == pytest.approx(made.duration, rel=0.015)
    assert found.deviation < 0.07 and found.correlation > 0.999 and found.rms < 0.01
    assert said == [] and not port.pen_is_down and port.at_rest
    assert port.paper.place[:2] == (0, 0)  # not one step is lost over a page
    assert report.min_queue in (None, 2)


@pytest.mark.parametrize("version", VERSIONS)
def test_executed_is_never_more_than_was(version):
    port = opened(f"firmware={version}")
    controller = ebb.connect(port, PROFILE, lambda _: None)
    before = port.firmware.engine.finished
    queued = []
    for command in ebb.program(plan(DRAWING, PROFILE).blocks, controller.profile):
        controller.send(command.data)
        name = command.data[:2]
        queued.append(name in (b"SM", b"LM", b"LT", b"SP", b"HM"))
        claimed = sum(queued[: controller.executed])
        assert claimed <= port.firmware.engine.finished - before
        assert controller.executed <= controller.taken <= controller.sent
        assert controller.sent - controller.executed < 30
        if controller.sent == 200:
            while controller.executed < controller.sent:
                controller.wait()
        if controller.sent > 260:
            break
    controller.finish()
    port.read(0.01)  # old boards are told to rest a moment to find out
    assert controller.executed == controller.taken == controller.sent and port.at_rest


@pytest.mark.slow
@pytest.mark.parametrize("version", ["2.2.7", "2.6.5", "2.8.1", "3.0.0"])
@pytest.mark.parametrize("share", [0.02, 0.5])
def test_an_interrupt_stops_at_once_and_the_place_is_known(version, share):
    def stop(done, left):
        if done >= share:
            raise KeyboardInterrupt

    port, said = opened(f"firmware={version}"), []
    with pytest.raises(KeyboardInterrupt):  # `run` would go back to zero
        draw(
            plan(DRAWING, PROFILE),
            connect(port, PROFILE, said.append),
            port,
            PROFILE,
            Monitor(progress=stop, log=said.append),
        )
    assert not port.pen_is_down and port.at_rest and said == []
    stands = np.array(port.paper.place[:2]) / 160
    controller = ebb.connect(port, PROFILE, said.append)
    assert tuple(np.array(port.paper.place[:2]) / 160) == tuple(stands)  # it did not move by itself
    if version == "2.2.7":
        assert controller.position() is None
        with pytest.raises(DeviceAlarm, match="stand its pen above its zero"):
            controller.go(0, 0)
        return
    assert controller.position() == pytest.approx(tuple(stands), abs=1e-9)
    controller.go(10.0, 20.0)
    assert np.array(port.paper.place[:2]) / 160 == pytest.approx([10, 20], abs=0.01)
    assert controller.position() == pytest.approx((10, 20), abs=0.01)
    again = run(plan(DRAWING, PROFILE), port, PROFILE)  # a program goes to zero first
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1 and again.lines > 100


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "error", "said", "lifted"),
    [
        ("jam", DeviceSilent, "has not answered for", False),
        ("lost-byte", DeviceAlarm, "refused .*a number|refused .*comma", True),
        ("lost-ok", DeviceSilent, "an answer was lost", True),
        ("error", DeviceAlarm, "step rate", True),
        ("alarm", DeviceAlarm, "limit switch", True),
        ("reset", PortError, "connection .* is lost", False),
        ("unplugged", PortError, "connection .* is lost", False),
        ("power-cut", DeviceSilent, "has not answered for", False),
    ],
)
@pytest.mark.parametrize("version", ["2.8.1", "3.0.0"])
def test_every_fault_is_named_and_the_pen_is_lifted_if_the_board_answers(version, fault, error, said, lifted):
    port, words = opened(f"firmware={version}&fault={fault}&after=150"), []
    with pytest.raises(error, match=said):
        run(plan(DRAWING, PROFILE), port, PROFILE, log=words.append)
    assert any("could not be lifted" in word for word in words) == (not lifted)
    if lifted:
        assert not port.pen_is_down and port.at_rest


def test_late_answers_and_a_slow_hub_are_no_fault():
    for query in ("fault=late&after=30&late=100ms", "latency=4ms"):
        port = opened(query)
        run(plan(DRAWING, PROFILE), port, PROFILE)
        assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1


def test_motors_without_power_are_noticed_before_and_under_way():
    with pytest.raises(DeviceAlarm, match=r"no power \(4.8 V\): plug in its power supply"):
        run(plan(DRAWING, PROFILE), opened("motors=0"), PROFILE)
    port = opened()

    def unplug(done, left):
        port.firmware.powered = port.firmware.engine.powered = done < 0.1

    with pytest.raises(DeviceAlarm, match="no power"):
        run(plan(DRAWING, PROFILE), port, PROFILE, progress=unplug)


def test_after_a_power_cut_it_does_not_know_its_place_until_it_is_told():
    port = opened()
    run(plan(page(words=1), PROFILE), port, PROFILE)
    port.power_on()
    controller = ebb.connect(port, PROFILE, lambda _: None)
    assert controller.position() is None
    port.stand_at_zero()
    controller.zero()
    assert controller.position() == (0, 0)


def test_a_board_that_loses_steps_is_told_of():
    port, said = opened(), []

    def shift(done, left):
        port.firmware.engine.steps[0] += 1 if done < 0.2 else 0

    run(plan(DRAWING, PROFILE), port, PROFILE, progress=shift, log=said.append)
    assert any("counted other steps than it was told" in word for word in said)


def test_a_move_that_came_over_wrong_is_noticed_at_the_next_stroke():
    port = opened()

    def shift(done, left):
        port.firmware.engine.steps[1] += 20 if 0.2 < done < 0.3 else 0

    with pytest.raises(DeviceGarbled, match="came over wrong"):
        run(plan(DRAWING, PROFILE), port, PROFILE, progress=shift)
    assert not port.pen_is_down


class Mute:
    """A port that answers everything in its own way, or not at all."""

    def __init__(self, answer=b""):
        self.answer = answer

    def write(self, data):
        pass

    def read(self, timeout):
        return self.answer

    def close(self):
        pass


def test_who_is_no_ebb_is_told_so():
    patient = msgspec.structs.replace(PROFILE, port=msgspec.structs.replace(PROFILE.port, timeout=profiles.Time(1.0)))
    with pytest.raises(DeviceSilent, match="does not answer within 1 s: is this its port"):
        ebb.connect(Mute(), patient, print)
    with pytest.raises(DeviceSilent, match="not as an EBB does"):
        ebb.connect(Once(b"error:2\r\n"), patient, print)


class Once(Mute):
    """Says its word once."""

    def read(self, timeout):
        answer, self.answer = self.answer, b""
        return answer


def test_a_board_in_the_new_form_of_answers_is_understood():
    port = opened("firmware=3.0.0")
    port.write(b"CU,10,1\r")
    port.read(0.5)
    run(plan(DRAWING, PROFILE), port, PROFILE)
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1


def test_what_was_left_of_a_command_moves_nothing():
    port = opened()
    port.write(b"SM,1000,5")  # and here the cable was pulled
    ebb.connect(port, PROFILE, lambda _: None)
    port.read(2)
    assert port.paper.place[:2] == (0, 0)


@pytest.mark.parametrize("firmware", ["2.8.1", "3.0.3"])
def test_a_brushless_pen_lift_has_a_pin_and_pulses_of_its_own(firmware):
    """Told by another pin it would not move, and nothing would be drawn."""
    brushless = profiles.find("nextdraw-8511", "plotter")
    made, port = plan(DRAWING, brushless), open_port(f"sim:?firmware={firmware}", brushless)
    run(made, port, brushless)
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1
    assert protocol.pen(True, brushless.pen).endswith(b",2\r") and b"SC,8,1\r" in protocol.reach(brushless.pen)
    swing = next(data for data in protocol.reach(brushless.pen) if data.startswith(b"SC,11,"))
    pulses = (9720 - 8280) / int(swing[6:]) * 0.003
    assert pulses == pytest.approx(0.7 * brushless.pen.up_time, rel=0.05)
