"""What was taken as a formula is said, in words and in the JSON."""

import json

import pytest

LETTER = "+++\n+++\n\nSee $x^2$ *here*.\n"


@pytest.mark.parametrize("source", ["text", "letter"])
def test_formulas_are_told(call, tmp_path, source):
    (tmp_path / "l.md").write_text(LETTER)
    text = [r"$x^2$ and $\frac{a}{b}$"] if source == "text" else [str(tmp_path / "l.md")]
    out, err = call("write", *text, "-o", "a.svg", "--seed", 1, "--json")
    assert json.loads(out)["formulas"] == (["$x^2$", r"$\frac{a}{b}$"] if source == "text" else ["$x^2$"])
    _, err = call("write", *text, "-o", "a.svg", "--seed", 1)
    more = "2 formulas, the first $x^2$" if source == "text" else "a formula: $x^2$"
    assert f"Taken as {more}; \\$ is the sign." in err


def test_a_text_without_formulas_tells_of_none(call):
    out, err = call("write", "It costs $5 and $6.", "-o", "a.svg", "--seed", 1, "--json")
    assert "formulas" not in json.loads(out) and "formula" not in err
