"""A table and a letter: every row's pages, the letter it fills and its envelope, for printers and plotters alike.

The pages of a row depend on the seed, the row, the letter, the hand and the program alone.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from handout import page_sizes, units
from handout.errors import InputError
from handout.hand import library
from handout.inking.device_pixels import Calibrate
from handout.letters import letter_file as letter_files
from handout.letters.document import LetterHead
from handout.merging.fields import Fields, RowManner, count_copies, doubts, tell_repeats
from handout.merging.sheets import overlay_drawings
from handout.merging.template import LetterTemplate
from handout.pipeline.declarations import list_declared
from handout.pipeline.inputs import LETTERS, decode_text, is_file, read_bytes
from handout.pipeline.letters import LetterDocument, prepare_letter
from handout.pipeline.options import MergeOptions, PictureOptions, SheetOptions, TableOptions, WritingOptions, seed_of
from handout.pipeline.results import Listener, Tally
from handout.pipeline.texts import INK, TextDocument, WritingTask, prepare, program
from handout.pipeline.writing import Document
from handout.printing import address, envelope, journal, media
from handout.printing.address_table import Addresses, read_addresses, read_rows
from handout.printing.batch import BatchOptions, chosen_rows
from handout.printing.journal import BACK, ENVELOPE, Batch, Journal
from handout.printing.prepared import BatchPage
from handout.printing.queue import Say
from handout.printing.rows import TableRow, name_rows, select
from handout.profiles import Printer
from handout.reading import second_reader
from handout.sinks import drawing_file
from handout.values import Drawing, Manuscript, Page
from handout.writing.layout import Layout

SENT_PICTURES = "pictures"  # the folder beside a letter that stands alone, with those that were sent with it
# the head of a letter file, as `letters.letter_file` finds it
_HEAD = re.compile(r"\ufeff?(?:---|\+\+\+)[ \t]*\n(?:.*\n)*?(?:---|\+\+\+)[ \t]*(?:\n|\Z)")
# options that the head of a letter file may give, too
_OF_HEADS = frozenset(LetterHead.__struct_fields__)
_LOOK = ("pen", "pen_width", "ink")  # of `PictureOptions`, what prints show
_MOST_SENDER = 6  # lines of a return address: more do not fit the corner of an envelope
_SENDER, _TICK = 1_000_003, 2_000_003  # added to the seed: a sender does not vary as the address beside it does


@dataclass(frozen=True)
class MailMerge:
    """A table, and what is made of each of its rows.

    letter : the template that rows fill; None where letters stand in a column, or where there are envelopes only.
    head : the head of a letter file with the lines around it, which has no gaps; None for a plain text.
    sender : the lines of the return address.
    """

    path: Path
    table: Addresses
    options: MergeOptions
    letter: LetterTemplate | None
    head: str | None = None
    sender: tuple[str, ...] = ()

    @property
    def fields(self) -> Fields:
        """What letters call the columns."""
        return Fields(self.table.columns)

    @property
    def with_letters(self) -> bool:
        return self.letter is not None or self.fields.says("text")

    @property
    def with_envelopes(self) -> bool:
        return self.options.with_envelopes or not self.with_letters

    def language_of(self, manner: RowManner, usual: str) -> str:
        """The language of a row: its own, else that of the head, unless `usual` was asked for."""
        given = self.options.given
        asked = usual != WritingOptions.language if given is None else "language" in given
        if manner.language or asked or not self.head:
            return manner.language or usual
        return letter_files.load(f"{self.head}x", Path(str(self.options.letter)).name).head.language or usual


def read_merge(path: Path, table: TableOptions, options: MergeOptions, listener: Listener) -> MailMerge:
    """Read a table and its letter, and check what needs no writing; the listener hears how they were read.

    Raises TableError, InputError: the table or the letter cannot be read, or does not fit the other.
    """
    letter, head = (None, None) if options.letter is None else _letter(Path(options.letter), listener)
    rows = read_rows(path, table.columns)
    names = Fields(rows.columns)
    with_text = names.says("text")
    if letter is not None and with_text:
        raise InputError("--letter and a column for the text are both given: the letter stands in one of them.")
    if letter is not None:
        names.check(letter, str(path))
    used = names.used_headers(list(letter.names) if letter else [])
    alone = letter is None and not with_text
    if alone or options.with_envelopes or options.window or (letter is not None and "address" in letter.names):
        rows = read_addresses(path, table.columns, table.address, table.no_name, used)
    if not alone:
        asked = [replace(row, warnings=(*row.warnings, *doubts(row, sorted(used)))) for row in rows]
        rows = replace(rows, rows=tuple(asked))
    rows = tell_repeats(_abroad(count_copies(rows), options.home_country), used, once=options.once)
    listener.say(*(f"{path}: {note}." for note in rows.notes))
    return MailMerge(path, rows, options, letter, head, _sender(options, listener))


def _letter(path: Path, listener: Listener) -> tuple[LetterTemplate, str | None]:
    """The letter in a file, and the head of a Markdown file."""
    text = decode_text(read_bytes(path), str(path), listener)
    if not text.strip():
        raise InputError(f"{path} is empty: there is no letter to write.")
    if path.suffix.lower() not in LETTERS:
        return LetterTemplate(text, path.name), None
    head = ((match := _HEAD.match(text)) and match.group()) or ""
    return LetterTemplate(text[len(head) :], path.name, markdown=True, first_line=1 + head.count("\n")), head


def _abroad(table: Addresses, home: str) -> Addresses:
    """The addresses without the country of the sender, and with others in the sender's script."""
    if not home:
        return table
    country = address.find(home)
    if country is None:
        raise InputError(f"home country: {home!r} is no country that is known; give a name or a code such as DE.")
    rows = []
    for row in table:
        *rest, last = row.lines or ("",)
        named = address.find(last) if len(rest) > 1 else None
        if named == country:
            row = replace(row, lines=tuple(rest))
        elif named is not None and (own := address.spell_abroad(last, country)) != last:
            said = f"the country {last} is written {own}, in the sender's letters"
            row = replace(row, lines=(*rest, own), warnings=(*row.warnings, said))
        rows.append(row)
    return replace(table, rows=tuple(rows))


def _sender(options: MergeOptions, listener: Listener) -> tuple[str, ...]:
    """The lines of a return address, a text or its file; one line is broken at its commas."""
    given = options.return_address
    text = given.replace("\\n", "\n")
    if not options.alone and is_file(text):
        text = decode_text(Path(text).read_bytes(), text, listener)
    lines = text.strip().split("\n")
    if len(lines) == 1:
        lines = lines[0].split(",")
    sender = tuple(line.strip() for line in lines if line.strip())
    if len(sender) > _MOST_SENDER or (given and not sender):
        raise InputError(f"return address: {len(sender)} lines; give 1 to {_MOST_SENDER}, or a file that has them.")
    return sender


def begin_batch(
    pages: RowPages,
    table: TableOptions,
    more: Mapping[str, object],
    *,
    envelopes_to: Sequence[str] = (),
    out: Path | None = None,
    dry_run: bool,
) -> tuple[BatchOptions, Journal]:
    """Choose the rows of a batch and open its journal (`journal_of`); the pages get the seed that it was begun with.

    Raises InputError: the batch cannot be begun, or gone on with; or no row of it is to be made.
    """
    merge = pages.merge
    if envelopes_to and not (merge.with_letters and merge.options.with_envelopes):
        raise InputError("--envelopes-to is for letters with envelopes: give it with --letter and --with-envelopes.")
    pages.seed = approved_seed(pages, table)
    record = journal_of(pages, table, {**more, "page_name": pages.sheet.page_name}, dry_run)
    pages.seed = record.seed
    # of letters one that cannot be made keeps all others from being made; of approved pages that is known not to be
    whole = merge.with_letters and not merge.options.skip_bad and merge.options.approved is None
    options = BatchOptions(table.rows, table.copies, table.again, out, whole)
    chosen_rows(merge.table, options, record.resumed)
    return options, record


def journal_of(pages: RowPages, table: TableOptions, more: Mapping[str, object], dry_run: bool) -> Journal:
    """The journal of a batch: a new one, the one that is resumed, or one in memory alone where nothing is made.

    A hand that has neither name nor file leaves no journal: the next run could not tell whether it is the same.

    table : every option of the device; more : further ones, by their names.

    Raises InputError: the batch cannot be begun, or gone on with.
    """
    if dry_run and (table.resume or table.afresh):
        raise InputError("--resume and --afresh are for what is made: leave them out of a --dry-run.")
    hand = pages.writing.hand
    if dry_run or not isinstance(hand, str):
        return Journal(seed=pages.seed)
    if table.resume and table.afresh:
        raise InputError("--resume goes on with a batch, --afresh makes all of it again: give one of them.")
    look = {name: getattr(pages.picture, name) for name in _LOOK}
    facts = {**_list_options(table), **_list_options(pages.writing), **look, **more}
    what = _batch(pages.merge, hand, facts)
    kept = journal.resume(what) if table.resume else journal.begin(what, pages.seed, afresh=table.afresh)
    if pages.merge.options.approved is not None and kept.seed != pages.seed:
        raise InputError(f"--approved: the batch was begun with seed {kept.seed}, and the proof has {pages.seed}.")
    return kept


def _batch(merge: MailMerge, hand: str, facts: dict[str, object]) -> Batch:
    """What identifies a batch when it is resumed: its table, its letter, its hand and its options.

    Of the options for letters only those that were given count, so that a batch of envelopes is the same as before
    there were letters.
    """
    usual = _list_options(MergeOptions())
    if second_reader.find():  # with it other glyphs may be chosen
        facts['content of the extra "reader"'] = "there"
    facts |= {name: value for name, value in _list_options(merge.options).items() if value != usual[name]}
    cells = merge.with_letters or any(merge.fields.says(setting) for setting in ("hand", "pen"))
    if cells:
        facts |= {"program": program(), "content of the rows' hands": _digest_of_hands(merge)}
    if merge.letter is not None:
        if merge.head is not None:
            named = ",".join(sorted((merge.options.given or frozenset()) & _OF_HEADS))
            facts["content of the options"] = hashlib.sha256(named.encode()).hexdigest()
        facts["content of the letter"] = hashlib.sha256(Path(str(merge.options.letter)).read_bytes()).hexdigest()
    if merge.sender:
        facts["return_address"] = "\n".join(merge.sender)
    return journal.batch(merge.path, merge.table, library.path(hand), facts, cells)


def _list_options(options: object) -> dict[str, object]:
    """The options that change something on paper, by name."""
    names = (each.name for each, declaration in list_declared(options) if declaration.of_batch)
    values = {name: getattr(options, name) for name in names}
    if rewritten := values.pop("rewritten", ()):
        values["rewritten"] = repr(rewritten)
    return {name: ",".join(value) if isinstance(value, tuple) else value for name, value in values.items()}


def _digest_of_hands(merge: MailMerge) -> str:
    """A digest of the files of the hands that rows name; "" if no row names one."""
    names = sorted({manner.hand for row in merge.table if (manner := merge.fields.manner(row)).hand})
    files = [library.path(name) for name in names]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files if file.is_file())).hexdigest() if names else ""


class PageFinding(NamedTuple):
    """What to look at on a page: how much it matters, 0 most; and a phrase."""

    rank: int
    phrase: str


OUT_OF_REACH, AT_EDGE, DOUBTFUL, SHRUNK, SPARSE, LENT, BROKEN, SLIP, WARNED = range(9)
_FEW = 2  # lines: a last page that has no more looks forgotten; set by eye
_SHRUNK = 0.99  # of the size that was asked for: what is nearer to it nobody sees


@dataclass
class RowAccount:
    """What was written for some rows; accounts add up.

    dropped : sentences on what no pen writes of the letters; said : sentences that must be seen at once.
    findings : number of a row → what to look at on its pages, by how much that matters.
    """

    tally: Tally = field(default_factory=Tally)
    dropped: dict[str, None] = field(default_factory=dict)
    said: dict[str, None] = field(default_factory=dict)
    findings: dict[int, list[PageFinding]] = field(default_factory=dict)

    def add(self, other: RowAccount) -> list[str]:
        """Add another account, without its findings; returns the sentences that are to be said now."""
        self.tally += other.tally
        new = [sentence for sentence in other.said if sentence not in self.said]
        self.dropped |= other.dropped
        self.said |= other.said
        return new


@dataclass
class RowPages:
    """Writes the pages of rows, and counts what was written.

    sheet : of the letters, or without letters of the envelopes; seed : wins over that of `writing`.
    wanted : of a scanned hand its ink or its strokes.
    calibrated : (task, name of its hand, who hears sentences on it) → how its ink goes to the printer.
    fed : page → the printer as it is fed with it; None of a machine that reaches all of a page.
    draws : False: pages are set, which tells whether a text fits, and stay blank.
    account : of the rows since `settle` was called.

    A pickled one has neither the rows of its table, nor its account, nor what it has loaded.
    """

    merge: MailMerge
    writing: WritingOptions
    sheet: SheetOptions
    picture: PictureOptions
    wanted: frozenset[str] = INK
    calibrated: Callable[[WritingTask, str, Say], Calibrate | None] | None = None
    fed: Callable[[Page], Printer] | None = None
    seed: int = 0
    draws: bool = True
    account: RowAccount = field(default_factory=RowAccount)
    _tasks: dict[tuple[bool, RowManner], WritingTask] = field(default_factory=dict)
    _calibrations: dict[str, Calibrate | None] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, Any]:
        bare = replace(self.merge, table=replace(self.merge.table, rows=()))
        return {**self.__dict__, "merge": bare, "account": RowAccount(), "_tasks": {}, "_calibrations": {}}

    def settle(self) -> RowAccount:
        """Return the account since the last call, and begin a new one."""
        settled, self.account = self.account, RowAccount()
        return settled

    def check(self, row: TableRow) -> None:
        """Whether a row can be written, as far as setting tells: text, letters, address, and whether it fits its page.

        Raises InputError: it cannot.
        """
        replace(self, draws=False)(row)

    @property
    def envelope_page(self) -> Page:
        """The envelope, as it is read."""
        if self.merge.with_letters:
            return page_sizes.page(self.merge.options.envelope)
        return page_sizes.page(self.sheet.page_name)

    @property
    def address_x_height(self) -> float | None:
        """The x-height of addresses, mm, where it is asked for and there are no letters; None: chosen for each."""
        given = self.writing.x_height is not None and not self.merge.with_letters
        return self.look().layout.x_height if given else None

    def margins(self, page: Page) -> tuple[float, float, float, float]:
        """What the machine does not reach of a page: (top, right, bottom, left), mm."""
        return (0.0, 0.0, 0.0, 0.0) if self.fed is None else media.page_margins(page, self.fed(page))

    def sheets(self) -> list[Page]:
        """The sizes of the pages of a row."""
        letters = [self.look().layout.page] if self.merge.with_letters else []
        return [*letters, *([self.envelope_page] if self.merge.with_envelopes else [])]

    def look(self) -> WritingTask:
        """How rows are written that name no manner of their own, be it letters or envelopes."""
        if self.merge.head is None:
            return self.task(self.merge.with_letters, RowManner())
        return self._letter_file("a", RowManner()).task

    def __call__(self, row: TableRow) -> list[BatchPage]:
        """The pages of a row: its letter, its envelope, the back of that.

        Raises InputError: the row cannot be written.
        """
        manner, pages = self.merge.fields.manner(row), list[BatchPage]()
        for name in (manner.hand, manner.pen) if self.merge.options.alone else ():
            if name and not letter_files.BARE.fullmatch(name):
                alone = "and this table stands alone, without files"
                raise InputError(f"{name!r} is no bare name of a hand or a pen, {alone}")
        if self.merge.with_letters:
            pages += self._letter(row, manner)
        if self.merge.with_envelopes:
            pages += self._envelope(row, manner)
        return pages

    def hand_of(self, task: WritingTask) -> str:
        """The name of the hand in which rows are written that name none."""
        return self.writing.hand if isinstance(self.writing.hand, str) else task.hand.name

    def task(self, of_letter: bool, manner: RowManner) -> WritingTask:
        """How a row's letter or envelope is written."""
        key = of_letter, replace(manner, text="")
        if key not in self._tasks:
            options, picture = self.options_of(manner)
            if of_letter:
                task = prepare(options, self.sheet, picture)
            else:
                edge = SheetOptions(f"{self.envelope_page.width}x{self.envelope_page.height}mm", "0mm", 1)
                task = prepare(replace(options, slips=0.0), edge, replace(picture, paper="none"))
            self._tasks[key] = task
        return self._tasks[key]

    def options_of(self, manner: RowManner) -> tuple[WritingOptions, PictureOptions]:
        """How a row is written and looks, by its own columns where these say so."""
        hand, language = manner.hand or self.writing.hand, manner.language or self.writing.language
        writing = replace(self.writing, hand=hand, language=language)
        return writing, replace(self.picture, pen=manner.pen or self.picture.pen)

    def text(self, row: TableRow, manner: RowManner) -> str:
        """The letter of a row."""
        if self.merge.letter is not None:
            language = self.merge.language_of(manner, self.writing.language)
            return self.merge.letter.fill(self.merge.fields.values(row), row.cells, language)
        if not manner.text:
            raise InputError("there is no text for its letter")
        return manner.text

    def _letter(self, row: TableRow, manner: RowManner) -> list[BatchPage]:
        text, window, read = self.text(row, manner), None, None
        if self.merge.head is not None:
            read = self._letter_file(text, manner)
        task = self.task(True, manner) if read is None else read.task
        if self.merge.options.window:
            window = _window(self.merge.options.window, task.layout.page)
            _check_address(row)
        if read is None:
            distance = task.layout.baseline_distance(task.hand.pitch)
            # empty lines keep the letter clear of what the window shows
            above = max(int(-(-(window.below - task.layout.margin[0]) // distance)), 0) if window else 0
            drawings = self._write_text("\n" * above + text, task, row)
        else:
            if window is not None:
                top, right, bottom, left = read.first.margin
                read = replace(read, first=replace(read.first, margin=(max(top, window.below), right, bottom, left)))
            drawings = self._pages_of(read, row, read.task.layout)
        first = [drawings[0]]
        if window is not None:
            layout = envelope.box_layout(task.layout.page, window.box, *_extent(row.lines), task.layout.x_height)
            first += self._write_text("\n".join(row.lines), replace(task, slips=0.0, paper=None), row, layout, _SENDER)
        if self.merge.options.tick:
            first += self._write_tick(row, task)
        drawings[0] = overlay_drawings(first, task.layout.page) if len(first) > 1 else first[0]
        return [self._page(f"letter {n}", drawing, task, manner) for n, drawing in enumerate(drawings, 1)]

    def _letter_file(self, text: str, manner: RowManner) -> LetterDocument:
        """The letter file of a row, with its hands and layouts."""
        path, given = Path(str(self.merge.options.letter)), self.merge.options.given
        alone = self.merge.options.alone
        folder = path.parent / SENT_PICTURES if alone else path.parent
        letter = letter_files.load(f"{self.merge.head}{text}", path.name, folder, alone=alone)
        self.account.dropped |= dict.fromkeys(letter.dropped)
        options, picture = self.options_of(manner)
        own = {name for name in ("hand", "pen", "language") if getattr(manner, name)}
        return prepare_letter(
            letter, replace(options, seed=self.seed), self.sheet, picture, None if given is None else given | own
        )

    def _envelope(self, row: TableRow, manner: RowManner) -> list[BatchPage]:
        _check_address(row)
        task, page, options = self.task(False, manner), self.envelope_page, self.merge.options
        layout = envelope.address_layout(page, *_extent(row.lines), self.address_x_height)
        front, back = self._write_text("\n".join(row.lines), task, row, layout), list[Drawing]()
        if sender := self.merge.sender:
            layout = envelope.sender_layout(page, *_extent(sender), options.return_at == "back", self.margins(page))
            written = self._write_text("\n".join(sender), task, row, layout, _SENDER)
            front, back = (front, written) if options.return_at == "back" else ([*front, *written], [])
        if options.tick:
            front += self._write_tick(row, task)
        pages = [self._page(ENVELOPE, overlay_drawings(front, page) if len(front) > 1 else front[0], task, manner)]
        return [*pages, *(self._page(BACK, drawing, task, manner) for drawing in back)]

    def _write_tick(self, row: TableRow, task: WritingTask) -> list[Drawing]:
        number = str(row.number)
        page = task.layout.page
        layout = envelope.tick_layout(page, len(number), self.margins(page))
        return self._write_text(number, replace(task, slips=0.0, paper=None), row, layout, _TICK)

    def _write_text(
        self, text: str, task: WritingTask, row: TableRow, layout: Layout | None = None, other: int = 0
    ) -> list[Drawing]:
        """Write a text of a row; `other` : added to the seed, so that it varies otherwise than the main text."""
        if layout is not None:
            wanted = task.layout
            spacing = wanted.line_spacing or layout.line_spacing
            layout = replace(layout, align=wanted.align, jitter=wanted.jitter * layout.jitter, line_spacing=spacing)
            task = replace(task, pages=1)
        task = replace(task, seed=self.seed + other)
        return self._pages_of(TextDocument(text, task, layout), row, layout or task.layout)

    def _pages_of(self, document: Document, row: TableRow, layout: Layout) -> list[Drawing]:
        """Draw a document, count its pages, and note what is to be looked at."""
        if not self.draws:
            document.check(row.number)
            return [Drawing((), layout.page)]
        pages = document.draw(self.wanted, row.number)
        self.account.findings.setdefault(row.number, []).extend(_findings(pages.manuscripts, layout))
        self.account.tally += pages.tally
        return list(pages.drawings)

    def _page(self, part: str, drawing: Drawing, task: WritingTask, manner: RowManner) -> BatchPage:
        from handout.inking import pens

        left_out = ("words", "lines") if self.wanted & INK else ()
        about = {name: value for name, value in drawing.about.items() if name not in left_out}
        drawing, look = replace(drawing, about=about), task.look
        hand = manner.hand or self.hand_of(task)
        if hand not in self._calibrations and self.calibrated is not None and self.draws:
            self._calibrations[hand] = self.calibrated(task, hand, lambda text: self.account.said.update({text: None}))
        return BatchPage(
            part,
            drawing,
            lambda dpi: pens.ink(drawing, dpi, look.pen, pens.noise(drawing.about)),
            self._calibrations.get(hand),
            lambda path: drawing_file(drawing, path, look),
        )


def open_rows(
    table: str | Path,
    options: TableOptions,
    merge: MergeOptions,
    how: tuple[WritingOptions, SheetOptions, PictureOptions],
    listener: Listener,
    wanted: frozenset[str] = INK,
) -> RowPages:
    """Read a table and its letter (`read_merge`); gives what writes its rows, without letters on envelopes DL.

    how : rows are written, on which sheet, and look.
    """
    merged, (writing, sheet, picture) = read_merge(Path(table), options, merge, listener), how
    sheet = sheet if merged.with_letters else replace(sheet, usual_page="DL")
    return RowPages(merged, writing, sheet, picture, wanted, seed=seed_of(writing.seed))


def _check_address(row: TableRow) -> None:
    if not row.lines:
        raise InputError("there is no street, place or address in it")


def _extent(lines: Sequence[str]) -> tuple[int, int]:
    """How many lines, and the characters of the longest."""
    return len(lines), max(map(len, lines))


def _window(name: str, page: Page) -> envelope.EnvelopeWindow:
    known = envelope.WINDOWS.get(name) or envelope.WINDOWS.get(name.upper())
    if known is None:
        raise InputError(f"window: {name!r} is none of {', '.join(envelope.WINDOWS)}.")
    wanted = page_sizes.page(known.page)
    if abs(page.width - wanted.width) > 1 or abs(page.height - wanted.height) > 1:
        raise InputError(
            f"window: an envelope {name} with a window takes letters of {known.page}: use --page {known.page}."
        )
    return known


def _findings(pages: Sequence[Manuscript], layout: Layout) -> Iterator[PageFinding]:
    """What to look at on the pages of one text."""
    size = min((page.x_height for page in pages), default=layout.x_height)
    if size < _SHRUNK * layout.x_height:
        yield PageFinding(SHRUNK, f"written at {size / layout.x_height:.0%} of its size, so that it fits")
    if len(pages) > 1 and len(pages[-1].lines) <= _FEW:
        yield PageFinding(SPARSE, f"its last page, {len(pages)}, has {units.count(len(pages[-1].lines), 'line')} only")
    for letter in pages[0].about.get("borrowed", []) if pages else []:
        if not letter["own"]:
            yield PageFinding(LENT, f"{letter['letter']!r}, {letter['count']} times, is {letter['from']}")
    for page in pages:
        for doubt in page.about.get("doubtful", []):
            yield PageFinding(DOUBTFUL, f"{doubt['word']!r} may be read as {doubt['reads_as'] or 'nothing'!r}")
        for slip in page.about.get("slips", []):
            yield PageFinding(SLIP, f"struck out and written again: {slip.get('word', '')!r}")
        yield from _find_broken(page)


def _find_broken(page: Manuscript) -> Iterator[PageFinding]:
    """Words that go on in the next line."""
    for above, below in itertools.pairwise(line for line in page.lines if line.placed):
        last = above.placed[-1]
        if below.placed[0].at == last.at + 1:
            word = "".join(placed.glyph.letter for placed in above.placed if placed.word == last.word)
            yield PageFinding(BROKEN, f"a word goes on in the next line after {word!r}")


def approval(pages: RowPages, table: TableOptions) -> dict[str, object]:
    """All that decides how the pages of a table look, without the seed, as a proof keeps it."""
    hand = pages.writing.hand
    if not isinstance(hand, str):
        raise InputError("A hand that is in memory alone cannot be told again: approve pages of a hand with a name.")
    options = {name: value for name, value in _list_options(pages.writing).items() if name != "seed"}
    sheet = {"page_name": pages.sheet.page_name, "margin": pages.sheet.margin, "pages": pages.sheet.pages}
    read = {"columns": ",".join(table.columns), "address": table.address}
    look = {name: getattr(pages.picture, name) for name in _LOOK}
    facts = _batch(pages.merge, hand, {**read, **options, **look, **sheet}).facts
    if pages.merge.sender or pages.merge.options.tick:  # which keep to what the printer reaches
        facts = {**facts, "content of the printer's margins": repr([pages.margins(page) for page in pages.sheets()])}
    told: dict[str, object] = json.loads(json.dumps({name: fact for name, fact in facts.items() if fact is not None}))
    return told


def approved_seed(pages: RowPages, table: TableOptions) -> int:
    """The seed of the approved proof of these pages; their own where no proof is named.

    Raises InputError: it is no proof, or something has changed since: the message says what.
    """
    path = pages.merge.options.approved
    if path is None:
        return pages.seed
    try:
        proof = msgspec.json.decode(Path(path).read_bytes())
        facts, seed, rows = dict(proof["facts"]), int(proof["seed"]), set(proof["rows"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = getattr(error, "strerror", None) or "it is no proof of handout"
        raise InputError(f"--approved: {path} cannot be read: {reason}; handout proof makes one.") from error
    now = approval(pages, table)
    changes = journal.changes(facts, now)
    if pages.writing.seed not in (None, seed):
        changes.append(f"--seed was {seed} and is now {pages.writing.seed}")
    asked = {row.number for row in select(pages.merge.table, table.rows)}
    if more := sorted(asked - rows):
        changes.append(f"{name_rows(more)} {'is' if len(more) == 1 else 'are'} not in it")
    if changes:
        raise InputError(f"The proof {path} does not hold any more, because {' and '.join(changes)}: make a new one.")
    return seed
