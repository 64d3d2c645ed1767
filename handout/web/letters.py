"""Routes of the page Letters: a scanned hand's pages, and corrections of its letters, each kept at once.

What the pages' networks learn from corrections is worked out in another process, and takes the place of the hand when
it is done; the letters go on being corrected meanwhile.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from handout.web.calls import CorrectionsBody, Revised, Rewinding
from handout.web.hands import name_of
from handout.web.routes import Way, json_answer
from handout.web.studio import Studio, raise_refused
from handout.web.tasks import follow_task
from handout.web.worker import Call
from handout.web.workers import Task


def _numbers(request: Request, *names: str, most: int = 10_000) -> tuple[int, ...]:
    numbers = tuple(int(request.path_params[name]) for name in names)
    if max(numbers) > most:
        raise HTTPException(404, "There is no such page or part of one.")
    return numbers


async def _ask_desk(studio: Studio, request: Request, function: str, *arguments: object) -> Response:
    hand = studio.hand(name_of(request))
    return json_answer(await studio.answer("letters", Call(f"letter_desk.{function}", (hand, *arguments)), studio.desk))


async def _change_hand(studio: Studio, request: Request, function: str, *arguments: object) -> Response:
    """The same of what changes a hand: its file follows when there is time."""
    hand = studio.hand(name_of(request))
    call = Call(f"letter_desk.{function}", (hand, *arguments))
    facts = await studio.answer("letters", call, studio.desk)
    studio.keep_soon(hand)
    return _with_trouble(studio, hand, facts)


def _with_trouble(studio: Studio, hand: str, facts: dict[str, Any]) -> Response:
    """What is told of a hand, with why its file has not all of it."""
    trouble = studio.troubles.get(hand)
    return json_answer(facts if trouble is None else {**facts, "trouble": trouble})


async def pages(studio: Studio, request: Request, body: None) -> Response:
    """The pages of a hand; what a break left in its log is kept."""
    hand = studio.hand(name_of(request))
    facts = await studio.answer("letters", Call("letter_desk.open_letters", (hand,)), studio.desk)
    if facts["waiting"] and hand not in studio.unkept:
        studio.keep_soon(hand)
    return _with_trouble(studio, hand, facts)


async def letters(studio: Studio, request: Request, body: None) -> Response:
    """The letters of a page; what corrections of it will ask for is then worked out beforehand."""
    (page,), hand = _numbers(request, "page"), studio.hand(name_of(request))
    answer = await _ask_desk(studio, request, "page_letters", page)
    studio.run_beside(_warm_letters(studio, hand, page))
    return answer


async def _warm_letters(studio: Studio, hand: str, page: int) -> None:
    try:
        while await studio.answer("making ready", Call("letter_desk.warm_letters", (hand, page)), studio.desk):
            pass
    except HTTPException:
        return  # who corrects is told


async def tile(studio: Studio, request: Request, body: None) -> Response:
    """A part of the picture of a page."""
    place = _numbers(request, "page", "level", "column", "row")
    call = Call("letter_desk.page_tile", (studio.hand(name_of(request)), *place))
    return Response(await studio.answer("a part of a page", call, studio.desk), media_type="image/jpeg")


async def strokes(studio: Studio, request: Request, body: None) -> Response:
    """How the word at a place is written."""
    page, x, y = _numbers(request, "page", "x", "y", most=100_000)
    return await _ask_desk(studio, request, "letter_strokes", page, (float(x), float(y)))


async def correct(studio: Studio, request: Request, body: CorrectionsBody) -> Response:
    """Corrections are made and kept."""
    return await _change_hand(studio, request, "correct_letters", body.revision, bytes(body.corrections), body.later)


async def alignment(studio: Studio, request: Request, body: None) -> Response:
    """The words around the last correction are aligned anew."""
    hand = studio.hand(name_of(request))
    call = Call("letter_desk.align_letters", (hand, request.query_params.get("revision", "")))
    facts = await studio.answer("letters", call, studio.desk)
    return _with_trouble(studio, hand, facts)


async def rewind(studio: Studio, request: Request, body: Rewinding) -> Response:
    """Corrections are undone, or made again."""
    return await _change_hand(studio, request, "rewind_letters", body.revision, body.back)


async def learn(studio: Studio, request: Request, body: Revised) -> Response:
    """The other letters learn from the corrections."""
    folder, hand = studio.folder(), studio.hand(name_of(request))
    copy = folder / "learning.hand"
    call = Call("letter_desk.begin_learning", (hand, body.revision, str(copy)))
    begun = await studio.answer("letters", call, studio.desk)
    task = Task("learning from corrections", call, folder, state="running")
    studio.tasks[task.id] = task
    studio.run_beside(_learn_apart(studio, task, hand, copy, begun["made"]))
    return await follow_task(request, task)


async def _learn_apart(studio: Studio, task: Task, hand: str, copy: Path, made: int) -> None:
    """See a task through: a copy of a hand learns, and takes its place."""
    try:
        apart = studio.begin(studio.long, task.kind, Call("letter_desk.learn_apart", (str(copy),), listens=True))
        async for _ in apart.follow():
            if task.has_ended:
                apart.change(state="cancelled")
                return
            task.change(share=0.95 * apart.share, stage=apart.stage)
        raise_refused(apart)
        taken = await studio.answer(task.kind, Call("letter_desk.take_learnt", (hand, str(copy), made)), studio.desk)
        studio.keep_soon(hand)
        task.change(state="done", share=1.0, facts={**taken, **apart.facts}, said=list(taken["notes"]))
    except HTTPException as error:
        task.change(state="refused", error=str(error.detail))


_TILE = "/api/hands/{name}/tiles/{page:int}/{level:int}/{column:int}/{row:int}"
ROUTES = (
    Way("GET", "/api/hands/{name}/letters", "The pages of a scanned hand, and the revision that it is of", pages),
    Way("GET", "/api/hands/{name}/letters/{page:int}", "The letters of a page, from 0, with their ink", letters),
    Way("GET", _TILE, "A square of a page, 512 pixels a side, each of 2 to the power of the level", tile,
        answer="image/jpeg"),
    Way("GET", "/api/hands/{name}/strokes/{page:int}/{x:int}/{y:int}",
        "How the word at a place of a page is written: strokes in order, as far as the ink tells", strokes),
    Way("POST", "/api/hands/{name}/corrections", "Make corrections, as `handout hand edit` takes them, and keep them; "
        "words around them are aligned anew", correct, body=CorrectionsBody),
    Way("GET", "/api/hands/{name}/alignment", "What the last correction means for the words around it, where it was "
        "answered before they were aligned anew", alignment, query=(("revision", "as that answer said"),)),
    Way("POST", "/api/hands/{name}/history", "Undo corrections, or make them again", rewind, body=Rewinding),
    Way("POST", "/api/hands/{name}/learning", "Align the corrected pages anew, with what the corrections teach; more "
        "can be corrected meanwhile", learn, body=Revised),
)  # fmt: skip
