"""A page among other people's: how far the nearest of them is, and which page comes first.

Whoever retrieves a writer's other page first among many writers' pages has told him apart; a page that is no
further from the nearest stranger than strangers are from each other could be one of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.score.hinge import chi_square, hinge
from handout.score.pages import ink, read_page
from handout.score.quill import quill
from handout.score.runs import run_distance, runs
from handout.values import Array

KINDS = ("hinge", "runs", "quill")
_IMAGES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"}


@dataclass(frozen=True, eq=False)
class Style:
    """What is compared of a page: `hinge` (24, 24), `runs` (4, 60), `quill` (24, 20), see the modules so named."""

    hinge: Array
    runs: Array
    quill: Array


@dataclass(frozen=True)
class Distance:
    """Two pages compared: χ² of `hinge` and `quill`, mean χ² of the run lengths, all 0–1."""

    hinge: float
    runs: float
    quill: float


@dataclass(frozen=True)
class Standing:
    """A page in a crowd of n.

    names : (n,) pages of the crowd, the nearest by hinge first.
    distances : (n,) to them.
    own : (n,) distances from each page of the crowd to its own nearest other; empty for n < 2.
    """

    names: tuple[str, ...]
    distances: tuple[Distance, ...]
    own: tuple[Distance, ...]

    @property
    def nearest(self) -> Distance:
        """The least distance of each kind, not always to the same page."""
        return least(self.distances)

    def further(self) -> Distance:
        """Shares of the crowd that are further from their own nearest than the page is from its."""
        near = self.nearest
        return Distance(*(float(np.mean([getattr(d, k) > getattr(near, k) for d in self.own] or [0])) for k in KINDS))

    def rank(self, name: str) -> int:
        """1 where the page of that name is the nearest by hinge, 2 where it comes second …"""
        return self.names.index(name) + 1


def style(mask: NDArray[np.bool_]) -> Style:
    """Measure the ink (h, w) of a page at about 300 dpi.

    Raises
    ------
    InputError
        Less ink than a word has.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        raise InputError("There is no ink on the page: nothing can be compared.")
    part = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    bends = hinge(part)
    if not bends.any():
        raise InputError("There is too little ink on the page to compare: it needs at least a word.")
    return Style(bends, runs(part), quill(part))


def distance(a: Style, b: Style) -> Distance:
    """How far two pages are from each other; the order does not matter."""
    return Distance(chi_square(a.hinge, b.hinge), run_distance(a.runs, b.runs), chi_square(a.quill, b.quill))


def least(distances: Sequence[Distance]) -> Distance:
    """The least of each kind."""
    return Distance(*(min(getattr(d, kind) for d in distances) for kind in KINDS))


def mean(distances: Sequence[Distance]) -> Distance:
    """The mean of each kind."""
    return Distance(*(float(np.mean([getattr(d, kind) for d in distances])) for kind in KINDS))


def read_crowd(folder: Path, leave_out: Sequence[Path] = ()) -> dict[str, Style]:
    """The images of a folder and of the folders in it, by their paths in it.

    Parameters
    ----------
    leave_out : files that are not read, such as the page that is to be compared.

    Raises
    ------
    InputError
        No such folder, no other image in it, or an image that cannot be read.
    """
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder: a crowd is a folder of page images.")
    out = {path.resolve() for path in leave_out}
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in _IMAGES and path.resolve() not in out)
    if not files:
        raise InputError(f"There is no other page in {folder}: a crowd needs {', '.join(sorted(_IMAGES))} files.")
    return {path.relative_to(folder).as_posix(): _read(path) for path in files}


def standing(page: Style, crowd: Mapping[str, Style]) -> Standing:
    """Where a page stands among others; it should not be one of them itself."""
    if not crowd:
        raise InputError("The crowd is empty: nothing can be compared.")
    found = sorted(((distance(page, other), name) for name, other in crowd.items()), key=lambda d: (d[0].hinge, d[1]))
    own = tuple(own_nearest(list(crowd.values())))
    return Standing(tuple(name for _, name in found), tuple(d for d, _ in found), own)


def own_nearest(pages: list[Style]) -> list[Distance]:
    """For each page the distances to the nearest of the others; empty for fewer than two."""
    if len(pages) < 2:
        return []
    between = {(i, j): distance(pages[i], pages[j]) for i in range(len(pages)) for j in range(i)}
    others = range(len(pages))
    return [least([between[max(i, j), min(i, j)] for j in others if j != i]) for i in others]


def _read(path: Path) -> Style:
    try:
        return style(ink(read_page(path)))
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error
