"""`handout studio`: the page in the browser."""

from __future__ import annotations

import json
from pathlib import Path

import click

from handout.cli.options import LISTENING, UNSEEN, verb
from handout.errors import InputError
from handout.pipeline.declarations import option

MISSING = "The studio needs two packages more: pip install 'handout-driver[web]'."


@verb("studio")
def command(
    files: tuple[str, ...],
    port: int | None = LISTENING,
    no_browser: bool = UNSEEN,
    key_file: Path | None = option(None, "Keep a key for programs in this file meanwhile."),
    hosts: tuple[str, ...] = option(
        (), "A host that webhooks may lead to, beside this computer.", flags=("--webhook-host",)
    ),
    phone: bool = option(False, "Let phones on your network send photographs of sheets, for half an hour."),
    as_json: bool = option(False, "Print the link as one JSON object.", flags=("--json",)),
) -> None:
    """Open the studio in the browser: write, make hands, correct their letters, bend styles.

    FILES are .hand files, and .toml and .style files of handstyles, to have there. It listens on this computer alone,
    and its link is good once. Programs use it, too: docs/studio.md.

    \b
    handout studio
    handout studio me.hand --port 8000 --no-browser
    handout studio --phone
    """
    open_studio(files, "own/1" if phone else "", port, not no_browser, as_json, key_file, hosts, phone)


def open_studio(
    names: tuple[str, ...],
    start: str,
    port: int | None,
    browser: bool,
    as_json: bool,
    key_file: Path | None = None,
    hosts: tuple[str, ...] = (),
    phone: bool = False,
) -> None:
    """Serve the studio with some files of hands and styles, at a page of it, until Ctrl-C; a .toml may be new."""
    files = {Path(name): Path(name).resolve() for name in names}
    for given, path in files.items():
        if path.suffix not in (".hand", ".toml", ".style") or not (path.is_file() or path.suffix == ".toml"):
            raise InputError(f"{path}: there is no such .hand file, nor a style.")
        if not given.stem.replace("-", "").replace("_", "").isalnum():
            raise InputError(f"{path}: in the studio it is called as its file is: use letters, digits, - and _.")
    try:
        from handout.web.server import serve
    except ModuleNotFoundError as error:
        raise InputError(MISSING) from error

    def show_link(links: dict[str, str]) -> None:
        click.echo(json.dumps(links) if as_json else "\n".join(links.values()))
        click.echo("The studio is open; Ctrl-C closes it.", err=True)
        if browser:
            click.launch(links["link"])

    hands = {path.stem: path for path in files.values() if path.suffix == ".hand"}
    styles = {path.stem: path for path in files.values() if path.suffix != ".hand"}
    serve(hands, start, port, key_file, show_link, styles, hosts, phone)
