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
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import msgspec

from handout import atomic, units
from handout.errors import InputError
from handout.inking.papers import lay_ink
from handout.pipeline import merging, plotting
from handout.pipeline.merging import AT_EDGE, OUT_OF_REACH, WARNED, PageFinding
from handout.pipeline.options import MergeOptions, PictureOptions, ProofOptions, SheetOptions, WritingOptions
from handout.pipeline.results import SILENT, Delivery, Facts, Listener, Told
from handout.pipeline.row_work import BatchDelivery, make_all
from handout.plotting import plan
from handout.printing import media, printers
from handout.printing.batch import BatchOptions
from handout.printing.journal import BACK, ENVELOPE, Journal
from handout.printing.prepared import BatchPage, Destination, PreparedPage, margin_warning
from handout.printing.rows import TableRow
from handout.printing.sending import Report
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
        try:
            price = float(value) if name in _PRICES else math.nan
        except ValueError:
            price = math.nan
        if name != "currency" and (not 0 <= price <= _MOST or (price == 0 and name in _MEASURES)):
            known = ", ".join(_PRICES)
            raise InputError(f"prices: {part!r} is none; write sheet=0.02,hour=4.50,currency=EUR, of {known}.")
        changes[name] = value if name == "currency" else price
    return msgspec.structs.replace(machine.prices if machine is not None else Prices(), **changes)


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
class ProofPage(PreparedPage):
    """A page in a proof, with its picture (PNG) as its data.

    row : its number; findings : what to look at on it.
    covered : mm² of paper under its ink; line : mm; seconds : that a plotter would take for it.
    """

    row: int = 0
    findings: tuple[PageFinding, ...] = ()
    covered: float = 0.0
    line: float = 0.0
    seconds: float = 0.0

    @property
    def called(self) -> str:
        """Which part of its row it is."""
        return "envelope" if self.part == ENVELOPE else self.part


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
    found = dict[int, list[PageFinding]]()
    with ProofPages(machine, at) as made:
        run = options, Journal(seed=pages.seed)
        done = make_all(pages, made, BatchOptions(options.rows), run, found=found, listener=listener)
    made.note_rows(pages.merge.table, found, done.report)
    approved = {"seed": pages.seed, "rows": done.report.rows, "facts": merging.approval(pages, options)}
    heading, write = f"{Path(table).name}, {hand}, seed {pages.seed}", {".html": _html, ".pdf": _pdf}
    shown = ((path, write[path.suffix.lower()](made, heading, made.totals(done))) for path in paths)
    atomic.write_all([*shown, (record, json.dumps(approved, ensure_ascii=False, indent=1).encode())])
    files, same = (*paths, record), {name: getattr(done, name) for name in ("tally", "seed", "notes")}
    told: Told = {
        **done.tally.facts(pages.seed, hand, files),
        **{name: done.told[name] for name in ("rows", "failed")},
        "look_at": [{"row": row, "why": [each.phrase for each in found]} for row, found in made.looked.items()],
        "sheets": dict(made.sheets),
        "ink_cm2": round(made.spent.covered / 100, 2),
        **({} if made.machine_s is None else {"machine_s": round(made.machine_s, 1)}),
        "cost": made.costs.facts(),
        **{name: done.told[name] for name in ("columns", "notes") if name in done.told},
    }
    return TableProof(**same, files=files, told=told, costs=made.costs, pages=made.pages)


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


@dataclass(frozen=True)
class _PageProof:
    """Prepares a page: its small picture, where its ink lies, and what it takes."""

    machine: Printer | Plotter | None

    def __call__(self, number: int, page: BatchPage) -> ProofPage:
        from PIL import Image

        drawing, scale, (found, seconds) = page.drawing, _DPI / 25.4, self._look_at(page)
        raster, sides = page.ink(_DPI), (drawing.page.width, drawing.page.height)
        width, height = (max(round(side * scale), 1) for side in sides)
        whole, stream = Image.new("RGB", (width, height), "white"), io.BytesIO()
        ink = Image.fromarray(lay_ink(raster, None))
        whole.paste(ink, (round(raster.origin[0] * _DPI / 25.4), round(raster.origin[1] * _DPI / 25.4)))
        whole.quantize(32).save(stream, "PNG", optimize=True)
        covered, data = float(raster.rgba[..., 3].sum()) / 255 / scale**2, stream.getvalue()
        return ProofPage(page.part, drawing.page, data, "", number, tuple(found), covered, drawing.pen_down, seconds)

    def _look_at(self, page: BatchPage) -> tuple[list[PageFinding], float]:
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


class ProofPages(Destination):
    """The pages of a proof, with what they use.

    failed, looked : row → why it cannot be made, and what is to be looked at on its pages.
    """

    def __init__(self, machine: Printer | Plotter | None, at: Prices) -> None:
        super().__init__()
        self.prepare, self._plotted, self._prices = _PageProof(machine), isinstance(machine, Plotter), at
        self.pages, self.sheets, self.spent = list[ProofPage](), Counter[str](), Spent()
        self.failed, self.looked = dict[int, str](), dict[int, list[PageFinding]]()

    def take(self, number: int, pages: Sequence[PreparedPage], copies: int) -> None:
        """Keep the row's pages, and count what the copies of them use."""
        for page in pages:
            assert isinstance(page, ProofPage)
            self.pages.append(page)
            self.looked.setdefault(number, []).extend(page.findings)
            self.sheets[page.page.name or f"{page.page.width:g} x {page.page.height:g} mm"] += copies
            envelope, spent = page.part == ENVELOPE, self.spent
            self.spent = replace(
                spent,
                sheets=spent.sheets + copies * (not envelope and page.part != BACK),
                envelopes=spent.envelopes + copies * envelope,
                covered=spent.covered + copies * page.covered,
                line=spent.line + copies * page.line,
                machine=(spent.machine or 0.0) + copies * page.seconds,
            )

    def note_rows(self, rows: Sequence[TableRow], found: Mapping[int, Sequence[PageFinding]], report: Report) -> None:
        """Note what is to be looked at of every row that was made, and why others cannot be."""
        self.failed = {each.row: each.reason for each in report.failed}
        for row in (row for row in rows if row.number in report.rows):
            warned = [PageFinding(WARNED, warning) for warning in row.warnings]
            if every := sorted({*found.get(row.number, []), *warned, *self.looked.pop(row.number, [])}):
                self.looked[row.number] = every

    @property
    def machine_s(self) -> float | None:
        """s that a plotter would take; None without one."""
        return self.spent.machine if self._plotted else None

    @property
    def costs(self) -> Costs:
        """What all of it costs."""
        return costs(replace(self.spent, machine=self.machine_s), self._prices, self._plotted)

    def totals(self, done: BatchDelivery) -> str:
        """Pages, ink, time and cost, in two sentences."""
        sheets = ", ".join(f"{count} {name}" for name, count in self.sheets.items()) or "no page"
        ink = f", {self.spent.covered / 100:.1f} cm² of ink"
        ink += f", {self.spent.line / 1000:.1f} m of line" if self.spent.line else ""
        time = f", {units.duration(done.tally.duration)} of writing" if done.tally.duration else ""
        machine = f", {units.duration(self.machine_s)} on the plotter" if self.machine_s else ""
        rows = units.count(len(done.report.rows), "row")
        return f"{rows}: {sheets}{ink}{time}{machine}. {self.costs.sentence()}"


def _list_first(made: ProofPages) -> list[tuple[int, str, int]]:
    """Rows that want looking at, the most urgent first: number, what, rank."""
    rows = [(row, reason, -1) for row, reason in made.failed.items()]
    rows += [(row, "; ".join(finding.phrase for finding in found), found[0].rank) for row, found in made.looked.items()]
    return sorted(rows, key=lambda entry: (entry[2], entry[0]))[:_FIRST]


_STYLE = f"""body{{font:14px sans-serif;margin:24px;background:#eee;color:#222}}
figure{{display:inline-block;margin:8px;vertical-align:top;width:{_WIDE}px}}
img{{width:100%;background:#fff;border:1px solid #aaa}} .look img{{border:3px solid #c30}}
figcaption{{font-size:12px}} li.failed{{color:#c00}} a{{color:inherit}}"""


def _html(made: ProofPages, heading: str, totals: str) -> bytes:
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
        f"<style>{_STYLE}</style><h1>{html.escape(heading)}</h1><p>{html.escape(totals)}</p>{look}"
        f"<h2>Every page</h2>{figures}</html>\n"
    )
    return text.encode()


def _figure(made: ProofPages, page: ProofPage, first: bool) -> str:
    """A page with its caption; the first of a row is where links to that row lead."""
    where = f' id="row-{page.row}"' if first else ""
    look = ' class="look"' if page.row in made.looked else ""
    picture = base64.b64encode(page.data).decode()
    own = "".join(f"<br>{html.escape(finding.phrase)}" for finding in page.findings)
    return (
        f'<figure{where}{look}><img alt="row {page.row}, {page.called}" src="data:image/png;base64,{picture}">'
        f"<figcaption>row {page.row}, {html.escape(page.called)}{own}</figcaption></figure>"
    )


def _pdf(made: ProofPages, heading: str, totals: str) -> bytes:
    """The proof for a printer: A4, what to look at first, then twelve pages on a page."""
    from reportlab.lib.pagesizes import A4
    from reportlab.lib.utils import ImageReader, simpleSplit
    from reportlab.pdfgen.canvas import Canvas

    stream = io.BytesIO()
    canvas = Canvas(stream, pagesize=A4, invariant=True)
    width, height = A4
    y = height - 50.0
    lines = [heading, totals, "", *(f"row {row}: {why}" for row, why, _ in _list_first(made))]
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
        scale = min(room[0] / page.page.width, room[1] / page.page.height)
        w, h = page.page.width * scale, page.page.height * scale
        x, top = edge + column * wide, height - edge - row * high
        canvas.drawImage(ImageReader(io.BytesIO(page.data)), x, top - h, w, h)
        canvas.setStrokeColorRGB(*((0.8, 0.2, 0.0) if page.row in made.looked else (0.6, 0.6, 0.6)))
        canvas.rect(x, top - h, w, h)
        canvas.setFont("Helvetica", 7)
        canvas.drawString(x, top - h - 9.0, f"row {page.row}, {page.called}")
    canvas.save()
    return stream.getvalue()
