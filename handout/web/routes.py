"""The table of routes: from it requests are served, and `openapi.json` is made."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import msgspec
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from handout import __version__
from handout.errors import at_border
from handout.web.calls import Body
from handout.web.guard import OPEN
from handout.web.studio import Studio
from handout.web.workers import State, bare

Handle = Callable[[Studio, Request, Any], Awaitable[Response]]
_IN_PATH = re.compile(r"{(\w+)(?::\w+)?}")
_FIELD = re.compile(rb'"(\w+)"\s*:')


@dataclass(frozen=True)
class Way:
    """A route.

    summary : for the documentation.
    handle : is given the studio, the request, and its body as one of `body`, or None.
    answer : the media type of what it answers.
    body : the type of its JSON body; bytes for a file.
    query : parameter → what it says.
    """

    method: str
    path: str
    summary: str
    handle: Handle
    answer: str = "application/json"
    body: type[Body] | type[bytes] | Any = None
    query: tuple[tuple[str, str], ...] = ()

    @property
    def task(self) -> bool:
        """Whether it answers with a task: what its handler calls says so."""
        return not {"follow_task", "snapshot"}.isdisjoint(getattr(self.handle, "__code__").co_names)  # noqa: B009

    def route(self) -> Route:
        """The same for starlette."""

        async def endpoint(request: Request) -> Response:
            body = None
            if self.body not in (None, bytes):
                body = parse_body(await request.body() or b"{}", self.body)
            return await self.handle(request.app.state.studio, request, body)

        return Route(self.path, endpoint, methods=[self.method], name=f"{self.method} {self.path}")


def parse_body(data: bytes, kind: Any) -> Any:
    """A body of a type. Raises HTTPException: 422: it is none."""
    try:
        return msgspec.json.decode(data, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        what, _, where = str(error).partition(" - at `$")
        field = where.rstrip("`").lstrip(".")
        if isinstance(error, UnicodeDecodeError) or "UTF-8" in what:  # by the version of msgspec
            what = "it is no UTF-8"
        if "matching regex" in what:
            what = "this is no such name or length"
        if "out of range" in what:
            what = "this number is larger than any that can be computed with"
        if "[...]" in field:
            field = field.replace("[...]", f".{_refused_key(data, kind, field)}", 1)
        if field:
            raise HTTPException(422, f"{field}: {what}.") from None
        raise HTTPException(422, f"The request cannot be read{_name_last_field(data, str(error))}: {what}.") from None


def _name_last_field(data: bytes, error: str) -> str:
    """Behind which field a request that is no JSON cannot be read, as far as that is known."""
    try:
        data.decode()
        broken = re.search(r"\(byte (\d+)\)", error)
        end = int(broken[1]) if broken else len(data)
    except UnicodeDecodeError as fault:
        end = fault.start
    fields = _FIELD.findall(data[:end])
    return f" behind the field {fields[-1].decode()}" if fields else ""


def _refused_key(data: bytes, kind: Any, field: str) -> str:
    """Which key of a mapping, whose place in a body is `field` up to "[...]", has the value that is refused."""
    *outer, name = field.partition("[...]")[0].split(".")
    levels = [msgspec.json.decode(data, type=dict[str, msgspec.Raw])]
    for place in (*outer, name):
        levels.append(msgspec.json.decode(levels[-1][place], type=dict[str, msgspec.Raw]))
    mapping = levels.pop()
    for key, value in mapping.items():
        body: dict[str, Any] = {key: value}
        for level, place in zip(reversed(levels), (name, *reversed(outer)), strict=True):
            body = {**level, place: body}
        try:
            msgspec.json.decode(msgspec.json.encode(body), type=kind)
        except msgspec.MsgspecError:
            return key
    return "…"


def json_answer(facts: Any, code: int = 200) -> Response:
    """An object as JSON."""
    return Response(msgspec.json.encode(facts), code, media_type="application/json")


def openapi(ways: Sequence[Way]) -> dict[str, Any]:
    """The description of all routes, in OpenAPI 3.1."""
    kinds = list(dict.fromkeys(way.body for way in ways if way.body not in (None, bytes)))
    schemas, parts = msgspec.json.schema_components(kinds, ref_template="#/components/schemas/{name}")
    schema = dict(zip(kinds, schemas, strict=True))
    paths: dict[str, dict[str, Any]] = {}
    for way in ways:
        bare = _IN_PATH.sub(r"{\1}", way.path)
        paths.setdefault(bare, {})[way.method.lower()] = _operation(way, schema)
    error = {"type": "object", "properties": {"error": {"type": "string"}}}
    return {
        "openapi": "3.1.0",
        "info": {"title": "handout studio", "version": __version__},
        "paths": paths,
        "components": {
            "schemas": {**parts, "Error": error, "Task": TASK},
            "securitySchemes": {"key": {"type": "http", "scheme": "bearer"}},
        },
    }


def _operation(way: Way, schema: dict[Any, Any]) -> dict[str, Any]:
    named = [{"name": name, "in": "path", "required": True, "schema": {"type": "string"}}
             for name in _IN_PATH.findall(way.path)]  # fmt: skip
    asked = [{"name": name, "in": "query", "description": said, "schema": {"type": "string"}}
             for name, said in way.query]  # fmt: skip
    fault = {"description": "refused", "content": {"application/json": {"schema": {"$ref": _ERROR}}}}
    responses: dict[str, Any] = {"200": {"description": "done", "content": {way.answer: {}}}}
    if way.task:
        task = {"application/json": {"schema": {"$ref": "#/components/schemas/Task"}}}
        own: dict[str, Any] = {} if way.answer == "application/json" else {way.answer: {}}  # where Accept names it
        begun = {"description": "begun, with the header Prefer: respond-async", "content": task}
        responses = {"200": {"description": "done", "content": {**task, **own}}, "202": begun}
    operation: dict[str, Any] = {
        "summary": way.summary,
        "responses": {**responses, "4XX": fault},
        **({"parameters": [*named, *asked]} if named or asked else {}),
        **({} if way.path in OPEN else {"security": [{"key": []}]}),
    }
    if way.body is bytes:
        operation["requestBody"] = {"required": True, "content": {"application/octet-stream": {}}}
    elif way.body is not None:
        operation["requestBody"] = {"required": True, "content": {"application/json": {"schema": schema[way.body]}}}
    return operation


_TEXT, _NUMBER, _OBJECT = ({"type": kind} for kind in ("string", "number", "object"))
TASK = {
    "type": "object",
    "required": ["id", "kind", "state", "share", "stage"],
    "properties": {
        "id": _TEXT,
        "kind": {**_TEXT, "description": "what it is, for people"},
        "state": {"enum": list(get_args(State))},
        "share": {**_NUMBER, "minimum": 0, "maximum": 1, "description": "how much of it is done"},
        "stage": {**_TEXT, "description": "what is being done"},
        "said": {"type": "array", "items": _TEXT, "description": "what a person should know"},
        "error": {**_TEXT, "description": "why it was refused, or failed"},
        "facts": {**_OBJECT, "description": "what came of it, as --json of the command says; `files` at …/files/0"},
        "live": {**_OBJECT, "description": "what is so at this moment: `question`, or `place` of a pen"},
    },
}
_ERROR = "#/components/schemas/Error"


async def _fault(request: Request, error: Exception) -> Response:
    """An error as a sentence, with nothing of where it came from."""
    if not isinstance(error, HTTPException):
        return JSONResponse({"error": "That is a fault of this program."}, 500)
    usual = {404: "There is nothing here.", 405: "That is not done here."}
    sentence = error.detail if error.detail not in ("Not Found", "Method Not Allowed") else usual[error.status_code]
    return JSONResponse({"error": bare(sentence)}, error.status_code, error.headers)


async def _full_disk(request: Request, error: OSError) -> Response:
    """A full disk as a sentence; other errors of files are faults."""
    if sentence := at_border(error):
        return JSONResponse({"error": sentence}, 507)
    raise error


FAULTS: dict[Any, Any] = {HTTPException: _fault, OSError: _full_disk, Exception: _fault}  # error → who answers
