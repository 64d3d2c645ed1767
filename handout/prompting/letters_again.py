"""What is to be written again: letters of which a hand has few sure glyphs, and the common pairs that it lacks.

Source: own method; the least number is that of seed 000, §6.2.1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from handout.hand.scanned import ScannedHand
from handout.prompting.coverage import COMMONEST, LEAST
from handout.prompting.sentence_choice import Frequencies, frequencies


def letters_again(sure: Mapping[str, int], wished: str) -> dict[str, float]:
    """Letter → share of `LEAST` sure glyphs that it lacks, of those of `wished` that lack any."""
    letters = dict.fromkeys(char for char in wished if not char.isspace())
    return {letter: 1 - sure.get(letter, 0) / LEAST for letter in letters if sure.get(letter, 0) < LEAST}


def frequencies_again(
    hand: ScannedHand, sure: Mapping[str, int], target: Iterable[str], wished: str
) -> tuple[Frequencies, str]:
    """What sentences for a hand should hold, and the letters that they must.

    A letter counts as much as it lacks; so does a pair, weighed by how common it is in the texts `target`.

    Parameters
    ----------
    sure : letter → how many of its glyphs are sure.
    wished : the characters that the hand should have.
    """
    wanted = frequencies(target)
    # the pairs of letters that stand side by side in the hand's words
    beside = (
        hand.glyphs[glyph.before].letter + glyph.letter for glyph in hand.glyphs if glyph.before >= 0 and glyph.letter
    )
    lacking, found = letters_again(sure, wished), Counter(beside)
    common = sorted(wanted.pairs.items(), key=lambda item: (-item[1], item[0]))[:COMMONEST]
    pairs = {
        pair: share * (1 - found[pair] / LEAST)
        for pair, share in common
        if found[pair] < LEAST and not lacking.keys().isdisjoint(pair)
    }
    # what texts never have is asked for once, among the characters; sentences are chosen for the rest
    letters = {letter: lack for letter, lack in lacking.items() if letter in wanted.letters}
    return Frequencies(letters, pairs), "".join(lacking)
