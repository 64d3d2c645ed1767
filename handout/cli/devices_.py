"""`handout devices`: list, show and check machines, and see who is plugged in."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click


@click.group("devices")
def command() -> None:
    """List, show and check machines, and see who is plugged in."""


@command.command("list")
@click.option("--ports", is_flag=True, help="The serial ports of this computer instead.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def list_(ports: bool, as_json: bool) -> None:
    """All known machines; your own files win over shipped ones of the same name."""
    from handout import profiles, shipped

    if ports:
        _list_ports(as_json)
        return
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


def _list_ports(as_json: bool) -> None:
    from handout.plotting.ports import serial_devices

    found = serial_devices()
    if as_json:
        rows = [{"port": port.name, "title": port.title, "usb": port.usb_text or None} for port in found]
        click.echo(json.dumps({"ports": rows}, ensure_ascii=False))
    elif not found:
        click.echo("No serial port was found: is the plotter plugged in and switched on?", err=True)
    else:
        width = max(len(port.name) for port in found)
        for port in found:
            click.echo(f"{port.name:<{width}}  {port.usb_text or '-':<9}  {port.title}".rstrip())


@command.command("probe")
@click.option("--port", default="auto", show_default=True, help="/dev/ttyUSB0, COM3, socket://host:port, or sim:.")
@click.option("--device", help="The plotter's profile; without it every dialect is tried.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def probe(port: str, device: str | None, as_json: bool) -> None:
    """Ask the plotter at PORT who it is and what it can do; nothing moves.

    \b
    handout devices probe
    handout devices probe --port /dev/ttyUSB0
    handout devices probe --port auto --device plotter-axidraw-v3
    """
    if device is None and port.partition(":")[0] != "sim":
        result = _identify(port)
    else:
        result = _meet(port, device or "simulated")
    if as_json:
        click.echo(json.dumps(result, ensure_ascii=False))
        return
    click.echo(f"{result['port']} speaks {result['dialect']}: {result['firmware'] or 'it does not say what it is'}")
    for key, value in result.get("limits", {}).items():
        click.echo(f"  {key:<26} {value:g}")
    if "limits" not in result:
        click.echo("Name its profile with --device to hear its limits.", err=True)


def _identify(port: str) -> dict[str, Any]:
    """Who is there, of all dialects."""
    from handout.errors import DeviceSilent
    from handout.plotting import connections

    port = connections.only_port() if port == "auto" else port
    answer = connections.identify(port)
    if answer is None:
        raise DeviceSilent(
            f"Nobody at {port} answers in a language handout knows (GRBL, EBB, Marlin, HP-GL): is the plotter switched "
            "on, is this its port?"
        )
    return {"port": port, "dialect": answer.dialect, "firmware": answer.firmware}


def _meet(address: str, device: str) -> dict[str, Any]:
    """Who is there and what are its limits, in the dialect of a profile."""
    from handout import profiles
    from handout.plotting import connections, open_port
    from handout.plotting.dialects import dialect

    profile = profiles.find(device, "plotter")
    assert isinstance(profile, profiles.Plotter)
    spoken = dialect(profile.dialect)
    port = open_port(address, profile)
    try:
        controller = spoken.connect(port, profile, lambda said: click.echo(said, err=True))
        answer = connections.ask(port, [profile.dialect], wakes=0.0)
        own = controller.profile
    finally:
        port.close()
    name = getattr(port, "url", address)
    firmware = answer.firmware if answer else ""
    return {"port": name, "dialect": profile.dialect, "firmware": firmware, "limits": connections.limits(own)}


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
