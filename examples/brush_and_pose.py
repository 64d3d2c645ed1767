"""A brush learned from a sheet of strokes, and a greeting painted with it, its pen held as in a library.

python examples/brush_and_pose.py strokes.jpg card.png

Without a sheet of your own, the strokes that the brush sumi paints are photographed, so to speak, and learned again.
"""

import sys
from pathlib import Path

import numpy as np

import handout
from handout.inking.brush import brushes
from handout.inking.pen import Pen
from handout.values import Drawing, Page, Stroke


def strokes(path):
    """Four strokes of 12 mm width on a sheet, from short to long."""
    lines = [np.array([[20.0, y], [60.0 + 25 * k, y + 4.0]]) for k, y in enumerate((20.0, 45.0, 70.0, 95.0))]
    made = [Stroke(np.array([k, k + 0.9]), line, width=np.full(2, 12.0)) for k, line in enumerate(lines)]
    look = handout.Look(Pen(12.0, "#15131a", "sumi"), dpi=150)
    handout.write_drawings([Drawing(tuple(made), Page(170, 120))], [path], look)


def main(photograph, card):
    """Learn the brush, keep it, and write with it."""
    if not photograph.exists():
        strokes(photograph)
    brush, left_out = brushes.learn([photograph], width=2.0)
    print(*left_out, f"{len(brush.ribbons)} strokes learned", sep="\n")
    Path("mine.brush").write_bytes(brushes.to_bytes(brush))
    handout.write(
        "Happy birthday, Zoë",
        [card],
        handout.WritingOptions(hand="house-print", x_height="8mm", seed=1, pose="firm", fit=True),
        handout.SheetOptions(page="210x60mm", margin="8mm"),
        handout.PictureOptions(pen="mine.brush", dpi=200),
    )


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:] or ["strokes.png", "card.png"]))
