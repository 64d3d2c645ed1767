"""Routes of batches: a table and its letter, their proof, what became of the rows."""

from __future__ import annotations

import re
import shutil

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from handout.web.calls import Approval, MadeBatch, NewBatch
from handout.web.hands import beside, sent
from handout.web.routes import Way, json_answer
from handout.web.studio import TABLES, Studio
from handout.web.tasks import TYPES, followed
from handout.web.worker import Call

_BATCH = re.compile(r"[a-z]{3}\d\d-\d{1,5}")
_FILE = re.compile(r"(proof|batch)\.pdf|proof-\d{1,6}\.png")


def _name(request: Request) -> str:
    name = str(request.path_params["name"])
    if not _BATCH.fullmatch(name):
        raise HTTPException(404, "There is no such batch.")
    return name


def _made(studio: Studio) -> dict[str, str]:
    """Name of a batch that is made now → its task."""
    running = [task for task in studio.attended.values() if not task.ended]
    return {task.kind.removeprefix("batch "): task.id for task in running if task.kind.startswith("batch ")}


async def _asked(studio: Studio, request: Request, function: str, *arguments: str) -> Response:
    name = _name(request)
    facts = await studio.answer("a batch", Call(f"batch_desk.{function}", (name, *arguments)), studio.long)
    return json_answer({**facts, "task": _made(studio).get(name)})


def _idle(studio: Studio, name: str) -> None:
    if name in _made(studio):
        raise HTTPException(409, f"The batch {name} is being made: wait, or stop it first.")


async def batches(studio: Studio, request: Request, body: None) -> Response:
    """The batches that are kept."""
    found = await studio.answer("listing batches", Call("batch_desk.batches"))
    return json_answer({"batches": found, "made": _made(studio)})


async def keep(studio: Studio, request: Request, body: NewBatch) -> Response:
    """A batch is kept."""
    table = None if body.table is None else sent(studio, body.table, *TABLES)
    name = "a text" if body.table is None else studio.uploads[body.table].name
    folder = studio.folder()
    wanted = table, body.text, body.letter, body.plan(studio.hand(body.hand), name)
    call = Call("batch_desk.keep_batch", (*wanted, beside(studio, body.pictures, folder)))
    try:
        return json_answer(await studio.answer("keeping a batch", call, studio.long))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


async def show(studio: Studio, request: Request, body: None) -> Response:
    """A batch with its rows."""
    return await _asked(studio, request, "show_batch")


async def prove(studio: Studio, request: Request, body: None) -> Response:
    """The proof of a batch is made."""
    _idle(studio, name := _name(request))
    call = Call("batch_desk.prove_batch", (name,), listens=True)
    return await followed(request, studio.begin(studio.long, f"proof of {name}", call))


async def approve(studio: Studio, request: Request, body: Approval) -> Response:
    """The proof of a batch is approved."""
    return await _asked(studio, request, "approve_batch", body.made)


async def make(studio: Studio, request: Request, body: MadeBatch) -> Response:
    """A batch is printed or plotted, or gone on with."""
    _idle(studio, name := _name(request))
    call = Call("batch_desk.make_batch", (name, body.ports, body.at_zero), listens=True, moves=True)
    return await followed(request, await studio.attend(body.ports, f"batch {name}", call))


async def file(studio: Studio, request: Request, body: None) -> Response:
    """The proof, a picture of it, or what was made."""
    wanted = str(request.path_params["file"])
    if not _FILE.fullmatch(wanted):
        raise HTTPException(404, "A batch has no such file.")
    path = await studio.answer("a file of a batch", Call("batch_desk.batch_file", (_name(request), wanted)))
    return FileResponse(path, media_type=TYPES[f".{wanted.rpartition('.')[2]}"], filename=wanted)


async def forget(studio: Studio, request: Request, body: None) -> Response:
    """A batch is deleted."""
    _idle(studio, name := _name(request))
    return json_answer({"deleted": await studio.answer("deleting a batch", Call("batch_desk.forget_batch", (name,)))})


_ONE = "/api/batches/{name}"
ROUTES = (
    Way("GET", "/api/batches", "The batches that are kept, newest first; of those that are made now, tasks", batches),
    Way("POST", "/api/batches", "Keep a table with its letter, with gaps as {{ first_name }}; a text without a table",
        keep, body=NewBatch),
    Way("GET", _ONE, "A batch: its rows, what its proof says of them, and what its journal says became of them", show),
    Way("POST", f"{_ONE}/proof", "Make the proof of a batch: every page, small, and what to look at", prove),
    Way("POST", f"{_ONE}/approval", "Approve the proof: what is made then is what was looked at, or nothing", approve,
        body=Approval),
    Way("POST", f"{_ONE}/make", "Print or plot it, or go on where its journal says; each page once", make,
        body=MadeBatch),
    Way("GET", f"{_ONE}/files/{{file}}", "proof.pdf, a picture of it by its name, or the batch.pdf that was made", file,
        answer="application/pdf"),
    Way("DELETE", _ONE, "Delete it; its journal stays", forget),
)  # fmt: skip
