"""Proofs: every page of a table's letters and envelopes, small, with what to look at first and what it costs.

A proof is a page for a browser (.html) or a printer (.pdf), and beside it a .json file by which a later run knows that
it makes what was looked at (`merging.approved_seed`).
"""

from __future__ import annotations

import base64
import html
import io
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from handout import atomic, units
from handout.errors import InputError
from handout.inking.papers import lay_ink
from handout.pipeline import merging, plotting
from handout.pipeline.merging import AT_EDGE, OUT_OF_REACH, WARNED, PageFinding, RowPages
from handout.pipeline.options import MergeOptions, PictureOptions, ProofOptions, SheetOptions, WritingOptions
from handout.pipeline.results import SILENT, Delivery, Facts, Listener, Told
from handout.plotting import plan
from handout.printing import media, printers
from handout.printing.journal import BACK, ENVELOPE
from handout.printing.prepared import BatchPage, margin_warning
from handout.printing.rows import TableRow, select
from handout.profiles import Plotter, Prices, Printer

_DPI = 96  # of the small pictures
_WIDE = 300  # pixels across a picture, on the screen
_EDGE = 4.0  # mm from the edge of the paper: what comes nearer is said; set by eye
_FIRST = 200  # rows that are named at the top
_PRICES = [name for name in Prices.__struct_fields__ if name != "currency"]
_MEASURES = ("ink_load", "pen_length")  # that are no prices, but what these are of
_MOST = 1e6  # of a price, as in a profile


@dataclass(frozen=True)
class Spent:
    """What a batch uses: sheets and envelopes; mm² of paper under ink; mm of line; s of a plotter, None without one."""

    sheets: int = 0
    envelopes: int = 0
    covered: float = 0.0
    line: float = 0.0
    machine: float | None = None


@dataclass(frozen=True)
class Costs:
    """What it costs: each item in money, None where its price is not known; `lacking` names the prices for these."""

    currency: str
    items: Mapping[str, float | None]
    lacking: tuple[str, ...]

    @property
    def total(self) -> float:
        """Of what is known."""
        return sum(cost for cost in self.items.values() if cost is not None)

    def facts(self) -> Facts:
        """For JSON."""
        items = {name: None if cost is None else round(cost, 4) for name, cost in self.items.items()}
        return {"currency": self.currency, **items, "total": round(self.total, 4), "unknown": list(self.lacking)}

    def sentence(self) -> str:
        """In words."""
        if all(cost is None for cost in self.items.values()):
            return f"What it costs is not known: give prices with --prices {'=…,'.join(self.lacking)}=…"
        known = ", ".join(f"{name} {cost:.2f}" for name, cost in self.items.items() if cost is not None)
        money = f"{self.total:.2f} {self.currency}".strip()
        if not self.lacking:
            return f"Cost: {money} ({known})."
        unknown = " and ".join(name for name, cost in self.items.items() if cost is None)
        return f"Cost: {money} ({known}) without {unknown}: not known is {', '.join(self.lacking)}."


def prices(machine: Plotter | Printer | None, given: str) -> Prices:
    """The prices of a machine's profile, with those that are given as ``"sheet=0.02,hour=4,currency=EUR"`` over them.

    Raises InputError: an unknown price, or one that is no number from 0.
    """
    changes: dict[str, str | float] = {}
    for part in filter(None, (part.strip() for part in given.split(","))):
        name, _, value = part.partition("=")
        changes[name] = value if name == "currency" else _price(name, value, part)
    return msgspec.structs.replace(machine.prices if machine is not None else Prices(), **changes)


def _price(name: str, value: str, part: str) -> float:
    try:
        price = float(value) if name in _PRICES else math.nan
    except ValueError:
        price = math.nan
    if not 0 <= price <= _MOST or (price == 0 and name in _MEASURES):
        known = ", ".join(_PRICES)
        raise InputError(f"prices: {part!r} is none; write sheet=0.02,hour=4.50,currency=EUR, of {known}.")
    return price


def costs(spent: Spent, at: Prices, plotted: bool) -> Costs:
    """What is spent, at these prices: by pens on a plotter, else by ink."""
    volume = None if at.ink_load is None else spent.covered * 1e-6 * at.ink_load
    pens = None if at.pen_length is None else spent.line * 1e-3 / at.pen_length
    # item → how much of it, its price, and what that is not known without
    wanted: dict[str, tuple[float | None, float | None, dict[str, float | None]]] = {}
    if spent.sheets:
        wanted["paper"] = spent.sheets, at.sheet, {"sheet": at.sheet}
    if spent.envelopes:
        wanted["envelopes"] = spent.envelopes, at.envelope, {"envelope": at.envelope}
    if plotted:
        wanted["pens"] = pens, at.pen, {"pen": at.pen, "pen_length": at.pen_length}
    else:
        wanted["ink"] = volume, at.ink, {"ink": at.ink, "ink_load": at.ink_load}
    if spent.machine is not None:
        wanted["machine"] = spent.machine / 3600, at.hour, {"hour": at.hour}
    items = {
        name: None if amount is None or price is None else amount * price for name, (amount, price, _) in wanted.items()
    }
    lacking = [name for _, _, needed in wanted.values() for name, value in needed.items() if value is None]
    return Costs(at.currency, items, tuple(lacking))


@dataclass(frozen=True)
class ProofPage:
    """A page in a proof: its row, what it is, its picture (PNG), its size in mm, and what to look at on it."""

    row: int
    part: str
    picture: bytes
    size: tuple[float, float]
    findings: tuple[PageFinding, ...] = ()


@dataclass(frozen=True, kw_only=True)
class TableProof(Delivery):
    """A proof of a table; costs : what all of it costs; pages : with their pictures."""

    costs: Costs
    pages: Sequence[ProofPage]


def proof(
    table: str | Path,
    outputs: Sequence[str | Path],
    options: ProofOptions = ProofOptions(),
    writing: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
    merge: MergeOptions = MergeOptions(),
    *,
    listener: Listener = SILENT,
) -> TableProof:
    """Write a proof of a table's letters and envelopes.

    outputs : .html and .pdf files; the file by which the proof is approved has the name of the first, with .json.

    Raises TableError, InputError: the table or the letter cannot be read, or an option is wrong.
    """
    paths = [Path(name) for name in outputs]
    record, machine = _check_options(paths, options)
    at = prices(machine, options.prices)
    sheet = SheetOptions(options.page, merge.margin, merge.pages, "A5" if isinstance(machine, Plotter) else "A4")
    pages = merging.open_rows(table, options, merge, (writing, sheet, picture), listener)
    hand = pages.look().hand.name
    if isinstance(machine, Printer):
        pages.fed = partial(media.printer_for, profile=machine)
    made = _Made(pages, machine, at)
    rows = select(pages.merge.table, options.rows)
    for number, row in enumerate(rows):
        listener.progress(number / len(rows), f"proof {number}/{len(rows)}")
        made.take(row)
    approved = {"seed": pages.seed, "rows": made.good, "facts": merging.approval(pages, options)}
    heading = f"{Path(table).name}, {hand}, seed {pages.seed}"
    shown = ((path, (_html if path.suffix.lower() == ".html" else _pdf)(made, heading)) for path in paths)
    atomic.write_all([*shown, (record, json.dumps(approved, ensure_ascii=False, indent=1).encode())])
    tally, files, notes = pages.account.tally, (*paths, record), tuple(pages.account.dropped)
    told: Told = {
        **tally.facts(pages.seed, hand, files),
        "rows": len(made.good),
        "failed": [{"row": row, "reason": reason} for row, reason in made.failed.items()],
        "look_at": [{"row": row, "why": [each.phrase for each in found]} for row, found in made.looked.items()],
        "sheets": dict(made.sheets),
        "ink_cm2": round(made.spent.covered / 100, 2),
        **({} if made.machine_s is None else {"machine_s": round(made.machine_s, 1)}),
        "cost": made.costs.facts(),
        "columns": {**pages.merge.table.facts()},
        **({"notes": list(notes)} if notes else {}),
    }
    told_of: dict[str, Any] = {"tally": tally, "seed": pages.seed, "files": files, "told": told, "notes": notes}
    return TableProof(**told_of, costs=made.costs, pages=made.pages)


def _check_options(paths: Sequence[Path], options: ProofOptions) -> tuple[Path, Printer | Plotter | None]:
    """The file by which a proof is approved, and the machine whose reach is looked at."""
    if not paths:
        raise InputError("A proof needs a file: give it with -o proof.html.")
    for path in paths:
        if path.suffix.lower() not in (".html", ".pdf"):
            raise InputError(f"{path}: a proof is written as .html or .pdf; give the file one of these endings.")
        atomic.check_writable(path)
    record = paths[0].with_suffix(".json")
    atomic.check_writable(record)
    if options.printer and options.device:
        raise InputError("--printer and --device are both given: a proof is of one machine.")
    machine: Printer | Plotter | None = printers.resolve(options.printer) if options.printer else None
    if options.device:
        machine = plotting.machine(options.device, None)
    return record, machine


@dataclass
class _Made:
    """The pages as they are written, one row after the other."""

    writer: RowPages
    machine: Printer | Plotter | None
    prices: Prices
    rows: list[int] = field(default_factory=list)
    pages: list[ProofPage] = field(default_factory=list)
    failed: dict[int, str] = field(default_factory=dict)
    looked: dict[int, list[PageFinding]] = field(default_factory=dict)
    sheets: Counter[str] = field(default_factory=Counter)
    spent: Spent = field(default_factory=Spent)

    @property
    def machine_s(self) -> float | None:
        """s that a plotter would take; None without one."""
        return self.spent.machine if isinstance(self.machine, Plotter) else None

    @property
    def costs(self) -> Costs:
        """What all of it costs."""
        return costs(replace(self.spent, machine=self.machine_s), self.prices, isinstance(self.machine, Plotter))

    @property
    def good(self) -> list[int]:
        """The rows that can be made."""
        return [row for row in self.rows if row not in self.failed]

    def take(self, row: TableRow) -> None:
        """Write a row and look at it."""
        self.rows.append(row.number)
        try:
            if row.problem:
                raise InputError(row.problem)
            pages = self.writer(row)
        except InputError as error:
            self.failed[row.number] = str(error)
            return
        found = self.writer.account.findings.pop(row.number, [])
        found += [PageFinding(WARNED, warning) for warning in row.warnings]
        placed = [self._of_page(page) for page in pages]
        every = sorted(dict.fromkeys([*found, *(finding for own, _ in placed for finding in own)]))
        if every:
            self.looked[row.number] = every
        for page, (own, seconds) in zip(pages, placed, strict=True):
            sheet = page.drawing.page
            self.sheets[sheet.name or f"{sheet.width:g} x {sheet.height:g} mm"] += row.copies
            called = "envelope" if page.part == ENVELOPE else page.part
            picture, covered = _small(page)
            self.pages.append(ProofPage(row.number, called, picture, (sheet.width, sheet.height), tuple(own)))
            self._spend(page, covered, seconds, row.copies)

    def _spend(self, page: BatchPage, covered: float, seconds: float, copies: int) -> None:
        """Count what the copies of a page use."""
        spent, envelope = self.spent, page.part == ENVELOPE
        self.spent = replace(
            spent,
            sheets=spent.sheets + copies * (not envelope and page.part != BACK),
            envelopes=spent.envelopes + copies * envelope,
            covered=spent.covered + copies * covered,
            line=spent.line + copies * page.drawing.pen_down,
            machine=(spent.machine or 0.0) + copies * seconds,
        )

    def _of_page(self, page: BatchPage) -> tuple[list[PageFinding], float]:
        """Findings on where a page's ink lies, and the s that a plotter would take for it."""
        drawing, found, seconds = page.drawing, list[PageFinding](), 0.0
        if isinstance(self.machine, Printer):
            fed = media.printer_for(drawing.page, self.machine)
            if warning := margin_warning(drawing, fed):
                found.append(PageFinding(OUT_OF_REACH, warning))
        elif isinstance(self.machine, Plotter) and drawing.strokes:
            try:
                seconds = plan(drawing, self.machine).duration
            except InputError as error:
                found.append(PageFinding(OUT_OF_REACH, str(error)))
        if not found and drawing.bounds is not None:
            x0, y0, x1, y1 = drawing.bounds
            near = min(x0, y0, drawing.page.width - x1, drawing.page.height - y1)
            if near < _EDGE:
                called = "the envelope" if page.part == ENVELOPE else page.part
                found.append(PageFinding(AT_EDGE, f"ink comes within {max(near, 0.0):.1f} mm of the edge of {called}"))
        return found, seconds


def _small(page: BatchPage) -> tuple[bytes, float]:
    """A small picture of a page on white, PNG, and how much of the paper its ink covers, mm²."""
    from PIL import Image

    raster = page.ink(_DPI)
    width, height = (max(round(side * _DPI / 25.4), 1) for side in (page.drawing.page.width, page.drawing.page.height))
    whole = Image.new("RGB", (width, height), "white")
    ink = Image.fromarray(lay_ink(raster, None))
    whole.paste(ink, (round(raster.origin[0] * _DPI / 25.4), round(raster.origin[1] * _DPI / 25.4)))
    stream = io.BytesIO()
    whole.quantize(32).save(stream, "PNG", optimize=True)
    return stream.getvalue(), float(raster.rgba[..., 3].sum()) * (25.4 / _DPI) ** 2


def _totals(made: _Made) -> str:
    """Pages, ink, time and cost, in two sentences."""
    tally = made.writer.account.tally
    sheets = ", ".join(f"{count} {name}" for name, count in made.sheets.items()) or "no page"
    ink = f", {made.spent.covered / 100:.1f} cm² of ink"
    ink += f", {made.spent.line / 1000:.1f} m of line" if made.spent.line else ""
    time = f", {units.duration(tally.duration)} of writing" if tally.duration else ""
    machine = f", {units.duration(made.machine_s)} on the plotter" if made.machine_s else ""
    return f"{units.count(len(made.good), 'row')}: {sheets}{ink}{time}{machine}. {made.costs.sentence()}"


def _list_first(made: _Made) -> list[tuple[int, str, int]]:
    """Rows that want looking at, the most urgent first: number, what, rank."""
    rows = [(row, reason, -1) for row, reason in made.failed.items()]
    rows += [(row, "; ".join(finding.phrase for finding in found), found[0].rank) for row, found in made.looked.items()]
    return sorted(rows, key=lambda entry: (entry[2], entry[0]))[:_FIRST]


_STYLE = f"""body{{font:14px sans-serif;margin:24px;background:#eee;color:#222}}
figure{{display:inline-block;margin:8px;vertical-align:top;width:{_WIDE}px}}
img{{width:100%;background:#fff;border:1px solid #aaa}} .look img{{border:3px solid #c30}}
figcaption{{font-size:12px}} li.failed{{color:#c00}} a{{color:inherit}}"""


def _html(made: _Made, heading: str) -> bytes:
    """The proof for a browser, in one file."""
    first = "".join(
        f'<li{" class=failed" if rank < 0 else ""}><a href="#row-{row}">row {row}</a>: {html.escape(why)}</li>'
        for row, why, rank in _list_first(made)
    )
    begins = {page.row: n for n, page in reversed(list(enumerate(made.pages)))}
    figures = "".join(_figure(made, page, begins[page.row] == n) for n, page in enumerate(made.pages))
    look = f"<h2>Look at these first</h2><ol>{first}</ol>" if first else "<p>Nothing wants looking at first.</p>"
    text = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(heading)}</title>'
        f"<style>{_STYLE}</style><h1>{html.escape(heading)}</h1><p>{html.escape(_totals(made))}</p>{look}"
        f"<h2>Every page</h2>{figures}</html>\n"
    )
    return text.encode()


def _figure(made: _Made, page: ProofPage, first: bool) -> str:
    """A page with its caption; the first of a row is where links to that row lead."""
    where = f' id="row-{page.row}"' if first else ""
    look = ' class="look"' if page.row in made.looked else ""
    picture = base64.b64encode(page.picture).decode()
    own = "".join(f"<br>{html.escape(finding.phrase)}" for finding in page.findings)
    return (
        f'<figure{where}{look}><img alt="row {page.row}, {page.part}" src="data:image/png;base64,{picture}">'
        f"<figcaption>row {page.row}, {html.escape(page.part)}{own}</figcaption></figure>"
    )


def _pdf(made: _Made, heading: str) -> bytes:
    """The proof for a printer: A4, what to look at first, then twelve pages on a page."""
    from reportlab.lib.pagesizes import A4
    from reportlab.lib.utils import ImageReader, simpleSplit
    from reportlab.pdfgen.canvas import Canvas

    stream = io.BytesIO()
    canvas = Canvas(stream, pagesize=A4, invariant=True)
    width, height = A4
    y = height - 50.0
    lines = [heading, _totals(made), "", *(f"row {row}: {why}" for row, why, _ in _list_first(made))]
    for line in lines:
        told = line.encode("cp1252", "replace").decode("cp1252")  # in the letters that every PDF has
        for part in simpleSplit(told, "Helvetica", 9, width - 80) or [""]:
            if y < 50:
                canvas.showPage()
                y = height - 50.0
            canvas.setFont("Helvetica", 9)
            canvas.drawString(40, y, part)
            y -= 13.0
    across, down, edge = 3, 4, 30.0
    wide, high = (width - 2 * edge) / across, (height - 2 * edge) / down
    for number, page in enumerate(made.pages):
        if number % (across * down) == 0:
            canvas.showPage()
        column, row = number % across, number // across % down
        room = wide - 10.0, high - 24.0
        scale = min(room[0] / page.size[0], room[1] / page.size[1])
        w, h = page.size[0] * scale, page.size[1] * scale
        x, top = edge + column * wide, height - edge - row * high
        canvas.drawImage(ImageReader(io.BytesIO(page.picture)), x, top - h, w, h)
        canvas.setStrokeColorRGB(*((0.8, 0.2, 0.0) if page.row in made.looked else (0.6, 0.6, 0.6)))
        canvas.rect(x, top - h, w, h)
        canvas.setFont("Helvetica", 7)
        canvas.drawString(x, top - h - 9.0, f"row {page.row}, {page.part}")
    canvas.save()
    return stream.getvalue()
