"""The letters of a scanned hand on a desk: shown page by page, corrected one after another, each kept at once.

A correction is made and kept in a fraction of a second; what the other letters of a page learn from it takes some
seconds, and is asked for by itself (`learn_letters`).  Until then how sure the others are is what it was before.  Every
change says which revision of the file it is about, so that two windows, or two programs, do not write over each
other's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.branching import branches
from handout.errors import InputError
from handout.hand import file, library
from handout.hand.corrections import Entry, Journal, read_corrections
from handout.hand.places import graphemes
from handout.hand.scanned import NOBODY, ScannedHand, ScannedPage
from handout.hand.vetting import REFUSED, SURE, vet
from handout.pipeline.kept_hands import learn
from handout.pipeline.results import SILENT, Facts, Listener
from handout.progress import within
from handout.values import Array

TILE = 512  # pixels of a side of a tile
_THINNED = 2  # every so manieth vertex of a line is shown: they lie about a pixel apart
_QUALITY = 88  # of tiles as JPEG, set by eye


class StaleHand(InputError):
    """The hand was changed by somebody else since it was looked at."""


@dataclass(frozen=True, eq=False)
class _Desk:
    """A hand as its file has it.

    probability : (n,) of each glyph to be what it is called, as far as it is known.
    """

    hand: ScannedHand
    journal: Journal
    probability: Array


_DESKS: dict[Path, tuple[str, _Desk]] = {}  # revision and desk of the files that were looked at last
_MOST_DESKS = 4  # each holds the pictures of its pages once they were looked at


def _revision(path: Path) -> str:
    try:
        state = path.stat()
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror or error}.") from error
    return f"{state.st_mtime_ns:x}-{state.st_size:x}"


def _desk(path: Path) -> _Desk:
    revision, kept = _revision(path), _DESKS.get(path)
    if kept is not None and kept[0] == revision:
        return kept[1]
    hand = file.load(path)
    return _laid(path, _Desk(hand, file.journal(path), vet(hand).probability))


def _laid(path: Path, desk: _Desk) -> _Desk:
    _DESKS.pop(path, None)
    while len(_DESKS) >= _MOST_DESKS:
        _DESKS.pop(next(iter(_DESKS)))
    _DESKS[path] = _revision(path), desk
    return desk


def open_letters(name: str) -> Facts:
    """What is on the pages of a hand, and what was corrected of it."""
    path = library.scanned_file(name)
    desk = _desk(path)
    hand, journal = desk.hand, desk.journal
    open_ = [(glyph.page, sure) for glyph, sure in zip(hand.glyphs, (desk.probability >= SURE).tolist(), strict=True)]
    pages: list[Facts] = [
        {
            "source": page.source,
            "width": page.shape[1],
            "height": page.shape[0],
            "x_height": round(page.x_height / page.pixel, 1),
            "slant": round(page.slant, 3),
            "letters": sum(on == number for on, _ in open_),
            "doubtful": sum(on == number and not sure for on, sure in open_),
        }
        for number, page in enumerate(hand.pages)
    ]
    return {
        "revision": _revision(path),
        "title": hand.title,
        "pages": pages,
        "made": journal.made,
        "entries": len(journal.entries),
        "tile": TILE,
    }


def page_letters(name: str, page: int) -> Facts:
    """The letters of a page in the order of writing, with the lines of their ink as SVG paths in pixels of the scan."""
    desk = _desk(library.scanned_file(name))
    hand, sheet = desk.hand, _page(desk.hand, page)
    here = [number for number, glyph in enumerate(hand.glyphs) if glyph.page == page]
    owner = np.full(len(sheet.graph), NOBODY, dtype=np.intp)
    for number in here:
        owner[hand.glyphs[number].vertices] = number
    units, ink = graphemes(sheet.transcript), _ink(sheet, owner)
    return {"letters": [_letter(desk, number, units, ink.get(number, "")) for number in here]}


def _page(hand: ScannedHand, page: int) -> ScannedPage:
    if not 0 <= page < len(hand.pages):
        raise InputError(f"{hand.name} has no page {page}; they are numbered from 0 to {len(hand.pages) - 1}.")
    return hand.pages[page]


def _ink(sheet: ScannedPage, owner: NDArray[np.intp]) -> dict[int, str]:
    """Glyph → the lines of its ink; single vertices are left out."""
    edges = sheet.graph.edges
    own = (owner[edges[:, 0]] == owner[edges[:, 1]]) & (owner[edges[:, 0]] != NOBODY)
    places = np.rint(sheet.graph.uv).astype(int).tolist()
    parts: dict[int, list[str]] = {}
    for path in branches(edges[own], len(sheet.graph)):
        if len(path) > 1:
            shown = [*path[:-1:_THINNED].tolist(), int(path[-1])]
            line = "L".join(f"{places[v][0]} {places[v][1]}" for v in shown)
            parts.setdefault(int(owner[path[0]]), []).append(f"M{line}")
    return {number: "".join(lines) for number, lines in parts.items()}


def _letter(desk: _Desk, number: int, units: tuple[str, ...] | list[str], ink: str) -> Facts:
    glyph, probability = desk.hand.glyphs[number], float(desk.probability[number])
    uv = desk.hand.pages[glyph.page].graph.uv[glyph.vertices]
    spot = uv[len(uv) // 2]
    verdict = "unnamed" if not glyph.letter else "confirmed" if glyph.confirmed else _verdict(probability)
    return {
        "letter": glyph.letter,
        "verdict": verdict,
        "probability": round(probability, 3),
        "line": glyph.line,
        "word": _word(units, glyph.at),
        "spot": [round(float(at), 1) for at in spot],
        "box": [round(float(at), 1) for at in (*uv.min(axis=0), *uv.max(axis=0))],
        "linked": glyph.after != NOBODY,
        "joined": bool(glyph.ligatures),
        "ink": ink,
    }


def _verdict(probability: float) -> str:
    return "sure" if probability >= SURE else "refused" if probability < REFUSED else "doubtful"


def _word(units: tuple[str, ...] | list[str], at: int) -> str:
    """The word of a text that a grapheme stands in, "" for one that is not in the text."""
    if at < 0:
        return ""
    first, last = at, at
    while first and not units[first - 1].isspace():
        first -= 1
    while last + 1 < len(units) and not units[last + 1].isspace():
        last += 1
    return "".join(units[first : last + 1])


def page_tile(name: str, page: int, level: int, column: int, row: int) -> bytes:
    """A square of a page's picture as JPEG; at `level` 1 it shows twice as much each way as at 0, and so on."""
    import cv2

    path = library.scanned_file(name)
    desk = _desk(path)
    sheet = _page(desk.hand, page)
    if not 0 <= level <= 6:
        raise InputError(f"level: {level} is outside 0 to 6.")
    picture = _picture(sheet, level)
    part = picture[max(0, row) * TILE : (row + 1) * TILE, max(0, column) * TILE : (column + 1) * TILE]
    if not part.size:
        raise InputError("That square is off the page.")
    made, data = cv2.imencode(".jpg", part[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    assert made
    return bytes(data)


@lru_cache(maxsize=3)
def _picture(sheet: ScannedPage, level: int) -> NDArray[np.uint8]:
    """(h, w, 3): the page, each pixel the mean of a square of 2 to the power of `level`."""
    import cv2

    if level == 0:
        return sheet.on_paper()
    finer = _picture(sheet, level - 1)
    size = (-(-finer.shape[1] // 2), -(-finer.shape[0] // 2))
    return np.asarray(cv2.resize(finer, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def correct_letters(name: str, revision: str, corrections: bytes) -> Facts:
    """Make corrections (JSON, as `handout hand edit` takes them) and keep them; the other letters stay as they are.

    Raises
    ------
    StaleHand
        The file is not of that revision.
    InputError
        The hand comes with the program; a correction that cannot be made: nothing is, then.
    """
    from handout.tagging.relearning import correct

    path, desk = _changed(name, revision)
    new = read_corrections(corrections, "the corrections")
    corrected = correct(desk.hand, new, learning=False)
    journal = file.record(path, path, desk.hand, corrected.hand, Entry(new, corrected.changes))
    _laid(path, _Desk(corrected.hand, journal, _carried(desk, corrected.hand)))
    return {**open_letters(name), "notes": list(corrected.notes)}


def rewind_letters(name: str, revision: str, back: int) -> Facts:
    """Undo so many entries of the journal, or, negative, make them again; else as `correct_letters`."""
    path, desk = _changed(name, revision)
    journal = file.rewind(path, path, desk.journal.made - back)
    hand = file.load(path)
    _laid(path, _Desk(hand, journal, _carried(desk, hand)))
    return open_letters(name)


def learn_letters(name: str, revision: str, listener: Listener = SILENT) -> Facts:
    """Align the pages that were corrected anew, judge all letters anew, and keep both; else as `correct_letters`."""
    from handout.tagging.relearning import changes, realigned

    path, desk = _changed(name, revision)
    hand = desk.hand
    pages = sorted({glyph.page for glyph in hand.glyphs if glyph.confirmed})
    for number, page in enumerate(pages):
        tell = within(listener.progress, 0.8 * number / len(pages), 0.8 * (number + 1) / len(pages))
        hand = realigned(hand, page, rng=np.random.default_rng((0, page)), tell=tell)
    found = changes(desk.hand, hand)
    listener.progress(0.8, "judging the letters")
    if found:
        file.record(path, path, desk.hand, hand, Entry((), found))
    learn(path)
    _DESKS.pop(path, None)
    return {**open_letters(name), "changed": len(found)}


def _changed(name: str, revision: str) -> tuple[Path, _Desk]:
    """The file of a hand that is to be changed, and what it holds."""
    path = library.scanned_file(name)
    if library.comes_with_program(path):
        raise InputError(f"{path.stem} comes with the program: make a copy of your own first.")
    atomic.check_writable(path)
    desk = _desk(path)
    if revision != _revision(path):
        raise StaleHand("The hand was changed in another window meanwhile; it is shown as it is now.")
    return path, desk


def _carried(desk: _Desk, hand: ScannedHand) -> Array:
    """How sure the glyphs of a changed hand are: as before where they are as before, sure where a person said so."""
    known = {_key(desk.hand, number): float(p) for number, p in enumerate(desk.probability.tolist())}
    values = [
        1.0 if glyph.confirmed else known.get(_key(hand, number), 0.5 * glyph.confidence if glyph.letter else 0.0)
        for number, glyph in enumerate(hand.glyphs)
    ]
    return np.array(values)


def _key(hand: ScannedHand, number: int) -> tuple[int, str, int, tuple[float, ...]]:
    """What a glyph is known by, whatever its number is, and those of its vertices."""
    glyph = hand.glyphs[number]
    ends = hand.pages[glyph.page].graph.uv[glyph.vertices[[0, -1]]].round(1)
    return glyph.page, glyph.letter, len(glyph.vertices), tuple(ends.ravel().tolist())
