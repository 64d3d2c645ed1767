"""A page of a real writer parted into lines that a hand is read from and lines that are kept out of it.

Nothing of a kept-out line may reach the hand: neither a letter, nor a shade of its ink in what the ink of the hand is
measured from, nor its words.  So the other lines are lifted off the scan and laid on the page's own paper as it is
without ink (`WrittenPage.matte`), each in the place of a line further up, and that picture with the text of these lines
alone is read as any scan is.  They close up because the distance of lines is what sizes are told in.

Of a hand that comes with the program there are no scans any more, only their ink.  Its pages are that ink on white, and
it loses the glyphs of the kept-out lines.  The distance of lines, slant and size of its pages stay those of all lines.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.parts import DPI, LUMA
from handout.hand import file, library
from handout.hand.scanned import ScannedHand, ScannedPage
from handout.scanning.scan import Scan
from handout.scanning.text_lines import line_owners
from handout.scanning.written_page import WrittenPage, read_page
from handout.tagging.line_space import frames
from handout.tagging.page_tagging import hand_of_pages, tag_page, with_transcript_lines
from handout_lab.score.features import LineFeatures, measure_lines
from handout_lab.score.repetition import repetition
from handout_lab.score.written_lines import read_page as read_grey

AROUND = 0.5  # mm of paper that go with the ink of a line

_HEAD = re.compile(r"^## (\S+)[^\n]*\n(.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True, eq=False)
class Author:
    """Pages with their text, line by line, and their lines as they are measured.

    lines : (n,) measured, of the scan itself, or of the ink of a whole hand.
    repetition : of the worst page.
    whole : the hand of all lines, for one that comes with the program.
    """

    name: str
    path: Path
    text: tuple[str, ...]
    lines: tuple[LineFeatures, ...]
    repetition: float
    whole: ScannedHand | None = None

    def given(self, fold: int) -> list[int]:
        """Numbers of the lines that a hand is read from: every other one, from the first (fold 0) or second (1)."""
        return list(range(fold, len(self.text), 2))

    def kept_out(self, fold: int) -> list[int]:
        """Numbers of the other lines."""
        return list(range(1 - fold, len(self.text), 2))


def read_author(folder: Path, name: str) -> Author:
    """The author of `name` ("cvl/0013_1") in a folder of scans with their transcripts."""
    path = folder / f"{name}.png"
    said = dict(_HEAD.findall((path.parent / "TRANSCRIPTS.md").read_text(encoding="utf-8")))
    text = said.get(path.name) or said[path.stem]
    grey = read_grey(path, DPI)
    lines, written = measure_lines(grey), tuple(line for line in text.strip().splitlines() if line.strip())
    if len(lines) != len(written):
        raise ValueError(f"{name}: {len(lines)} lines found, {len(written)} in its transcript")
    return Author(name, path, written, tuple(lines), repetition(grey))


def shipped_author(name: str) -> Author:
    """The simulated author of a scanned hand that comes with the program."""
    path = library.scanned_file(name)
    hand = file.load(path)
    greys = [_on_white(page) for page in hand.pages]
    measured = [measure_lines(grey) for grey in greys]
    written = [page.transcript.splitlines() for page in hand.pages]
    found, said = list(map(len, measured)), list(map(len, written))
    if not found == said == [len(page.baselines) for page in hand.pages]:
        raise ValueError(f"{name}: {found} lines found, {said} in its transcripts")
    text, lines = tuple(chain.from_iterable(written)), tuple(chain.from_iterable(measured))
    return Author(name, path, text, lines, max(map(repetition, greys)), hand)


def hand_without(author: Author, fold: int) -> ScannedHand:
    """The hand that the lines `author.given(fold)` show, and nothing else."""
    if author.whole is not None:
        first = np.cumsum([0, *(len(page.baselines) for page in author.whole.pages)])
        given = set(author.given(fold))
        kept = [i for i, glyph in enumerate(author.whole.glyphs) if int(first[glyph.page]) + glyph.line in given]
        return author.whole.take_glyphs(kept)
    scan, text = without(author, fold)
    rng = np.random.default_rng((7, fold))
    return hand_of_pages(f"{author.path.stem}-{fold}", [tag_page(read_page(scan), text, rng=rng)])


def without(author: Author, fold: int) -> tuple[Scan, str]:
    """The scan and the text of the page without its kept-out lines."""
    text = "\n".join(author.text)
    written = with_transcript_lines(read_page(author.path, dpi=DPI), text, np.random.default_rng(7))
    if len(written.text_lines.lines) != len(author.text):
        raise ValueError(
            f"{author.name}: the scan has {len(written.text_lines.lines)} lines, its text {len(author.text)}"
        )
    given = author.given(fold)
    return Scan(closed_up(written, given), DPI, f"{author.name}, half"), "\n".join(author.text[i] for i in given)


def closed_up(written: WrittenPage, given: list[int]) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: the given lines on the page's own paper, the k-th of them in the place of the page's k-th."""
    lines = frames(written)
    owner = _around(line_owners(written.mask.ink, lines), written.scan.pixels(AROUND))
    picture = written.matte.paper.copy()
    height = picture.shape[0]
    for place, number in enumerate(given):
        y, x = np.nonzero(owner == number)
        middle = lines[number].middle
        moved = y + round(float(lines[place].base(middle) - lines[number].base(middle)))
        on = (moved >= 0) & (moved < height)
        picture[moved[on], x[on]] = written.scan.rgb[y[on], x[on]]
    return picture


def _on_white(page: ScannedPage) -> NDArray[np.uint8]:
    """(h, w) uint8: luma of a page's ink on white."""
    white = replace(page, paper=np.full((1, 1, 3), 255, dtype=np.uint8))
    return np.asarray(np.rint(white.on_paper() @ LUMA), dtype=np.uint8)


def _around(owner: NDArray[np.int16], reach: float) -> NDArray[np.int16]:
    """The same (h, w) with the paper next to ink, that of the nearest ink."""
    from scipy.ndimage import distance_transform_edt

    away, nearest = distance_transform_edt(owner < 0, return_indices=True)
    spread = owner[nearest[0], nearest[1]]
    return np.asarray(np.where(away <= reach, spread, -1), dtype=np.int16)
