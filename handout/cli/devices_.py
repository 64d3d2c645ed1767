"""`handout devices`: list, show and check machines, and see who is plugged in."""

from __future__ import annotations

import json
from pathlib import Path

import click

from handout.cli import options
from handout.cli.commands import Group

_json = click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")


@click.group("devices", cls=Group)
def command() -> None:
    """List, show and check machines, and see who is plugged in."""


@command.command("list")
@click.option("--ports", is_flag=True, help="The serial ports of this computer instead.")
@click.option(
    "--network", is_flag=True, help="Plotters that announce themselves on the network instead (three seconds)."
)
@_json
def list_(ports: bool, network: bool, as_json: bool) -> None:
    """All known machines; your own files win over shipped ones of the same name.

    \b
    handout devices list
    handout devices list --ports
    handout devices list --network
    """
    if network:
        _list_network(as_json)
        return
    if ports:
        _list_ports(as_json)
        return
    from handout import shipped
    from handout.pipeline.devices import list_devices

    devices = list_devices()
    if as_json:
        click.echo(json.dumps({"devices": [device.facts() for device in devices]}, ensure_ascii=False))
        return
    width = max(len(device.name) for device in devices)
    for device in devices:
        click.echo(f"{device.name:<{width}}  {device.title}")
    click.echo(f"Your own go into {shipped.user_folder('devices')}.", err=True)


def _list_ports(as_json: bool) -> None:
    from handout.pipeline.devices import serial_devices

    ports = serial_devices()
    if as_json:
        rows = [{"port": port.name, "title": port.title, "usb": port.usb_text or None} for port in ports]
        click.echo(json.dumps({"ports": rows}, ensure_ascii=False))
    elif not ports:
        click.echo("No serial port was found: is the plotter plugged in and switched on?", err=True)
    else:
        width = max(len(port.name) for port in ports)
        for port in ports:
            click.echo(f"{port.name:<{width}}  {port.usb_text or '-':<9}  {port.title}".rstrip())


def _list_network(as_json: bool) -> None:
    from handout.pipeline.devices import on_network

    machines = on_network()
    if as_json:
        rows = [{"port": one.address, "reached": one.reached, "dialect": one.dialect or None} for one in machines]
        click.echo(json.dumps({"network": rows}, ensure_ascii=False))
    elif not machines:
        click.echo(
            "No plotter has announced itself: is it on this network, and does it do so (mDNS)? Its address can be "
            "named all the same: --port tcp://192.168.1.7",
            err=True,
        )
    else:
        width = max(len(one.address) for one in machines)
        for one in machines:
            click.echo(f"{one.address:<{width}}  {one.dialect or 'who this is must be asked':<7}  {one.reached}")


@command.command("probe")
@options.shared(
    "--port", default="auto", show_default=True, help="/dev/ttyUSB0, tcp://host, ws://host, moonraker://host, or sim:."
)
@click.option("--device", help="The plotter's profile; without it every dialect is tried.")
@_json
def probe(port: str, device: str | None, as_json: bool) -> None:
    """Ask the plotter at PORT who it is and what it can do; nothing moves.

    \b
    handout devices probe
    handout devices probe --port /dev/ttyUSB0
    handout devices probe --port auto --device plotter-axidraw-v3
    """
    from handout.cli.console import Console
    from handout.pipeline import devices

    answer = devices.probe(port, device, Console())
    if as_json:
        click.echo(json.dumps(answer.facts(), ensure_ascii=False))
        return
    click.echo(f"{answer.port} speaks {answer.dialect}: {answer.firmware or 'it does not say what it is'}")
    for key, value in answer.limits.items():
        click.echo(f"  {key:<26} {value:g}")
    if answer.profiles:
        fits = " or ".join(f"--device {name}" for name in answer.profiles)
        likely = "" if len(answer.profiles) == 1 else ", the likeliest first: a board does not say which frame it moves"
        click.echo(f"  {answer.title}: {fits}{f' ({answer.why})' if answer.why else likely}")
        if answer.others:
            click.echo(f"  less likely: {', '.join(answer.others)}")
    if not answer.limits:
        click.echo("Name its profile with --device to hear its limits.", err=True)


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
