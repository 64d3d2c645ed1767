"""Routes of the page Hands: pictures of hands, new ones from scans, what a text would lack, sheets to write on."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from handout import atomic, shipped
from handout.pipeline.options import PictureOptions, PromptOptions, ReadingOptions, SheetOptions, WritingOptions
from handout.web.calls import Answered, GivenHand, HandCheck, Lacking, MorePages, NewHand, Sheets
from handout.web.routes import Way, json_answer
from handout.web.studio import PICTURES, Studio
from handout.web.tasks import follow_task
from handout.web.worker import Call

_SAMPLE = "The quick brown fox jumps over the lazy dog"
_SAMPLE_SHEET = SheetOptions("110x24mm", "4mm", 1)
_SAMPLE_DPI = 200.0  # of a line of writing in the gallery: sharp on screens of two pixels a point


def name_of(request: Request) -> str:
    """The hand that a request is about."""
    name = str(request.path_params["name"])
    if not name.replace("-", "").replace("_", "").isalnum() or len(name) > 80:
        raise HTTPException(422, "A hand is called by its name: letters, digits, - and _.")
    return name


def find_upload(studio: Studio, key: str, *suffixes: str) -> Path:
    """The file of an upload; HTTPException where there is none, or none of these kinds."""
    upload = studio.uploads.get(key)
    if upload is None or not upload.path.exists():
        raise HTTPException(422, f"The file {key} that was to be used is not here: send it again.")
    if suffixes and upload.path.suffix not in suffixes:
        raise HTTPException(422, f"{upload.name} is no {' or '.join(suffixes)} file.")
    return upload.path


def put_beside(studio: Studio, keys: Sequence[str], folder: Path) -> Path | None:
    """A folder in a folder with the pictures of a letter, by the names they were sent with; None without any.

    Raises HTTPException: 422: one is not here, or its name is none for a picture.
    """
    if not keys:
        return None
    named = {
        studio.uploads[key].name: path for key, path in [(key, find_upload(studio, key, *PICTURES)) for key in keys]
    }
    if odd := next((name for name in named if not atomic.PLAIN_NAME.fullmatch(name)), None):
        raise HTTPException(422, f"{odd!r}: a picture is called by letters, digits, ., - and _.")
    (pictures := folder / "pictures").mkdir()
    for name, path in named.items():
        os.link(path, pictures / name)
    return pictures


async def sample(studio: Studio, request: Request, body: None) -> Response:
    """A line in a hand; that of a scanned one, which takes a second or two, is kept until its file is another."""
    name = name_of(request)
    drawn, kind = name in studio.drawn, "image/svg+xml" if name in studio.drawn else "image/png"
    await studio.settle_hand(studio.hand(name))
    own = studio.hands.get(name, shipped.user_folder("hands") / f"{name}.hand")
    file = (own.stat().st_mtime_ns, own.stat().st_size) if own.exists() else None  # None: it comes with the program
    before, task = studio.samples.get(name, (None, None))
    if drawn or task is None or before != file or task.state != "done" or task.id not in studio.tasks:
        writing, folder = WritingOptions(studio.hand(name), seed=1, fit=True, fallback=True), studio.folder()
        options = (writing, _SAMPLE_SHEET, PictureOptions(_SAMPLE_DPI))
        call = Call("writing.write", (_SAMPLE, [folder / f"line.{'svg' if drawn else 'png'}"], *options), listens=True)
        task = studio.begin(studio.quick if drawn else studio.long, "a sample", call, folder)
        studio.samples[name] = file, task
    return await follow_task(request, task, kind)


async def sheet(studio: Studio, request: Request, body: None) -> Response:
    """All letters of a hand."""
    name, folder = name_of(request), studio.folder()
    await studio.settle_hand(studio.hand(name))
    call = Call("kept_hands.show_hand", (studio.hand(name), [folder / f"{name}.png"]))
    return await follow_task(request, studio.begin(studio.long, "showing the letters", call, folder), "image/png")


async def lacks(studio: Studio, request: Request, body: Lacking) -> Response:
    """What a text would lack."""
    name = name_of(request)
    if name in studio.drawn:
        raise HTTPException(422, f"{name} is a drawn hand; what a text lacks is said when it is written.")
    call = Call("kept_hands.check_hand", (studio.hand(name), None, body.text))
    return json_answer(await studio.answer("looking for letters", call))


async def check(studio: Studio, request: Request, body: HandCheck) -> Response:
    """What was found on the pages of a hand, drawn on them; or questions about its letters."""
    name, folder = name_of(request), studio.folder()
    await studio.settle_hand(studio.hand(name))
    asked = (None, None, folder / "questions.png", body.questions) if body.questions else (folder / "found.png",)
    call = Call("kept_hands.check_hand", (studio.hand(name), *asked))
    return await follow_task(request, studio.begin(studio.long, f"looking through {name}", call, folder))


async def answer(studio: Studio, request: Request, body: Answered) -> Response:
    """Answers become corrections, by the process that corrects letters: one writer."""
    name, asked = name_of(request), studio.tasks.get(body.task)
    questions = next((path for path in asked.files if path.suffix == ".json"), None) if asked else None
    if questions is None:
        raise HTTPException(422, "These questions are not here any more: ask them again.")
    await studio.settle_hand(studio.hand(name))
    call = Call("kept_hands.answer_questions", (studio.hand(name), questions, body.answers), listens=True)
    return await follow_task(request, studio.begin(studio.desk, f"correcting {name}", call))


async def read_hand(studio: Studio, request: Request, body: NewHand) -> Response:
    """Scans become a hand."""
    scans = [find_upload(studio, key) for key in body.scans]
    call = Call("hands.read_as_own", (body.name, scans, body.texts, body.options(ReadingOptions)), listens=True)
    return await follow_task(request, studio.begin(studio.long, f"reading {body.name}", call))


async def read_more(studio: Studio, request: Request, body: MorePages) -> Response:
    """More scans of an author become pages of his hand, by the process that corrects its letters: one writer."""
    name, scans = name_of(request), [find_upload(studio, key) for key in body.scans]
    call = Call("hands.read_more", (studio.hand(name), scans, body.texts, body.options(ReadingOptions)), listens=True)
    return await follow_task(request, studio.begin(studio.desk, f"reading more of {name}", call))


async def take(studio: Studio, request: Request, body: GivenHand) -> Response:
    """A .hand file becomes a hand of the user's own."""
    call = Call("kept_hands.import_hand", (find_upload(studio, body.upload, ".hand"), body.name))
    facts = await studio.answer("taking a hand in", call)
    return json_answer({"name": facts["name"]})


async def copy(studio: Studio, request: Request, body: None) -> Response:
    """A hand that comes with the program becomes one of the user's own, which can be corrected."""
    name = name_of(request)
    call = Call("kept_hands.copy_hand", (studio.hand(name), f"my-{name}"))
    return json_answer({"name": (await studio.answer("copying a hand", call))["name"]})


async def give(studio: Studio, request: Request, body: None) -> Response:
    """A hand as a file, with the scans that it keeps or without them."""
    name, folder = name_of(request), studio.folder()
    await studio.settle_hand(studio.hand(name))
    only = {"ink_only": request.query_params.get("ink_only") == "true"}
    call = Call("kept_hands.export_hand", (studio.hand(name), folder / f"{name}.hand"), only)
    await studio.answer("copying a hand", call)
    return FileResponse(folder / f"{name}.hand", media_type="application/zip", filename=f"{name}.hand")


async def remove(studio: Studio, request: Request, body: None) -> Response:
    """A hand of the user's own is deleted."""
    facts = await studio.answer("deleting a hand", Call("kept_hands.remove_hand", (name_of(request),)), studio.desk)
    if (waiting := studio.unkept.pop(name_of(request), None)) is not None:
        waiting.cancel()
    studio.troubles.pop(name_of(request), None)
    return json_answer({"name": facts["name"]})


async def sheets(studio: Studio, request: Request, body: Sheets) -> Response:
    """Sheets to write on."""
    folder = studio.folder()
    wanted = body.options(PromptOptions, hand=None if body.hand is None else studio.hand(body.hand))
    task = studio.begin(studio.long, "making sheets", Call("prompts.prompt", (folder / "sheets.pdf", wanted)), folder)
    return await follow_task(request, task, "application/pdf")


ROUTES = (
    Way("GET", "/api/hands/{name}/sample", "A line in a hand: the picture itself, if Accept has its type", sample,
        answer="image/png"),
    Way("GET", "/api/hands/{name}/sheet", "All letters of a hand", sheet, answer="image/png"),
    Way("POST", "/api/hands/{name}/lacks", "What a text would lack in a scanned hand", lacks, body=Lacking),
    Way("POST", "/api/hands", "A hand from scans, kept among the user's own; half a minute a page", read_hand,
        body=NewHand),
    Way("POST", "/api/hands/{name}/pages", "More scans for a hand of the user's own; half a minute a page", read_more,
        body=MorePages),
    Way("POST", "/api/hands/given", "A .hand file, kept among the user's own", take, body=GivenHand),
    Way("POST", "/api/hands/{name}/copy", "A copy of a scanned hand among the user's own, called my-NAME", copy),
    Way("POST", "/api/hands/{name}/check", "What was found on its pages, drawn on them; or questions about its letters",
        check, body=HandCheck),
    Way("POST", "/api/hands/{name}/answers", "Answer such questions: what reads badly is not written any more", answer,
        body=Answered),
    Way("GET", "/api/hands/{name}/file", "A scanned hand as a .hand file", give, answer="application/zip",
        query=(("ink_only", "true: without the scans that it keeps beside the ink"),)),
    Way("DELETE", "/api/hands/{name}", "Delete a scanned hand of the user's own", remove),
    Way("POST", "/api/sheets", "Sheets to write a hand on, as PDF", sheets, answer="application/pdf", body=Sheets),
)  # fmt: skip
