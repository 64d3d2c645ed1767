"""Who is let in, and what every answer says.

A page of another site may send requests to this server, and a name of its own may be made to lead here (DNS
rebinding).  So the Host has to be this very address, an Origin that is named has to be this page's, and what is under
/api needs a session's key in the header Authorization, which no browser sends by itself: there are no cookies.  Bodies
are counted while they come in; too many requests, with a key, without one, or for the pages themselves, are refused
each from an allowance of its own, so that who guesses keys does not lock out the user.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

OPEN = frozenset({"/api/session", "/api/openapi.json"})  # routes under /api that need no session
# bytes of a body, and of a scan: A4 at 600 dpi, not compressed, has 104 MB
BODY, UPLOAD = 1 << 20, 128 << 20
_SLOW = 60.0  # s without a byte of a body that is not yet whole, then it is given up
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
    "connect-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


@dataclass
class Allowance:
    """So many requests at once, and so many a second on end (a token bucket); clock : seconds."""

    most: float
    rate: float
    clock: Callable[[], float] = time.monotonic
    left: float = field(init=False)
    _seen: float = field(init=False)

    def __post_init__(self) -> None:
        self.left, self._seen = self.most, self.clock()

    def take(self) -> bool:
        """Whether there is one left, which is taken."""
        now = self.clock()
        self.left = min(self.most, self.left + (now - self._seen) * self.rate)
        self._seen = now
        if self.left < 1:
            return False
        self.left -= 1
        return True


class Guard:
    """The application behind its checks.

    port : it listens there.
    known : whether a key is that of a session.
    """

    def __init__(self, app: ASGIApp, port: int, known: Callable[[str], bool]) -> None:
        self._app, self._known = app, known
        names = [f"127.0.0.1:{port}", f"localhost:{port}"]
        self._hosts = {name.encode() for name in names}
        self._origins = {f"http://{name}".encode() for name in names}
        # a page that is typed into asks a few times a second, a page of tiles some hundred at once, a target that is
        # dragged once for each picture of a screen, 60 a second, a page that is loaded anew a dozen times; set by hand
        self._members, self._strangers, self._files = Allowance(600, 75), Allowance(120, 2), Allowance(600, 75)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
        elif scope["type"] == "http":
            await self._http(scope, receive, with_headers(send))

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        refusal = self._refusal(scope)
        if refusal is None:
            limit = UPLOAD if scope["path"] == "/api/uploads" else BODY
            await self._app(scope, count_body(receive, limit), send)
            return
        code, sentence = refusal
        headers = {"Retry-After": "10"} if code == 429 else {"WWW-Authenticate": "Bearer"} if code == 401 else {}
        await JSONResponse({"error": sentence}, code, {**headers, "Connection": "close"})(scope, receive, send)

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Why a request is not let in, if it is not."""
        headers: dict[bytes, list[bytes]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name, []).append(value)
        sentence = ""
        if headers.get(b"host", []) not in [[host] for host in self._hosts]:
            sentence = "This server answers to 127.0.0.1 and localhost alone."
        elif not set(headers.get(b"origin", [])) <= self._origins or (
            scope["path"].startswith("/api/") and headers.get(b"sec-fetch-site", [b"none"])[0] not in _OURS
        ):
            sentence = "That page is not the studio's."
        if sentence:
            return (403, sentence) if self._strangers.take() else _MANY
        key = headers.get(b"authorization", [b""])[0].decode("latin-1").removeprefix("Bearer ")
        return self._refuse(scope["path"], key)

    def _refuse(self, path: str, key: str) -> tuple[int, str] | None:
        """The same by the key alone, of a request of the studio's pages."""
        own = not path.startswith("/api/")  # the pages themselves, which hold no secret
        known = not own and self._known(key)
        if not (self._files if own else self._members if known else self._strangers).take():
            return _MANY
        if own or known or path in OPEN:
            return None
        return 401, "This needs a session: open the link that `handout studio` printed."


_OURS = (b"same-origin", b"none")
_MANY = 429, "Too many requests: wait some seconds."


def with_headers(send: Send) -> Send:
    """`send`, whose answers also say what a browser may do with them."""

    async def send_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            there = {name.lower() for name, _ in message["headers"]}
            more = [(name.lower().encode(), value.encode()) for name, value in _HEADERS.items()]
            message = {**message, "headers": [*message["headers"], *(pair for pair in more if pair[0] not in there)]}
        await send(message)

    return send_headers


def count_body(receive: Receive, limit: int) -> Receive:
    """The parts of a body, as far as they are not more than `limit` bytes and do not take for ever."""
    count, whole = 0, False

    async def receive_part() -> Message:
        nonlocal count, whole
        try:
            message = await receive() if whole else await asyncio.wait_for(receive(), _SLOW)
        except TimeoutError:
            raise HTTPException(408, "The request did not come in whole.") from None
        count += len(message.get("body", b""))
        whole = whole or not message.get("more_body", False)
        if count > limit:
            raise HTTPException(413, f"That is larger than {limit >> 20} MB.", {"Connection": "close"})
        return message

    return receive_part
