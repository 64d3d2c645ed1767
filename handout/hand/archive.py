"""One file that holds tables, arrays and pictures, and that can be trusted when it is read back.

It is a zip archive of JSON, ``.npy`` arrays and PNG or WebP pictures, so that other tools can look at its contents.
Nothing in it is code and nothing is unpacked to disk.  Whoever reads says what must be there and what it must look
like; a file that is cut off, damaged, or made to do harm is refused with a sentence.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from tokenize import TokenError
from typing import Any, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from handout import atomic
from handout.errors import InputError
from handout.libraries import cv2

_MOST_MEMBERS = 10_000  # what a file may hold is bounded, so that none takes all memory
_MOST_BYTES = 1 << 30  # of one member, unpacked
_MOST_PIXELS = 400_000_000
_EPOCH = (1980, 1, 1, 0, 0, 0)  # no clock in the file: the same hand, the same bytes
_KEPT = (".png", ".webp")  # packed already
_NAME_LENGTH = 26  # bytes into a part's header, where the lengths of its name and its extra field are: APPNOTE 4.3.7
_SWAPPED = [2, 1, 0, 3]  # of channels with alpha: red and blue change places

Json = TypeVar("Json")


@dataclass(frozen=True, eq=False)
class Packed:
    """A part of another archive as it is packed there.  info : of the part; data : its packed bytes."""

    info: zipfile.ZipInfo
    data: bytes


Content = bytes | NDArray[Any] | msgspec.Struct


def pack(members: Mapping[str, Content | Packed], behind: bytes = b"", level: int = 9) -> bytes:
    """The bytes of an archive: arrays by names that end in ``.npy``, structs in ``.json``, bytes as they are.

    Parts of another archive are copied as they are packed there: packing takes longer than all else.

    behind : an archive whose parts, of other names, come first and are not packed anew.
    level : of zlib, how hard the others are packed.
    """
    stream = io.BytesIO(behind)
    with zipfile.ZipFile(stream, "a") as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type = zipfile.ZIP_STORED if name.endswith(_KEPT) else zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            if isinstance(content, Packed):
                # write a packed part behind the others, as `ZipFile.writestr` writes one that it has packed
                assert archive.fp is not None
                info.compress_type, info.CRC = content.info.compress_type, content.info.CRC
                info.file_size, info.compress_size = content.info.file_size, len(content.data)
                archive.fp.seek(archive.start_dir)
                info.header_offset = archive.fp.tell()
                archive.fp.write(info.FileHeader() + content.data)
                archive.start_dir = archive.fp.tell()
                archive.filelist.append(info)
                archive.NameToInfo[info.filename] = info
            else:
                archive.writestr(info, content_bytes(content), compresslevel=level)
    return stream.getvalue()


def write(path: Path, members: Mapping[str, Content]) -> None:
    """Pack `members` into the file `path`, whole or not at all. Raises InputError: the file cannot be written."""
    atomic.write(path, pack(members))


def check_version(path: Path, found: tuple[str, int], known: tuple[str, int]) -> None:
    """Raise InputError for a learned file of another format or version than is known."""
    if found != known:
        raise InputError(
            f"{path} cannot be used: it is {found[0]} version {found[1]}, and this program reads "
            f"{known[0]} version {known[1]}; take a newer handout, or learn it again."
        )


def split_bytes(numbers: NDArray[Any]) -> NDArray[np.uint8]:
    """Whole numbers (n[, columns]) of 32 bits as (1 to 4, [columns,] n): the lowest bytes of all, then the next ones.

    They pack a fifth smaller.  v is kept as 2v, a negative one as −2v − 1: the higher bytes of small numbers are 0, and
    bytes that are 0 in all are left out.
    """
    numbers = np.ascontiguousarray(numbers.T, dtype=np.int32)
    folded = ((numbers << 1) ^ (numbers >> 31)).view(np.uint32)
    count = max(1, (int(folded.max(initial=0)).bit_length() + 7) // 8)
    return np.stack([(folded >> 8 * k).astype(np.uint8) for k in range(count)])


def join_bytes(split: NDArray[np.uint8]) -> NDArray[np.int32]:
    """What `split_bytes` was given."""
    folded = split[-1].astype(np.uint32)
    for lower in split[-2::-1]:
        folded <<= 8
        folded |= lower
    return np.ascontiguousarray(((folded >> 1).view(np.int32) ^ -(folded & 1).view(np.int32)).T)


def content_bytes(content: Content) -> bytes:
    """A part before it is packed."""
    if isinstance(content, bytes):
        return content
    if isinstance(content, np.ndarray):
        stream = io.BytesIO()
        np.lib.format.write_array(stream, np.ascontiguousarray(content), allow_pickle=False)
        return stream.getvalue()
    return msgspec.json.format(msgspec.json.encode(content), indent=1)


class Archive:
    """An archive that is being read; each method checks what it gives.

    Raises InputError: from every method: the file cannot be opened, is damaged, or does not hold what it must.
    """

    def __init__(self, path: Path, data: bytes | None = None) -> None:
        """Open the file `path`, or `data`, which are to become it."""
        self._path = path
        with self._refusing():
            self._zip = zipfile.ZipFile(path if data is None else io.BytesIO(data))
            infos = self._zip.infolist()
        if len(infos) > _MOST_MEMBERS:
            raise self.error(f"it holds {len(infos)} parts, more than {_MOST_MEMBERS}")
        self._sizes = {info.filename: info.file_size for info in infos}
        self._sums = {info.filename: info.CRC for info in infos}
        self._layers: tuple[str, ...] = ()
        if len(self._sizes) < len(infos):
            raise self.error("it holds two parts of one name")

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()

    def __contains__(self, name: str) -> bool:
        return self._resolve_name(name) in self._sizes

    @property
    def names(self) -> tuple[str, ...]:
        """All parts."""
        return tuple(self._sizes)

    def look_in(self, folders: Sequence[str]) -> None:
        """Take from now on every part from the last of these folders that has it, or else from the top."""
        self._layers = tuple(folders)[::-1]

    def list_parts(self) -> set[str]:
        """The parts that are at the top or in one of those folders, without its name."""
        folders = ("", *self._layers)
        return {name[len(folder) :] for folder in folders for name in self._sizes if name.startswith(folder)}

    def _resolve_name(self, name: str) -> str:
        return next((folder + name for folder in self._layers if folder + name in self._sizes), name)

    def fingerprint(self, names: Sequence[str]) -> str:
        """A digest of the check sums of some parts: other contents give another."""
        parts = [
            (name, self._sizes[self._resolve_name(name)], self._sums[self._resolve_name(name)])
            for name in sorted(names)
        ]
        return sha256(repr(parts).encode()).hexdigest()

    def read_part(self, name: str) -> bytes:
        """The bytes of a part."""
        name = self._resolve_name(name)
        if name not in self._sizes:
            raise self.error(f"{name} is missing")
        if self._sizes[name] > _MOST_BYTES:
            raise self.error(f"{name} unpacks to {self._sizes[name] >> 20} MB, more than {_MOST_BYTES >> 20}")
        with self._refusing(), self._zip.open(name) as stream:
            # never more than the directory says: what is packed may unpack to more
            data = stream.read(self._sizes[name] + 1)
        if len(data) != self._sizes[name]:
            raise self.error(f"{name} has another length than it says")
        return data

    def packed_part(self, name: str) -> Packed:
        """A part as it is packed, for another archive; one that is damaged is refused as by `read_part`."""
        self.read_part(name)
        info = self._zip.getinfo(self._resolve_name(name))
        with self._refusing():
            assert self._zip.fp is not None
            self._zip.fp.seek(info.header_offset + _NAME_LENGTH)
            name_length, extra_length = struct.unpack("<HH", self._zip.fp.read(4))
            self._zip.fp.seek(name_length + extra_length, io.SEEK_CUR)
            return Packed(info, self._zip.fp.read(info.compress_size))

    def json(self, name: str, kind: type[Json]) -> Json:
        """A part as a msgspec struct of type `kind`."""
        try:
            return msgspec.json.decode(self.read_part(name), type=kind)
        except msgspec.MsgspecError as error:
            raise self.error(f"{name}: {error}") from error

    def array(self, name: str, dtype: str, *shape: int | None) -> NDArray[Any]:
        """A part as an array of `dtype` and `shape` (None: any length), all of its numbers finite.

        Whole numbers may be there as they are, or as `split_bytes` gives them.
        """
        data = self.read_part(name)
        try:
            # headers of arrays that numpy itself wrote are a few dozen bytes
            array = np.lib.format.read_array(io.BytesIO(data), allow_pickle=False, max_header_size=1000)
        except (ValueError, EOFError, TypeError, SyntaxError, TokenError, OverflowError, MemoryError) as error:
            raise self.error(f"{name} is not an array") from error
        if dtype in ("int32", "uint16") and array.dtype == np.uint8 and array.ndim > len(shape) and 0 < len(array) <= 4:
            joined = join_bytes(array)
            array = joined.astype(dtype) if np.array_equal(joined, joined.astype(dtype)) else joined
        fits = array.ndim == len(shape) and all(w in (None, n) for n, w in zip(array.shape, shape, strict=True))
        if array.dtype != np.dtype(dtype) or not fits:
            wanted = ", ".join("any" if n is None else str(n) for n in shape)
            raise self.error(f"{name} is {array.dtype} of {array.shape}, not {np.dtype(dtype)} of ({wanted})")
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise self.error(f"{name} holds numbers that are not finite")
        return array

    def picture(self, name: str, mode: str, most: int = _MOST_PIXELS) -> NDArray[np.uint8]:
        """A part as a picture (h, w[, channels]) uint8, of `most` pixels, of a Pillow `mode` such as ``"RGBA"``.

        With the modes ``"BGRA"`` and ``"BGR"`` the pixels of an RGBA or RGB picture have blue first.
        """
        from PIL import Image, UnidentifiedImageError
        from PIL import WebPImagePlugin as _  # noqa: F401  (or Pillow looks for it by importing all that it has)

        data = self.read_part(name)
        Image.MAX_IMAGE_PIXELS = None  # the check below is narrower, and says what is wrong
        try:
            with Image.open(io.BytesIO(data), formats=["PNG", "WEBP"]) as picture:
                if picture.width * picture.height > most:
                    raise self.error(f"{name} has {picture.width} × {picture.height} pixels, too many")
                wanted = {"BGRA": "RGBA", "BGR": "RGB"}.get(mode, mode)
                if picture.mode != wanted:
                    raise self.error(f"{name} is a picture in {picture.mode}, not {wanted}")
                # of WebP Pillow makes three copies on the way, which take twice as long as unpacking it
                if picture.format == "WEBP":
                    unpacked = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
                    if unpacked is not None:  # None: it is damaged
                        pixels = np.asarray(unpacked, dtype=np.uint8)
                        return pixels if mode != wanted else pixels[:, :, _SWAPPED]
                own = np.asarray(picture)
                return own if mode == wanted else own[:, :, _SWAPPED[: own.shape[2]]]
        except (OSError, UnidentifiedImageError, SyntaxError, ValueError, struct.error, zlib.error) as error:
            raise self.error(f"{name} is not a picture") from error

    def error(self, why: str) -> InputError:
        return InputError(f"{self._path} cannot be used: {why}; make it again, or take a copy that is whole.")

    @contextmanager
    def _refusing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise InputError(f"{self._path} cannot be read: {error.strerror or error}.") from error
        except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, ValueError, OverflowError) as error:
            raise self.error("it is cut off or damaged") from error
        except (NotImplementedError, RuntimeError) as error:
            raise self.error("it is packed in a way that this program does not use") from error
