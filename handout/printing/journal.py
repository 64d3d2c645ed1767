"""Records what became of every page of a batch, as JSON lines, so that an interrupted batch can be resumed.

Every batch, identified by its table, letter, hand and options, has a file in the user's state folder.  A run first
writes ``{"begun": "2026-03-01T09:30:00", "run": "4f2a9c", "table": "…", "facts": {…}, "seed": 7}``, a resumed one
``{"resumed": …, "run": …}``; then a line for each step of each page: ``{"row": 5, "copy": 1, "state": "sending",
"title": "handout 4f2a9c row 5", "device": "epson"}``, ``"sent"`` with the job's name, and ``"completed"``, ``"failed"``
or ``"doubtful"``.  A page that is no envelope has a ``"part"`` (``"letter 2"``), and a row that has such pages is first
written with all of its ``"parts"``: from then on it is known what it consists of.  Lines are only added, and each is on
the disk before the next step; a line cut off by a crash is ignored.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import secrets
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, NamedTuple, TextIO

from handout import atomic, shipped
from handout.errors import InputError, reason
from handout.printing.rows import Row

State = Literal["sending", "sent", "completed", "failed", "doubtful"]
_TABLE, _HAND = "content of the table", "content of the hand's file"
_TOLD = ("title", "device", "job", "why")
ENVELOPE = ""  # the part of a row that is its envelope
BACK = "back"  # and the back of that
_ALONE = (ENVELOPE,)


class Piece(NamedTuple):
    """One page of a batch: the number of its row, of the copy from 1, and which part of that row it is."""

    row: int
    copy: int
    part: str = ENVELOPE


@dataclass(frozen=True)
class Step:
    """The last known state of a piece."""

    state: State
    title: str = ""
    device: str = ""
    job: str = ""
    why: str = ""


def _add(steps: dict[Piece, Step], piece: Piece, state: State, more: Mapping[str, str]) -> None:
    """Add a step.  Pieces keep the order in which they were begun, and their job until they are sent again."""
    before = steps.pop(piece, None) if state == "sending" else steps.get(piece)
    kept = before if state != "sending" else None
    ticket = {"title": kept.title, "device": kept.device, "job": kept.job} if kept is not None else {}
    steps[piece] = Step(state, **{**ticket, **more})


@dataclass(frozen=True)
class Batch:
    """What identifies a batch.

    table : its file, for messages; facts : every option by name, and the content of the table and of the hand's file
    as digests.
    """

    table: Path
    facts: Mapping[str, Any]

    @property
    def key(self) -> str:
        """A digest of the facts: equal for equal batches."""
        return _digest(json.dumps(self.facts, sort_keys=True))


def batch(table: Path, rows: Sequence[Row], hand: Path, options: Mapping[str, Any], cells: bool = False) -> Batch:
    """The batch of these rows, written by the hand in this file, with these options (JSON values).

    cells : whether what is written depends on more of a row than its address.
    """
    content = json.dumps([[row.number, row.lines, row.problem, *([dict(row.cells)] * cells)] for row in rows])
    hand_digest = hashlib.sha256(hand.read_bytes()).hexdigest()
    return Batch(table.resolve(), {**options, _TABLE: _digest(content), _HAND: hand_digest})


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def folder() -> Path:
    """Where journals are kept; it need not exist."""
    return shipped.own_folder("state") / "batches"


@dataclass
class Journal:
    """The journal of one run; without a stream it is kept in memory only.  Threads may write it.

    run : a random token in the titles of its jobs, which tells them from all others.
    parts : number of a row of which something was sent → what it consists of, in order.
    """

    run: str = field(default_factory=lambda: _token())
    seed: int = 0
    resumed: bool = False
    path: Path | None = None
    steps: dict[Piece, Step] = field(default_factory=dict)
    parts: dict[int, tuple[str, ...]] = field(default_factory=dict)
    _stream: TextIO | None = None
    _head: Mapping[str, Any] | None = None  # written before the first step: a run that sends nothing leaves no trace
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def title(self, piece: Piece) -> str:
        """Title of a piece's job at its device; it holds nobody's name."""
        copy = [f"copy {piece.copy}"] * (piece.copy > 1)
        return " ".join(["handout", self.run, f"row {piece.row}", *copy, *filter(None, [piece.part])])

    def earlier(self, piece: Piece) -> frozenset[str]:
        """Titles of the pieces that were begun before this one and are completed."""
        with self._lock:
            before = list(itertools.takewhile(lambda step: step[0] != piece, self.steps.items()))
        return frozenset(step.title for _, step in before if step.state == "completed")

    def note(self, piece: Piece, state: State, **more: str) -> None:
        """Add a step of a piece; it is on the disk when this returns."""
        part = {"part": piece.part} if piece.part else {}
        with self._lock:
            _add(self.steps, piece, state, more)
            self._write({"row": piece.row, "copy": piece.copy, **part, "state": state, **more})

    def consists(self, row: int, parts: Sequence[str]) -> None:
        """Note of what a row consists, before anything of it is sent; of its envelope alone goes without saying."""
        with self._lock:
            if self.parts.get(row, _ALONE) != tuple(parts):
                self._write({"row": row, "parts": list(parts)})
            self.parts[row] = tuple(parts)

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # a resumed run is ended even if nothing was left to do
        if self._head is None or (self.resumed and error is None):
            self._write({"ended": "done" if error is None else reason(error)})
        if self._stream is not None:
            self._stream.close()

    def _write(self, entry: Mapping[str, Any]) -> None:
        if self._stream is not None:
            entries = [entry] if self._head is None else [self._head, entry]
            self._stream.write("".join(json.dumps(line) + "\n" for line in entries))
            self._stream.flush()
            os.fsync(self._stream.fileno())
        self._head = None


def begin(what: Batch, seed: int, place: Path | None = None, afresh: bool = False) -> Journal:
    """A new run of a batch.

    Raises
    ------
    InputError
        The journal cannot be written, another program is printing this batch, or the last run broke off and this one
        is not `afresh`.
    """
    path = (place or folder()) / f"{what.key[:24]}.jsonl"
    before = _read(path)
    if before is not None and before.ended != "done" and not afresh:
        raise InputError(
            f"This batch of {what.table.name} was begun on {_time(before)} and broke off: go on with --resume, or "
            "print all of it again with --afresh."
        )
    run = _token()
    head = {"begun": _now(), "run": run, "table": str(what.table), "facts": dict(what.facts), "seed": seed}
    return Journal(run, seed, False, path, {}, {}, _opened(path), head)


def resume(what: Batch, place: Path | None = None) -> Journal:
    """Continue the journal of the batch's last run.

    Raises
    ------
    InputError
        There is no such run: no batch of this table, or one of other content, hand or options.
    """
    path = (place or folder()) / f"{what.key[:24]}.jsonl"
    last = _read(path)
    if last is None:
        raise InputError(_nothing_to_resume(what, place or folder()))
    run = _token()
    seed, steps, parts = last.head["seed"], last.steps, last.parts
    return Journal(run, seed, True, path, steps, parts, _opened(path), {"resumed": _now(), "run": run})


@dataclass
class Run:
    """A run as read from its file; ended : "done", why it ended, or "" where nobody wrote that down."""

    head: dict[str, Any]
    steps: dict[Piece, Step]
    parts: dict[int, tuple[str, ...]]
    ended: str = ""


def last_run(table: Path, place: Path | None = None) -> Run | None:
    """The newest run of a table in this file, whatever was made of it; None if there was none."""
    paths = sorted((place or folder()).glob("*.jsonl"), key=lambda path: path.stat().st_mtime, reverse=True)
    runs = (run for path in paths if (run := _read(path)) is not None)
    return next((run for run in runs if run.head.get("table") == str(table.resolve())), None)


def _token() -> str:
    """A random name for a run."""
    return secrets.token_hex(3)


def _time(run: Run) -> str:
    return str(run.head["begun"]).replace("T", " at ")


def _now() -> str:
    return datetime.now().isoformat(timespec="seconds")


def _opened(path: Path) -> TextIO:
    """The file opened for appending and locked against other programs."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # a line that a crash has cut off is ended here, so that it cannot spoil the next
        torn = path.exists() and not path.read_bytes().endswith(b"\n") and path.stat().st_size > 0
        stream = path.open("a", encoding="utf-8")
        if torn:
            stream.write("\n")
    except OSError as error:
        raise InputError(f"Cannot write the journal {path}: {error.strerror or error}.") from error
    try:
        atomic.lock(stream)
    except OSError as error:
        stream.close()
        message = "This batch is being printed by another program at this moment: wait until it is through."
        raise InputError(message) from error
    return stream


def _entries(path: Path) -> Iterator[dict[str, Any]]:
    try:
        data = path.read_bytes()
    except OSError:
        return
    for line in data.split(b"\n"):
        try:
            entry = json.loads(line)
        except ValueError:
            continue
        if isinstance(entry, dict):
            yield entry


def _read(path: Path) -> Run | None:
    """The last run in a file, with its resumptions; None if the file holds none."""
    run: Run | None = None
    for entry in _entries(path):
        if "begun" in entry:
            run = Run(entry, {}, {})
        elif run is not None and "state" in entry:
            piece = Piece(int(entry["row"]), int(entry["copy"]), str(entry.get("part", ENVELOPE)))
            more = {name: str(entry[name]) for name in _TOLD if name in entry}
            _add(run.steps, piece, entry["state"], more)
            run.parts.setdefault(piece.row, _ALONE)
        elif run is not None and "parts" in entry:
            run.parts[int(entry["row"])] = tuple(map(str, entry["parts"]))
        elif run is not None:
            run.ended = entry.get("ended", "")
    return run


def _nothing_to_resume(what: Batch, place: Path) -> str:
    """Why nothing can be resumed: what has changed since the newest batch of the same table."""
    last = last_run(what.table, place)
    if last is None:
        return f"There is nothing to resume: no batch of {what.table.name} was begun on this computer."
    return (
        f"The batch of {what.table.name} begun on {_time(last)} cannot be resumed, because "
        f"{' and '.join(changes(last.head['facts'], what.facts))}: give the same again, or print with --rows what is "
        "missing."
    )


def changes(was: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What differs between two batches, each a phrase."""
    return [_change(name, was.get(name), now.get(name)) for name in {**was, **now} if was.get(name) != now.get(name)]


def _change(name: str, was: object, now: object) -> str:
    if name.startswith("content of "):
        return f"the {name} has changed since"
    if name == "program":
        return f"it was begun by {_shown(was)}, and this is {_shown(now)}"
    return f"--{name.removesuffix('_name').replace('_', '-')} was {_shown(was)} and is now {_shown(now)}"


def _shown(value: object) -> str:
    return "not given" if value in (None, "", False) else str(value)
