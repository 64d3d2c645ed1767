"""The text of a page as six QR codes at its foot, so that a scan alone says what was to be copied; and reading them.

A record (see `PageRecord`) is packed with msgpack and zlib and cut into five parts; the sixth code holds the parity of
these, so that any five of the six suffice.  Each part has a header and is written as a QR code in base 45 (RFC 9285,
the alphabet of QR's alphanumeric mode), which any reader of QR codes gives back:

    part    = version (1 byte), index (1), length of the packed record (2), its CRC-32 (4), data

The fiducials tell where the codes are.  So each module is sampled at its place, made black or white against its
neighbourhood, and only the clean square that results is given to the decoder: that reads scans of 150 dpi, shadows
and all, in which a search for codes fails.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import reduce
from hashlib import blake2b
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from handout.errors import DoesNotFit, InputError
from handout.libraries import cv2, ndimage
from handout.prompting.sheet_layout import Registration
from handout.values import Array

VERSION = 1  # of the format; a reader refuses any other
PARTS = 5  # with data; one more has their parity
_HEADER = struct.Struct(">BBHI")
_MOST = 20_000  # bytes of an unpacked record: what is longer is none of ours
_BASE45 = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ $%*+-./:"
_VALUE = {char: i for i, char in enumerate(_BASE45)}
# letters that a QR code of versions 1 to 15 holds at error correction level M (ISO/IEC 18004, table 7)
_HOLDS = (20, 38, 61, 90, 122, 154, 178, 221, 262, 311, 366, 419, 483, 528, 600)
VERSIONS = tuple(range(1, len(_HOLDS) + 1))
_FINDER = 7  # modules of the squares at three corners of a code
_REACH = 1.6  # modules by which a code may lie off
_STEP = 0.2
_SCALE = 4  # pixels a module, of the square for the decoder
_QUIET = 4  # modules
_SHARPEN = (0.8, 0.0, 1.6)  # tried in turn
_AROUND = np.array([[0.25, 0.5, 0.25], [0.5, 0.0, 0.5], [0.25, 0.5, 0.25]]) / 3


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
    """The record again. Raises InputError: it is not a record of this version."""
    try:
        whole = zlib.decompressobj().decompress(data, _MOST)
        kind = tuple[bytes, int, int, float, bool, str]
        named, number, pages, pitch, printed, text = msgspec.msgpack.decode(whole, type=kind)
    except (zlib.error, msgspec.MsgspecError) as error:
        raise InputError("The codes of the page hold no text: the sheet is not one of this program's.") from error
    return PageRecord(named.hex(), number, pages, pitch, printed, tuple(text.split("\n")) if text else ())


def split_data(data: bytes) -> list[bytes]:
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
    for (length, check), by_index in groups.items():
        data = _join_parts(by_index)[:length]
        if len(data) == length and zlib.crc32(data) == check:
            return data
    return None


def _join_parts(by_index: Mapping[int, bytes]) -> bytes:
    if len(by_index) < PARTS or len({len(part) for part in by_index.values()}) > 1:
        return b""
    missing = [i for i in range(PARTS) if i not in by_index]
    parts = dict(by_index)
    if missing:
        parts[missing[0]] = _parity(list(by_index.values()))
    return b"".join(parts[i] for i in range(PARTS))


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
    data = bytearray()
    for i in range(0, len(text), 3):
        digits = [_VALUE[char] for char in text[i : i + 3]]
        value = sum(digit * 45**place for place, digit in enumerate(digits))
        size = len(digits) - 1
        if value >= 256**size:
            return None
        data += value.to_bytes(size, "big")
    return bytes(data)


def symbols(record: PageRecord) -> list[NDArray[np.bool_]]:
    """The six codes of a page as (m, m) bool arrays, True black, all of one size, without the white around them.

    Raises DoesNotFit: more text than codes of that size hold.
    """
    texts = [base45(part) for part in split_data(pack(record))]
    longest = max(map(len, texts))
    version = next((v for v, most in enumerate(_HOLDS, 1) if longest <= most), None)
    if version is None:
        raise DoesNotFit(
            f"The text of page {record.number} takes {longest} letters a code, and {_HOLDS[-1]} are possible: "
            "use a wider ruling, so that fewer lines stand on a page."
        )
    return [_symbol(text, version) for text in texts]


def symbol(data: bytes, version: int) -> NDArray[np.bool_]:
    """Some bytes as one code of that version, as `symbols` gives them. Raises DoesNotFit: more than it holds."""
    text = base45(data)
    if len(text) > _HOLDS[version - 1]:
        raise DoesNotFit(f"{len(data)} bytes are more than a QR code of version {version} holds.")
    return _symbol(text, version)


def _symbol(text: str, version: int) -> NDArray[np.bool_]:
    vision: Any = cv2  # what is nested in classes has other names in the library's annotations
    parameters = vision.QRCodeEncoder_Params()
    parameters.version = version
    parameters.correction_level = vision.QRCodeEncoder_CORRECT_LEVEL_M
    parameters.mode = vision.QRCodeEncoder_MODE_ALPHANUMERIC
    drawn = np.asarray(vision.QRCodeEncoder.create(parameters).encode(text)) < 128
    border = (len(drawn) - side_modules(version)) // 2
    return drawn[border:-border, border:-border] if border else drawn


def side_modules(version: int) -> int:
    """Modules along a side of a QR code of that version."""
    return 17 + 4 * version


def read_codes(
    grey: NDArray[np.uint8], registration: Registration, boxes: Array, versions: tuple[int, ...] = VERSIONS[::-1]
) -> list[bytes]:
    """What can be read of the codes in some boxes (n, 4) mm, each as bytes; `versions` that they may be of, in turn."""
    contents: list[bytes] = []
    # blur away detail much finer than the finest module, at whose mercy single samples would be
    finest = (boxes[0, 2] - boxes[0, 0]) / side_modules(VERSIONS[-1]) * registration.dpi / 25.4
    sigma = 0.3 * finest
    smooth = grey if sigma < 0.8 else np.asarray(cv2.GaussianBlur(grey, (0, 0), sigma), dtype=np.uint8)
    for box in boxes:
        for version in versions:
            data = _read_symbol(smooth, registration, box, side_modules(version))
            if data is not None:
                contents.append(data)
                versions = (version,)  # all codes of a page have one size
                break
    return contents


def _read_symbol(grey: NDArray[np.uint8], registration: Registration, box: Array, side: int) -> bytes | None:
    for grid in _grids(grey, registration, box, side):
        grey_modules = _sample_grey(grey, registration.pixels(grid.reshape(-1, 2)).reshape(side, side, 2))
        for strength in _SHARPEN:
            # take away what neighbours spilt into a module: at 150 dpi a module is no larger than the blur
            # dark is told against the neighbourhood: light falls off across a code, and ink is uneven
            modules = np.asarray(
                grey_modules + strength * (grey_modules - ndimage.convolve(grey_modules, _AROUND, mode="nearest"))
            )
            low = ndimage.minimum_filter(modules, 9, mode="nearest")
            high = ndimage.maximum_filter(modules, 9, mode="nearest")
            text = _decode_symbol(np.asarray(modules < ndimage.gaussian_filter((low + high) / 2, 2.0, mode="nearest")))
            data = from_base45(text) if text else None
            if data:
                return data
    return None


def _grids(grey: NDArray[np.uint8], registration: Registration, box: Array, side: int) -> Iterator[Array]:
    """Where the modules' middles may be, (side, side, 2) mm: as drawn, then as its three corner squares have moved."""
    module = (box[2] - box[0]) / side
    at = (np.arange(side) + 0.5) * module
    drawn = box[:2] + np.stack(np.meshgrid(at, at), axis=-1)
    first, last = slice(0, _FINDER), slice(-_FINDER, None)
    corners = ((first, first), (first, last), (last, first))
    fits = [_fit_corner(grey, registration, drawn[corner], module) for corner in corners]
    if min(likeness for likeness, _ in fits) < 0.5:
        return  # not a code of this size, or a spoilt one
    yield drawn
    (_, a), (_, b), (_, c) = fits
    weight = (np.arange(side) - _FINDER / 2 + 0.5) / (side - _FINDER)
    yield drawn + a + weight[None, :, None] * (b - a) + weight[:, None, None] * (c - a)


def _fit_corner(
    grey: NDArray[np.uint8], registration: Registration, points: Array, module: float
) -> tuple[float, Array]:
    """How well the square of a code's corner fits, −1 to 1, and by how many mm (2,) it has moved."""
    steps = np.arange(-_REACH, _REACH + _STEP / 2, _STEP) * module
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    places = points.reshape(1, -1, 2) + shifts[:, None, :]
    samples = _sample_grey(grey, registration.pixels(places.reshape(-1, 2)).reshape(len(shifts), -1, 2))
    ring = np.abs(np.arange(_FINDER) - _FINDER // 2)
    ring_number = np.maximum(ring[:, None], ring)
    pattern = np.where(ring_number == 2, 1.0, -1.0).reshape(-1)
    pattern -= pattern.mean()
    samples = samples - samples.mean(axis=1, keepdims=True)
    norm = np.linalg.norm(samples, axis=1) * np.linalg.norm(pattern)
    likeness = samples @ pattern / np.maximum(norm, 1e-9)
    # of all that fit nearly as well, the middle: blur makes the peak flat
    best = likeness >= likeness.max() - 0.02
    return float(likeness.max()), shifts[best].mean(axis=0)


def _sample_grey(grey: NDArray[np.uint8], pixels: Array) -> Array:
    """Grey at pixels (…, 2), linear between them; white outside the picture."""
    flat = pixels.reshape(len(pixels), -1, 2).astype(np.float32)
    white = cv2.BORDER_CONSTANT
    values = cv2.remap(grey, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR, borderMode=white, borderValue=255)
    return np.asarray(values, dtype=np.float64).reshape(pixels.shape[:-1])


def _decode_symbol(black: NDArray[np.bool_]) -> str:
    side = len(black)
    image = np.full((side + 2 * _QUIET,) * 2, 255, dtype=np.uint8)
    image[_QUIET:-_QUIET, _QUIET:-_QUIET] = np.where(black, 0, 255)
    image = np.kron(image, np.ones((_SCALE, _SCALE), dtype=np.uint8))
    low, high = _QUIET * _SCALE, (_QUIET + side) * _SCALE - 1
    corners = np.array([[[low, low], [high, low], [high, high], [low, high]]], dtype=np.float32)
    try:
        text, _ = cv2.QRCodeDetector().decode(image, corners)
    except cv2.error:  # a damaged code may name a size or mode that cannot be
        return ""
    return str(text)
