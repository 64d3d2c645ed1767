from functools import partial

import pytest

from handout.page_sizes import page
from handout.pipeline.inputs import sent_source
from handout.pipeline.options import SheetOptions, WritingOptions
from handout.pipeline.rereading import reread
from handout.pipeline.texts import STROKES, TextDocument, prepare
from handout.pipeline.writing import open_document
from handout.writing.compose import each_page
from handout.writing.kept_text import last_text
from handout.writing.layout import Layout

TYPED = (  # what one types, one after the other: at the end, in the middle, at the beginning, another text, nothing new
    "the men met then the hen\n\n  ten men",
    "the men met then the hen\n\n  ten men met",
    "the men met then the ten\n\n  ten men met",
    "the ten",
    "then met ten men\nten hen\n" * 2,
    "then met ten men\nten hen\n" * 2,
)
FORMULAS = ("it is $a_b$ ten", "it is $a^b$ ten", "it is $a^b$ and $a^b$ ten", "it is $a^b$ and $a^c$ ten men")


def pages_of(text, hand, **options):
    at = options.pop("at", None)
    task = prepare(WritingOptions(hand=hand, seed=4, **options), SheetOptions(page="60x40mm", at=at))
    return TextDocument(text, task).draw(STROKES)


def told(pages):
    """All that is seen of pages, as bytes."""
    strokes = [[(s.xy.tobytes(), s.t.tobytes()) for s in drawing.strokes] for drawing in pages.drawings]
    glyphs = [
        [(p.at, p.word, p.ink and (p.ink.number, p.ink.graph.xy.tobytes())) for line in m.lines for p in line.placed]
        for m in pages.manuscripts
    ]
    return strokes, glyphs, [m.about for m in pages.manuscripts], pages.words()


def check_as_if_new(typed, hand, **options):
    new = []
    for text in typed:
        last_text.cache_clear()
        new.append(told(pages_of(text, hand, **options)))
    last_text.cache_clear()
    assert [told(pages_of(text, hand, **options)) for text in typed] == new


@pytest.mark.parametrize("options", [{}, {"slips": 60.0}, {"rewritten": ((4, 2),)}, {"jitter": 0.0}])
def test_a_text_that_goes_on_is_written_as_if_it_were_new(options):
    check_as_if_new(TYPED, "house-joined", **options)


def test_so_are_formulas_that_have_the_same_letters():
    check_as_if_new(FORMULAS, "house-print")


@pytest.mark.parametrize("options", [{}, {"rewritten": ((4, 2),)}])
def test_so_is_one_in_a_scanned_hand_whose_words_are_read(small_hand, options):
    check_as_if_new(TYPED[:4], small_hand, **options)


def test_what_was_read_of_kept_words_is_told(small_hand):
    layout = Layout(page("100x80mm"))

    def read(text):
        compose = partial(each_page, text, small_hand, layout, [4])
        _, _, words = reread(lambda reader: compose(proofread=reader), small_hand, small_hand)
        return [(word.text, word.at, word.wrong) for word in words]

    new = read(TYPED[1])
    last_text.cache_clear()
    assert len(read(TYPED[0])) < len(read(TYPED[1])) == len(TYPED[1].split())
    assert read(TYPED[1]) == new


def test_what_did_not_change_is_not_set_again(monkeypatch):
    from handout.writing.drawn_words import WordWriter

    set_, word = [], WordWriter.word
    monkeypatch.setattr(WordWriter, "word", lambda *given: (set_.append(given), word(*given))[1])
    last_text.cache_clear()
    pages_of("the men met then", "house-joined")
    pages_of("the men met ten", "house-joined")
    assert len(set_) == 4 + 1


@pytest.mark.parametrize("options", [{}, {"slips": 60.0}])
def test_a_page_by_itself_is_as_among_all(options):
    text = "\n".join(TYPED[:3])
    strokes, glyphs, about, words = told(whole := pages_of(text, "house-joined", **options))
    assert len(strokes) > 2 and whole.number is None
    for at in (0, len(text) // 2, len(text) + 5):
        page = pages_of(text, "house-joined", at=at, **options)
        number = page.number
        assert told(page) == ([strokes[number - 1]], [glyphs[number - 1]], [about[number - 1]],
                              tuple(word for word in words if word["page"] == number))  # fmt: skip
        places = [place for place, *_ in glyphs[number - 1]]
        assert max(places) >= at or number == len(strokes)
        assert number == 1 or max(place for place, *_ in glyphs[number - 2]) < at


def test_one_page_is_all_there_is():
    assert pages_of("the ten", "house-joined", at=3).number is None


LETTERS = (  # typed one after the other: bold, an ink of its own, a hand of its own, a table, a formula
    "# ten hens\n\nthe **men** met\n\nthen the hen met ten men\n\nten",
    "# ten hens\n\nthe **men** met\n\nthen the hen met ten men\n\nten [men]{ink=red} met",
    "# ten hens\n\nthe **men** met\n\nthen [the hen]{hand=house-print} met ten men\n\nten [men]{ink=red} met $a^b$",
    "# ten hens\n\nthe **men** met\n\nthen [the hen]{hand=house-print} met\n\n|ten|hen|\n|--|--|\n|met|men|\n\nten",
)


def letter_pages(text, hand, **options):
    at = options.pop("at", None)
    writing = WritingOptions(hand=hand, seed=4, fallback=True, **options)
    return open_document(sent_source(text, True), writing, SheetOptions(page="60x40mm", at=at)).draw(STROKES)


@pytest.mark.parametrize("options", [{}, {"slips": 60.0}, {"rewritten": ((4, 2),)}])
@pytest.mark.parametrize("hand", ["house-joined", None])
def test_a_letter_file_that_is_typed_on_is_written_as_if_it_were_new(small_hand, hand, options):
    new = []
    for text in LETTERS:
        last_text.cache_clear()
        new.append(told(letter_pages(text, hand or small_hand, **options)))
    last_text.cache_clear()
    assert [told(letter_pages(text, hand or small_hand, **options)) for text in LETTERS] == new


def test_a_page_of_a_letter_file_by_itself_is_as_among_all():
    text = "\n\n".join([*LETTERS[:3], "the men met then the ten hens " * 9])
    strokes, glyphs, about, words = told(letter_pages(text, "house-joined"))
    asked = [0, text.index("\n\nthe **men**"), text.rindex("$a^b$"), len(text) - 150, len(text) + 5]
    numbers = []
    for at in asked:
        page = letter_pages(text, "house-joined", at=at)
        numbers.append(page.number)
        assert told(page) == ([strokes[page.number - 1]], [glyphs[page.number - 1]], [about[page.number - 1]],
                              tuple(word for word in words if word["page"] == page.number))  # fmt: skip
    assert numbers == sorted(numbers) and numbers[0] == 1 and numbers[-1] == len(strokes) > numbers[-2] > numbers[2]
    marked = next(word["page"] for word in words if word["word"].startswith("a"))
    assert abs(numbers[2] - marked) <= 1
    assert letter_pages("the **ten**", "house-joined", at=3).number is None
