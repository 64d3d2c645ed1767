"""Whether what scanned hands write reads as what it should: by our reader and an off-the-shelf one, beside the author.

Every word is read as a picture of its traced lines: the author's own from his page, and a text that is written in his
hand, as it comes and after it was read again; without vetting, where every glyph is taken for what it is called, and
with the ligatures that the author made alone, new ones left out.  The shipped hands are measured; with HANDOUT_HANDS
set, the .hand files of that folder, too.  The other reader is ``rapidocr-onnxruntime``, which the program does not
need; it knows words.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks.legibility import TEXT, character_error
from handout.completion.completed_hand import complete_hand
from handout.hand import library
from handout.hand.author_reader import own_words
from handout.hand.scanned import ScannedHand
from handout.hand.vetting import Vetting
from handout.page_sizes import page
from handout.pipeline.rereading import reread
from handout.reading import pictures
from handout.values import Array
from handout.writing import scanned_words
from handout.writing.compose import Proofreader, each_page
from handout.writing.layout import Layout
from handout.writing.pages import Sheet

WORDS = int(os.environ.get("HANDOUT_WORDS", "100"))  # of the text that are written
SEED = 1
# title, how often it is set anew, what is switched off
COLUMNS = (
    ("as they come", 0, ""),
    ("read again", 5, ""),
    ("read again, without vetting", 5, "vetting"),
    ("read again, without new ligatures", 5, "new ligatures"),
)
_ROOM = 10  # pixels of paper around a word for the other reader

Words = Sequence[tuple[str, Array]]


def other_reader() -> Callable[[Array], str] | None:
    """Reads a picture of a word, if the other reader is installed."""
    if importlib.util.find_spec("rapidocr_onnxruntime") is None:
        return None
    from rapidocr_onnxruntime import RapidOCR

    engine = RapidOCR()

    def read(picture: Array) -> str:
        grey = np.pad(np.rint(255 * (1 - picture)).astype(np.uint8), _ROOM, constant_values=255)
        found, _ = engine(np.dstack([grey] * 3), use_det=False, use_cls=False)
        return str(found[0][0]) if found else ""

    return read


def row(words: Words, other: Callable[[Array], str] | None) -> str:
    """Words misread of 100, mean surprise, and the other reader's character error and words misread of 100."""
    reader = pictures.load()
    seen = [(text, reader.read(picture)) for text, picture in words if pictures.known(text)]
    misread = np.mean([reading.verdict(text).doubtful for text, reading in seen])
    surprise = -np.mean([max(reading.log_probability(text), -20.0) for text, reading in seen])
    told = f"misread {misread:.0%}, surprise {surprise:.2f}"
    if other is None:
        return told
    errors = [character_error(text, other(picture)) for text, picture in words if any(map(str.isalnum, text))]
    return f"{told}; other reader {np.mean(errors):.3f}, words {np.mean(np.array(errors) > 0):.0%}"


def made(hand: ScannedHand, tries: int) -> tuple[Words, int]:
    """The words of the text in a hand, set anew so many times, and how many are doubtful then."""
    text = " ".join(TEXT.split()[:WORDS])
    completed, _ = complete_hand(hand, text, fallback=True, seed=SEED)
    assert isinstance(completed, ScannedHand)
    layout = Layout(page("A4"), x_height=hand.x_height)

    def compose(reader: Proofreader) -> Iterator[Sheet]:
        return each_page(text, completed, layout, np.random.default_rng(SEED), fallback=True, proofread=reader)

    _, doubts, words = reread(compose, completed, hand, tries)
    return [(word.text, word.picture) for word in words], len(doubts)


@contextmanager
def without(part: str) -> Iterator[None]:
    """One part of the writing switched off: "vetting", "new ligatures", or "" for none."""
    with ExitStack() as stack:
        if part == "vetting":
            stack.enter_context(patch("handout.writing.glyph_index.vet", _unvetted))
        elif part == "new ligatures":
            stack.enter_context(patch("handout.writing.joints.Joints._usual", lambda *_: False))
        scanned_words._learnt.cache_clear()
        yield
        scanned_words._learnt.cache_clear()


def _unvetted(hand: ScannedHand) -> Vetting:
    return Vetting(*2 * [np.ones(len(hand.glyphs))])


def main() -> None:
    """Print, of each hand: the author's words, the made ones, those that were read again, and what each part earns."""
    other = other_reader()
    folder = os.environ.get("HANDOUT_HANDS")
    names = [*sorted(library.scanned_files()), *(map(str, sorted(Path(folder).glob("*.hand"))) if folder else ())]
    for name in names:
        hand = library.find(name)
        assert isinstance(hand, ScannedHand)
        print(f"{hand.name}: author's own: {row([(word.text, word.picture) for word in own_words(hand)], other)}")
        for title, tries, part in COLUMNS:
            with without(part):
                words, doubtful = made(hand, tries)
            print(f"  {title}: {row(words, other)}; doubtful {doubtful} of {len(words)}", flush=True)
