"""`handout pose`: how a pen is held, learned of recordings and shown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from handout import units
from handout.cli.console import Console
from handout.cli.options import verb
from handout.pipeline.declarations import argument, option, output

if TYPE_CHECKING:
    from handout.pipeline.poses import PoseSheet


@click.group("pose")
def command() -> None:
    """Learn from recordings how a writer holds the pen, and show it."""


@verb("learn", command)
def learn(
    console: Console,
    recordings: tuple[Path, ...] = argument(required=True),
    output: Path = output("The .pose file."),
    title: str | None = option(None, "What to call the library, for people; default: the name of the file."),
    level: bool = option(False, "Take out what the place on the page does to the pose."),
) -> None:
    """Learn how one writer holds the pen from RECORDINGS of a tablet with pressure or tilt.

    They are .inkml, .svc, .uim, .cyn, .dat or .unp files, or .json: drawings, or the pointer events of a web page.

    \b
    handout pose learn page1.uim page2.uim -o artist.pose
    """
    from handout.pipeline.poses import learn_pose

    result = learn_pose(recordings, output, title, level=level)
    console.note(*result.notes)
    console.report(result, f"Wrote {output}: {_sentence(result)}.")


@verb("show", command)
def show(console: Console, pose: str, output: Path = output("A PNG file.")) -> None:
    """Draw the strokes of POSE, a name or a .pose file, coloured by how the pen was held.

    \b
    handout pose show artist.pose -o sheet.png
    """
    from handout.pipeline.poses import show_pose

    result = show_pose(pose, output)
    console.report(result, f"Wrote {output}: {result.library.title}, {_sentence(result)}.")


def _sentence(result: PoseSheet) -> str:
    pose = result.library
    return f"{units.count(len(pose.lengths), 'stroke')} with {', '.join(pose.channels)}"
