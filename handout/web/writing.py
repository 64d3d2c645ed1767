"""Routes of the pages Write and Style: a text in a hand as files; a handstyle, and targets that are moved through."""

from __future__ import annotations

from dataclasses import replace

from starlette.requests import Request
from starlette.responses import Response

from handout.pipeline.options import PictureOptions, SheetOptions, StyleDraft, WritingOptions
from handout.web.calls import Handstyle, KeptStyle, MovementBody, MovementFile, StyledWord, WritePage
from handout.web.hands import name_of, put_beside
from handout.web.routes import Way, json_answer
from handout.web.studio import Studio
from handout.web.tasks import TYPES, file_answer, follow_task
from handout.web.worker import Call

_SCREEN = 150  # dots an inch of pictures that are looked at, not kept


async def choices(studio: Studio, request: Request, body: None) -> Response:
    """The names that requests may hold."""
    facts = await studio.answer("listing", Call("names.list_choices", (list(studio.hands.values()),)))
    studio.drawn = frozenset(hand["name"] for hand in facts["hands"] if hand["drawn"])
    return json_answer(facts)


async def write(studio: Studio, request: Request, body: WritePage) -> Response:
    """A text becomes files."""
    folder = studio.folder()
    await studio.settle_hand(studio.hand(body.hand))
    writing = body.options(WritingOptions, hand=studio.hand(body.hand))
    options = writing, replace(body.options(SheetOptions), at=body.at), body.options(PictureOptions)
    arguments = body.text, body.letter, [folder / f"page.{body.format}"], options
    shown = {"device": body.device, "pictures": put_beside(studio, body.pictures, folder)}
    call = Call("writing.write_sent", arguments, shown, listens=True)
    looked_at = body.format == "png" and options[2].dpi <= _SCREEN
    lane = studio.typed if looked_at else studio.long
    lane = studio.quick if body.hand in studio.drawn and body.format == "svg" else lane
    task = studio.begin(lane, "writing", call, folder)
    return await follow_task(request, task, TYPES.get(f".{body.format}", "application/octet-stream"))


def _draft(studio: Studio, body: Handstyle) -> StyleDraft:
    return StyleDraft(body.values, "" if body.base is None else studio.style(body.base), body.name)


async def show_style(studio: Studio, request: Request, body: None) -> Response:
    """A style with its knobs."""
    facts = await studio.answer("a style", Call("style_editor.open_style", (studio.style(name_of(request)),)))
    return json_answer({**facts, "own": name_of(request) in studio.styles})


async def move(studio: Studio, request: Request, body: MovementBody) -> Response:
    """Targets are moved through."""
    arguments = (bytes(body.plan), _draft(studio, body.style), body.seed, body.samples)
    return json_answer(await studio.answer("a movement", Call("style_editor.move_targets", arguments)))


async def word(studio: Studio, request: Request, body: StyledWord) -> Response:
    """A word in a style."""
    arguments = (body.text, studio.hand(body.hand), _draft(studio, body.style), body.seed)
    return json_answer(await studio.answer("a word", Call("style_editor.word", arguments)))


async def targets(studio: Studio, request: Request, body: StyledWord) -> Response:
    """The targets of a word."""
    arguments = (body.text, studio.hand(body.hand), _draft(studio, body.style))
    return json_answer(await studio.answer("targets", Call("style_editor.targets_of_word", arguments)))


async def movement_file(studio: Studio, request: Request, body: MovementFile) -> Response:
    """What is on the desk as a file."""
    folder = studio.folder()
    output = folder / f"{body.style.name}.{body.format}"
    call = Call("style_editor.keep_movement", (bytes(body.plan), _draft(studio, body.style), body.seed, output))
    task = studio.begin(studio.quick, "saving", call, folder)
    answer = await follow_task(request, task)
    return file_answer(task) if task.has_ended else answer


async def keep_style(studio: Studio, request: Request, body: KeptStyle) -> Response:
    """A style is kept."""
    given = studio.styles.get(body.style.name)
    arguments = (_draft(studio, body.style), None if given is None else str(given))
    call = Call("style_editor.save_style", arguments, {"replace_": body.replace})
    return json_answer(await studio.answer("keeping a style", call))


ROUTES = (
    Way("GET", "/api/choices", "Hands, pens, papers, pages, styles, plotters: what requests may name", choices),
    Way("POST", "/api/write", "A text in a hand, as files; with the format's type in Accept the first file itself, "
        "with Prefer: respond-async the task at once", write, body=WritePage),
    Way("GET", "/api/styles/{name}", "A handstyle, and what can be changed of it", show_style),
    Way("POST", "/api/styles", "Keep a style among the user's own, or in the file that was opened", keep_style,
        body=KeptStyle),
    Way("POST", "/api/movements", "Targets moved through in a style: strokes with speeds, ellipses, samples", move,
        body=MovementBody),
    Way("POST", "/api/movements/file", "The same as a file, or its style", movement_file, answer="*/*",
        body=MovementFile),
    Way("POST", "/api/movements/word", "A word in a drawn hand and a style", word, body=StyledWord),
    Way("POST", "/api/movements/targets", "Targets that lead through the letters of a word", targets, body=StyledWord),
)  # fmt: skip
