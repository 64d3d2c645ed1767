"""The conversation with a Marlin: whatever is lost, damaged, doubled or late, every line is executed once, in order."""

import math

import msgspec
import pytest

from handout import profiles
from handout.errors import DeviceAlarm, DeviceSilent, PortError
from handout.plotting.dialects import MoveBlock, Pause, PenBlock
from handout.plotting.dialects.marlin import DIALECT as marlin
from handout.simulated.plotter.options import SimulatorOptions
from handout_lab.simulated import FaultyPlotter

replace = msgspec.structs.replace
SLOW = profiles.find("marlin-servo", "plotter")
QUICK = replace(  # so that a short job is over soon
    SLOW,
    segment_rate=50,
    limits=replace(SLOW.limits, acceleration=50000, draw_speed=1000, travel_speed=1000),
    pen=replace(SLOW.pen, up_time=0.01, down_time=0.01),
    port=replace(SLOW.port, start_up=0.3, timeout=3.0, line_time=0.001),
)
ROUND = [MoveBlock(round(6 - 4 * math.cos(k / 2), 1), round(5 + 4 * math.sin(k / 2), 1), 60000) for k in range(1, 8)]
JOB = [
    PenBlock(False),
    MoveBlock(2, 5, 60000),
    PenBlock(True),
    *ROUND,
    PenBlock(False),
    MoveBlock(12, 9, 60000),
    PenBlock(True),
    Pause(0.02),
]
JOB += [PenBlock(False), MoveBlock(0, 0, 60000)]
SHORT = [
    PenBlock(False),
    MoveBlock(2, 5, 60000),
    PenBlock(True),
    MoveBlock(4, 5, 60000),
    Pause(0.02),
    PenBlock(False),
]  # every kind of line


class Watched:
    """A simulated plotter that notes every move that is queued and everything its pen is told, in order."""

    def __init__(self, options=None, profile=QUICK, **switches):
        self.port = FaultyPlotter(profile, options or SimulatorOptions())
        self.profile, self.did, self.said = profile, [], []
        firmware = self.port.firmware
        for name, value in switches.items():
            setattr(firmware.reception if name == "echoes" else firmware, name, value)
        add, pen = firmware.planner.add, self.port.paper.pen

        def noted(target, feed):
            queued = add(target, feed)
            if queued:
                self.did.append((firmware.planner.position, self.port.paper.pen_is_down))
            return queued

        def told(now, value):
            self.did.append(value)
            pen(now, value)

        firmware.planner.add, self.port.paper.pen = noted, told

    def connect(self):
        return marlin.connect(self.port, self.profile, self.said.append)

    def run(self, blocks=JOB):
        controller = self.connect()
        for command in marlin.program(blocks, controller.profile):
            controller.send(command.data)
        controller.finish()
        return controller


def intended(blocks=JOB, least=34):
    watched = Watched()
    controller = watched.run(blocks)
    lines = len(list(marlin.program(blocks, QUICK)))
    assert controller.sent == controller.taken == controller.executed == lines >= least
    assert watched.said == []
    return watched.did, watched.port.faults.written


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["lost-byte", "flipped-byte", "doubled-byte"])
def test_a_fault_at_every_byte_changes_nothing_on_the_paper(fault):
    """From the first greeting to the last line: moves and pen are exactly those of a run without a fault."""
    meant, size = intended(SHORT, 15)
    for at in range(size):
        watched = Watched(SimulatorOptions(fault=fault, at=at, bit=at % 8))
        controller = watched.run(SHORT)
        assert watched.did == meant, f"byte {at}"
        assert controller.executed == controller.sent


@pytest.mark.slow
@pytest.mark.parametrize("echoes", [False, True])
@pytest.mark.parametrize("advanced", [False, True])
@pytest.mark.parametrize("latency", [0.001, 0.02])
def test_all_kinds_of_marlin_survive_a_noisy_cable(echoes, advanced, latency):
    meant, size = intended()
    for at in range(7, size, 60):
        watched = Watched(
            SimulatorOptions(fault="flipped-byte", at=at, bit=at % 7, latency=0.001), echoes=echoes, advanced=advanced
        )
        watched.run()
        assert watched.did == meant, f"byte {at}"
    watched = Watched(SimulatorOptions(latency=latency), echoes=echoes, advanced=advanced)
    controller = watched.run()
    assert watched.did == meant and controller.conversation.window == (1 if latency < 0.01 else 4)
    assert controller.conversation.echoes == echoes


def test_an_ok_that_is_lost_is_not_missed():
    meant, _ = intended()
    for after in range(0, 20, 4):
        watched = Watched(SimulatorOptions(fault="lost-ok", after=after))
        assert watched.run().executed == watched.connect().sent + len(list(marlin.program(JOB, QUICK)))
        assert watched.did == meant


def test_a_late_ok_is_waited_for():
    meant, _ = intended()
    watched = Watched(SimulatorOptions(fault="late", after=4, late=1.5))
    watched.run()
    assert watched.did == meant


def test_a_long_move_is_waited_for_and_its_signs_of_life_are_heard():
    watched = Watched()
    controller = watched.run([MoveBlock(100, 0, 120)])  # 50 s
    assert controller.executed == controller.sent and watched.port.now > 50 and controller.conversation.again == 0


def test_a_loop_of_requests_ends_with_one_sentence():
    watched = Watched(SimulatorOptions(fault="resend-loop", after=5))
    with pytest.raises(DeviceSilent, match=r"in a row for the same line: .* cable"):
        watched.run()
    assert any("sent again" in said for said in watched.said)


@pytest.mark.parametrize(
    ("fault", "error", "said"),
    [
        ("reset", DeviceAlarm, "restarted by itself"),
        ("alarm", DeviceAlarm, r"limit switch \(endstops hit"),
        ("error", DeviceAlarm, "heater protection"),
        ("jam", DeviceSilent, "not answered for"),
        ("power-cut", DeviceSilent, "not answered for"),
        ("unplugged", PortError, "connection"),
    ],
)
def test_trouble_is_told_in_words(fault, error, said):
    with pytest.raises(error, match=said):
        Watched(SimulatorOptions(fault=fault, after=6)).run()


@pytest.mark.parametrize("fault", ["reset", "jam", "unplugged", "alarm"])
@pytest.mark.parametrize("advanced", [False, True])
def test_no_command_is_called_executed_before_it_was(fault, advanced):
    """The moves of all commands that are said to be executed have been made when the machine breaks off."""
    slow = replace(QUICK, limits=replace(QUICK.limits, acceleration=500, draw_speed=20))
    program = list(marlin.program([PenBlock(False), MoveBlock(2, 5, 6000), PenBlock(True), *ROUND], slow))
    for after in range(2, 14):
        watched = Watched(SimulatorOptions(fault=fault, after=after), slow, advanced=advanced)
        controller = watched.connect()
        with pytest.raises((DeviceAlarm, DeviceSilent, PortError)):
            for command in program:
                controller.send(command.data)
            controller.finish()
        certain = program[controller.executed - 1].done if controller.executed else 0
        moves = [
            block
            for block in [PenBlock(False), MoveBlock(2, 5, 6000), PenBlock(True), *ROUND][:certain]
            if isinstance(block, MoveBlock)
        ]
        reached = {position[:2] for _, position in watched.port.paper.trace}
        assert all((round(move.x * 80), round(move.y * 80)) in reached for move in moves)
        assert controller.executed <= controller.taken <= controller.sent


def test_an_overlap_that_is_smaller_than_the_queue_does_not_wait_for_ever():
    for advanced in (False, True):
        watched = Watched(advanced=advanced)
        controller = watched.connect()
        for command in marlin.program(JOB, QUICK):
            while controller.sent - controller.executed > 3:
                controller.wait()
            controller.send(command.data)
        controller.finish()
        assert controller.queued == (0 if advanced else None)


def test_halting_finishes_what_is_in_hand_and_lifts_the_pen():
    slow = replace(QUICK, limits=replace(QUICK.limits, draw_speed=10))
    watched = Watched(profile=slow)
    controller = watched.connect()
    for command in list(marlin.program([PenBlock(True), MoveBlock(40, 0, 600), MoveBlock(40, 10, 600)], slow))[:-1]:
        controller.send(command.data)
    controller.halt()
    assert not watched.port.pen_is_down and watched.port.at_rest
    assert controller.executed == controller.sent and controller.position() == (40.0, 10.0)
    assert any("finishes what it has in hand, about 4 s" in said for said in watched.said)


@pytest.mark.parametrize("emergency", [False, True])
def test_a_second_interrupt_stops_it_dead(emergency):
    slow = replace(QUICK, limits=replace(QUICK.limits, draw_speed=10))
    watched = Watched(profile=slow, emergency=emergency)
    controller = watched.connect()
    for command in list(marlin.program([PenBlock(True), MoveBlock(100, 0, 600)], slow))[:-1]:
        controller.send(command.data)
    watched.port.read(1.0)
    before, read = controller.executed, watched.port.read

    def interrupted(timeout):
        watched.port.read = read
        raise KeyboardInterrupt

    watched.port.read = interrupted
    controller.halt()
    assert watched.port.paper.place[0] < 20 * 80 and not watched.port.pen_is_down
    assert controller.executed == before and controller.position() is None
    assert any("stopped dead" in said for said in watched.said)


def test_the_machines_own_limits_win():
    watched = Watched(SimulatorOptions(acceleration=700, speed=80))
    controller = watched.connect()
    limits = controller.profile.limits
    assert (limits.acceleration, limits.draw_speed, limits.travel_speed) == (700, 80, 80)
    assert any("acceleration: the plotter's own 700" in said for said in watched.said)
    jerky = replace(QUICK, limits=replace(QUICK.limits, jerk=10.0))
    assert Watched(profile=jerky).connect().profile.limits.jerk == 10
    watched = Watched(SimulatorOptions(queue=7), advanced=True)
    assert watched.connect().profile.port.queue == 7


def test_a_command_that_it_does_not_know_stops_the_plot():
    pen = replace(QUICK.pen, lift="command", up_command=("M3900",), down_command=("M3901",))
    with pytest.raises(DeviceAlarm, match="does not know 'M3900"):
        Watched(profile=replace(QUICK, pen=pen)).run()


def test_homing_lifts_the_pen_first():
    on_z = profiles.find("creality-ender-3", "plotter")
    watched = Watched(profile=on_z)
    controller = watched.connect()
    controller.go(20, 20)
    controller.home()
    assert controller.position() == (0.0, 0.0) and watched.port.paper.place[:2] == (0, 0)
    assert watched.port.paper.place[2] == 4 * 250  # 2 mm above the lifted pen


class Mute:
    """A port behind which nobody, or somebody else, is."""

    def __init__(self, answer=b""):
        self.answer = answer

    def write(self, data):
        pass

    def read(self, timeout):
        return self.answer

    def close(self):
        pass


def test_nobody_and_somebody_else():
    short = replace(QUICK, port=replace(QUICK.port, start_up=0.5, timeout=0.5))
    with pytest.raises(DeviceSilent, match="is it switched on"):
        marlin.connect(Mute(), short, print)


def test_a_grbl_is_not_taken_for_a_marlin():
    grbl = profiles.find("simulated", "plotter")
    port = FaultyPlotter(grbl)
    with pytest.raises(DeviceSilent, match="not as a Marlin controller"):
        marlin.connect(port, replace(QUICK, port=replace(QUICK.port, timeout=1.0)), print)
