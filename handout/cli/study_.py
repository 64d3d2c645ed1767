"""`handout study`: questionnaires on which people tell made writing from real, read back and scored."""

from __future__ import annotations

from pathlib import Path

import click

from handout import units
from handout.cli import options
from handout.cli.console import Console
from handout.pipeline.options import StudyOptions


@click.group("study")
def command() -> None:
    """A study: can people tell what is made in a hand from what its writer wrote?"""


@command.command("make")
@click.option("--output", "-o", required=True, help="A folder, new or empty.")
@options.bind(
    "study",
    StudyOptions,
    click.option("--hand", multiple=True, required=True, help="A scanned hand, or a .hand file; may be repeated."),
    click.option(
        "--real",
        multiple=True,
        type=click.Path(path_type=Path),
        help="A folder of scans that real words are cut from, each with its text in a .txt file beside it (prompt "
        "sheets need none), for each --hand; default: the pages that the hand was read from.",
    ),
    click.option("--people", type=click.IntRange(1), default=20, show_default=True, help="How many are asked."),
    click.option("--singles", type=click.IntRange(0), default=10, show_default=True, help="Questions A for each."),
    click.option("--pairs", type=click.IntRange(0), default=10, show_default=True, help="Questions B for each."),
    click.option("--control", default="", help="Another person's scanned hand, for pairs that everybody should tell."),
    click.option(
        "--controls", type=click.IntRange(0), default=2, show_default=True, help="Such pairs for each person."
    ),
    click.option(
        "--envelopes",
        type=click.Path(path_type=Path),
        help="A file of addresses, parted by empty lines: a test of envelopes, half of them made.",
    ),
    click.option("--page", default="A4", show_default=True, help="A4 or letter."),
    click.option("--about", is_flag=True, help="Ask on the cover for age, habit of writing, and hand."),
    click.option("--title", default="A study of handwriting", show_default=True, help="On the cover."),
    click.option("--dpi", type=float, help="Pixels an inch of the scans, where the files do not say."),
    click.option("--seed", type=click.IntRange(0), help="Same seed, same sheets; without it every run differs."),
)
@options.console
def make(output: str, study: StudyOptions, console: Console) -> None:
    """Make the sheets of a study: sheets.pdf to print, and its key, study.key, which nobody who takes part may see.

    Questionnaire A shows words and asks of each whether it is real or fake; B shows the same words twice, below a
    line of the same person's writing, and asks which is fake. Each person's sheets differ, and all is balanced. Made
    words never hold a letter cut from the real ones that the same person sees.

    \b
    handout study make --hand me.hand --real scans/ --people 170 -o study/
    """
    from handout.pipeline.study import make

    with console.working():
        result = make(output, study, listener=console)
    pages, people = units.count(result.pages, "page"), units.count(result.people, "person", "people")
    console.report(
        result,
        f"Wrote {result.files[0]}: {pages} for {people}, {units.count(result.snippets, 'snippet')} real and made; its "
        f"key is {result.files[1]}; study {result.name}, seed {result.seed}.",
    )
