from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from handout.errors import InputError
from handout.inking.papers import Paper, place_lines, sheet
from handout.values import Page

PAGE = Page(60, 80)


def made(name: str, dpi: float = 300, pitch: float | None = None, seed: int = 1) -> np.ndarray:
    found = sheet(Paper(name, pitch), PAGE, dpi, np.random.default_rng(seed))
    assert found is not None and found.dtype == np.uint8
    assert found.shape == (round(80 * dpi / 25.4), round(60 * dpi / 25.4), 3)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "mean"),
    [
        ("plain", (250.4, 249.4, 245.3)),
        # the wires take away half of their depth; the lines 0.18 mm in every 8, and twice 0.18 in every 5
        ("laid", (244.7, 240.9, 230.7)),
        ("ruled", (247.8, 248.5, 246.6)),
        ("squared", (243.0, 245.2, 245.0)),
    ],
)
def test_mean_colours(name: str, mean: tuple[float, float, float]) -> None:
    for dpi in (150, 300):
        assert made(name, dpi).mean(axis=(0, 1)) == pytest.approx(mean, abs=1.0)


def test_tooth_is_slight_and_follows_the_seed() -> None:
    paper = made("plain")
    assert 0.5 < paper[..., 1].std() < 1.5
    assert np.array_equal(paper, made("plain")) and not np.array_equal(paper, made("plain", seed=2))


def test_lines_lie_a_pitch_apart() -> None:
    red = made("ruled", 508, pitch=10).mean(axis=1)[:, 0]
    dark = np.flatnonzero(red < red.max() - 40)
    first = dark[np.r_[True, np.diff(dark) > 1]]
    assert np.allclose(first / 20, [10 * k - 0.09 for k in range(1, 9)], atol=0.06)
    columns = made("squared", 508).mean(axis=0)[:, 0]
    assert ((columns[1:] < 200) & (columns[:-1] >= 200)).sum() == 12
    assert made("ruled", 508).mean(axis=0)[:, 0].std() < 0.5


def test_laid_lines_can_be_seen_but_only_just() -> None:
    rows = made("laid").mean(axis=(1, 2))
    assert 1 < np.ptp(rows) < 6
    found = np.abs(np.fft.rfft(rows - rows.mean()))
    assert pytest.approx(found.argmax(), abs=1.5) == (80 / 0.525)


def test_a_picture_fills_the_page(tmp_path: Path) -> None:
    file = tmp_path / "sheet.png"
    Image.new("RGB", (150, 200), (200, 180, 90)).save(file)
    assert (made(str(file), 100) == (200, 180, 90)).all()


def test_no_paper_and_no_such_paper(tmp_path: Path) -> None:
    assert sheet(Paper(), PAGE, 300, np.random.default_rng(1)) is None
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"not a picture")
    for name in (str(broken), "vellum"):
        with pytest.raises(InputError, match="nor one of none, plain"):
            made(name)
    with pytest.raises(InputError, match="2 to 100 mm"):
        Paper("ruled", 0.5)


def test_lines_lie_under_the_writing() -> None:
    about = {"baseline": 14.2, "line_spacing": 7.5}
    assert place_lines(Paper("ruled"), about) == Paper("ruled", 7.5, 14.2)
    assert place_lines(Paper("ruled", 9.0), about) == Paper("ruled", 9.0, 14.2)
    assert place_lines(Paper("squared"), about) == Paper("squared", None, 14.2)
    assert place_lines(Paper("ruled"), {}) == Paper("ruled")
    found = sheet(place_lines(Paper("ruled"), about), PAGE, 508, np.random.default_rng(1))
    assert found is not None
    red = found.mean(axis=1)[:, 0]
    dark = np.flatnonzero(red < red.max() - 40) / 20
    assert dark.min() == pytest.approx(14.2, abs=0.15) and np.allclose((dark - 14.2 + 3) % 7.5 - 3, 0, atol=0.15)
