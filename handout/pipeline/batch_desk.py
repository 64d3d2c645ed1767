"""Batches as a page attends to them: a table and a letter are kept, proofed, approved, then printed or plotted."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import shutil
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from handout import atomic
from handout.errors import InputError
from handout.pipeline.batch_store import (
    APPROVED,
    FACTS,
    PDF,
    PLAN,
    PROOF,
    REFUSED,
    TESTED,
    TOLD,
    KeptBatch,
    find_batch,
    folder,
    list_batches,
    read_batch,
    read_facts,
)
from handout.pipeline.batch_trial import as_shown, name_row
from handout.pipeline.inputs import Source, check_pictures
from handout.pipeline.merging import SENT_PICTURES
from handout.pipeline.options import (
    BatchPlan,
    PrintOptions,
    ProofOptions,
    SheetOptions,
    TableOptions,
    seed_of,
)
from handout.pipeline.plot_desk import AtPage, PageWire, known_port
from handout.pipeline.plot_request import AttendanceOptions, PlotOptions, PlotRequest
from handout.pipeline.plot_rows import plot_rows
from handout.pipeline.printing import print_
from handout.pipeline.proofing import proof
from handout.pipeline.results import SILENT, Facts, Listener
from handout.pipeline.row_work import BatchDelivery
from handout.plotting.jobs.store import free_name
from handout.printing import printers
from handout.printing.address_rows import cell_names
from handout.printing.rows import name_rows
from handout.printing.table_files import read_sheet

_PATIENCE = 10.0  # s that a batch with a key waits for another to be kept
# a text as a letter that has no gaps
_ONCE = "{% raw %}", "{% endraw %}{{ '{%' }}{% raw %}", "{% endraw %}"
_MOST_ROWS = 2000  # that are shown; all are made
_MOST_TABLE = 20 << 20  # bytes; a hundred thousand addresses have about ten million


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
        same = next((batch for batch in list_batches() if batch.plan.key == plan.key), None)
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
        atomic.write(work / PLAN, json.dumps(kept, ensure_ascii=False).encode())
        read_batch(work).read_table()
        name = free_name(work, base).name
    except OSError as error:
        raise InputError(f"Cannot keep the batch in {base}: {error.strerror or error}.") from error
    finally:
        if work is not None and work.exists():
            shutil.rmtree(work, ignore_errors=True)
    return show_batch(name)


def batches(*, listener: Listener = SILENT) -> Facts:
    """The batches that are kept, the newest first."""
    found = list_batches()
    return {"batches": [{"batch": each.folder.name, "title": each.plan.title, "state": each.state} for each in found]}


def show_batch(name: str) -> Facts:
    """A batch with its rows: what each is called, what is wrong with it, what became of it, what its proof says."""
    batch = find_batch(name)
    merged, run, plan, state = batch.read_table(), batch.journal_run, batch.plan, batch.state
    proofed = read_facts(batch.folder / FACTS)
    said = {entry["row"]: entry["why"] for entry in proofed.get("look_at", ())}
    bad = {entry["row"]: entry["reason"] for entry in proofed.get("failed", ())}
    bad |= {row.number: row.problem for row in merged.table if row.problem}
    states = batch.tell_states([row.number for row in merged.table], bad)
    rows = [
        {
            "row": row.number,
            "called": name_row(row),
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
        "file": (batch.folder / PDF).is_file(),
        "rehearsed": batch.rehearsed,
        "key": plan.key,
        "test": plan.test,
        "webhook": {"url": plan.webhook, **read_facts(batch.folder / TOLD)} if plan.webhook else None,
    }


def prove_batch(name: str, *, listener: Listener = SILENT) -> Facts:
    """Make the proof of a batch; one that was approved is so no longer."""
    batch = find_batch(name)
    plan, path = batch.plan, batch.folder / PROOF
    for gone in (APPROVED, FACTS, REFUSED):
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
    facts["failed"] = [{**each, "reason": as_shown(each["reason"])} for each in facts["failed"]]
    facts["look_at"] = [{**each, "why": [*map(as_shown, each["why"])]} for each in facts["look_at"]]
    atomic.write(batch.folder / FACTS, json.dumps(facts, ensure_ascii=False).encode())
    return show_batch(name)


def approve_batch(name: str, made: str = "", left_out: Sequence[int] = ()) -> Facts:
    """Approve the proof of a batch, if named the one that was `made` then: what is made is what was looked at.

    left_out : rows, by their numbers in the file, that are not to be made.
    """
    batch = find_batch(name)
    if not (batch.folder / FACTS).is_file():
        raise InputError(f"The batch {name} has no proof yet: make one, and look at it.")
    if made and read_facts(batch.folder / FACTS).get("made") != made:
        raise InputError("The proof was made anew elsewhere: look at that one first.")
    if not read_facts(batch.folder / FACTS).get("rows"):
        raise InputError(f"No row of the batch {name} can be made: put its table right, and keep it anew.")
    if unknown := sorted(set(left_out) - {row.number for row in batch.read_table().table}):
        raise InputError(f"left_out: the table of {name} has no {name_rows(unknown)}.")
    approved = json.dumps({"left_out": sorted(set(left_out))}).encode()
    if not set(_proofed_rows(batch)) - set(left_out):
        raise InputError("Every row is left out: there is nothing to make.")
    atomic.write(batch.folder / APPROVED, approved)
    return show_batch(name)


def make_batch(name: str, ports: Sequence[str], at_zero: bool, *, listener: PageWire) -> Facts:
    """Print or plot a batch, or go on with it where its journal says; `ports` : of plotters, which share it.

    Raises InputError, DeviceError: it is not approved, or what the message says.
    """
    batch = find_batch(name)
    with (batch.folder / PLAN).open("rb+") as held:
        try:
            atomic.lock(held)  # what its journal says is so until it is made
        except OSError as error:
            raise InputError(f"The batch {name} is being made by another program: wait until it is through.") from error
        plan, merge = batch.plan, batch.merge
        if merge.approved is None:
            raise InputError(f"The proof of the batch {name} was not approved: approve it first.")
        run = batch.run_for(ports)
        if run is not None and run.ended == "done":
            raise InputError(f"All of the batch {name} was made: keep it anew to make it once more.")
        if plan.test:
            atomic.write(batch.folder / TESTED, b"")
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
        refused = {str(each["row"]): as_shown(each["reason"]) for each in told["failed"]}
        atomic.write(batch.folder / REFUSED, json.dumps(refused).encode())
        return {**show_batch(name), "complete": True, "made": {**told, "files": []}}


def _rows(batch: KeptBatch) -> str:
    """The rows that are made: those of its plan, without those that its proof says cannot be, or that were left out."""
    chosen, left_out = batch.plan.table.rows, batch.left_out
    if not read_facts(batch.folder / FACTS).get("failed") and not left_out:
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


def _proofed_rows(batch: KeptBatch) -> list[int]:
    """The rows that its proof says can be made."""
    rows: list[int] = read_facts((batch.folder / PROOF).with_suffix(".json")).get("rows", [])
    return rows


def _print_or_plot(
    batch: KeptBatch, table: TableOptions, where: tuple[Sequence[str], bool], page: AtPage
) -> BatchDelivery:
    """What becomes of a batch at some ports, or at its printers."""
    (ports, at_zero), plan, merge = where, batch.plan, batch.merge
    if plan.to != "plotter":
        out = batch.folder / PDF if plan.to == "pdf" else None
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
    for batch in [find_batch(name)] if name else list_batches():
        if batch.plan.webhook and batch.state in ("done", "broken off"):
            facts = show_batch(batch.folder.name)
            text = json.dumps({each: facts[each] for each in ("batch", "key", "test", "state", "ended", "states")})
            told = {"id": hashlib.sha256(text.encode()).hexdigest()[:24], "why": ""}
            if read_facts(batch.folder / TOLD) != told:
                to = {"url": batch.plan.webhook, "secret": batch.plan.secret, "text": text}
                news.append({"batch": batch.folder.name, "id": told["id"], **to})
    return news


def note_told(name: str, id_: str, why: str) -> None:
    """Keep what a webhook was told, or why it could not be."""
    atomic.write(find_batch(name).folder / TOLD, json.dumps({"id": id_, "why": why}).encode())


def edit_row(name: str, row: int, cells: Mapping[str, str], was: Mapping[str, str]) -> Facts:
    """Put cells of a row, by their headers, into the table of a batch that is not approved; all `cells` of it then.

    Its proof is to be made anew.  A workbook or a contacts file becomes delimited text.  `was` : cells as they were
    looked at; InputError where they are others now.
    """
    batch = find_batch(name)
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
        for gone in (APPROVED, FACTS):
            (batch.folder / gone).unlink(missing_ok=True)
        atomic.write(table, stream.getvalue().encode())  # what it is called says nothing of what it holds
    return {"row": row, "cells": {**found.cells, **cells}}


def forget_batch(name: str) -> str:
    """Delete a batch, made or not; what it was called.  Its journal stays."""
    batch = find_batch(name)
    shutil.rmtree(batch.folder, ignore_errors=True)
    return batch.plan.title


def batch_file(name: str, file: str) -> str:
    """The path of a picture of the proof, the proof, or what was made; InputError where there is none."""
    batch = find_batch(name)
    path = batch.folder / Path(file).name
    if file not in (PROOF, PDF) and not (path.suffix == ".png" and path.stem.startswith("proof-")):
        raise InputError(f"A batch has no file {file}.")
    if not path.is_file():
        raise InputError(f"The batch {name} has no file {file} yet.")
    return str(path)
