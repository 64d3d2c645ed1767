"""`handout hand`: list and show hands."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout.cli import options, prompt_, results

if TYPE_CHECKING:
    from handout.sinks import Pen
    from handout.values import Hand

_SPECIMEN = """\
{name}: {title}

The quick brown fox jumps over the lazy dog. Sphinx of black quartz, judge my vow! \
Two driven jocks help fax my big quiz; all questions asked by five watch experts amazed the judge.

à á â ã ä å æ ç è é ê ë ì í î ï ñ ò ó ô õ ö ø œ ß ù ú û ü ý ÿ ¿Qué? ¡Ñandú! Čapek, Škoda, Åsa, Øre, Élan, Übermut.

Minimum, aluminium, hill, letter, little, coffee, good food, off, address, bubble, happy, running, skiing, vacuum, \
success: how doubled letters look. The, and, of, to, in, that, is, was, he, for, it, with, as, his, on, be, at, by, \
I, this, had, not, are, but, from, or, have, an, they. 0123456789, 24 May, 7:30, £9.50, €12, 100 %."""
_TIMES = 3  # larger than one writes
_WIDTH = 420.0  # mm


@click.group("hand")
def command() -> None:
    """List and show hands, and make sheets to write one on."""


command.add_command(prompt_.command)


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
    """Write a specimen sheet of the hand NAME at three times its size: every form of every character, and text.

    \b
    handout hand show house-joined -o sheet.png
    """
    import numpy as np

    from handout.sinks import check_outputs, write_drawings
    from handout.writing.specimen import specimen

    paths = [Path(file) for file in output]
    check_outputs(paths)
    look = options.look(given)
    job = options.setup({**given, "hand": name}, "A4")
    text = _SPECIMEN.format(name=job.hand.name, title=job.hand.title)
    rng = np.random.default_rng(job.seed)
    sheet = specimen(job.hand, text, rng, width=_WIDTH, x_height=_TIMES * job.layout.x_height)
    drawing = options.traced(sheet, job, rng, {"title": f"Specimen of {job.hand.name}"})
    files = write_drawings([drawing], paths, **{**look, "pen": _enlarged(look["pen"])})
    result = {**results.summary([sheet], [drawing], job, files), **_facts(job.hand)}
    said = f"Wrote {', '.join(map(str, files))}: {_drawn(job.hand)} forms; seed {job.seed}."
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])


def _enlarged(pen: Pen) -> Pen:
    from dataclasses import replace

    return replace(pen, width=_TIMES * pen.width)


def _drawn(hand: Hand) -> int:
    return sum(len({glyph.form for glyph in glyphs}) for glyphs in hand.glyphs.values())


def _facts(hand: Hand) -> dict[str, object]:
    return {"name": hand.name, "title": hand.title, "characters": "".join(hand.glyphs), "forms": _drawn(hand)}
