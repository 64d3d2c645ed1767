"""How long the studio takes to answer, beside the same call of the library.

Medians, ms: a card in each drawn hand as SVG, asked for and fetched; a line in a scanned hand as PNG; a card that is
typed on in each scanned hand; targets that are dragged, in each style; of the letters of a scanned hand a page, a tile,
a correction that is kept (with the words around it aligned anew), how a word is written, ink that is painted, and its
undoing.
Columns: through the server; in the library, warm; what the server adds.  The browser waits 120 ms after a key before it
asks: a card is to be there within 300 ms.  The movement of a drag is to be there within 16 ms.
"""

from __future__ import annotations

import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from handout.hand import file, library
from handout.hand.scanned import KeptScan, ScannedHand, ScannedPage
from handout.motion.styles import style
from handout.pipeline import letter_desk, style_editor
from handout.pipeline.options import PictureOptions, SheetOptions, StyleDraft, WritingOptions
from handout.pipeline.writing import write

CARD = "Dear Ada,\n\nthank you for the jam: it is nearly finished, and we all hope for more.\n\nYours, Zoë"
LINE = "thank you for the jam"
HANDS = ("house-joined", "house-quick", "house-print")
SCANNED, JOINED = "house-print-fountain", "house-joined-ballpoint"
TARGETS = (8, 30)  # in a movement
TIMES, FEW, MANY = 15, 5, 41  # of which the median is taken: of quick calls, and of slow ones


class Server:
    """The studio with a copy of a scanned hand, in a process of its own, and requests to it."""

    def __init__(self, folder: Path, hand: Path) -> None:
        key = folder / "key"
        command = [
            sys.executable,
            "-m",
            "handout",
            "studio",
            str(hand),
            "--no-browser",
            "--json",
            "--key-file",
            str(key),
        ]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert self._process.stdout is not None
        self._address = json.loads(self._process.stdout.readline())["link"].split("/#")[0]
        self._headers = {"Authorization": f"Bearer {key.read_text(encoding='ascii').strip()}"}

    def ask(self, path: str, body: dict[str, Any] | None = None) -> bytes:
        """What a route answers."""
        data = None if body is None else json.dumps(body).encode()
        with urllib.request.urlopen(urllib.request.Request(self._address + path, data, self._headers)) as answer:
            return bytes(answer.read())

    def written(self, **asked: Any) -> bytes:
        """A text, written and fetched."""
        done = json.loads(self.ask("/api/write", asked))
        return self.ask(f"/api/tasks/{done['id']}/files/0")

    def close(self) -> None:
        """End it."""
        self._process.terminate()
        self._process.wait()


def median(call: Callable[[], object], times: int) -> float:
    """Of some calls, ms, after one that is not counted."""
    call()
    taken = []
    for _ in range(times):
        begin = time.perf_counter()
        call()
        taken.append(time.perf_counter() - begin)
    return 1000 * statistics.median(taken)


def compared(name: str, server: Callable[[], object], own: Callable[[], object], times: int = TIMES) -> None:
    """A row of the table."""
    there, here = median(server, times), median(own, times)
    print(f"{name:<34} {there:8.1f} {here:8.1f} {there - here:8.1f}", flush=True)


def corrections(server: Server, hand: Path) -> None:
    """The rows of the letters of a hand; `hand` is the server's, a copy of it the library's."""
    own = str(shutil.copy(hand, hand.with_name("own.hand")))
    url = f"/api/hands/{hand.stem}"
    revision = [json.loads(server.ask(f"{url}/letters"))["revision"], letter_desk.open_letters(own)["revision"]]
    letters: Any = letter_desk.page_letters(own, 0)["letters"]
    spot = letters[20]["spot"]
    made = [{"do": "confirm", "page": 0, "at": spot}]

    def post(path: str, **body: Any) -> None:
        revision[0] = json.loads(server.ask(f"{url}/{path}", {"revision": revision[0], **body}))["revision"]

    def change(call: Callable[..., Any], what: object) -> None:
        revision[1] = call(own, revision[1], what)["revision"]

    compared("the letters of a page", lambda: server.ask(f"{url}/letters/0"), lambda: letter_desk.page_letters(own, 0))
    tile = (0, 0, 1, 1)
    place = "/".join(map(str, tile))
    compared("a tile", lambda: server.ask(f"{url}/tiles/{place}"), lambda: letter_desk.page_tile(own, *tile))
    data = json.dumps(made).encode()
    compared(
        "a correction, kept",
        lambda: post("corrections", corrections=made),
        lambda: change(letter_desk.correct_letters, data),
        FEW,
    )
    x, y = (round(at) for at in spot)
    compared(
        "how a word is written",
        lambda: server.ask(f"{url}/strokes/0/{x}/{y}"),
        lambda: letter_desk.letter_strokes(own, 0, (float(x), float(y))),
        FEW,
    )
    paint = {"do": "paint", "page": 0, "to": "ink", "stroke": [spot, [spot[0] + 30.0, spot[1]]], "width": 6.0}
    painted = json.dumps([paint]).encode()
    answered(own, revision, painted)
    compared(
        "ink painted, words aligned anew",
        lambda: post("corrections", corrections=[paint]),
        lambda: change(letter_desk.correct_letters, painted),
        FEW,
    )
    compared("undone", lambda: post("history", back=1), lambda: change(letter_desk.rewind_letters, 1), FEW - 1)


def answered(own: str, revision: list[str], painted: bytes) -> None:
    """The row of ink that is painted, with its window segmented anew, until it is answered; the words follow."""
    taken = []
    for _ in range(FEW):
        begin, spent = time.perf_counter(), time.process_time()
        revision[1] = str(letter_desk.correct_letters(own, revision[1], painted, later=True)["revision"])
        taken.append((1000 * (time.perf_counter() - begin), 1000 * (time.process_time() - spent)))
        letter_desk.align_letters(own, revision[1])
    wall, own_time = (statistics.median(column) for column in zip(*taken, strict=True))
    print(f"{'ink painted, answered; CPU alone':<34} {'':8} {wall:8.1f} {own_time:8.1f}", flush=True)


def with_scans(hand: ScannedHand) -> ScannedHand:
    """A hand with a scan of each page: its ink on its paper."""

    def kept(page: ScannedPage) -> ScannedPage:
        import cv2

        pixels = np.ascontiguousarray(page.on_paper()[:, :, ::-1])
        data = bytes(cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, 75])[1])
        return replace(page, scan=KeptScan(page.shape, lambda: pixels, lambda: data))

    return replace(hand, pages=tuple(map(kept, hand.pages)))


def typed_on(server: Server, folder: Path) -> None:
    """The rows of a card that is typed on, a letter a time, in each scanned hand: what changed is drawn."""
    for hand in (SCANNED, JOINED):
        asked = {"page": "A6", "hand": hand, "seed": 1, "format": "png", "dpi": 150, "fallback": True}
        there, here = (iter(CARD) for _ in range(2))
        texts = [CARD, CARD]

        def typed(k: int, letters: Iterator[str], texts: list[str] = texts) -> str:
            texts[k] += next(letters)
            return texts[k]

        compared(
            f"card typed on, {hand}",
            lambda: server.written(text=typed(0, there), **asked),  # noqa: B023
            lambda: write(
                typed(1, here),  # noqa: B023
                [folder / "card.png"],
                WritingOptions(hand, 1, fallback=True),  # noqa: B023
                SheetOptions("A6"),
                PictureOptions(150),
            ),
        )


def movements(server: Server) -> None:
    """The rows of targets that are dragged: so many in each style."""
    for name in style.names():
        facts: Any = style_editor.open_style(name)
        base = name if facts["learned"] else ""
        draft = StyleDraft(facts["values"], base, name)
        asked = {"name": name, "values": facts["values"], **({"base": base} if base else {})}
        for count in TARGETS:
            places = [[5 + 140 * k / count, 50 + 30 * (-1) ** k] for k in range(count)]
            plan = {"targets": places, "page": {"width": 148, "height": 105}}
            data = json.dumps(plan).encode()
            compared(
                f"{count} targets dragged, {name}",
                partial(server.ask, "/api/movements", {"plan": plan, "style": asked}),
                partial(style_editor.move_targets, data, draft, 1),
                MANY,
            )


def main() -> None:
    print(f"{'ms, medians':<34} {'studio':>8} {'library':>8} {'more':>8}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        hand = folder / "copy.hand"
        file.save(with_scans(file.load(library.scanned_file(SCANNED))), hand, packed=True)
        server = Server(folder, hand)
        try:
            server.ask("/api/choices")
            for drawn in HANDS:
                compared(
                    f"card, {drawn}",
                    partial(server.written, text=CARD, page="A6", hand=drawn, seed=1),
                    partial(write, CARD, [folder / "card.svg"], WritingOptions(drawn, 1), SheetOptions("A6")),
                )
            writing, sheet, picture = WritingOptions(SCANNED, 1), SheetOptions("120x30mm"), PictureOptions(150)
            asked = {"text": LINE, "page": "120x30mm", "hand": SCANNED, "seed": 1, "format": "png", "dpi": 150}
            compared(
                f"line, {SCANNED}",
                lambda: server.written(**asked),
                lambda: write(LINE, [folder / "line.png"], writing, sheet, picture),
                FEW,
            )
            typed_on(server, folder)
            movements(server)
            corrections(server, hand)
        finally:
            server.close()


if __name__ == "__main__":
    main()
