"""The options of the laboratory's verbs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from handout.pipeline.declarations import FILES, HAND, option


@dataclass(frozen=True)
class StudyOptions:
    """A study of how well people tell made writing from real."""

    hand: tuple[str, ...] = option((), "A scanned hand, or a .hand file; may be repeated.", HAND, required=True)
    real: tuple[Path, ...] = option(
        (),
        "A folder of scans that real words are cut from, each with its text in a .txt file beside it (prompt "
        "sheets need none), for each --hand; default: the pages that the hand was read from.",
        FILES,
    )
    people: int = option(20, "How many are asked.", least=1)
    singles: int = option(10, "Questions A for each.", least=0)
    pairs: int = option(10, "Questions B for each.", least=0)
    snippets: int = option(60, "Pieces of each hand at most.", least=1)
    control: str = option("", "Another person's scanned hand, for pairs that everybody should tell.", HAND)
    controls: int = option(2, "Pairs of --control for each person.", least=0)
    random: int = option(
        0, "Pairs for each person whose fake is made by random selection, the simple way to compare with.", least=0
    )
    random_people: bool = option(False, "Instead of --random: half of the people see such fakes alone, in A and in B.")
    sampling: str = option(
        "balanced",
        "Everybody's pieces: each piece as often as any other, or drawn by chance.",
        choices=("balanced", "random"),
    )
    envelopes: Path | None = option(
        None, "A file of addresses, parted by empty lines: a test of envelopes, half of them made.", FILES
    )
    page: str = option("A4", "A4 or letter.")
    about: bool = option(False, "Ask on the cover for age, habit of writing, and hand.")
    title: str = option("A study of handwriting", "On the cover.")
    dpi: float | None = option(None, "Pixels an inch of the scans, where the files do not say.")
    seed: int | None = option(None, "Same seed, same sheets; without it every run differs.", least=0)
