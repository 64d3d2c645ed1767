"""The options of the laboratory's verbs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class StudyOptions:
    """A study of how well people tell made writing from real."""

    hand: tuple[str, ...] = ()  # scanned hands, or .hand files
    real: tuple[Path, ...] = ()  # for each hand a folder of scans that real snippets are cut from; none: its own pages
    people: int = 20
    singles: int = 10  # questions of questionnaire A for each person
    pairs: int = 10  # of questionnaire B
    snippets: int = 60  # of each hand at most, real and made
    control: str = ""  # another person's scanned hand: pairs that are easy
    controls: int = 2  # such pairs for each person, where `control` is given
    random: int = 0  # pairs for each person whose made one is of letters taken by chance
    random_people: bool = False  # half of the people see such ones alone
    sampling: str = "balanced"  # or "random": everybody's snippets are drawn by chance
    envelopes: Path | None = None  # a file of addresses, parted by empty lines: half go on made envelopes
    page: str = "A4"  # or letter
    about: bool = False  # whether the cover asks for age, habit and hand
    title: str = "A study of handwriting"
    dpi: float | None = None  # of the scans, where the files do not say
    seed: int | None = None  # same seed, same sheets; None: one by chance
