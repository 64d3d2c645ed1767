"""`handout devices`: list, show and check machines, and see who is plugged in."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from handout.cli.options import JSON, verb
from handout.pipeline.declarations import option, shared


@click.group("devices")
def command() -> None:
    """List, show and check machines, and see who is plugged in."""


@verb("list", command)
def list_(
    ports: bool = option(False, "The serial ports of this computer instead."),
    network: bool = option(False, "Plotters that announce themselves on the network instead (three seconds)."),
    as_json: bool = JSON,
) -> None:
    """All known machines; your own files win over shipped ones of the same name.

    \b
    handout devices list
    handout devices list --ports
    handout devices list --network
    """
    from handout.pipeline import devices

    if network:
        found = devices.on_network()
        facts = [{"port": one.address, "reached": one.reached, "dialect": one.dialect or None} for one in found]
        rows = [(one.address, f"{one.dialect or 'who this is must be asked':<7}  {one.reached}") for one in found]
        none = (
            "No plotter has announced itself: is it on this network, and does it do so (mDNS)? Its address can be "
            "named all the same: --port tcp://192.168.1.7"
        )
        _print("network", facts, rows, as_json, none)
    elif ports:
        known = devices.serial_devices()
        facts = [{"port": port.name, "title": port.title, "usb": port.usb_text or None} for port in known]
        rows = [(port.name, f"{port.usb_text or '-':<9}  {port.title}") for port in known]
        _print("ports", facts, rows, as_json, "No serial port was found: is the plotter plugged in and switched on?")
    else:
        from handout import shipped

        machines = devices.list_devices()
        _print("devices", [one.facts() for one in machines], [(one.name, one.title) for one in machines], as_json)
        if not as_json:
            click.echo(f"Your own go into {shipped.user_folder('devices')}.", err=True)


def _print(
    key: str, facts: Sequence[Mapping[str, object]], rows: Sequence[tuple[str, str]], as_json: bool, none: str = ""
) -> None:
    """Print what was found as JSON or in two columns, or that nothing was."""
    if as_json:
        click.echo(json.dumps({key: facts}, ensure_ascii=False))
    elif not rows:
        click.echo(none, err=True)
    else:
        width = max(len(name) for name, _ in rows)
        for name, rest in rows:
            click.echo(f"{name:<{width}}  {rest}".rstrip())


@verb("probe", command)
def probe(
    port: str = shared("auto", "/dev/ttyUSB0, tcp://host, ws://host, moonraker://host, or sim:."),
    device: str | None = option(None, "The plotter's profile; without it every dialect is tried."),
    as_json: bool = JSON,
) -> None:
    """Ask the plotter at PORT who it is and what it can do; nothing moves.

    \b
    handout devices probe
    handout devices probe --port /dev/ttyUSB0
    handout devices probe --port auto --device plotter-axidraw-v3
    """
    from handout.cli.console import Console
    from handout.pipeline import devices

    told = devices.probe(port, device, Console())
    if as_json:
        click.echo(json.dumps(told, ensure_ascii=False))
        return
    click.echo(f"{told['port']} speaks {told['dialect']}: {told['firmware'] or 'it does not say what it is'}")
    for key, value in told.get("limits", {}).items():
        click.echo(f"  {key:<26} {value:g}")
    if names := told.get("profiles"):
        fits = " or ".join(f"--device {name}" for name in names)
        likely = "" if len(names) == 1 else ", the likeliest first: a board does not say which frame it moves"
        why = f" ({told['why']})" if told["why"] else likely
        click.echo(f"  {told['title']}: {fits}{why}")
        if told["others"]:
            click.echo(f"  less likely: {', '.join(told['others'])}")
    if "limits" not in told:
        click.echo("Name its profile with --device to hear its limits.", err=True)


@verb("show", command)
def show(name: str) -> None:
    """Print the file of the machine NAME: a start for one of your own."""
    from handout import profiles

    click.echo(profiles.locate(name).read_text(encoding="utf-8"), nl=False)


@verb("check", command)
def check(file: Path) -> None:
    """Check a machine's TOML FILE: names, units, bounds."""
    from handout import profiles

    profile = profiles.read_profile(file)
    click.echo(f"{file}: a valid {profile.kind}, {profile.title!r}.")
