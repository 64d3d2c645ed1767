"""FluidNC and grblHAL over TCP and WebSocket, through real sockets of this computer."""

import socket
import struct
import sys
import threading

import pytest
from cursive import page

from handout import profiles
from handout.errors import InputError, PortError
from handout.plotting import connections, observation, open_port, plan, run
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.store import JobOptions
from handout_lab.ink_comparison import compare

PROFILE = profiles.find("simulated", "plotter")
DRAWING = page(words=1)
MADE = plan(DRAWING, PROFILE)
WAYS = ["network=tcp&variant=fluidnc", "network=ws&variant=fluidnc", "network=ws&variant=grblhal"]


class Nobody:
    """Nobody is asked, and nobody tries again."""

    def do(self, request):
        raise AssertionError(request)

    def try_again(self, error):
        return False


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("more", ["", "&latency=20ms&buffer=128", "&fault=stall"])
def test_a_plot_over_a_network_overruns_nothing(way, more):
    port, said = open_port(f"sim:?{way}{more}", PROFILE), []
    run(MADE, port, PROFILE, log=said.append)
    assert observation.compare_strokes(DRAWING, port.executed_drawing()).deviation < 0.1
    assert port.lost_bytes == 0 and said == []
    port.close()
    with pytest.raises(PortError, match=r"is lost: is the plotter still switched on, and on the network\?"):
        port.read(0.1)


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_a_lost_connection_is_gone_on_with_where_it_was_lost(way, tmp_path, monkeypatch):
    """The greeting of whoever connects is not taken for a restart: the machine has kept its place."""
    monkeypatch.setattr("os.fsync", lambda handle: None)
    port, said = open_port(f"sim:?{way}&fault=unplugged&after=60", PROFILE), []
    job = store.create((DRAWING,), PROFILE, JobOptions(overlap=6.0), place=tmp_path)
    with pytest.raises(PortError, match=r"The connection to (ws|tcp)://127.* is lost"):
        runner.run_job(job, lambda: port, Nobody())
    port.replug()
    runner.run_job(job, lambda: port, Nobody(), log=said.append)
    told = compare(DRAWING, port.executed_drawing().strokes)
    assert told.missing == 0 and told.stray == 0 and told.deviation < 0.1 and told.doubled <= 6.0
    assert any("has kept its place" in words for words in said)


def test_a_restart_behind_a_network_is_seen(tmp_path, monkeypatch):
    """The connection is lost, the machine greets as it greets everybody, and has forgotten its place."""
    monkeypatch.setattr("os.fsync", lambda handle: None)
    port = open_port("sim:?network=tcp&variant=grblhal&fault=reset&after=60", PROFILE)
    job = store.create((DRAWING,), PROFILE, JobOptions(overlap=6.0), place=tmp_path)
    with pytest.raises(PortError):
        runner.run_job(job, lambda: port, Nobody())
    port.replug()
    with pytest.raises(AssertionError, match="push it above the plotter's zero"):
        runner.run_job(job, lambda: port, Nobody())


@pytest.mark.parametrize("scheme", ["tcp", "ws"])
def test_who_is_there_is_asked_once(scheme):
    opened = []

    def open_at(url, baud):
        opened.append(url)
        return open_port(f"sim:?network={scheme}&variant=fluidnc", PROFILE)

    answer = connections.identify(f"{scheme}://fluidnc.local", open_at)
    assert answer.dialect == "grbl" and "FluidNC" in answer.firmware and len(opened) == 1


@pytest.mark.parametrize(("device", "network"), [("axidraw-v3", "ws"), ("klipper-servo", "tcp")])
def test_only_some_are_simulated_on_a_network(device, network):
    with pytest.raises(InputError, match=r"only GRBL machines .* and Klipper"):
        open_port(f"sim:?network={network}", profiles.find(device, "plotter"))


@pytest.mark.parametrize(
    ("url", "kind", "said"),
    [
        ("tcp://", InputError, "is no address of a plotter"),
        ("ws://host:port", InputError, "is no address of a plotter"),
        ("socket://host", InputError, "is no address of a plotter"),
        ("tcp://nobody.invalid", PortError, "nobody on this network is called nobody.invalid"),
        ("ws://127.0.0.1:1", PortError, "connection refused.*no other program"),
    ],
)
def test_an_address_that_leads_nowhere_is_explained(url, kind, said):
    with pytest.raises(kind, match=said):
        open_port(url, PROFILE)


def test_websockets_is_an_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "websockets.sync.client", None)
    with pytest.raises(
        PortError, match=r"handout-driver\[network\]'; or use the machine's telnet, tcp://fluidnc.local"
    ):
        open_port("ws://fluidnc.local:81", PROFILE)


def test_what_is_not_a_websocket_is_told():
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(5)

        def answer():
            connection = server.accept()[0]
            connection.recv(4096)
            connection.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")
            connection.close()

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(PortError, match="answers, but not as a WebSocket does"):
            open_port(f"ws://127.0.0.1:{server.getsockname()[1]}", PROFILE)
        thread.join()


def test_a_connection_is_aborted():
    """What is under way when it breaks must not arrive when the plot has been gone on with."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = open_port(f"tcp://127.0.0.1:{server.getsockname()[1]}", PROFILE)
        there = server.accept()[0]
        assert port._socket.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8) == struct.pack("ii", 1, 0)
        port.close()
        there.settimeout(5)
        with pytest.raises(ConnectionResetError):
            there.recv(1)
        there.close()
