"""A page of a real writer parted into lines that a hand is read from and lines that are kept out of it.

Nothing of a kept-out line may reach the hand: neither a letter, nor a shade of its ink in what the ink of the hand is
measured from, nor its words.  So the other lines are lifted off the scan and laid on the page's own paper as it is
without ink (`WrittenPage.matte`), each in the place of a line further up, and that picture with the text of these lines
alone is read as any scan is.  They close up because the distance of lines is what sizes are told in.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedHand
from handout.scanning.belonging import owners
from handout.scanning.page import Scan
from handout.scanning.reading import WrittenPage, read_page
from handout.score.measured import MeasuredLine, measure_lines
from handout.score.pages import read_page as read_grey
from handout.score.repetition import repetition
from handout.tagging.align import frames
from handout.tagging.making import make_page, read_hand, with_lines

DPI = 300.0
AROUND = 0.5  # mm of paper that go with the ink of a line

_HEAD = re.compile(r"^## (\S+)[^\n]*\n(.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True, eq=False)
class Author:
    """A page with its text, line by line, and its lines as they are measured.

    lines : (n,) measured, of the scan itself.
    repetition : of the whole page.
    """

    name: str
    path: Path
    text: tuple[str, ...]
    lines: tuple[MeasuredLine, ...]
    repetition: float

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


def hand_without(author: Author, fold: int) -> ScannedHand:
    """The hand that the lines `author.given(fold)` show, and nothing else."""
    scan, text = without(author, fold)
    rng = np.random.default_rng((7, fold))
    return read_hand(f"{author.path.stem}-{fold}", [make_page(read_page(scan), text, rng=rng)])


def without(author: Author, fold: int) -> tuple[Scan, str]:
    """The scan and the text of the page without its kept-out lines."""
    text = "\n".join(author.text)
    written = with_lines(read_page(author.path, dpi=DPI), text, np.random.default_rng(7))
    if len(written.rules.lines) != len(author.text):
        raise ValueError(f"{author.name}: the scan has {len(written.rules.lines)} lines, its text {len(author.text)}")
    given = author.given(fold)
    return Scan(closed_up(written, given), DPI, f"{author.name}, half"), "\n".join(author.text[i] for i in given)


def closed_up(written: WrittenPage, given: list[int]) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: the given lines on the page's own paper, the k-th of them in the place of the page's k-th."""
    lines = frames(written)
    owner = _around(owners(written.mask.ink, lines), written.scan.pixels(AROUND))
    picture = written.matte.paper.copy()
    height = picture.shape[0]
    for place, number in enumerate(given):
        y, x = np.nonzero(owner == number)
        middle = lines[number].middle
        moved = y + round(float(lines[place].base(middle) - lines[number].base(middle)))
        on = (moved >= 0) & (moved < height)
        picture[moved[on], x[on]] = written.scan.rgb[y[on], x[on]]
    return picture


def _around(owner: NDArray[np.int16], reach: float) -> NDArray[np.int16]:
    """The same (h, w) with the paper next to ink, that of the nearest ink."""
    from scipy.ndimage import distance_transform_edt

    away, nearest = distance_transform_edt(owner < 0, return_indices=True)
    spread = owner[nearest[0], nearest[1]]
    return np.asarray(np.where(away <= reach, spread, -1), dtype=np.int16)
