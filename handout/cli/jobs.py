"""What verbs that are not yet in the pipeline call of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.results import Facts
from handout.progress import silent

if TYPE_CHECKING:
    import numpy as np

    from handout.hand.scanned import ScannedHand
    from handout.pipeline.writing import WritingTask
    from handout.progress import Tell
    from handout.values import Drawing, Manuscript
    from handout.writing.layout import Layout
    from handout.writing.sheets import Sheet

    Setup = WritingTask

INK, STROKES = frozenset({"ink"}), frozenset({"strokes"})


def _writing(given: Mapping[str, Any]) -> WritingOptions:
    return WritingOptions(**{field.name: given[field.name] for field in fields(WritingOptions) if field.name in given})


def _sheet(page_name: str, given: Mapping[str, Any]) -> SheetOptions:
    return SheetOptions(page_name, given.get("margin"), given.get("pages"))


def setup(given: Mapping[str, Any], page_name: str, margin: str | None = None, pages: int | None = None) -> Setup:
    """As `pipeline.writing.prepare`."""
    from handout.cli import options
    from handout.pipeline import writing

    return writing.prepare(_writing(given), SheetOptions(page_name, margin, pages), options.pictured(given))


def on_paper(job: Setup, given: Mapping[str, Any]) -> Setup:
    """As `pipeline.writing.on_lined_paper`."""
    from handout.cli import options
    from handout.pipeline import writing

    return writing.on_lined_paper(job, _writing(given), _sheet(given["page_name"], given), options.pictured(given))


def on_sheet(look: dict[str, Any], job: Setup) -> dict[str, Any]:
    """How pictures look, with the paper's lines where they are written on."""
    return look if job.paper is None or job.paper.paper is None else {**look, "paper": job.paper.paper}


def compose_and_trace(
    text: str,
    job: Setup,
    layout: Layout | None = None,
    row: int | None = None,
    shown: frozenset[str] = INK,
    tell: Tell = silent,
) -> tuple[list[Manuscript], list[Drawing]]:
    """As `pipeline.writing.draw_pages`."""
    from handout.pipeline import writing

    return writing.draw_pages(text, job, layout, row, shown, tell)


def sheets(text: str, job: Setup) -> tuple[Setup, Iterator[Sheet]]:
    """As `pipeline.writing.set_pages`."""
    from handout.pipeline import writing

    return writing.set_pages(text, job)


def traced(
    sheet: Manuscript, job: Setup, rng: np.random.Generator, about: Mapping[str, Any], shown: frozenset[str] = INK
) -> Drawing:
    """As `pipeline.writing.draw`."""
    from handout.pipeline import writing

    return writing.draw(sheet, job, rng, about, shown)


def title(text: str) -> str:
    """As `pipeline.writing.title`."""
    from handout.pipeline import writing

    return writing.title(text)


def seed(given: Mapping[str, Any]) -> int:
    """As `pipeline.writing.seed_of`."""
    from handout.pipeline import writing

    return writing.seed_of(given["seed"])


def supplied(text: str, hand: ScannedHand, fallback: bool, seed: int) -> tuple[ScannedHand, list[Facts]]:
    """A scanned hand with every letter of a text, as far as it may be supplied; and what was."""
    from handout.completion.completed_hand import complete_hand
    from handout.hand.scanned import ScannedHand
    from handout.pipeline.writing import letter_facts

    lent, letters = complete_hand(hand, text, fallback=fallback, seed=seed)
    assert isinstance(lent, ScannedHand)
    return lent, [letter_facts(letter) for letter in letters]


def unheeded(job: Setup, given: Mapping[str, Any], pictures: bool) -> list[str]:
    """As `pipeline.writing.not_followed`."""
    from handout.cli import options
    from handout.pipeline import writing

    return writing.not_followed(job, options.pictured(given), pictures)
