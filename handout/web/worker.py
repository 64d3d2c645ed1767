"""A process that does the studio's work: calls of the pipeline come in, progress and results go out.

It is started as ``python -m handout.web.worker``.  Frames are a length (4 bytes, big endian) and that many bytes:
pickled calls from the server, which is trusted, and MessagePack to it.  It ends when its input does, so that no process
outlives its server.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import sys
import threading
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, BinaryIO

import msgspec

from handout.errors import HandoutError, at_border

LENGTH = 4  # bytes of a frame's length
HALTS = 30.0  # s that a machine has to stop in good order, its pen lifted; set by eye
_GLANCE = 0.05  # s


@dataclass(frozen=True)
class Call:
    """A function of the pipeline and what it is called with.

    function : "writing.write" is `handout.pipeline.writing.write`.
    listens : whether it takes a `listener`.
    moves : whether it moves a machine: it is asked to end, and has the time to lift a pen.
    """

    function: str
    arguments: tuple[Any, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    listens: bool = False
    moves: bool = False


class Cancelled(BaseException):
    """Nobody waits for the call any longer; no part of the program catches it as a fault."""


class _WorkDesk:
    """One call at a time, and the listener that it talks to; what it tells is sent by a thread of its own, which a
    server that does not read cannot hold up."""

    def __init__(self, answers: BinaryIO) -> None:
        self._answers = answers
        self._calls: queue.Queue[tuple[int, Call]] = queue.Queue()
        self._words: queue.Queue[tuple[int, str]] = queue.Queue()
        self._out: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._unwanted: set[int] = set()
        self._number, self._moves, self._lost = 0, False, False
        threading.Thread(target=self._send, daemon=True).start()

    def listen(self, requests: BinaryIO) -> None:
        """Take calls, words to them, and numbers of calls that are no longer wanted, until the server is gone."""
        while len(head := requests.read(LENGTH)) == LENGTH:
            number, call = pickle.loads(requests.read(int.from_bytes(head, "big")))
            if call is None:
                self._unwanted.add(number)
            elif isinstance(call, str):
                self._words.put((number, call))
            else:
                self._calls.put((number, call))
        self._lost = True
        for _ in range(round(HALTS / _GLANCE)):  # a pen that is down has to be lifted first
            if not self._moves:
                break
            time.sleep(_GLANCE)
        os._exit(0)

    def _send(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                data = self._out.get()
                self._answers.write(len(data).to_bytes(LENGTH, "big") + data)
                if self._out.empty():
                    self._answers.flush()

    def work(self) -> None:
        """Do one call after the other."""
        while True:
            self._moves = False
            self._number, call = self._calls.get()
            self._moves = call.moves
            try:
                self._tell("done", **_result(call, self))
            except Cancelled:
                self._tell("cancelled")
            except Exception as error:
                own = str(error) if isinstance(error, HandoutError) else ""
                if own or at_border(error):
                    self._tell("refused", error=f"{own} {at_border(error)}".strip(), reason=type(error).__name__)
                    continue
                traceback.print_exc()
                fault = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
                self._tell("failed", error=f"That is a fault of this program: {fault}.")

    def _tell(self, what: str, **facts: Any) -> None:
        data = msgspec.msgpack.encode({"what": what, "number": self._number, **facts}, enc_hook=_plain)
        self._out.put(data)

    def _look(self) -> None:
        if self._lost or self._number in self._unwanted:
            raise Cancelled

    def say(self, *sentences: str) -> None:
        self._look()
        self._tell("said", sentences=sentences)

    note = say

    def progress(self, share: float, stage: str) -> None:
        self._look()
        self._tell("progress", share=float(share), stage=stage)

    def live(self, facts: Mapping[str, Any]) -> None:
        self._tell("live", live=facts)

    def word(self, seconds: float = 0.0) -> str:
        """See `pipeline.plot_desk.PageWire`; words to earlier calls are passed over."""
        if self._lost or self._number in self._unwanted:
            return "gone" if self._lost else "stop"
        with contextlib.suppress(queue.Empty):
            number, word = self._words.get(timeout=seconds) if seconds else self._words.get_nowait()
            return word if number == self._number else ""
        return ""


def _plain(value: Any) -> Any:
    """Numbers of numpy, and paths, as MessagePack has them."""
    return value.item() if hasattr(value, "item") else str(value)


def _result(call: Call, desk: _WorkDesk) -> dict[str, Any]:
    module, name = call.function.rsplit(".", 1)
    function = getattr(import_module(f"handout.pipeline.{module}"), name)
    heard = {"listener": desk} if call.listens else {}
    result = function(*call.arguments, **call.options, **heard)
    if hasattr(result, "facts"):
        return {"facts": result.facts(), "notes": list(getattr(result, "notes", ()))}
    return {"facts": result, "notes": []}


def main() -> None:
    """Serve until standard input ends; what the work prints goes to standard error."""
    for name in ("SIGINT", "SIGHUP"):  # Ctrl-C, or the end of the terminal, is the server's, which ends its processes
        with contextlib.suppress(ValueError, AttributeError):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    desk = _WorkDesk(answers)
    threading.Thread(target=desk.listen, args=(sys.stdin.buffer,), daemon=True).start()
    desk.work()


if __name__ == "__main__":
    main()
