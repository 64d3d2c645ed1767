"""Writes files so that none is ever left half-written, even when the power goes, and locks them against others.

What is to be kept goes to a temporary file, which is put on the disk, then renamed, and then the new name is put on the
disk too: a rename alone may survive a power cut without the content.
"""

from __future__ import annotations

import contextlib
import errno
import math
import os
import re
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import IO, Any, BinaryIO

from handout.errors import InputError, reported

PLAIN_NAME = re.compile(r"[\w-][\w.-]{0,99}", re.ASCII)  # of a file that was sent: it leads to no other folder
_TRIED_AGAIN = 0.05  # s between two looks whether another program still holds a file
_TAKEN = {errno.EAGAIN, errno.EACCES, errno.EDEADLK}  # what the systems answer where another program has the lock
_CLOSED = {errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT}  # and where a folder cannot be written
_holding = threading.local()
_LOCKED = 1 << 30  # the byte of a file that is locked on Windows: no file that is locked has so many
# names of devices, which Windows takes no file for, whatever their suffix
_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])\s*(\..*)?", re.IGNORECASE)


@contextlib.contextmanager
def open_together() -> Iterator[Callable[[Path], contextlib.AbstractContextManager[BinaryIO]]]:
    """Give a function that opens files as `open_file` does; all go to their places if the block ends without an error.

    Raises InputError: as `open_file`, of any of them; none has been changed then.
    """
    made = list[tuple[Path, Path]]()  # temporary files, and their places

    @contextlib.contextmanager
    def opening(path: Path) -> Iterator[BinaryIO]:
        path = target(path)
        with reported(f"write {path}"):
            if path.exists() and not path.is_file():
                with path.open("wb") as stream:
                    yield stream
                return
            handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
            made.append((Path(name), path))
            with os.fdopen(handle, "wb") as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            umask = os.umask(0)
            os.umask(umask)
            Path(name).chmod(0o666 & ~umask)

    try:
        yield opening
        for _, path in made:
            target(path)
        for temporary, path in made:
            with reported(f"write {path}"):
                temporary.replace(path)
                sync_folder(path.parent)
    finally:
        for temporary, _ in made:
            with contextlib.suppress(OSError):  # those in their places are gone from here
                temporary.unlink()


@contextlib.contextmanager
def open_file(path: Path) -> Iterator[BinaryIO]:
    """A stream into a temporary file beside `path`, renamed into place when the block ends without an error.

    After that the file survives a power cut.

    For what is too long to be held in memory as a whole; `write` is for everything else.  A link is written through: it
    stays, and what it leads to is written, whether that is there yet or not.  What is no file, such as a pipe, is
    written to at once.

    Raises InputError: the folder does not exist or is not writable, or a link leads in a circle; nothing has been
    changed then.
    """
    with open_together() as opening, opening(path) as stream:
        yield stream


def target(path: Path) -> Path:
    """Where what is written to `path` comes to lie: behind all links.

    Raises InputError: it is a folder, a link that leads to itself, or on Windows the name of a device.
    """
    if sys.platform == "win32" and _RESERVED.fullmatch(path.name):
        raise InputError(f"Cannot write {path}: on Windows {path.stem} is the name of a device; choose another.")
    if path.is_symlink():
        path = Path(os.path.realpath(path))
        if path.is_symlink():
            raise InputError(f"Cannot write {path}: it is a link that leads to itself.")
    if path.is_dir():
        raise InputError(f"Cannot write {path}: it is a folder; give a file name.")
    return path


def write(path: Path, data: bytes) -> None:
    """Write `data` to a temporary file beside `path`, then rename it into place.

    Raises InputError: the folder does not exist or is not writable; nothing has been changed then.
    """
    with open_file(path) as stream:
        stream.write(data)


def write_all(files: Iterable[tuple[Path, bytes]]) -> None:
    """Write several files, all of them or none; errors are those of `write`."""
    with open_together() as opening:
        for path, data in files:
            with opening(path) as stream:
                stream.write(data)


def move_folder(work: Path, place: Path) -> None:
    """Rename a folder whose files are all written; then it survives a power cut with all of them.

    Raises OSError: it cannot be renamed, for instance because `place` holds something.
    """
    for folder, _, names in os.walk(work):
        for name in names:
            _sync(Path(folder, name))
        sync_folder(Path(folder))
    work.rename(place)
    sync_folder(place.parent)


def sync_folder(path: Path) -> None:
    """Make the names in a folder survive a power cut."""
    # systems that cannot open folders have no need of it
    with contextlib.suppress(OSError):
        _sync(path)


def _sync(path: Path) -> None:
    # Windows syncs only what is open for writing; a folder, or a file that is copied from a read-only one, cannot be
    writable = path.is_file() and os.access(path, os.W_OK)
    handle = os.open(path, os.O_RDWR if writable else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def lock(stream: IO[Any]) -> None:
    """Hold an open file against other programs; raises OSError if another has it.

    The lock goes with the program, however it ends.
    """
    number = stream.fileno()
    if sys.platform == "win32":
        import msvcrt

        # of one byte far behind the end: what is locked there nobody else may read
        before = os.lseek(number, 0, os.SEEK_CUR)
        os.lseek(number, _LOCKED, os.SEEK_SET)
        try:
            msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(number, before, os.SEEK_SET)
        return
    import fcntl

    fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextlib.contextmanager
def hold_file(path: Path, say: Callable[[str], None] = lambda _: None, patience: float = math.inf) -> Iterator[None]:
    """Keep other programs that hold the file `path`, too, from it until the block ends.

    Who changes a file according to what is in it holds it from before it is read until it is written.  Since the file
    is replaced then, the lock is a file beside it, `.NAME.lock`, which goes when nobody needs it.  A thread may hold
    again what it holds.  Where the folder cannot be written nothing is held: nobody changes the file there.

    say : is told once if another program has to be waited for.
    patience : s to wait at most.

    Raises InputError: another program held it all that time, or the file system cannot lock; `path` is as it was.
    """
    path = Path(os.path.realpath(path))
    mine: set[Path] = _holding.__dict__.setdefault("paths", set())
    stream = None if path in mine else _lock_beside(path, say, time.monotonic() + patience)
    if stream is None:
        yield
        return
    mine.add(path)
    try:
        yield
    finally:
        mine.remove(path)
        # on Windows what is open cannot be deleted; whoever opened it meanwhile keeps it
        if sys.platform == "win32":
            stream.close()
        with contextlib.suppress(OSError):
            Path(stream.name).unlink()
        stream.close()


def _lock_beside(path: Path, say: Callable[[str], None], until: float) -> BinaryIO | None:
    """The file beside `path`, open and locked; None where the folder cannot be written."""
    beside, told = path.with_name(f".{path.name}.lock"), False
    while True:
        stream = None
        try:
            stream = beside.open("ab")
            lock(stream)
            if os.path.samestat(os.fstat(stream.fileno()), beside.stat()):
                return stream
            stream.close()  # whoever held it has deleted it meanwhile: it keeps nobody away
            continue
        except FileNotFoundError:
            if stream is None:
                return None
            stream.close()
            continue
        except OSError as error:
            if stream is None and error.errno in _CLOSED:
                return None
            if stream is not None:
                stream.close()
            if stream is None or error.errno not in _TAKEN:
                raise InputError(f"Cannot hold {path} against other programs: {error.strerror or error}.") from error
        if time.monotonic() > until:
            raise InputError(f"{path.name} is being changed by another program: wait until it is through, then again.")
        if not told:
            say(f"Another program is changing {path.name}: waiting until it is through.")
        told = True
        time.sleep(_TRIED_AGAIN)


def check_writable(path: Path) -> None:
    """Raise InputError now if `path` could not be written later (asked before long work, not instead of it)."""
    path = target(path)
    if not path.parent.is_dir():
        raise InputError(f"Cannot write {path}: the folder {path.parent} does not exist.")
    if not os.access(path.parent, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise InputError(f"Cannot write {path}: permission denied.")
