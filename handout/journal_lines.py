"""The lines of every journal: sealed with a check sum (CRC-32), only ever added, and read when nobody else writes them.

::

    5d3ae2f1 run 2026-03-01T09:30:00

What a line says is on the disk when `JournalFile.sync` has returned, and only then may somebody rely on it.  A power
cut or a crash leaves the beginning of a line at most: that is cut off.  Whatever else is no sealed line is `Damage`: it
stays where it is, and whose journal it is says what is not known for it.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import zlib
from pathlib import Path
from typing import NamedTuple

from handout import atomic
from handout.errors import InputError

# the beginning of a line, sealed or of a program that did not seal lines of JSON
_TORN = re.compile(rb"[0-9a-f]{1,8}|(?:[0-9a-f]{8} |\{)[^\0-\x1f]*")


class Damage(NamedTuple):
    """What of a journal cannot be read: from which line on, from 1, and how many bytes."""

    line: int
    size: int


def seal(text: str) -> bytes:
    """A text of one line as a line of a journal."""
    data = text.encode("utf-8", "replace")
    return b"%08x %s\n" % (zlib.crc32(data), data)


def parse(data: bytes) -> tuple[list[str | Damage], int]:
    """The texts of a journal's lines, with what is damaged between them, and how many bytes are no torn end."""
    found, size = list[str | Damage](), 0
    *lines, last = data.split(b"\n")
    for number, line in enumerate(lines, 1):
        size += len(line) + 1
        _add(found, line, Damage(number, len(line) + 1))
    if not last:
        return found, size
    # all of it is there where the line's end alone is lost, or another byte
    for whole in (last, last[:-1]):
        if _unseal_line(whole) is not None:
            _add(found, whole, Damage(0, 0))
            return found, size + len(whole)
    if _TORN.fullmatch(last):
        return found, size
    _add(found, last, Damage(len(lines) + 1, len(last)))
    return found, size + len(last)


def _add(found: list[str | Damage], line: bytes, damage: Damage) -> None:
    text = _unseal_line(line)
    if text is None and line[:1] == b"{" and not any(isinstance(each, str) and each[:1] != "{" for each in found):
        with contextlib.suppress(ValueError):  # of a journal of batches as programs wrote it that did not seal it
            text = json.dumps(json.loads(line))
    if text is not None:
        found.append(text)
    elif line and found and isinstance(found[-1], Damage):
        found[-1] = Damage(found[-1].line, found[-1].size + damage.size)
    elif line:
        found.append(damage)


def _unseal_line(line: bytes) -> str | None:
    sealed = line[8:9] == b" " and line[:8] == b"%08x" % zlib.crc32(line[9:])
    return line[9:].decode("utf-8", "replace") if sealed else None


def read_lines(path: Path) -> list[str | Damage]:
    """The lines of a journal that another program may be writing; none where there is no file.

    Raises InputError: it cannot be read.
    """
    try:
        return parse(path.read_bytes())[0]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise cannot("read", path, error) from error


def cannot(what: str, path: Path, error: OSError) -> InputError:
    """That a journal cannot be read or written."""
    return InputError(f"Cannot {what} the journal {path}: {error.strerror or error}.")


class JournalFile:
    """A journal that is open for adding, held against other programs from before it is read until it is closed.

    lines : what it held, as `parse` finds it.
    """

    def __init__(self, path: Path, busy: str) -> None:
        """Open it, or make it.

        Raises InputError: it cannot be read or written; or, in the words of `busy`, another program has it.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("ab+", buffering=0)
        except OSError as error:
            raise cannot("write", path, error) from error
        try:
            self._hold(path, busy)
        except BaseException:
            self._file.close()
            raise

    def _hold(self, path: Path, busy: str) -> None:
        try:
            atomic.lock(self._file)
        except OSError as error:
            raise InputError(busy) from error
        try:
            self._file.seek(0)
            data = self._file.read()
            self.lines, size = parse(data)
            self._file.truncate(size)
            if not data:
                atomic.sync_folder(path.parent)
            elif size and data[size - 1 : size] != b"\n":
                self.add(b"\n")
        except OSError as error:
            raise cannot("write", path, error) from error

    def add(self, lines: bytes) -> None:
        """Add sealed lines; raises OSError, and then none of them is there."""
        before = os.fstat(self._file.fileno()).st_size
        try:
            while lines:  # a disk that fills up takes a part
                lines = lines[self._file.write(lines) or 0 :]
        except OSError:
            with contextlib.suppress(OSError):
                self._file.truncate(before)
            raise

    def sync(self) -> None:
        """Wait until all lines are on the disk; raises OSError."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Let others have it."""
        self._file.close()
