"""The text of a page as six small square codes at its foot, so that a scan alone says what was to be copied.

A record (see `PageRecord`) is packed with msgpack and zlib and cut into five parts; the sixth code holds the parity of
these, so that any five of the six suffice. Each part has a header and is written as a QR code in base 45 (RFC 9285,
the alphabet of QR's alphanumeric mode): any reader of such codes gives it back, now or in thirty years.

    part    = version (1 byte), index (1), length of the packed record (2), its CRC-32 (4), data
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import reduce
from hashlib import blake2b
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from handout.errors import DoesNotFit, InputError

VERSION = 1
PARTS = 5  # with data; one more has their parity
_HEADER = struct.Struct(">BBHI")
_MOST = 20_000  # bytes of an unpacked record: what is longer is none of ours
_BASE45 = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ $%*+-./:"
_VALUE = {char: i for i, char in enumerate(_BASE45)}
# letters that a QR code of versions 1 to 15 holds at error correction level M (ISO/IEC 18004, table 7)
_HOLDS = (20, 38, 61, 90, 122, 154, 178, 221, 262, 311, 366, 419, 483, 528, 600)


@dataclass(frozen=True)
class PageRecord:
    """What the codes of a page say.

    key : names the whole prompt; the same on all of its pages.
    number, pages : of this page, counted from 1, and of all.
    pitch : mm between lines.
    printed : whether the words are printed on the page.
    lines : the text, as it was to be broken into lines.
    """

    key: str
    number: int
    pages: int
    pitch: float
    printed: bool
    lines: tuple[str, ...]


def key(pages: Sequence[Sequence[str]]) -> str:
    """Sixteen hexadecimal digits that name the text of a prompt."""
    return blake2b("\f".join("\n".join(page) for page in pages).encode(), digest_size=8).hexdigest()


def pack(record: PageRecord) -> bytes:
    """The record in few bytes."""
    named, number, pages, pitch, printed, lines = astuple(record)
    fields = (bytes.fromhex(named), number, pages, pitch, printed, "\n".join(lines))
    return zlib.compress(msgspec.msgpack.encode(fields), 9)


def unpack(data: bytes) -> PageRecord:
    """The record again.

    Raises
    ------
    InputError
        It is not a record of this version.
    """
    try:
        whole = zlib.decompressobj().decompress(data, _MOST)
        kind = tuple[bytes, int, int, float, bool, str]
        named, number, pages, pitch, printed, text = msgspec.msgpack.decode(whole, type=kind)
    except (zlib.error, msgspec.MsgspecError) as error:
        raise InputError("The codes of the page hold no text: the sheet is not one of this program's.") from error
    return PageRecord(named.hex(), number, pages, pitch, printed, tuple(text.split("\n")) if text else ())


def split(data: bytes) -> list[bytes]:
    """Five parts of equal length and their parity, each with its header."""
    size = -(-len(data) // PARTS)
    padded = data.ljust(size * PARTS, b"\0")
    parts = [padded[i * size : (i + 1) * size] for i in range(PARTS)]
    parts.append(_parity(parts))
    check = zlib.crc32(data)
    return [_HEADER.pack(VERSION, i, len(data), check) + part for i, part in enumerate(parts)]


def join(parts: Sequence[bytes]) -> bytes | None:
    """The data from any five of the six parts; None if there are too few that belong together."""
    groups: dict[tuple[int, int], dict[int, bytes]] = {}
    for part in parts:
        if len(part) > _HEADER.size:
            version, index, length, check = _HEADER.unpack_from(part)
            if version == VERSION and index <= PARTS:
                groups.setdefault((length, check), {})[index] = part[_HEADER.size :]
    for (length, check), found in groups.items():
        data = _joined(found)[:length]
        if len(data) == length and zlib.crc32(data) == check:
            return data
    return None


def _joined(found: Mapping[int, bytes]) -> bytes:
    if len(found) < PARTS or len({len(part) for part in found.values()}) > 1:
        return b""
    missing = [i for i in range(PARTS) if i not in found]
    whole = dict(found)
    if missing:
        whole[missing[0]] = _parity(list(found.values()))
    return b"".join(whole[i] for i in range(PARTS))


def _parity(parts: Sequence[bytes]) -> bytes:
    rows = [np.frombuffer(part, dtype=np.uint8) for part in parts]
    return reduce(np.bitwise_xor, rows).tobytes()


def base45(data: bytes) -> str:
    """Bytes as letters that QR's alphanumeric mode holds (RFC 9285)."""
    text = []
    for i in range(0, len(data) - 1, 2):
        high, low = divmod(data[i] * 256 + data[i + 1], 45)
        middle, high = high % 45, high // 45
        text += [_BASE45[low], _BASE45[middle], _BASE45[high]]
    if len(data) % 2:
        high, low = divmod(data[-1], 45)
        text += [_BASE45[low], _BASE45[high]]
    return "".join(text)


def from_base45(text: str) -> bytes | None:
    """The bytes again; None if the text is not base 45."""
    if len(text) % 3 == 1 or any(char not in _VALUE for char in text):
        return None
    found = bytearray()
    for i in range(0, len(text), 3):
        digits = [_VALUE[char] for char in text[i : i + 3]]
        value = sum(digit * 45**place for place, digit in enumerate(digits))
        size = len(digits) - 1
        if value >= 256**size:
            return None
        found += value.to_bytes(size, "big")
    return bytes(found)


def symbols(record: PageRecord) -> list[NDArray[np.bool_]]:
    """The six codes of a page as (m, m) bool arrays, True black, all of one size, without the white around them.

    Raises
    ------
    DoesNotFit
        More text than codes of that size hold.
    """
    texts = [base45(part) for part in split(pack(record))]
    longest = max(map(len, texts))
    version = next((v for v, most in enumerate(_HOLDS, 1) if longest <= most), None)
    if version is None:
        raise DoesNotFit(
            f"The text of page {record.number} takes {longest} letters a code, and {_HOLDS[-1]} are possible: "
            "use a wider ruling, so that fewer lines stand on a page."
        )
    return [_symbol(text, version) for text in texts]


def _symbol(text: str, version: int) -> NDArray[np.bool_]:
    import cv2

    vision: Any = cv2  # what is nested in classes has other names in the library's annotations
    parameters = vision.QRCodeEncoder_Params()
    parameters.version = version
    parameters.correction_level = vision.QRCodeEncoder_CORRECT_LEVEL_M
    parameters.mode = vision.QRCodeEncoder_MODE_ALPHANUMERIC
    drawn = np.asarray(vision.QRCodeEncoder.create(parameters).encode(text)) < 128
    border = (len(drawn) - side(version)) // 2
    return drawn[border:-border, border:-border] if border else drawn


def side(version: int) -> int:
    """Modules along a side of a QR code of that version."""
    return 17 + 4 * version


VERSIONS = tuple(range(1, len(_HOLDS) + 1))
