"""Klipper behind Moonraker: what it is told, what its answers mean, and what becomes of a plot that breaks off."""

import http.server
import json
import os
import socket
import threading

import msgspec
import pytest
from cursive import page
from hypothesis import given
from hypothesis import strategies as st

from handout import profiles
from handout.errors import DeviceAlarm, DeviceError, DeviceGarbled, DeviceSilent, DoesNotFit, InputError, PortError
from handout.plotting import connections, observation, open_port, plan, run
from handout.plotting.dialects import MoveBlock, Pause, PenBlock
from handout.plotting.dialects.klipper import DIALECT as klipper
from handout.plotting.dialects.klipper import protocol
from handout.plotting.dialects.klipper.controller import Executed
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions
from handout.plotting.network_ports import MoonrakerPort
from handout_lab.ink_comparison import compare

replace = msgspec.structs.replace
SERVO, STEPPER, Z = (profiles.find(f"klipper-{pen}", "plotter") for pen in ("servo", "stepper", "z"))
MACRO = replace(SERVO, pen=replace(SERVO.pen, lift="command", up_command=("PEN_UP",), down_command=("PEN_DOWN Z=1",)))
HERE = replace(SERVO, homing=False, bed=replace(SERVO.bed, zero="here"))
DRAWING = page(words=1)
BLOCKS = [PenBlock(False), MoveBlock(2, 5, 6000), PenBlock(True), MoveBlock(3, 5, 1200), Pause(0.02), PenBlock(False)]


def lines(profile):
    return b"".join(command.data for command in klipper.program(BLOCKS, profile)).decode().splitlines()[4:]


def test_a_program_is_what_klipper_reads():
    up, down = ["SET_SERVO SERVO=pen ANGLE=40", "G4P150"], ["SET_SERVO SERVO=pen ANGLE=90", "G4P200"]
    assert lines(SERVO) == [*up, "G1X2Y5F6000", *down, "G1X3F1200", "G4P20", *up, "M400"]
    assert lines(HERE)[:2] == ["SET_KINEMATIC_POSITION X=0 Y=0 SET_HOMED=XY", "G92X0Y0"]
    assert lines(STEPPER)[3:5] == ["MANUAL_STEPPER STEPPER=pen MOVE=0 SPEED=50", "G4P30"]
    assert lines(Z)[:4] == ["G1Z2F600", "G1X2Y5F6000", "G1Z0F600", "G1X3F1200"]
    assert lines(MACRO)[:2] == ["PEN_UP", "G4P150"] and "PEN_DOWN Z=1" in lines(MACRO)
    assert lines(MACRO)[5] == "G1X3Y5F1200"  # a macro may have moved it


@pytest.mark.parametrize(
    ("said", "means"),
    [
        (b'{"jsonrpc":"2.0","result":"ok","id":7}', protocol.Answer(7, "ok")),
        (b'{"jsonrpc":"2.0","error":{"code":400,"message":"Must home"},"id":7}', protocol.Failure(7, "Must home")),
        (b'{"jsonrpc":"2.0","method":"notify_klippy_shutdown"}', protocol.Notice("shutdown", "")),
        (b'{"jsonrpc":"2.0","method":"notify_gcode_response","params":["//"]}', protocol.Notice("response", "//")),
        (b"<html>", protocol.Notice("garbage", "<html>")),
        (b"[]", protocol.Notice("garbage", "[]")),
        # as Moonraker 0.11 says it: Klipper has not been there yet, has gone, refuses, stops
        (b'{"jsonrpc":"2.0","error":{"code":-32601,"message":"Method not found"},"id":2}',
         protocol.Failure(2, "Method not found")),
        (b'{"jsonrpc":"2.0","error":{"code":503,"message":"Klippy Host not connected"},"id":8}',
         protocol.Failure(8, "Klippy Host not connected")),
        (b'{"jsonrpc":"2.0","method":"notify_gcode_response","params":["!! Must home axis first: 10.000"]}',
         protocol.Notice("response", "!! Must home axis first: 10.000")),
        (b'{"jsonrpc":"2.0","method":"notify_klippy_disconnected"}', protocol.Notice("disconnected", "")),
    ],
)  # fmt: skip
def test_messages(said, means):
    assert protocol.reply(said) == means


def test_the_board_has_done_what_was_due_before_it_was_counted_and_heard_again():
    proof, proven = Executed(), []
    for executed, heard in ((2, 100), (4, 100), (6, 140), (8, 140), (10, 180), (12, 180), (14, 180), (16, 220)):
        proof.note(executed, heard)
        proven.append(proof.proven)
    assert proven == [0, 0, 0, 0, 4, 4, 4, 8]
    proof.note(18, None)  # it does not count
    assert proof.proven == 18


def test_places_are_told_in_the_coordinates_of_the_program():
    move = {"position": [12.0, 20.0, 0.0], "gcode_position": [2.0, 5.0, 0.0]}
    told = {"motion_report": {"live_position": [11.0, 18.0, 0.0, 0.0]}, "gcode_move": move}
    told |= {"mcu": {"last_stats": {"bytes_retransmit": 0, "bytes_read": 5297}}}
    status = protocol.status({"status": told})
    assert status.live == (1.0, 3.0) and status.end == (2.0, 5.0) and status.state == "startup" and status.heard == 5297
    assert protocol.status(None).live is None


@pytest.mark.parametrize("profile", [SERVO, STEPPER, Z, MACRO, HERE], ids=["servo", "stepper", "z", "macro", "here"])
def test_a_plot_is_drawn_as_meant(profile):
    port, said = open_port("sim:", profile), []
    report = run(plan(DRAWING, profile), port, profile, log=said.append)
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.05
    assert said == (["Homing: the plotter looks for its zero."] if profile.homing else [])
    assert "four times a second" in report.observation.unknown and port.at_rest and not port.pen_is_down
    assert abs(report.executed_s - report.announced_s) < 0.8  # it begins late, and is asked for its end


class Nobody:
    """Nobody is asked, and nobody tries again."""

    def do(self, request):
        raise AssertionError(request)

    def try_again(self, error):
        return False


@pytest.mark.parametrize(
    ("profile", "way", "error", "said"),
    [
        (SERVO, "network=ws&fault=unplugged&after=8", PortError, "is lost: is the plotter still switched on"),
        (STEPPER, "fault=alarm&after=8", DeviceAlarm, "Klipper has stopped.* no longer knows where it is"),
        (SERVO, "fault=reset&after=8", DeviceAlarm, "Klipper has stopped .Moonraker does not reach it"),
        (SERVO, "fault=lost-board&after=8", DeviceGarbled, "Klipper has stopped .Lost communication with MCU 'mcu'"),
        (SERVO, "fault=lost-board&after=10", DeviceAlarm, "Klipper has stopped .Lost communication"),  # at the end
        (SERVO, "fault=error&after=5", DeviceAlarm, "Klipper refused a line: Move out of range"),
        (SERVO, "network=ws&fault=jam&after=8", DeviceSilent, "has not answered for"),  # Moonraker goes on talking
    ],
)
def test_what_breaks_off_is_gone_on_with(profile, way, error, said, tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    port, told = open_port(f"sim:?{way}", profile), []
    job = store.create((DRAWING,), profile, JobOptions(overlap=6.0), place=tmp_path)
    with pytest.raises(error, match=said):
        runner.run_job(job, lambda: port, Nobody(), log=told.append)
    port.power_on() if error is DeviceSilent else port.replug()
    runner.run_job(job, lambda: port, Nobody(), log=told.append)
    found = compare(DRAWING, port.executed_drawing().strokes)
    assert found.missing == 0 and found.stray == 0 and found.dots == 0 and found.deviation < 0.1
    for words, fault in (
        ("Klipper was shut down (MCU 'mcu' shutdown: Timer too close); it is started", "alarm"),
        ("interrupt, turn the motor", "alarm"),
        ("Klipper was shut down (Lost communication with MCU 'mcu'); it is started", "lost-board"),
    ):
        assert (words in " ".join(told)) == (fault in way)


def test_a_stall_and_slow_answers_only_take_time():
    for way in ("fault=stall&after=8", "fault=late&late=800ms&after=3", "latency=40ms"):
        port = open_port(f"sim:?{way}", SERVO)
        run(plan(DRAWING, SERVO), port, SERVO)
        assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.05


def test_an_interrupt_lets_it_finish_what_it_has_in_hand():
    port, said = open_port("sim:", SERVO), []
    controller = klipper.connect(port, SERVO, said.append)
    controller.home()
    for command in klipper.program(plan(DRAWING, SERVO).blocks, SERVO):
        if controller.sent == 60:
            break
        controller.send(command.data)
    controller.halt()
    assert controller.executed > 10 and not port.pen_is_down and port.at_rest
    at = [steps / SERVO.limits.steps_per_mm for steps in port.paper.place[:2]]
    assert "two seconds" in said[-1] and controller.position() == pytest.approx(at, abs=0.02)


def pressed_twice(port, controller):
    """Ctrl-C while it finishes what it has in hand."""
    real, calls = port.read, []

    def read(timeout):
        calls.append(timeout)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(timeout)

    port.read = read
    controller.halt()
    port.read = real


def test_a_second_interrupt_shuts_klipper_down_and_starts_it_anew():
    port, said = open_port("sim:", SERVO), []
    controller = klipper.connect(port, SERVO, said.append)
    controller.home()
    for command in list(klipper.program(plan(DRAWING, SERVO).blocks, SERVO))[:60]:
        controller.send(command.data)
    pressed_twice(port, controller)
    assert "stopped dead" in said[-1] and not port.pen_is_down and controller.position() is None


def with_object(name, **values):
    """A simulated machine one of whose objects says something else."""

    def open_(profile):
        port = open_port("sim:", profile)
        real = port.firmware._object
        port.firmware._object = lambda asked: real(asked) | (values if asked == name else {})
        return port

    return open_


def test_the_machine_s_own_limits_win():
    port, said = with_object("toolhead", max_accel=900.0, max_velocity=80.0)(SERVO), []
    controller = klipper.connect(port, SERVO, said.append)
    limits = controller.profile.limits
    assert (limits.acceleration, limits.draw_speed, limits.travel_speed) == (900.0, 80.0, 80.0)
    assert len(said) == 4 and said[0].startswith("draw speed: the plotter's own 80")


@pytest.mark.parametrize(
    ("name", "values", "error", "said"),
    [
        ("stift", {}, DeviceAlarm, r"has no \[servo stift\] \(of this kind it has: pen\)"),
        ("pen", {"axis_minimum": [3.0, 0, 0, 0]}, DoesNotFit, r"\[stepper_x\]. leave x from 3 to 220 mm"),
        ("pen", {"axis_maximum": [220.0, 8.0, 0, 0]}, DoesNotFit, "leave y from 0 to 8 mm"),
    ],
)
def test_what_does_not_fit_is_refused_before_anything_moves(name, values, error, said):
    port = with_object("toolhead", **values)(SERVO)
    with pytest.raises(error, match=said):
        klipper.connect(port, replace(SERVO, pen=replace(SERVO.pen, name=name)), print)
    assert port.at_rest and not port.executed_drawing().strokes


def test_an_axis_that_is_not_homed_is_not_moved():
    profile = replace(SERVO, homing=False)
    controller = klipper.connect(with_object("toolhead", homed_axes="z")(profile), profile, print)
    for call in (lambda: controller.send(b"G1X5F600\n"), lambda: controller.jog(1, 1)):
        with pytest.raises(DeviceAlarm, match="home it"):
            call()
    assert controller.position() is None
    profile = replace(Z, homing=False)
    controller = klipper.connect(with_object("toolhead", homed_axes="xy")(profile), profile, print)
    with pytest.raises(DeviceAlarm, match="home Z at its page"):
        controller.send(b"G1X5F600\n")


def test_what_another_program_does_is_noticed():
    port = with_object("motion_report", live_position=[90.0, 90.0, 0.0, 0.0])(SERVO)
    with pytest.raises(DeviceGarbled, match=r"at 90.0, 90.0 mm and not on its way: another program"):
        run(plan(DRAWING, SERVO), port, SERVO)


@pytest.mark.parametrize("moves", [40, 1])  # to the end
def test_relative_coordinates_of_another_program_are_noticed(moves):
    port = open_port("sim:", SERVO)
    controller = klipper.connect(port, SERVO, print)
    controller.home()
    commands = list(klipper.program(plan(DRAWING, SERVO).blocks, SERVO))
    begin = [number for number, command in enumerate(commands) if command.data.startswith(b"G1X")][-moves]
    for command in commands[:begin]:
        controller.send(command.data)
    controller.finish()
    port.firmware.relative = True
    with pytest.raises(DeviceError) as error:
        for command in commands[begin:]:
            controller.send(command.data)
        controller.finish()
    proven = controller.proven
    controller.halt()
    assert controller.spoilt or isinstance(error.value, DeviceGarbled)
    assert controller.proven == proven < len(commands) and not port.pen_is_down


def test_a_line_of_the_user_s_own_may_have_remarks():
    controller = klipper.connect(open_port("sim:", replace(SERVO, homing=False)), SERVO, print)
    controller.home()
    controller.send(b"G1 X5.5 F600 ; to the X of Y\n")
    assert controller._at == (5.5, 0.0)
    controller.finish()
    assert controller.position() == (5.5, 0.0)


def test_a_command_that_klipper_lacks_is_named():
    port = open_port("sim:", SERVO)
    controller = klipper.connect(port, SERVO, print)
    port.firmware._notify("notify_gcode_response", '// Unknown command:"TYPED_BY_SOMEBODY_ELSE"')
    controller.conversation.ask(b"M400\n")
    with pytest.raises(DeviceAlarm, match=r"does not know a line .*FEED_SHEET.*gcode_macro"):
        controller.conversation.ask(b"Feed_Sheet\n")


def test_a_klipper_that_prints_a_file_is_left_alone():
    with pytest.raises(DeviceAlarm, match=r"is printing with the file vase\.gcode: wait"):
        klipper.connect(with_object("print_stats", state="printing", filename="vase.gcode")(SERVO), SERVO, print)


def test_klipper_that_does_not_start_is_told_with_its_reason():
    port = open_port("sim:", SERVO)
    port.firmware.state, port.firmware.message = "error", "Option 'pin' in section 'servo pen' must be specified\nx"
    with pytest.raises(DeviceAlarm, match=r"is not ready \(Option 'pin' in section 'servo pen' must be specified\)"):
        klipper.connect(port, SERVO, print)


UNAUTHORISED = b'{"jsonrpc":"2.0","error":{"code":-32602,"message":"Unauthorized"},"id":1}'


class Handler(http.server.BaseHTTPRequestHandler):
    """Moonraker's JSON-RPC over HTTP, with the simulated Klipper behind it."""

    protocol_version = "HTTP/1.1"

    def do_POST(self):
        asked = self.rfile.read(int(self.headers["Content-Length"]))
        key = self.headers["X-Api-Key"]
        status, body = 200, UNAUTHORISED  # as Moonraker 0.11 answers whoever has no key; one that is wrong it refuses
        if self.server.key and key and key != self.server.key:
            status = 401
        with self.server.lock:
            if key == self.server.key or not self.server.key:
                self.server.port.write(asked + b"\n")
                number, body = json.loads(asked)["id"], b""
                while b'"id":%d}' % number not in body:
                    body = next((line for line in self.server.port.read(60.0).splitlines() if b'"id"' in line), b"")
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *words):
        pass


@pytest.fixture
def moonraker():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.port, server.key, server.lock = open_port("sim:", SERVO), "", threading.Lock()
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield server, f"moonraker+http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    thread.join()
    server.server_close()


def test_over_http_it_is_asked_and_drives(moonraker):
    server, url = moonraker
    answer = connections.identify(url)
    assert answer.dialect == "klipper" and answer.known.profiles[0] == "klipper-servo"
    port = open_port(url, SERVO)
    controller = klipper.connect(port, SERVO, print)
    controller.home()
    for command in klipper.program(BLOCKS, SERVO):
        controller.send(command.data)
    controller.finish()
    port.close()
    assert controller.executed == controller.sent and len(server.port.executed_drawing().strokes) == 1


def test_a_connection_that_was_closed_while_nobody_asked_is_opened_again(moonraker, monkeypatch):
    monkeypatch.setattr(Handler, "timeout", 0.02)  # s that the server keeps one
    port, asked = open_port(moonraker[1], SERVO), protocol.request(7, "server.info")
    for _ in range(2):
        port.write(asked)
        assert b'"id":7' in port.read(5.0)
        port._idle[0].sock.recv(1, socket.MSG_PEEK)  # until it is closed
    monkeypatch.setattr("select.select", None)  # on Windows it waits for no empty list
    assert port.read(0.001) == b""
    port.close()


def test_a_key_is_taken_from_the_environment(moonraker, monkeypatch):
    server, url = moonraker
    server.key = "secret"
    monkeypatch.delenv("MOONRAKER_API_KEY", raising=False)
    for key in ("", "sicret"):
        monkeypatch.setenv("MOONRAKER_API_KEY", key)
        with pytest.raises(PortError, match=r"asks for a key: put its API key into .* MOONRAKER_API_KEY") as told:
            connections.identify(url)
        assert not key or key not in str(told.value)
    monkeypatch.setenv("MOONRAKER_API_KEY", "sec\rret")
    with pytest.raises(InputError, match="has other characters than a key"):
        connections.identify(url)
    monkeypatch.setenv("MOONRAKER_API_KEY", "secret\r\n")  # of a file from Windows
    assert connections.identify(url).dialect == "klipper"


def test_a_web_socket_says_who_may_not_ask_and_not_how_moonraker_is():
    port = MoonrakerPort.__new__(MoonrakerPort)
    port.url = "moonraker://x"
    with pytest.raises(PortError, match="Moonraker at moonraker://x asks for a key"):
        port._hear_message(UNAUTHORISED.decode())
    assert (
        port._hear_message('{"jsonrpc":"2.0","method":"notify_proc_stat_update","params":[{"cpu_temp":null}]}') == b""
    )
    for kind in ("klippy_shutdown", "gcode_response"):
        assert port._hear_message(f'{{"jsonrpc":"2.0","method":"notify_{kind}"}}').endswith(b"}\n")


@pytest.mark.parametrize(
    ("url", "said"),
    [("moonraker://127.0.0.1:1", "connection refused"), ("moonraker+http://127.0.0.1:1", "connection refused")],
)
def test_nobody_there(url, said):
    with pytest.raises(PortError, match=said):
        open_port(url, SERVO)


@pytest.mark.slow
@pytest.mark.skipif(
    not {"HANDOUT_KLIPPY", "HANDOUT_MOONRAKER"} <= set(os.environ),
    reason="neither Klipper's host nor Moonraker is here",
)
def test_a_real_moonraker_and_klipper_are_shut_down_and_gone_on_with(tmp_path):
    from benchmarks import faults, moonraker

    with moonraker.Host(tmp_path, SERVO) as host:
        assert host.wait("ready") == "ready"
        run = moonraker.plotted(host, "emergency stop", 0, faults.drawing("it"))
    assert faults.verdict(run) == "right" and run.stops  # a busy computer stops Klipper by itself, too


@pytest.mark.skipif(os.name != "posix", reason="its board speaks through a pseudo-terminal")
@given(st.integers(-(2**31), 2**31 - 1))
def test_numbers_of_klipper_s_boards_come_back(value):
    from benchmarks.moonraker import _packed, _unpacked

    assert _unpacked(_packed(value), 0) == (value, len(_packed(value)))
