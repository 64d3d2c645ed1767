"""Routes of sessions, uploads and tasks: what every page needs."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import secrets
import shutil
from collections.abc import AsyncIterator, Sequence
from pathlib import Path, PurePath

from msgspec import DecodeError, Raw
from msgspec.json import decode
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse

from handout import atomic, shipped
from handout.errors import InputError
from handout.web.calls import Draft, Login
from handout.web.routes import Way, json_answer
from handout.web.studio import SUFFIXES, Studio, Upload, raise_refused
from handout.web.workers import Task

TYPES = {
    ".svg": "image/svg+xml", ".png": "image/png", ".pdf": "application/pdf", ".inkml": "application/inkml+xml",
    ".eps": "application/postscript", ".dxf": "image/vnd.dxf",
    ".json": "application/json", ".hand": "application/zip", ".toml": "application/toml", ".jpg": "image/jpeg",
}  # fmt: skip
DRAFTS = (
    "draft",
    "style",
    "texts",
    "batch",
    "own",
)  # Write, Style, what is on scans, a table's letter, steps to a hand
# by suffix: how what many people have becomes a file that is read
_WAYS_OUT = {
    **dict.fromkeys((".heic", ".heif", ".avif"), "save the photograph as JPEG"),
    **dict.fromkeys((".xls", ".ods", ".numbers"), "save the table as Excel (.xlsx) or CSV"),
}
_ALIVE = 15.0  # s after which a stream of events says that it is still there
_LOOK = 0.25  # s between two looks whether who asked is still there


async def kept_draft(studio: Studio, request: Request, body: None) -> Response:
    """What was last written on a page."""
    try:
        return json_answer({"draft": Raw(await asyncio.to_thread(_draft(request).read_bytes))})
    except OSError:
        return json_answer({"draft": None})


async def keep_draft(studio: Studio, request: Request, body: Draft) -> Response:
    """What is written on a page is kept on the disk."""
    path = _draft(request)
    with contextlib.suppress(OSError, DecodeError):
        there, new = decode(await asyncio.to_thread(path.read_bytes)), decode(body.draft)
        if not isinstance(there, dict) or not isinstance(new, dict):
            pass  # a program's, not a page's
        elif {**there, "kept_at": 0} == {**new, "kept_at": 0}:
            return json_answer({})
        elif body.since is not None and there.get("kept_at", 0) > body.since:
            raise HTTPException(409, "Another browser changed this since: load the page anew to go on from there.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        await asyncio.to_thread(atomic.write, path, bytes(body.draft))
    except (OSError, InputError) as error:
        why = getattr(error, "strerror", None) or str(error).rpartition(": ")[2].rstrip(".")
        raise HTTPException(507, f"What you do here is kept in this browser alone, not on the disk: {why}.") from None
    return json_answer({})


def _draft(request: Request) -> Path:
    name = str(request.path_params["name"])
    if name not in DRAFTS:
        raise HTTPException(404, f"There are drafts called {', '.join(DRAFTS)}.")
    return shipped.own_folder("state") / f"studio-{name}.json"


async def log_in(studio: Studio, request: Request, body: Login) -> Response:
    """The token of the link becomes a session, once."""
    key = studio.exchange(body.token)
    if key is None:
        raise HTTPException(401, "This link was used already, or is of an earlier run: start `handout studio` again.")
    return json_answer({"key": key, "start": studio.start})


async def new_key(studio: Studio, request: Request, body: None) -> Response:
    """A key for a program."""
    return json_answer({"key": studio.new_key()})


async def upload(studio: Studio, request: Request, body: None) -> Response:
    """A file is taken in."""
    key = await take_file(studio, request, SUFFIXES, request.query_params.get("kept") == "true")
    return json_answer({"id": key, "name": studio.uploads[key].name, "bytes": studio.uploads[key].size})


async def uploads(studio: Studio, request: Request, body: None) -> Response:
    """What was sent and is still here."""
    there = {key: sent.name for key, sent in studio.uploads.items() if sent.path.exists()}
    return json_answer({"uploads": [{"id": key, "name": name} for key, name in there.items()]})


async def sent_file(studio: Studio, request: Request, body: None) -> Response:
    """A file that was sent, as it was."""
    sent = studio.uploads.get(request.path_params["id"])
    if sent is None or not sent.path.exists():
        raise HTTPException(404, "That file is not here any more.")
    return FileResponse(sent.path, media_type="application/octet-stream", content_disposition_type="attachment")


async def take_file(studio: Studio, request: Request, suffixes: Sequence[str], kept: bool = False) -> str:
    """The key of an upload, which is taken in part by part; kept : it is there in the next studio, too.

    Raises HTTPException: 422: its name has none of the suffixes; 507: there is no room.
    """
    name = PurePath(request.query_params.get("name", "").replace("\\", "/")).name[-100:]
    suffix = PurePath(name).suffix.lower()
    if suffix not in suffixes:
        way_out = _WAYS_OUT.get(suffix, f"taken are those that end in {', '.join(suffixes)}")
        raise HTTPException(422, f"{name or 'A file without a name'} is no file that can be read here: {way_out}.")
    studio.room(0)
    # by letters, digits and hyphens the scan is called in a hand, and in sentences
    stem = re.sub("[^A-Za-z0-9]+", "-", PurePath(name).stem)[:40].strip("-") or "scan"
    key, size = secrets.token_urlsafe(16), 0
    path = (studio.kept / key if kept else studio.folder()) / f"{stem}{suffix}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            async for part in request.stream():
                studio.room(size := size + len(part))
                await asyncio.to_thread(file.write, part)
        if kept:  # from here on
            atomic.write(path.with_name("name"), name.encode())
    except OSError as error:
        shutil.rmtree(path.parent, ignore_errors=True)
        raise HTTPException(507, f"The file cannot be kept: {error.strerror or error}.") from None
    except BaseException:
        shutil.rmtree(path.parent, ignore_errors=True)
        raise
    studio.uploads[key] = Upload(path, name, size)
    return key


async def take_away(studio: Studio, request: Request, body: None) -> Response:
    """An upload is deleted."""
    drop_upload(studio, request.path_params["id"])
    return json_answer({})


def drop_upload(studio: Studio, key: str) -> None:
    """Delete an upload, if it is there."""
    if (gone := studio.uploads.pop(key, None)) is not None:
        shutil.rmtree(gone.path.parent, ignore_errors=True)


def task_of(studio: Studio, request: Request) -> Task:
    """The task that a request is about."""
    task = studio.tasks.get(request.path_params["id"])
    if task is None:
        raise HTTPException(404, "There is no such task, or it ended long ago.")
    return task


async def show(studio: Studio, request: Request, body: None) -> Response:
    """How far a task has come."""
    return json_answer(task_of(studio, request).snapshot())


async def cancel(studio: Studio, request: Request, body: None) -> Response:
    """A task is no longer wanted."""
    task = task_of(studio, request)
    if not task.has_ended:
        task.change(state="cancelled")
    return json_answer(task.snapshot())


async def events(studio: Studio, request: Request, body: None) -> Response:
    """A task's snapshots as they come."""
    return StreamingResponse(_stream(task_of(studio, request)), media_type="text/event-stream")


async def _stream(task: Task) -> AsyncIterator[str]:
    snapshots = task.follow()
    coming = asyncio.ensure_future(anext(snapshots))
    try:
        while True:
            done, _ = await asyncio.wait({coming}, timeout=_ALIVE)
            if not done:
                yield ": still there\n\n"
                continue
            try:
                yield f"data: {json.dumps(coming.result(), ensure_ascii=False)}\n\n"
            except StopAsyncIteration:
                return
            coming = asyncio.ensure_future(anext(snapshots))
    finally:
        coming.cancel()


async def file(studio: Studio, request: Request, body: None) -> Response:
    """A file that a task made, by its number from 0."""
    return file_answer(task_of(studio, request), int(request.path_params["number"]))


def file_answer(task: Task, number: int = 0) -> Response:
    """A file of a task as an answer."""
    raise_refused(task)
    paths = task.files
    if not 0 <= number < len(paths):
        raise HTTPException(404, f"The task has no file {number}.")
    path = paths[number]
    kind = TYPES.get(path.suffix, "application/octet-stream")
    return FileResponse(path, media_type=kind, filename=path.name, content_disposition_type="attachment")


async def follow_task(request: Request, task: Task, wanted: str = "") -> Response:
    """What becomes of a task: at once its number where the request prefers that, else when it has ended.

    Who goes away before that cancels it.  wanted : a media type; a request that accepts it gets the first file itself.
    """
    if "respond-async" in request.headers.get("prefer", ""):
        return json_answer(task.snapshot(), 202)
    while not task.has_ended:
        waiting = asyncio.ensure_future(task.wait())
        await asyncio.wait({waiting}, timeout=_LOOK)
        waiting.cancel()
        if not task.has_ended and await request.is_disconnected():
            task.change(state="cancelled")
    raise_refused(task)
    if wanted and wanted in request.headers.get("accept", ""):
        return file_answer(task)
    return json_answer(task.snapshot())


ROUTES = (
    Way("POST", "/api/session", "The token of the link for the key of a session, once", log_in, body=Login),
    Way("POST", "/api/keys", "A key for a program, which lasts as long as the server", new_key),
    Way("GET", "/api/drafts/{name}", "What was last written on Write (draft), bent on Style (style), typed of scans "
        "(texts) or as the letter of a batch (batch)", kept_draft),
    Way("PUT", "/api/drafts/{name}", "Keep it, for whoever opens the page next", keep_draft, body=Draft),
    Way("POST", "/api/uploads", "A scan, a photograph or a .hand file; up to 128 MB", upload, body=bytes,
        query=(("name", "the file's name, whose suffix says what it is"),
               ("kept", "true: it is there when the studio is started anew, for a month"))),
    Way("GET", "/api/uploads", "What was sent and is still here", uploads),
    Way("GET", "/api/uploads/{id}", "A file that was sent", sent_file, answer="*/*"),
    Way("DELETE", "/api/uploads/{id}", "Delete an upload", take_away),
    Way("GET", "/api/tasks/{id}", "How far a task has come", show),
    Way("DELETE", "/api/tasks/{id}", "Cancel a task", cancel),
    Way("GET", "/api/tasks/{id}/events", "The same as a stream of events, until it has ended", events,
        answer="text/event-stream"),
    Way("GET", "/api/tasks/{id}/files/{number:int}", "A file that it made, from 0", file,
        answer="*/*"),
)  # fmt: skip
