"""Ports: what cannot be opened is explained, and bytes go through a real serial line and a real socket."""

import contextlib
import os
import socket
import sys
import threading

import pytest
from cursive import page

from handout import profiles
from handout.errors import InputError, PortError
from handout.plotting import observation, open_port, plan, run, serial_ports
from handout.simulated.plotter import SimulatedPlotter
from handout_lab.simulated import FaultyPlotter

PROFILE = profiles.find("simulated", "plotter")
posix = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")


@pytest.mark.parametrize(
    ("url", "said"),
    [
        (
            "/dev/tty-none",
            r"/dev/tty-none does not exist: is the plotter plugged in .*[Ss]erial port",
        ),
        ("", "No port was given"),
        ("socket://127.0.0.1:1", "socket://127.0.0.1:1 cannot be opened .*on the network"),
        ("teapot://x", "teapot://x cannot be opened"),
    ],
)
def test_what_cannot_be_opened_is_explained(url, said):
    with pytest.raises(PortError, match=said):
        open_port(url, PROFILE)


def test_a_file_is_not_a_port(tmp_path):
    path = tmp_path / "file"
    path.write_text("")
    with pytest.raises(PortError, match="cannot be opened as a serial port"):
        open_port(str(path), PROFILE)


def test_sim_options_begin_with_a_question_mark():
    assert isinstance(open_port("sim:", PROFILE), SimulatedPlotter)
    with pytest.raises(InputError, match="question mark"):
        open_port("sim:fault=jam", PROFILE)


def test_ports_are_listed():
    assert all(isinstance(name, str) for name in serial_ports())


def serve(read, write, plotter, end):
    """Carry bytes between a file descriptor or socket and the simulated plotter."""
    with contextlib.suppress(OSError, PortError):
        while not end.is_set():
            if data := read():
                plotter.write(data)
            if answer := plotter.read(0.005):
                write(answer)


@pytest.mark.slow
@posix
def test_a_plot_through_a_serial_line():
    """The answers of the simulated plotter come as fast as it can give them; nothing is lost on the way."""
    inner, outer = os.openpty()
    import tty

    tty.setraw(outer)
    os.set_blocking(inner, False)
    plotter, end = FaultyPlotter(PROFILE), threading.Event()

    def read():
        with contextlib.suppress(BlockingIOError):
            return os.read(inner, 4096)
        return b""

    drawing = page(words=1)
    thread = threading.Thread(target=serve, args=(read, lambda data: os.write(inner, data), plotter, end))
    port = open_port(os.ttyname(outer), PROFILE)
    try:
        with pytest.raises(PortError, match="is in use: close the other program"):
            open_port(os.ttyname(outer), PROFILE)
        thread.start()
        made = plan(drawing, PROFILE)
        plotter.lay(drawing.page, made.placement)
        report = run(made, port, PROFILE)
        assert report.stretched == pytest.approx(made.stretched) and 0 < report.executed_s < 60
        assert (
            observation.compare_strokes(drawing, plotter.executed_drawing()).deviation < 0.1 and plotter.lost_bytes == 0
        )
    finally:
        end.set()
        thread.join()
        port.close()
        os.close(inner)
        os.close(outer)


@pytest.mark.slow
def test_a_plot_through_a_socket_and_a_broken_connection():
    server = socket.create_server(("127.0.0.1", 0))
    plotter, end = FaultyPlotter(PROFILE), threading.Event()
    ended = threading.Event()

    def accept():
        connection, _ = server.accept()
        connection.settimeout(0.001)

        def read():
            with contextlib.suppress(TimeoutError):
                return connection.recv(4096)
            return b""

        serve(read, connection.sendall, plotter, end)
        connection.close()
        ended.set()

    thread = threading.Thread(target=accept)
    thread.start()
    port = open_port(f"socket://127.0.0.1:{server.getsockname()[1]}", PROFILE)
    try:
        drawing = page(words=1)
        made = plan(drawing, PROFILE)
        plotter.lay(drawing.page, made.placement)
        run(made, port, PROFILE)
        assert observation.compare_strokes(drawing, plotter.executed_drawing()).deviation < 0.1
        end.set()
        ended.wait(5)
        with pytest.raises(PortError, match="is lost: is the plotter still switched on"):
            for _ in range(100):
                port.write(b"?")
                port.read(0.05)
    finally:
        end.set()
        thread.join()
        port.close()
        server.close()
