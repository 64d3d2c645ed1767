"""How an option is declared: once, as the default of a dataclass's field or a verb's parameter that says all of it.

The command's options and its configuration (`cli.options`), the bodies of the API (`web.calls`), what a plot keeps of
its text (`pipeline.job_pages`) and what makes a batch another one (`pipeline.merging`) are made of the declarations.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import Field, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from msgspec import Meta

# headings of the help, in its order; what has none is the verb's own, and stands first
OWN = "Options"
FILES = "Text and files"
MACHINE = "Printer or plotter"
PAGE = "Page and lines"
HAND = "Hand"
STYLE = "Handstyle and pose"
INK = "Pen, ink and paper in pictures"
PARTS = "Parts and repeats"
HOOKS = "Dips and other steps on the way"
TABLE = "Rows of a table and their letters"
ENVELOPES = "Envelopes"
GENERAL = "General"
HEADINGS = (OWN, FILES, MACHINE, PAGE, HAND, STYLE, INK, PARTS, HOOKS, TABLE, ENVELOPES, GENERAL)


@dataclass(frozen=True, kw_only=True)
class Declaration:
    """What is known of an option besides its default.

    help : what the command says of it; None: it is none of the command.
    flags : how it is called on the command line; none: as the field, with dashes.
    heading : the one of `HEADINGS` under which it stands.
    shared : it means the same in every verb, so that one bare key of the configuration sets it for all; unless :
        parameters; where one of them is typed, what is configured is ignored.
    kind : the type of its value, where neither annotation nor default tells it; choices : its possible values;
        least, most : bounds of a number.
    metavar : what the help shows for its value; alone : its value where the option is typed without one.
    repeated, required : whether it may be given several times (a tuple may), and has to be given.
    off : the name that turns a switch off; usual : the field that says what is taken where nothing is given.
    sent : the type (for msgspec) of the field in bodies of the API; None: it is none of the API; sent_as : its name
        there, if it is not the field's.
    of_strokes : whether it decides about the strokes of a text, so that a plot keeps it under its name.
    of_batch : whether it changes something on paper, so that a batch with another value is another batch.
    """

    help: str | None = None
    flags: tuple[str, ...] = ()
    heading: str = ""
    shared: bool = False
    unless: tuple[str, ...] = ()
    kind: object = None
    choices: tuple[str, ...] = ()
    least: float | None = None
    most: float | None = None
    metavar: str | None = None
    alone: str | None = None
    repeated: bool = False
    required: bool = False
    off: str = ""
    usual: str = ""
    sent: Any = None
    sent_as: str = ""
    of_strokes: bool = True
    of_batch: bool = True


def option(default: Any, help: str | None = None, heading: str = OWN, **settings: Any) -> Any:
    """An option: the default of a dataclass's field or a verb's parameter; `settings` : those of `Declaration`."""
    return field(default=default, metadata={"option": Declaration(help=help, heading=heading, **settings)})


def shared(default: Any, help: str, heading: str = OWN, **settings: Any) -> Any:
    """An option that means the same in every verb that has it, so that one bare key of the configuration sets it."""
    return option(default, help, heading, shared=True, **settings)


def output(help: str | None, heading: str = OWN, **settings: Any) -> Any:
    """The option -o, which has to be given unless `required` is False."""
    return option(None, help, heading, **{"flags": ("--output", "-o"), "required": True, **settings})


def port(default: Any) -> Any:
    """--port of a plotter; one of the configuration is left aside where the result is to be a file."""
    names = "/dev/ttyUSB0, COM3, tcp://host, ws://host, auto, or sim: (simulated)."
    return shared(default, names, MACHINE, flags=("--port",), unless=("dry_run", "output"))


def argument(**settings: Any) -> Any:
    """A parameter of a verb that has a place on the command line in place of a name."""
    return option(None, **settings)


@dataclass(frozen=True)
class Bundle:
    """The options that a dataclass declares, as the default of a verb's parameter.

    usual : an instance, whose fields are taken where no option says otherwise.
    only, leave_out : names of fields; without `only` all but those left out.
    changed : name of a field → what is declared otherwise for this verb.
    """

    usual: Any
    only: Collection[str]
    leave_out: Collection[str]
    changed: Mapping[str, Mapping[str, Any]]


def bundle(usual: Any, *, only: Collection[str] = (), leave_out: Collection[str] = (), **changed: Any) -> Any:
    """A parameter of a verb that has options which a dataclass declares; see `Bundle`."""
    return Bundle(usual, only, leave_out, changed)


def read_declared(each: Field[Any], annotation: str) -> Declaration:
    """What is declared of an option; what its type tells need not be."""
    declared: Declaration = each.metadata["option"]
    words = set(re.findall(r"\w+", annotation))
    texts = words - {"str"} if "Path" in words or "str" not in words else set[str]()
    told = next((kind for name, kind in _KINDS.items() if name in texts), None)
    return replace(declared, kind=declared.kind or told, repeated=declared.repeated or "tuple" in words)


_KINDS: Mapping[str, object] = {"Path": Path, "float": float, "int": int}  # that a type of an option may name


def list_declared(
    kind: Any, changed: Mapping[str, Mapping[str, Any]] = MappingProxyType({})
) -> Iterator[tuple[Field[Any], Declaration]]:
    """The fields of a dataclass that are options, with their declarations; `changed` : name of a field → changes."""
    for each in fields(kind):
        if "option" in each.metadata:
            yield each, replace(read_declared(each, str(each.type)), **changed.get(each.name, {}))


def inner(kind: Any) -> dict[str, Any]:
    """The fields of a dataclass that are dataclasses with options of their own: name → default."""
    return {each.name: each.default for each in fields(kind) if is_dataclass(each.default)}


def build_options(usual: Any, values: dict[str, object]) -> Any:
    """A dataclass, and those in it, with the values that are called like its fields; else as usual.

    The values are taken out of `values`.
    """
    nested = {name: build_options(each, values) for name, each in inner(usual).items()}
    return replace(
        usual, **nested, **{each.name: values.pop(each.name) for each in fields(usual) if each.name in values}
    )


# what bodies of the API may hold: names are names and no paths, so that nothing can lead to a file
Name = Annotated[str, Meta(pattern=r"^[\w-]{1,80}(?!\n)$")]
SentLength = Annotated[str, Meta(pattern=r"^[0-9.]{1,9} ?(mm|cm|in|pt)?(?!\n)$")]
Lengths = Annotated[str, Meta(pattern=r"^[0-9., a-z]{1,60}(?!\n)$")]
PageName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9.-]{1,30}(?!\n)$")]
PaperName = Annotated[str, Meta(pattern=r"^(none|plain|laid|ruled|squared)(:[0-9.]+mm(,[0-9.]+mm)?)?(?!\n)$")]
Colour = Annotated[str, Meta(pattern=r"^(#[0-9a-fA-F]{3,6}|[a-zA-Z ]{1,30})(?!\n)$")]
Seed = Annotated[int, Meta(ge=0, le=2**53)]
Number = Annotated[int, Meta(ge=1, le=100)]
