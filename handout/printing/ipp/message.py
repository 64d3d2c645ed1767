"""IPP messages as values and as bytes, and back: pure functions.

Source: RFC 8010 §3 (encoding), RFC 3382 (collections).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

from handout.errors import PrinterError

_LONGEST = 0x7FFF  # bytes of one name or value, RFC 8010 §3.1: lengths are signed and two bytes long
_DEEPEST = 16  # collections in collections; real printers nest two


class MessageTag(IntEnum):
    """What follows in a message: a group of attributes (below 0x10), or a value of that type."""

    OPERATION = 0x01
    JOB = 0x02
    END = 0x03
    PRINTER = 0x04
    UNSUPPORTED_GROUP = 0x05
    UNSUPPORTED = 0x10
    UNKNOWN = 0x12
    NO_VALUE = 0x13
    INTEGER = 0x21
    BOOLEAN = 0x22
    ENUM = 0x23
    OCTETS = 0x30
    DATE_TIME = 0x31
    RESOLUTION = 0x32
    RANGE = 0x33
    COLLECTION = 0x34
    TEXT_WITH_LANGUAGE = 0x35
    NAME_WITH_LANGUAGE = 0x36
    END_COLLECTION = 0x37
    TEXT = 0x41
    NAME = 0x42
    KEYWORD = 0x44
    URI = 0x45
    URI_SCHEME = 0x46
    CHARSET = 0x47
    LANGUAGE = 0x48
    MIME_TYPE = 0x49
    MEMBER_NAME = 0x4A


_NUMBERS = (MessageTag.INTEGER, MessageTag.ENUM)


@dataclass(frozen=True)
class Resolution:
    """Dots across and along the feed; unit 3 is dots an inch, 4 dots a centimetre."""

    across: int
    along: int
    unit: int = 3


@dataclass(frozen=True)
class Range:
    """Whole numbers from `least` to `greatest`, both included."""

    least: int
    greatest: int


@dataclass(frozen=True)
class Value:
    """One value and the tag of its type.

    Integers and enums hold an int, booleans a bool, characters a str (bytes that are no UTF-8 survive as surrogates),
    collections a tuple of `Attribute`; `Resolution` and `Range` hold themselves; everything else its bytes.
    """

    tag: int
    value: int | str | bytes | Resolution | Range | tuple[Attribute, ...]


@dataclass(frozen=True)
class Attribute:
    """A name and its values, at least one."""

    name: str
    values: tuple[Value, ...]


@dataclass(frozen=True)
class AttributeGroup:
    """A group of attributes; `tag` says of what (operation, job, printer, unsupported)."""

    tag: int
    attributes: tuple[Attribute, ...] = ()


@dataclass(frozen=True)
class Message:
    """A request or a response.

    code : of the operation, or of the status.
    request : the number by which a response is known to belong to its request.
    version : (major, minor).
    """

    code: int
    groups: tuple[AttributeGroup, ...] = ()
    request: int = 1
    version: tuple[int, int] = (2, 0)

    def find_all(self, name: str, group: int | None = None) -> tuple[Value, ...]:
        """The values of an attribute, wherever it first stands (or in a group with that tag); none if it is absent."""
        for section in self.groups:
            if group in (None, section.tag):
                for attribute in section.attributes:
                    if attribute.name == name:
                        return attribute.values
        return ()


def attribute(name: str, tag: int, *values: int | str | bytes | Resolution | Range | Sequence[Attribute]) -> Attribute:
    """An attribute all of whose values are of one type."""
    return Attribute(
        name, tuple(Value(tag, v if isinstance(v, (int, str, bytes, Resolution, Range)) else tuple(v)) for v in values)
    )


def encode(message: Message) -> bytes:
    """The bytes of a message, without a document.

    Raises ValueError: a name or a value longer than 32767 bytes, or a value that is not of its type.
    """
    parts = [struct.pack(">BBHI", *message.version, message.code, message.request)]
    for group in message.groups:
        parts.append(bytes([group.tag]))
        for attribute in group.attributes:
            if not attribute.values:
                raise ValueError(f"{attribute.name} has no value")
            for n, value in enumerate(attribute.values):
                # RFC 8010 §3.1.5: a further value of the same attribute has an empty name
                parts += _value(attribute.name.encode() if n == 0 else b"", value)
    parts.append(bytes([MessageTag.END]))
    return b"".join(parts)


def _value(name: bytes, value: Value) -> Iterator[bytes]:
    if value.tag != MessageTag.COLLECTION:
        yield _item(value.tag, name, _body(value))
        return
    yield _item(MessageTag.COLLECTION, name, b"")
    assert isinstance(value.value, tuple)
    for member in value.value:
        yield _item(MessageTag.MEMBER_NAME, b"", member.name.encode())
        for item in member.values:
            yield from _value(b"", item)
    yield _item(MessageTag.END_COLLECTION, b"", b"")


def _item(tag: int, name: bytes, body: bytes) -> bytes:
    if max(len(name), len(body)) > _LONGEST:
        raise ValueError(f"{name[:40]!r}: {max(len(name), len(body))} bytes are more than {_LONGEST}")
    return struct.pack(">BH", tag, len(name)) + name + struct.pack(">H", len(body)) + body


def _body(value: Value) -> bytes:
    held = value.value
    if isinstance(held, str):  # most are
        return held.encode("utf-8", "surrogateescape")
    if isinstance(held, bytes):
        return held
    if isinstance(held, Resolution):
        return struct.pack(">iib", held.across, held.along, held.unit)
    if isinstance(held, Range):
        return struct.pack(">ii", held.least, held.greatest)
    if isinstance(held, tuple):
        raise ValueError("a collection needs the tag of a collection")
    return struct.pack(">?", held) if value.tag == MessageTag.BOOLEAN else struct.pack(">i", held)


def decode(data: bytes) -> tuple[Message, int]:
    """A message, and the place in `data` behind it, where a document begins if there is one.

    Raises PrinterError: the bytes are no IPP message, or not the whole of one.
    """
    reader = _MessageReader(data)
    major, minor, code, request = struct.unpack(">BBHI", reader.take(8))
    groups: list[AttributeGroup] = []
    tag = reader.tag()
    while tag != MessageTag.END:
        if tag >= 0x10:
            raise PrinterError(f"An IPP message has a value (tag {tag:#x}) before its first group.")
        attributes, following = _attributes(reader)
        groups.append(AttributeGroup(tag, attributes))
        tag = following
    return Message(code, tuple(groups), request, (major, minor)), reader.at


class _MessageReader:
    """Reads bytes from the front; raises PrinterError if there are too few."""

    def __init__(self, data: bytes) -> None:
        self._data, self.at = data, 0

    def take(self, count: int) -> bytes:
        begin, self.at = self.at, self.at + count
        if self.at > len(self._data):
            raise PrinterError(f"An IPP message ends in the middle, after {len(self._data)} bytes.")
        return self._data[begin : self.at]

    def tag(self) -> int:
        return self.take(1)[0]

    def field(self) -> bytes:
        high, low = self.take(2)
        length = high << 8 | low
        if length > _LONGEST:
            raise PrinterError(f"An IPP message has a field of {length} bytes; {_LONGEST} is the most.")
        return self.take(length) if length else b""


def _attributes(reader: _MessageReader) -> tuple[tuple[Attribute, ...], int]:
    """The attributes up to the next tag of a group, and that tag."""
    attributes: list[tuple[str, list[Value]]] = []
    while (tag := reader.tag()) >= 0x10:
        name = _text(reader.field())
        value = _read_value(reader, tag, _DEEPEST)
        if name:
            attributes.append((name, [value]))
        elif attributes:
            attributes[-1][1].append(value)
        else:
            raise PrinterError("An IPP message has a value without a name.")
    return tuple(Attribute(name, tuple(values)) for name, values in attributes), tag


def _read_value(reader: _MessageReader, tag: int, depth: int) -> Value:
    body = reader.field()
    if tag != MessageTag.COLLECTION:
        return Value(tag, _decode_value(tag, body))
    if depth == 0:
        raise PrinterError(f"An IPP message has collections in more than {_DEEPEST} collections.")
    members: list[tuple[str, list[Value]]] = []
    while (inner := reader.tag()) != MessageTag.END_COLLECTION:
        reader.field()  # within a collection names are empty: a member's name is the value of an item of its own
        if inner == MessageTag.MEMBER_NAME:
            members.append((_text(reader.field()), []))
        elif members and inner >= 0x10:
            members[-1][1].append(_read_value(reader, inner, depth - 1))
        else:
            raise PrinterError("An IPP message has a collection that is not one.")
    reader.field()
    reader.field()
    return Value(tag, tuple(Attribute(name, tuple(values)) for name, values in members if values))


def _decode_value(tag: int, body: bytes) -> int | str | bytes | Resolution | Range:
    if 0x40 <= tag <= 0x5F:  # most are
        return _text(body)
    if tag in _NUMBERS and len(body) == 4:
        return int.from_bytes(body, "big", signed=True)
    if tag == MessageTag.BOOLEAN and len(body) == 1:
        return body != b"\0"
    if tag == MessageTag.RESOLUTION and len(body) == 9:
        return Resolution(*struct.unpack(">iib", body))
    if tag == MessageTag.RANGE and len(body) == 8:
        return Range(*struct.unpack(">ii", body))
    return body


def _text(body: bytes) -> str:
    return body.decode("utf-8", "surrogateescape")
