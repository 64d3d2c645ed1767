"""What a plotter has acknowledged, line by line, as JSON lines.

Every plot begins with a line that says what it is: ``{"lines": 5120, "sha256": "…"}`` of the program.  Then comes a
line for every line of the program that the controller has acknowledged, as soon as it has: ``{"line": 12, "text":
"X10.2Y8F900"}``, numbered from 0; and at the end ``{"done": true}``, or ``{"stopped": "why"}``.  Acknowledged means
taken into the controller's queue: the last few moves (usually 15) need not have been executed when a connection breaks.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from handout.errors import InputError


class Journal:
    """Adds to the end of `path`, one plot after the other; without a path it keeps nothing."""

    def __init__(self, path: Path | None, program: list[bytes]) -> None:
        self._stream: TextIO | None = None
        if path is not None:
            try:
                self._stream = path.open("a", encoding="utf-8")
            except OSError as error:
                raise InputError(f"Cannot write the journal {path}: {error.strerror or error}.") from error
        self._write({"lines": len(program), "sha256": hashlib.sha256(b"".join(program)).hexdigest()})

    def acknowledged(self, number: int, data: bytes) -> None:
        """The controller has taken a line."""
        self._write({"line": number, "text": data.decode("ascii").strip()})

    def _write(self, entry: dict[str, Any]) -> None:
        if self._stream is not None:
            self._stream.write(json.dumps(entry) + "\n")
            self._stream.flush()  # what is on the disk must be true even if this program is killed

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._write({"done": True} if kind is None else {"stopped": str(error) or kind.__name__})
        if self._stream is not None:
            self._stream.close()
