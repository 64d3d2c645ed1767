"""What goes wrong at the simulated IPP printer."""

from __future__ import annotations

from dataclasses import dataclass

FAILURES = tuple(f"{when}{how}" for how in ("500", "503", "drop", "error", "text") for when in ("", "done-"))


@dataclass(frozen=True)
class Faults:
    """What goes wrong; jobs are counted from 1.

    busy : so many print requests are refused as busy first; empty_at : the job at which the tray is empty; jam_at :
    the job that jams and is given up; cleared_after : s until somebody has filled the tray or taken out what had
    jammed, 0 for never (see `SimulatedPrinter.clear`); until then nothing is printed;
    hold_at : the job that is held; lie_at : the job that jams and yet is called completed; lost_at : the job in the
    middle of whose document the connection breaks, before the printer knows of it; torn_at : the same, and the printer
    keeps the beginning; unanswered_at : the job that is taken and printed, and the connection broken before the answer;
    fail_at : the request, of whatever kind, from which it fails; fail_for : so many fail in a row; fail_as : how, one
    of `FAILURES`: "500" or "503" is the HTTP status that it answers with, "drop" breaks the connection, "error" is an
    internal error of IPP's own, "text" an answer that is no IPP; nothing else is done then, or, with "done-" before it,
    what was asked is done first; retry_after : s that it wants to be left alone after a 503, -1: it does not say;
    simple : it knows Print-Job only, not Create-Job and Send-Document; slow : s before every answer; printing : s that
    a sheet takes; forgetful : jobs are forgotten when they are over; old : it speaks IPP 1.1 only; no_envelopes : it
    takes A4 and A5 only; formats : what it prints.
    """

    busy: int = 0
    empty_at: int = 0
    cleared_after: float = 0.0
    jam_at: int = 0
    hold_at: int = 0
    lie_at: int = 0
    lost_at: int = 0
    torn_at: int = 0
    unanswered_at: int = 0
    fail_at: int = 0
    fail_for: int = 1
    fail_as: str = "500"
    retry_after: float = -1.0
    simple: bool = False
    slow: float = 0.0
    printing: float = 0.02
    forgetful: bool = False
    old: bool = False
    no_envelopes: bool = False
    formats: tuple[str, ...] = ("application/pdf", "image/pwg-raster", "image/urf")
