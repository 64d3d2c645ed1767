"""Routes of the page Letters: a scanned hand's pages, and corrections of its letters, each kept at once."""

from __future__ import annotations

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from handout.web.calls import Corrections, Revised, Rewinding
from handout.web.hands import name_of
from handout.web.routes import Way, json_answer
from handout.web.studio import Studio
from handout.web.tasks import followed
from handout.web.worker import Call


def _numbers(request: Request, *names: str) -> tuple[int, ...]:
    numbers = tuple(int(request.path_params[name]) for name in names)
    if max(numbers) > 10_000:
        raise HTTPException(404, "There is no such page or part of one.")
    return numbers


async def _asked(studio: Studio, request: Request, function: str, *arguments: object) -> Response:
    hand = studio.hand(name_of(request))
    return json_answer(await studio.answer("letters", Call(f"letter_desk.{function}", (hand, *arguments)), studio.desk))


async def pages(studio: Studio, request: Request, body: None) -> Response:
    """The pages of a hand."""
    return await _asked(studio, request, "open_letters")


async def letters(studio: Studio, request: Request, body: None) -> Response:
    """The letters of a page."""
    return await _asked(studio, request, "page_letters", *_numbers(request, "page"))


async def tile(studio: Studio, request: Request, body: None) -> Response:
    """A part of the picture of a page."""
    place = _numbers(request, "page", "level", "column", "row")
    call = Call("letter_desk.page_tile", (studio.hand(name_of(request)), *place))
    return Response(await studio.answer("a part of a page", call, studio.desk), media_type="image/jpeg")


async def correct(studio: Studio, request: Request, body: Corrections) -> Response:
    """Corrections are made and kept."""
    return await _asked(studio, request, "correct_letters", body.revision, bytes(body.corrections))


async def rewind(studio: Studio, request: Request, body: Rewinding) -> Response:
    """Corrections are undone, or made again."""
    return await _asked(studio, request, "rewind_letters", body.revision, body.back)


async def learn(studio: Studio, request: Request, body: Revised) -> Response:
    """The other letters learn from the corrections."""
    call = Call("letter_desk.learn_letters", (studio.hand(name_of(request)), body.revision), listens=True)
    return await followed(request, studio.begin(studio.desk, "learning from corrections", call))


_TILE = "/api/hands/{name}/tiles/{page:int}/{level:int}/{column:int}/{row:int}"
ROUTES = (
    Way("GET", "/api/hands/{name}/letters", "The pages of a scanned hand, and the revision that it is of", pages),
    Way("GET", "/api/hands/{name}/letters/{page:int}", "The letters of a page, from 0, with their ink", letters),
    Way("GET", _TILE, "A square of a page, 512 pixels a side, each of 2 to the power of the level", tile,
        answer="image/jpeg"),
    Way("POST", "/api/hands/{name}/corrections", "Make corrections, as `handout hand edit` takes them, and keep them",
        correct, body=Corrections),
    Way("POST", "/api/hands/{name}/history", "Undo corrections, or make them again", rewind, body=Rewinding),
    Way("POST", "/api/hands/{name}/learning", "Align the corrected pages anew, with what the corrections teach", learn,
        body=Revised),
)  # fmt: skip
