"""How well the pen paths that handout writes in can be read, and how much of what is misread is theirs.

Readers of paths see order and direction, letter by letter and without a language: the one that ships, and a second
(`second_path_reader.npz` beside this file, where it is), which differs in architecture, features, fonts, hands and
seed.  They misread half of the letters of *true* joined pens, so by themselves they judge no joined hand.  Therefore
the same words are read three times; columns are character errors:

- path: readers of paths on the strokes as they were recovered; *true* on those of the recorded pen, where it is known.
  What the first has more is ours.
- picture: readers of pictures (`pictures`, and `second_reader` where the package rapidocr is installed) on the ink, and
  on the strokes drawn with a pen of one width.  What the second has more is ink that no stroke has, or strokes that no
  ink has; order and direction they do not see.  Goal: .20, or no more than .08 over the ink.

Drawn hands show what readers cannot do: their order is known.  With HANDOUT_DATA, recorded pens (`recorded`) are inked,
read as pages, and written again where they stand.  With HANDOUT_HANDS, a folder of .hand files, these write as well.
With HANDOUT_SHEETS, a folder, 40 words of every scanned hand are shown there a fifth at a time, for a person to judge
whether a writer would go that way: frames from left to right, what is new in red with arrows, numbered where it begins.

With both readers of pictures, on ink and on strokes: c0013 .197 .155 and .213 .165, w0180 .079 .101 and .085 .128,
c0052 .167 .125 and .189 .149, w0515 .095 .063 and .110 .089, p0012 .159 .161 and .197 .221, joined German pens .428
.367 and .457 .416: no ink is lost or made up that readers see. Readers of paths, on true and on recovered strokes:
joined German .527 .555 and .603 .597, English of three writers .141 .095 and .157 .104, .031 .064 and .073 .101, .088
.067 and .140 .127.

By eye, of 40 words each, nobody would go the way of about 8 in c0013, 7 in w0180 and 18 in p0012 (9, 13 and 20 before
joined letters were cut in the middle of what joins them): pieces that cuts leave with a neighbour, a
last s with a long tail, stems that were led in from the line and are begun at their top, and rings begun elsewhere.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TypeAlias

import numpy as np

from benchmarks import order_recovery, recorded
from handout.alphabet import fold
from handout.hand import file, library
from handout.hand.drawn import Hand
from handout.hand.measures import mean_slant
from handout.hand.scanned import ScannedHand
from handout.motion.recovery.pen_paths import pen_paths
from handout.motion.trace import trace
from handout.reading import pictures, second_reader
from handout.reading.word_space import X_HEIGHT, drawn
from handout.values import Array, Indices, Page, Placed
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.reading import pen_paths as path_reader

TEXT = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8")
WORDS = 120  # of the text, which is enough for a standard error of .02
SECOND = Path(__file__).parent / "second_path_reader.npz"
SHOWN = 40  # words on a sheet
_PictureReader: TypeAlias = "pictures.Reader | second_reader.SecondReader"
_FRAMES, _MM = 5, 16  # of a word on it; pixels a mm


@dataclass(frozen=True, eq=False)
class WrittenWord:
    """A word's text and strokes (n, 2), mm, with the line it stands on.

    ink : places (n, 2), mm, and radii (n,) of its line, and edges (m, 2); None where a hand is drawn.
    true : the strokes of the recorded pen; none where it was not.
    """

    text: str
    strokes: list[Array]
    baseline: float
    x_height: float
    slant: float = 0.0
    ink: tuple[Array, Array, Indices] | None = None
    true: tuple[Array, ...] = ()


def written_words(hand: Hand | ScannedHand, text: str, seed: int = 1) -> Iterator[WrittenWord]:
    """The words of a text as the hand's pen writes them; words with letters that the hand lacks are left out."""
    scanned = isinstance(hand, ScannedHand)
    known = set(hand.letters) if isinstance(hand, ScannedHand) else set(hand.glyphs)
    chosen = " ".join([word for word in text.split() if set(word) <= known][:WORDS])
    rng = np.random.default_rng(seed)
    layout = Layout(Page(190.0, 5000.0, "scroll"), x_height=hand.x_height)
    for sheet in compose(chosen, hand, layout, rng):
        drawing = trace(sheet, hand, rng)
        strokes = {word: [s.xy for s in own] for word, own in groupby(drawing.strokes, key=lambda stroke: stroke.word)}
        for line in sheet.lines:
            for word, placed in groupby(line.placed, key=lambda unit: unit.word):
                units, own = list(placed), strokes.get(word, [])
                if own:
                    middle = np.array([float(np.mean([xy[:, 0].mean() for xy in own]))])
                    letters = "".join({unit.at: unit.glyph.letter for unit in units}.values())
                    slant = mean_slant(hand) if isinstance(hand, ScannedHand) else 0.0
                    ink = _ink(units) if scanned else None
                    yield WrittenWord(letters, own, float(line.height_at(middle)[0]), sheet.x_height, slant, ink)


def _ink(units: Sequence[Placed]) -> tuple[Array, Array, Indices]:
    graphs = [unit.ink.graph for unit in units if unit.ink is not None]
    first = np.cumsum([0, *map(len, graphs)])
    edges = [graph.edges + at for graph, at in zip(graphs, first, strict=False)]
    return np.concatenate([g.xy for g in graphs]), np.concatenate([g.radius for g in graphs]), np.concatenate(edges)


def recorded_words(pages: Sequence[Sequence[recorded.Recording]]) -> Iterator[WrittenWord]:
    """The words of recorded writers, inked, read as a page and recovered where they stand."""
    for hand, true, words, texts in order_recovery.read_pages(pages):
        page, lines = hand.pages[0], order_recovery.as_written(hand).lines
        placed = [unit for line in lines for unit in line.placed if unit.ink is not None]
        paths = [path for line in lines for path in pen_paths(line.placed, hand)]
        for word, some in groupby(placed, key=lambda unit: unit.word):
            units = list(some)
            ink = _ink(units)
            name = order_recovery.most_within(ink[0], true, words)
            row, middle = hand.glyphs[units[0].ink.number].line if units[0].ink else 0, ink[0][:, 0].mean() / page.pixel
            if texts[name] == "".join(unit.glyph.letter for unit in units):
                strokes = [path.xy for path in paths if path.word == word]
                own = tuple(xy for xy, of in zip(true, words, strict=True) if of == name)
                base = float(page.base(row, middle)) * page.pixel
                yield WrittenWord(texts[name], strokes, base, page.x_height, page.slant, ink, own)


def picture_of(word: WrittenWord, *, of_ink: bool) -> Array:
    """A word's ink, or its strokes drawn with a pen as wide as that usually is, in word space."""
    assert word.ink is not None
    xy, radius, edges = word.ink
    if not of_ink:
        xy, radius = np.concatenate(word.strokes), np.full(sum(map(len, word.strokes)), float(np.median(radius)))
        edges = np.column_stack([np.arange(len(xy) - 1), np.arange(1, len(xy))])
        edges = np.delete(edges, np.cumsum([len(stroke) for stroke in word.strokes])[:-1] - 1, axis=0)
    up, scale = word.baseline - xy[:, 1], X_HEIGHT / word.x_height
    return drawn(scale * np.column_stack([xy[:, 0] - word.slant * up, up]), scale * radius, edges)


def error(words: Sequence[WrittenWord], read: Callable[[WrittenWord], str]) -> float:
    """Letters that a reader misreads, of all."""
    wrong = sum(path_reader.edits("".join(map(fold, word.text)), read(word)) for word in words)
    return wrong / max(sum(len(word.text) for word in words), 1)


def row(name: str, words: Sequence[WrittenWord]) -> str:
    """What every reader misreads."""
    shown = f"{name:<26}{len(words):>6}"
    for network in (path_reader.shipped(), *([path_reader.load(SECOND)] if SECOND.is_file() else [])):
        for known in (True, False):

            def of_path(word: WrittenWord, known: bool = known, network: path_reader.PathNetwork = network) -> str:
                strokes = word.true if known else word.strokes
                return path_reader.read(strokes, word.baseline, word.x_height, network=network).text

            shown += f"{error(words, of_path):>9.3f}" if not known or all(word.true for word in words) else f"{'-':>9}"
    for reader in (pictures.load(), second_reader.load()):
        for of_ink in (True, False):

            def of_picture(word: WrittenWord, of_ink: bool = of_ink, reader: _PictureReader | None = reader) -> str:
                return "".join(map(fold, reader.read_all([picture_of(word, of_ink=of_ink)])[0].text)) if reader else ""

            known = reader is not None and all(word.ink is not None for word in words)
            shown += f"{error(words, of_picture):>9.3f}" if known else f"{'-':>9}"
    return shown


def show(words: Sequence[WrittenWord], to: Path) -> None:
    """Words a fifth of their length at a time, for a person to judge."""
    from PIL import Image, ImageDraw

    rows = []
    for word in words[:SHOWN]:
        xy = np.concatenate(word.strokes)
        low, size = xy.min(axis=0) - 1, np.ceil((np.ptp(xy, axis=0) + 2) * _MM).astype(int)
        frame = Image.new("RGB", (int(size[0]) * _FRAMES, int(size[1])), "white")
        pen = ImageDraw.Draw(frame)
        runs = [np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(one, axis=0).T))]) for one in word.strokes]
        begin = np.cumsum([0.0, *(run[-1] for run in runs)])
        for k in range(_FRAMES):
            since, until = begin[-1] * k / _FRAMES, begin[-1] * (k + 1) / _FRAMES
            for n, (stroke, run) in enumerate(zip(word.strokes, runs, strict=True)):
                at, here = (stroke - low) * _MM + (int(size[0]) * k, 0), begin[n] + run
                pen.line([*map(tuple, at[here <= until].tolist())], "grey")
                new = at[(here >= since) & (here <= until)]
                pen.line([*map(tuple, new.tolist())], "red")
                for i in range(8, len(new), 16):
                    ahead = new[i] - new[i - 3]
                    ahead *= 4 / max(float(np.hypot(*ahead)), 1e-9)
                    side = np.array([-ahead[1], ahead[0]]) / 2
                    pen.polygon([*map(tuple, (new[i] + [ahead, side - ahead, -side - ahead]).tolist())], "red")
                if since <= here[0] < until:
                    pen.text(tuple(at[0].tolist()), str(n + 1), "black")
        rows.append(frame)
    sheet = Image.new("RGB", (max(one.width for one in rows), sum(one.height for one in rows)), "white")
    for one, y in zip(rows, np.cumsum([0, *(one.height for one in rows)]).tolist(), strict=False):
        sheet.paste(one, (0, y))
    sheet.save(to)


def main() -> None:
    """Print the table."""
    columns = [f"{of:>9}" for one in ("path", "path 2") for of in ("true", one)]
    columns += [f"{of:>9}" for one in ("strokes", "strokes 2") for of in ("ink", one)]
    print(f"{'':<26}{'words':>6}" + "".join(columns))
    hands: dict[str, Hand | ScannedHand] = {
        name: library.find(name) for name in (*("house-joined", "house-quick", "house-print"), *library.scanned_files())
    }
    folder, data, sheets = (os.environ.get(f"HANDOUT_{name}") for name in ("HANDS", "DATA", "SHEETS"))
    hands |= {path.stem: file.load(path) for path in sorted(Path(folder).glob("*.hand"))} if folder else {}
    for name, hand in hands.items():
        words = list(written_words(hand, TEXT))
        print(row(name, words), flush=True)
        if sheets and isinstance(hand, ScannedHand):
            show(words, Path(sheets) / f"{name}.png")
    if data and (pens := Path(data) / "pen" / "unipen").is_dir():
        for name, pages in (("English", recorded.english(pens)), ("German", recorded.writers(recorded.words(pens)))):
            found = list(recorded_words(pages))
            print(row(f"recorded {name}", found), flush=True)


if __name__ == "__main__":
    main()
