"""The simulated plotter behind a real socket of this computer: FluidNC, grblHAL and Moonraker on a network.

Bytes go through the product's own port, the system's sockets and a server, which hands them to the controller when they
are written and sends what it answers when that is read; so time stays the plotter's, virtual or real, and no thread
races with another.  What such machines do of themselves: grblHAL, and FluidNC's telnet, greet whoever connects; the
WebSocket of FluidNC tells its page in a browser who it is, pings it, and reports its state while it moves.  A machine
that starts anew drops its connections; Moonraker, which is another program than Klipper, does not.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator
from typing import Any, Protocol

from handout.errors import InputError, PortError
from handout.plotting.network_ports import open_moonraker, open_network
from handout.plotting.ports import Port
from handout.profiles import Plotter
from handout.simulated.plotter.options import SimulatorOptions
from handout.simulated.plotter.port import Clock
from handout_lab.simulated.faults import FaultyPlotter

_HERE = "127.0.0.1"
_REACHED = (("grbl", "tcp"), ("grbl", "ws"), ("klipper", "ws"))
_LOOP = 10.0  # s that bytes may take through this computer before that is an error
_REPORTS = 0.2  # s between two reports of FluidNC's WebSocket
_PINGS = 10.0  # s between two words for its page in the browser
_STATISTICS = 1.0  # s between two words of Moonraker about the computer it runs on


class _Server(Protocol):
    """The machine's end of a connection."""

    def receive(self, many: int) -> bytes:
        """The next so many bytes that the host has written."""

    def send(self, data: bytes) -> None:
        """Answer."""

    def tell_page(self, text: str) -> None:
        """Say something that is no answer, to a page in a browser."""

    def close(self) -> None:
        """Drop the connection."""


class _RawServer:
    """Bytes as they are."""

    def __init__(self, connection: socket.socket) -> None:
        connection.settimeout(_LOOP)
        self._connection = connection

    def receive(self, many: int) -> bytes:
        data = b""
        while len(data) < many:
            data += (more := self._connection.recv(many - len(data)))
            if not more:
                break
        return data

    def send(self, data: bytes) -> None:
        with contextlib.suppress(OSError):  # the host has gone
            self._connection.sendall(data)

    def tell_page(self, text: str) -> None:
        pass

    def close(self) -> None:
        self._connection.close()


class _WebSocketServer(_RawServer):
    """Messages: what the host sends in any, answers in binary ones, words for the page in text."""

    subprotocols: tuple[str, ...] = ("arduino",)

    def __init__(self, connection: socket.socket) -> None:
        from websockets.server import ServerProtocol

        super().__init__(connection)
        spoken: Any = list(self.subprotocols) or None  # plain strings at run time
        self._protocol = ServerProtocol(subprotocols=spoken)
        self._received = b""
        while not (request := self._events()):
            pass
        self._protocol.send_response(self._protocol.accept(request[0]))  # type: ignore[arg-type]
        self._flush()

    def _events(self) -> list[object]:
        """What comes in next; none if the connection has ended."""
        self._protocol.receive_data(self._connection.recv(65536))
        self._flush()
        return list(self._protocol.events_received())

    def _flush(self) -> None:
        with contextlib.suppress(OSError):
            for data in self._protocol.data_to_send():
                self._connection.sendall(data)

    def receive(self, many: int) -> bytes:
        while len(self._received) < many and (frames := self._events()):
            self._received += b"".join(getattr(frame, "data", b"") for frame in frames)
        data, self._received = self._received[:many], self._received[many:]
        return data

    def send(self, data: bytes) -> None:
        self._protocol.send_binary(data)
        self._flush()

    def tell_page(self, text: str) -> None:
        self._protocol.send_text(text.encode("ascii"))
        self._flush()


class _MoonrakerServer(_WebSocketServer):
    """A message a line, in text frames both ways."""

    subprotocols = ()

    def receive(self, many: int) -> bytes:
        while len(self._received) < many and (frames := self._events()):
            self._received += b"".join(frame.data + b"\n" for frame in frames if hasattr(frame, "data"))
        data, self._received = self._received[:many], self._received[many:]
        return data

    def send(self, data: bytes) -> None:
        for line in data.splitlines():
            self.tell_page(line.decode("ascii"))


class NetworkedPlotter(FaultyPlotter):
    """A simulated GRBL machine or Klipper on a network of this computer alone; see `FaultyPlotter`.

    greets : see `plotting.network_ports`.
    """

    greets = True

    def __init__(self, profile: Plotter, options: SimulatorOptions | None = None, clock: Clock | None = None) -> None:
        if (profile.dialect, options.network if options else "tcp") not in _REACHED:
            raise InputError(
                "sim: only GRBL machines (network=tcp, network=ws) and Klipper (network=ws) are simulated on a network."
            )
        super().__init__(profile, options, clock)
        self._server: _Server | None = None
        self._client: Port
        self._reported = self._pinged = 0.0
        self._connect()

    def _connect(self) -> None:
        """Take a new connection, as after a pause or a start, and say what the machine says then."""
        self._drop()
        web, moonraker = self.options.network == "ws", self.profile.dialect == "klipper"
        kind = _MoonrakerServer if moonraker else _WebSocketServer if web else _RawServer
        made: list[_Server] = []
        with socket.create_server((_HERE, 0)) as listener:

            def accept() -> None:
                made.append(kind(listener.accept()[0]))

            thread = threading.Thread(target=accept)
            thread.start()
            place = f"{_HERE}:{listener.getsockname()[1]}"
            if moonraker:
                self._client = open_moonraker(f"moonraker://{place}")
            else:
                self._client = open_network(f"{'ws' if web else 'tcp'}://{place}")
            thread.join()
        self._server = made[0]
        if moonraker:
            return
        if web and self.options.variant == "fluidnc":
            self.firmware.reports_itself = True
            self._server.tell_page("currentID:1")
            self._server.tell_page("CURRENT_ID:1")
        else:
            self.firmware.banner()

    def _drop(self) -> None:
        if self._server is not None:
            self._server.close()
        self._server = None

    def write(self, data: bytes) -> None:
        """Send bytes through the network."""
        self._client.write(data)
        if self._server is not None:
            with self._dropping():
                super().write(self._server.receive(len(data)))

    def read(self, timeout: float) -> bytes:
        """What has come through the network by now, or within `timeout` s."""
        said, got = b"", b""
        with self._dropping():
            self._speak_unasked()
            said = super().read(timeout)
        if self._server is None:
            return self._client.read(_LOOP)  # which finds the connection closed
        if said:
            self._server.send(said)
        while len(got) < len(said):
            got += self._client.read(_LOOP)
        return got

    @contextlib.contextmanager
    def _dropping(self) -> Iterator[None]:
        """The connection goes where the machine has gone."""
        try:
            yield
        except PortError:
            self._drop()

    def _speak_unasked(self) -> None:
        """What FluidNC says by itself on a WebSocket."""
        if self._server is None or self.options.network != "ws":
            return
        if self.profile.dialect == "klipper" and self.now >= self._pinged + _STATISTICS:
            self._pinged = self.now
            self._server.tell_page('{"jsonrpc":"2.0","method":"notify_proc_stat_update","params":[{}]}')
        if self.options.variant != "fluidnc":
            return
        if self.now >= self._pinged + _PINGS:
            self._pinged = self.now
            self._server.tell_page("PING\n")
        if self.firmware.reports_itself and self.firmware.stepper.moving and self.now >= self._reported + _REPORTS:
            self._reported = self.now
            self.firmware.urgent(b"?")

    def close(self) -> None:
        """Abort the connection."""
        self._client.close()
        self._drop()
        super().close()

    def replug(self, seconds: float = 60.0) -> None:
        """Connect anew after so many seconds, in which the machine went on with what it had."""
        super().replug(seconds)
        self._connect()

    def power_on(self) -> None:
        """Switch it off, and on again, and connect."""
        super().power_on()
        self._out.clear()
        self._connect()

    def _begin_anew(self) -> None:
        super()._begin_anew()
        if self.profile.dialect == "klipper":
            return
        self._wire.lose()
        self._gone = True
        self._out.clear()
