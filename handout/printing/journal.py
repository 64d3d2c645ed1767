"""Records what became of every page of a batch, so that an interrupted batch can be resumed.

Every batch, identified by its table, letter, hand and options, has a file in the user's state folder: a journal of
`handout.journal_lines`, each line a JSON object.  A run first writes ``{"begun": "2026-03-01T09:30:00", "run":
"4f2a9c", "table": "…", "facts": {…}, "seed": 7}``, twice, for without it nothing can be gone on with; a resumed one
``{"resumed": …, "run": …}``, and ``{"settled": true}`` when every row that may have been lost in damaged lines is said
to be doubtful; then a line for each step of each page: ``{"row": 5, "copy": 1, "state": "sending",
"title": "handout 4f2a9c row 5", "device": "epson"}``, ``"sent"`` with the job's name, and ``"completed"``, ``"failed"``
or ``"doubtful"``.  A page that is no envelope has a ``"part"`` (``"letter 2"``), and a row that has such pages says in
each line what all its ``"parts"`` are.  Each line is on the disk before the next step.

Every line says of which run it is (``"of"``), and how many pages that has begun so far (``"n"``): where lines are
damaged, it is known by these of how many pages nothing is known.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import json
import secrets
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, NamedTuple, get_args

from handout import journal_lines, shipped
from handout.errors import InputError, reason
from handout.journal_lines import Damage, JournalFile, cannot, seal
from handout.printing.rows import TableRow, name_rows

State = Literal["sending", "sent", "completed", "failed", "doubtful"]
_TABLE, _HAND = "content of the table", "content of the hand's file"
_TOLD = ("title", "device", "job", "why")
ENVELOPE = ""  # the part of a row that is its envelope
BACK = "back"  # and the back of that
_ALONE = (ENVELOPE,)
_SHORTEST = 100  # bytes, of the line of a page that is begun: of its least, 123, some may be lost


class Piece(NamedTuple):
    """One page of a batch: the number of its row, of the copy from 1, and which part of that row it is."""

    row: int
    copy: int
    part: str = ENVELOPE


@dataclass(frozen=True)
class PieceStep:
    """The last known state of a piece; of a printer's job, `job` is the number and the up-time, ``"17@3600"``."""

    state: State
    title: str = ""
    device: str = ""
    job: str = ""
    why: str = ""

    @property
    def number(self) -> str:
        """What its job is called, without when it was made."""
        return self.job.partition("@")[0]


def _add(steps: dict[Piece, PieceStep], piece: Piece, state: State, more: Mapping[str, str]) -> None:
    """Add a step.  Pieces keep the order in which they were begun, and their job until they are sent again."""
    before = steps.pop(piece, None) if state == "sending" else steps.get(piece)
    kept = before if state != "sending" else None
    ticket = {"title": kept.title, "device": kept.device, "job": kept.job} if kept is not None else {}
    steps[piece] = PieceStep(state, **{**ticket, **more})


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


def batch(table: Path, rows: Sequence[TableRow], hand: Path, options: Mapping[str, Any], cells: bool = False) -> Batch:
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
class JournalRun:
    """A run as read from its file, with its resumptions.

    token : its name, of the run that began the batch; head : how it was begun, empty where that is damaged.
    parts : number of a row of which something was sent → what it consists of, in order.
    damaged : the first line of its file that is, 0 for none; lost : of how many pages at most, that may have been sent,
    nothing is known for that; begun : pages, in all of its runs.
    ended : "done", why it ended, or "" where nobody wrote that down.
    """

    token: str
    head: dict[str, Any] = field(default_factory=dict)
    steps: dict[Piece, PieceStep] = field(default_factory=dict)
    parts: dict[int, tuple[str, ...]] = field(default_factory=dict)
    damaged: int = 0
    lost: int = 0
    begun: int = 0
    ended: str = ""

    def add(self, entry: Mapping[str, Any], gap: Damage | None) -> None:
        """What a line says that is none of a beginning; gap : what is damaged before it."""
        self.damaged = self.damaged or (0 if gap is None else gap.line)
        state: State | None = entry.get("state")
        # as many pages may have been begun in lines that are damaged as there is room for
        expected = self.begun + (state == "sending")
        told = int(entry.get("n", expected + (0 if gap is None else gap.size // _SHORTEST + 1)))
        self.lost, self.begun = self.lost + max(told - expected, 0), max(told, expected)
        if state is None:
            self.ended = entry.get("ended", "")
        if "settled" in entry:
            self.lost = 0
        if "parts" in entry:
            self.parts[int(entry["row"])] = tuple(map(str, entry["parts"]))
        if state is None:
            return
        piece = Piece(int(entry["row"]), int(entry["copy"]), str(entry.get("part", ENVELOPE)))
        known, more = self.steps.get(piece), {name: str(entry[name]) for name in _TOLD if name in entry}
        under_way = known is not None and known.state in ("sending", "sent", "doubtful")
        if self.lost and state in ("sent", "completed", "failed") and not under_way:
            self.lost -= 1  # it is this one whose beginning is lost, with what it was called
            if state == "sent":
                state, more["why"] = "doubtful", f"line {self.damaged} of the journal, which said more, is damaged"
        _add(self.steps, piece, state, more)
        self.parts.setdefault(piece.row, _ALONE)
        self.ended = ""


@dataclass
class Journal(JournalRun):
    """The journal of one run; without a stream it is kept in memory only.  Threads may write it.

    run : a random token in the titles of its jobs, which tells them from all others.
    """

    token: str = ""
    run: str = field(default_factory=lambda: _token())
    seed: int = 0
    resumed: bool = False
    path: Path | None = None
    _file: JournalFile | None = None
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
            parts = self.parts.get(piece.row, _ALONE)
            self.begun += state == "sending"
            _add(self.steps, piece, state, more)
            kept = {} if parts == _ALONE else {"parts": list(parts)}
            self._write({"row": piece.row, "copy": piece.copy, **part, **kept, "state": state, **more})

    def doubt(self, pieces: Sequence[Piece]) -> str:
        """All pieces of a row of which nothing is known may be among those that are lost; why, in a phrase."""
        with self._lock:
            self.parts[pieces[0].row] = tuple(dict.fromkeys(piece.part for piece in pieces))
            for piece in pieces:
                self.note(piece, "doubtful", why=self.why_unknown)
            self.settle()
        return self.why_unknown

    def settle(self) -> None:
        """One row more of those that may have been lost is accounted for."""
        self.lost -= 1
        if not self.lost:
            self._write({"settled": True})

    @property
    def damage_notes(self) -> list[str]:
        """What has to be said of it."""
        return [f"line {self.damaged} of the journal {self.path} is damaged"] if self.damaged else []

    @property
    def why_unknown(self) -> str:
        """Why nothing is known of a page."""
        return f"whether it was sent is not known: its journal is damaged at line {self.damaged}"

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # a resumed run is ended even if nothing was left to do
        if self._head is None or (self.resumed and error is None):
            self._write({"ended": "done" if error is None else reason(error)})
        if self._file is not None:
            self._file.close()

    def _write(self, entry: Mapping[str, Any]) -> None:
        if self._file is not None:
            head = [] if self._head is None else [self._head] if self.resumed else [self._head, self._head]
            before = self.begun - (entry.get("state") == "sending")
            numbered = [*((line, before) for line in head), (entry, self.begun)]
            lines = [json.dumps({**line, "of": self.token, "n": begun}) for line, begun in numbered]
            try:
                self._file.add(b"".join(map(seal, lines)))
                self._file.sync()
            except OSError as error:
                assert self.path is not None
                raise cannot("write", self.path, error) from error
        self._head = None


def begin(what: Batch, seed: int, place: Path | None = None, afresh: bool = False) -> Journal:
    """A new run of a batch.

    Raises InputError: the journal cannot be written, another program is printing this batch, or the last run broke off
    and this one is not `afresh`.
    """
    path = _path(what, place)
    file = JournalFile(path, _BUSY)
    with _closing_if_refused(file):
        before = _read_run(file.lines)
        if before is not None and not before.head:  # nor is it known whose batch it was
            raise InputError(_explain_lost_head(before, what, path))
        if before is not None and before.ended != "done" and not afresh:
            raise InputError(
                f"This batch of {what.table.name} was begun {_time(before)} and broke off: go on with --resume, or "
                "print all of it again with --afresh."
            )
    run = _token()
    head = {"begun": _now(), "run": run, "table": str(what.table), "facts": dict(what.facts), "seed": seed}
    return Journal(run, run=run, seed=seed, path=path, _file=file, _head=head)


def resume(what: Batch, place: Path | None = None) -> Journal:
    """Continue the journal of the batch's last run.

    Raises InputError: there is no such run: no batch of this table, or one of other content, hand or options.
    """
    path = _path(what, place)
    if not path.exists():
        raise InputError(_explain_nothing_to_resume(what, place or folder()))
    file = JournalFile(path, _BUSY)
    with _closing_if_refused(file):
        last = _read_run(file.lines)
        if last is None:
            raise InputError(_explain_nothing_to_resume(what, place or folder()))
        if not last.head:
            raise InputError(_explain_lost_head(last, what, path))
    run = _token()
    head = {"resumed": _now(), "run": run}
    return Journal(**vars(last), run=run, seed=last.head["seed"], resumed=True, path=path, _file=file, _head=head)


_BUSY = "This batch is being printed by another program at this moment: wait until it is through."


def _path(what: Batch, place: Path | None) -> Path:
    return (place or folder()) / f"{what.key[:24]}.jsonl"


@contextlib.contextmanager
def _closing_if_refused(file: JournalFile) -> Iterator[None]:
    try:
        yield
    except BaseException:
        file.close()
        raise


def _explain_lost_head(run: JournalRun, what: Batch, path: Path) -> str:
    """That a run whose beginning is lost cannot be gone on with, and what is known of its rows."""
    states = {row: {step.state for piece, step in run.steps.items() if piece.row == row} for row in run.parts}
    done = [row for row, found in sorted(states.items()) if found == {"completed"}]
    open_ = [row for row, found in sorted(states.items()) if found != {"completed"}]
    told = (
        [f"all that is known is that {name_rows(done)} came out"] if done else ["of no row is known that it came out"]
    )
    told += [f"look what became of {name_rows(open_)}"] if open_ else []
    return (
        f"The batch of {what.table.name} cannot be gone on with: its journal is damaged at line {run.damaged}, where "
        f"it said how it was begun; {'; '.join(told)}. Look which sheets are there, and print the others with "
        f"--rows; to print all of it again, delete {path}."
    )


def last_run(table: Path, place: Path | None = None) -> JournalRun | None:
    """The newest run of a table in this file, whatever was made of it; None if there was none."""
    paths = sorted((place or folder()).glob("*.jsonl"), key=lambda path: path.stat().st_mtime, reverse=True)
    runs = (run for path in paths if (run := _read_run(journal_lines.read_lines(path))) is not None)
    return next((run for run in runs if run.head.get("table") == str(table.resolve())), None)


def _token() -> str:
    """A random name for a run."""
    return secrets.token_hex(3)


def _time(run: JournalRun) -> str:
    return f"on {run.head['begun']}".replace("T", " at ") if run.head else "at a time that is not known"


def _now() -> str:
    return datetime.now().isoformat(timespec="seconds")


def _read_run(lines: Iterable[str | Damage]) -> JournalRun | None:
    """The last run in a journal; None if it holds none."""
    run, gap = None, None
    for line in lines:
        entry = None if isinstance(line, Damage) else _entry(line)
        if entry is None:
            damage = line if isinstance(line, Damage) else Damage(0, len(line))
            gap = damage if gap is None else Damage(gap.line, gap.size + damage.size)
        else:
            run, gap = _add_line(run, entry, gap), None
    return run if gap is None else _add_line(run, {}, gap)


def _add_line(run: JournalRun | None, entry: dict[str, Any], gap: Damage | None) -> JournalRun:
    """A run with a line more, or the run that the line begins; gap : what is damaged before it."""
    token = str(entry.get("run" if "begun" in entry else "of", "" if run is None else run.token))
    if run is None or run.token != token:
        run = JournalRun(token)
    if "begun" in entry:
        run.head, run.damaged = entry, run.damaged or (0 if gap is None else gap.line)
    else:
        run.add(entry, gap)
    return run


def _entry(line: str) -> dict[str, Any] | None:
    """What a line says; None where that is nothing of a batch, as in damaged lines that were not sealed."""
    with contextlib.suppress(ValueError, TypeError):
        entry = json.loads(line)
        numbers = [entry.get(name, 0) for name in ("row", "copy", "n")]
        wanted = {"state": ("row", "copy"), "parts": ("row",), "begun": ("run", "facts", "seed", "table")}
        whole = all(name not in entry or entry.keys() >= set(more) for name, more in wanted.items())
        if whole and all(type(each) is int for each in numbers) and entry.get("state", "sent") in get_args(State):
            return dict(entry)
    return None


def _explain_nothing_to_resume(what: Batch, place: Path) -> str:
    """Why nothing can be resumed: what has changed since the newest batch of the same table."""
    last = last_run(what.table, place)
    if last is None:
        return f"There is nothing to resume: no batch of {what.table.name} was begun on this computer."
    return (
        f"The batch of {what.table.name} begun {_time(last)} cannot be resumed, because "
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
        return f"it was begun by {_show_value(was)}, and this is {_show_value(now)}"
    return f"--{name.removesuffix('_name').replace('_', '-')} was {_show_value(was)} and is now {_show_value(now)}"


def _show_value(value: object) -> str:
    return "not given" if value in (None, "", False) else str(value)
