"""`handout hand prompt`: sheets for an author to write on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout.cli import results

if TYPE_CHECKING:
    from handout.prompting.prompt_pages import Prompt
    from handout.prompting.sheet_layout import SheetLayout

_LETTERS_A_MINUTE = 117  # copied; see `_minutes`


@click.command("prompt")
@click.option("--output", "-o", required=True, help="The PDF file for the sheets.")
@click.option("--pages", type=click.IntRange(1, 100), default=4, show_default=True, help="How many to write.")
@click.option("--characters", help="Each occurs at least once; default: all printable ASCII.")
@click.option("--also", default="", help="More characters than these, e.g. äöüß€.")
@click.option("--target", help="A file with texts such as will be wanted later: its letters count, and occur.")
@click.option("--corpus", "corpus_file", help="A file of text to take the sentences from; default: the program's own.")
@click.option("--page", "page_name", default="A4", show_default=True, help="A4 or letter.")
@click.option("--ruling", default="10mm", show_default=True, help="Distance of the lines, 6mm to 20mm.")
@click.option("--letter-width", help="Width your letters take, with gaps, e.g. 2.8mm; default: a third of the ruling.")
@click.option(
    "--ruled/--plain",
    default=True,
    show_default=True,
    help="Lines and words printed pale where you write; or nothing but the marks, with the words on a page beside "
    "and lines to lay under: for printers without colour, and for red ink.",
)
@click.option("--verbose", "-v", is_flag=True, help="A table of how often each letter and pair will be there.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
@click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
def command(as_json: bool, quiet: bool, verbose: bool, output: str, **given: Any) -> None:
    """Make sheets to write on, so that a scan of them becomes a hand.

    The sentences are chosen so that few pages hold as many instances of every letter and pair as possible. Print the
    sheets at their true size, copy each line, and scan them in colour at 300 dpi or more; marks and codes on the sheets
    say what was to be written where. With --verbose a table says how often each letter and pair will
    be there.

    \b
    handout hand prompt -o prompt.pdf
    handout hand prompt -o prompt.pdf --pages 6 --also äöüß€ --target my-letters.txt
    """
    from handout import atomic
    from handout.errors import InputError
    from handout.prompting import sheet_pdf

    path = Path(output)
    if path.suffix.lower() != ".pdf":
        raise InputError(f"Sheets are written as PDF, not {path.suffix or 'without a suffix'}: use {path.stem}.pdf.")
    atomic.check_writable(path)
    prompt, layout, target, characters = _chosen(given)
    atomic.write(path, sheet_pdf.to_pdf(prompt, layout))
    _say(path, prompt, layout, target, characters, as_json=as_json, quiet=quiet, verbose=verbose)


def _chosen(given: dict[str, Any]) -> tuple[Prompt, SheetLayout, list[str], str]:
    """The prompt, the layout of its sheets, the target's texts and the characters asked for."""
    from handout import units
    from handout.prompting import corpus, prompt_pages, sentence_choice
    from handout.prompting.sheet_layout import SheetLayout, paper_of_name

    layout = SheetLayout(
        paper_of_name(given["page_name"]), units.length(given["ruling"], "ruling"), printed=given["ruled"]
    )
    letter = given["letter_width"]
    width = layout.width(units.length(letter, "letter width") if letter else None)
    own = given["corpus_file"]
    sentences = corpus.sentences(corpus.read(Path(own))) if own else list(corpus.shipped())
    wished = corpus.typed(given["characters"] or corpus.PRINTABLE) + corpus.typed(given["also"])
    if given["target"]:
        target = [corpus.read(Path(given["target"]))]
        wished += "".join(char for char in dict.fromkeys(target[0]) if char.isprintable())
    else:
        target = corpus.usable(sentences, frozenset(corpus.PRINTABLE + wished + " "))
    characters = "".join(dict.fromkeys(char for char in wished if not char.isspace()))
    chosen = prompt_pages.prompt(
        sentences,
        sentence_choice.frequencies(target),
        characters,
        pages=given["pages"],
        lines=layout.lines,
        width=width,
    )
    return chosen, layout, target, characters


def _say(
    path: Path,
    prompt: Prompt,
    layout: SheetLayout,
    target: list[str],
    characters: str,
    *,
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    from handout.prompting import sheet_codes
    from handout.prompting.coverage import coverage

    found = coverage((" ".join(page) for page in prompt.pages), target, characters)
    facts = {
        "files": [str(path)],
        "key": sheet_codes.key(prompt.pages),
        "pages": len(prompt.pages),
        "lines": sum(map(len, prompt.pages)),
        "words": prompt.words,
        "minutes": round(_minutes(prompt), 1),
        "page": layout.page.name,
        "ruling_mm": layout.pitch,
        "ruled": layout.printed,
        "text": ["\n".join(page) for page in prompt.pages],
        "coverage": found.as_json(),
    }
    if verbose and not as_json:
        click.echo(f"{found.table()}\n{found.summary()}")
    pages = f"{facts['pages']} page{'' if facts['pages'] == 1 else 's'}"
    said = f"Wrote {path}: {pages}, {facts['words']} words, about {_rounded(_minutes(prompt))} of writing; "
    said += f"{found.short()} fewer than {found.least} times{'' if verbose or as_json else ' (--verbose lists them)'}."
    results.report(facts, said, as_json=as_json, quiet=quiet)


def _minutes(prompt: Prompt) -> float:
    """What it takes to copy the text.

    Source: Graham, Berninger, Weintraub and Schafer 1998, Development of handwriting speed and legibility in grades
    1–9, for letters copied a minute in the ninth grade: 121 (girls) and 114 (boys).  In seed 000, §4, authors took 10
    to 30 minutes for four pages on every other line.
    """
    letters = sum(not char.isspace() for page in prompt.pages for line in page for char in line)
    return letters / _LETTERS_A_MINUTE


def _rounded(minutes: float) -> str:
    """Minutes as they are known: to 5, or to one where there are few."""
    whole = 5 * round(minutes / 5) if minutes >= 10 else max(1, round(minutes))
    return f"{whole} minute{'' if whole == 1 else 's'}"
