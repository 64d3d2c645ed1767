"""Lines of pages as material for the reader of pictures: what is left out, and what a line looks like."""

from pathlib import Path

import numpy as np
import pytest

from handout.errors import InputError
from handout.scanning.scan import Scan
from handout_lab.training.page_lines import (
    Transcribed,
    kept_apart,
    read_alto,
    shared_phrases,
    usable,
    without_print,
    writer_of,
)
from handout_lab.training.picture_reader import Words, batches, edit_distance

LINE = '<TextLine TAGREFS="{tag}" BASELINE="10 {y} 300 {y}"><String CONTENT="{text}"/></TextLine>'
ALTO = '<alto><Tags><OtherTag ID="T1" LABEL="DefaultLine:Typewritten"/></Tags>{lines}</alto>'


def transcribed(*texts):
    return [Transcribed(text, np.array([[10.0, 100.0 * k], [900.0, 100.0 * k]])) for k, text in enumerate(texts, 1)]


def test_an_alto_file_gives_its_written_lines(tmp_path):
    path = tmp_path / "page.xml"
    some = [("A", 90, "l&#x27;eau est"), ("T1", 190, "typed"), ("A", 290, "imp_wikitexte_0024")]
    path.write_text(ALTO.format(lines="".join(LINE.format(tag=tag, y=y, text=text) for tag, y, text in some)))
    (line,) = read_alto(path)
    assert line.text == "l'eau est" and line.baseline.tolist() == [[10, 90], [300, 90]]
    path.write_text("<alto>")
    with pytest.raises(InputError, match="ALTO"):
        read_alto(path)


def test_every_fourth_writer_is_kept_apart_with_all_pages():
    pages = [Path(f"{batch}_{number:04}_{page}.xml") for number in range(9) for batch, page in (("a", 1), ("b", 2))]
    assert kept_apart([writer_of(page) for page in pages]) == {"0003", "0007"}


def test_what_several_writers_were_given_to_write_is_left_out():
    pages = {
        Path(f"w_{n:04}.jpg"): transcribed("I have read all the terms", f"my own {n} words are here") for n in range(4)
    }
    shared = shared_phrases(pages)
    assert not usable("I have read all the terms", shared)
    assert usable("my own 3 words are here", shared)
    assert shared_phrases(dict(list(pages.items())[:3])) == set()


@pytest.mark.parametrize("text", [">struck< out", "what is 田 here", "a -", "#gone"])
def test_lines_that_are_not_read_whole_are_left_out(text):
    assert not usable(text, set())


def test_print_is_taken_away_and_writing_stays():
    rgb = np.full((600, 1000, 3), 250, np.uint8)
    rgb[300:304] = 90  # a rule
    rgb[250:340, 400:408] = 60  # a stroke that crosses it
    rgb[450:460, 100:300] = 60  # print at the foot of the page
    lines = transcribed("one", "two", "three")
    left = without_print(Scan(rgb, 300.0), lines).rgb[..., 0] < 128
    assert not left[440:].any() and not left[300:304, :390].any()
    assert left[250:340, 402:406].all()


def test_batches_have_so_many_columns_and_every_picture_once():
    widths = np.random.default_rng(0).integers(10, 900, 200)
    words = Words(np.zeros((40, widths.sum()), np.uint8), np.cumsum(widths), ("a",) * 200, ("b",) * 200)
    groups = list(batches(words, 4000, np.random.default_rng(1)))
    assert sorted(np.concatenate(groups).tolist()) == list(range(200))
    assert all(widths[group].sum() + 16 * len(group) < 4000 + 916 for group in groups)


@pytest.mark.parametrize(
    ("one", "other", "count"), [("", "abc", 3), ("abc", "abc", 0), ("kitten", "sitting", 3), ("a", "", 1)]
)
def test_edits_are_counted(one, other, count):
    assert edit_distance(one, other) == count
