"""Routes of the page Jobs: machines, the pen moved by hand, plots that are kept, drawn, paused and stopped."""

from __future__ import annotations

import re

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from handout.web.calls import DrawnPlot, NewPlot, PenMove, Said
from handout.web.hands import beside
from handout.web.routes import Way, json_answer
from handout.web.studio import Studio
from handout.web.tasks import followed, task_of
from handout.web.worker import Call

_JOB = re.compile(r"[a-z]{3}\d\d-\d{1,5}")  # as `plotting.jobs.store` calls them


def _name(request: Request) -> str:
    name = str(request.path_params["name"])
    if not _JOB.fullmatch(name):
        raise HTTPException(404, "There is no such plot.")
    return name


def _drawn(studio: Studio) -> dict[str, str]:
    """Name of a plot that is drawn now → its task."""
    running = [task for task in studio.attended.values() if not task.ended]
    return {task.kind.removeprefix("plot "): task.id for task in running if task.kind.startswith("plot ")}


async def machines(studio: Studio, request: Request, body: None) -> Response:
    """Ports, plotters, print queues and printers."""
    return json_answer(await studio.answer("looking for machines", Call("plot_desk.machines"), studio.long))


async def move(studio: Studio, request: Request, body: PenMove) -> Response:
    """The pen is moved by hand."""
    call = Call("plot_desk.move_pen", (body.port, body.device, body.move, body.x, body.y), listens=True, moves=True)
    return await followed(request, await studio.attend((body.port,), "moving the pen", call))


async def plots(studio: Studio, request: Request, body: None) -> Response:
    """The plots that are kept."""
    facts = await studio.answer("listing plots", Call("plot_desk.plots", listens=True))
    return json_answer({**facts, "drawn": _drawn(studio)})


async def keep(studio: Studio, request: Request, body: NewPlot) -> Response:
    """A text is kept as a plot."""
    pictures = beside(studio, body.pictures, folder := studio.folder())
    wanted = body.text, body.letter, body.request(studio.hand(body.hand)), pictures
    call = Call("plot_desk.keep_plot", wanted, listens=True)
    return await followed(request, studio.begin(studio.long, "a plot", call, folder))


async def show(studio: Studio, request: Request, body: None) -> Response:
    """How far a plot has come, and how its sheet lies on the bed."""
    facts = await studio.answer("looking at a plot", Call("plot_desk.show_plot", (_name(request),)))
    return json_answer({**facts, "task": _drawn(studio).get(facts["job"])})


async def page(studio: Studio, request: Request, body: None) -> Response:
    """A page of a plot."""
    call = Call("plot_desk.plot_page", (_name(request), int(request.path_params["page"])))
    return Response(await studio.answer("a page of a plot", call), media_type="image/svg+xml")


async def draw(studio: Studio, request: Request, body: DrawnPlot) -> Response:
    """A plot is drawn, or what is left of it."""
    name = _name(request)
    if name in _drawn(studio):
        raise HTTPException(409, f"The plot {name} is being drawn.")
    call = Call("plot_desk.draw_plot", (name, body.port, body.at_zero, body.home_after), listens=True, moves=True)
    return await followed(request, await studio.attend((body.port,), f"plot {name}", call))


async def forget(studio: Studio, request: Request, body: None) -> Response:
    """A plot is deleted."""
    if (name := _name(request)) in _drawn(studio):
        raise HTTPException(409, f"The plot {name} is being drawn: stop it first.")
    return json_answer({"deleted": await studio.answer("deleting a plot", Call("plot_jobs.forget_job", (name,)))})


async def say(studio: Studio, request: Request, body: Said) -> Response:
    """Something is said to work that goes on."""
    task = task_of(studio, request)
    if task.state != "running":
        raise HTTPException(409, "It is not being done.")
    task.tell(body.word)
    return json_answer(task.snapshot())


ROUTES = (
    Way("GET", "/api/machines", "Serial ports found, plotters and their beds, print queues and printers", machines),
    Way("POST", "/api/pen", "Move a plotter's pen: up, down, to its zero, so far; or its motors off", move,
        body=PenMove),
    Way("GET", "/api/plots", "The plots that are kept, newest first; of those that are drawn now, the tasks", plots),
    Way("POST", "/api/plots", "Keep a text as a plot, which is drawn later", keep, body=NewPlot),
    Way("GET", "/api/plots/{name}", "How far a plot has come, what comes next, how its sheet lies on the bed", show),
    Way("GET", "/api/plots/{name}/pages/{page:int}", "A page of it, from 0, its strokes as they are drawn", page,
        answer="image/svg+xml"),
    Way("POST", "/api/plots/{name}/draw", "Draw it, or what is left; the task's events tell where the pen is", draw,
        body=DrawnPlot),
    Way("DELETE", "/api/plots/{name}", "Delete it", forget),
    Way("POST", "/api/tasks/{id}/word", "Say pause, on or stop to a plot; on or stop to what asks for something", say,
        body=Said),
)  # fmt: skip
