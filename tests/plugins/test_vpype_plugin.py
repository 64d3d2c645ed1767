"""handout in vpype: its command in a pipeline, and drawings to and fro."""

import numpy as np
import pytest

vpype = pytest.importorskip("vpype")
vpype_cli = pytest.importorskip("vpype_cli")

from click.testing import CliRunner  # noqa: E402

from handout.errors import InputError  # noqa: E402
from handout.plugins import vpype_  # noqa: E402
from handout.sources import read_drawing  # noqa: E402
from handout.values import Drawing, Page, Stroke  # noqa: E402

PX = 25.4 / 96


@pytest.fixture(scope="module", autouse=True)
def plugged():
    """The command as the entry point adds it, in case that this is not the installed handout."""
    vpype_cli.cli.add_command(vpype_.command)


def test_a_pipeline_writes(tmp_path):
    arguments = ["handout", "Dear Ada", "--hand", "house-print", "--page", "A6", "--seed", "3", "--fit"]
    done = CliRunner().invoke(vpype_cli.cli, [*arguments, "linesort", "write", str(tmp_path / "out.svg")])
    assert done.exit_code == 0, done.output
    drawing = read_drawing(tmp_path / "out.svg")
    assert (drawing.page.width, drawing.page.height) == pytest.approx((105, 148), abs=0.1)
    assert len(drawing.strokes) > 6 and not drawing.timed


def test_options_may_stand_before_and_after_the_text_and_the_page_be_that_of_the_pipeline():
    document = vpype_cli.execute("pagesize 60mmx100mm handout -l 4 --seed 1 'Ada' --x-height 4mm")
    assert list(document.layers) == [4]
    assert document.page_size == pytest.approx((60 / PX, 100 / PX))


def test_what_cannot_be_written_is_said_in_a_sentence():
    done = CliRunner().invoke(vpype_cli.cli, ["handout", "\u4e2d"])
    assert done.exit_code != 0 and "has no form for" in done.output and "Traceback" not in done.output


def test_a_drawing_there_and_back():
    angle = np.linspace(0, 6, 400)
    spiral = np.column_stack([50 + 5 * angle * np.cos(angle), 50 + 5 * angle * np.sin(angle)])
    strokes = (
        Stroke(np.arange(400.0), spiral, layer="snail", colour="#c01020"),
        Stroke([0.0, 1.0], [[1, 2], [9, 2]], layer="frame"),
        Stroke([0.0], [[5, 5]], layer="frame"),
    )
    document = vpype.Document()
    vpype_.add(Drawing(strokes, Page(100, 90)), document)
    back = vpype_.from_document(document)
    assert (back.page.width, back.page.height) == pytest.approx((100, 90))
    assert [(s.layer, s.colour) for s in back.strokes] == [("snail", "#c01020"), ("frame", ""), ("frame", "")]
    assert back.strokes[1].xy[[0, -1]] == pytest.approx(strokes[1].xy) and back.strokes[2].length < 0.01
    assert len(back.strokes[0].t) < 400 and back.strokes[0].length == pytest.approx(strokes[0].length, rel=1e-3)
    assert not back.timed


def test_an_empty_document_is_refused():
    with pytest.raises(InputError, match="no lines"):
        vpype_.from_document(vpype.Document())
