"""How an option is declared: once, as a field of a frozen dataclass that says all that is known of it.

The command's options and its configuration (`cli.options`), the bodies of the API (`web.calls`), what a plot keeps of
its text (`pipeline.job_pages`) and what makes a batch another one (`pipeline.merging`) are made of the declarations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, field, fields, is_dataclass, replace
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
    kind : the type of its value, where the default does not tell it; choices : its possible values; least, most :
        bounds of a number.
    metavar : what the help shows for its value; alone : its value where the option is typed without one.
    repeated, required : whether it may be given several times, and has to be given.
    off : the name that turns a switch off.
    sent : the type (for msgspec) of the field in bodies of the API; None: it is none of the API; sent_as : its name
        there, if it is not the field's.
    of_strokes : whether it decides about the strokes of a text, so that a plot keeps it.
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
    sent: Any = None
    sent_as: str = ""
    of_strokes: bool = False
    of_batch: bool = True


def option(default: Any, heading: str = OWN, help: str | None = None, **settings: Any) -> Any:
    """A field of a frozen dataclass that is an option; `settings` are those of `Declaration`."""
    return field(default=default, metadata={"option": Declaration(heading=heading, help=help, **settings)})


def shared(default: Any, heading: str, help: str, **settings: Any) -> Any:
    """An option that means the same in every verb that has it, so that one bare key of the configuration sets it."""
    return option(default, heading, help, shared=True, **settings)


def list_declared(
    kind: Any, changed: Mapping[str, Mapping[str, object]] = MappingProxyType({})
) -> Iterator[tuple[Field[Any], Declaration]]:
    """The fields of a dataclass that are options, with their declarations; `changed` : name of a field → changes."""
    for each in fields(kind):
        if (found := each.metadata.get("option")) is not None:
            yield each, replace(found, **changed.get(each.name, {}))


def inner(kind: Any) -> dict[str, Any]:
    """The fields of a dataclass that are dataclasses with options of their own: name → default."""
    return {each.name: each.default for each in fields(kind) if is_dataclass(each.default)}


def build_options(kind: Any, values: dict[str, object], usual: Any = None) -> Any:
    """Make a dataclass, and those in it, of the values that are called like its fields, and take these out of `values`.

    usual : where no value is given, its fields are taken.
    """
    nested = {name: build_options(type(each), values, each) for name, each in inner(kind).items()}
    own = {each.name: values.pop(each.name) for each in fields(kind) if each.name in values}
    return kind(**own, **nested) if usual is None else replace(usual, **own, **nested)


# what bodies of the API may hold: names are names and no paths, so that nothing can lead to a file
Name = Annotated[str, Meta(pattern=r"^[\w-]{1,80}(?!\n)$")]
SentLength = Annotated[str, Meta(pattern=r"^[0-9.]{1,9} ?(mm|cm|in|pt)?(?!\n)$")]
Lengths = Annotated[str, Meta(pattern=r"^[0-9., a-z]{1,60}(?!\n)$")]
PageName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9.-]{1,30}(?!\n)$")]
PaperName = Annotated[str, Meta(pattern=r"^(none|plain|laid|ruled|squared)(:[0-9.]+mm(,[0-9.]+mm)?)?(?!\n)$")]
Colour = Annotated[str, Meta(pattern=r"^(#[0-9a-fA-F]{3,6}|[a-zA-Z ]{1,30})(?!\n)$")]
Seed = Annotated[int, Meta(ge=0, le=2**53)]
Number = Annotated[int, Meta(ge=1, le=100)]
