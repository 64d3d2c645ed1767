"""The simulated plotter, spoken to byte by byte as any program might."""

import msgspec
import numpy as np
import pytest

from handout import profiles
from handout.plotting import open_port
from handout.simulated.plotter.hpgl_carriage import Carriage
from handout.simulated.plotter.hpgl_firmware import Escapes

PROFILE = profiles.find("hpgl", "plotter")


def plotter(options="", **changes):
    hpgl = msgspec.structs.replace(PROFILE.hpgl, **changes)
    return open_port("sim:?" + options, msgspec.structs.replace(PROFILE, hpgl=hpgl))


def ask(port, data, wait=30.0):
    port.write(data)
    heard = b""
    while fresh := port.read(wait):
        heard += fresh
        wait = 0.1
    return heard


def test_questions_are_answered():
    port = plotter()
    assert ask(port, b"OI;") == b"7475A\r"
    assert ask(port, b"OH;") == b"0,0,16800,11880\r"
    assert ask(port, b"OS;") == b"24\r" and ask(port, b"OS;") == b"16\r"
    assert ask(port, b"\x1b.B\x1b.L") == b"1023\r1023\r"
    assert ask(port, b"\x1b.O") == b"8\r" and ask(port, b"\x1b.E") == b"0\r"
    assert ask(port, b"PU400,800;PD;OA;OC;") == b"400,800,1\r400,800,1\r"


def test_answers_end_as_they_are_told_until_it_is_switched_off():
    port = plotter()
    assert ask(port, b"\x1b.M;;;10:OA;") == b"0,0,0\n"
    assert ask(port, b"\x1b.M;;;1\x1b:\x1b.E") == b"12\n"  # what came over wrong changes nothing
    port.power_on()
    assert ask(port, b"OA;") == b"0,0,0\r"


def test_an_output_instruction_waits_and_device_control_does_not():
    port = plotter()
    port.write(b"VS1;PD400,0;OA;" + b"\x1b.B")
    assert port.read(5.0).strip().isdigit() and port.now < 0.2
    assert port.read(5.0) == b"400,0,1\r" and 1.0 < port.now < 1.3  # 10 mm at 1 cm/s, and the pen


@pytest.mark.parametrize(
    ("data", "error"),
    [(b"XX1,2;", 1), (b"PD1,2,3;", 2), (b"VS300;", 3), (b"PA99999,0;", 3), (b"RO45;", 3), (b"?;", 1), (b"PU 1 2;", 0)],
)
def test_errors_are_kept_until_they_are_asked_for(data, error):
    port = plotter()
    assert ask(port, data + b"OE;OE;") == b"%d\r0\r" % error


def test_instructions_end_with_the_next_ones_letters_too():
    port = plotter()
    assert ask(port, b"PU10,20\r\nPD30,40OA;") == b"30,40,1\r"
    assert ask(port, b"PR5,5;PU;PA;PD1,2;OA;") == b"1,2,1\r"


def test_a_buffer_that_runs_over_loses_bytes_and_says_so():
    port = plotter("buffer=128")
    port.write(b"VS1;" + b"PD4000,0;PD0,0;" * 20)
    assert ask(port, b"\x1b.E", wait=1.0) == b"16\r"
    assert port.lost_bytes > 100 and ask(port, b"\x1b.E", wait=1.0) == b"0\r"
    assert int(ask(port, b"\x1b.B", wait=1.0)) < 10  # it never blocks device control


def test_abort_drops_the_buffer_and_ends_the_vector():
    port = plotter()
    port.write(b"VS1;PD400,0,800,0,1200,0,1600,0,2000,0;" + b"PD0,0;" * 30)
    port.read(0.5)  # it draws the first vector
    ask(port, b"\x1b.K", wait=0.0)
    x, y, down = map(int, ask(port, b"OA;").split(b","))
    assert x in (400, 800, 1200) and y == 0 and down == 1
    assert ask(port, b"\x1b.B") == b"1023\r"


def test_a_line_is_clipped_with_the_pen_lifted_outside():
    port = plotter()
    assert ask(port, b"PU16000,100;PD17600,100,17600,300,16000,300;PU;OA;") == b"16000,300,0\r"
    a, b = port.executed_drawing().strokes
    assert np.allclose(a.xy[[0, -1], 0], [400.0, 420.0]) and np.allclose(b.xy[[0, -1], 0], [420.0, 400.0])
    assert port.firmware.error == 0


def test_rotation_turns_coordinates_and_not_the_paper():
    straight, turned = plotter(), plotter(rotation=0)
    ask(straight, b"PU100,200;PD400,200;PU;OA;")
    assert ask(turned, b"RO90;OH;").strip() == b"0,0,11880,16800"
    # a quarter turn: y of the paper is x of the instructions
    assert ask(turned, b"PU200,16700;PD200,16400;PU;OA;") == b"200,16400,0\r"
    (a,), (b,) = straight.executed_drawing().strokes, turned.executed_drawing().strokes
    assert np.allclose(a.xy[[0, -1]], b.xy[[0, -1]])


def test_view_suspends_and_the_lever_stops():
    port = plotter()
    port.firmware.view(2.0)
    port.write(b"PU4000,0;")
    assert int(ask(port, b"\x1b.O", wait=0.5)) & 16 and ask(port, b"OA;") == b"4000,0,0\r" and port.now > 2.0
    port.firmware.alarm()
    assert int(ask(port, b"PU0,0;\x1b.O", wait=0.5)) & 32 and ask(port, b"OA;", wait=5.0) == b""


@pytest.mark.parametrize("cut", [0.0, 2.0])
def test_vectors_take_their_time_on_every_machine(cut):
    """Stops: two trapezoids; with a corner cut, less, and never faster than the axes allow."""
    carriage = Carriage(push=40000.0, cut=cut, room=3)
    for place in ((400, 0), (800, 0), (800, 400)):
        carriage.add(place, 4000.0)
    carriage.start(0.0)
    track = [(0.0, (0, 0))]
    while carriage.moving:
        track.append(carriage.ahead[0])
        carriage.arrive()
    t, xy = np.array([time for time, _ in track]), np.array([place for _, place in track], dtype=float)
    speed = np.diff(xy, axis=0) / np.diff(t)[:, None]
    assert np.abs(speed).max() < 4000 + 2 / np.diff(t).min()
    alone = 2 * (400 / 40000) ** 0.5
    assert t[-1] == pytest.approx(3 * alone, rel=1e-6) if cut == 0 else t[-1] < 3 * alone - 0.02


def test_device_control_may_come_in_pieces():
    cut = Escapes()
    pieces = [
        piece for part in (b"PU1,", b"2;\x1b", b".", b"@;0", b":P", b"D;\x1b.BPU;") for piece in cut.cut_pieces(part)
    ]
    urgent = [piece for piece, at_once in pieces if at_once]
    assert urgent == [b"\x1b.@;0:", b"\x1b.B"]
    assert b"".join(piece for piece, at_once in pieces if not at_once) == b"PU1,2;PD;PU;"
