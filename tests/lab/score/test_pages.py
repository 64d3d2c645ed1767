"""Reading page images, and the verb that measures them."""

import numpy as np
import pytest
from PIL import Image

from handout.errors import InputError
from handout_lab.score.written_lines import ink, read_page


def test_resolution_and_transparency(tmp_path):
    rgba = np.zeros((100, 200, 4), np.uint8)
    rgba[40:60, 40:60, 3] = 255
    Image.fromarray(rgba).save(tmp_path / "a.png", dpi=(150, 150))
    grey = read_page(tmp_path / "a.png")
    assert grey.shape == (200, 400)
    assert grey[0, 0] == 255 and grey[100, 100] == 0
    assert read_page(tmp_path / "a.png", 300).shape == (100, 200)


def test_not_an_image(tmp_path):
    (tmp_path / "a.png").write_text("no")
    with pytest.raises(InputError, match=r"a\.png"):
        read_page(tmp_path / "a.png")
    with pytest.raises(InputError, match="No such file"):
        read_page(tmp_path / "b.png")


def test_only_writing_is_ink():
    grey = np.full((900, 900), 250, np.uint8)
    grey[100:150, 100:140] = 30  # a letter
    grey[300:302, 50:850] = 30  # a ruling
    grey[200:700, 880:884] = 30  # the frame
    grey[500:503, 500:503] = 30  # dust
    grey[890:900, 300:330] = 30  # at the very edge
    grey[0:60, 400:430] = 30  # a letter that runs over the edge
    mask = ink(grey)
    assert mask.sum() == 50 * 40 + 60 * 30
    assert mask[120, 120] and mask[5, 410]
    assert not ink(np.full((40, 40), 200, np.uint8)).any()


@pytest.mark.slow
def test_a_house_page_repeats_itself_as_little_as_people_do():
    from handout.hand.library import load
    from handout.inking.plain import flatten, ink
    from handout.motion.trace import trace
    from handout.page_sizes import page
    from handout.writing.compose import compose
    from handout.writing.layout import Layout
    from handout_lab.score.repetition import repetition

    text = (
        " ".join(
            f"{a} {b}"
            for a in ("the", "and", "little", "house", "letter")
            for b in ("boat", "sea", "was", "they", "on")
        )
        * 3
    )
    for name in ("house-joined", "house-quick"):
        rng = np.random.default_rng(1)
        hand = load(name)
        (sheet,) = compose(text, hand, Layout(page("A5"), x_height=2.2), rng)
        grey = flatten(ink(trace(sheet, hand, rng), 300)).mean(axis=2).astype(np.uint8)
        assert repetition(grey) <= 0.03, name
