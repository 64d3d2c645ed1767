"""Recorded pens on paper: words and letters of the UNIPEN collection, inked as handout inks, scanned and read.

Recordings are read from the folder in HANDOUT_DATA (`pen/unipen`); nothing of them is kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from handout.inking import pens
from handout.inking.pen import usual
from handout.scanning.line_graph import find_line_graph
from handout.scanning.scan import Scan
from handout.scanning.written_page import find_ink, prepare
from handout.sources import read_drawing
from handout.values import Array, Drawing, Indices, LineGraph, Page, Stroke

DPI = 300.0
_SHEET = Page(210, 297, "A4")
_SCALE = 0.55  # people write larger on a tablet; those of English words less so:
_ENGLISH = 0.8
_APART = 4.0  # mm between two English words, at least
_BACK = 15.0  # mm to the left where the next line begins
_ROWS = 15  # of a page of English words
_LETTER = 6.0  # mm, the longer side of a letter that was recorded larger, or very small
_MOST = 10  # recordings of one letter from one source
_CELL = (18.0, 19.0)  # mm
_CELLS = (10, 14)
# labels of the words write ä, ü and ß as a, u and s, and a name otherwise; a reader of the page would not
_SPELT = {
    "Grunschnabel": "Grünschnabel",
    "Ladenschlusgesetz": "Ladenschlußgesetz",
    "lauft": "läuft",
    "ist": "ißt",
    "Gaby": "Gabi",
}
# what some recordings hold in place of their label
_WRITTEN = {
    "aab02": "Grünschnabe",
    "aan07": "Heute wird es regnen.",
    "aap01": "Hans ißt ein Marmeladenbrot.",
    "aap12": "Zickzack",
    "abo18": "Mein letzter Wille ist",
    "abo27": "sechshundertundsechzig",
}


@dataclass(frozen=True, eq=False)
class Recording:
    """What a pen did.

    text : what it wrote; source : the file.
    strokes : (n, 2) float, mm, y down.
    words : the word that each stroke is of; empty where that is not known.
    """

    text: str
    source: str
    strokes: tuple[Array, ...]
    words: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Cell:
    """One letter inked and read: its recording, its strokes on the page, mm, and the line that was found there."""

    recording: Recording
    strokes: list[Array]
    graph: LineGraph


def words(folder: Path) -> list[Recording]:
    """Sentences and words, German, joined, at 200 samples a second, with the text that they show."""
    every = [r for path in sorted((folder / "data/8/atu").rglob("*.dat")) for r in _segments(path, "TEXT")]
    spelt = (" ".join(_SPELT.get(word, word) for word in r.text.split()) for r in every)
    return [replace(r, text=_WRITTEN.get(r.source, text)) for r, text in zip(every, spelt, strict=True)]


def writers(recordings: Sequence[Recording]) -> list[list[Recording]]:
    """Recordings of words, those of one writer together: the first three letters of the file name them."""
    return [list(own) for _, own in groupby(recordings, key=lambda one: one.source[:3])]


def english(folder: Path) -> list[list[Recording]]:
    """Lines of English words, hardly joined, of three writers, in pages."""
    pages = list[list[Recording]]()
    for writer in ("01", "03", "08"):
        rows = [row for part in ("trn", "tst") for row in _rows(folder / f"data/1c/art/art{writer}{part}.dat")]
        pages += [rows[k : k + _ROWS] for k in range(0, len(rows), _ROWS)]
    return pages


def _rows(path: Path) -> Iterator[Recording]:
    """The lines of a file that has its letters one after the other."""
    row: list[tuple[Recording, bool]] = []  # letters, and whether a word begins with each
    left = right = 0.0
    for letter in _segments(path, "CHARACTER"):
        x = np.concatenate(letter.strokes)[:, 0]
        if row and x.min() < left - _BACK:
            yield _row(row)
            row = []
        row.append((letter, bool(row) and float(x.min()) - right > _APART))
        left, right = float(x.min()), float(x.max()) if len(row) == 1 else max(right, float(x.max()))
    yield _row(row)


def _row(letters: Sequence[tuple[Recording, bool]]) -> Recording:
    word = np.cumsum([begins for _, begins in letters]).tolist()
    text = "".join(" " * begins + letter.text for letter, begins in letters)
    of = tuple(number for (letter, _), number in zip(letters, word, strict=True) for _ in letter.strokes)
    return Recording(text, letters[0][0].source, tuple(xy for letter, _ in letters for xy in letter.strokes), of)


def letters(folder: Path) -> list[Recording]:
    """Single letters and digits, a few of each from each source."""
    often: Counter[tuple[str, str]] = Counter()
    found = []
    paths = [
        p for part in ("1c/sie", "1a/art", "1b/art", "1c/art") for p in sorted((folder / "data" / part).rglob("*.dat"))
    ]
    every = [r for path in paths for r in _segments(path, "CHARACTER")]
    for i in np.random.default_rng(0).permutation(len(every)):
        recording = every[i]
        key = (recording.text, recording.source[:4])
        if often[key] < _MOST and np.ptp(np.concatenate(recording.strokes), axis=0).max() > 0.5:
            often[key] += 1
            found.append(recording)
    return found


def _segments(path: Path, kind: str) -> Iterator[Recording]:
    """What one file has of a kind."""
    drawing = read_drawing(path)
    for segment in drawing.about.get("segments", ()):
        strokes = [xy for i in segment["strokes"] for xy in _down(drawing.strokes[i])]
        if segment["level"] == kind and strokes:
            yield Recording(segment["label"], path.stem, tuple(strokes))


def _down(stroke: Stroke) -> Iterator[Array]:
    """The movements in a component: where pressure is known, its zeros part them."""
    down = stroke.pressure > 0 if stroke.pressure is not None else np.ones(len(stroke.xy), dtype=bool)
    for some in np.split(np.arange(len(down)), np.flatnonzero(np.diff(down.astype(int))) + 1):
        if down[some[0]]:
            xy = stroke.xy[some]
            yield xy[np.concatenate([[True], (np.abs(np.diff(xy, axis=0)) > 0).any(axis=1)])]


def inked(strokes: Sequence[Array], seed: int = 5) -> Scan:
    """A sheet with some strokes in ballpoint, scanned."""
    timed, clock = [], 0.0
    for xy in strokes:
        places = xy if len(xy) > 1 else np.concatenate([xy, xy + np.array([0.15, 0.0])])
        t = clock + np.arange(len(places)) / 200
        timed.append(Stroke(t, places))
        clock = float(t[-1]) + 0.2
    drawing = Drawing(tuple(timed), _SHEET)
    picture = pens.image(drawing, DPI, usual("ballpoint"), np.random.default_rng(seed), None)
    return Scan(np.asarray(picture), DPI, "recorded")


def sheet(recordings: Sequence[Recording], pitch: float = 16.0) -> tuple[list[Array], Indices]:
    """Recordings one under the other, scaled to the size of handwriting: strokes, mm, and the row of each."""
    strokes, rows = list[Array](), list[int]()
    for row, recording in enumerate(recordings):
        places = np.concatenate(recording.strokes)
        scale = min(_ENGLISH if recording.words else _SCALE, 170 / float(np.ptp(places[:, 0])))
        middle = np.array([float(places[:, 0].min()), float(np.median(places[:, 1]))])
        strokes += [(xy - middle) * scale + (20.0, 25.0 + row * pitch) for xy in recording.strokes]
        rows += [row] * len(recording.strokes)
    return strokes, np.array(rows, dtype=np.intp)


def cells(recordings: Sequence[Recording]) -> Iterator[Cell]:
    """Letters on sheets, a cell for each, and the line of each as the ordinary reading finds it."""
    many = _CELLS[0] * _CELLS[1]
    for first in range(0, len(recordings), many):
        some = recordings[first : first + many]
        placed = [_placed(recording, k) for k, recording in enumerate(some)]
        read = find_ink(prepare(inked([xy for strokes in placed for xy in strokes])))
        graph = find_line_graph(read.prepared.scan, read.mask, read.density)
        column, row = (np.rint((graph.xy[:, k] - 22) / _CELL[k]).astype(int) for k in (0, 1))
        for k, (recording, strokes) in enumerate(zip(some, placed, strict=True)):
            own = (column == k % _CELLS[0]) & (row == k // _CELLS[0])
            if own.sum() > 2:
                yield Cell(recording, strokes, graph.take(own))


def _placed(recording: Recording, number: int) -> list[Array]:
    places = np.concatenate(recording.strokes)
    low, high = places.min(axis=0), places.max(axis=0)
    size = float((high - low).max())
    scale = _LETTER / size if not _LETTER / 2 <= size <= _LETTER else 1.0
    middle = np.array([22 + (number % _CELLS[0]) * _CELL[0], 22 + (number // _CELLS[0]) * _CELL[1]])
    return [(xy - (low + high) / 2) * scale + middle for xy in recording.strokes]
