"""Batches as a page attends to them: a table and a letter are kept, proofed, approved, then printed or plotted.

A batch is a folder with its table, its letter and its plan, so that whoever comes later, to whatever program, goes on
with the same; what became of its rows is in the journal that every batch has (`printing.journal`).
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import io
import json
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import msgspec

from handout import atomic, shipped
from handout.errors import InputError
from handout.pipeline import merging
from handout.pipeline.inputs import Source, check_pictures
from handout.pipeline.merging import SENT_PICTURES
from handout.pipeline.options import (
    MergeOptions,
    PictureOptions,
    PrintOptions,
    ProofOptions,
    SheetOptions,
    TableOptions,
    WritingOptions,
    seed_of,
)
from handout.pipeline.plot_desk import AtPage, PageWire, known_port
from handout.pipeline.plot_request import AttendanceOptions, PlotOptions, PlotRequest
from handout.pipeline.plot_rows import plot_rows
from handout.pipeline.printing import print_
from handout.pipeline.proofing import proof
from handout.pipeline.results import SILENT, Facts, Listener
from handout.pipeline.row_work import BatchDelivery
from handout.plotting.connections import is_simulated
from handout.plotting.jobs.store import free_name
from handout.printing import journal, printers
from handout.printing.address_rows import cell_names
from handout.printing.journal import JournalRun, Piece, PieceStep
from handout.printing.rows import TableRow, name_rows
from handout.printing.table_files import read_sheet

_PLAN, _PROOF, _FACTS, _APPROVED, _PDF = "batch.json", "proof.pdf", "proof-facts.json", "approved", "batch.pdf"
_REFUSED = "refused.json"  # rows that were not begun when it was made last, and why
_TESTED, _TOLD = "tested", "told.json"  # of a test that was made; of what its webhook was told last
_PATIENCE = 10.0  # s that a batch with a key waits for another to be kept
# a text as a letter that has no gaps
_ONCE = "{% raw %}", "{% endraw %}{{ '{%' }}{% raw %}", "{% endraw %}"
_SHOWN = 3  # cells of a row by which it is known on the page
_MOST_ROWS = 2000  # that are shown; all are made
_MOST_TRIED = 500  # that are tried while the letter is written; the proof tries all
# what a command would be told to type, and a file that a letter on a page has not → what stands on the page
_AS_SHOWN = (
    (re.compile(r"(?:; [^;]*--[a-z].*?| or \{% if \w+ %\})(\.?)\Z"), r"\1"),
    (re.compile(r"\b(use) --[a-z-]+ or "), r"\1 "),
    (re.compile(r"letter\.(?:txt|md), (line \d+): "), r"\1 of the letter: "),
)
_MOST_TABLE = 20 << 20  # bytes; a hundred thousand addresses have about ten million


@dataclass(frozen=True)
class BatchPlan:
    """How a batch is made.

    to : a PDF file, a printer (`printer`, by its profile or queue), or a plotter (`device`, its profile).
    queues : further queues, which share it with that; grid : of a plotter, cards side by side, see `PlotOptions`.
    key : by which a program that asks twice keeps it once; test : it is proofed, and nothing is sent.
    webhook : the address that is told how it ended, with a signature of `secret`.
    """

    title: str
    to: Literal["pdf", "printer", "plotter"]
    writing: WritingOptions
    picture: PictureOptions
    table: TableOptions
    merge: MergeOptions
    page: str
    printer: str = ""
    queues: tuple[str, ...] = ()
    device: str | None = None
    grid: str = ""
    key: str = ""
    test: bool = False
    webhook: str = ""
    secret: str = ""


_PARTS: dict[str, type[Any]] = {
    "writing": WritingOptions, "picture": PictureOptions, "table": TableOptions, "merge": MergeOptions,
}  # fmt: skip


@dataclass(frozen=True)
class _Batch:
    """A batch in its folder."""

    folder: Path
    plan: BatchPlan
    begun: str
    asked: str = ""

    @property
    def table(self) -> Path:
        return next(self.folder.glob("table-*/*"))

    @property
    def merge(self) -> MergeOptions:
        """With the letter, if there is one, and the proof, if it was approved."""
        letter = next((path for path in self.folder.iterdir() if path.stem == "letter"), None)
        proofed = (self.folder / _PROOF).with_suffix(".json")
        approved = proofed if (self.folder / _APPROVED).is_file() else None
        given = frozenset[str]()
        return replace(self.plan.merge, letter=letter, approved=approved, alone=True, given=given)

    @property
    def left_out(self) -> frozenset[int]:
        """The rows that whoever approved it left out."""
        return frozenset(_facts(self.folder / _APPROVED).get("left_out", ()))

    def read_table(self) -> merging.MailMerge:
        """Its table and letter."""
        return merging.read_merge(self.table, self.plan.table, self.merge, SILENT)

    @property
    def journal_run(self) -> JournalRun | None:
        """What its journal says."""
        return journal.last_run(self.table)

    @property
    def real(self) -> bool:
        """Whether it is for a real plotter."""
        return self.plan.to == "plotter" and not (self.plan.device or "").endswith("simulated")

    @property
    def rehearsed(self) -> bool:
        """Whether all that was drawn of it, for a real plotter, the simulated one drew: nothing is on paper."""
        steps = run.steps.values() if self.real and (run := self.journal_run) is not None else ()
        return bool(steps) and all(is_simulated(step.device) for step in steps)

    def run_for(self, ports: Sequence[str]) -> JournalRun | None:
        """The run that is gone on with at some ports; InputError where a part would be on paper, and a part not."""
        run, simulated = None if self.rehearsed else self.journal_run, {is_simulated(port) for port in ports}
        if self.real and True in simulated and (False in simulated or run is not None):
            raise InputError("A part of it comes on paper: the simulated plotter cannot draw the rest.")
        return run

    @property
    def state(self) -> str:
        """Where it is: new, proofed, approved, broken off or done."""
        if (run := self.journal_run) is not None and not self.rehearsed:
            return "done" if run.ended == "done" else "broken off"
        if (self.folder / _PDF).is_file() or (self.folder / _TESTED).is_file():
            return "done"
        if (self.folder / _APPROVED).is_file():
            return "approved"
        return "proofed" if (self.folder / _FACTS).is_file() else "new"

    def tell_states(self, rows: Sequence[int], bad: Collection[int]) -> dict[int, str]:
        """What became of its rows, some of which cannot be made."""
        run, done = self.journal_run, "simulated" if self.rehearsed else "tested" if self.plan.test else "done"
        states = dict.fromkeys(rows, done if run is None and self.state == "done" else "")
        states |= {int(row): f"failed: {why}" for row, why in _facts(self.folder / _REFUSED).items()}
        states |= {} if run is None else _tell_steps(run, done)
        return states | dict.fromkeys(self.left_out, "left out") | dict.fromkeys(bad, "cannot be made")


def _tell_steps(run: JournalRun, done: str) -> dict[int, str]:
    """What became of the rows that a run began; `done` : what one is whose parts are all made."""
    steps, states = dict[int, dict[Piece, PieceStep]](), dict[int, str]()
    for piece, step in run.steps.items():
        steps.setdefault(piece.row, {})[piece] = step
    for row, own in steps.items():
        wrong = next((step for step in own.values() if step.state in ("failed", "doubtful")), None)
        if all(step.state == "completed" for step in own.values()):
            states[row] = done if len({piece.part for piece in own}) >= len(run.parts.get(row, ())) else "in part"
        elif wrong is None:
            states[row] = "sent"
        else:
            states[row] = f"{wrong.state}: {wrong.why}" if wrong.why else wrong.state
    return states


def folder() -> Path:
    """Where batches are kept; it need not exist."""
    return shipped.own_folder("state") / "desk-batches"


def keep_batch(table: Path | None, letter: str, markdown: bool, plan: BatchPlan, pictures: Path | None = None) -> Facts:
    """Keep a batch: its table and pictures, which are copied, its letter, "" for none, and its plan.

    Without a table the letter is a text as it stands, which is made once.  One whose key is kept is shown.

    Raises InputError: the table or the letter cannot be read, the folder cannot be written, or the key is another
    batch's; nothing is kept then.
    """
    content = [b"" if table is None else table.read_bytes(), letter.encode(), repr((markdown, plan)).encode()]
    content += [each.read_bytes() for each in sorted(pictures.iterdir())] if pictures else []
    asked = hashlib.sha256(b"".join(hashlib.sha256(part).digest() for part in content)).hexdigest()
    if not plan.key:
        return _keep_batch(table, letter, markdown, plan, pictures, asked)
    with atomic.hold_file(folder() / ".keys", patience=_PATIENCE):
        same = next((batch for batch in _list_batches() if batch.plan.key == plan.key), None)
        if same is not None and same.asked != asked:
            raise InputError(f"The key {plan.key} is that of the batch {same.folder.name}, which was asked otherwise.")
        if same is not None:
            return show_batch(same.folder.name)
        return _keep_batch(table, letter, markdown, plan, pictures, asked)


def _keep_batch(
    table: Path | None, letter: str, markdown: bool, plan: BatchPlan, pictures: Path | None, asked: str
) -> Facts:
    """Keep a batch whose key nobody else has."""
    if table is None:
        letter = _ONCE[0] + letter.replace("{%", _ONCE[1]) + _ONCE[2]
    elif table.stat().st_size > _MOST_TABLE:
        raise InputError(f"The table is larger than {_MOST_TABLE >> 20} MB: make it in parts.")
    plan = replace(plan, writing=replace(plan.writing, seed=seed_of(plan.writing.seed)))
    base, work = folder(), None
    try:
        base.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(dir=base, prefix=".new-"))
        # in a folder of a name that no other batch has had: by its path its journal is found
        own = Path(tempfile.mkdtemp(dir=work, prefix="table-"))
        if table is None:
            (own / "once.csv").write_text("number\n1\n", encoding="utf-8")
        else:
            shutil.copyfile(table, own / table.name)
        if letter.strip():
            (work / f"letter.{'md' if markdown else 'txt'}").write_text(letter, encoding="utf-8")
        if pictures is not None:
            check_pictures(pictures)
            shutil.copytree(pictures, work / SENT_PICTURES)
        begun = datetime.now().isoformat(timespec="seconds")
        options: dict[str, Any] = {"given": [], "approved": None, "letter": None}
        kept = asdict(plan) | {"merge": asdict(plan.merge) | options, "begun": begun, "asked": asked}
        atomic.write(work / _PLAN, json.dumps(kept, ensure_ascii=False).encode())
        _batch(work).read_table()
        name = free_name(work, base).name
    except OSError as error:
        raise InputError(f"Cannot keep the batch in {base}: {error.strerror or error}.") from error
    finally:
        if work is not None and work.exists():
            shutil.rmtree(work, ignore_errors=True)
    return show_batch(name)


def try_table(table: Path, letter: str, markdown: bool, plan: BatchPlan, row: int | None = None) -> Facts:
    """A table before it is kept: its columns as a letter calls them, what is odd of its rows, the letter of one.

    Returns
    -------
    columns : `name`, which stands in gaps, and `header`; rows : `row`, `called`, `why` it is to be looked at, and
        `filled`, its letter.
    trouble : why the letter does not fit the table; no_envelopes : why no envelopes can be addressed.
    numbers : of all rows in the file.
    tried : the `row` that is asked for by its number, in place of all.

    Raises InputError: the table cannot be read.
    """
    with tempfile.TemporaryDirectory() as work:
        path = Path(work) / f"letter.{'md' if markdown else 'txt'}"
        path.write_text("-", encoding="utf-8")
        plain, wrong = _try_letter(table, plan, path, False)
        if plain is None:
            raise InputError(wrong)
        _, no_envelopes = _try_letter(table, plan, path, True)
        path.write_text(letter, encoding="utf-8")
        envelopes = plan.merge.with_envelopes and not no_envelopes
        merged, trouble = _try_letter(table, plan, path, envelopes) if letter.strip() else (None, "")
    merged, fields = merged or plain, plain.fields
    names = {header: name for name, header in reversed([*fields.headers_by_name.items()])}
    rows = list(merged.table)
    found = next((_try_row(merged, each, plan.writing.language) for each in rows if each.number == row), None)
    shown = [] if found else rows
    return {
        "columns": [{"name": names[header], "header": header} for header in fields.headers if header in names],
        "count": len(rows),
        "numbers": [each.number for each in shown],
        "rows": [_try_row(merged, each, plan.writing.language) for each in shown[:_MOST_TRIED]],
        "notes": [*map(_as_shown, merged.table.notes)],
        "trouble": trouble,
        "no_envelopes": no_envelopes,
        "tried": found,
    }


def _try_letter(table: Path, plan: BatchPlan, path: Path, envelopes: bool) -> tuple[merging.MailMerge | None, str]:
    """A table with a letter, or why they do not fit."""
    options = replace(plan.merge, letter=path, alone=True, given=frozenset[str](), with_envelopes=envelopes)
    try:
        return merging.read_merge(table, plan.table, options, SILENT), ""
    except InputError as error:
        return None, _as_shown(str(error).replace(f"{table}: ", "").replace(f"{table.parent}/", ""))


def _as_shown(sentence: str) -> str:
    """A sentence as a page shows it, which has fields for what a command is told to type."""
    for typed, shown in _AS_SHOWN:
        sentence = typed.sub(shown, sentence)
    return sentence


def _try_row(merged: merging.MailMerge, row: TableRow, language: str) -> Facts:
    """A row, why it is to be looked at, and its letter as a text, `filled`, where that can be filled."""
    filled, why = "", [*([row.problem] if row.problem else []), *row.warnings]
    if merged.letter is not None:
        language = merged.language_of(merged.fields.manner(row), language)
        try:
            filled = f"{merged.head or ''}{merged.letter.fill(merged.fields.values(row), row.cells, language)}"
        except InputError as error:
            why.append(_as_shown(str(error)))
    return {"row": row.number, "called": _called(row), "why": why, "filled": filled}


def _called(row: TableRow) -> str:
    """By what a row is known on the page."""
    return ", ".join([cell for cell in row.cells.values() if cell][:_SHOWN])


def _batch(path: Path) -> _Batch:
    data = msgspec.json.decode((path / _PLAN).read_bytes())
    begun, asked = data.pop("begun"), data.pop("asked", "")
    for name, kind in _PARTS.items():
        data[name] = kind(**data[name])
    data["table"] = replace(data["table"], columns=tuple(data["table"].columns))
    data["queues"] = tuple(data.get("queues", ()))
    return _Batch(path, BatchPlan(**data), begun, asked)


def _find(name: str) -> _Batch:
    try:
        return _batch(folder() / name)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"There is no batch {name}, or it cannot be read.") from error


def _list_batches() -> list[_Batch]:
    """Those that can be read, the newest first."""
    base, found = folder(), list[_Batch]()
    for path in base.iterdir() if base.is_dir() else []:
        if not path.name.startswith("."):
            with contextlib.suppress(InputError):
                found.append(_find(path.name))
    return sorted(found, key=lambda batch: batch.begun, reverse=True)


def batches(*, listener: Listener = SILENT) -> Facts:
    """The batches that are kept, the newest first."""
    found = _list_batches()
    return {"batches": [{"batch": each.folder.name, "title": each.plan.title, "state": each.state} for each in found]}


def show_batch(name: str) -> Facts:
    """A batch with its rows: what each is called, what is wrong with it, what became of it, what its proof says."""
    batch = _find(name)
    merged, run, plan, state = batch.read_table(), batch.journal_run, batch.plan, batch.state
    proofed = _facts(batch.folder / _FACTS)
    said = {entry["row"]: entry["why"] for entry in proofed.get("look_at", ())}
    bad = {entry["row"]: entry["reason"] for entry in proofed.get("failed", ())}
    bad |= {row.number: row.problem for row in merged.table if row.problem}
    states = batch.tell_states([row.number for row in merged.table], bad)
    rows = [
        {
            "row": row.number,
            "called": _called(row),
            "why": [bad[row.number]] if row.number in bad else said.get(row.number, []),
            "state": states[row.number],
        }
        for row in list(merged.table)[:_MOST_ROWS]
    ]
    return {
        "batch": name,
        "title": plan.title,
        "begun": batch.begun,
        "to": plan.to,
        "printer": plan.printer,
        "queues": list(plan.queues),
        "device": plan.device,
        "state": state,
        "ended": "" if run is None else run.ended,
        "seed": plan.writing.seed,
        "letters": merged.with_letters,
        "envelopes": merged.with_envelopes,
        "count": len(merged.table.rows),
        "rows": rows,
        "states": Counter(told.partition(":")[0] for told in states.values()),
        "left_out": sorted(batch.left_out),
        "proof": proofed,
        "file": (batch.folder / _PDF).is_file(),
        "rehearsed": batch.rehearsed,
        "key": plan.key,
        "test": plan.test,
        "webhook": {"url": plan.webhook, **_facts(batch.folder / _TOLD)} if plan.webhook else None,
    }


def _facts(path: Path) -> dict[str, Any]:
    try:
        facts: dict[str, Any] = msgspec.json.decode(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return facts


def prove_batch(name: str, *, listener: Listener = SILENT) -> Facts:
    """Make the proof of a batch; one that was approved is so no longer."""
    batch = _find(name)
    plan, path = batch.plan, batch.folder / _PROOF
    for gone in (_APPROVED, _FACTS, _REFUSED):
        (batch.folder / gone).unlink(missing_ok=True)
    device, printer = (plan.device or "grbl-servo", "") if plan.to == "plotter" else ("", plan.printer)
    options = ProofOptions(**_table_fields(plan.table), page=plan.page, printer=printer, device=device)
    merge = replace(batch.merge, approved=None)
    result = proof(batch.table, [path], options, plan.writing, plan.picture, merge, listener=listener)
    pictures = []
    for number, page in enumerate(result.pages):
        picture = f"proof-{number}.png"
        atomic.write(batch.folder / picture, page.data)
        pictures.append({"row": page.row, "part": page.called, "picture": picture})
    made = datetime.now().isoformat()
    facts: dict[str, Any] = {**result.facts(), "files": [], "pages_shown": pictures, "made": made}
    facts["failed"] = [{**each, "reason": _as_shown(each["reason"])} for each in facts["failed"]]
    facts["look_at"] = [{**each, "why": [*map(_as_shown, each["why"])]} for each in facts["look_at"]]
    atomic.write(batch.folder / _FACTS, json.dumps(facts, ensure_ascii=False).encode())
    return show_batch(name)


def approve_batch(name: str, made: str = "", left_out: Sequence[int] = ()) -> Facts:
    """Approve the proof of a batch, if named the one that was `made` then: what is made is what was looked at.

    left_out : rows, by their numbers in the file, that are not to be made.
    """
    batch = _find(name)
    if not (batch.folder / _FACTS).is_file():
        raise InputError(f"The batch {name} has no proof yet: make one, and look at it.")
    if made and _facts(batch.folder / _FACTS).get("made") != made:
        raise InputError("The proof was made anew elsewhere: look at that one first.")
    if not _facts(batch.folder / _FACTS).get("rows"):
        raise InputError(f"No row of the batch {name} can be made: put its table right, and keep it anew.")
    if unknown := sorted(set(left_out) - {row.number for row in batch.read_table().table}):
        raise InputError(f"left_out: the table of {name} has no {name_rows(unknown)}.")
    approved = json.dumps({"left_out": sorted(set(left_out))}).encode()
    if not set(_proofed_rows(batch)) - set(left_out):
        raise InputError("Every row is left out: there is nothing to make.")
    atomic.write(batch.folder / _APPROVED, approved)
    return show_batch(name)


def make_batch(name: str, ports: Sequence[str], at_zero: bool, *, listener: PageWire) -> Facts:
    """Print or plot a batch, or go on with it where its journal says; `ports` : of plotters, which share it.

    Raises InputError, DeviceError: it is not approved, or what the message says.
    """
    batch = _find(name)
    with (batch.folder / _PLAN).open("rb+") as plan:
        try:
            atomic.lock(plan)  # what its journal says is so until it is made
        except OSError as error:
            raise InputError(f"The batch {name} is being made by another program: wait until it is through.") from error
        return _make(batch, name, ports, at_zero, listener)


def _make(batch: _Batch, name: str, ports: Sequence[str], at_zero: bool, listener: PageWire) -> Facts:
    plan, merge = batch.plan, batch.merge
    if merge.approved is None:
        raise InputError(f"The proof of the batch {name} was not approved: approve it first.")
    run = batch.run_for(ports)
    if run is not None and run.ended == "done":
        raise InputError(f"All of the batch {name} was made: keep it anew to make it once more.")
    if plan.test:
        atomic.write(batch.folder / _TESTED, b"")
        return {**show_batch(name), "complete": True}
    # who keeps a batch anew and approves it wants all of it, whatever became of another with the same rows
    afresh = run is None and plan.to != "pdf"
    table = replace(plan.table, resume=run is not None, afresh=afresh, rows=_rows(batch))
    shared = len(_queues(plan) if plan.to == "printer" else ports) > 1
    try:
        with AtPage(listener, shared) as page:
            made = _print_or_plot(batch, table, (ports, at_zero), page)
    except KeyboardInterrupt:
        return {**show_batch(name), "complete": False}
    told: dict[str, Any] = made.facts()
    refused = {str(each["row"]): _as_shown(each["reason"]) for each in told["failed"]}
    atomic.write(batch.folder / _REFUSED, json.dumps(refused).encode())
    return {**show_batch(name), "complete": True, "made": {**told, "files": []}}


def _rows(batch: _Batch) -> str:
    """The rows that are made: those of its plan, without those that its proof says cannot be, or that were left out."""
    chosen, left_out = batch.plan.table.rows, batch.left_out
    if not _facts(batch.folder / _FACTS).get("failed") and not left_out:
        return chosen
    good = list[list[int]]()
    for row in _proofed_rows(batch):
        if row in left_out:
            continue
        if good and row == good[-1][1] + 1:
            good[-1][1] = row
        else:
            good.append([row, row])
    return ",".join(f"{first}-{last}" for first, last in good)


def _proofed_rows(batch: _Batch) -> list[int]:
    """The rows that its proof says can be made."""
    rows: list[int] = _facts((batch.folder / _PROOF).with_suffix(".json")).get("rows", [])
    return rows


def _print_or_plot(
    batch: _Batch, table: TableOptions, where: tuple[Sequence[str], bool], page: AtPage
) -> BatchDelivery:
    """What becomes of a batch at some ports, or at its printers."""
    (ports, at_zero), plan, merge = where, batch.plan, batch.merge
    if plan.to != "plotter":
        out = batch.folder / _PDF if plan.to == "pdf" else None
        if plan.to == "printer" and printers.resolve(plan.printer).simulated:
            out = batch.folder / "printed"
        own: dict[str, Any] = {"printer": plan.printer or "pdf", "queue": _queues(plan), "page": plan.page}
        printing = PrintOptions(**_table_fields(table), **own, dry_run=out)
        return print_(batch.table, printing, plan.writing, plan.picture, merge, attendant=page)
    for port in ports:
        known_port(port)
    ways = PlotOptions(device=plan.device, copies=plan.table.copies, grid=plan.grid)
    request = PlotRequest(
        Source(""), plan.writing, SheetOptions(plan.page, merge.margin, merge.pages), plan.picture, ways
    )
    attendance = AttendanceOptions(at_zero)
    return plot_rows(batch.table, request, ports, (table, merge), attendance, attendant=page)


def _queues(plan: BatchPlan) -> tuple[str, ...]:
    """The queues that share a batch: the printer's own, if it is one, and the further ones; none of a printer alone."""
    if not plan.queues:
        return ()
    profile = printers.resolve(plan.printer)
    return tuple(dict.fromkeys([*([profile.queue] if profile.queue else []), *plan.queues]))


def _table_fields(table: TableOptions) -> dict[str, Any]:
    """Its fields, for the options that are more than it."""
    return {field.name: getattr(table, field.name) for field in fields(TableOptions)}


def list_untold(name: str = "") -> list[dict[str, str]]:
    """What webhooks are to be told of batches that ended, one or all: `batch`, `id`, `url`, `secret`, `text`."""
    news = []
    for batch in [_find(name)] if name else _list_batches():
        if batch.plan.webhook and batch.state in ("done", "broken off"):
            facts = show_batch(batch.folder.name)
            text = json.dumps({each: facts[each] for each in ("batch", "key", "test", "state", "ended", "states")})
            told = {"id": hashlib.sha256(text.encode()).hexdigest()[:24], "why": ""}
            if _facts(batch.folder / _TOLD) != told:
                to = {"url": batch.plan.webhook, "secret": batch.plan.secret, "text": text}
                news.append({"batch": batch.folder.name, "id": told["id"], **to})
    return news


def note_told(name: str, id_: str, why: str) -> None:
    """Keep what a webhook was told, or why it could not be."""
    atomic.write(_find(name).folder / _TOLD, json.dumps({"id": id_, "why": why}).encode())


def edit_row(name: str, row: int, cells: Mapping[str, str], was: Mapping[str, str]) -> Facts:
    """Put cells of a row, by their headers, into the table of a batch that is not approved; all `cells` of it then.

    Its proof is to be made anew.  A workbook or a contacts file becomes delimited text.  `was` : cells as they were
    looked at; InputError where they are others now.
    """
    batch = _find(name)
    merged, table = batch.read_table(), batch.table
    found = next((each for each in merged.table if each.number == row), None)
    if found is None or not cells.keys() <= found.cells.keys():
        raise InputError(f"The table of {name} has no row {row}, or not all these columns.")
    if was.items() - found.cells.items():
        raise InputError(f"Row {row} was changed in another window meanwhile: open it again.")
    if cells and batch.state not in ("new", "proofed"):
        raise InputError(f"The batch {name} is approved: its rows stay as they were looked at.")
    if cells:
        texts = [list(record.cells) for record in read_sheet(table).records]
        for column, header in zip(merged.fields.columns, cell_names(merged.fields.columns), strict=True):
            texts[row - 1] += [""] * (column.number - len(texts[row - 1]))
            texts[row - 1][column.number - 1] = cells.get(header, texts[row - 1][column.number - 1])
        csv.writer(stream := io.StringIO()).writerows(texts)
        for gone in (_APPROVED, _FACTS):
            (batch.folder / gone).unlink(missing_ok=True)
        atomic.write(table, stream.getvalue().encode())  # what it is called says nothing of what it holds
    return {"row": row, "cells": {**found.cells, **cells}}


def forget_batch(name: str) -> str:
    """Delete a batch, made or not; what it was called.  Its journal stays."""
    batch = _find(name)
    shutil.rmtree(batch.folder, ignore_errors=True)
    return batch.plan.title


def batch_file(name: str, file: str) -> str:
    """The path of a picture of the proof, the proof, or what was made; InputError where there is none."""
    batch = _find(name)
    path = batch.folder / Path(file).name
    if file not in (_PROOF, _PDF) and not (path.suffix == ".png" and path.stem.startswith("proof-")):
        raise InputError(f"A batch has no file {file}.")
    if not path.is_file():
        raise InputError(f"The batch {name} has no file {file} yet.")
    return str(path)
