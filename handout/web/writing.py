"""Routes of the page Write: what can be chosen, and a text in a hand as files."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response

from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.web.calls import Write
from handout.web.hands import beside
from handout.web.routes import Way, json_answer
from handout.web.studio import Studio
from handout.web.tasks import TYPES, followed
from handout.web.worker import Call


async def choices(studio: Studio, request: Request, body: None) -> Response:
    """The names that requests may hold."""
    facts = await studio.answer("listing", Call("choices.choices", (list(studio.hands.values()),)))
    studio.drawn = frozenset(hand["name"] for hand in facts["hands"] if hand["drawn"])
    return json_answer(facts)


async def write(studio: Studio, request: Request, body: Write) -> Response:
    """A text becomes files."""
    folder = studio.folder()
    await studio.settled(studio.hand(body.hand))
    writing = body.options(WritingOptions, hand=studio.hand(body.hand))
    options = writing, body.options(SheetOptions), body.options(PictureOptions)
    arguments = body.text, body.letter, [folder / f"page.{body.format}"], options
    shown = {"device": body.device, "pictures": beside(studio, body.pictures, folder)}
    call = Call("writing.write_sent", arguments, shown, listens=True)
    lane = studio.quick if body.hand in studio.drawn and body.format == "svg" else studio.long
    task = studio.begin(lane, "writing", call, folder)
    return await followed(request, task, TYPES.get(f".{body.format}", "application/octet-stream"))


ROUTES = (
    Way("GET", "/api/choices", "Hands, pens, papers, pages, styles, plotters: what requests may name", choices),
    Way("POST", "/api/write", "A text in a hand, as files; with the format's type in Accept the first file itself, "
        "with Prefer: respond-async the task at once", write, body=Write),
)  # fmt: skip
