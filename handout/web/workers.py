"""Tasks of the studio, and the processes that they run in.

A `Lane` has some processes and a row of tasks that wait for them.  A task that is cancelled is told so at its next
report of progress; where none comes soon its process is ended, and the next task gets a new one.
"""

from __future__ import annotations

import asyncio
import contextlib
import pickle
import re
import secrets
import shutil
import sys
import tempfile
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec

import handout
from handout import shipped
from handout.web.worker import HALTS, LENGTH, Call

State = Literal["waiting", "running", "done", "refused", "failed", "cancelled"]
ENDED = frozenset({"done", "refused", "failed", "cancelled"})
_GRACE = 3.0  # s that cancelled work has to stop by itself; a process that is ended takes a second or two to replace
_MOST_SAID = 200  # sentences of a task that are kept
_BROKEN = "The work broke off: its process ended, perhaps for want of memory."


class LaneFull(Exception):
    """More tasks wait than the lane takes."""


@dataclass(eq=False)
class Task:
    """A call of the pipeline, and how far it has come.

    kind : what it is, for people.
    folder : for files that it makes, its own.
    reason : of a refusal, the class of the error.
    live : what is so at this moment, such as where a pen is.
    tell : says a word to the call while it runs.
    """

    kind: str
    call: Call
    folder: Path | None = None
    id: str = field(default_factory=lambda: secrets.token_urlsafe(12))
    state: State = "waiting"
    share: float = 0.0
    stage: str = ""
    said: list[str] = field(default_factory=list)
    facts: Any = None
    error: str = ""
    reason: str = ""
    live: dict[str, Any] = field(default_factory=dict)
    tell: Callable[[str], None] = lambda word: None
    _turn: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def has_ended(self) -> bool:
        """Whether nothing more will come."""
        return self.state in ENDED

    @property
    def files(self) -> list[Path]:
        """The files that it made, in the order in which the pipeline names them."""
        named = self.facts.get("files", []) if self.state == "done" and isinstance(self.facts, dict) else []
        paths = [Path(name) for name in named]
        return [path for path in paths if self.folder is not None and path.parent == self.folder]

    def snapshot(self) -> dict[str, Any]:
        """What is told of it: the fields that say something."""
        facts = {**self.facts, "files": [path.name for path in self.files]} if isinstance(self.facts, dict) else None
        told = {"said": self.said, "error": self.error, "facts": facts, "live": self.live}
        return {
            "id": self.id,
            "kind": self.kind,
            "state": self.state,
            "share": round(self.share, 3),
            "stage": self.stage,
            **{name: value for name, value in told.items() if value},
        }

    def change(self, **fields: Any) -> None:
        """Take new values and wake who follows."""
        for name, value in fields.items():
            setattr(self, name, value)
        turn, self._turn = self._turn, asyncio.Event()
        turn.set()

    async def follow(self) -> AsyncIterator[dict[str, Any]]:
        """Its snapshots, one now and one at each change, until it has ended."""
        while True:
            turn, ended = self._turn, self.has_ended
            yield self.snapshot()
            if ended:
                return
            await turn.wait()

    async def wait(self) -> None:
        """Until it has ended."""
        while not self.has_ended:
            await self._turn.wait()

    def discard(self) -> None:
        """Delete what it made."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


class _WorkerProcess:
    """One process, started when it is first needed and again after it has ended."""

    def __init__(self) -> None:
        self._process: asyncio.subprocess.Process | None = None
        self._number = 0

    async def start(self) -> asyncio.subprocess.Process:
        """The process, alive."""
        if self._process is None or self._process.returncode is not None:
            command = (sys.executable, "-m", "handout.web.worker")
            pipe = asyncio.subprocess.PIPE
            self._process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe)
        return self._process

    async def run_task(self, task: Task) -> None:
        """A task, until it has ended."""
        process = await self.start()
        assert process.stdout is not None
        self._number += 1
        number, canceller = self._number, asyncio.ensure_future(self._watch(task, process, self._number))
        try:
            _send(process, (number, task.call))
            task.tell = lambda word: _send(process, (number, word))
            while not (task.has_ended and task.state != "cancelled"):
                length = int.from_bytes(await process.stdout.readexactly(LENGTH), "big")
                answer = msgspec.msgpack.decode(await process.stdout.readexactly(length))
                if answer["number"] == number and self._hear_answer(task, answer):
                    return
        except (asyncio.IncompleteReadError, ConnectionError, OSError):
            if not task.has_ended:
                task.change(state="failed", error=_BROKEN)
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
        finally:
            canceller.cancel()

    def _hear_answer(self, task: Task, answer: dict[str, Any]) -> bool:
        """Whether an answer was the last; nobody hears what a cancelled task still says."""
        what = answer["what"]
        if what in ENDED:
            if not task.has_ended:
                told: dict[str, Any] = {
                    "live": {},
                    "facts": answer.get("facts"),
                    "error": bare(answer.get("error", "")),
                    "share": 1.0,
                }
                told |= {"said": [*task.said, *(note for note in answer.get("notes", ()) if note not in task.said)]}
                task.change(state=what, reason=answer.get("reason", ""), **told)
            return True
        if not task.has_ended and what == "said":
            task.change(said=[*task.said, *map(bare, answer["sentences"])][-_MOST_SAID:])
        elif not task.has_ended and what == "live":
            task.change(live=answer["live"])
        elif not task.has_ended:
            task.change(share=answer["share"], stage=answer["stage"])
        return False

    async def _watch(self, task: Task, process: asyncio.subprocess.Process, number: int) -> None:
        """End the work where the task is cancelled, by asking and then by force."""
        await task.wait()
        if task.state == "cancelled":
            with contextlib.suppress(ConnectionError, OSError):
                _send(process, (number, None))
            await asyncio.sleep(HALTS if task.call.moves else _GRACE)
            with contextlib.suppress(ProcessLookupError):
                process.kill()

    async def stop(self, seconds: float = 0.0) -> None:
        """End it; what it does may take so long to come to its end."""
        if self._process is not None and self._process.returncode is None:
            if seconds and self._process.stdin is not None:
                self._process.stdin.close()
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._process.wait(), seconds)
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()


def bare(sentence: str) -> str:
    """A sentence in which files of the server's own are called by their names, without their folders."""
    package = Path(handout.__file__).parent
    own = [shipped.own_folder("config"), shipped.own_folder("data"), shipped.own_folder("state"), package.parent]
    places = {str(place) for folder in (Path(tempfile.gettempdir()), *own) for place in (folder, folder.resolve())}
    roots = "|".join(re.escape(place) for place in sorted(places, key=len, reverse=True))
    return re.sub(rf"(?:{roots})[/\\](?:[\w.-]+[/\\])*", "", sentence)


def _send(process: asyncio.subprocess.Process, message: tuple[int, Call | str | None]) -> None:
    assert process.stdin is not None
    data = pickle.dumps(message)
    process.stdin.write(len(data).to_bytes(LENGTH, "big") + data)


class Lane:
    """Some processes, and the tasks that wait for them; the process that worked last takes the next.

    most : tasks that may wait; halts : s that what runs may take to end when the lane is closed.
    """

    def __init__(self, processes: int, most: int, halts: float = 0.0) -> None:
        self._halts = halts
        self._processes = [_WorkerProcess() for _ in range(processes)]
        self._idle, self._room = list(self._processes), asyncio.Semaphore(processes)
        self._row: asyncio.Queue[Task] = asyncio.Queue(most)
        self._running: set[asyncio.Task[None]] = set()

    def open(self) -> None:
        """Begin to serve; processes start when they are needed."""
        self._running.add(asyncio.ensure_future(self._serve()))

    async def warm(self) -> None:
        """Start the processes before they are needed."""
        await asyncio.gather(*(process.start() for process in self._processes))

    async def _serve(self) -> None:
        while True:
            await self._room.acquire()
            task = await self._row.get()
            doing = asyncio.ensure_future(self._run_task(self._idle.pop(), task))
            self._running.add(doing)
            doing.add_done_callback(self._running.discard)

    async def _run_task(self, process: _WorkerProcess, task: Task) -> None:
        try:
            if not task.has_ended:
                task.change(state="running")
                await process.run_task(task)
        finally:
            self._idle.append(process)
            self._room.release()

    def add_task(self, task: Task) -> Task:
        """Let a task wait for its turn. Raises LaneFull: too many wait."""
        try:
            self._row.put_nowait(task)
        except asyncio.QueueFull:
            raise LaneFull from None
        return task

    async def close(self) -> None:
        """End all processes."""
        for running in self._running:
            running.cancel()
        for process in self._processes:
            await process.stop(self._halts)
