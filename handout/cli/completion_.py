"""`handout completion`: what a shell needs to complete verbs, options, names and files; and what it completes."""

from __future__ import annotations

from collections.abc import Callable

import click
from click.shell_completion import CompletionItem, get_completion_class

from handout.cli import configuration
from handout.cli.options import verb
from handout.pipeline.declarations import argument

VARIABLE = "_HANDOUT_COMPLETE"  # in which a shell asks; click makes it of the program's name
_SHELLS = {
    "bash": "~/.local/share/bash-completion/completions/handout",
    "zsh": "~/.zfunc/_handout",
    "fish": "~/.config/fish/completions/handout.fish",
}
# what an argument names, by its verb; those of other verbs are files
_ARGUMENTS = {
    **dict.fromkeys(("hand.show", "hand.check", "hand.edit", "hand.export", "hand.remove", "hand.tag"), "hand"),
    "brush.show": "pen",
    "pose.show": "pose",
    "style.edit": "style",
    "devices.show": "machine",
}
_CALLED = {"ports": "port", "page_name": "page"}  # parameters that are not called as what they name


@verb("completion")
def command(shell: str = argument(choices=(*sorted(_SHELLS),))) -> None:
    """Print what makes SHELL complete verbs, options, the names of hands, pens, styles and machines, ports and files.

    \b
    handout completion bash > ~/.local/share/bash-completion/completions/handout
    handout completion zsh > ~/.zfunc/_handout      with fpath+=~/.zfunc before compinit in ~/.zshrc
    handout completion fish > ~/.config/fish/completions/handout.fish
    """
    kind = get_completion_class(shell)
    assert kind is not None
    script = kind(click.Command("handout"), {}, "handout", VARIABLE)
    click.echo(script.source_template % script.source_vars())


class _Named(click.types.StringParamType):
    """A text that may be one of some names, or a file."""

    def __init__(self, names: Callable[[click.Context], list[str]]) -> None:
        self._names = names

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        found = [CompletionItem(name) for name in self._names(ctx) if name.startswith(incomplete)]
        return found or [CompletionItem(incomplete, type="file")]


def prepare(command: click.Command, path: str) -> None:
    """Give the parameters of a verb, and of those in it, what they complete: they are plain texts without."""
    if isinstance(command, click.Group):
        for name, each in command.commands.items():
            prepare(each, f"{path}.{name}")
        return
    for parameter in command.params:
        if parameter.type is click.STRING:
            parameter.type = _Named(_names(parameter, path))


def _names(parameter: click.Parameter, path: str) -> Callable[[click.Context], list[str]]:
    """What lists the names that a parameter takes."""
    from handout.pipeline.names import KNOWN

    name = str(parameter.name)
    if path.startswith("config."):
        return _keys if name == "key" else lambda context: []
    called = _ARGUMENTS.get(path, "") if isinstance(parameter, click.Argument) else _CALLED.get(name, name)
    return lambda context: KNOWN[called]() if called in KNOWN else []


def _keys(context: click.Context) -> list[str]:
    """Every key of a configuration."""
    root = context.find_root().command
    assert isinstance(root, click.Group)
    every = configuration.all_verbs(root).items()
    options = [(path, option) for path, verb in every for option in configuration.options_of(verb)]
    return sorted({key for path, option in options for key in configuration.keys_of(path, option)})
