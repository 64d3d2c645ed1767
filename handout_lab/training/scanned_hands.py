"""Makes the scanned hands that ship: the simulated author copies a prompt, and the ordinary pipeline reads the scans.

Simulated devices stand in for pen, paper and scanner.  Ink, line and lines of writing are what the pipeline finds;
whose ink is whose is known, so that these hands have no wrong letters.
`python -m handout_lab.training.scanned_hands -o FOLDER` makes them anew.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from handout import atomic
from handout.errors import InputError
from handout.hand import file, library
from handout.hand.drawn import Hand
from handout.hand.scanned import ScannedHand, Texture
from handout.inking.pen import Pen, usual
from handout.page_sizes import page
from handout.prompting import corpus, prompt_pages, sentence_choice
from handout.tagging.page_tagging import TaggedPage, hand_of_pages, tag_labelled_page
from handout.writing.layout import Layout
from handout_lab.author import page_score
from handout_lab.author.simulate import Desk, simulate_pages
from handout_lab.author.truth import Simulated
from handout_lab.training.glyph_vetting import known

PAGES = 3  # that the author copies; set by eye
ACCENTED = "àáâãäåæçèéêëìíîïñòóôõöøœßùúûüýÿÄÖÜÉ¡¿€£–…"
_UNSEEN = 6  # of 255: change of a pixel that nobody sees beside its neighbours' own
_LAYOUT = Layout(page("A4"), margin=(20.0, 14.0, 20.0, 14.0), x_height=2.5)


@dataclass(frozen=True)
class Recipe:
    """A scanned hand to make.

    name, title : of the hand; drawn : the drawn hand that writes it.
    width : characters that it gets into a line.
    """

    name: str
    title: str
    drawn: str
    pen: Pen
    width: int


RECIPES = (
    Recipe(
        "house-joined-ballpoint", "Everyday joined-up hand, ballpoint, scanned", "house-joined", usual("ballpoint"), 49
    ),
    Recipe("house-print-fountain", "Printed hand, fountain pen, scanned", "house-print", usual("fountain"), 56),
)


@dataclass(frozen=True, eq=False)
class Shipped:
    """A hand that was made, its scans one after the other as they were read, and how well each was."""

    hand: ScannedHand
    scores: tuple[page_score.LetterScore, ...]


def prompt(recipe: Recipe, hand: Hand, count: int = PAGES) -> str:
    """What the author copies: chosen sentences with all printable ASCII and the usual accents, broken into lines."""
    characters = corpus.PRINTABLE + ACCENTED
    sentences = corpus.shipped_sentences()
    target = sentence_choice.frequencies(corpus.usable(sentences, frozenset(characters + " ")))
    lines = _LAYOUT.lines_a_page(hand.pitch)
    chosen = prompt_pages.prompt(sentences, target, characters, pages=count, lines=lines, width=recipe.width)
    return "\n".join(line for sheet in chosen.pages for line in sheet)


def scans(recipe: Recipe, seed: int, dpi: float = 300.0) -> Iterator[Simulated]:
    """The pages as they come from the simulated scanner; the same seed gives the same pages."""
    hand = library.load(recipe.drawn)
    rng = np.random.default_rng([seed, *recipe.name.encode()])
    yield from simulate_pages(prompt(recipe, hand), hand, Desk(recipe.pen, layout=_LAYOUT, dpi=dpi), rng=rng)


def read_back(simulated: Simulated, source: str) -> TaggedPage:
    """A simulated page read as a user's scan is, its letters taken from what is known of it."""
    return tag_labelled_page(*known(simulated, page_score.read(simulated, source)))


def ship(recipe: Recipe, seed: int, dpi: float = 300.0, scans_to: Path | None = None) -> Shipped:
    """Write, scan and read a hand.

    scans_to : a folder for the scans and their texts, to be looked at.
    """
    read, scores = list[TaggedPage](), list[page_score.LetterScore]()
    for number, simulated in enumerate(scans(recipe, seed, dpi), 1):
        if number > PAGES:
            raise InputError(f"{recipe.name}: a line of {recipe.width} characters is too long for it: ask for fewer.")
        source = f"{recipe.name}-{number}.png"
        if scans_to is not None:
            _keep(simulated, scans_to / source)
        read.append(read_back(simulated, source))
        scores.append(page_score.score(simulated.truth, read[-1]))
        _say(f"{source}: {_scores_line(scores[-1])}; {len(read[-1].glyphs)} letters, {len(read[-1].missing)} not found")
        for note in read[-1].notes:
            _say(f"  {note}")
    return Shipped(hand_of_pages(recipe.name, read, recipe.title), tuple(scores))


def compressible(hand: ScannedHand) -> ScannedHand:
    """The hand without scans, and with ink that packs well: faint pixels have fewer colours, which no eye tells apart.

    Laid on any paper, no pixel changes by more than `_UNSEEN` of 255.
    """
    return replace(
        hand, pages=tuple(replace(sheet, texture=_rounded(sheet.texture), scan=None) for sheet in hand.pages)
    )


def _rounded(texture: Texture) -> Texture:
    rgba = texture.rgba
    usual = np.median(rgba[rgba[:, :, 3] > 128][:, :3], axis=0).astype(np.int32)
    alpha = rgba[:, :, 3:].astype(np.int32)
    # a power of two, at most 64; rounding errs by half of it
    step = np.exp2(np.floor(np.log2(np.clip(2 * _UNSEEN * 255 / np.maximum(alpha, 1), 1, 64)))).astype(np.int32)
    colour = usual + np.rint((rgba[:, :, :3] - usual) / step).astype(np.int32) * step
    rounded = np.where(alpha > 0, np.concatenate([np.clip(colour, 0, 255), alpha], axis=2), 0).astype(np.uint8)
    return Texture(texture.corner, texture.shape, lambda: rounded)


def _keep(simulated: Simulated, path: Path) -> None:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.asarray(simulated.image)).save(stream, "PNG", dpi=(simulated.dpi, simulated.dpi))
    atomic.write(path, stream.getvalue())
    atomic.write(path.with_suffix(".txt"), (page_score.transcript(simulated) + "\n").encode())


def _scores_line(score: page_score.LetterScore) -> str:
    split = score.splits
    return f"{score.right:.1%} of the letters right, {split.placed:.1%} of the splits in place"


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the hands and write them."""
    names = [recipe.name for recipe in RECIPES]
    parser = argparse.ArgumentParser(
        prog="python -m handout_lab.training.scanned_hands", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="the folder for the .hand files")
    parser.add_argument("--hands", nargs="+", choices=names, default=names)
    parser.add_argument("--dpi", type=float, default=300.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scans", action="store_true", help="keep the scans and their texts there, too")
    chosen = parser.parse_args(arguments)
    try:
        chosen.output.mkdir(parents=True, exist_ok=True)
        for recipe in RECIPES:
            if recipe.name in chosen.hands:
                shipped = ship(recipe, chosen.seed, chosen.dpi, chosen.output if chosen.scans else None)
                path = chosen.output / f"{recipe.name}{file.SUFFIX}"
                file.save(compressible(shipped.hand), path, packed=True)
                _say(f"{path}: {path.stat().st_size / 1e6:.2f} MB, {len(shipped.hand.glyphs)} letters")
    except (InputError, OSError) as error:
        parser.exit(2, f"{error}\n")


if __name__ == "__main__":
    main()
