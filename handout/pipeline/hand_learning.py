"""Works out of a scanned hand what is asked of it whenever it is written with, and keeps that with the hand."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from handout import atomic
from handout.errors import InputError
from handout.hand import file
from handout.hand.learnt import is_kept, known_values, remember
from handout.hand.scanned import ScannedHand
from handout.values import Array


def learn(path: Path, *, strokes: bool = False) -> Mapping[str, Array]:
    """Work out what is asked of the hand of a file whenever it is written with, and keep it there; what that is.

    strokes : whether those of all its glyphs too, which take some 3 s a page and only drawings ask for.
    """
    with atomic.hold_file(path):
        hand = file.load(path)
        if hand.glyphs:
            file.keep_learnt(path, work_out(hand, strokes=strokes))
    return known_values(hand)


def work_out(hand: ScannedHand, *, strokes: bool) -> Mapping[str, Array]:
    """What is asked of a hand whenever it is written with: of what it keeps, what is out of date is worked out anew.

    strokes : see `learn`.
    """
    from handout.completion.manner import WritingManner
    from handout.hand.measures import ink_colours
    from handout.motion.recovery.letter_forms import HANDS
    from handout.motion.recovery.stroke_order import learn_strokes, stroke_order_model
    from handout.writing.glyph_index import index_glyphs
    from handout.writing.word_layout import layout_model

    index_glyphs(hand)
    layout_model(hand)
    WritingManner(hand)
    ink_colours(hand)
    # the model asks for those that are kept, which stay so
    (learn_strokes if strokes else stroke_order_model)(hand, HANDS)
    return known_values(hand)


def learn_beside(hand: ScannedHand, *, strokes: bool = False) -> None:
    """Where something was worked out of a hand that its file does not keep, work out the rest and keep it beside it.

    Where the folder cannot be written it is worked out with each text.

    strokes : whether those of all its glyphs are asked for, as `learn` has it.
    """
    if file.beside(hand) is None or not hand.glyphs:
        return
    if strokes:
        from handout.motion.recovery.letter_forms import HANDS
        from handout.motion.recovery.stroke_order import learn_strokes

        learn_strokes(hand, HANDS)
    if not is_kept(hand):
        values = dict(work_out(hand, strokes=False))
        remember(hand, values)
        with suppress(InputError):
            file.keep_beside(hand, values)
