"""Pages compared: made writing with its author's, and a page with other people's.

How far made writing is from its author is told in units of how far the author is from himself.  Half of the author's
lines, drawn at random, is compared with his other half, and as much of the made writing with as much of his: distances
between histograms shrink with the amount of ink, so all amounts are the same.  The ratio is 1 for writing that is his;
the goal is a ratio of the hinge of 1.5 at most.

Whoever retrieves a writer's other page first among many writers' pages has told him apart; a page that is no further
from the nearest stranger than strangers are from each other could be one of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handout.errors import InputError
from handout_lab.score.features import (
    KINDS,
    Distance,
    LineFeatures,
    PageFeatures,
    distance,
    full_lines,
    least,
    mean,
    page_features,
    pool_lines,
)
from handout_lab.score.two_sample import TwoSample, two_sample
from handout_lab.score.written_lines import ink, read_page

DRAWS = 24  # of halves
LEAST = 4  # lines: with fewer a half is one line


_IMAGES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"}


@dataclass(frozen=True)
class Closeness:
    """Means over random draws.

    own : between halves of the author's lines.
    across : between as much of the author's lines and of the made ones.
    lines, made : how many lines there were.
    draws : how many draws; where they all hold the same lines, fewer.
    """

    own: Distance
    across: Distance
    lines: int
    made: int
    draws: int

    @property
    def ratio(self) -> Distance:
        """`across` over `own`, of each kind."""
        return Distance(*(getattr(self.across, kind) / max(getattr(self.own, kind), 1e-9) for kind in KINDS))


def half_to_half(
    lines: Sequence[LineFeatures], rng: np.random.Generator, *, draws: int = DRAWS, amount: float = np.inf
) -> list[Distance]:
    """Distances between random halves of an author's lines.

    Parameters
    ----------
    lines : at least `LEAST`.
    amount : contour points of either half, if less than half of all.

    Raises
    ------
    InputError
        Too few lines.
    """
    if len(lines) < LEAST:
        raise InputError(f"There are {len(lines)} lines, and comparing halves needs at least {LEAST}.")
    distances = []
    for _ in range(draws):
        order = rng.permutation(len(lines))
        first, other = ([lines[i] for i in part] for part in (order[::2], order[1::2]))
        distances.append(distance(pool_lines(_as_much(first, amount)), pool_lines(_as_much(other, amount))))
    return distances


def closeness(
    real: Sequence[LineFeatures],
    synthetic: Sequence[LineFeatures],
    rng: np.random.Generator,
    *,
    author: Sequence[LineFeatures] | None = None,
    draws: int = DRAWS,
) -> Closeness:
    """How far made lines are from real ones of their author.

    Parameters
    ----------
    real : lines that the made ones are compared with: none that they were made from.
    synthetic : lines of writing in that hand.
    author : all lines of the author that there are, for the distance between halves; by default `real`.

    Raises
    ------
    InputError
        Fewer than `LEAST` lines of the author, or none that were made.
    """
    author = real if author is None else author
    if not real or not synthetic:
        raise InputError("There is no line to compare.")
    half = sum(line.amount for line in author) / 2
    amount = min(half, *(sum(line.amount for line in lines) for lines in (real, synthetic)))
    halves = half_to_half(author, rng, draws=draws, amount=amount)
    across = []
    for _ in range(draws):
        first, other = ([lines[i] for i in rng.permutation(len(lines))] for lines in (real, synthetic))
        across.append(distance(pool_lines(_as_much(first, amount)), pool_lines(_as_much(other, amount))))
    return Closeness(mean(halves), mean(across), len(author), len(synthetic), draws)


def _as_much(lines: Sequence[LineFeatures], amount: float) -> Sequence[LineFeatures]:
    """The first lines that come nearest to an amount of contour points together, one at least."""
    total = np.cumsum([line.amount for line in lines])
    return lines[: int(np.argmin(np.abs(total - amount))) + 1] if np.isfinite(amount) else lines


@dataclass(frozen=True)
class Comparison:
    """What can be said of a made page, line by line.

    closeness : how far it is from the author, in units of his own halves; None with too few lines.
    test : whether a classifier tells the lines apart; None with too few lines.
    notes : sentences that say what could not be measured, and why.
    """

    closeness: Closeness | None
    test: TwoSample | None
    notes: tuple[str, ...]


def compare(real: Sequence[LineFeatures], synthetic: Sequence[LineFeatures], rng: np.random.Generator) -> Comparison:
    """Hold a made page against its author's.

    Parameters
    ----------
    real, synthetic : their lines, as `features.measure_lines` gives them; short ones are left out here.
    """
    lines = full_lines(real), full_lines(synthetic)
    notes: list[str] = []
    near: Closeness | None = None
    test: TwoSample | None = None
    try:
        near = closeness(*lines, rng)
    except InputError as error:
        notes.append(str(error))
    try:
        test = two_sample(*lines, rng)
    except InputError as error:
        notes.append(str(error))
    return Comparison(near, test, tuple(notes))


@dataclass(frozen=True)
class WriterRanking:
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


def read_crowd(folder: Path, leave_out: Sequence[Path] = ()) -> dict[str, PageFeatures]:
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


def rank_writers(page: PageFeatures, crowd: Mapping[str, PageFeatures]) -> WriterRanking:
    """Where a page stands among others; it should not be one of them itself."""
    if not crowd:
        raise InputError("The crowd is empty: nothing can be compared.")
    ranked = sorted(((distance(page, other), name) for name, other in crowd.items()), key=lambda d: (d[0].hinge, d[1]))
    nearest = tuple(own_nearest(list(crowd.values())))
    return WriterRanking(tuple(name for _, name in ranked), tuple(d for d, _ in ranked), nearest)


def own_nearest(pages: list[PageFeatures]) -> list[Distance]:
    """For each page the distances to the nearest of the others; empty for fewer than two."""
    if len(pages) < 2:
        return []
    between = {(i, j): distance(pages[i], pages[j]) for i in range(len(pages)) for j in range(i)}
    others = range(len(pages))
    return [least([between[max(i, j), min(i, j)] for j in others if j != i]) for i in others]


def _read(path: Path) -> PageFeatures:
    try:
        return page_features(ink(read_page(path)))
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error
