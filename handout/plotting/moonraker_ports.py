"""Ports to Moonraker, which stands before Klipper: messages of JSON-RPC, one a line, over WebSocket or over HTTP.

An API key, where Moonraker asks for one, is taken from the environment variable ``MOONRAKER_API_KEY``, so that no job
and no message has it.

Sources: Moonraker's documentation (introduction: WebSocket connections, JSON-RPC over HTTP; authorization).
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import time
from http.client import HTTPConnection, HTTPException
from urllib.parse import urlsplit

from handout.errors import InputError, PortError
from handout.plotting.network_ports import WebSocketPort, lost_error, unreachable
from handout.plotting.ports import Port

_PORT = 7125  # of Moonraker, where nothing else was set up
_CONNECTS, _ANSWERS = 5.0, 10.0  # s
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

    Raises
    ------
    InputError
        It is no such address.
    PortError
        Nobody takes the connection, or websockets is not installed.
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
