"""Plotting from end to end: faults, interrupts, the machine's own limits, how much is on its way, progress."""

import dataclasses
import re
import signal
from concurrent.futures import Future

import msgspec
import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent, DoesNotFit, PortError
from handout.plotting import observation, open_port, plan, run
from handout.plotting.dialects import dialect
from handout.plotting.overlap import ink

PROFILE, ON_Z = profiles.find("simulated", "plotter"), profiles.find("grbl-z", "plotter")
DRAWING, SHORT = page(words=4), page(words=2)


def changed(profile, table, **values):
    return msgspec.structs.replace(profile, **{table: msgspec.structs.replace(getattr(profile, table), **values)})


@pytest.mark.slow
@pytest.mark.parametrize("profile", [PROFILE, ON_Z], ids=lambda p: p.name)
@pytest.mark.parametrize(
    ("fault", "error", "said", "lifted"),
    [
        ("jam", DeviceSilent, "has not answered for 5 s", False),
        ("lost-byte", (DeviceAlarm, DeviceSilent), "refused line|something was lost|came over wrong", True),
        ("lost-ok", DeviceGarbled, "something was lost", True),
        ("error", DeviceAlarm, "error:33", True),
        ("alarm", DeviceAlarm, "ALARM:1: a limit switch", True),
        ("reset", DeviceAlarm, "restarted by itself", True),
        ("unplugged", PortError, "connection .* is lost", False),
    ],
)
@pytest.mark.parametrize("after", [12, 150])
def test_every_fault_is_named_and_the_pen_is_lifted_if_the_machine_answers(profile, fault, error, said, lifted, after):
    port = open_port(f"sim:?fault={fault}&after={after}", profile)
    words = []
    with pytest.raises(error, match=said) as caught:
        run(plan(DRAWING, profile), port, profile, log=words.append)
    assert after < 100 or re.search(rf"It happened at stroke \d+ of {len(DRAWING.strokes)}\.$", str(caught.value))
    assert any("could not be lifted" in word for word in words) == (not lifted)
    if lifted:
        assert not port.pen_is_down
        assert port.at_rest


def test_an_interrupt_while_it_looks_for_its_zero_stops_it():
    class Impatient:
        def __init__(self, port):
            self.port, self.homing, self.written = port, False, []

        def write(self, data):
            self.written.append(data)
            self.homing |= data == b"$H\n"
            self.port.write(data)

        def read(self, timeout):
            if self.homing:
                self.homing = False
                raise KeyboardInterrupt
            return self.port.read(timeout)

    profile = msgspec.structs.replace(PROFILE, homing=True)
    port = Impatient(open_port("sim:", profile))
    with pytest.raises(KeyboardInterrupt):
        run(plan(page(words=1), profile), port, profile)
    assert port.written[port.written.index(b"$H\n") + 1] == b"!" and b"\x18" in port.written


def test_what_hangs_off_the_paper_is_said_before_it_is_drawn():
    words, small = [], dataclasses.replace(DRAWING, page=dataclasses.replace(DRAWING.page, width=60))
    run(plan(small, PROFILE), open_port("sim:", PROFILE), PROFILE, log=words.append)
    assert len(words) == 1 and "beyond the right edge of the paper (60 x" in words[0]


def test_late_answers_are_no_fault():
    port = open_port("sim:?fault=late&after=30&late=300ms", PROFILE)
    report = run(plan(page(words=1), PROFILE), port, PROFILE)
    assert report.executed_s > report.announced_s and port.lost_bytes == 0
    assert len(port.executed_drawing().strokes) == 1


@pytest.mark.slow
@pytest.mark.parametrize("profile", [PROFILE, ON_Z], ids=lambda p: p.name)
@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
def test_an_interrupt_stops_the_machine_and_lifts_the_pen(profile, share):
    def stop(done, left):
        if done >= share:
            raise KeyboardInterrupt

    port = open_port("sim:", profile)
    with pytest.raises(KeyboardInterrupt):
        run(plan(DRAWING, profile), port, profile, progress=stop)
    assert not port.pen_is_down and port.firmware.state == "Idle" and not port.firmware.locked
    assert port.paper.place[:2] == (0, 0)
    drawn = sum(stroke.length for stroke in port.executed_drawing().strokes)
    assert drawn < (share + 0.25) * DRAWING.pen_down
    again = run(plan(DRAWING, profile), port, profile)  # it knows where it is: the next sheet is in its place
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1 and again.lines > 100


class Impatient:
    """Somebody who presses Ctrl-C when the pen is down, and again and again: at every look and word from then on."""

    def __init__(self, port):
        self.port, self.pressed = port, 0

    def _press(self):
        if self.pressed or (self.port.pen_is_down and len(self.port.paper.trace) > 300):
            self.pressed += 1
            signal.raise_signal(signal.SIGINT)

    def write(self, data):
        self._press()
        self.port.write(data)

    def read(self, timeout):
        self._press()
        return self.port.read(timeout)

    def close(self):
        self.port.close()


@pytest.mark.parametrize("name", ["simulated", "grbl-z", "marlin-servo", "axidraw-v3", "hp-7475a", "klipper-servo"])
def test_lifting_the_pen_is_not_cut_short(name, monkeypatch):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored behind a shell's &
    profile = profiles.find(name, "plotter")
    port, words = Impatient(open_port("sim:", profile)), []
    try:
        with pytest.raises(KeyboardInterrupt):
            run(plan(DRAWING, profile), port, profile, log=words.append)
    finally:
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        signal.signal(signal.SIGINT, before)
    port.port.read(2.0)
    assert port.pressed > 5 and not port.port.pen_is_down
    assert not any("could not be lifted" in word for word in words)


def test_an_error_of_ours_lifts_the_pen_too():
    def fail(done, left):
        if done > 0.5:
            raise ZeroDivisionError

    port = open_port("sim:", PROFILE)
    with pytest.raises(ZeroDivisionError):
        run(plan(DRAWING, PROFILE), port, PROFILE, progress=fail)
    assert not port.pen_is_down and port.firmware.state == "Idle"


def test_the_machines_own_limits_win_and_are_named():
    words = []
    port = open_port("sim:?acceleration=600mm/s2&speed=50mm/s", PROFILE)
    made = plan(DRAWING, PROFILE)
    report = run(made, port, PROFILE, log=words.append)
    assert any("acceleration: the plotter's own 600 instead of the profile's 2000" in word for word in words)
    assert any("draw speed: the plotter's own 50" in word for word in words)
    assert any("planned anew" in word for word in words)
    assert report.announced_s > made.duration and report.plan.profile.limits.acceleration == 600
    assert report.executed_s == pytest.approx(report.announced_s, rel=0.05)
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1


def test_a_machine_that_agrees_says_nothing():
    words = []
    made = plan(DRAWING, PROFILE)
    assert run(made, open_port("sim:", PROFILE), PROFILE, log=words.append).plan is made
    assert words == []


def test_a_small_buffer_is_believed():
    port = open_port("sim:?buffer=40", PROFILE)
    report = run(plan(DRAWING, PROFILE), port, PROFILE)
    assert port.lost_bytes == 0 and len(port.executed_drawing().strokes) == len(DRAWING.strokes)
    assert report.executed_s == pytest.approx(report.announced_s, rel=0.05)


def test_a_slow_usb_adapter_is_no_hindrance():
    port = open_port("sim:?latency=8ms", PROFILE)
    report = run(plan(DRAWING, PROFILE), port, PROFILE)
    assert report.executed_s == pytest.approx(report.announced_s, rel=0.05) and port.lost_bytes == 0


@pytest.mark.parametrize(
    ("work", "said"), [(0.0, "leave x from 0 to 0 mm of a page"), (-60.0, "outside the bed 0–60 mm")]
)
def test_soft_limits_of_the_machine_count(work, said):
    """Machine space is negative: from −60 to 0, of which the work zero may leave nothing."""
    port = open_port("sim:?$22=1&$20=1&$130=60", PROFILE)
    port.firmware.modes.work[:2] = [work, -220.0]
    with pytest.raises(DoesNotFit, match=said):
        run(plan(DRAWING, PROFILE), port, PROFILE)
    assert not port.executed_drawing().strokes and port.paper.place[:2] == (0, 0)


def test_several_sheets_over_one_connection():
    port = open_port("sim:", PROFILE)
    for seed in (1, 2, 3):
        drawing = page(seed=seed, words=2)
        report = run(plan(drawing, PROFILE), port, PROFILE)
        assert observation.compare_strokes(drawing, port.executed_drawing()).deviation < 0.1
        assert report.executed_s == pytest.approx(report.announced_s, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("zero", ["kept", "here"])
@pytest.mark.parametrize("origin", ["bottom-left", "top-left", "centre"])
@pytest.mark.parametrize("y", ["up", "down"])
def test_every_origin_draws_the_page_the_right_way_round(zero, origin, y):
    profile = changed(PROFILE, "bed", zero=zero, origin=origin, y=y)
    port = open_port("sim:", profile)
    run(plan(SHORT, profile), port, profile)
    assert observation.compare_strokes(SHORT, port.executed_drawing()).deviation < 0.1


def test_homing_comes_first():
    profile = msgspec.structs.replace(PROFILE, homing=True)
    words = []
    port = open_port("sim:", profile)
    report = run(plan(SHORT, profile), port, profile, log=words.append)
    assert words == ["Homing: the plotter looks for its zero."]
    assert report.executed_s == pytest.approx(report.announced_s, rel=0.05)


def test_a_locked_machine_is_unlocked_with_a_word():
    port = open_port("sim:", PROFILE)
    port.firmware.locked = True
    words = []
    run(plan(SHORT, PROFILE), port, PROFILE, log=words.append)
    assert len(words) == 1 and "unlocked ($X)" in words[0]


@pytest.mark.parametrize("name", ["simulated", "marlin-servo", "axidraw-v3", "hp-7475a", "klipper-servo"])
def test_what_comes_byte_by_byte_takes_the_time_that_it_takes(name):
    class Trickling:
        def __init__(self, port):
            self.port, self.rest = port, b""

        @property
        def time(self):
            return self.port.time

        def write(self, data):
            self.port.write(data)

        def read(self, timeout):
            said = self.rest or self.port.read(timeout)
            self.rest = said[1:]
            return said[:1]

        def close(self):
            self.port.close()

    profile = profiles.find(name, "plotter")
    port, made, words, usual = open_port("sim:", profile), plan(SHORT, profile), [], []
    run(made, whole := open_port("sim:", profile), profile, log=usual.append)
    port.lay(SHORT.page, made.placement)
    run(made, Trickling(port), profile, log=words.append)
    assert observation.compare_strokes(SHORT, port.executed_drawing()).deviation < 0.1 and words == usual
    assert port.executed_s == pytest.approx(whole.executed_s, rel=0.05)


@pytest.mark.parametrize("name", ["simulated", "marlin-servo", "axidraw-v3", "hp-7475a", "klipper-servo"])
def test_who_never_stops_talking_is_listened_to_for_a_time(name):
    class Babbling:
        time = 0.0

        def write(self, data):
            pass

        def read(self, timeout):
            self.time += min(timeout, 0.1)
            assert self.time < 400.0, "it is listened to for ever"
            return b"echo: lorem ipsum 1,2,3\n"

        def close(self):
            pass

    profile, port = profiles.find(name, "plotter"), Babbling()
    with pytest.raises(DeviceSilent, match=r"Something answers, but not as|Moonraker"):
        run(plan(SHORT, profile), port, profile)
    assert port.time < 60.0


def test_nobody_there():
    class Nobody:
        def write(self, data):
            pass

        def read(self, timeout):
            return b""

        def close(self):
            pass

    with pytest.raises(DeviceSilent, match="does not answer within 5 s: is it switched on"):
        run(plan(DRAWING, PROFILE), Nobody(), PROFILE)


def test_something_else_there():
    class Printer:
        def write(self, data):
            pass

        def read(self, timeout):
            return b"echo:busy\n" if timeout else b""

        def close(self):
            pass

    class Chatty(Printer):
        left = 30

        def read(self, timeout):
            self.left -= 1
            return b"\xfe\xffstart\n" if self.left > 0 else b""

    with pytest.raises(DeviceSilent, match="not as a GRBL controller does"):
        run(plan(DRAWING, PROFILE), Chatty(), PROFILE)


class Watching:
    """Remembers all counts; what is secured is what was noted last."""

    def __init__(self):
        self.noted, self.secured = [(0, 0, 0, 0)], []

    def note(self, sent, taken, executed, done):
        self.noted.append((sent, taken, executed, done))

    def secure(self):
        self.secured.append((len(self.noted), self.noted[-1]))
        done = Future()
        done.set_result(None)
        return done


@pytest.mark.slow
@pytest.mark.parametrize("profile", [PROFILE, ON_Z], ids=lambda p: p.name)
@pytest.mark.parametrize("overlap", [3.0, 20.0])
def test_no_more_ink_is_on_its_way_than_may_be_drawn_twice(profile, overlap):
    made, watching = plan(DRAWING, profile), Watching()
    report = run(
        made, open_port("sim:", profile), profile, watch=watching.note, secure=watching.secure, overlap=overlap
    )
    noted, drawn = np.array(watching.noted), np.append(0.0, np.cumsum(ink(made)))
    assert (np.diff(noted, axis=0) >= 0).all() and tuple(noted[-1]) == (report.lines,) * 3 + (len(made.blocks),)
    assert (noted[:, 0] >= noted[:, 1]).all() and (noted[:, 1] >= noted[:, 2]).all()
    commands = list(dialect(profile.dialect).program(made.blocks, profile))
    blocks = np.append(0, [command.done for command in commands])
    certain = np.zeros(len(noted))
    for at, (_, _, executed, _) in watching.secured:
        certain[at:] = drawn[blocks[executed]]
    assert (drawn[blocks[noted[:, 0]]] - certain).max() <= overlap


def test_progress_runs_from_nothing_to_all():
    told = []
    made = plan(DRAWING, PROFILE)
    run(made, open_port("sim:", PROFILE), PROFILE, progress=lambda done, left: told.append((done, left)))
    shares = [done for done, _ in told]
    assert shares == sorted(shares) and shares[0] < 0.15 and shares[-1] == 1 and told[-1][1] == 0
    assert 20 < len(told) < 200
    for done, left in told:
        assert left == pytest.approx((1 - done) * made.duration, abs=1e-6)
