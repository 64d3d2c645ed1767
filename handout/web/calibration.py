"""Routes of the page Calibration: the wizard's steps, each asked for by itself, and what was calibrated before."""

from __future__ import annotations

from dataclasses import replace

from starlette.requests import Request
from starlette.responses import Response

from handout.web.calls import Calibrating
from handout.web.hands import find_upload
from handout.web.routes import Handle, Way, json_answer
from handout.web.studio import Studio
from handout.web.tasks import follow_task
from handout.web.worker import Call


async def list_calibrations(studio: Studio, request: Request, body: None) -> Response:
    """What is calibrated, and what can be."""
    return json_answer(await studio.answer("calibrations", Call("calibration_desk.calibrations"), studio.bench))


def _step(function: str, makes_files: bool) -> Handle:
    """A step of the wizard as a task."""

    async def step(studio: Studio, request: Request, body: Calibrating) -> Response:
        place = body.place("" if body.hand is None else studio.hand(body.hand))
        place = replace(place, scans=tuple(find_upload(studio, key) for key in body.uploads))
        folder = studio.folder() if makes_files else None
        call = Call(f"calibration_desk.{function}", (replace(place, folder=folder or place.folder),), listens=True)
        return await follow_task(request, studio.begin(studio.bench, "calibrating", call, folder))

    return step


_STEPS = (
    ("state", "What comes next of a calibration, which is begun or gone on with", "open_calibration", False),
    ("pages", "Print the chart or the strip, or give it as PDF", "print_page", True),
    ("pages/again", "The PDF of what is to be scanned, once more", "print_page_again", True),
    ("scans", "Take scans of the chart or the strip: what was found, with pictures; of the simulated printer its own",
     "take_scans", True),
    ("table", "Build the table of the scans", "build_table", False),
    ("stored", "Store what was built", "store_calibration", False),
    ("back", "Forget the scans, and scan the chart again", "scan_again", False),
    ("report", "The report of a stored calibration, or of this one, as HTML", "give_report", True),
)  # fmt: skip

ROUTES = (
    Way("GET", "/api/calibrations", "What is calibrated, and what can be", list_calibrations),
    *(Way("POST", f"/api/calibration/{path}", summary, _step(function, makes_files), body=Calibrating)
      for path, summary, function, makes_files in _STEPS),
)  # fmt: skip
