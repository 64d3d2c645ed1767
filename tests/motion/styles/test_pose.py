"""What a pen recorded goes through a handstyle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handout.motion.styles import targets
from handout.motion.styles.restyling import losses, restyle
from handout.motion.styles.style import find
from handout.values import POSE, Drawing, Page, Stroke


def recorded(xy: np.ndarray, **more: float) -> Stroke:
    """A stroke whose channels change evenly along its length, azimuth past the turn of the circle."""
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    share = run / run[-1]
    turned = np.arctan2(np.sin(2.9 + 0.6 * share), np.cos(2.9 + 0.6 * share))
    pose = {"pressure": 0.2 + 0.6 * share, "tilt": 0.5 + 0.2 * share, "azimuth": turned, "rotation": 0.3 * share}
    return Stroke(np.linspace(0, 1, len(xy)), xy, **pose, **more)


def word(left: float = 20.0) -> Stroke:
    """Waves as of a joined word, 4 mm high with two ascenders."""
    x = np.linspace(0, 40, 400)
    high = np.where((x > 10) & (x < 15) | (x > 25) & (x < 30), 3.0, 1.0)
    return recorded(np.column_stack([left + x, 30 - 2 * high * np.sin(2 * np.pi * x / 5) - 2 * high]))


@pytest.mark.parametrize("name", ["fast-tag", "calm", "scrawl", "blackletter", "chancery"])
def test_every_channel_goes_through_a_style(name: str) -> None:
    drawing = Drawing((word(),), Page(100, 60))
    made = restyle(drawing, find(name), np.random.default_rng(1))
    (stroke,) = made.strokes
    assert set(stroke.pose) == set(POSE)
    share = np.linspace(0, 1, len(stroke.t))
    assert np.abs(stroke.pressure - (0.2 + 0.6 * share)).max() < 0.12
    assert np.abs(stroke.tilt - (0.5 + 0.2 * share)).max() < 0.05
    assert np.abs(np.exp(1j * stroke.azimuth) - np.exp(1j * (2.9 + 0.6 * share))).max() < 0.15
    said = losses(drawing, made, find(name))
    assert [("rotation" in one) for one in said] == ([True] if stroke.nib else [])


def test_a_channel_that_not_all_strokes_have_is_said_to_be_left_out() -> None:
    bare = replace(word(), pressure=None, xy=word(40).xy)
    drawing = Drawing((word(), replace(bare, t=bare.t + 2)), Page(100, 80))
    made = restyle(drawing, find("calm"), np.random.default_rng(1))
    assert any("pressure" in one for one in losses(drawing, made, find("calm")))


def test_a_joined_word_has_the_letters_of_its_turns_not_of_its_box() -> None:
    drawing = Drawing((word(),), Page(100, 60))
    assert np.ptp(word().xy[:, 1]) > 11
    assert targets.letter_height(drawing) == pytest.approx(6.0, rel=0.2)
    known = Drawing((word(),), Page(100, 60), {"x_height": 3.0})
    assert targets.letter_height(known) == pytest.approx(4.5)


def test_letters_that_are_rounded_away_are_told() -> None:
    import msgspec

    drawing, calm = Drawing((word(),), Page(100, 60)), find("calm")
    smooth = msgspec.structs.replace(calm, movement=msgspec.structs.replace(calm.movement, smooth=0.9))
    assert not losses(drawing, restyle(drawing, calm, np.random.default_rng(1)), calm)
    (said,) = losses(drawing, restyle(drawing, smooth, np.random.default_rng(1)), smooth)
    assert "smooth = 0.9" in said and "0.38 keeps" in said
