"""Hands that are kept: listed, shown, checked, corrected, given away and removed; and pens for scanned hands."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from handout import atomic, units
from handout.completion.completed_hand import complete_hand, outlook
from handout.errors import InputError, reported
from handout.hand import file, library, report
from handout.hand.corrections import AnyCorrection, CorrectionJournal, JournalEntry, KeepOut, read_corrections
from handout.hand.drawn import Hand
from handout.hand.pending import PendingLog
from handout.pipeline import texts
from handout.pipeline.hand_learning import learn
from handout.pipeline.inputs import hand_path, output_path, read_bytes
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions, seed_of
from handout.pipeline.results import SILENT, Delivery, Facts, Listener, Result, Tally
from handout.prompting.sentence_choice import lacks
from handout.sinks import check_outputs, write_drawings
from handout.sinks.png import to_png
from handout.writing.legibility import unclear_letters

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedHand

_SHEET_DPI = 200.0  # of pictures of letters side by side
_SPECIMEN = """\
{name}: {title}

The quick brown fox jumps over the lazy dog. Sphinx of black quartz, judge my vow! \
Two driven jocks help fax my big quiz; all questions asked by five watch experts amazed the judge.

à á â ã ä å æ ç è é ê ë ì í î ï ñ ò ó ô õ ö ø œ ß ù ú û ü ý ÿ ¿Qué? ¡Ñandú! Čapek, Škoda, Åsa, Øre, Élan, Übermut.

Minimum, aluminium, hill, letter, little, coffee, good food, off, address, bubble, happy, running, skiing, vacuum, \
success: how doubled letters look. The, and, of, to, in, that, is, was, he, for, it, with, as, his, on, be, at, by, \
I, this, had, not, are, but, from, or, have, an, they. 0123456789, 24 May, 7:30, £9.50, €12, 100 %."""
_ENLARGED = 3  # times the size in which one writes, on the specimen sheet of a drawn hand
_SPECIMEN_WIDTH = 420.0  # mm, that of a sheet of A3


@dataclass(frozen=True, kw_only=True)
class CheckedHand(Delivery):
    """What a scanned hand holds; table : how often each letter is there, in each place of a word."""

    table: str


def check_hand(
    name: str,
    output: str | Path | None = None,
    text: str | None = None,
    sheet: str | Path | None = None,
    questions: int = 24,
) -> CheckedHand:
    """What a scanned hand holds and what of it is doubtful, with a picture of its pages where one is asked for.

    output : a PNG file; several pages are numbered.
    text : one that is to be written, of which it is told how it comes by letters that are missing.
    sheet : a PNG file for the letters that may read badly in what is written, the most harmful first, at most so many
        `questions`; a JSON file beside it says which they are, for `answer_questions`.

    Raises InputError: there is no such hand; an output cannot be written, or would take the place of a file of
    something else.
    """
    asked = None if sheet is None else _sheet_files(sheet)
    path = None if output is None else output_path(output, ".png", "overlays are written as")
    hand = file.load(library.scanned_file(name))
    files: list[Path] = []
    if path is not None:
        count = len(hand.pages)
        numbered = [path.with_name(f"{path.stem}-{n}{path.suffix}") for n in range(1, count + 1)]
        files = [path] if count == 1 else numbered
        for number, picture in enumerate(files):
            atomic.write(picture, to_png(report.overlay(hand, number), hand.pages[number].dpi))
    told = {**report.facts(hand), "unclear": unclear_letters(hand)}
    if asked is not None:
        from handout.pipeline import letter_questions

        found = letter_questions.ask_letters(hand, questions)
        kept = letter_questions.question_file(hand, found)
        atomic.write(asked[0], to_png(letter_questions.draw_questions(hand, found), _SHEET_DPI))
        atomic.write(asked[1], msgspec.json.format(msgspec.json.encode(kept)))
        files += asked
        told["questions"] = msgspec.to_builtins(kept.questions)
    told["files"] = [*map(str, files)]
    if text is not None:
        fields = ("letter", "place", "needed", "here", "anywhere")
        lacking, ways = (lacks(text, hand.instances, least=1), outlook(hand, text)) if text else ((), ())
        told["lacks"] = [{field: getattr(lack, field) for field in fields} for lack in lacking]
        told["supply"] = [{"letter": way.letter, "how": way.how, "from": way.source} for way in ways]
    return CheckedHand(files=tuple(files), told=told, table=report.table(hand))


def _sheet_files(sheet: str | Path) -> tuple[Path, Path]:
    """The files of a sheet of questions; its JSON, which nobody named, takes no other file's place."""
    picture = output_path(sheet, ".png", "letters that may read badly are shown as")
    questions = picture.with_suffix(".json")
    if questions.exists():
        from handout.pipeline.letter_questions import read_questions

        try:
            read_questions(read_bytes(questions), str(questions))
        except InputError as error:
            raise InputError(f"{questions} would go with the sheet, and holds something else: name another.") from error
    return picture, questions


@dataclass(frozen=True)
class KeptHand(Result):
    """A hand in a file, and what else is told of it (`details`, for ``--json``)."""

    path: Path
    name: str | None = None
    details: Mapping[str, int | float] = field(default_factory=dict)
    letters: int = 0

    def facts(self) -> Facts:
        return {
            **({} if self.name is None else {"name": self.name}),
            "files": [str(self.path)],
            **self.details,
        }


def _edited_hand(
    path: Path, journal: CorrectionJournal, made: int = 0, glyphs: int = 0, notes: tuple[str, ...] = ()
) -> Delivery:
    """A hand that was corrected, or whose journal of corrections was looked at or turned back.

    made : corrections that were just made, the last entry in force of the journal; glyphs : letters of the hand.
    """
    entries = [
        {
            "corrections": msgspec.to_builtins(entry.corrections, enc_hook=float),
            "changes": msgspec.to_builtins(entry.changes),
            "in_force": number < journal.made,
        }
        for number, entry in enumerate(journal.entries)
    ]
    told = {
        "files": [str(path)],
        "made": made,
        "corrections": len(journal.corrections),
        "glyphs": glyphs,
        # the letters that changed though nobody named them
        "changes": entries[journal.made - 1]["changes"] if made else [],
        "journal": entries,
    }
    return Delivery(files=(path,), told=told, notes=notes)


def edit_hand(
    name: str,
    corrections: str | Path,
    output: str | Path | None = None,
    *,
    learning: bool = True,
    listener: Listener = SILENT,
) -> Delivery:
    """Make corrections to a scanned hand, after those that it has already, and align their pages anew.

    corrections : a JSON file; or a .hand file, whose corrections are made to this one, of the same pages read anew.
    learning : False: only what the corrections say is done.

    Raises InputError: the hand comes with the program and no `output` is given; corrections that cannot be read or
    made.
    """
    if str(corrections).endswith(file.SUFFIX):
        new = file.journal(Path(corrections)).corrections
    else:
        new = read_corrections(read_bytes(corrections), str(corrections))
    return _make_corrections(name, new, output, learning, listener)


def answer_questions(
    name: str,
    sheet: str | Path,
    answers: Sequence[str],
    output: str | Path | None = None,
    *,
    listener: Listener = SILENT,
) -> Delivery:
    """Correct a scanned hand by answers to the questions of a sheet, whose JSON file is given.

    Other letters learn from an answer that says what a letter is, not from one that only keeps letters out.

    Raises InputError: as `edit_hand`; answers that are to none of the questions (`letter_questions.read_answers`).
    """
    from handout.pipeline.letter_questions import read_answers

    new = read_answers(read_bytes(sheet), str(sheet), answers)
    return _make_corrections(name, new, output, not all(isinstance(one, KeepOut) for one in new), listener)


def _make_corrections(
    name: str, new: Sequence[AnyCorrection], output: str | Path | None, learning: bool, listener: Listener
) -> Delivery:
    from handout.tagging.relearning import correct

    source, path = _edited(name, output)
    with _held(source, path, listener):
        hand = file.load(source)
        corrected = correct(hand, new, learning=learning, tell=listener.progress)
        journal = file.record(source, path, hand, corrected.hand, JournalEntry(tuple(new), corrected.changes))
        learn(path)
    notes = corrected.notes
    if gone := "".join(sorted(hand.letters.keys() - corrected.hand.letters.keys())):
        notes = (*notes, f"None is left to write of {gone}: texts with it need --fallback, or another page.")
    return _edited_hand(path, journal, len(new), len(corrected.hand.glyphs), notes=notes)


@contextlib.contextmanager
def _held(source: Path, path: Path, listener: Listener) -> Iterator[None]:
    """Hold the file that is read and the one that is written, in one order whoever asks: nobody waits in a circle."""
    first, second = sorted((source.resolve(), path.resolve()))
    with atomic.hold_file(first, listener.say), atomic.hold_file(second, listener.say):
        yield


def _edited(name: str, output: str | Path | None) -> tuple[Path, Path]:
    """The file of a hand that is to be edited, and where the result goes."""
    source = library.scanned_file(name)
    path = hand_path(output) if output else source
    if library.comes_with_program(path):
        raise InputError(f"{path.stem} comes with the program: give a .hand file for the result with --output.")
    atomic.check_writable(path)
    return source, path


def undo_edits(name: str, count: int, output: str | Path | None = None, *, listener: Listener = SILENT) -> Delivery:
    """Turn the journal of corrections of a scanned hand back by `count` entries, or, negative, forward.

    Raises InputError: there are not so many; the hand comes with the program.
    """
    source, path = _edited(name, output)
    with _held(source, path, listener):
        journal = file.rewind(source, path, file.journal(source).made - count)
        return _edited_hand(path, journal, glyphs=len(file.load(path).glyphs))


def edits(name: str) -> Delivery:
    """What was corrected of a scanned hand."""
    source = library.scanned_file(name)
    return _edited_hand(source, file.journal(source))


def keep_pen(scans: Sequence[str | Path], output: str | Path, dpi: float | None = None) -> KeptHand:
    """Keep a pen to write in a scanned hand with, from scans of anything drawn with it; `details` has its width, mm."""
    from handout.inking.swatches import swatches
    from handout.scanning.picture_files import read_scan
    from handout.scanning.written_page import read_page
    from handout.tagging.page_tagging import pen_of_pages

    path = hand_path(output)
    # the size of what is drawn tells nothing of the resolution
    pages = [read_page(replace(read_scan(Path(scan), dpi), told=True)) for scan in scans]
    hand = pen_of_pages(path.stem, pages)
    samples = swatches(hand)
    file.save(hand, path)
    pieces = sum(len(sample.start) for sample in samples)
    return KeptHand(path, details={"pieces": pieces, "width": round(2 * samples[0].radius, 3)})


def export_hand(name: str, output: str | Path, *, ink_only: bool = False) -> KeptHand:
    """Copy a scanned hand into a file, to be given to somebody or kept; with `ink_only` without the scans it keeps."""
    source, path = library.scanned_file(name), hand_path(output)
    hand = file.check(source)
    with atomic.hold_file(path):
        atomic.write(path, file.without_scans(source) if ink_only else source.read_bytes())
    return KeptHand(path, notes=() if ink_only else scan_notes(hand))


def scan_notes(hand: ScannedHand) -> tuple[str, ...]:
    """What is to be said of the scans in the file of a hand."""
    if not (kept := _scans(hand)):
        return ()
    return (
        f"The file keeps the scan of {units.count(kept, 'page')} around the writing, so that what is painted is "
        "segmented anew; `handout hand export --ink-only` leaves it out.",
    )


def _scans(hand: ScannedHand) -> int:
    return sum(page.scan is not None for page in hand.pages)


def import_hand(source: str | Path, name: str | None = None, *, replaced: bool = False) -> KeptHand:
    """Put a .hand file among the user's own hands, in place of one of that name where it may be `replaced`."""
    hand = file.check(Path(source))  # its ink too: a damaged one would be found when it is written with
    name = name or Path(source).stem
    with atomic.hold_file(path := own_place(name, replaced=replaced)):
        own_place(name, replaced=replaced)  # nobody has taken the name meanwhile
        atomic.write(path, Path(source).read_bytes())
        PendingLog(path).forget()  # of the hand that had the name before
    return KeptHand(path, name, letters=len(hand.glyphs))


def copy_hand(source: str, name: str) -> KeptHand:
    """Put a copy of a scanned hand among the user's own, under another name."""
    return import_hand(library.scanned_file(source), name)


def own_place(name: str, *, replaced: bool = False) -> Path:
    """The file that a new hand among the user's own is to be kept in; its folder is there.

    Raises InputError: no name for a hand, or one that is taken and may not be `replaced`.
    """
    path = library.own_file(name)
    if path.exists() and not replaced:
        raise InputError(f"There is a hand {name!r} already: give another name, or replace it (--replace).")
    with reported(f"make the folder {path.parent}"):
        path.parent.mkdir(parents=True, exist_ok=True)
    return path


def remove_hand(name: str) -> KeptHand:
    """Delete a scanned hand from among the user's own hands."""
    own_hands = library.own_scanned()
    if name not in own_hands:
        others = f"; there are {', '.join(sorted(own_hands))}" if own_hands else ""
        raise InputError(f"Among your own hands there is none called {name!r}{others}.")
    with reported(f"delete {own_hands[name]}"), atomic.hold_file(own_hands[name]):
        own_hands[name].unlink()
        PendingLog(own_hands[name]).forget()
        own_hands[name].with_suffix(file.BESIDE).unlink(missing_ok=True)
    return KeptHand(own_hands[name], name)


@dataclass(frozen=True)
class ListedHand:
    """A hand that is known by name; `about` says how much it holds, or why it cannot be read.

    forms : of its letters, if it is drawn; glyphs : its letters, if it was scanned; scans : pages whose scan it keeps.
    """

    name: str
    title: str
    characters: str
    about: str
    forms: int | None = None
    glyphs: int = 0
    scans: int = 0

    def facts(self) -> Facts:
        """What ``--json`` prints."""
        facts: Facts = {"name": self.name, "title": self.title, "characters": self.characters}
        return {**facts, "forms": self.forms} if self.forms is not None else {
            **facts, "glyphs": self.glyphs, "scans": self.scans, "said": self.about
        }  # fmt: skip


@dataclass(frozen=True)
class HandList(Result):
    """The hands that are known by name, drawn ones and scanned ones."""

    drawn: Sequence[ListedHand]
    scanned: Sequence[ListedHand]

    def facts(self) -> Facts:
        return {
            "hands": [hand.facts() for hand in self.drawn],
            "scanned": [hand.facts() for hand in self.scanned],
        }


def list_hands() -> HandList:
    """The hands that are known by name, the program's and the user's own."""
    drawn = [_listed(library.load(name)) for name in library.names()]
    return HandList(drawn, [_listed_scan(name, path) for name, path in library.scanned_files().items()])


def listed_file(path: Path) -> ListedHand:
    """The hand of a .hand file, called as the file is."""
    return _listed_scan(path.stem, path)


def _listed(hand: Hand) -> ListedHand:
    forms = sum(len({glyph.form for glyph in glyphs}) for glyphs in hand.glyphs.values())
    about = f"{units.count(len(hand.glyphs), 'character')}, {units.count(forms, 'form')}"
    return ListedHand(hand.name, hand.title, "".join(hand.glyphs), about, forms)


def _listed_scan(name: str, path: Path) -> ListedHand:
    """A scanned hand; of one that cannot be read the reason."""
    try:
        hand = file.load(path)
    except InputError as error:
        return ListedHand(name, "cannot be read", "", str(error))
    about = (
        f"{units.count(len(hand.letters), 'character')}, {units.count(len(hand.glyphs), 'letter')} "
        f"from {units.count(len(hand.pages), 'scanned page')}"
    )
    return ListedHand(name, hand.title, "".join(hand.letters), about, None, len(hand.glyphs), _scans(hand))


def show_hand(
    name: str,
    outputs: Sequence[str | Path],
    text: str | None = None,
    writing_options: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
) -> Delivery:
    """A specimen sheet of a drawn hand at three times its size; or the letters of a scanned hand side by side.

    text : of a scanned hand: show which of its letters would write this, and why.
    """
    if name.endswith(file.SUFFIX) or name in library.scanned_files():
        return _show_scanned(file.load(library.scanned_file(name)), outputs, text, writing_options)
    if text is not None:
        raise InputError(f"--text shows how letters of a scanned hand are chosen, and {name} is a drawn one.")
    return _show_drawn(name, outputs, writing_options, picture)


def _show_drawn(
    name: str, outputs: Sequence[str | Path], writing_options: WritingOptions, picture: PictureOptions
) -> Delivery:
    from handout.writing.specimen import specimen

    check_outputs(outputs)
    task = texts.prepare(replace(writing_options, hand=name), SheetOptions("A4"), picture, lined=False)
    hand = task.hand
    assert hand.pages is None
    text = _SPECIMEN.format(name=hand.name, title=hand.title)
    rng = np.random.default_rng(task.seed)
    sheet = specimen(hand, text, rng, width=_SPECIMEN_WIDTH, x_height=_ENLARGED * task.layout.x_height)
    drawing = texts.draw(sheet, task, rng, {"title": f"Specimen of {hand.name}"})
    look = replace(task.look, pen=replace(task.look.pen, width=_ENLARGED * task.look.pen.width))
    files = write_drawings([drawing], outputs, look)
    listed = _listed(hand)
    tally = Tally.from_pages([sheet], [drawing])
    told = {**tally.facts(task.seed, hand.name, files), **listed.facts(), "files": [*map(str, files)]}
    return Delivery(tally=tally, seed=task.seed, files=tuple(files), told=told)


def _show_scanned(
    hand: ScannedHand, outputs: Sequence[str | Path], text: str | None, writing_options: WritingOptions
) -> Delivery:
    """The letters of a scanned hand, or those that would write a text, as PNG files."""
    files = tuple(output_path(output, ".png", "the letters of a scanned hand are shown as") for output in outputs)
    if text is None:
        pixels, found, tally = report.contact_sheet(hand), report.facts(hand), Tally()
    else:
        pixels, found, tally = _choices(hand, text, writing_options)
    for path in files:
        atomic.write(path, to_png(pixels, _SHEET_DPI))
    return Delivery(tally=tally, files=files, told={**found, "files": [*map(str, files)]})


def _choices(
    hand: ScannedHand, text: str, writing_options: WritingOptions
) -> tuple[NDArray[np.uint8], dict[str, Any], Tally]:
    """Which letters of a hand would write a text: a picture, and why in words."""
    from handout.writing.explaining import choices_sheet, explain, reasons

    seed = seed_of(writing_options.seed)
    completed, letters = complete_hand(hand, text, fallback=writing_options.fallback, seed=seed)
    assert completed.pages is not None
    hand = completed
    borrowed = [texts.letter_facts(letter) for letter in letters]
    explained = explain(hand, text, np.random.default_rng([seed]), writing_options.jitter)
    told = {"hand": hand.name, "text": text, "seed": seed, "why": reasons(hand, explained)}
    told |= {"borrowed": borrowed} if borrowed else {}
    return choices_sheet(hand, explained), told, Tally(borrowed=borrowed)
