"""`handout man`: manual pages made of what every verb says of itself."""

from __future__ import annotations

import inspect
import os
import re
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import click

from handout import __version__, atomic
from handout.cli.options import group_options, records, verb
from handout.errors import InputError, reported
from handout.pipeline.declarations import OWN, argument, output

_FILES = """
.SH FILES
.TP
.I ~/.config/handout/config.toml
Defaults of options; of the hands, machines and styles of the user the folders beside it.
.TP
.I handout.toml
The same, in the folder of a project or one above.
.SH ENVIRONMENT
.TP
.B HANDOUT_OPTION
The default of an option, such as HANDOUT_HAND, or of one verb HANDOUT_PLOT_PORT.
.TP
.B HANDOUT_CONFIG
As \\-\\-config.
.SH EXIT STATUS
0 done; 1 handout doctor found that something is missing; 2 bad input; 3 device fault; 4 some rows of a batch failed;
130 interrupted, 143 by SIGTERM, 129 by SIGHUP.
"""


@verb("man")
def command(
    words: tuple[str, ...] = argument(metavar="[VERB]..."),
    output: Path | None = output("Write all pages, into man1 in this folder.", required=False),
) -> None:
    """Print the manual page of VERB for man or mandoc; or write those of all verbs.

    \b
    handout man hand read | man -l -
    handout man -o ~/.local/share/man          then: man handout-write
    """
    root = click.get_current_context().find_root().command
    pages = dict(_pages(root, ("handout",)))
    if output is None:
        name = " ".join(("handout", *words))
        if name not in pages:
            raise InputError(f"There is no command {name!r}: see handout --help.")
        click.echo(_page(name, pages), nl=False)
        return
    if words:
        raise InputError("-o writes the pages of all verbs: leave their names out.")
    folder = output / "man1"
    with reported(f"write {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
    for name in pages:
        atomic.write(folder / f"{name.replace(' ', '-')}.1", _page(name, pages).encode())
    click.echo(f"Wrote {len(pages)} pages into {folder}.", err=True)


def _pages(verb: click.Command, words: tuple[str, ...]) -> Iterator[tuple[str, click.Command]]:
    """A verb and those in it, by the words that call them."""
    yield " ".join(words), verb
    if isinstance(verb, click.Group):
        context = click.Context(verb, info_name=words[-1])
        for name in verb.list_commands(context):
            inner = verb.get_command(context, name)
            assert inner is not None
            yield from _pages(inner, (*words, name))


def _page(name: str, pages: dict[str, click.Command]) -> str:
    """The manual page of a command, in the macros of man(7)."""
    verb = pages[name]
    context = click.Context(verb, info_name=name)
    title = name.replace(" ", "-")
    inner = [each for each in pages if each.startswith(f"{name} ") and each.count(" ") == name.count(" ") + 1]
    # the day on which the page is made, or that on which its package was
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH") or time.time())
    lines = [
        f'.TH {title.upper()} 1 "{datetime.fromtimestamp(seconds, UTC).date()}" "handout {__version__}" "handout"',
        f".SH NAME\n{_plain(title)} \\- {_plain(_title(verb))}",
        f".SH SYNOPSIS\n.B {_plain(name)}\n{_plain(' '.join(verb.collect_usage_pieces(context)))}",
        ".SH DESCRIPTION",
        "\n".join(_set_paragraphs(inspect.cleandoc(verb.help or ""))).removeprefix(".PP\n"),
    ]
    lines.append(".SH OPTIONS")
    for heading, options in group_options(verb, context).items():
        lines += [] if heading == OWN else [f".SS {_plain(heading)}"]
        lines += [f".TP\n.B {_plain(option)}\n{_text(meaning)}" for option, meaning in records(options, context)]
    if inner:
        lines += [".SH COMMANDS", *(f".TP\n.B {_plain(each)}\n{_text(_title(pages[each]))}" for each in inner)]
    related = [name.rpartition(" ")[0]] if " " in name else []
    see = ", ".join(f"{each.replace(' ', '-')}(1)" for each in related + inner)
    return "\n".join(lines) + _FILES + (f".SH SEE ALSO\n{_plain(see)}\n" if see else "")


def _title(verb: click.Command) -> str:
    """What a verb does, in one sentence."""
    text = inspect.cleandoc(verb.help or "").partition("\n\n")[0]
    return re.split(r"(?<=\w)[.:;] ", " ".join(text.split()))[0].rstrip(".")


def _set_paragraphs(text: str) -> Iterator[str]:
    """The paragraphs of a help text; those behind \\b stay as they are."""
    for paragraph in re.split(r"\n\s*\n", text):
        if paragraph.startswith("\b"):
            yield f".PP\n.RS 4\n.nf\n{_text(paragraph[1:].strip(chr(10)), keep=True)}\n.fi\n.RE"
        elif paragraph.strip():
            yield f".PP\n{_text(paragraph)}"


def _text(text: str, keep: bool = False) -> str:
    """Words as lines of a page; no line of them is taken for a macro."""
    lines = text.splitlines() if keep else [" ".join(text.split())]
    return "\n".join(re.sub(r"^(?=[.'])", r"\\&", _plain(line)) for line in lines)


def _plain(text: str) -> str:
    return text.replace("\\", "\\e").replace("-", "\\-")
