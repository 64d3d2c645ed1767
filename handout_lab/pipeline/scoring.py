"""Page images measured: repetition and statistics of each, how like the first the others are, a crowd beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from handout.errors import InputError
from handout.pipeline.results import Fact, Facts, Result
from handout_lab.score.comparison import Comparison, WriterRanking, compare, rank_writers, read_crowd
from handout_lab.score.features import Distance as Distance
from handout_lab.score.features import LineFeatures, PageFeatures, distance, measure_lines, page_features
from handout_lab.score.repetition import components, repetition
from handout_lab.score.statistics import PageStatistics, page_statistics
from handout_lab.score.written_lines import ink, read_page

_NEAREST = 5  # of a crowd, that are named
_DECIMALS = 5  # of the figures in JSON


@dataclass(frozen=True)
class ScoredPage:
    """The measures of one page; `features` and `lines` are what other pages are held against."""

    path: Path
    repetition: float
    components: int
    statistics: PageStatistics
    features: PageFeatures
    lines: Sequence[LineFeatures]

    def facts(self) -> Facts:
        """What ``--json`` prints."""
        return {
            "file": str(self.path),
            "repetition": self.repetition,
            "components": self.components,
            "statistics": asdict(self.statistics),
        }


@dataclass(frozen=True)
class ScoredPair:
    """A page held against the author's.

    rank : the place at which the author's page retrieves it among a crowd; author_rank : the other way; among : of how
    many.  0 without a crowd.
    """

    author: Path
    page: Path
    distance: Distance
    lines: Comparison
    rank: int = 0
    author_rank: int = 0
    among: int = 0

    def facts(self) -> Facts:
        """What ``--json`` prints."""
        near, test = self.lines.closeness, self.lines.test
        ranks: Facts = {"rank": self.rank, "author_rank": self.author_rank, "among": self.among}
        return {
            "from": str(self.author),
            "to": str(self.page),
            **asdict(self.distance),
            "closeness": {**asdict(near), "ratio": asdict(near.ratio)} if near else None,
            "two_sample": {**asdict(test), "verdict": test.verdict} if test else None,
            "notes": list(self.lines.notes),
            **(ranks if self.among else {}),
        }


@dataclass(frozen=True)
class CrowdedPage:
    """A page among a crowd."""

    path: Path
    ranking: WriterRanking

    @property
    def nearest(self) -> list[tuple[str, Distance]]:
        """The few nearest pages of the crowd."""
        return list(zip(self.ranking.names[:_NEAREST], self.ranking.distances, strict=False))

    def facts(self) -> Facts:
        """What ``--json`` prints."""
        near, further = asdict(self.ranking.nearest), asdict(self.ranking.further())
        return {
            "file": str(self.path),
            "pages": len(self.ranking.names),
            **{f"nearest_{kind}": value for kind, value in near.items()},
            **{f"further_{kind}": value for kind, value in further.items()},
            "nearest": [{"file": name, **asdict(apart)} for name, apart in self.nearest],
        }


@dataclass(frozen=True)
class Scores(Result):
    """What was measured of some pages; the first is the author's own."""

    pages: Sequence[ScoredPage]
    pairs: Sequence[ScoredPair]
    crowded: Sequence[CrowdedPage] | None
    seed: int

    def facts(self) -> Facts:
        facts: Facts = {
            "pages": [_rounded(page.facts()) for page in self.pages],
            "distances": [_rounded(pair.facts()) for pair in self.pairs],
        }
        if self.crowded is not None:
            facts["crowd"] = [_rounded(page.facts()) for page in self.crowded]
        return {**facts, "seed": self.seed}


def score(pages: Sequence[str | Path], crowd: Path | None = None, *, dpi: float | None = None, seed: int = 0) -> Scores:
    """Measure page images, and hold all but the first against the first.

    Parameters
    ----------
    pages : files of images; of several the first is the author's own.
    crowd : a folder of other people's pages to compare with.
    dpi : of the images, where the files do not say.
    seed : of random halves and shuffles.

    Raises
    ------
    InputError
        A page that cannot be read or has too little ink; an empty crowd.
    """
    paths = [Path(page) for page in pages]
    measured = [_measure(path, dpi, lines=len(paths) > 1) for path in paths]
    others = read_crowd(crowd, leave_out=paths) if crowd else {}
    pairs = [_compare(measured[0], page, others, np.random.default_rng(seed)) for page in measured[1:]]
    crowded = [CrowdedPage(page.path, rank_writers(page.features, others)) for page in measured] if crowd else None
    return Scores(measured, pairs, crowded, seed)


def _measure(path: Path, dpi: float | None, lines: bool) -> ScoredPage:
    """Repetition and statistics of a page, and what of it is compared; its lines one by one if they are wanted."""
    grey = read_page(path, dpi)
    try:
        statistics = page_statistics(grey)
        features = page_features(ink(grey))
        parts = measure_lines(grey) if lines else []
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return ScoredPage(path, repetition(grey), len(components(grey)), statistics, features, parts)


def _compare(
    author: ScoredPage, page: ScoredPage, crowd: Mapping[str, PageFeatures], rng: np.random.Generator
) -> ScoredPair:
    """A page held against the author's, and each looked for among the crowd by the other."""
    apart, lines = distance(author.features, page.features), compare(author.lines, page.lines, rng)
    if not crowd:
        return ScoredPair(author.path, page.path, apart, lines)
    rank = rank_writers(author.features, {**crowd, "\0": page.features}).rank("\0")
    author_rank = rank_writers(page.features, {**crowd, "\0": author.features}).rank("\0")
    return ScoredPair(author.path, page.path, apart, lines, rank, author_rank, len(crowd) + 1)


def _rounded(value: Fact) -> Fact:
    """The same with floats of five decimals."""
    if isinstance(value, float):
        return round(value, _DECIMALS)
    if isinstance(value, Mapping):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_rounded(item) for item in value]
    return value
