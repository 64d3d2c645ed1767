"""Photographs from a phone: a second server, on the local network, which takes them and does nothing else.

It is there only while the user wants it, and half an hour at most.  Its address holds a key of its own, made anew each
time; its Host has to be that very address; whatever else is asked for is not there.  It speaks plain http: of a
certificate that nobody vouches for phones warn as of an attack, and people would learn to press such warnings away.  So
who is in the network and listens there may see the photographs, which the page says.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import secrets
import socket
import time
from pathlib import Path, PurePath

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route
from starlette.types import Receive, Scope, Send

from handout.errors import InputError
from handout.web.guard import Allowance, count_body, with_headers
from handout.web.routes import FAULTS, Way, json_answer
from handout.web.studio import PICTURES, Studio
from handout.web.tasks import drop_upload, take_file
from handout.web.worker import Call
from handout.web.workers import Task

_PORT = 7218  # that is tried first, so that a firewall is asked once: the studio's and one
_MINUTES = 30
_MOST, _LARGEST = 20, 64 << 20  # photographs, as many as a hand is read from at once; bytes of each, own choice
_CONNECTIONS = 12  # at once; a phone opens six
_PAGE = {
    "": "phone.html",
    "phone.js": "phone.js",
    "dom.js": "dom.js",
    "studio.css": "studio.css",
    "icon.svg": "icon.svg",
}
_HEIC = (
    " On an iPhone: Settings, Camera, Formats, Most Compatible, and photograph it again; on others switch HEIC or "
    "HEIF off in the camera's settings."
)


def listening() -> socket.socket:
    """A socket that listens on this computer's address in the local network.

    Raises InputError: it is in none, or its address is one of the whole internet.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            asked.connect(("192.0.2.1", 9))  # an address of no one (RFC 5737): nothing is sent, only the way looked up
            address = str(asked.getsockname()[0])
        except OSError:
            raise InputError("This computer is in no network that a phone could be in, too: join a Wi-Fi.") from None
    if ipaddress.ip_address(address).is_global:
        raise InputError(f"{address} can be reached from the whole internet: photographs are not taken there.")
    for port in (_PORT, 0):
        with contextlib.suppress(OSError):
            return socket.create_server((address, port))
    raise InputError(f"Cannot listen at {address}: it does not let programs in.")


class PhoneDoor:
    """What a phone may ask for: a page, and that a photograph is taken.

    task : says what came, and while it runs that photographs may come.
    """

    def __init__(self, studio: Studio, host: str, task: Task) -> None:
        self._studio, self._task, self._host = studio, task, host.encode()
        self.key = secrets.token_urlsafe(16)
        self._phones: set[str] = set()
        self._digests: dict[str, str] = {}  # of a photograph → its upload
        # a page of four files, and a photograph every few seconds; set by hand
        self._members, self._strangers = Allowance(120, 4), Allowance(60, 1)
        routes = [
            Route("/{key}/photographs", self._take, methods=["POST"]),
            Route("/{key}/{name}", self._show),
            Route("/{key}/", self._show),
        ]
        self._app = Starlette(routes=routes, exception_handlers=FAULTS)
        self._app.router.redirect_slashes = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            await self._http(scope, count_body(receive, _LARGEST), with_headers(send))

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        hosts = [value for name, value in scope["headers"] if name == b"host"]
        origins = {value for name, value in scope["headers"] if name == b"origin"}
        key = scope["path"].split("/")[1] if scope["path"].startswith("/") else ""
        known = secrets.compare_digest(key.encode(), self.key.encode())
        valid = known and not self._task.has_ended  # a phone that is connected already may ask once more
        if not (valid and hosts == [self._host] and origins <= {b"http://" + self._host}):
            code, sentence = (404, "There is nothing here.") if self._strangers.take() else (429, "Wait.")
            await JSONResponse({"error": sentence}, code, {"Connection": "close"})(scope, receive, send)
        elif not self._members.take():
            answer = JSONResponse({"error": "Too much at once: wait some seconds."}, 429, {"Connection": "close"})
            await answer(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _show(self, request: Request) -> Response:
        """A file of the page; who asks for the page itself is counted as a phone."""
        name = request.path_params.get("name", "")
        if name not in _PAGE:
            raise HTTPException(404)
        if not name and request.client is not None:
            self._phones.add(request.client.host)
            self._tell()
        return FileResponse(Path(__file__).parent / "static" / _PAGE[name])

    def _tell(self, *more: str) -> None:
        """Have the studio's page know what came, and from how many phones."""
        keys = [*(one["id"] for one in self._task.live["photographs"]), *more]
        there = [{"id": key, "name": self._studio.uploads[key].name} for key in keys if key in self._studio.uploads]
        self._task.change(live={**self._task.live, "photographs": there, "phones": len(self._phones)})

    async def _take(self, request: Request) -> Response:
        """A photograph is taken in, if it can be read; one that was sent before is there once."""
        self._tell()
        try:
            if len(self._task.live["photographs"]) >= _MOST:
                raise HTTPException(409, f"{_MOST} photographs wait at the computer: read them there first.")
            key = await take_file(self._studio, request, (*PICTURES, ".heic", ".heif"), kept=True)
        except HTTPException as error:
            if error.status_code in (409, 422):
                async for _ in request.stream():  # a phone that is cut off while it sends does not hear why
                    pass
            raise
        sent = self._studio.uploads[key]
        try:
            facts = await self._studio.answer("looking at a photograph", Call("photographs.look_at", (sent.path,)))
            if self._task.has_ended:
                raise HTTPException(410, "It was switched off at the computer: scan the code that is there now.")
        except BaseException as error:
            drop_upload(self._studio, key)
            if isinstance(error, HTTPException) and "HEI" in error.detail:
                raise HTTPException(422, error.detail + _HEIC) from None
            raise
        before = self._digests.get(facts["digest"])
        if before in self._studio.uploads:
            drop_upload(self._studio, key)
            return json_answer({"name": self._studio.uploads[before].name, "again": True})
        names = {upload.name for other, upload in self._studio.uploads.items() if other != key}
        stem, suffix = PurePath(sent.name).stem, sent.path.suffix
        numbered = (f"{stem}-{number}{suffix}" for number in range(2, 100))  # phones call all of them image.jpg
        sent.name = next(name for name in (sent.name, *numbered) if name not in names)
        sent.small = facts["small"]
        self._digests[facts["digest"]] = key
        self._tell(key)
        return json_answer({"name": sent.name, "again": False})


class _Server(uvicorn.Server):
    """A server beside another: signals are for that one."""

    capture_signals = contextlib.nullcontext  # type: ignore[assignment]


async def let_in(studio: Studio, one: socket.socket) -> Task:
    """Take photographs at a socket: a task, which runs as long."""
    host = "{}:{}".format(*one.getsockname())
    task = Task("photographs from a phone", Call("photographs.draw_code"), state="running")
    door = PhoneDoor(studio, host, task)
    link = f"http://{host}/{door.key}/"
    code = await studio.answer("drawing a code", Call("photographs.draw_code", (link,)))
    until = round(time.time() + 60 * _MINUTES)
    task.live = {"link": link, "code": code, "until": until, "photographs": [], "phones": 0}
    studio.tasks[task.id] = studio.phone = task
    config = uvicorn.Config(
        door, log_level="error", access_log=False, ws="none", lifespan="off", server_header=False,
        limit_concurrency=_CONNECTIONS, timeout_graceful_shutdown=2,
    )  # fmt: skip
    studio.run_beside(_serve_phones(_Server(config), one, task))
    return task


async def _serve_phones(server: uvicorn.Server, one: socket.socket, task: Task) -> None:
    """Until the task ends, or its time is over."""
    serving = asyncio.ensure_future(server.serve(sockets=[one]))
    try:
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(task.wait(), 60 * _MINUTES)
        if not task.has_ended:
            task.change(state="done", share=1.0)
        server.should_exit = True
        await serving
    finally:
        serving.cancel()
        one.close()


async def switch_on(studio: Studio, request: Request, body: None) -> Response:
    """Photographs may come, at an address of their own; where they may already, that one is told."""
    if studio.phone is None or studio.phone.has_ended:
        try:
            one = listening()
        except InputError as error:
            raise HTTPException(422, str(error)) from None
        await let_in(studio, one)
    return await show(studio, request, None)


async def show(studio: Studio, request: Request, body: None) -> Response:
    """What came, as far as it is still there."""
    if (task := studio.phone) is None:
        return json_answer({"task": None})
    there = [one for one in task.live["photographs"] if one["id"] in studio.uploads]
    task.live = {**task.live, "photographs": there}
    return json_answer({"task": task.snapshot()})


async def small_picture(studio: Studio, request: Request, body: None) -> Response:
    """A small picture of a photograph."""
    sent = studio.uploads.get(request.path_params["id"])
    if sent is None or not sent.small:
        raise HTTPException(404, "There is no picture of that.")
    return Response(sent.small, media_type="image/jpeg")


ROUTES = (
    Way("POST", "/api/phone", "Let phones on the local network send photographs, for half an hour: `task` says at "
        "which address and what came, and is cancelled to end it", switch_on),
    Way("GET", "/api/phone", "The same without letting any; `task` is null where none ever was", show),
    Way("GET", "/api/uploads/{id}/picture", "A small picture of a photograph that a phone sent", small_picture,
        answer="image/jpeg"),
)  # fmt: skip
