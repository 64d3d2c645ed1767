"""Order: pen-up travel of drawings against vpype's linesort, and of handwriting with its words moved about."""

from __future__ import annotations

import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import handout
from handout.plotting.planning.order import by_travel
from handout.sinks.paths import join_numbers
from handout.values import Array, Drawing, Page, Stroke

HANDS = ("house-joined", "house-print", "house-quick")
STROKES = 2000
A4 = Page(210, 297, "A4")
TEXT = Path(__file__).parent / "three-hundred-words.txt"
_PX = 25.4 / 96  # mm
# what a script does that reads, orders and writes, start included: vpype does the same
_OURS = """
import sys
from handout.plotting.planning.order import by_tour
from handout.sinks.svg import to_svg
from handout.sources import read_drawing
from dataclasses import replace
drawing = read_drawing(sys.argv[1])
ordered = replace(drawing, strokes=by_tour(drawing.strokes))
open(sys.argv[2], "wb").write(to_svg(ordered))
print(ordered.pen_up, len(ordered.strokes))
"""


def main() -> None:
    """Print both tables."""
    drawings()
    handwriting()


def written(hand: str, size: str, x_height: float, spacing: float | None = None) -> Drawing:
    """The first page of a text of 1800 words, as small and as dense as asked for."""
    loaded, rng = handout.load(hand), np.random.default_rng(1)
    layout = handout.Layout(handout.page(size), margin=(10,) * 4, x_height=x_height, line_spacing=spacing)
    page = handout.compose((TEXT.read_text(encoding="utf-8") + " ") * 6, loaded, layout, rng)[0]
    drawing: Drawing = handout.trace(page, loaded, rng)
    return drawing


def sheets() -> dict[str, list[Array]]:
    """Lines of 2000 strokes a sheet, mm."""
    rng = np.random.default_rng(1)
    found = {hand: [s.xy for s in written(hand, "A4", 1.5, 5.0).strokes[:STROKES]] for hand in HANDS[:2]}
    middle = rng.uniform(0, 1, (STROKES, 2)) * (190, 277) + 10
    angle, half = rng.uniform(0, np.pi, STROKES), rng.uniform(0.5, 6, STROKES)
    reach = np.column_stack([np.cos(angle), np.sin(angle)]) * half[:, None]
    found["short lines"] = [np.array([m - r, m + r]) for m, r in zip(middle, reach, strict=True)]
    around = np.linspace(0, 2 * np.pi, 40)
    ring = np.column_stack([np.cos(around), np.sin(around)])
    ring[-1] = ring[0]
    found["rings"] = [m + h * ring for m, h in zip(middle, half, strict=True)]
    return found


def drawings() -> None:
    """The same 2000 strokes by vpype and by us: read, ordered, written; CPU of the whole process."""
    vpype = shutil.which("vpype", path=str(Path(sys.executable).parent)) or shutil.which("vpype")
    print(
        f"pen-up mm of {STROKES} strokes without times; s of CPU from start to written file; " + (vpype or "no vpype")
    )
    print(f"{'':<14}{'file':>8}{'linesort':>10}{'two-opt':>9}{'s':>6}{'handout':>9}{'s':>6}{'ratio':>7}")
    with tempfile.TemporaryDirectory() as folder:
        for name, paths in sheets().items():
            sheet, out = Path(folder) / "sheet.svg", Path(folder) / "out.svg"
            sheet.write_text(as_svg(paths), encoding="utf-8")
            strokes = tuple(Stroke(np.arange(len(xy), dtype=np.float64), xy) for xy in paths)
            file = Drawing(strokes, A4).pen_up
            ours, ours_s = cpu([sys.executable, "-c", _OURS, str(sheet), str(out)])
            travel, count = (float(value) for value in ours.split())
            if count != len(paths):
                raise AssertionError(f"{count} of {len(paths)} strokes were drawn")
            row = f"{name:<14}{file:8.0f}"
            if vpype:
                greedy, _ = _vpype(vpype, sheet, out, "linesort")
                best, best_s = _vpype(vpype, sheet, out, "linesort", "--two-opt")
                row += f"{greedy:10.0f}{best:9.0f}{best_s:6.2f}{travel:9.0f}{ours_s:6.2f}{travel / best:7.3f}"
            else:
                row += f"{'-':>10}{'-':>9}{'-':>6}{travel:9.0f}{ours_s:6.2f}{'-':>7}"
            print(row)


def as_svg(paths: list[Array]) -> str:
    """Polylines, as other programs write them."""
    lines = "".join(
        f'<polyline points="{join_numbers(np.rint(xy * 1000).astype(int).ravel().tolist())}"/>' for xy in paths
    )
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{A4.width}mm" height="{A4.height}mm"'
    return f'{head} viewBox="0 0 {A4.width} {A4.height}"><g fill="none" stroke="black">{lines}</g></svg>'


def cpu(command: list[str]) -> tuple[str, float]:
    """What a command prints, and the seconds of CPU it takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _vpype(program: str, sheet: Path, out: Path, *operations: str) -> tuple[float, float]:
    said, seconds = cpu([program, "read", str(sheet), *operations, "write", str(out), "stat"])
    found = re.search(r"Pen-up length: ([\d.]+)", said)
    if found is None:
        raise AssertionError(said)
    return float(found.group(1)) * _PX, seconds


def handwriting() -> None:
    """Pages as people write them: only whole words move."""
    print("pen-up mm of pages of handwriting, in the order of writing and with --order travel")
    for hand in HANDS:
        for size, x_height in (("A5", 2.5), ("A4", 2.5)):
            drawing = written(hand, size, x_height)
            begin = time.process_time()
            ordered = Drawing(by_travel(drawing.strokes), drawing.page)
            took = time.process_time() - begin
            words = len({stroke.word for stroke in drawing.strokes})
            ratio = ordered.pen_up / drawing.pen_up
            print(f"{hand:<14}{size}{words:5} words{drawing.pen_up:8.0f}{ordered.pen_up:8.0f}{ratio:7.3f}{took:7.2f} s")


if __name__ == "__main__":
    main()
