"""How like an author's own lines text is that handout writes in his hand, on lines that the hand has never seen.

For each author a hand is read from every other line of one page (`benchmarks.keeping_out`), new text is written in it,
and the pages are compared with the lines that were kept out; then the same with the two halves changed over, so that
every line is kept out once.  The pages are read from the folder in HANDOUT_DATA (`scans/cvl`, `scans/csafe`).  The
scanned hands that come with the program are judged likewise: their author is the simulated one.

- ratio: hinge (run lengths, quill) distance from the made lines to the kept-out ones, in units of the distance between
  random halves of the author's own lines, the same amount of ink everywhere.  Goal 1.5.
- rank: of the author among all writers of the folder when the made lines are asked whose they are; every writer is
  there with half of his lines, the author with those kept out.  Goal 1.
- repetition: of the worse page.  Goal .02.
- told apart: what share of lines a classifier tells right, real or made, with its 95 % interval and the number of
  lines it stands on.  Goal .60.

The first columns show that the measures can pass and can fail: the author's other real lines, the lines of another
author, and a drawn built-in hand in ballpoint (never the one that a simulated author writes).  The others switch the
parts of the writing on one by one, as seed 000, Appendix F does:

a) random selection: any glyph of the letter, constant gaps, heights as they were on the page, no ligatures;
b) glyphs chosen by dynamic programming: ligatures compared where they lie on the line, neighbours as like each other
   as the author's own, none written again soon;
c) gaps learned from the hand, and letters settled, so that none come nearer than the author's do;
d) heights inferred from shapes, and from ligatures though they are not written yet;
e) ligatures written;
f) seams cut through overlapping ink: all that the paper has.

Ours bends the glyphs too, before gaps are settled and lines broken, and is what handout writes; the column after it is
the same with half of the variation.  In a second table of each author one part is switched off and all others are on;
there choosing is taken apart as well: "no fit" takes any ligature for as good as any other, "no likeness" lets
neighbours differ as they will.  What takes the place of a part is told in `benchmarks.parts`.  The text is of the
program's own sentences, never the page's, and of letters that the half page has.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.keeping_out import Author, hand_without, read_author, shipped_author
from benchmarks.likeness import house_page, real_pages
from benchmarks.parts import write as written_in_parts
from handout.hand.scanned import ScannedHand
from handout.prompting.corpus import shipped_sentences
from handout_lab.score.comparison import closeness, rank_writers
from handout_lab.score.features import Distance, LineFeatures, PageFeatures, full_lines, mean, measure_lines, pool_lines
from handout_lab.score.repetition import repetition
from handout_lab.score.two_sample import TwoSample, together, two_sample

AUTHORS = ("cvl/0013_1", "cvl/0012_1", "csafe/w0238_s01_pLND_r01", "csafe/w0180_s01_pWOZ_r01")
SHIPPED = ("house-joined-ballpoint", "house-print-fountain")
OWN, DRAWN, OURS = "own lines", "drawn hand", "ours"
FOLDS = (0, 1)
GOALS = {"hinge": 1.5, "runs": 1.5, "quill": 1.5, "rank": 1, "repetition": 0.02, "told apart": 0.60}
SHOWN = 10  # lines that are written for each hand: more cost time, and the real lines are few anyway

Grey = NDArray[np.uint8]
Write = Callable[..., Sequence[Grey]]  # write(hand, text, seed, **switches): pages (h, w) uint8 at 300 dpi
OFF: dict[str, Any] = {
    "choice": "random",
    "fit": False,
    "likeness": False,
    "spacing": "constant",
    "heights": "source",
    "ligatures": False,
    "seams": False,
    "bending": False,
}
STEPS: dict[str, dict[str, Any]] = {
    "a random": {},
    "b chosen": {"choice": "best", "fit": True, "likeness": True},
    "c gaps": {"spacing": "learned"},
    "d heights": {"heights": "learned"},
    "e ligatures": {"ligatures": True},
    "f seams": {"seams": True},
    OURS: {"bending": True},
}


@dataclass(frozen=True, eq=False)
class Candidate:
    """Something that may be the author's writing: its lines, measured, and how often its worst page repeats itself."""

    lines: Sequence[LineFeatures]
    repetition: float


@dataclass(frozen=True)
class Result:
    """What is said of one candidate for one author: figures of `GOALS` and the test behind the last of them."""

    ratio: Distance
    rank: int
    repetition: float
    test: TwoSample

    def figures(self) -> dict[str, float]:
        """By the names of `GOALS`."""
        ratios = {kind: getattr(self.ratio, kind) for kind in ("hinge", "runs", "quill")}
        return {**ratios, "rank": self.rank, "repetition": self.repetition, "told apart": self.test.accuracy}


def switches() -> dict[str, dict[str, Any]]:
    """Column → every switch of the writing, each column with one more switched on than the one before."""
    on, found = dict(OFF), {}
    for name, more in STEPS.items():
        on = {**on, **more}
        found[name] = on
    return {**found, "ours, half": {**on, "variation": 0.5}}


def left_out() -> dict[str, dict[str, Any]]:
    """Column → every switch, one of them off and all the others on; without bending that is column f."""
    on = switches()[OURS]
    return {f"no {part}": {**on, part: off} for part, off in OFF.items() if part != "bending"}


def writable(hand: ScannedHand, author: Author, lines: int = SHOWN) -> str:
    """Lines of new text about as long as the author's, of words whose letters the hand has."""
    longest = float(np.median([len(line) for line in author.text]))
    rows, row = list[str](), ""
    for word in _words(frozenset(hand.letters)):
        if row and len(row) + 1 + len(word) > longest:
            rows.append(row)
            row = ""
        row = f"{row} {word}".strip()
        if len(rows) == lines:
            break
    return "\n".join(rows)


def _words(letters: frozenset[str]) -> Iterator[str]:
    """Words of other sentences: first of those that can be written whole, then of those that lack the least."""
    parts = [[word for word in sentence.split() if letters.issuperset(word)] for sentence in shipped_sentences()]
    shares = [len(part) / len(sentence.split()) for part, sentence in zip(parts, shipped_sentences(), strict=True)]
    for number in np.argsort(np.negative(shares), kind="stable"):
        yield from parts[number]


def judge(author: Author, fold: int, candidate: Candidate, crowd: Mapping[str, PageFeatures], seed: int = 0) -> Result:
    """A candidate against the lines that were kept out."""
    rng = np.random.default_rng((seed, fold))
    real = _full(author, author.kept_out(fold))
    near = closeness(real, candidate.lines, rng, author=full_lines(author.lines))
    gallery = {**{name: style for name, style in crowd.items() if name != author.path.stem}, "\0": pool_lines(real)}
    rank = rank_writers(pool_lines(_as_many(candidate.lines, len(real), rng)), gallery).rank("\0")
    return Result(near.ratio, rank, candidate.repetition, two_sample(real, candidate.lines, rng))


def both(results: Sequence[Result]) -> Result:
    """Both folds, or several authors: mean ratios, the worst rank and repetition, the tests together."""
    return Result(
        mean([result.ratio for result in results]),
        max(result.rank for result in results),
        max(result.repetition for result in results),
        together([result.test for result in results]),
    )


def sanity(authors: Sequence[Author]) -> dict[str, Callable[[Author, int], Candidate]]:
    """Candidates that must pass (the first) and must fail."""

    def own(author: Author, fold: int) -> Candidate:
        return Candidate(_full(author, author.given(fold)), author.repetition)

    def stranger(author: Author, fold: int) -> Candidate:
        other = authors[(authors.index(author) + 1) % len(authors)]
        return own(other, fold)

    def house(author: Author, fold: int) -> Candidate:
        return _house("house-print" if author.name.startswith("house-joined") else "house-joined", fold)

    return {OWN: own, "stranger": stranger, DRAWN: house}


def written(write: Write, on: Mapping[str, Any]) -> Callable[[Author, int], Candidate]:
    """A candidate written in the hand that the given lines show, with some switches on."""

    def candidate(author: Author, fold: int) -> Candidate:
        hand = _hand(author, fold)
        return _candidate(write(hand, writable(hand, author), fold, **on))

    return candidate


def measure(authors: Sequence[Author], folder: Path, write: Write | None = None) -> dict[str, dict[str, Result]]:
    """Author → column → result; "all" for all authors together."""
    crowd = {name: _half(grey) for name, grey in real_pages(folder).items()}
    columns = sanity(authors)
    if write:
        columns |= {name: written(write, on) for name, on in {**switches(), **left_out()}.items()}
    found: dict[str, dict[str, Result]] = {}
    for author in authors:
        found[author.name] = {
            name: both([judge(author, fold, make(author, fold), crowd) for fold in _folds(name)])
            for name, make in columns.items()
        }
    found[f"all {len(authors)} authors"] = {name: both([row[name] for row in found.values()]) for name in columns}
    return found


def main() -> None:
    """Print a table an author, and one for all."""
    given = os.environ.get("HANDOUT_DATA")
    if not given or not (Path(given) / "scans").is_dir():
        print("HANDOUT_DATA names no folder with scans of real pages: there is nothing to compare with.")
        sys.exit(0)
    folder, alone = Path(given), left_out()
    people = [read_author(folder / "scans", name) for name in AUTHORS]
    for authors in (people, [shipped_author(name) for name in SHIPPED]):
        for name, columns in measure(authors, folder, written_in_parts).items():
            _print(name, {column: result for column, result in columns.items() if column not in alone})
            _print(name, {column: columns[column] for column in (OURS, *alone)})


def _print(name: str, columns: Mapping[str, Result]) -> None:
    print(f"\n{name:<22}" + "".join(f"{column:>14} " for column in columns) + "  goal")
    for figure, goal in GOALS.items():
        cells = [(value := result.figures()[figure], " " if value <= goal else "!") for result in columns.values()]
        print(f"{figure:<22}" + "".join(f"{value:>14.3g}{mark}" for value, mark in cells) + f"  ≤ {goal:g}")
    intervals = [f"{r.test.low:.2f}–{r.test.high:.2f}" for r in columns.values()]
    print(f"{'  95 % interval':<22}" + "".join(f"{text:>14} " for text in intervals))
    counts = [f"{r.test.real} + {r.test.made}" for r in columns.values()]
    print(f"{'  lines, real + made':<22}" + "".join(f"{text:>14} " for text in counts))
    print(f"{'  p of guessing':<22}" + "".join(f"{r.test.p:>14.3f} " for r in columns.values()))
    print(f"{'  verdict':<22}" + "".join(f"{r.test.verdict.removesuffix(' to say'):>14} " for r in columns.values()))


def _candidate(pages: Sequence[Grey]) -> Candidate:
    lines = [line for page in pages for line in measure_lines(page)]
    return Candidate(full_lines(lines), max(repetition(page) for page in pages))


@cache
def _hand(author: Author, fold: int) -> ScannedHand:
    return hand_without(author, fold)


@cache
def _house(name: str, seed: int) -> Candidate:
    return _candidate([house_page(name, seed)])


def _folds(column: str) -> Sequence[int]:
    """Changed over, the author's own halves would be the same comparison once more."""
    return FOLDS[:1] if column == OWN else FOLDS


def _full(author: Author, numbers: Sequence[int]) -> list[LineFeatures]:
    """Some of the author's lines, without those far shorter than his others."""
    full = {id(line) for line in full_lines(author.lines)}
    return [author.lines[i] for i in numbers if id(author.lines[i]) in full]


def _half(grey: Grey) -> PageFeatures:
    return pool_lines(full_lines(measure_lines(grey))[::2])


def _as_many(lines: Sequence[LineFeatures], count: int, rng: np.random.Generator) -> list[LineFeatures]:
    return [lines[i] for i in rng.permutation(len(lines))[:count]]


if __name__ == "__main__":
    main()
