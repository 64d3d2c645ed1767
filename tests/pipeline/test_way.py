"""The way of a text through the program, from the first line of `write` to the first ink or motion, can be followed.

Functions are taken in the order in which they are first called, each once, comprehensions and lambdas as parts of the
function that has them.  A *stay* is a stretch of that order in one file; a *return* is a stay in a file that was left
before, so that returns = stays − files.  Ink begins in `inking.pens` or `inking.pen_replacement`, motion in
`motion.trace`; the checks of a pen and a paper before are on the way.

`python tests/pipeline/test_way.py HAND` prints the way in a hand.
"""

import sys
from itertools import groupby
from pathlib import Path

import pytest

import handout

PACKAGE = Path(handout.__file__).resolve().parent
ENDS = {"inking/pens.py", "inking/pen_replacement.py", "motion/trace.py"}
OPTIMISED = 0x2  # the code flag that functions have, and bodies of modules and classes have not


def way(hand: str, folder: Path) -> list[tuple[str, str]]:
    """(file, function) in the order of first calls, while a text is written in a hand."""
    from handout.pipeline.writing import WritingOptions, write

    called = dict[object, tuple[str, str]]()

    def heard(frame, event, _):
        code = frame.f_code
        function = code.co_flags & OPTIMISED and code.co_name[0] != "<"
        if event == "call" and function and code.co_filename.startswith(f"{PACKAGE}/"):
            called.setdefault(code, (str(Path(code.co_filename).relative_to(PACKAGE)), code.co_name))

    sys.setprofile(heard)
    try:
        write("The quick brown fox\njumps over the lazy dog", [folder / "a.svg"], WritingOptions(hand=hand, seed=1))
    finally:
        sys.setprofile(None)
    calls = list(called.values())
    return calls[: next(k for k, (file, _) in enumerate(calls) if file in ENDS)]


def stays(calls: list[tuple[str, str]]) -> list[tuple[str, list[str]]]:
    return [(file, [name for _, name in group]) for file, group in groupby(calls, key=lambda call: call[0])]


def test_stays_are_counted():
    assert stays([("a", "f"), ("a", "g"), ("b", "h"), ("a", "i")]) == [("a", ["f", "g"]), ("b", ["h"]), ("a", ["i"])]


@pytest.mark.parametrize(("hand", "files", "returns"), [("house-joined", 28, 40)])
def test_the_way_of_a_text_is_no_longer_than_it_was(hand, files, returns, tmp_path):
    way(hand, tmp_path)  # what is worked out once for a hand is no part of the way of the next text
    found = stays(way(hand, tmp_path))
    seen = {file for file, _ in found}
    assert len(seen) <= files and len(found) - len(seen) <= returns


if __name__ == "__main__":
    import tempfile

    found = stays(way(sys.argv[1], Path(tempfile.mkdtemp())))
    for file, names in found:
        print(f"{file:32} {', '.join(names)}")
    print(f"{len(found)} stays in {len({file for file, _ in found})} files")
