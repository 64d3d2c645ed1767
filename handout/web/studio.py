"""What the routes of the studio share: sessions, uploads, the names of hands, tasks and the lanes that they run in."""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
import shutil
import tempfile
import time
from collections.abc import Coroutine, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException

from handout import atomic, shipped
from handout.web.worker import HALTS, Call
from handout.web.workers import Lane, LaneFull, Task

TABLES = (".csv", ".tsv", ".txt", ".xlsx", ".vcf")
PICTURES = (".png", ".jpg", ".jpeg", ".webp")  # in letters
SUFFIXES = (*PICTURES, ".tif", ".tiff", ".pdf", ".bmp", ".hand", *TABLES)  # of uploads
_MOST_UPLOADS, _MOST_BYTES = 40, 1 << 30  # kept at once; a hand of ten pages at 600 dpi is a third of that
_MOST_TASKS = 60  # that have ended and whose files are kept
_QUIET, _AGAIN, _LAST = 2.0, 15.0, 10.0  # s: without a correction, then they are kept; tried again; at the end
_MOST_MACHINES = 16
_WAITING = 12  # tasks that may wait in a lane
_PREFIX, _ALIVE = "handout-studio-", "alive"  # of its folder for a while; the file there that is locked while it runs
_NEW = 60.0  # s
_AGED = 30 * 86400.0  # s after which a file that a page sent is forgotten: a month, as long as nobody goes on with it


@dataclass
class Upload:
    """A file that a browser or program sent; its name here is not its name there.

    name : there, for people.
    small : a small picture of it, JPEG; b"" where none was made.
    """

    path: Path
    name: str
    size: int
    small: bytes = b""


@dataclass(eq=False)
class Studio:
    """The state of the server.

    hands : name → file of hands that were given on the command line, beside those that are known by name.
    start : the page that the link opens, such as "letters/mine"; "" for the first.
    styles : name → file of handstyles that were given there.
    """

    hands: Mapping[str, Path] = field(default_factory=dict)
    start: str = ""
    styles: Mapping[str, Path] = field(default_factory=dict)
    hosts: frozenset[str] = frozenset()  # beside this computer, that webhooks may lead to
    token: str = field(default_factory=lambda: secrets.token_urlsafe(32))
    uploads: dict[str, Upload] = field(default_factory=dict)
    tasks: dict[str, Task] = field(default_factory=dict)
    samples: dict[str, tuple[Any, Task]] = field(default_factory=dict)  # lines in hands, and of which state of a file
    drawn: frozenset[str] = frozenset()  # hands that are quick to write in; known once hands were listed
    unkept: dict[str, asyncio.Task[None]] = field(default_factory=dict)  # hands whose corrections wait for their file
    troubles: dict[str, str] = field(default_factory=dict)  # why those of a hand could not be put there
    running: set[asyncio.Task[None]] = field(default_factory=set)
    phone: Task | None = None  # while phones may send photographs, and after it
    _keys: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        sweep()
        self.kept = shipped.own_folder("state") / "studio-files"  # files that pages sent: a folder each, by its number
        for name in self.kept.glob("*/name"):
            with contextlib.suppress(OSError):
                path = next(each for each in name.parent.iterdir() if each != name)
                if time.time() - path.stat().st_mtime > _AGED:
                    shutil.rmtree(name.parent)
                else:
                    self.uploads[name.parent.name] = Upload(path, name.read_text("utf-8"), path.stat().st_size)
        self._folder = tempfile.TemporaryDirectory(prefix=_PREFIX)
        self._alive = (Path(self._folder.name) / _ALIVE).open("wb")
        atomic.lock(self._alive)
        # short calls, long ones, and those about the letters of a hand, which one process does in turn: one writer
        self.quick = Lane(1, _WAITING)
        # two long ones at least, so that what replaces cancelled work need not wait for its end
        self.long = Lane(max(2, min(4, (os.cpu_count() or 1) - 1)), _WAITING)
        self.typed = Lane(1, _WAITING)  # pages that are looked at while they are typed: what did not change is kept
        self.desk = Lane(1, 8 * _WAITING)
        self.bench = Lane(1, _WAITING)  # the same for calibrations
        self._machines: dict[str, Lane] = {}
        self.attended: dict[str, Task] = {}  # port → what moves there, or did last

    def new_key(self) -> str:
        """The key of a new session."""
        self._keys.append(key := secrets.token_urlsafe(32))
        return key

    def exchange(self, token: str) -> str | None:
        """A session's key for the token of the link, once; None for another."""
        if not self.token or not secrets.compare_digest(token.encode(), self.token.encode()):
            return None
        self.token = ""
        return self.new_key()

    def knows_key(self, key: str) -> bool:
        """Whether a key is that of a session; how long that takes says nothing of the keys."""
        return sum(secrets.compare_digest(key.encode(), own.encode()) for own in self._keys) > 0

    def folder(self) -> Path:
        """A new folder of the server's own."""
        return Path(tempfile.mkdtemp(dir=self._folder.name))

    def hand(self, name: str) -> str:
        """What the pipeline calls a hand: its file, if it was given on the command line, or its name."""
        return str(self.hands.get(name, name))

    def style(self, name: str) -> str:
        """The same of a style."""
        return str(self.styles.get(name, name))

    def begin(self, lane: Lane, kind: str, call: Call, folder: Path | None = None) -> Task:
        """A task that waits for its turn. Raises HTTPException: 429: too many wait."""
        ended = [task for task in self.tasks.values() if task.has_ended]
        for task in ended[: max(0, len(ended) - _MOST_TASKS)]:
            self.tasks.pop(task.id).discard()
        task = Task(kind, call, folder)
        try:
            lane.add_task(task)
        except LaneFull:
            task.discard()  # pictures that were sent lie in it
            raise HTTPException(429, "Too much is waiting to be done: wait, or cancel some of it.") from None
        self.tasks[task.id] = task
        return task

    async def answer(self, kind: str, call: Call, lane: Lane | None = None) -> Any:
        """What a short call gives; it leaves no task behind.

        Raises HTTPException: 422 with the pipeline's own sentence; 409 where the hand was changed meanwhile; 500 for
        faults.
        """
        task = self.begin(lane or self.quick, kind, call)
        try:
            await task.wait()
        finally:
            if not task.has_ended:
                task.change(state="cancelled")
            self.tasks.pop(task.id, None)
        raise_refused(task)
        return task.facts

    def run_beside(self, work: Coroutine[Any, Any, None]) -> None:
        """Have something done for which nobody waits."""
        task = asyncio.ensure_future(work)
        self.running.add(task)
        task.add_done_callback(self.running.discard)

    def keep_soon(self, hand: str, after: float = _QUIET) -> None:
        """Have the corrections of a hand taken into its file, once there were no more of them for a while."""
        if hand in self.unkept:
            self.unkept[hand].cancel()
        self.unkept[hand] = asyncio.ensure_future(self._keep(hand, after))

    async def _keep(self, hand: str, after: float) -> None:
        await asyncio.sleep(after)
        try:
            # whoever comes meanwhile waits for the next: a call that is cancelled ends its process
            await asyncio.shield(
                self.answer("keeping corrections", Call("letter_desk.keep_letters", (hand,)), self.desk)
            )
            self.troubles.pop(hand, None)
        except HTTPException as error:
            self.troubles[hand] = str(error.detail)
            self.unkept.pop(hand, None)
            self.keep_soon(hand, _AGAIN)
            return
        if self.unkept.get(hand) is asyncio.current_task():
            del self.unkept[hand]

    async def settle_hand(self, hand: str) -> None:
        """Wait until the file of a hand has all its corrections, before somebody else reads it."""
        waiting = self.unkept.pop(hand, None)
        if waiting is not None:
            waiting.cancel()
            await self._keep(hand, 0.0)

    def room(self, size: int) -> None:
        """Make sure that there is room for an upload, or for more of one. Raises HTTPException: 507: there is none."""
        kept = sum(upload.size for upload in self.uploads.values())
        if len(self.uploads) >= _MOST_UPLOADS or kept + size > _MOST_BYTES:
            raise HTTPException(507, "No more scans can be kept: use those that were sent, or take some away.")

    async def attend(self, ports: Sequence[str], kind: str, call: Call) -> Task:
        """A task that moves the machines at some ports, alone; "" for printers.

        Raises HTTPException: 422: there is no such port; 409: something else moves it.
        """
        for port in filter(None, ports):
            await self.answer("looking for a port", Call("plot_desk.known_port", (port,)))
        # of simulated machines there is one
        places = [port.partition(":")[0] if port.startswith("sim") else port for port in ports]
        before = next((task for place in places if (task := self.attended.get(place)) and not task.has_ended), None)
        if before is not None:
            raise HTTPException(409, f"The machine is busy with {before.kind}: wait, or stop that first.")
        first = places[0]
        if first not in self._machines:
            if len(self._machines) >= _MOST_MACHINES:
                raise HTTPException(429, "So many machines are not attended at once: start the studio again.")
            self._machines[first] = Lane(1, _WAITING, HALTS)
            self._machines[first].open()
        task = self.begin(self._machines[first], kind, call)
        self.attended |= dict.fromkeys(places, task)
        return task

    async def open(self) -> None:
        """Begin to work."""
        for lane in (self.quick, self.typed, self.long, self.desk, self.bench):
            lane.open()
        await self.quick.warm()

    async def close(self) -> None:
        """End all work, and delete what was made."""
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(asyncio.gather(*map(self.settle_hand, list(self.unkept))), _LAST)
        for waiting in (*self.unkept.values(), *self.running):
            waiting.cancel()
        lanes = (self.quick, self.typed, self.long, self.desk, self.bench, *self._machines.values())
        await asyncio.gather(*(lane.close() for lane in lanes))
        self._alive.close()
        self._folder.cleanup()


def sweep() -> None:
    """Delete what studios that were killed left: scans that were sent, and files that were made."""
    for alive in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*/{_ALIVE}"):
        with contextlib.suppress(OSError):
            if time.time() - alive.stat().st_mtime < _NEW:
                continue  # one that begins may not hold its lock yet
            with alive.open("ab") as stream:
                atomic.lock(stream)
            shutil.rmtree(alive.parent)


def raise_refused(task: Task) -> None:
    """Raise what became of a task as an answer, where it was not done."""
    if task.state == "refused":
        raise HTTPException(409 if task.reason.startswith("Stale") else 422, task.error)
    if task.state == "failed":
        raise HTTPException(500, task.error)
    if task.state == "cancelled":
        raise HTTPException(499, "It was cancelled.")
