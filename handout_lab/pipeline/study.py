"""A study of hands: sheets on which people tell real writing from made, their scans read, and the answers scored."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from numpy.typing import NDArray

from handout import atomic, units
from handout.errors import InputError
from handout.hand import file, library
from handout.pipeline.options import SheetOptions, WritingOptions, seed_of
from handout.pipeline.results import SILENT, Fact, Facts, Listener, Result
from handout.pipeline.writing import write
from handout.progress import narrow_reports
from handout.prompting.sheet_layout import paper_of_name
from handout.scanning.picture_files import read_picture
from handout.tagging.page_sources import chosen_pages
from handout_lab.pipeline.options import StudyOptions
from handout_lab.pipeline.study_material import Material, Twin, material, parted, pictures_in, twins
from handout_lab.study import answers as answering
from handout_lab.study import design, evenness, scoring, sheets
from handout_lab.study.answers import Answer
from handout_lab.study.design import Item, Key, Person, Snippet
from handout_lab.study.figure import figure
from handout_lab.study.scoring import Scores as Scores
from handout_lab.study.scoring import Share as Share

if TYPE_CHECKING:
    from handout_lab.pipeline.study_material import Parted
    from handout_lab.study.evenness import Tell
    from handout_lab.study.scoring import Difficulty, Taken
    from handout_lab.study.snippets import Picture

_READ, _WRITTEN = 0.1, 0.9  # of the work on a study, when its pages are known, and when all is written; measured
KEY, SHEETS, ABOUT = "study.key", "sheets.pdf", "study.json"
_MOST_PEOPLE = 10_000  # far more than any study has: a bound against slips
_FEWEST_ENVELOPES = 4  # two of either kind
_FEWEST_PARTED = 4  # people: two of either kind
_MOST_ROWS = 125  # of a kind: the code of a sheet counts rows in a byte, and pairs and controls together
_ADDRESS = "45mm,10mm,10mm,90mm"  # margins of an envelope: the address stands right of its middle
_CHOSEN = "The controls decided who counts: their own share is too high for that, and is no finding."
_STAYS = "whose size, slant and distance of lines stay those of all"


@dataclass(frozen=True, eq=False)
class MadeStudy(Result):
    """A study that was made.

    name : of the study, printed on its sheets; tells : what might give the made snippets away.
    sampling : how snippets were dealt.
    """

    name: str
    files: tuple[Path, ...]
    people: int
    pages: int
    snippets: int
    folds: int
    tells: tuple[Tell, ...]
    seed: int
    sampling: str

    def facts(self) -> Facts:
        tells: list[Fact] = [
            {"measure": t.name, "made": t.made, "real": t.real, "share": round(t.share, 3), "error": round(t.error, 3),
             "p": round(t.p, 5), "tells": t.tells} for t in self.tells
        ]  # fmt: skip
        return {
            "study": self.name,
            "files": [str(path) for path in self.files],
            "people": self.people,
            "pages": self.pages,
            "snippets": self.snippets,
            "hands_made": self.folds,
            "tells": tells,
            "sampling": self.sampling,
            "seed": self.seed,
        }


def make(output: str | Path, options: StudyOptions = StudyOptions(), *, listener: Listener = SILENT) -> MadeStudy:
    """Make the sheets of a study, with their key in a file of its own.

    Parameters
    ----------
    output : a folder, new or empty.

    Raises
    ------
    InputError
        A hand that is not scanned, too few snippets for what each person is asked, a folder that holds something.
    """
    folder = _new_folder(Path(output))
    _check(options)
    seed = seed_of(options.seed)
    rng = np.random.default_rng([seed, 8])
    materials = _materials(options, listener)
    control = file.load(library.scanned_file(options.control)) if options.control else None
    options = options if control is not None else replace(options, controls=0)
    shown = options.singles + options.pairs + options.controls + options.random
    lots = parted(materials, shown, options.snippets, rng)
    loose = options.random > 0 or options.random_people
    made, references = twins(materials, lots, control, loose, seed, narrow_reports(listener.progress, _READ, _WRITTEN))
    kept, scales, notes = _fitting(materials, made)
    if options.random_people:
        kept, more = _all_random(kept, len(lots.folds), shown)
        notes += more
    people = _people(kept, lots, options, rng)
    hands, words = tuple(each.hand.name for each in materials), tuple(_lettered(twin.snippet, rng) for twin in kept)
    key = Key(seed=seed, hands=hands, snippets=words, people=people, sampling=options.sampling)
    told = tuple(evenness.tells([twin.made for twin in kept], [twin.real for twin in kept]))
    notes += _notes(materials, lots, kept, told)
    for condition, wanted in ((design.CONTROL, options.controls), (design.RANDOM, options.random)):
        fewest = min(sum(item.condition == condition for item in person.pairs) for person in people)
        if fewest < wanted:
            notes.append(f"Somebody has only {units.count(fewest, f'{condition} pair')}: there are no more snippets.")
    listener.progress(_WRITTEN, "drawing the sheets")
    show = _show(kept, scales, lots, references, options.title)
    with TemporaryDirectory(prefix=".study-", dir=folder.resolve().parent) as aside:
        work = Path(aside) / "study"
        name, files, pages = _written(work, key, show, options)
        files += [*_pictures(work / "snippets", kept, words), work / ABOUT]
        paths = tuple(folder / path.relative_to(work) for path in files)
        result = MadeStudy(name, paths, len(people), pages, len(kept), len(lots.folds), told, seed, options.sampling,
                           notes=tuple(notes))  # fmt: skip
        about = {**result.facts(), "key_sha256": sha256((work / KEY).read_bytes()).hexdigest(), "notes": notes}
        atomic.write(work / ABOUT, (json.dumps(about, ensure_ascii=False, indent=1) + "\n").encode())
        if folder.exists():
            folder.rmdir()
        atomic.move_folder(work, folder)
    return result


def _show(
    kept: Sequence[Twin], scales: Sequence[float], lots: Parted, references: Sequence[Picture], title: str
) -> sheets.Show:
    """What the sheets show, each hand at its scale."""
    pictures: dict[tuple[int, str], tuple[Picture, float]] = {}
    for n, twin in enumerate(kept):
        scale = scales[twin.snippet.hand]
        pictures |= {(n, design.REAL): (twin.real, scale), (n, design.OURS): (twin.made, scale)}
        if twin.control is not None:  # which may look as it will: it is to be easy
            pictures[n, design.CONTROL] = twin.control, min(scale, sheets.largest(twin.control))
        if twin.random is not None:
            pictures[n, design.RANDOM] = twin.random, scale
    hands_of = [k for k, _ in lots.references]
    above = {n: (picture, scales[k]) for n, (k, picture) in enumerate(zip(hands_of, references, strict=True))}
    return sheets.Show(pictures, above, title)


def _written(folder: Path, key: Key, show: sheets.Show, options: StudyOptions) -> tuple[str, list[Path], int]:
    """The name of the study, its files and the number of its pages; key and sheets are written."""
    page = paper_of_name(options.page)
    folder.mkdir()
    name = design.seal(key, folder / KEY)
    pages = [
        (record, person)
        for number, person in enumerate(key.people, 1)
        for record in sheets.records(page, name, number, person, options.about)
    ]
    atomic.write(folder / SHEETS, sheets.to_pdf(page, pages, show))
    return name, [folder / SHEETS, folder / KEY, *_envelopes(folder, key, options)], len(pages)


def _new_folder(folder: Path) -> Path:
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} holds something already: give a folder that is new or empty.")
    atomic.check_writable(folder)
    return folder


def _check(options: StudyOptions) -> None:
    """Raise InputError for options that no study can have."""
    paper_of_name(options.page)
    if not options.hand:
        raise InputError("A study is of a scanned hand: give one with --hand.")
    if options.real and len(options.real) != len(options.hand):
        raise InputError(
            f"{len(options.real)} --real for {len(options.hand)} --hand: give one for each, in the same order, or none."
        )
    if not 1 <= options.people <= _MOST_PEOPLE:
        raise InputError(f"people: {options.people} is outside 1 to {_MOST_PEOPLE}.")
    asked = (options.singles, options.pairs, options.controls, options.random)
    if not 0 <= min(asked) <= max(asked) <= _MOST_ROWS or sum(asked[1:]) > _MOST_ROWS:
        raise InputError(f"singles, and pairs with controls and random ones, are 0 to {_MOST_ROWS}.")
    if options.sampling not in design.SAMPLINGS:
        raise InputError(f"sampling: {options.sampling!r} is not one of {', '.join(design.SAMPLINGS)}.")
    if options.random and options.random_people:
        raise InputError("Random selection is seen beside the hand's own (--random) or by other people: give one.")
    if options.random_people and options.people < _FEWEST_PARTED:
        raise InputError(f"--random-people parts the people in two: {_FEWEST_PARTED} or more.")
    design.roles_of(options.singles, options.pairs)
    if options.envelopes is not None:
        _addresses(options.envelopes)


def _materials(options: StudyOptions, listener: Listener) -> list[Material]:
    found = []
    for k, name in enumerate(options.hand):
        listener.progress(_READ * k / len(options.hand), "reading the pages")
        found.append(material(name, options.real[k] if options.real else None, options.dpi, listener))
    return found


def _fitting(materials: Sequence[Material], made: Sequence[Twin]) -> tuple[list[Twin], list[float], list[str]]:
    """The snippets that fit their frames, by how much those of each hand are made smaller, and what to say of that."""
    kept, scales, notes = list[Twin](), list[float](), list[str]()
    for k, each in enumerate(materials):
        own = [twin for twin in made if twin.snippet.hand == k]
        scales.append(sheets.scale_of([picture for twin in own for picture in (twin.real, twin.made)]))
        fit = [twin for twin in own if sheets.fits(twin.real, scales[k]) and sheets.fits(twin.made, scales[k])]
        kept += [
            twin if twin.random is None or sheets.fits(twin.random, scales[k]) else replace(twin, random=None)
            for twin in fit
        ]
        if scales[k] < 1:
            notes.append(f"The writing of {each.hand.name} is shown at {scales[k]:.0%} of its size, real and made.")
        if len(fit) < len(own):
            notes.append(f"{units.count(len(own) - len(fit), 'snippet')} of {each.hand.name} too large for its frame.")
    return kept, scales, notes


def _all_random(kept: Sequence[Twin], folds: int, wanted: int) -> tuple[list[Twin], list[str]]:
    """The snippets that are there of letters taken by chance, too, and what to say of the others.

    Raises
    ------
    InputError
        Too few for somebody who is shown `wanted`.
    """
    both = [twin for twin in kept if twin.random is not None]
    least = min(sum(twin.snippet.fold == fold for twin in both) for fold in range(folds))
    if least < wanted:
        raise InputError(
            f"Of {units.count(len(kept), 'snippet')} random selection can write {len(both)}: of the others the hand "
            f"lacks a letter, or they are too wide. Some people could see {least}, and each is to see {wanted}: ask "
            "less, give more pages, or use --random instead of --random-people."
        )
    left = units.count(len(kept) - len(both), "snippet")
    return both, [f"{left} without random selection left out."] if len(both) < len(kept) else []


def _people(kept: Sequence[Twin], lots: Parted, options: StudyOptions, rng: np.random.Generator) -> tuple[Person, ...]:
    """What everybody is asked."""
    folds = [[n for n, twin in enumerate(kept) if twin.snippet.fold == fold] for fold in range(len(lots.folds))]
    each = folds * (1 + options.random_people)  # balanced among those who see one condition
    plans = design.dealt(each, options.people, options.singles, options.pairs, rng, options.sampling)
    count = len(_addresses(options.envelopes)) if options.envelopes else 0
    opened = design.envelopes(count, (count + 1) // 2, options.people, rng)
    people = []
    for number, ((singles, pairs), seen) in enumerate(zip(plans, opened, strict=True)):
        shown = {item.snippet for item in (*singles, *pairs)}
        rest = [n for n in folds[number % len(folds)] if n not in shown]
        both = [*pairs, *_compared(rest, kept, options, number, rng)]
        referred = _referred([both[k] for k in rng.permutation(len(both))], kept, lots, rng)
        who = Person(singles, tuple(referred), seen)
        people.append(_all_by_chance(who) if options.random_people and sum(divmod(number, len(folds))) % 2 else who)
    return tuple(people)


def _compared(
    rest: Sequence[int], kept: Sequence[Twin], options: StudyOptions, person: int, rng: np.random.Generator
) -> list[Item]:
    """Somebody's pairs of other conditions, of snippets that he does not see otherwise."""
    easy = _more(rest, options.controls, design.CONTROL, person, rng)
    shown = {item.snippet for item in easy}
    left = [n for n in rest if kept[n].random is not None and n not in shown]
    return [*easy, *_more(left, options.random, design.RANDOM, person, rng)]


def _all_by_chance(person: Person) -> Person:
    """The same questions, what was written in the hand being of letters taken by chance."""

    def instead(items: Sequence[Item]) -> tuple[Item, ...]:
        ours = [item.condition == design.OURS for item in items]
        return tuple(
            msgspec.structs.replace(item, condition=design.RANDOM) if own else item
            for item, own in zip(items, ours, strict=True)
        )

    return Person(instead(person.singles), instead(person.pairs), person.envelopes)


def _referred(items: Sequence[Item], kept: Sequence[Twin], lots: Parted, rng: np.random.Generator) -> list[Item]:
    """Somebody's pairs with references of their hands: none again before all of its hand were there."""
    own = {k: rng.permutation([n for n, (each, _) in enumerate(lots.references) if each == k])
           for k in sorted({each for each, _ in lots.references})}  # fmt: skip
    found, used = list[Item](), Counter[int]()
    for item in items:
        hand = kept[item.snippet].snippet.hand
        found.append(msgspec.structs.replace(item, reference=int(own[hand][used[hand] % len(own[hand])])))
        used[hand] += 1
    return found


def _more(rest: Sequence[int], count: int, condition: str, person: int, rng: np.random.Generator) -> list[Item]:
    """Some pairs of another condition, as often left as right; fewer where there are no more."""
    chosen = rng.permutation(rest)[:count].tolist()
    sides = (design.LEFT, design.RIGHT)
    return [Item(n, sides[(person + k) % 2], condition) for k, n in enumerate(chosen)]


def _lettered(snippet: Snippet, rng: np.random.Generator) -> Snippet:
    return msgspec.structs.replace(snippet, made="ab"[rng.integers(2)])


def _pictures(folder: Path, kept: Sequence[Twin], words: Sequence[Snippet]) -> list[Path]:
    """Every snippet as two pictures, a and b; the key says which is made."""
    from PIL import Image

    folder.mkdir()
    files = []
    for n, (twin, snippet) in enumerate(zip(kept, words, strict=True), 1):
        both = (twin.made, twin.real) if snippet.made == "a" else (twin.real, twin.made)
        for letter, picture in zip("ab", both, strict=True):
            files.append(folder / f"{n:03d}-{letter}.png")
            Image.fromarray(picture.rgb).save(files[-1], dpi=(picture.dpi, picture.dpi))
    return files


def _addresses(path: Path) -> list[str]:
    """The addresses of a file, parted by empty lines."""
    try:
        blocks = path.read_text(encoding="utf-8").split("\n\n")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Cannot read {path}: {error}.") from error
    found = [block.strip() for block in blocks if block.strip()]
    if not _FEWEST_ENVELOPES <= len(found) <= _MOST_ROWS:
        held = units.count(len(found), "address", "addresses")
        raise InputError(f"{path} holds {held}, parted by empty lines: {_FEWEST_ENVELOPES} to {_MOST_ROWS}.")
    return found


def _envelopes(folder: Path, key: Key, options: StudyOptions) -> list[Path]:
    """The made envelopes, each as a PDF, and a list of those that people write; it says which is which."""
    if options.envelopes is None:
        return []
    texts = _addresses(options.envelopes)
    real = {item.snippet for item in key.people[0].envelopes if item.truth == design.REAL}
    place = folder / "envelopes"
    place.mkdir()
    files = [place / f"{n + 1:02d}.pdf" for n in range(len(texts)) if n not in real]
    sheet = SheetOptions(page="DL", margin=_ADDRESS)
    for path in files:
        n = int(path.stem) - 1
        writing = WritingOptions(hand=options.hand[n % len(options.hand)], seed=key.seed + n, fallback=True)
        write(texts[n], [path], writing, sheet)
    wanted = "\n\n".join(f"Envelope {n + 1}, to be written by a person:\n{texts[n]}" for n in sorted(real))
    atomic.write(place / "to-write.txt", f"{wanted}\n".encode())
    return [*files, place / "to-write.txt"]


def _notes(materials: Sequence[Material], lots: Parted, kept: Sequence[Twin], told: Sequence[Tell]) -> list[str]:
    """What was decided, and what might tell the made snippets without a look at the writing."""
    notes = []
    for each in materials:
        shared = any(each.own(page) for page in each.used)
        notes.append(
            f"Real words of {each.hand.name} are from pages that it was read from: each of "
            f"{units.count(len(lots.folds), 'hand')} is made without the lines that its readers see, {_STAYS}."
            if shared
            else f"No page that real words of {each.hand.name} are from is one that it was read from."
        )
    lent = sum(bool(twin.snippet.lent) for twin in kept)
    if lent:
        notes.append(f"{lent} of {len(kept)} made snippets have a letter that the hand lacked; the key says which.")
    doubtful = sum(bool(twin.snippet.doubtful) for twin in kept)
    if doubtful:
        notes.append(f"{doubtful} of {len(kept)} made snippets have a word that reads as another.")
    notes += [
        f"Not even: {tell.name} alone tells the made one in {max(tell.share, 1 - tell.share):.0%} of pairs (made "
        f"{tell.made:.3g}, real {tell.real:.3g}); half is even; of the {len(told)} measures chance alone makes "
        f"one as uneven with p = {tell.p:.2g} (Holm)."
        for tell in told
        if tell.tells
    ]
    return notes


@dataclass(frozen=True, eq=False)
class ReadStudy(Result):
    """Scans that were read.

    unread : pages that could not be, with the reason; missing : person → pages of him that were not there.
    """

    path: Path
    study: str
    people: int
    sheets: int
    answers: tuple[Answer, ...]
    unread: tuple[str, ...]
    missing: Mapping[int, Sequence[int]]

    @property
    def doubtful(self) -> tuple[Answer, ...]:
        """Rows for a person to decide."""
        return tuple(answer for answer in self.answers if answer.state == answering.DOUBTFUL)

    def facts(self) -> Facts:
        return {
            "files": [str(self.path)],
            "study": self.study,
            "people": self.people,
            "sheets": self.sheets,
            "answers": len(self.answers),
            "doubtful": [
                {
                    "person": one.person,
                    "questionnaire": one.questionnaire,
                    "item": one.item,
                    "why": one.why,
                    "picture": one.picture,
                }
                for one in self.doubtful
            ],
            "unread": list(self.unread),
            "missing": {str(person): list(pages) for person, pages in self.missing.items()},
        }


def read(scans: Sequence[str | Path], output: str | Path, *, listener: Listener = SILENT) -> ReadStudy:
    """Read the filled sheets of a study into a table of answers.

    Rows that are not plain are left empty, with a picture of each in a folder beside the table.

    Parameters
    ----------
    scans : pictures or PDF files of one or more pages, or folders of them: scans or photographs, any way round.
    output : the table, a .csv file.

    Raises
    ------
    InputError
        Nothing can be read, or sheets of several studies, or a table is there with what a person decided.
    """
    path = Path(output)
    if path.suffix.lower() != ".csv":
        raise InputError(f"Answers are written as CSV, not {path.suffix or 'without a suffix'}: use {path.stem}.csv.")
    atomic.check_writable(path)
    _keeps_decisions(path)
    found, unread = _sheets(scans, listener)
    rows, pictures = answering.answers(found)
    folder = path.with_name(f"{path.stem}-doubtful")
    rows = [
        replace(row, picture=str(Path(folder.name) / _picture_name(row))) if row.place in pictures else row
        for row in rows
    ]
    for row in rows:
        if row.picture:
            folder.mkdir(exist_ok=True)
            atomic.write(path.parent / row.picture, _png(pictures[row.place]))
    atomic.write(path, answering.to_csv(rows))
    people = {sheet.record.person for sheet in found}
    missing = answering.missing(found)
    notes = [f"Not read: {reason}" for reason in unread]
    notes += [f"Person {person}: {_pages(gone)} not among the scans." for person, gone in missing.items()]
    if again := answering.repeated(found):
        which = "; ".join(f"person {who}, page {page}: {', '.join(of)}" for (who, page), of in again.items())
        notes.append(
            f"{units.count(len(again), 'sheet')} scanned more than once and counted once ({which}). If two people "
            "filled in copies of one sheet, read those of one of them only."
        )
    doubtful = sum(row.state == answering.DOUBTFUL for row in rows)
    if doubtful:
        notes.append(
            f"{units.count(doubtful, 'row')} doubtful: look at the pictures in {folder}, and write the answers into "
            "the table, or leave them empty."
        )
    return ReadStudy(path, found[0].record.study, len(people), len(found), tuple(rows), tuple(unread), missing,
                     notes=tuple(notes))  # fmt: skip


def _keeps_decisions(path: Path) -> None:
    """Raise InputError for a table that would be lost with what a person wrote into it."""
    try:
        lost = path.exists() and any(row.answer and row.state == answering.DOUBTFUL for row in answering.from_csv(path))
    except InputError:
        lost = True
    if lost:
        raise InputError(f"{path} holds answers that a person wrote into it, or something else: give another --output.")


def _sheets(scans: Sequence[str | Path], listener: Listener) -> tuple[list[answering.ReadSheet], list[str]]:
    """The sheets that could be read, and why others could not."""
    names = [str(path) for scan in scans for path in (pictures_in(Path(scan)) if Path(scan).is_dir() else [Path(scan)])]
    pages = chosen_pages(names)
    found, unread = list[answering.ReadSheet](), list[str]()
    for number, (path, page) in enumerate(pages):
        listener.progress(number / len(pages), f"reading {number + 1}/{len(pages)}")
        source = str(path) if page is None else f"{path}, page {page}"
        try:
            found.append(answering.read_sheet(read_picture(path, page).rgb, source))
        except InputError as error:
            unread.append(str(error) if str(error).startswith(source) else f"{source}: {error}")
    if not found:
        raise InputError(f"No sheet of a study could be read. {unread[0]}")
    return found, unread


def _pages(numbers: Sequence[int]) -> str:
    return (
        ("page " if len(numbers) == 1 else "pages ")
        + ", ".join(map(str, numbers))
        + (" is" if len(numbers) == 1 else " are")
    )


def _picture_name(row: Answer) -> str:
    return f"person-{row.person}-{row.questionnaire}-{row.item}.png"


def _png(pixels: NDArray[np.uint8]) -> bytes:
    import cv2

    return bytes(cv2.imencode(".png", pixels[:, :, ::-1])[1])


@dataclass(frozen=True, eq=False)
class ScoredStudy(Result):
    """The figures of a study."""

    study: str
    answers: Taken
    scores: Mapping[str, Scores]
    snippets: tuple[Difficulty, ...]
    histograms: Mapping[str, Sequence[float]]
    files: tuple[Path, ...]

    def facts(self) -> Facts:
        return {
            "study": self.study,
            "files": [str(path) for path in self.files],
            "people": len({one.person for one in self.answers.judged}),
            "answers": len(self.answers.judged),
            "empty": self.answers.empty,
            "decided_by_a_person": self.answers.decided,
            "without_consent": list(self.answers.unwilling),
            "too_few_controls": list(self.answers.careless),
            "questionnaires": {kind: _score_facts(each) for kind, each in self.scores.items()},
            "difficulty": {kind: list(shares) for kind, shares in self.histograms.items()},
            "snippets": [_snippet_facts(one) for one in self.snippets],
        }


def _snippet_facts(one: Difficulty) -> Facts:
    shares = {"real": one.real, "made": one.made, "pair": one.pair}
    found: Facts = {name: _share_facts(share) for name, share in shares.items() if share is not None}
    return {"snippet": one.snippet, "text": one.text, "hand": one.hand, **found}


def _share_facts(share: Share) -> Facts:
    return {
        "right": share.right, "of": share.of, "share": round(share.share, 5), "exact": _rounded(share.exact),
        "people": _rounded(share.people), "people_and_words": _rounded(share.both), "p": share.p,
    }  # fmt: skip


def _rounded(interval: tuple[float, float]) -> list[Fact]:
    return [round(end, 5) for end in interval]


def _score_facts(scores: Scores) -> Facts:
    skill, confusions = scores.skill, scores.confusions
    return {
        **_share_facts(scores.share),
        "hands": {name: _share_facts(share) for name, share in scores.hands.items()},
        "conditions": {name: _share_facts(share) for name, share in scores.conditions.items()},
        "tests": [{"first": test.first, "second": test.second, "p": test.p} for test in scores.tests],
        "groups": {
            name: {said: _share_facts(share) for said, share in group.items()} for name, group in scores.groups.items()
        },
        "skill": {
            "rows": skill.rows, "people_with_score": {str(k): n for k, n in skill.scores.items()},
            "if_guessing": {str(k): round(n, 3) for k, n in skill.expected.items()}, "spread": round(skill.spread, 5),
            "p_alike": skill.p, "above_chance": list(skill.above), "above_by_chance": round(skill.above_by_chance, 3),
        },
        "confusions": {f"{truth} called {answer}": n for (truth, answer), n in confusions.counts.items()},
        "sensitivity": round(confusions.sensitivity, 5),
        "bias": round(confusions.bias, 5),
    }  # fmt: skip


def score(
    table: str | Path,
    key: str | Path | None = None,
    output: str | Path | None = None,
    *,
    least_controls: int = 0,
    seed: int = 0,
) -> ScoredStudy:
    """Score the answers of a study.

    Parameters
    ----------
    table : what `read` wrote, with what a person decided of the doubtful rows.
    key : the key of the study; None: a .key file beside the table, in a folder there, or in the working folder.
    output : an .svg file for the figure, if any.
    least_controls : people who told fewer of the easy pairs are left out.
    seed : of the permutations.

    Raises
    ------
    InputError
        No such table or key, a key that was changed, answers of several studies, nothing that counts.
    """
    path, figure_path = Path(table), None if output is None else Path(output)
    if figure_path is not None:
        if figure_path.suffix.lower() != ".svg":
            raise InputError(f"The figure is written as SVG: use {figure_path.stem}.svg.")
        atomic.check_writable(figure_path)
    rows = answering.from_csv(path)
    studies = {row.study for row in rows}
    if len(studies) != 1:
        raise InputError(f"{path} holds answers of {units.count(len(studies), 'study', 'studies')}: give those of one.")
    (study,) = studies
    opened = design.opened(_key_of(study, path) if key is None else Path(key), study)
    answers = scoring.taken(opened, rows, least_controls)
    found = scoring.scores(opened, answers, seed)
    parts = {kind: [one for one in answers.judged if one.questionnaire == kind] for kind in found}
    histograms = {kind: scoring.difficulty_histogram(own) for kind, own in parts.items() if kind != design.ENVELOPES}
    files: tuple[Path, ...] = ()
    if figure_path is not None:
        atomic.write(figure_path, figure(found, histograms, f"Study {study}"))
        files = (figure_path,)
    return ScoredStudy(study, answers, found, tuple(scoring.difficulties(opened, answers.judged)), histograms, files,
                       notes=(*_left_out(answers), *([_CHOSEN] if least_controls else [])))  # fmt: skip


def _left_out(answers: Taken) -> list[str]:
    notes = []
    if answers.empty:
        notes.append(f"{units.count(answers.empty, 'row')} without an answer left out.")
    if answers.decided:
        notes.append(f"{units.count(answers.decided, 'doubtful row')} as a person decided.")
    for people, why in (
        (answers.unwilling, "did not tick that they agree"),
        (answers.careless, "told too few of the controls"),
    ):
        if people:
            named = ", ".join(map(str, people))
            notes.append(f"{units.count(len(people), 'person', 'people')} left out who {why}: {named}.")
    return notes


def _key_of(study: str, table: Path) -> Path:
    """The key of a study, looked for near its answers."""
    folders = dict.fromkeys((table.resolve().parent, Path.cwd()))
    keys = [path for folder in folders for pattern in ("*.key", "*/*.key") for path in sorted(folder.glob(pattern))]
    for path in keys:
        with suppress(OSError):  # somebody else's, or a folder
            if design.name_of(path.read_bytes()) == study:
                return path
    others = ", ".join(map(str, keys[:3]))
    seen = f" ({others}: of other studies, or changed)" if keys else ""
    raise InputError(f"The key of study {study} is not beside {table} nor in a folder there{seen}: give it with --key.")
