"""Whoever comes from another plotter program finds what they look for: options, profile keys and verbs that exist."""

import re
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from handout import profiles
from handout.cli import _sentence, cli, elsewhere

PAGE = (Path(__file__).parents[2] / "docs" / "other-programs.md").read_text(encoding="utf-8")
OURS = [row.split("|")[2] for row in PAGE.splitlines() if row.startswith("| ") and not row.startswith("| there")]


def options_of(command):
    names = {name for parameter in command.params for name in getattr(parameter, "opts", [])}
    if isinstance(command, click.Group):
        context = click.Context(command)
        return names.union(*(options_of(command.get_command(context, name)) for name in command.list_commands(context)))
    return names


@pytest.fixture(scope="module")
def options():
    return options_of(cli)


def keys():
    tables = {"bed": profiles.Bed, "limits": profiles.Limits, "pen": profiles.PenLift, "port": profiles.PortSettings}
    tables["hpgl"] = profiles.Hpgl
    return {f"{name}.{key}" for name, kind in tables.items() for key in kind.__struct_fields__}


def test_what_stands_in_the_table_is_there(options):
    text = " ".join([*OURS, *elsewhere.ours().values()])
    named = set(re.findall(r"--[a-z][a-z-]+", re.sub(r"`vpype[^`]*`", "", text)))
    assert named - options == set() and len(named) > 20
    files = set(re.findall(r"\b(?:bed|limits|pen|port|hpgl)\.[a-z_]+", text))
    assert files - keys() == set() and len(files) > 12
    machines = set(re.findall(r"--device ([a-z0-9-]+)", text))
    assert [name for name in machines if not profiles.find(name, "plotter").title] == [] and len(machines) > 3


def test_every_hint_is_of_an_option_in_the_table_and_none_is_ours(options):
    theirs = {name.replace("_", "-") for name in re.findall(r"--([a-z_-]+)", PAGE)}
    assert elsewhere.ours().keys() - theirs == set()
    assert {f"--{name}" for name in elsewhere.ours()} & options <= {"--paper-size", "--model"}


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        (
            ["plot", "--pen_pos_up", "60", "x.svg"],
            "--pen_pos_up is not an option here: --pen-up, in the servo's own values",
        ),
        (["plot", "--preview", "x.svg"], "--preview is not an option here: --dry-run preview.svg."),
        (["plot", "--no-such", "x"], None),
        (["score", "--preview", "x"], None),
    ],
)
def test_what_is_typed_out_of_habit_is_answered(typed, said):
    result = CliRunner().invoke(cli, typed, standalone_mode=False)
    assert isinstance(result.exception, click.NoSuchOption)
    sentence = _sentence(result.exception)
    assert sentence is None if said is None else sentence.startswith(said)
