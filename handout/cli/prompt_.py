"""`handout hand prompt`: sheets for an author to write on."""

from __future__ import annotations

import click

from handout import units
from handout.cli import sentences
from handout.cli.console import Console
from handout.cli.options import verb
from handout.pipeline.declarations import option, output
from handout.pipeline.options import PromptOptions


@verb("prompt")
def command(
    console: Console,
    output: str = output("The PDF file for the sheets."),
    prompting: PromptOptions = PromptOptions(),
    verbose: bool = option(
        False, "A table of how often each letter and pair will be there.", flags=("--verbose", "-v")
    ),
) -> None:
    """Make sheets to write on, so that a scan of them becomes a hand.

    The sentences are chosen so that few pages hold as many instances of every letter and pair as possible. Print the
    sheets at their true size, copy each line, and scan them in colour at 300 dpi or more; marks and codes on the sheets
    say what was to be written where. With --verbose a table says how often each letter and pair will
    be there.

    \b
    handout hand prompt -o prompt.pdf
    handout hand prompt -o prompt.pdf --pages 6 --also äöüß€ --target my-letters.txt
    handout hand prompt -o again.pdf --for me.hand
    """
    from handout.pipeline.prompts import prompt

    result = prompt(output, prompting)
    coverage = result.coverage
    if verbose and not console.as_json:
        click.echo(f"{coverage.table()}\n{coverage.summary()}")
    hint = "" if verbose or console.as_json else " (--verbose lists them)"
    told, minutes = result.told, result.told["minutes"]
    # as they are known: to 5, or to one where there are few
    about = units.count(5 * round(minutes / 5) if minutes >= 10 else max(1, round(minutes)), "minute")
    pages = units.count(told["pages"], "page")
    sheets = f"Wrote {sentences.names(result.files)}: {pages}, {told['words']} words, about {about} of writing"
    if again := told.get("write_again"):
        console.report(result, f"{sheets}, for what {prompting.hand} has few sure ones of: {' '.join(again)}.")
    else:
        console.report(result, f"{sheets}; {coverage.short()} fewer than {coverage.least} times{hint}.")
