"""Makes old-letter.png, a page as one finds it in a drawer, and old-letter.txt, what is written on it.

The paper is yellowed, spotted, stained and folded; the ink of its back shines through; somebody numbered it in blue
pencil much later, and stamped it. All of it is simulated.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from handout.simulated.scanner import Flatbed
from PIL import Image

import handout
from handout.inking.papers import Paper
from handout.inking.pen import Pen
from handout.values import Drawing, Stroke
from handout_lab.author.old_paper import old_sheet
from handout_lab.author.simulate import Desk, simulate

FRONT = (
    "My dear Sister, your letter of the ninth came this morning with the carrier, and I answer at once. "
    "We have had rain for eleven days; the lower field is quite under water, and the bridge by the mill was "
    "carried off in the night of Sunday. Nobody was hurt, but the miller lost his two grey horses.\n"
    "The children have been ill with a cough and are better. They ask every evening when you will visit us, "
    "and whether you will bring the little box with the shells. I have sewn six shirts and a quilt, and sold "
    "the quilt for a good price at the fair.\n"
    "Pray send me the receipt for the quince jelly, for mine will not set, and tell me just how long it must boil."
)
BACK = (
    "I had almost forgotten to tell you of the clock. It stopped again on Friday, and the man who came to mend it "
    "found a mouse's nest behind the weights, with five young ones in it. So it may go or stand as it likes until "
    "they are grown. The apples are all in, and we have made nine barrels of cider, of which two are for you if "
    "the roads allow it. Do not send money for them. The evenings are long now and I read aloud while the others "
    "spin. Keep warm, and write soon, and believe me always your loving sister."
)
PAGE, DPI, SEED = handout.page("A5"), 300, 1871
INK = Pen(0.42, "#6b4c30", "fountain")  # iron gall ink that has turned brown
STAMP, PENCIL = Pen(0.35, "#8a5a9a", "fineliner"), Pen(0.6, "#5b7fb8", "pencil")
LAYOUT = handout.Layout(PAGE, margin=(22.0, 12.0, 12.0, 14.0), x_height=1.9, line_spacing=8.6, fit=True)


def ring(x: float, y: float, radius: float) -> Stroke:
    """A circle, as a stamp prints it."""
    turn = np.linspace(0, 2 * np.pi, 120)
    return Stroke(turn, np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)]))


def line_at(text: str, x: float, y: float, x_height: float, rng: np.random.Generator) -> Drawing:
    """A few words by another hand, their baseline beginning at a place of the page."""
    layout = handout.Layout(PAGE, margin=(y - 2 * x_height, 1.0, 1.0, x), x_height=x_height)
    hand = handout.load("house-print")
    (page,) = handout.compose(text, hand, layout, rng, pages=1)
    return handout.trace(page, hand, rng)


def main() -> None:
    """Write the page and its text into the folder one is in."""
    paper, back, marks, front = np.random.default_rng(SEED).spawn(4)
    hand = handout.load("house-joined")
    (behind,) = handout.compose(BACK, hand, replace(LAYOUT, margin=(20.0, 14.0, 12.0, 12.0)), back, pages=1)
    stamp = line_at("14 MY", 113.0, 24.0, 1.7, marks)
    stamp = replace(stamp, strokes=(ring(119.0, 23.0, 8.0), ring(119.0, 23.0, 6.6), *stamp.strokes))
    sheet = old_sheet(
        PAGE, DPI, paper, back=handout.trace(behind, hand, back), back_pen=INK,
        marks=[(stamp, STAMP), (line_at("No. 27", 16.0, 12.0, 2.2, marks), PENCIL)],
    )  # fmt: skip
    Image.fromarray(sheet).save("old-sheet.png", dpi=(DPI, DPI))
    flatbed = replace(Flatbed.of_handwriting(), white=1.0)  # the scanner does not take this paper for white
    desk = Desk(INK, Paper("old-sheet.png"), LAYOUT, DPI, flatbed)
    letter = simulate(FRONT, hand, desk, rng=front)
    Path("old-sheet.png").unlink()
    Image.fromarray(letter.image).save("old-letter.png", dpi=(DPI, DPI))
    Path("old-letter.txt").write_text("\n".join(line.text for line in letter.manuscript.lines) + "\n", encoding="utf-8")
    print("Wrote old-letter.png, old-letter.txt")


if __name__ == "__main__":
    main()
