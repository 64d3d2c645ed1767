"""The studio's application, and its start."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
from collections.abc import AsyncIterator, Callable, Collection, Mapping
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from handout import atomic
from handout.errors import InputError
from handout.web import calibration, hands, jobs, letters, phone, tasks, writing
from handout.web.guard import Guard
from handout.web.routes import FAULTS, Way, json_answer, openapi
from handout.web.studio import Studio
from handout.web.webhooks import tell_ended

TABLES = (tasks.ROUTES, writing.ROUTES, hands.ROUTES, letters.ROUTES, calibration.ROUTES, jobs.ROUTES, phone.ROUTES)
PORT = 7217  # that is tried first; no service is registered there (IANA).  Drafts belong to it, so it stays the same
_STATIC = Path(__file__).resolve().parent / "static"
_MOST_CONNECTIONS = 200  # at once; a browser opens six


async def _describe_api(studio: Studio, request: Request, body: None) -> Response:
    return json_answer(openapi(WAYS))


WAYS = (*(way for table in TABLES for way in table), Way("GET", "/api/openapi.json", "This description", _describe_api))


def application(studio: Studio, port: int) -> ASGIApp:
    """The application as it is served at a port."""

    @contextlib.asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        await studio.open()
        studio.run_beside(tell_ended(studio))
        try:
            yield
        finally:
            await studio.close()

    ways = [way.route() for way in WAYS]

    async def nothing(request: Request) -> Response:
        known = {method for way in ways if way.path_regex.match(request.url.path) for method in way.methods or ()}
        raise HTTPException(405 if known else 404, headers={"Allow": ", ".join(sorted(known))} if known else None)

    others = Route("/api/{path:path}", nothing, methods=["GET", "POST", "PUT", "PATCH", "DELETE"])
    routes = [*ways, others, Mount("/", StaticFiles(directory=_STATIC, html=True))]
    app = Starlette(routes=routes, lifespan=lifespan, exception_handlers=FAULTS)
    app.state.studio = studio
    return Guard(app, port, studio.knows_key)


def listening(port: int | None) -> socket.socket:
    """A socket that listens on this computer alone: at the port, or at the usual one or any that is free.

    Raises InputError: something else listens at the port that was asked for.
    """
    for number in (PORT, 0) if port is None else (port,):
        # with the protocol named, asyncio sends small answers at once; else each waits 40 ms to be joined by more
        one = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            one.bind(("127.0.0.1", number))
            one.listen()  # two studios that start at once may both bind a port, and one alone listens
            return one
        except OSError as error:
            one.close()
            if error.errno not in (errno.EADDRINUSE, errno.EACCES) or (port is None and number == 0):
                raise InputError(f"Cannot listen at 127.0.0.1:{number}: {error.strerror}.") from error
    raise InputError(f"Cannot listen at 127.0.0.1:{port}: another program does; give another --port.")


def serve(
    hands_: Mapping[str, Path],
    start: str,
    port: int | None,
    key_file: Path | None,
    opened: Callable[[dict[str, str]], None],
    styles_: Mapping[str, Path] = {},
    hosts: Collection[str] = (),
    phone_too: bool = False,
) -> None:
    """Serve the studio until it is interrupted.

    hands_ : name → .hand file of hands beside those that are known by name.
    styles_ : the same of handstyles.
    start : the page that the link opens; hosts : that webhooks may lead to, beside this computer.
    key_file : where a key for programs is kept meanwhile, readable for the user alone.
    opened : is told `link` once the server listens, and `phone`, the link of phones.
    phone_too : whether phones may send photographs at once, as by the page.
    """
    studio = Studio(hands_, start, styles_, frozenset(hosts))
    for_phones = phone.listening() if phone_too else None
    one = listening(port)
    number = int(one.getsockname()[1])
    if key_file is not None:
        atomic.write(key_file, b"")
        key_file.chmod(0o600)
        key_file.write_text(studio.new_key() + "\n", encoding="ascii")
    config = uvicorn.Config(
        application(studio, number),
        log_level="error",
        access_log=False,
        ws="none",
        server_header=False,
        limit_concurrency=_MOST_CONNECTIONS,
        timeout_graceful_shutdown=2,
    )
    server = uvicorn.Server(config)

    async def run_server() -> None:
        serving = asyncio.ensure_future(server.serve(sockets=[one]))
        while not server.started and not serving.done():
            await asyncio.sleep(0.01)
        if server.started:
            links = {"link": f"http://127.0.0.1:{number}/#{studio.token}"}
            if for_phones is not None:
                links["phone"] = (await phone.let_in(studio, for_phones)).live["link"]
            opened(links)
        await serving

    try:
        asyncio.run(run_server())
    finally:
        one.close()
        if key_file is not None:
            key_file.unlink(missing_ok=True)
