"""XML from strangers, read with care: no entities that grow, nothing fetched, no bottomless nesting, not too much."""

from __future__ import annotations

from xml.etree import ElementTree
from xml.parsers import expat

from handout.errors import InputError

_DEEPEST = 64  # levels: a bound for what recurses over elements, far beyond any drawing's groups
_MOST = 500_000  # elements; each takes some 400 bytes


def parse(data: bytes, what: str, *, doctype: bool = False) -> ElementTree.Element:
    """The root element; names of elements and attributes come without their namespaces.

    what : what the document should be, for messages: ``"InkML"``.
    doctype : whether a DOCTYPE is accepted, as long as it declares nothing; what it refers to is never fetched.

    Raises InputError: not well-formed, with a DOCTYPE that is not accepted, nested more than 64 deep, or of 500 000
    elements.
    """
    builder = ElementTree.TreeBuilder()
    depth = count = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > _DEEPEST:
            raise InputError(f"This is not {what}: elements are nested more than {_DEEPEST} deep.")
        if count > _MOST:
            raise InputError(f"This {what} has more than {_MOST} elements: simplify it or split it.")
        plain = {key: value for key, value in attributes.items() if "}" not in key}
        builder.start(_local(name), {_local(key): value for key, value in attributes.items()} | plain)

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(_local(name))

    def refuse_doctype(_name: str, _system: str | None, _public: str | None, inside: bool) -> None:
        if not doctype:
            raise InputError(
                f"This {what} has a DOCTYPE, which could hide entities that grow without bound; remove it."
            )
        if inside:
            raise InputError(
                f"This {what} declares entities in its DOCTYPE, which could grow without bound: remove what stands "
                "there in [ ], or save it anew as plain SVG."
            )

    parser = expat.ParserCreate(namespace_separator="}")
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError) as error:  # not well-formed, or in an encoding that nobody knows
        raise InputError(f"This is not {what}: {str(error)[:80]}.") from error
    return builder.close()


def _local(name: str) -> str:
    return name.rpartition("}")[2]
