"""Routes of the page Calibration: the wizard's steps, each asked for by itself, and what was calibrated before."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from handout.web.calls import Calibrating
from handout.web.hands import sent
from handout.web.routes import Handle, Way, json_answer
from handout.web.studio import Studio
from handout.web.tasks import followed
from handout.web.worker import Call


async def known(studio: Studio, request: Request, body: None) -> Response:
    """What is calibrated, and what can be."""
    return json_answer(await studio.answer("calibrations", Call("calibration_desk.calibrations"), studio.bench))


def _step(kind: str, function: str, *, makes_files: bool = False, listens: bool = False) -> Handle:
    """A step of the wizard as a task."""

    async def step(studio: Studio, request: Request, body: Calibrating) -> Response:
        folder = studio.folder() if makes_files else None
        arguments: list[Any] = [body.place("" if body.hand is None else studio.hand(body.hand))]
        options: dict[str, Any] = {}
        if function == "give_report":
            arguments += [body.made, folder and folder / "report.html"]
        elif folder is not None:
            arguments.append(folder)
        if function == "take_scans":
            arguments.append([sent(studio, key) for key in body.uploads])
        if function == "print_page":
            options = {"to_printer": body.to_printer}
        call = Call(f"calibration_desk.{function}", tuple(arguments), options, listens)
        return await followed(request, studio.begin(studio.bench, kind, call, folder))

    return step


_STEPS: tuple[tuple[str, str, str, dict[str, bool]], ...] = (
    ("state", "What comes next of a calibration, which is begun or gone on with", "open_calibration", {}),
    ("pages", "Print the chart or the strip, or give it as PDF", "print_page", {"makes_files": True}),
    ("pages/again", "The PDF of what is to be scanned, once more", "again", {"makes_files": True}),
    ("scans", "Take scans of the chart or the strip: what was found, with pictures; of the simulated printer its own",
     "take_scans", {"makes_files": True, "listens": True}),
    ("table", "Build the table of the scans", "build_table", {"listens": True}),
    ("stored", "Store what was built", "store_calibration", {}),
    ("back", "Forget the scans, and scan the chart again", "scan_again", {}),
    ("report", "The report of a stored calibration, or of this one, as HTML", "give_report", {"makes_files": True}),
)  # fmt: skip

ROUTES = (
    Way("GET", "/api/calibrations", "What is calibrated, and what can be", known),
    *(Way("POST", f"/api/calibration/{path}", summary, _step("calibrating", function, **how), body=Calibrating)
      for path, summary, function, how in _STEPS),
)  # fmt: skip
