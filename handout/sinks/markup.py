"""XML from strangers, read with care: no document type, so no entities that grow; no bottomless nesting."""

from __future__ import annotations

from typing import NoReturn
from xml.etree import ElementTree
from xml.parsers import expat

from handout.errors import InputError

_DEEPEST = 64


def parse(data: bytes, what: str) -> ElementTree.Element:
    """The root element; names of elements and attributes come without their namespaces.

    Parameters
    ----------
    data : bytes
    what : str
        What the document should be, for messages: ``"InkML"``.

    Raises
    ------
    InputError
        Not well-formed, with a DOCTYPE, or nested more than 64 deep.
    """
    builder = ElementTree.TreeBuilder()
    depth = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise InputError(f"This is not {what}: elements are nested more than {_DEEPEST} deep.")
        builder.start(_local(name), {_local(key): value for key, value in attributes.items()})

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(_local(name))

    def refuse(*_: object) -> NoReturn:
        raise InputError(f"This {what} has a DOCTYPE, which could hide entities that grow without bound; remove it.")

    parser = expat.ParserCreate(namespace_separator="}")
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InputError(f"This is not {what}: {error}.") from error
    return builder.close()


def _local(name: str) -> str:
    return name.rpartition("}")[2]
