"""What `restyle` and `asemic` have in common: the options of a handstyle, and how its pictures look."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import click

from handout.errors import InputError

if TYPE_CHECKING:
    from handout.motion.styles.style import Style

F = TypeVar("F", bound=Callable[..., Any])

_NOISE = 0.02  # heights of a letter: motor noise at --jitter 1


def style_options(default: str) -> Callable[[F], F]:
    """--style (of that default), what changes it, and --seed."""
    made = (
        click.option(
            "--style",
            default=default,
            show_default=True,
            help="fast-tag, calm, blackletter, chancery, scrawl, one of your own, or a .toml file.",
        ),
        click.option("--smooth", type=float, help="0.05 to 1: how much the movement rounds; default: the style's."),
        click.option("--shear", help="Lean of the letters, such as 12deg; default: the style's."),
        click.option("--jitter", type=float, help="How much the hand varies, 1 as people do; default: the style's."),
        click.option("--seed", type=int, help="Same seed, same bytes; without it every run may differ."),
    )

    def decorate(function: F) -> F:
        for option in reversed(made):
            function = option(function)
        return function

    return decorate


def style(given: Mapping[str, Any]) -> Style:
    """The style that was asked for, changed as asked.

    Raises
    ------
    InputError
        There is no such style, or a number is outside its bounds.
    """
    import msgspec

    from handout import units
    from handout.motion.styles.style import checked, find
    from handout.tables import Angle

    found = find(given["style"])
    if given["smooth"] is not None:
        movement = msgspec.structs.replace(found.movement, smooth=given["smooth"])
        found = msgspec.structs.replace(found, movement=movement)
    if given["shear"] is not None:
        lean = Angle(units.parse(given["shear"], "angle", "shear", default="deg"))
        found = msgspec.structs.replace(found, form=msgspec.structs.replace(found.form, shear=lean))
    if given["jitter"] is not None:
        noise = msgspec.structs.replace(found.jitter, size=_NOISE * given["jitter"])
        found = msgspec.structs.replace(found, jitter=noise)
    try:
        return checked(found)
    except ValueError as error:
        raise InputError(f"style {found.name}: {error}") from error


def look(given: Mapping[str, Any]) -> dict[str, Any]:
    """How pictures look: a style brings its own widths, so that an even ink is the usual one."""
    from handout.cli import options

    return options.look({**given, "pen": given["pen"] or "plain"})


def said(facts: Mapping[str, Any]) -> str:
    """One sentence about what was made."""
    from handout import units

    strokes = units.count(facts["strokes"], "stroke")
    return (
        f"Wrote {', '.join(facts['files'])}: {strokes} in the style {facts['style']}; "
        f"{units.duration(facts['duration_s'])} of writing; seed {facts['seed']}."
    )
