"""`handout doctor`: what the program needs of this computer, what is there, and what to do about the rest."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout.cli.options import JSON, verb
from handout.pipeline.declarations import option

if TYPE_CHECKING:
    from handout.pipeline.doctor import CheckFinding

_MARKS = {"fine": "  ok", "note": "   -", "poor": "   !", "broken": "FAIL"}
_FAILED = 1  # the exit code where something is broken


@verb("doctor")
def command(
    test_page: Path | None = option(None, "Write a page, .pdf .svg or .png, to look at."),
    as_json: bool = JSON,
) -> int:
    """Look at what handout needs: Python and packages, files, folders, ports, printers, network, settings.

    What is marked - is only told, what is marked ! is lacking for some verbs, FAIL for all; each with the way out. The
    exit code is 1 where something fails. Nothing is changed, and nothing outside this computer is asked.

    \b
    handout doctor
    handout doctor --test-page page.pdf
    handout doctor --json
    """
    from handout.pipeline.doctor import examine

    result = examine(test_page, [settings])
    if as_json:
        click.echo(json.dumps(result.facts(), ensure_ascii=False))
        return _FAILED if result.is_broken else 0
    group = ""
    for finding in result.findings:
        if finding.group != group:
            group = finding.group
            click.echo(group)
        click.echo(f"{_MARKS[finding.state]}  {finding.words}.")
        if finding.remedy:
            click.echo(f"      > {finding.remedy}")
    failed = sum(finding.state == "broken" for finding in result.findings)
    click.echo(f"{failed} of these must be put right." if failed else "All that is needed is here.", err=True)
    return _FAILED if result.is_broken else 0


def settings() -> Iterator[CheckFinding]:
    """What is configured, and whether it can be."""
    from handout.cli import config_, configuration
    from handout.errors import InputError
    from handout.pipeline.doctor import CheckFinding

    try:
        layers = configuration.layers(click.get_current_context().find_root().params.get("config"))
        problems = config_.problems()
    except InputError as error:
        yield CheckFinding("Settings", "files", "broken", str(error).rstrip("."), "put it right, or use --config none")
        return
    files = [str(layer.file) for layer in layers if layer.file is not None]
    yield CheckFinding("Settings", "files", "fine", f"from {', '.join(files)}" if files else "as built in")
    for problem in problems:
        yield CheckFinding("Settings", "keys", "poor", problem.rstrip("."), "handout config show --all lists all keys")
