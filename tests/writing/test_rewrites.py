"""Words that are written again while all others of their text stay as they are."""

import numpy as np
import pytest

from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.texts import TextDocument, prepare
from handout.writing import scanned_words

TEXT = "ten hens\nin an even line"


def words(hand, rewritten=()):
    """Of each word the form of its glyphs, wherever they stand, and of scanned ones their numbers."""
    task = prepare(WritingOptions(hand, 4, rewritten=rewritten), SheetOptions("120x60mm", "5mm"))
    (sheet,) = TextDocument(TEXT, task).set_pages()[1]
    found = {}
    for line in sheet.manuscript.lines:
        for placed in line.placed:
            if placed.ink is not None:
                form = [placed.ink.number, *np.ptp(placed.ink.graph.xy[:, :1], axis=0)]
            else:  # across the line, since lines rise and sag along their way
                form = np.concatenate([np.diff(stroke[:, 0]) for stroke in placed.strokes])
            found.setdefault(placed.word, []).append((placed.glyph.letter, form))
    spelt = ["".join(letter for letter, _ in word) for word in found.values()]
    return spelt, [np.concatenate([form for _, form in word]) for word in found.values()]


def others(before, after):
    """The words that are not as they were."""
    pairs = enumerate(zip(before, after, strict=True))
    return [k for k, (one, other) in pairs if len(one) != len(other) or not np.allclose(one, other, atol=1e-9)]


@pytest.mark.parametrize("scanned", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_word_is_written_again_and_all_others_stay(request, scanned):
    hand = request.getfixturevalue("small_hand") if scanned else "house-joined"
    spelt, before = words(hand)
    assert spelt == ["ten", "hens", "in", "an", "even", "line"]
    at = TEXT.index("even")
    once, twice = (words(hand, ((at, times),))[1] for times in (1, 2))
    assert others(before, once) == others(before, twice) == others(once, twice) == [4]
    assert others(words(hand, ((at, 2),))[1], twice) == []


def test_of_a_place_where_no_word_begins_nothing_changes():
    assert others(words("house-joined", ((1, 1), (900, 3)))[1], words("house-joined")[1]) == []


def test_a_job_keeps_what_was_written_again():
    from handout.pipeline.job_pages import inputs

    writing = WritingOptions(seed=4, rewritten=((3, 1),))
    kept = inputs(TEXT, prepare(writing), writing, SheetOptions(), "A4")
    assert kept["options"]["rewritten"] == ((3, 1),)


@pytest.mark.parametrize("scanned", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_what_is_added_or_changed_leaves_all_else_as_it_was(request, scanned):
    """What a page shows while its text is typed: only the lines that changed are others.

    The seed is one at which no letter of the line behind would have been a glyph of the new word.
    """
    hand = request.getfixturevalue("small_hand") if scanned else "house-joined"

    def lines(text):
        (sheet,) = TextDocument(text, prepare(WritingOptions(hand, 11), SheetOptions("120x90mm", "5mm"))).set_pages()[1]
        return [list(line.placed) for line in sheet.manuscript.lines]

    def places(line):
        return [placed.ink.graph.xy if placed.ink else np.concatenate(placed.strokes) for placed in line]

    def glyphs(line):
        return [placed.ink.number if placed.ink else len(placed.strokes[0]) for placed in line]

    def same(one, other):
        return len(one) == len(other) and all(map(np.array_equal, places(one), places(other)))

    before, longer = lines(TEXT + "\nten hens in"), lines(TEXT + "\nten hens in an inn\nand on\nit\nsent")
    assert [same(*pair) for pair in zip(before, longer, strict=False)] == [True, True, False]
    # of scanned letters those before a new one are raised a little with it, so that joins hold
    unmoved = glyphs if scanned else places
    assert all(map(np.array_equal, unmoved(before[2][:5]), unmoved(longer[2]))), "nor are the first words of that line"
    changed = lines(TEXT.replace("even", "open") + "\nten hens in")
    assert same(before[0], changed[0]) and all(map(np.array_equal, unmoved(before[1][:4]), unmoved(changed[1])))
    assert glyphs(before[2]) == glyphs(changed[2])


LETTER = """+++
page = "A6"
+++
# Hello

The [red]{ink=red} jam and [more]{hand=house-print} jam.

- the [jam]{hand=house-print}
"""


def test_words_of_a_letter_are_told_and_written_again_in_each_of_its_hands(tmp_path):
    from handout.pipeline.options import PictureOptions
    from handout.pipeline.writing import write_sent

    def words(*rewritten):
        options = WritingOptions(seed=3, rewritten=rewritten), SheetOptions(), PictureOptions()
        return write_sent(LETTER, True, [tmp_path / "page.svg"], options).facts()["words"]

    before = words()
    spelt = [word["word"] for word in before]
    assert spelt == ["Hello", "The", "red", "jam", "and", "jam.", "the", "more", "jam"]
    assert len({word["at"] for word in before}) == len(before)
    for number in (5, 8):  # ends of lines: what comes behind a word on its line goes along with it
        changed = words((before[number]["at"], 1))
        assert [k for k, (one, other) in enumerate(zip(before, changed, strict=True)) if one != other] == [number]


@pytest.mark.slow
def test_what_is_typed_on_is_the_text_written_at_once(small_hand):
    """Paragraphs that stay are not set and read anew."""

    def page(text):
        (sheet,) = TextDocument(
            text, prepare(WritingOptions(small_hand, 4), SheetOptions("120x60mm", "5mm"))
        ).set_pages()[1]
        return np.concatenate([placed.ink.graph.xy for line in sheet.manuscript.lines for placed in line.placed])

    scanned_words._learnt.cache_clear()
    page(TEXT)
    before = scanned_words._learnt(small_hand)[2]
    first = next(iter(before.paragraphs.values()))
    typed = page(TEXT + "n")
    assert any(units is first for units in before.paragraphs.values())
    scanned_words._learnt.cache_clear()
    assert np.array_equal(typed, page(TEXT + "n"))
