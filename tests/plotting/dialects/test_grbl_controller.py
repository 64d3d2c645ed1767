"""A GRBL controller that is connected: its counts never lie, its place is watched, and it can be taken up again."""

import dataclasses
import math
import threading

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles, signals
from handout.errors import DeviceAlarm, DeviceError
from handout.plotting import observation, open_port, plan, run
from handout.plotting.dialects import MoveBlock, dialect
from handout.plotting.dialects.grbl.controller import GrblController

SERVO, ON_Z = profiles.find("simulated", "plotter"), profiles.find("grbl-z", "plotter")
DRAWING = page(words=4)
GRBL = dialect("grbl")


def silent(_):
    pass


def connected(port, profile=SERVO, log=silent):
    return GrblController(port, profile, log)


def streamed(made, port, controller, profile):
    """Send a plan; yields after every command."""
    port.lay(made.drawing.page, made.placement)
    for command in GRBL.program(made.blocks, profile):
        controller.send(command.data)
        yield command
    controller.finish()


def ends(made, port, profile):
    """When each block of a plan that is a move has come to its end, s, by where the carriage was; infinite: never."""
    at, found, row = [], [], 0
    scale = np.array([port.paper.steps[0], port.paper.steps[1]])
    trace = [(t, np.array(steps[:2]) / scale) for t, steps in port.paper.trace]
    for block in made.blocks:
        if isinstance(block, MoveBlock):
            there = np.array([block.x, block.y])
            while row < len(trace) and np.abs(trace[row][1] - there).max() > 0.51 / scale[0] + 1e-6:
                row += 1
        found.append(trace[row][0] if row < len(trace) else math.inf)
    return np.maximum.accumulate(found) if found else at


@pytest.mark.slow
@pytest.mark.parametrize("profile", [SERVO, ON_Z], ids=lambda p: p.name)
@pytest.mark.parametrize("options", ["", "$10=1", "$10=0&$13=1", "latency=8ms", "variant=grblhal&queue=60&buffer=512"])
def test_what_is_said_to_be_executed_is(profile, options):
    port = open_port(f"sim:?{options}", profile)
    made, told = plan(page(words=2), profile), []
    controller = connected(port, profile)
    done = [0]
    for command in streamed(made, port, controller, profile):
        done.append(command.done)
        told.append((port.now, done[controller.executed]))
    assert controller.executed == controller.taken == controller.sent
    end = ends(made, port, profile)
    assert np.isfinite(end).all()
    for now, blocks in told:
        assert blocks == 0 or end[blocks - 1] <= now + 1e-9
    assert sum(blocks > 0 for _, blocks in told) > len(told) / 2  # it says something
    assert controller.queued is not None
    lag = [number + 1 - controller_done for number, (_, controller_done) in enumerate(told)]
    assert np.median(lag) < (120 if "grblhal" in options else 60)


@pytest.mark.slow
def test_a_flipped_digit_is_noticed_by_where_the_machine_is():
    """Somewhere in the middle of a stroke X is given another tens digit, which is valid G-code."""
    made = plan(DRAWING, SERVO)
    noticed = 0
    for place in range(2500, 4000, 100):
        port = open_port(f"sim:?fault=flipped-byte&at={place}&bit=1", SERVO)
        try:
            run(made, port, SERVO)
        except DeviceError:
            noticed += 1
            assert not port.pen_is_down
        else:
            assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 2.0
    assert noticed >= 3


def test_a_pen_that_was_not_lowered_is_noticed():
    port = open_port("sim:", SERVO)
    controller = connected(port)
    with pytest.raises(DeviceAlarm, match="its pen is not as it should be"):
        for command in streamed(plan(DRAWING, SERVO), port, controller, SERVO):
            if command.data == b"M3S90\n" and controller.sent > 60:
                port.firmware._switch = lambda power: None
    assert controller.executed < controller.sent


class Eavesdropper:
    """A port that remembers what was written, and interrupts at a chosen write."""

    def __init__(self, port, at=-1, every=False):
        self.port, self.at, self.every, self.written = port, at, every, []

    def write(self, data):
        self.written.append(data)
        self.port.write(data)
        if len(self.written) - 1 == self.at:
            raise KeyboardInterrupt

    def read(self, timeout):
        if self.every and b"!" in self.written:
            signals.interrupt(threading.get_ident())
        return self.port.read(timeout)

    def close(self):
        self.port.close()


ONE = page(words=1)
_PORT = Eavesdropper(open_port("sim:", SERVO))
run(plan(ONE, SERVO), _PORT, SERVO)
WIRE = b"".join(_PORT.written)


@settings(deadline=None, max_examples=10)
@given(st.dictionaries(st.text(max_size=20), st.text(max_size=60)), st.text(max_size=20))
def test_nothing_of_the_users_text_is_ever_on_the_wire(about, name):
    port = Eavesdropper(open_port("sim:", SERVO))
    drawing = dataclasses.replace(ONE, about=about, page=dataclasses.replace(ONE.page, name=name))
    run(plan(drawing, SERVO), port, SERVO)
    assert b"".join(port.written) == WIRE
    assert WIRE.isascii() and max(map(len, WIRE.split(b"\n"))) <= 70


@pytest.mark.parametrize("profile", [SERVO, ON_Z], ids=lambda p: p.name)
@pytest.mark.parametrize("at", [40, 77, 200])
def test_the_first_byte_after_an_interrupt_is_the_hold(profile, at):
    port = Eavesdropper(open_port("sim:", profile), at)
    with pytest.raises(KeyboardInterrupt):
        run(plan(DRAWING, profile), port, profile)
    assert port.written[at + 1] == b"!"
    assert not port.port.pen_is_down and port.port.at_rest


def test_a_second_interrupt_resets_at_once():
    port = Eavesdropper(open_port("sim:", SERVO), 100, every=True)
    with pytest.raises(KeyboardInterrupt):
        run(plan(DRAWING, SERVO), port, SERVO)
    after = [data for data in port.written[port.written.index(b"!") :] if data != b"?"]
    assert after[:2] == [b"!", b"\x18"]
    assert not port.port.pen_is_down


@pytest.mark.parametrize("zero", ["kept", "here"])
@pytest.mark.parametrize("profile", [SERVO, ON_Z], ids=lambda p: p.name)
def test_after_a_halt_it_knows_where_it_is_to_a_step(profile, zero):
    port = open_port("sim:", profile)
    port.write(b"G0X7Y5\n")
    while port.read(1):
        pass
    controller = connected(port, profile)
    if zero == "here":
        controller.zero()
    made = plan(DRAWING, profile)
    for _ in streamed(made, port, controller, profile):
        if controller.sent == 150:
            proven = controller.proven
            controller.halt()
            break
    stood = controller.position()
    shift = np.array([7, 5]) if zero == "here" else np.zeros(2)
    assert stood == pytest.approx(np.array(port.paper.place[:2]) / 80 - shift, abs=2e-3)
    assert not port.pen_is_down and 0 < controller.executed < 150
    assert controller.proven == proven < controller.executed, "where it was braked proves nothing about what it drew"
    port.replug()
    again = connected(port, profile)
    assert again.position() == pytest.approx(stood, abs=2e-3)
    again.go(0, 0)
    assert again.position() == (0, 0) and port.paper.place[:2] == tuple(shift * 80)


def test_a_controller_that_has_restarted_does_not_know_its_place():
    port = open_port("sim:", SERVO)
    assert connected(port).position() is None
    controller = connected(port)
    controller.zero()
    assert controller.position() == (0, 0)
    for _ in streamed(plan(DRAWING, SERVO), port, controller, SERVO):
        pass
    port.replug()
    assert connected(port).position() == (0, 0)
    port.power_on()
    port.replug()  # its greeting is not heard
    assert connected(port).position() is None


def test_a_plotter_that_is_still_drawing_is_let_finish():
    port = open_port("sim:", SERVO)
    controller = connected(port)
    made, said = plan(DRAWING, SERVO, speed=0.1), []
    for _ in streamed(made, port, controller, SERVO):
        if controller.sent == 150:
            break
    port.write(b"X1")  # a line that somebody began
    port.close()
    port.replug(0.05)
    again = connected(port, log=said.append)
    assert port.at_rest and "still busy" in said[0]
    assert again.position() == pytest.approx(controller._tracking.at[:2], abs=0.02)  # all that was sent, and not X1


@pytest.mark.slow
@pytest.mark.parametrize("options", ["blank=1", "variant=grblhal", "variant=fluidnc", "$13=1", "blank=1&$22=1"])
def test_relatives_and_odd_memories_are_understood(options):
    said = []
    profile = msgspec.structs.replace(SERVO, homing="$22" in options)
    port = open_port(f"sim:?{options}", profile)
    run(plan(DRAWING, profile), port, profile, log=said.append)
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1 and port.lost_bytes == 0
    assert said == (["Homing: the plotter looks for its zero."] if profile.homing else [])


def test_a_machine_that_wants_homing_and_cannot_by_its_profile_is_told_of():
    said = []
    run(plan(page(words=1), SERVO), open_port("sim:?$22=1", SERVO), SERVO, log=said.append)
    assert len(said) == 1 and "wants to be homed" in said[0] and "homing = false" in said[0]


def test_a_line_that_writes_into_memory_is_sent_alone():
    port = open_port("sim:", SERVO)
    controller = connected(port)
    for line in (b"G21\n", b"$11=0.020\n", b"G90\n", b"G10 L20 P1 X0 Y0\n", *[b"G1X1F600\n"] * 8):
        controller.send(line)
    controller.finish()
    assert port.lost_bytes == 0 and controller.executed == 12
    port.write(b"G10L20P1X0Y0\n" + b"G1X10.125Y10.125F600\n" * 5)
    while port.read(1):
        pass
    assert port.lost_bytes > 0  # so it is when it is not


def test_soft_limits_strike_it_deaf_and_it_is_brought_back():
    port = open_port("sim:?$22=1&$20=1&$130=300&$131=220", SERVO)
    port.firmware.modes.work[:2] = [-300.0, -220.0]
    profile = msgspec.structs.replace(SERVO, homing=True)
    controller = connected(port, profile)
    controller.home()
    with pytest.raises(DeviceAlarm, match=r"ALARM:2: a move would have left its travel"):
        for line in (b"G1X290Y210F6000\n", b"X301\n"):
            controller.send(line)
        controller.finish()
    controller.halt()
    assert port.firmware.state == "Idle"


def test_what_is_strange_ends_in_a_sentence():
    for answer, said in ((b"error:7\r\n", "memory of settings"), (b"ALARM:12\r\n", "push the carriage off it")):
        port = open_port("sim:", SERVO)
        controller = connected(port)
        controller.send(b"G21\n")
        port._out.append((port.now, answer))
        with pytest.raises(DeviceAlarm, match=said):
            controller.finish()
