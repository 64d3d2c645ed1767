"""Glyphs set side by side step by step: of a scanned hand as `ScannedHandwriting` does it, and words of a drawn one."""

import numpy as np

from handout.writing import joining
from handout.writing.choosing import GlyphChooser, choices
from handout.writing.compose import handwriting
from handout.writing.drawn_forms import DrawnForms
from handout.writing.variation import Chances


class Forms:
    """The forms that a drawn hand writes words with."""

    def __init__(self, hand, rng):
        self.stock = DrawnForms(hand)
        self.chooser = GlyphChooser(self.stock, rng)

    def word(self, letters):
        return [self.stock.glyphs[number] for number in self.chooser.word(letters).numbers]


def drawn_units(hand, paragraph, seed):
    """The units of one paragraph of pieces."""
    streams = np.random.default_rng(seed), np.random.default_rng(seed + 1)
    writer = handwriting(hand, streams, 1.0)
    (words,) = choices([paragraph], [GlyphChooser(writer.stock, rng) for rng in streams])
    return list(writer.set_paragraph(words))


def gaps(model, numbers, new_word, rng, variation=1.0):
    chances = Chances.draw(rng, len(numbers))
    return model.spacing.between(np.asarray(numbers, dtype=int), np.asarray(new_word, dtype=bool), chances, variation)


def heights(model, numbers, new_word, rng, variation=1.0):
    return model.heights.heights_of(
        np.asarray(numbers), np.asarray(new_word), Chances.draw(rng, len(numbers)), variation
    )


def bent(model, numbers, rng, variation=1.0):
    return model.bends(np.asarray(numbers), Chances.draw(rng, len(numbers)), variation)


def set_line(model, numbers, x, y, new_word, bends):
    forms = [model.forms[int(number)] for number in numbers]
    centres = np.column_stack([x, y])
    joints = model.joints([int(number) for number in numbers], [bool(apart) for apart in new_word])
    return joining.set_line(forms, bends, centres, joints, model.spread.x_height)
