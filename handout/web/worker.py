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
import traceback
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, BinaryIO

import msgspec

from handout.errors import HandoutError

LENGTH = 4  # bytes of a frame's length


@dataclass(frozen=True)
class Call:
    """A function of the pipeline and what it is called with.

    function : "writing.write" is `handout.pipeline.writing.write`.
    listens : whether it takes a `listener`.
    """

    function: str
    arguments: tuple[Any, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    listens: bool = False


class Cancelled(BaseException):
    """Nobody waits for the call any longer; no part of the program catches it as a fault."""


class _Desk:
    """One call at a time, and the listener that it talks to."""

    def __init__(self, answers: BinaryIO) -> None:
        self._answers = answers
        self._calls: queue.Queue[tuple[int, Call]] = queue.Queue()
        self._unwanted: set[int] = set()
        self._number = 0

    def listen(self, requests: BinaryIO) -> None:
        """Take calls, and numbers of calls that are no longer wanted, until the server is gone."""
        while len(head := requests.read(LENGTH)) == LENGTH:
            number, call = pickle.loads(requests.read(int.from_bytes(head, "big")))
            if call is None:
                self._unwanted.add(number)
            else:
                self._calls.put((number, call))
        os._exit(0)

    def work(self) -> None:
        """Do one call after the other."""
        while True:
            self._number, call = self._calls.get()
            try:
                self._tell("done", **_result(call, self))
            except Cancelled:
                self._tell("cancelled")
            except HandoutError as error:
                self._tell("refused", error=str(error), reason=type(error).__name__)
            except Exception as error:
                traceback.print_exc()
                fault = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
                self._tell("failed", error=f"That is a fault of this program: {fault}.")

    def _tell(self, what: str, **facts: Any) -> None:
        data = msgspec.msgpack.encode({"what": what, "number": self._number, **facts}, enc_hook=_plain)
        self._answers.write(len(data).to_bytes(LENGTH, "big") + data)
        self._answers.flush()

    def _look(self) -> None:
        if self._number in self._unwanted:
            raise Cancelled

    def say(self, *sentences: str) -> None:
        """See `pipeline.results.Listener`."""
        self._look()
        self._tell("said", sentences=sentences)

    note = say

    def progress(self, share: float, stage: str) -> None:
        """See `pipeline.results.Listener`."""
        self._look()
        self._tell("progress", share=float(share), stage=stage)


def _plain(value: Any) -> Any:
    """Numbers of numpy, and paths, as MessagePack has them."""
    return value.item() if hasattr(value, "item") else str(value)


def _result(call: Call, desk: _Desk) -> dict[str, Any]:
    module, name = call.function.rsplit(".", 1)
    function = getattr(import_module(f"handout.pipeline.{module}"), name)
    heard = {"listener": desk} if call.listens else {}
    result = function(*call.arguments, **call.options, **heard)
    if hasattr(result, "facts"):
        return {"facts": result.facts(), "notes": list(getattr(result, "notes", ()))}
    return {"facts": result, "notes": []}


def main() -> None:
    """Serve until standard input ends; what the work prints goes to standard error."""
    with contextlib.suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the server's, which ends its processes
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    desk = _Desk(answers)
    threading.Thread(target=desk.listen, args=(sys.stdin.buffer,), daemon=True).start()
    desk.work()


if __name__ == "__main__":
    main()
