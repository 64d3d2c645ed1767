"""The HTTP side of the simulated IPP printer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler
from typing import Protocol

from handout.errors import PrinterError
from handout.printing.ipp.message import Message, decode, encode

_HEAD = 8192  # bytes; the attributes of a print request are shorter


@dataclass(frozen=True)
class Broken:
    """What is answered beside IPP: an HTTP status with further headers, or a body that is no IPP."""

    status: int
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b""


class Device(Protocol):
    """What requests are handed to."""

    def break_now(self, request: Message) -> Callable[[int], int] | None:
        """Whether the connection is to break: bytes announced → bytes still read."""
        ...

    def torn(self, request: Message, document: bytes) -> None:
        """The connection broke in the middle of a document."""
        ...

    def answer(self, request: Message, document: bytes) -> Message | Broken | None:
        """What it says; None if the connection breaks instead."""
        ...


class _Handler(BaseHTTPRequestHandler):
    """One connection."""

    device: Device
    device_path: str
    protocol_version = "HTTP/1.1"

    def do_POST(self) -> None:
        """One request, with or without a document."""
        if self.path != self.device_path or self.headers.get("Content-Type") != "application/ipp":
            self.send_error(404)
            return
        try:
            answer = self._answer(int(self.headers.get("Content-Length", "0")))
        except (PrinterError, ValueError):
            self.send_error(400)
            return
        if answer is None:
            self.close_connection = True
            return
        broken = answer if isinstance(answer, Broken) else Broken(200)
        body = broken.body if isinstance(answer, Broken) else encode(answer)
        self.send_response(broken.status)
        for name, value in broken.headers.items():
            self.send_header(name, value)
        self.send_header("Content-Type", "application/ipp")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def _answer(self, length: int) -> Message | Broken | None:
        """The device's answer; attributes come first, so that it is known whether the rest is going to be lost."""
        data = self.rfile.read(min(length, _HEAD))
        request, start = decode(data)
        cut = self.device.break_now(request)
        data += self.rfile.read(max((cut(length) if cut else length) - len(data), 0))
        if len(data) < length:
            self.device.torn(request, data[start:])
            return None
        return self.device.answer(request, data[start:])

    def log_message(self, format: str, *arguments: object) -> None:
        """Keep quiet."""


def handler(device: Device, path: str) -> type[BaseHTTPRequestHandler]:
    """A request handler for `device`, which is found at `path`."""
    return type("Handler", (_Handler,), {"device": device, "device_path": path})
