"""`handout devices`: list, show and check machines."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.group("devices")
def command() -> None:
    """List, show and check machines."""


@command.command("list")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def list_(as_json: bool) -> None:
    """All known machines; your own files win over shipped ones of the same name."""
    from handout import profiles, shipped

    files = shipped.files("devices", "*.toml")
    found = {name: profiles.read(path) for name, path in files.items()}
    if as_json:
        rows = [{"name": n, "kind": p.kind, "title": p.title, "file": str(files[n])} for n, p in found.items()]
        click.echo(json.dumps({"devices": rows}, ensure_ascii=False))
        return
    width = max(map(len, found))
    for name, profile in found.items():
        click.echo(f"{name:<{width}}  {profile.title}")
    click.echo(f"Your own go into {shipped.user_folder('devices')}.", err=True)


@command.command("show")
@click.argument("name")
def show(name: str) -> None:
    """Print the file of the machine NAME: a start for one of your own."""
    from handout import profiles

    click.echo(profiles.locate(name).read_text(encoding="utf-8"), nl=False)


@command.command("check")
@click.argument("file", type=click.Path(path_type=Path))
def check(file: Path) -> None:
    """Check a machine's TOML FILE: names, units, bounds."""
    from handout import profiles

    profile = profiles.read(file)
    click.echo(f"{file}: a valid {profile.kind}, {profile.title!r}.")
