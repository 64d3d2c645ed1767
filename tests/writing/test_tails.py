"""How much of a ligature a letter keeps where a word ends: as much as the author's words have."""

from dataclasses import replace

import numpy as np

from handout.hand.measures import mean_x_height
from handout.hand.scanned import ScannedHand
from handout.writing.forms import _TURN, ExtractedStrokes, tails


def _joined(small_hand):
    """The ways of the glyphs that are joined to a next letter."""
    return {i: tuple(way.path for way in g.ligatures) for i, g in enumerate(small_hand.glyphs) if g.ligatures}


def _ending(small_hand, ways, whole):
    """The hand with every joined glyph once more, as the end of a word with its own part of the way, or all of it."""
    glyphs = list(small_hand.glyphs)
    for i, paths in ways.items():
        glyph = small_hand.glyphs[i]
        path = np.concatenate(paths)
        kept = path if whole else path[np.isin(path, glyph.vertices)]
        vertices = np.union1d(small_hand.body(i), kept)
        glyphs.append(replace(glyph, vertices=vertices, before=-1, after=-1, ligatures=(), place="end"))
    # those that did end words stay out: only the ends made here tell
    named = [replace(g, letter="") if i < len(small_hand.glyphs) and i not in ways else g for i, g in enumerate(glyphs)]
    return ScannedHand("h", "h", small_hand.pages, tuple(named))


def test_the_share_is_what_word_ends_show(small_hand):
    ways = _joined(small_hand)
    for whole, share in ((False, 0.0), (True, 1.0)):
        hand = _ending(small_hand, ways, whole)
        assert abs(tails(hand, ExtractedStrokes(hand, ways, hand.centres))[1] - share) < 0.15


def test_few_ends_tell_nothing(small_hand):
    ways = _joined(small_hand)
    few = ExtractedStrokes(small_hand, dict(list(ways.items())[:3]), small_hand.centres)
    assert tails(small_hand, few)[1] == 0.0


def test_loose_ways_end_before_the_letter_they_led_to(small_manner):
    for number in range(len(small_manner.forms)):
        form = small_manner.forms[number]
        for way in (*form.exits, *form.entries):
            assert 1 <= way.loose <= len(way)


def test_a_loose_way_does_not_turn_back_to_the_line(small_manner):
    """An exit that came down again would read as a piece of the letter that is not there."""
    most = _TURN * mean_x_height(small_manner.forms.hand) + 1e-9
    for number in range(len(small_manner.forms)):
        form = small_manner.forms[number]
        for way, outward in [(w, w.xy[:, 1]) for w in form.exits] + [(w, -w.xy[::-1, 1]) for w in form.entries]:
            kept = outward[: way.loose]
            if way.loose <= way.owned:
                continue
            assert (np.maximum.accumulate(kept) - kept).max() <= most
