"""Whether a machine can read what the hands write: character error of an off-the-shelf reader.

Needs the package ``rapidocr-onnxruntime``, which the program itself does not.  Single words of real pen data read
with it: 0.14.  With the environment variable HANDOUT_DATA set, the real pages that have a transcript there
(`scans/*/TRANSCRIPTS.md`) are read as well: the reader drops lines of a page, people's as well as ours.
"""

from __future__ import annotations

import importlib.util
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from handout.hand.library import load, names
from handout.inking import pens
from handout.inking.pen import usual
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.score.written_lines import read_page

GOALS = {"house-print": 0.10, "house-joined": 0.15, "house-quick": 0.15}
TEXT = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8").strip()
SEEDS = (1, 2, 3, 4)
_SAME_LINE = 0.45  # of the height of a box: boxes no further apart are on one line


def character_error(wanted: str, got: str) -> float:
    """Edit distance over length, spaces left out and case ignored."""
    a, b = (re.sub(r"\s", "", text.lower().replace("’", "'")) for text in (wanted, got))
    codes = np.array([ord(c) for c in b])
    index = np.arange(len(b) + 1)
    row = index.copy()
    for number, char in enumerate(a, 1):
        best = np.minimum(row[:-1] + (codes != ord(char)), row[1:] + 1)
        # insertions run along the row: a running minimum of what it costs to come from the left
        row = np.minimum.accumulate(np.concatenate([[number], best]) - index) + index
    return float(row[-1]) / max(len(a), 1)


def _read(reader: Any, picture: np.ndarray[Any, Any]) -> str:
    """The text on a page of 300 dpi, its boxes put into lines."""
    import cv2

    # a third as fine: the reader finds lines of about 40 pixels best, and drops fewer of them
    picture = cv2.resize(picture, None, fx=1 / 3, fy=1 / 3, interpolation=cv2.INTER_AREA)
    # the page is upright: without this the reader turns some lines of handwriting upside down
    found, _ = reader(picture, use_cls=False)
    boxes = sorted((sum(p[1] for p in box) / 4, min(p[0] for p in box), text) for box, text, _ in found or [])
    near = _SAME_LINE * float(np.median([box[2][1] - box[0][1] for box, _, _ in found])) if found else 0.0
    lines: list[tuple[float, list[tuple[float, str]]]] = []
    for y, x, text in boxes:
        if lines and abs(lines[-1][0] - y) < near:
            lines[-1][1].append((x, text))
        else:
            lines.append((y, [(x, text)]))
    return " ".join(text for _, line in lines for _, text in sorted(line))


def transcribed(folder: Path) -> Iterator[tuple[str, Path, str]]:
    """(name, picture, text) of the real pages whose text is known: sections ``## name`` of the lists of transcripts."""
    for listed in sorted(folder.glob("scans/*/TRANSCRIPTS.md")):
        for section in listed.read_text(encoding="utf-8").split("\n## ")[1:]:
            head, text = section.split("\n", 1)
            name = head.split()[0].removesuffix(".png")
            yield name, listed.parent / f"{name}.png", " ".join(text.replace("~~", "").splitlines())


def main() -> None:
    """Print the character error of a page of each hand, and of people's pages where there are any."""
    if importlib.util.find_spec("rapidocr_onnxruntime") is None:
        print("rapidocr-onnxruntime is not installed: pip install rapidocr-onnxruntime")
        return
    from rapidocr_onnxruntime import RapidOCR

    reader = RapidOCR()
    for name in names():
        errors = []
        for seed in SEEDS:
            rng = np.random.default_rng(seed)
            hand = load(name)
            sheet, *_ = compose(TEXT, hand, Layout(page("A4"), x_height=2.2, fit=True), rng)
            drawing = trace(sheet, hand, rng)
            picture = pens.image(drawing, 300, usual("ballpoint"), pens.noise({"seed": seed}))
            errors.append(character_error(TEXT, _read(reader, picture)))
        said = ", ".join(f"{error:.3f}" for error in errors)
        print(f"{name}: character error {said} (goal {GOALS.get(name, 0.15):.2f}; real pen data 0.14)")
    if not os.environ.get("HANDOUT_DATA"):
        return
    for name, path, text in transcribed(Path(os.environ["HANDOUT_DATA"])):
        error = character_error(text, _read(reader, np.dstack([read_page(path)] * 3)))
        print(f"{name}: character error {error:.3f} (a person's page)")
