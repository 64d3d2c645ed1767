"""Pages that handout itself wrote are aligned with their transcripts, as they are and with what goes wrong."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from handout.alphabet import SPACE
from handout.errors import InputError
from handout.hand import library
from handout.tagging import alignment, network, segmentation
from handout.tagging.alignment import align_strips
from handout.tagging.decoder import decode
from handout.tagging.line_space import X_HEIGHT, LineFrame, LineStrip
from handout.tagging.segmentation import Adaptation, PageReader, by_segments, by_segments_once, confidence
from handout.tagging.synthetic_lines import WriterHabits, write_lines
from handout.tagging.transcript import read_transcript

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow

PLAIN = WriterHabits(
    tight=0.05, gap=1.2, slur=0.0, swash=0.0, tail=0.0, breadth=1.0, size=1.0, shear=0.0, rise=0.0, ascender=1.0,
    descender=1.0, wobble=0.02, pen=0.1, haste=1.0,
)  # fmt: skip
TEXT = (
    "The harbour master keeps two grey cats, and neither of them will come when he calls. Yesterday, at half past "
    'three, both sat on his desk among the charts; one had a herring. "Out!" he said, but quietly. Nobody moved, '
    "except the clock above the door, which has been six minutes fast since 1987."
)


@lru_cache(maxsize=4)
def page(name: str = "house-joined", seed: int = 2):
    """Strips, the text of each line, and where its letters are."""
    made = write_lines(TEXT, library.load(name), PLAIN, np.random.default_rng(seed))
    strips = [LineStrip(one.image, LineFrame((float(100 * i),), float(X_HEIGHT))) for i, one in enumerate(made)]
    rest, texts = TEXT.split(" "), []
    for one in made:
        letters = "".join(span.letter for span in one.spans)
        words: list[str] = []
        while len("".join(words)) < len(letters):
            words.append(rest.pop(0))
        texts.append(" ".join(words))
    assert not rest
    return strips, texts, [one.spans for one in made]


def right(alignment, spans) -> float:
    """Share of letters whose ends are within a third of their width, or 3 pixels, of where they are."""
    good = total = 0
    for line in alignment.lines:
        for letter, span in zip(line.letters, spans[line.number], strict=True):
            off = max(abs(letter.left - span.left), abs(letter.right - span.right))
            good += off <= max((span.right - span.left) / 2, 5.0)
            total += 1
    return good / total


@pytest.fixture(scope="module")
def aligned():
    strips, texts, _ = page()
    with pytest.MonkeyPatch.context() as less:  # of what takes time
        less.setattr(segmentation, "_ADAPTATION", Adaptation(rehearsed=8, copies=2))
        two = network.load_networks()[:2]
        return align_strips(strips, "\n".join(texts), rng=np.random.default_rng(1), networks=two)


def test_nearly_every_letter_is_found(aligned):
    assert right(aligned, page()[2]) > 0.93
    assert not aligned.poor and min(line.fit for line in aligned.lines) > 0.5


def test_letters_know_their_place_in_the_text(aligned):
    text = "\n".join(page()[1])
    assert all(text[letter.at] == letter.text for letter in aligned.letters)
    assert len(aligned.letters) == sum(not c.isspace() for c in text)
    assert [line.text for line in aligned.lines] == [line.replace(" ", "") for line in page()[1]]


def test_most_letters_are_sure_and_the_list_of_doubt_begins_with_the_worst(aligned):
    sure = [letter.confidence for letter in aligned.letters]
    assert np.median(sure) > 0.7 and min(sure) >= 0 and max(sure) <= 1
    doubt = [letter.confidence for letter in aligned.doubtful]
    assert doubt == sorted(doubt) and len(doubt) < 0.2 * len(sure)


def test_the_same_generator_gives_the_same_alignment(monkeypatch):
    monkeypatch.setattr(segmentation, "_ADAPTATION", Adaptation(rehearsed=2, copies=1))
    strips, texts, _ = page()
    some, two = (strips[:1], texts[0]), network.load_networks()[:2]
    first, second = (align_strips(*some, rng=np.random.default_rng(5), networks=two) for _ in range(2))
    assert first == second


def test_line_breaks_that_differ_from_the_page_are_found():
    strips, texts, _ = page()
    some = PageReader([strip.image for strip in strips], network.load_networks())
    readings = [some.reading(i) for i in range(len(strips))]
    lines = read_transcript(TEXT)
    widths = some.widths(read_transcript("\n".join(texts)))
    parts = alignment.broken_freely(readings, lines, widths)
    assert [part.text for part in parts] == texts


@pytest.mark.parametrize("bare", [(0,), (2,), (0, 1), (-1,)])
def test_lines_that_are_not_in_the_text_are_left_without_any(bare):
    strips, texts, _ = page()
    want = ["" if i - len(texts) in bare or i in bare else text for i, text in enumerate(texts)]
    lines = read_transcript(" ".join(text for text in want if text))
    some = PageReader([strip.image for strip in strips], network.load_networks())
    found, fits = alignment.assigned_to_lines(some, lines, np.random.default_rng(1))
    assert [part.text for part in found] == want
    assert all((fit > 0.3) == bool(text) for fit, text in zip(fits, want, strict=True))


def test_the_transcript_of_another_page_is_refused():
    strips, _, _ = page()
    other = "Dear Aunt Ruth,\nThank you for the parcel, which\narrived on Monday with the plums\nunharmed and sweet."
    with pytest.raises(InputError, match="does not seem to be this page's"):
        align_strips(strips, other, rng=np.random.default_rng(1))


def test_a_line_of_wrong_text_is_named():
    strips, texts, _ = page()
    wrong = [*texts[:1], "quite other words stand here, surely", *texts[2:]]
    found = align_strips(strips, "\n".join(wrong), method=by_segments_once, rng=np.random.default_rng(1))
    assert found.poor == (1,)


@pytest.mark.slow
def test_words_that_page_and_text_do_not_share_are_named():
    strips, texts, _ = page()

    def odd(*lines):
        found = align_strips(strips, "\n".join(lines), method=by_segments_once, rng=np.random.default_rng(1))
        return [(one.line, one.word, one.more) for one in found.odd]

    assert odd(*texts) == []
    words = texts[1].split()
    longest = max(range(1, len(words) - 1), key=lambda k: len(words[k]))
    without, added = [*words[:longest], *words[longest + 1 :]], [*words[:longest], "garden", *words[longest:]]
    ((line, _, more),) = odd(texts[0], " ".join(without), *texts[2:])
    assert (line, more) == (1, True)
    assert odd(texts[0], " ".join(added), *texts[2:]) == [(1, "garden", False)]


def test_small_slips_cost_only_themselves():
    strips, texts, spans = page()
    slip = [texts[0].replace("master", "mastter"), texts[1] + "!", *texts[2:]]
    some = PageReader([strip.image for strip in strips], network.load_networks())
    widths = some.widths(read_transcript("\n".join(texts)))
    for number, (text, true) in enumerate(zip(slip, texts, strict=True)):
        (line,) = read_transcript(text)
        found = decode(some.reading(number), line.letters, widths)
        k = next((i for i, (a, b) in enumerate(zip(text, true, strict=False)) if a != b), len(true))
        keep = [i for i, letter in enumerate(line.letters) if letter != SPACE and not k - 2 <= i <= k + 2]
        want = dict(zip([i for i, c in enumerate(true) if c != SPACE], spans[number], strict=True))
        off = [abs(found.left[i] - want[i if i < k else i - (len(text) - len(true))].left) for i in keep]
        assert np.mean(np.array(off) < 8) > 0.85


def test_what_cannot_be_aligned_is_said():
    with pytest.raises(InputError, match="No lines"):
        align_strips([], "text", rng=np.random.default_rng(0))


def test_decodings_that_agree_are_sure():
    strips, texts, _ = page()
    some = PageReader([strips[0].image], network.load_networks())
    lines = read_transcript(texts[0])
    one = decode(some.reading(0), lines[0].letters, some.widths(lines))
    away = replace(one, left=one.left + 9, right=one.right + 9)
    assert confidence([one, one, one]) == pytest.approx(np.ones(len(one.left)))
    assert confidence([away, one]).max() < 0.5
    assert (confidence([away, one, one]) > confidence([away, one])).all()


def test_what_is_compared_for_confidence_is_every_network_alone(monkeypatch):
    monkeypatch.setattr(segmentation, "_ADAPTATION", Adaptation(rehearsed=2, copies=1))
    strips, texts, _ = page()
    nets = network.load_networks()[:2]
    some = PageReader([strip.image for strip in strips[:2]], nets)
    lines = read_transcript("\n".join(texts[:2]))
    once = by_segments(some, lines, np.random.default_rng(1), adapting=False)
    assert [len(each) for each in once] == [3, 3]
    alone = decode(some.readings(0, [nets[1]])[0], lines[0].letters, some.widths(lines))
    assert np.array_equal(once[0][1].left, alone.left)
    both = by_segments(some, lines, np.random.default_rng(1))
    assert [len(each) for each in both] == [5, 5]
    assert np.array_equal(both[0][1].left, alone.left)
    single = PageReader([strips[0].image], nets[:1])
    assert len(by_segments(single, lines[:1], np.random.default_rng(1), adapting=False)[0]) == 1
