"""Ports over the network: TCP as it is (telnet of FluidNC and grblHAL, ESP3D, ser2net), WebSocket, and Moonraker.

Neither holds the sender back in time: what a machine has not answered is bounded by counting characters, as on a serial
line (`dialects.grbl.conversation`).  A connection is always aborted, never shut: what lies in this computer's buffers
after a break must not reach the machine when the network is back and the plot has been gone on with.

Moonraker, which stands before Klipper, is spoken to in messages of JSON-RPC, one a line, over WebSocket or over HTTP.
An API key, where it asks for one, is taken from the environment variable ``MOONRAKER_API_KEY``, so that no job and no
message has it.

Sources: FluidNC, WebUI (TelnetClient, WSChannel: whole lines in binary frames, words for its page in text frames);
grblHAL, Plugin_networking (telnetd: one client, greeted; websocketd: binary frames for the subprotocol "arduino", a
ping after 3 s without traffic, of which four must not stay unanswered); Moonraker's documentation (introduction:
WebSocket connections, JSON-RPC over HTTP; authorization).
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import socket
import struct
import time
from http.client import HTTPConnection, HTTPException
from typing import Any
from urllib.parse import urlsplit

from handout.errors import InputError, PortError
from handout.plotting.ports import Port

_PORTS = {"tcp": 23, "telnet": 23, "socket": 0, "ws": 81}  # what a machine uses that was told nothing else; 0: none
_CONNECTS = 5.0  # s
_SENDS = 10.0  # s that what is sent may wait for the network
_MISSING = "needs the library websockets: pip install 'handout-driver[network]'; or "
# what FluidNC tells its own page in the browser; not lines of the conversation
_FOR_BROWSERS = re.compile(r"(CURRENT_ID|ACTIVE_ID|currentID|activeID):|PING\b")


def is_network(url: str) -> bool:
    """Whether an address is one of this module."""
    return url.partition("://")[0] in _PORTS and "://" in url


def open_network(url: str) -> Port:
    """Open ``tcp://host:port`` (or ``telnet://``, ``socket://``; port 23) or ``ws://host:port/path`` (port 81).

    Raises InputError: it is no such address. PortError: nobody takes the connection, or websockets is not installed.
    """
    return WebSocketPort(url) if url.startswith("ws:") else TcpPort(url)


class TcpPort:
    """Bytes as they are over TCP.

    greets : whoever connects may be greeted as after a start: a greeting tells nothing of one.
    """

    greets = True

    def __init__(self, url: str) -> None:
        self.url, self._socket = url, _open_socket(url)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._socket.settimeout(_SENDS)
            self._socket.sendall(data)
        except OSError as error:
            raise lost_error(self.url) from error

    def read(self, timeout: float) -> bytes:
        """What has come in; waits up to `timeout` seconds for a first byte."""
        try:
            self._socket.settimeout(timeout)
            data = self._socket.recv(65536)
        except (TimeoutError, BlockingIOError):
            return b""
        except OSError as error:
            raise lost_error(self.url) from error
        if not data:
            raise lost_error(self.url)
        return data

    def close(self) -> None:
        """Abort the connection."""
        self._socket.close()


class WebSocketPort:
    """The lines of a machine over WebSocket; its pings are answered while nobody reads.

    greets : as of `TcpPort`.
    missing, other : what to do where the library is missing, and where who answers is no WebSocket.
    """

    greets = True
    missing = "use the machine's telnet, tcp://{}."
    other = "the port is 81 on most FluidNC and grblHAL machines."

    def __init__(self, url: str, protocols: tuple[str, ...] = ("arduino",)) -> None:
        try:
            from websockets.exceptions import WebSocketException
            from websockets.sync.client import connect
        except ImportError as error:
            raise PortError(f"{url} {_MISSING}{self.missing.format(urlsplit(url).hostname)}") from error
        self.url, self._socket = url, _open_socket(url)
        subprotocols: Any = list(protocols) or None
        try:  # no pings of ours: older grblHAL answers them with a broken frame
            self._connection = connect(
                url,
                sock=self._socket,
                subprotocols=subprotocols,
                additional_headers=self.headers(),
                compression=None,
                open_timeout=_CONNECTS,
                ping_interval=None,
                max_queue=None,
            ).__enter__()  # left by closing the socket, without the farewells of its own way out
        except (OSError, WebSocketException) as error:
            self._socket.close()
            raise PortError(f"{url} answers, but not as a WebSocket does: {self.other}") from error

    def headers(self) -> dict[str, str]:
        """What is told when it connects."""
        return {}

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._send(data)

    def _send(self, data: bytes | str) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            self._connection.send(data)
        except (OSError, ConnectionClosed) as error:
            raise lost_error(self.url) from error

    def read(self, timeout: float) -> bytes:
        """What has come in; waits up to `timeout` seconds for a first byte."""
        from websockets.exceptions import ConnectionClosed

        data, end = b"", time.monotonic() + timeout
        with contextlib.suppress(TimeoutError):
            while True:
                try:
                    message = self._connection.recv(timeout=0.0 if data else max(end - time.monotonic(), 0.0))
                except (OSError, ConnectionClosed) as error:
                    if isinstance(error, TimeoutError) or data:
                        break
                    raise lost_error(self.url) from error
                data += self._hear_message(message)
        return data

    def _hear_message(self, message: str | bytes) -> bytes:
        """What a message means to the conversation."""
        if isinstance(message, bytes):
            return message
        return b"" if _FOR_BROWSERS.match(message) else message.encode()

    def close(self) -> None:
        """Abort the connection."""
        self._connection.close_socket()


def lost_error(url: str) -> PortError:
    """The error of a connection that was there."""
    return PortError(f"The connection to {url} is lost: is the plotter still switched on, and on the network?")


def unreachable(url: str, host: str, error: OSError) -> PortError:
    """The error of a place that takes no connection."""
    reason = "it does not answer" if isinstance(error, TimeoutError) else (error.strerror or str(error)).lower()
    if isinstance(error, socket.gaierror):
        reason = f"nobody on this network is called {host}"
    return PortError(
        f"{url} cannot be opened ({reason}): check the address, that the machine is switched on and on the network, "
        "and that no other program is connected to it."
    )


def _open_socket(url: str) -> socket.socket:
    """A connection to the place that an address names."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port or _PORTS[parts.scheme]
    except ValueError:
        host, port = None, 0
    if not host or not port:
        raise InputError(f"{url} is no address of a plotter: write tcp://host:23 or ws://host:81.")
    try:
        made = socket.create_connection((host, port), _CONNECTS)
    except OSError as error:
        raise unreachable(url, host, error) from error
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closing aborts
    made.settimeout(None)
    return made


_PORT = 7125  # of Moonraker, where nothing else was set up
_ANSWERS = 10.0  # s that Moonraker may take over a request
_SCHEMES = ("moonraker", "moonraker+http")
# what it tells about itself, not about Klipper: no sign that Klipper lives
_OWN_NOTICE = re.compile(r'\{"jsonrpc": ?"2\.0", ?"method": ?"notify_(?!klippy_|gcode_response")')
_UNAUTHORISED = re.compile(r'"error": ?\{"code": ?-32602, ?"message": ?"Unauthorized')  # the connection itself is taken


def is_moonraker(url: str) -> bool:
    """Whether an address is one of this module."""
    scheme, found, _ = url.partition("://")
    return bool(found) and scheme in _SCHEMES


def open_moonraker(url: str) -> Port:
    """Open ``moonraker://host:port`` (WebSocket; port 7125) or ``moonraker+http://host:port``, which needs no library.

    Raises InputError: it is no such address. PortError: nobody takes the connection, or websockets is not installed.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port or _PORT
    except ValueError:
        host, port = None, 0
    if not host:
        raise InputError(f"{url} is no address of Moonraker: write moonraker://mainsailos.local.")
    return HttpPort(url, host, port) if parts.scheme == "moonraker+http" else MoonrakerPort(url, host, port)


def _headers() -> dict[str, str]:
    """The key as a header; refuses a key that no header can hold, since libraries would show it in their errors."""
    key = os.environ.get("MOONRAKER_API_KEY", "").strip()
    if not (key.isascii() and key.isprintable()):
        raise InputError("The environment variable MOONRAKER_API_KEY has other characters than a key: copy it again.")
    return {"X-Api-Key": key} if key else {}


def _check_authorised(url: str, answer: str, status: int = 200) -> None:
    """Raise PortError where Moonraker asks for a key, or for another."""
    if status in (401, 403) or _UNAUTHORISED.search(answer[:200]):
        raise PortError(
            f"Moonraker at {url} asks for a key: put its API key into the environment variable MOONRAKER_API_KEY, or "
            "name this computer under trusted_clients in its moonraker.conf."
        )


class MoonrakerPort(WebSocketPort):
    """Moonraker's WebSocket."""

    def __init__(self, url: str, host: str, port: int) -> None:
        where = f"[{host}]" if ":" in host else host
        self._half = b""
        super().__init__(f"ws://{where}:{port}/websocket", ())
        self.url = url

    missing = "use moonraker+http://{}."
    other = "the port is 7125 on most machines; where Moonraker asks for a key, put it into MOONRAKER_API_KEY."

    def headers(self) -> dict[str, str]:
        """The key, where there is one."""
        return _headers()

    def write(self, data: bytes) -> None:
        """Send every line as a message."""
        *lines, self._half = (self._half + data).split(b"\n")
        for line in filter(None, lines):
            self._send(line.decode("utf-8"))

    def _hear_message(self, message: str | bytes) -> bytes:
        text = message.decode("utf-8", "replace") if isinstance(message, bytes) else message
        _check_authorised(self.url, text)
        return b"" if _OWN_NOTICE.match(text) else text.encode() + b"\n"


class HttpPort:
    """Moonraker's requests over HTTP, each on a connection of its own until it is answered; it tells nothing unasked.

    greets : as of `network_ports.TcpPort`.
    """

    greets = True

    def __init__(self, url: str, host: str, port: int) -> None:
        self.url, self._place = url, (host, port)
        self._half = b""
        self._waiting: list[HTTPConnection] = []
        self._idle: list[HTTPConnection] = [self._connect()]

    def _connect(self) -> HTTPConnection:
        made = HTTPConnection(*self._place, timeout=_CONNECTS)
        try:
            made.connect()
        except OSError as error:
            raise unreachable(self.url, self._place[0], error) from error
        return made

    def write(self, data: bytes) -> None:
        """Send every line as a request."""
        *lines, self._half = (self._half + data).split(b"\n")
        for line in filter(None, lines):
            connection = self._free()
            self._waiting.append(connection)
            try:
                connection.request("POST", "/server/jsonrpc", line, {"Content-Type": "application/json"} | _headers())
            except (OSError, HTTPException) as error:
                raise lost_error(self.url) from error

    def _free(self) -> HTTPConnection:
        """An idle connection, or a new one; drops those that the other end has closed."""
        while self._idle:
            connection = self._idle.pop()
            if not select.select([connection.sock], [], [], 0.0)[0]:
                return connection
            connection.close()
        return self._connect()

    def read(self, timeout: float) -> bytes:
        """What has been answered by now; waits up to `timeout` seconds for a first answer."""
        if not self._waiting:  # Windows cannot wait for nothing
            time.sleep(timeout)
            return b""
        waiting = {connection.sock: connection for connection in self._waiting}
        try:
            ready = select.select(list(waiting), [], [], timeout)[0]
            return b"".join(self._answer(waiting[sock]) for sock in ready)
        except (OSError, HTTPException, ValueError) as error:
            raise lost_error(self.url) from error

    def _answer(self, connection: HTTPConnection) -> bytes:
        self._waiting.remove(connection)
        connection.sock.settimeout(_ANSWERS)
        response = connection.getresponse()
        body = response.read()
        _check_authorised(self.url, body.decode("utf-8", "replace"), response.status)
        if response.status != 200:
            raise PortError(
                f"{self.url} answers, but not as Moonraker does (HTTP {response.status}): its port is 7125."
            )
        if connection.sock is not None:  # it may have been closed by the other end
            self._idle.append(connection)
        return body.replace(b"\n", b" ").strip() + b"\n"

    def close(self) -> None:
        """Close all connections."""
        for connection in (*self._waiting, *self._idle):
            with contextlib.suppress(OSError):
                connection.close()
