"""`handout hand`: list and show hands."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout import units
from handout.cli import options

if TYPE_CHECKING:
    from handout.values import Hand

_SPECIMEN = """\
{name}: {title}

a b c d e f g h i j k l m n o p q r s t u v w x y z
A B C D E F G H I J K L M N O P Q R S T U V W X Y Z
0 1 2 3 4 5 6 7 8 9 & @ # % € £ $ § °
. , ; : ! ? ' " ‘ ’ “ ” ( ) [ ] - – — … / * + = < >
à á â ã ä å æ ç è é ê ë ì í î ï ñ ò ó ô õ ö ø œ ß ù ú û ü ý ÿ

The quick brown fox jumps over the lazy dog. Sphinx of black quartz, judge my vow! \
Two driven jocks help fax my big quiz; all questions asked by five watch experts amazed the judge.

Minimum, aluminium, hill, letter, little, coffee, good food, off, address, bubble, happy, \
running, skiing, vacuum, success: how doubled letters look. The, and, of, to, in, that, is, was, he, for, it, with, \
as, his, on, be, at, by, I, this, had, not, are, but, from, or, have, an, they."""


@click.group("hand")
def command() -> None:
    """List and show hands."""


@command.command("list")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def list_(as_json: bool) -> None:
    """The hands that can be named with --hand."""
    from handout.hand.library import load, names

    hands = [load(name) for name in names()]
    if as_json:
        click.echo(json.dumps({"hands": [_facts(hand) for hand in hands]}, ensure_ascii=False))
        return
    width = max(len(hand.name) for hand in hands)
    for hand in hands:
        click.echo(f"{hand.name:<{width}}  {hand.title}; {len(hand.glyphs)} characters, {_drawn(hand)} forms")


@command.command("show")
@click.argument("name")
@click.option("--output", "-o", multiple=True, required=True, help="A file for the sheet: .png .svg .pdf …")
@options.writing_options
@options.picture_options
def show(name: str, output: tuple[str, ...], **given: Any) -> None:
    """Write a specimen sheet of the hand NAME: alphabets, signs, accents, a paragraph.

    \b
    handout hand show house-joined -o sheet.png
    """
    from handout.sinks import check_outputs, write_drawings

    paths = [Path(file) for file in output]
    check_outputs(paths)
    look = options.look(given)
    job = options.setup({**given, "hand": name, "fit": True}, "A4", None, 1)
    text = _SPECIMEN.format(name=job.hand.name, title=job.hand.title)
    pages, drawings = options.compose_and_trace(text, job)
    files = write_drawings(drawings, paths, **look)
    result = {**options.summary(pages, drawings, job, files), **_facts(job.hand)}
    said = f"Wrote {', '.join(map(str, files))}; seed {job.seed}, {units.duration(result['duration_s'])} of writing."
    options.report(result, said, as_json=given["as_json"], quiet=given["quiet"])


def _drawn(hand: Hand) -> int:
    return sum(len({glyph.form for glyph in glyphs}) for glyphs in hand.glyphs.values())


def _facts(hand: Hand) -> dict[str, object]:
    return {"name": hand.name, "title": hand.title, "characters": "".join(hand.glyphs), "forms": _drawn(hand)}
