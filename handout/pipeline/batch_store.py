"""A batch as it is kept: a folder with its table, its letter and its plan, and what became of its rows.

Whoever comes later, to whatever program, goes on with the same; the rows are in the journal that every batch has
(`printing.journal`).
"""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from handout import shipped
from handout.errors import InputError
from handout.pipeline import merging
from handout.pipeline.options import BatchPlan, MergeOptions, PictureOptions, TableOptions, WritingOptions
from handout.pipeline.results import SILENT
from handout.plotting.connections import is_simulated
from handout.printing import journal
from handout.printing.journal import JournalRun, Piece, PieceStep

PLAN, PROOF, FACTS, APPROVED, PDF = "batch.json", "proof.pdf", "proof-facts.json", "approved", "batch.pdf"
REFUSED = "refused.json"  # rows that were not begun when it was made last, and why
TESTED, TOLD = "tested", "told.json"  # of a test that was made; of what its webhook was told last


_PARTS: dict[str, type[Any]] = {
    "writing": WritingOptions, "picture": PictureOptions, "table": TableOptions, "merge": MergeOptions,
}  # fmt: skip


@dataclass(frozen=True)
class KeptBatch:
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
        proofed = (self.folder / PROOF).with_suffix(".json")
        approved = proofed if (self.folder / APPROVED).is_file() else None
        given = frozenset[str]()
        return replace(self.plan.merge, letter=letter, approved=approved, alone=True, given=given)

    @property
    def left_out(self) -> frozenset[int]:
        """The rows that whoever approved it left out."""
        return frozenset(read_facts(self.folder / APPROVED).get("left_out", ()))

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
        if (self.folder / PDF).is_file() or (self.folder / TESTED).is_file():
            return "done"
        if (self.folder / APPROVED).is_file():
            return "approved"
        return "proofed" if (self.folder / FACTS).is_file() else "new"

    def tell_states(self, rows: Sequence[int], bad: Collection[int]) -> dict[int, str]:
        """What became of its rows, some of which cannot be made."""
        run, done = self.journal_run, "simulated" if self.rehearsed else "tested" if self.plan.test else "done"
        states = dict.fromkeys(rows, done if run is None and self.state == "done" else "")
        states |= {int(row): f"failed: {why}" for row, why in read_facts(self.folder / REFUSED).items()}
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


def read_batch(path: Path) -> KeptBatch:
    """A batch of its folder."""
    data = msgspec.json.decode((path / PLAN).read_bytes())
    begun, asked = data.pop("begun"), data.pop("asked", "")
    for name, kind in _PARTS.items():
        data[name] = kind(**data[name])
    data["table"] = replace(data["table"], columns=tuple(data["table"].columns))
    data["queues"] = tuple(data.get("queues", ()))
    return KeptBatch(path, BatchPlan(**data), begun, asked)


def find_batch(name: str) -> KeptBatch:
    """A batch by its name; InputError where there is none."""
    try:
        return read_batch(folder() / name)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"There is no batch {name}, or it cannot be read.") from error


def list_batches() -> list[KeptBatch]:
    """Those that can be read, the newest first."""
    base, found = folder(), list[KeptBatch]()
    for path in base.iterdir() if base.is_dir() else []:
        if not path.name.startswith("."):
            with contextlib.suppress(InputError):
                found.append(find_batch(path.name))
    return sorted(found, key=lambda batch: batch.begun, reverse=True)


def read_facts(path: Path) -> dict[str, Any]:
    """What a file of a batch says; nothing where it is not there."""
    try:
        facts: dict[str, Any] = msgspec.json.decode(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return facts
