"""Bytes to a printer and back: one HTTP POST a request, over a connection of its own."""

from __future__ import annotations

import http.client
import socket
import ssl
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from urllib.parse import urlsplit

from handout.errors import InputError, PrinterError

_PORT = 631  # RFC 8010 §4
_PIECE = 1 << 15  # bytes of a document handed over at a time
_MOST = 1 << 24  # bytes of an answer; real ones have a few thousand
_LATE, _RETRYABLE = 408, (429, 503)  # HTTP: the request did not come in time; ask again later
SCHEMES = ("ipp", "ipps")


class TransportError(PrinterError):
    """The way to the printer failed, or what answers HTTP in it: what became of a request is not known.

    handed_over : whether all bytes had been sent by then; retryable : the printer says that it cannot answer now, and
    has done nothing (HTTP 429 and 503, RFC 9110 §15.6.4); after : s after which it wants to be asked again, if it said.
    """

    def __init__(self, message: str, handed_over: bool, *, retryable: bool = False, after: float | None = None) -> None:
        super().__init__(message)
        self.handed_over, self.retryable, self.after = handed_over, retryable, after


@dataclass(frozen=True)
class Address:
    """Where a printer is: ``ipp://host:port/path``, or ``ipps://`` for an encrypted connection."""

    scheme: str
    host: str
    port: int
    path: str

    @property
    def uri(self) -> str:
        """The address in full, as the printer is told it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}{self.path}"


def is_address(text: str) -> bool:
    """Whether a text is meant as the address of an IPP printer."""
    return text.partition("://")[0].lower() in SCHEMES and "://" in text


def parse_address(text: str) -> Address:
    """Read ``ipp://host[:port][/path]``; the port is 631 and the path /ipp/print where they are left out.

    Raises InputError: not such an address.
    """
    example = "write it as ipp://printer.local/ipp/print or ipps://192.168.1.7:631/ipp/print"
    try:
        parts = urlsplit(text)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise InputError(f"{text!r} is no printer's address ({error}): {example}.") from error
    if parts.scheme not in SCHEMES or not host or any(c in text for c in " \r\n\t"):
        raise InputError(f"{text!r} is no printer's address: {example}.")
    if parts.username is not None or parts.query or parts.fragment:
        raise InputError(f"{text!r}: names, passwords and questions have no place in a printer's address; {example}.")
    path = parts.path if parts.path not in ("", "/") else "/ipp/print"
    return Address(parts.scheme, host, port or _PORT, path)


class Transport:
    """Sends requests to one printer."""

    def __init__(self, address: Address, timeout: float = 30.0) -> None:
        """`timeout`, s, is the longest silence that is borne; no connection is made yet."""
        self.address = address
        self._timeout = timeout

    def post(self, request: bytes, document: bytes = b"") -> bytes:
        """Send a request, with a document behind it, and return the printer's answer.

        Raises TransportError: no connection, a broken one, silence, or a fault of the printer's own (HTTP 5xx).
        PrinterError: the printer refused the request before it looked into it.
        """
        connection = self._connection()
        handed_over = False
        try:
            connection.putrequest("POST", self.address.path, skip_accept_encoding=True)
            connection.putheader("Content-Type", "application/ipp")
            connection.putheader("Content-Length", str(len(request) + len(document)))
            handed_over = _hand_over(connection, request, document)
            return self._answer(connection.getresponse(), handed_over)
        except TimeoutError as error:
            raise TransportError(
                f"{self.address.uri} has not answered for {self._timeout:g} s.", handed_over
            ) from error
        except (OSError, http.client.HTTPException) as error:
            raise TransportError(f"{self.address.uri} {_failure(error)}.", handed_over) from error
        finally:
            connection.close()

    def _connection(self) -> http.client.HTTPConnection:
        host, port = self.address.host, self.address.port
        if self.address.scheme == "ipp":
            return http.client.HTTPConnection(host, port, timeout=self._timeout)
        # a printer signs its own certificate, so that no authority can vouch for it: what it gives is secrecy
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        return http.client.HTTPSConnection(host, port, timeout=self._timeout, context=context)

    def _answer(self, response: http.client.HTTPResponse, handed_over: bool) -> bytes:
        if response.status != 200:
            phrase = {
                401: "asks for a name and a password, which cannot be given here",
                404: f"has no printer at {self.address.path}",
                426: "wants an encrypted connection: write the address with ipps://",
            }.get(response.status, f"answered with HTTP status {response.status} {response.reason}".rstrip())
            if response.status >= 500 or response.status in (_LATE, *_RETRYABLE):
                retryable = response.status in _RETRYABLE
                raise TransportError(
                    f"{self.address.uri} {phrase}.", handed_over, retryable=retryable, after=_read_pause(response)
                )
            raise PrinterError(f"{self.address.uri} {phrase}.")
        data = response.read(_MOST + 1)
        if len(data) > _MOST:
            raise TransportError(f"{self.address.uri} answered with more than {_MOST} bytes.", handed_over=True)
        return data


def _hand_over(connection: http.client.HTTPConnection, request: bytes, document: bytes) -> bool:
    """Send it all; whether all of it went: a printer that refuses may answer, and hang up, before it has the page."""
    connection.endheaders()
    try:
        for data in (request, document):
            for start in range(0, len(data), _PIECE):
                connection.send(data[start : start + _PIECE])
    except (BrokenPipeError, ConnectionResetError) as error:
        try:
            connection.sock.settimeout(1.0)
            # an answer that is there is worth more than the error; without one the error stands
            if not connection.sock.recv(1, socket.MSG_PEEK):
                raise error
        except OSError:
            raise error from None
        return False
    return True


def _read_pause(response: http.client.HTTPResponse) -> float | None:
    """How long the printer wants to be left alone, s: Retry-After is a number, or a time on the printer's own clock.

    Source: RFC 9110 §10.2.3.
    """
    wait, now = response.getheader("Retry-After", "").strip(), response.getheader("Date", "")
    if wait.isascii() and wait.isdigit():
        return float(wait)
    try:
        return max((parsedate_to_datetime(wait) - parsedate_to_datetime(now)).total_seconds(), 0.0)
    except (ValueError, TypeError):
        return None


def _failure(error: Exception) -> str:
    """Why a connection failed, as what the printer did."""
    if isinstance(error, socket.gaierror):
        return "is not known on this network"
    if isinstance(error, ConnectionRefusedError):
        return "takes no connections (is the printer on, and the port right?)"
    if isinstance(error, ssl.SSLError):
        return f"could not agree on an encrypted connection ({error.reason or 'unknown reason'})"
    if isinstance(error, (ConnectionError, http.client.HTTPException)):
        return "broke the connection"
    return f"cannot be reached ({getattr(error, 'strerror', None) or error})"
