"""Routes of the page Style: a handstyle and targets edited, moved through as they are dragged, kept, saved."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response

from handout.pipeline.options import StyleDraft
from handout.web.calls import Handstyle, KeptStyle, Movement, MovementFile, StyledWord
from handout.web.hands import name_of
from handout.web.routes import Way, json_answer
from handout.web.studio import Studio
from handout.web.tasks import file_answer, followed
from handout.web.worker import Call


def _draft(studio: Studio, body: Handstyle) -> StyleDraft:
    return StyleDraft(body.values, "" if body.base is None else studio.style(body.base), body.name)


async def show(studio: Studio, request: Request, body: None) -> Response:
    """A style with its knobs."""
    facts = await studio.answer("a style", Call("style_editor.open_style", (studio.style(name_of(request)),)))
    return json_answer({**facts, "own": name_of(request) in studio.styles})


async def move(studio: Studio, request: Request, body: Movement) -> Response:
    """Targets are moved through."""
    arguments = (bytes(body.plan), _draft(studio, body.style), body.seed, body.samples)
    return json_answer(await studio.answer("a movement", Call("style_editor.moved", arguments)))


async def word(studio: Studio, request: Request, body: StyledWord) -> Response:
    """A word in a style."""
    arguments = (body.text, studio.hand(body.hand), _draft(studio, body.style), body.seed)
    return json_answer(await studio.answer("a word", Call("style_editor.word", arguments)))


async def targets(studio: Studio, request: Request, body: StyledWord) -> Response:
    """The targets of a word."""
    arguments = (body.text, studio.hand(body.hand), _draft(studio, body.style))
    return json_answer(await studio.answer("targets", Call("style_editor.targets_of_word", arguments)))


async def file(studio: Studio, request: Request, body: MovementFile) -> Response:
    """What is on the desk as a file."""
    folder = studio.folder()
    output = folder / f"{body.style.name}.{body.format}"
    call = Call("style_editor.keep_movement", (bytes(body.plan), _draft(studio, body.style), body.seed, output))
    task = studio.begin(studio.quick, "saving", call, folder)
    answer = await followed(request, task)
    return file_answer(task) if task.ended else answer


async def keep(studio: Studio, request: Request, body: KeptStyle) -> Response:
    """A style is kept."""
    given = studio.styles.get(body.style.name)
    arguments = (_draft(studio, body.style), None if given is None else str(given))
    call = Call("style_editor.save_style", arguments, {"replace_": body.replace})
    return json_answer(await studio.answer("keeping a style", call))


ROUTES = (
    Way("GET", "/api/styles/{name}", "A handstyle, and what can be changed of it", show),
    Way("POST", "/api/styles", "Keep a style among the user's own, or in the file that was opened", keep,
        body=KeptStyle),
    Way("POST", "/api/movements", "Targets moved through in a style: strokes with speeds, ellipses, samples", move,
        body=Movement),
    Way("POST", "/api/movements/file", "The same as a file, or its style", file, answer="*/*",
        body=MovementFile),
    Way("POST", "/api/movements/word", "A word in a drawn hand and a style", word, body=StyledWord),
    Way("POST", "/api/movements/targets", "Targets that lead through the letters of a word", targets, body=StyledWord),
)  # fmt: skip
