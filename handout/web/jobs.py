"""Routes of what is kept: plots, and batches of a table's rows; machines, and the pen moved by hand."""

from __future__ import annotations

import re
import shutil
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from handout.web.calls import (
    Approval,
    AskedPort,
    DrawnPlot,
    EditedRow,
    MadeBatch,
    NewBatch,
    NewPlot,
    PenMoveBody,
    Said,
    SheetOnBed,
    TriedBatch,
    TurnedPens,
)
from handout.web.hands import find_upload, put_beside
from handout.web.routes import Handle, Way, json_answer
from handout.web.studio import TABLES, Studio
from handout.web.tasks import TYPES, follow_task, task_of
from handout.web.webhooks import check_address, tell_ended
from handout.web.worker import Call

_KEPT = re.compile(r"[a-z]{3}\d\d-\d{1,5}")  # as `plotting.jobs.store` calls plots, and batches, too
_FILE = re.compile(r"(proof|batch)\.pdf|proof-\d{1,6}\.png")


def _name(request: Request, kind: str) -> str:
    """The plot or the batch that a request is about."""
    name = str(request.path_params["name"])
    if not _KEPT.fullmatch(name):
        raise HTTPException(404, f"There is no such {kind}.")
    return name


def _at_work(studio: Studio, kind: str) -> dict[str, str]:
    """Name of a plot or a batch that machines make now → its task."""
    running = [task for task in studio.attended.values() if not task.has_ended]
    return {task.kind.removeprefix(f"{kind} "): task.id for task in running if task.kind.startswith(f"{kind} ")}


def _idle(studio: Studio, request: Request, kind: str, way_out: str = ": wait, or stop it first") -> str:
    """The same as `_name`; HTTPException while it is made."""
    if (name := _name(request, kind)) in _at_work(studio, kind):
        raise HTTPException(409, f"The {kind} {name} is being {'drawn' if kind == 'plot' else 'made'}{way_out}.")
    return name


def _list_kept(kind: str, function: str, made: str) -> Handle:
    """What is kept, the newest first, and the tasks of what is made now, as `made`."""

    async def answer(studio: Studio, request: Request, body: None) -> Response:
        facts = await studio.answer(f"listing what is kept: {kind}", Call(function, listens=True))
        return json_answer({**facts, made: _at_work(studio, kind)})

    return answer


def _show_one(kind: str, function: str) -> Handle:
    """What a function says of a plot or a batch, with the task that makes it now."""

    async def answer(studio: Studio, request: Request, body: Any) -> Response:
        name = _name(request, kind)
        more = () if body is None else (body.made, body.left_out)
        lane = studio.quick if kind == "plot" else studio.long
        facts = await studio.answer(f"a {kind}", Call(function, (name, *more)), lane)
        return json_answer({**facts, "task": _at_work(studio, kind).get(name)})

    return answer


def _forget_one(kind: str, function: str) -> Handle:
    """It is deleted, unless it is made now."""

    async def answer(studio: Studio, request: Request, body: None) -> Response:
        name = _idle(studio, request, kind, ": stop it first" if kind == "plot" else ": wait, or stop it first")
        return json_answer({"deleted": await studio.answer(f"deleting a {kind}", Call(function, (name,)))})

    return answer


async def machines(studio: Studio, request: Request, body: None) -> Response:
    """Ports, plotters, print queues and printers."""
    return json_answer(await studio.answer("looking for machines", Call("plot_desk.machines"), studio.long))


async def ask_machine(studio: Studio, request: Request, body: AskedPort) -> Response:
    """Who answers at a port."""
    call = Call("plot_desk.who_answers", (body.port,), moves=True)
    return await follow_task(request, await studio.attend((body.port,), "asking who is there", call))


async def move(studio: Studio, request: Request, body: PenMoveBody) -> Response:
    """The pen is moved by hand."""
    call = Call("plot_desk.move_pen", (body.port, body.device, body.move, body.x, body.y), listens=True, moves=True)
    return await follow_task(request, await studio.attend((body.port,), "moving the pen", call))


async def keep_plot(studio: Studio, request: Request, body: NewPlot) -> Response:
    """A text is kept as a plot."""
    pictures = put_beside(studio, body.pictures, folder := studio.folder())
    wanted = body.text, body.letter, body.request(studio.hand(body.hand)), pictures
    call = Call("plot_desk.keep_plot", wanted, listens=True)
    return await follow_task(request, studio.begin(studio.long, "a plot", call, folder))


async def page(studio: Studio, request: Request, body: None) -> Response:
    """A page of a plot."""
    call = Call("plot_desk.plot_page", (_name(request, "plot"), int(request.path_params["page"])))
    return Response(await studio.answer("a page of a plot", call), media_type="image/svg+xml")


async def lay(studio: Studio, request: Request, body: SheetOnBed) -> Response:
    """The sheets of a plot are laid otherwise."""
    call = Call("plot_desk.lay_sheet", (_idle(studio, request, "plot"), body.quarters, body.x, body.y))
    return json_answer(await studio.answer("a sheet", call))


async def turn(studio: Studio, request: Request, body: TurnedPens) -> Response:
    """What draws the layers of a plot is said."""
    call = Call("plot_desk.turn_pens", (_idle(studio, request, "plot"), body.pens))
    return json_answer(await studio.answer("pens", call))


async def draw(studio: Studio, request: Request, body: DrawnPlot) -> Response:
    """A plot is drawn, or what is left of it."""
    name = _idle(studio, request, "plot", "")
    call = Call("plot_desk.draw_plot", (name, body.port, body.at_zero, body.home_after), listens=True, moves=True)
    return await follow_task(request, await studio.attend((body.port,), f"plot {name}", call))


async def say(studio: Studio, request: Request, body: Said) -> Response:
    """Something is said to work that goes on."""
    task = task_of(studio, request)
    if task.state != "running":
        raise HTTPException(409, "It is not being done.")
    task.tell(body.word)
    return json_answer(task.snapshot())


async def try_batch(studio: Studio, request: Request, body: TriedBatch) -> Response:
    """A table and its letter are looked at."""
    if body.table is None:
        raise HTTPException(422, "table: this names an upload.")
    table = find_upload(studio, body.table, *TABLES)
    wanted = table, body.text, body.letter, body.plan(studio.hand(body.hand), ""), body.row
    return json_answer(await studio.answer("looking at a table", Call("batch_trial.try_table", wanted), studio.long))


async def keep_batch(studio: Studio, request: Request, body: NewBatch) -> Response:
    """A batch is kept."""
    if body.webhook is not None and (why := check_address(body.webhook.url, studio.hosts)):
        raise HTTPException(422, f"webhook: {why}")
    table = None if body.table is None else find_upload(studio, body.table, *TABLES)
    name = "a text" if body.table is None else studio.uploads[body.table].name
    folder = studio.folder()
    wanted = table, body.text, body.letter, body.plan(studio.hand(body.hand), name)
    call = Call("batch_desk.keep_batch", (*wanted, put_beside(studio, body.pictures, folder)))
    try:
        return json_answer(await studio.answer("keeping a batch", call, studio.long))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


async def edit(studio: Studio, request: Request, body: EditedRow) -> Response:
    """Cells of a row are changed."""
    which = _idle(studio, request, "batch"), int(request.path_params["row"])
    call = Call("batch_desk.edit_row", (*which, body.cells, body.was))
    return json_answer(await studio.answer("a row", call, studio.long))


async def prove(studio: Studio, request: Request, body: None) -> Response:
    """The proof of a batch is made."""
    name = _idle(studio, request, "batch")
    call = Call("batch_desk.prove_batch", (name,), listens=True)
    return await follow_task(request, studio.begin(studio.long, f"proof of {name}", call))


async def make(studio: Studio, request: Request, body: MadeBatch) -> Response:
    """A batch is printed or plotted, or gone on with."""
    name = _idle(studio, request, "batch")
    call = Call("batch_desk.make_batch", (name, body.ports, body.at_zero), listens=True, moves=True)
    task = await studio.attend(body.ports, f"batch {name}", call)
    studio.run_beside(tell_ended(studio, name, task))
    return await follow_task(request, task)


async def file(studio: Studio, request: Request, body: None) -> Response:
    """The proof, a picture of it, or what was made."""
    wanted = str(request.path_params["file"])
    if not _FILE.fullmatch(wanted):
        raise HTTPException(404, "A batch has no such file.")
    path = await studio.answer("a file of a batch", Call("batch_desk.batch_file", (_name(request, "batch"), wanted)))
    return FileResponse(path, media_type=TYPES[f".{wanted.rpartition('.')[2]}"], filename=wanted)


_PLOT, _BATCH = "/api/plots/{name}", "/api/batches/{name}"
ROUTES = (
    Way("GET", "/api/machines", "Serial ports found, plotters and their beds, print queues and printers", machines),
    Way("POST", "/api/pen", "Move a plotter's pen: up, down, to its zero, so far; or its motors off", move,
        body=PenMoveBody),
    Way("POST", "/api/machines/asked", "Who answers at a port, and the profiles that it may have; nothing moves",
        ask_machine, body=AskedPort),
    Way("GET", "/api/plots", "The plots that are kept, newest first; of those that are drawn now, the tasks",
        _list_kept("plot", "plot_desk.plots", "drawn")),
    Way("POST", "/api/plots", "Keep a text as a plot, which is drawn later", keep_plot, body=NewPlot),
    Way("GET", _PLOT, "How far a plot has come, what comes next, how its sheet lies on the bed",
        _show_one("plot", "plot_desk.show_plot")),
    Way("GET", f"{_PLOT}/pages/{{page:int}}", "A page of it, from 0, its strokes as they are drawn", page,
        answer="image/svg+xml"),
    Way("PUT", f"{_PLOT}/sheet", "Lay its sheets otherwise on the bed, before it begins", lay, body=SheetOnBed),
    Way("PUT", f"{_PLOT}/pens", "What draws each layer, how fast, in which order, and which are left out", turn,
        body=TurnedPens),
    Way("POST", f"{_PLOT}/draw", "Draw it, or what is left; the task's events tell where the pen is", draw,
        body=DrawnPlot),
    Way("DELETE", _PLOT, "Delete it", _forget_one("plot", "plot_jobs.forget_job")),
    Way("POST", "/api/tasks/{id}/word", "Say pause, on or stop to a plot; on or stop to what asks for something", say,
        body=Said),
    Way("GET", "/api/batches", "The batches that are kept, newest first; of those that are made now, tasks",
        _list_kept("batch", "batch_desk.batches", "made")),
    Way("POST", "/api/batches", "Keep a table with its letter, with gaps as {{ first_name }}; a text without a table",
        keep_batch, body=NewBatch),
    Way("POST", "/api/batches/tried", "Look at a table and a letter: columns, odd rows, the letter of one; not kept",
        try_batch, body=TriedBatch),
    Way("GET", _BATCH, "A batch: its rows, what its proof says of them, and what its journal says became of them",
        _show_one("batch", "batch_desk.show_batch")),
    Way("POST", f"{_BATCH}/rows/{{row:int}}", "The cells of a row by its number in the file; change some before it is "
        "approved, and make the proof anew", edit, body=EditedRow),
    Way("POST", f"{_BATCH}/proof", "Make the proof of a batch: every page, small, and what to look at", prove),
    Way("POST", f"{_BATCH}/approval", "Approve the proof: what is made then is what was looked at, or nothing",
        _show_one("batch", "batch_desk.approve_batch"), body=Approval),
    Way("POST", f"{_BATCH}/make", "Print or plot it, or go on where its journal says; each page once", make,
        body=MadeBatch),
    Way("GET", f"{_BATCH}/files/{{file}}", "proof.pdf, a picture of it by its name, or the batch.pdf that was made",
        file, answer="application/pdf"),
    Way("DELETE", _BATCH, "Delete it; its journal stays", _forget_one("batch", "batch_desk.forget_batch")),
)  # fmt: skip
