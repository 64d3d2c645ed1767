"""The conversation with a plotter: never more than there is room for, and never a word that is not certain."""

import msgspec
import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent, DoesNotFit, PortError
from handout.plotting import observation, open_port, plan, run
from handout.plotting.dialects.hpgl import protocol
from handout.plotting.dialects.hpgl.controller import HpglController, PenPosition
from handout.profiles import Length, Time

PROFILE = profiles.find("hp-7475a", "plotter")
DRAWING = page(words=4)
PLAN = plan(DRAWING, PROFILE)


def met(options="", profile=PROFILE):
    port, said = open_port("sim:?" + options, profile), []
    return HpglController(port, profile, said.append), port, said


@pytest.mark.parametrize("options", ["", "buffer=128", "buffer=64", "latency=16ms", "queue=8"])
def test_a_page_arrives_whole_whatever_the_buffer_and_the_wire(options):
    port = open_port("sim:?" + options, PROFILE)
    profile = PROFILE
    if "queue" in options:  # a plotter that takes in more vectors than others: its profile has to say so
        profile = msgspec.structs.replace(PROFILE, port=msgspec.structs.replace(PROFILE.port, queue=8))
    report = run(plan(DRAWING, profile), port, profile)
    found = observation.compare_strokes(DRAWING, port.executed_drawing())
    assert port.lost_bytes == 0 and port.at_rest and not port.pen_is_down and port.firmware.error == 0
    assert found.deviation < 0.06
    if options in ("", "queue=8"):
        assert report.executed_s == pytest.approx(report.announced_s, rel=0.01)


@pytest.mark.parametrize(
    ("origin", "rotation"), [("bottom-left", 90), ("bottom-left", 180), ("centre", 270), ("centre", 0)]
)
def test_wherever_zero_is_and_however_coordinates_are_turned(origin, rotation):
    profile = msgspec.structs.replace(
        PROFILE,
        bed=msgspec.structs.replace(PROFILE.bed, origin=origin),
        hpgl=msgspec.structs.replace(PROFILE.hpgl, rotation=rotation),
    )
    port, said = open_port("sim:", profile), []
    run(plan(DRAWING, profile), port, profile, log=said.append)
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.06
    assert not any("less than the profile" in line for line in said)


def test_other_speeds_and_orders_are_announced_as_well():
    for speed, order in (("fast", "writing"), (0.5, "travel")):
        made = plan(DRAWING, PROFILE, speed=speed, order=order)
        port = open_port("sim:", PROFILE)
        report = run(made, port, PROFILE)
        assert report.executed_s == pytest.approx(made.duration, rel=0.02)
        assert len(port.executed_drawing().strokes) == len(DRAWING.strokes)


def test_the_plan_admits_that_the_timing_is_lost():
    port = open_port("sim:", PROFILE)
    run(PLAN, port, PROFILE)
    found = observation.compare_strokes(DRAWING, port.executed_drawing())
    predicted = observation.compare_strokes(PLAN.intended_drawing(), PLAN.predicted_drawing()).correlation
    assert predicted < 0.8 and predicted == pytest.approx(found.correlation, abs=0.1)
    assert PLAN.stretched == pytest.approx(found.stretched, rel=0.02) and PLAN.stretched < 1.15


@pytest.mark.parametrize("options", ["", "latency=16ms", "buffer=200"])
def test_what_is_said_to_be_executed_is_on_the_paper(options):
    port = open_port("sim:?" + options, PROFILE)
    commands = list(protocol.program(PLAN.blocks, PROFILE))
    followed, ends = PenPosition(), []
    for command in commands:
        followed.send(command.data)
        ends.append(followed.at)
    late = []

    def watch(sent, taken, executed, done):
        assert executed <= taken <= sent
        if executed and ends[executed - 1] is not None:
            been = np.array([place[:2] for _, place in port.paper.trace[-400:]])
            late.append(not (been == np.array(ends[executed - 1])).all(axis=1).any())

    run(PLAN, port, PROFILE, watch=watch)
    assert len(late) > 100 and not any(late)


def test_what_is_not_drawn_yet_is_not_said_to_be():
    """The bound is no more than the instructions read, less those whose moves may be waiting in the plotter."""
    plotter, port, _ = met()
    for data in (b"IN;", b"VS1;", b"PD400,0;", b"PD800,0;", b"PD1200,0;", b"PD1600,0;", b"PU;"):
        plotter.send(data)
    for _ in range(200):
        plotter.wait()
        drawn = 2 + port.firmware.carriage.at[0] // 400 + (port.firmware.carriage.at[0] == 1600)
        assert plotter.executed <= drawn
        if drawn >= 5:
            break
    assert plotter.executed >= 2
    plotter.finish()
    assert plotter.executed == plotter.proven == 7 and port.firmware.carriage.at == (1600, 0)


def test_halt_drops_the_buffer_lifts_the_pen_and_knows_where():
    plotter, port, said = met()
    for data in (b"IN;", b"VS1;", *(b"PD%d,400;" % x for x in range(400, 8000, 400))):
        plotter.send(data)
    port.read(4.0)
    plotter.halt()
    x, y = plotter.position()
    assert not port.pen_is_down and said == []
    assert (x, y) == pytest.approx(tuple(np.array(port.paper.place[:2]) / PROFILE.limits.steps_per_mm))
    assert 0 < x < 100
    plotter.go(1.0, 2.0)
    assert plotter.position() == pytest.approx((1.0, 2.0), abs=0.02)


def test_a_position_is_known_again_after_a_lost_connection_but_not_after_a_lost_power():
    port = open_port("sim:?fault=unplugged&after=60", PROFILE)
    with pytest.raises(PortError):
        run(PLAN, port, PROFILE)
    port.replug()
    again = HpglController(port, PROFILE, lambda _: None)
    assert not again.conversation.restarted
    assert again.position() == pytest.approx(tuple(np.array(port.paper.place[:2]) / PROFILE.limits.steps_per_mm))
    port.power_on()
    assert HpglController(port, PROFILE, lambda _: None).position() is None


def test_meeting_a_plotter_moves_nothing():
    plotter, port, said = met()
    assert (plotter.model, plotter.size, said) == ("7475A", 1023, [])
    assert len({place for _, place in port.paper.trace}) == 1 and not port.pen_is_down
    assert plotter.position() is None  # it has been switched on since anybody asked


@pytest.mark.parametrize(
    ("fault", "error", "said"),
    [
        ("jam", DeviceSilent, "has not answered for 5 s"),
        ("lost-ok", DeviceSilent, "has not answered for 5 s"),
        ("reset", DeviceAlarm, "switched off and on"),
        ("power-cut", DeviceSilent, "has not answered"),
        ("unplugged", PortError, "connection"),
        ("error", DeviceAlarm, "HP-GL error 1, an instruction it does not know"),
        ("alarm", DeviceAlarm, "paper lever"),
    ],
)
def test_faults_are_said_in_words(fault, error, said):
    port, told = open_port(f"sim:?fault={fault}&after=40", PROFILE), []
    with pytest.raises(error, match=said):
        run(PLAN, port, PROFILE, log=told.append)
    lifted = not any("lift it by hand" in line for line in told)
    assert lifted == (fault in ("lost-ok", "reset", "error"))
    assert not (lifted and port.pen_is_down)


def test_bytes_that_were_lost_are_noticed():
    plotter, _, _ = met("buffer=300")
    plotter._room = 10_000  # as if it had said so
    with pytest.raises(DeviceGarbled, match=r"RS-232 error 16.*ran over"):
        for data in (b"VS1;", *(b"PD%d,400;" % x for x in range(400, 4000, 80))):
            plotter.send(data)
        plotter.finish()


def test_view_holds_the_plot_and_says_so():
    port, said = open_port("sim:?fault=view&after=60", PROFILE), []
    report = run(PLAN, port, PROFILE, log=said.append)
    assert report.executed_s > report.announced_s + 2
    assert sum("VIEW" in line for line in said) == 1
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.06


def test_no_paper_is_said_before_anything_moves():
    port = open_port("sim:", PROFILE)
    port.firmware.alarm()
    with pytest.raises(DeviceAlarm, match="paper lever"):
        run(PLAN, port, PROFILE)
    assert not port.executed_drawing().strokes


def test_a_smaller_sheet_than_the_profile_says_is_refused():
    small = msgspec.structs.replace(
        PROFILE, bed=msgspec.structs.replace(PROFILE.bed, width=Length(60.0), height=Length(60.0))
    )
    port, said = open_port("sim:", small), []
    with pytest.raises(DoesNotFit, match=r"outside the bed 0–\d+"):
        run(PLAN, port, PROFILE, log=said.append)
    assert said == ["The plotter reaches 60 × 60 mm, less than the profile says: is this its paper?"]


class Chatter:
    """A port behind which is something else."""

    def __init__(self, says):
        self.says = says

    def write(self, data):
        pass

    def read(self, timeout):
        return self.says

    def close(self):
        pass


@pytest.mark.parametrize(
    ("says", "told"), [(b"", "has not answered"), (b"ok\r\n", "not as an HP-GL"), (b"%", "not as")]
)
def test_what_is_no_plotter_is_called_so(says, told):
    hasty = msgspec.structs.replace(PROFILE, port=msgspec.structs.replace(PROFILE.port, timeout=Time(0.5)))
    with pytest.raises(DeviceSilent, match=told):
        HpglController(Chatter(says), hasty, lambda _: None)
