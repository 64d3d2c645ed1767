"""`handout hand`: list and show hands; what is done with scans is in `scan_` and `scanned_`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from handout import units
from handout.cli import jobs, options, prompt_, results, scan_, scanned_
from handout.errors import InputError

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
    """List and show hands, make sheets to write one on, and read them from scanned pages."""


for _command in (prompt_.command, scan_.read, *scanned_.COMMANDS):
    command.add_command(_command)


@command.command("list")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def list_(as_json: bool) -> None:
    """The hands that are known by name: drawn ones and scanned ones, the program's and your own."""
    from handout.hand.library import load, names

    hands, scanned = [load(name) for name in names()], _scanned()
    if as_json:
        both = {"hands": [_facts(hand) for hand in hands], "scanned": scanned}
        click.echo(json.dumps(both, ensure_ascii=False))
        return
    width = max(len(name) for name in [*(hand.name for hand in hands), *(facts["name"] for facts in scanned)])
    for hand in hands:
        click.echo(
            f"{hand.name:<{width}}  {hand.title}; {units.count(len(hand.glyphs), 'character')}, "
            f"{units.count(_drawn(hand), 'form')}"
        )
    for facts in scanned:
        click.echo(f"{facts['name']:<{width}}  {facts['title']}; {facts['said']}")


def _scanned() -> list[dict[str, Any]]:
    """What is said of the scanned hands; one that cannot be read is named with the reason."""
    from handout.errors import InputError
    from handout.hand import file, library

    rows: list[dict[str, Any]] = []
    for name, path in library.scanned().items():
        try:
            hand = file.load(path)
        except InputError as error:
            rows.append({"name": name, "title": "cannot be read", "characters": "", "glyphs": 0, "said": str(error)})
            continue
        said = (
            f"{units.count(len(hand.letters), 'character')}, {units.count(len(hand.glyphs), 'letter')} "
            f"from {_scanned_pages(len(hand.pages))}"
        )
        facts = {"name": name, "title": hand.title, "characters": "".join(hand.letters), "glyphs": len(hand.glyphs)}
        rows.append({**facts, "said": said})
    return rows


@command.command("show")
@click.argument("name")
@click.option("--output", "-o", multiple=True, required=True, help="A file for the sheet: .png .svg .pdf …")
@click.option("--text", help="Of a scanned hand: show which of its letters would write this, and why.")
@options.writing_options
@options.picture_options
def show(name: str, output: tuple[str, ...], text: str | None, **given: Any) -> None:
    """Write a specimen sheet of the hand NAME at three times its size: every form of every character, and text.

    Of a scanned hand, or a .hand file, its letters side by side, as PNG; with --text, for every letter of it those
    that might have been taken, what each would have cost, and the one that was.

    \b
    handout hand show house-joined -o sheet.png
    handout hand show me.hand --text "quick" -o choices.png
    """
    from handout.hand import file, library

    if name.endswith(file.SUFFIX) or name in library.scanned():
        scanned = file.load(library.scanned_file(name))
        scanned_.show(scanned, output, text, given)
        return
    if text is not None:
        raise InputError(f"--text shows how letters of a scanned hand are chosen, and {name} is a drawn one.")
    _show_drawn(name, output, given)


def _show_drawn(name: str, output: tuple[str, ...], given: dict[str, Any]) -> None:
    import numpy as np

    from handout.sinks import Look, check_outputs, write_drawings
    from handout.values import Hand
    from handout.writing.specimen import specimen

    paths = [Path(file) for file in output]
    check_outputs(paths)
    look = options.look(given)
    job = jobs.setup({**given, "hand": name}, "A4")
    hand = job.hand
    assert isinstance(hand, Hand)
    text = _SPECIMEN.format(name=hand.name, title=hand.title)
    rng = np.random.default_rng(job.seed)
    sheet = specimen(hand, text, rng, width=_WIDTH, x_height=_TIMES * job.layout.x_height)
    drawing = jobs.traced(sheet, job, rng, {"title": f"Specimen of {hand.name}"})
    files = write_drawings([drawing], paths, Look(**{**look, "pen": _enlarged(look["pen"])}))
    result = {**results.summary([sheet], [drawing], job, files), **_facts(hand)}
    said = f"Wrote {', '.join(map(str, files))}: {units.count(_drawn(hand), 'form')}; seed {job.seed}."
    results.report(result, said, as_json=given["as_json"], quiet=given["quiet"])


def _enlarged(pen: Pen) -> Pen:
    from dataclasses import replace

    return replace(pen, width=_TIMES * pen.width)


def _drawn(hand: Hand) -> int:
    return sum(len({glyph.form for glyph in glyphs}) for glyphs in hand.glyphs.values())


def _facts(hand: Hand) -> dict[str, object]:
    return {"name": hand.name, "title": hand.title, "characters": "".join(hand.glyphs), "forms": _drawn(hand)}


def _scanned_pages(count: int) -> str:
    return units.count(count, "scanned page")
