"""Which lines stand above pairs."""

from handout.pipeline.study_material import _reference_lines
from handout.study.snippets import Run


def test_lines_of_words_stand_above_pairs_before_rows_of_accents():
    texts = {0: "ùù úú ûû", 1: "the quick brown fox", 2: "1 2 3 …", 3: "jumps over lazy dogs", 4: "ää öö"}
    by_line = {(0, 0, n): [(0, Run(0, n, (n,), text))] for n, text in texts.items()}
    assert {line for _, _, line in _reference_lines([*by_line], by_line, 0)} == {1, 3}
