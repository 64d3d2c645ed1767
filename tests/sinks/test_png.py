from __future__ import annotations

import io
import json
import math

import numpy as np
import pytest
from PIL import Image
from sample_drawings import loops

from handout.errors import InputError
from handout.inking import plain
from handout.sinks.png import to_png
from handout.values import Raster


def opened(data: bytes) -> Image.Image:
    return Image.open(io.BytesIO(data))


def test_size_resolution_and_metadata() -> None:
    drawing = loops()
    image = opened(to_png(plain.ink(drawing, 300), about=drawing.about))
    assert image.size == (round(90 * 300 / 25.4), round(40 * 300 / 25.4)) and image.mode == "RGB"
    assert image.info["dpi"] == pytest.approx((300, 300), abs=0.02)
    assert image.info["seed"] == "7" and image.info["hand"] == "house-joined"
    assert json.loads(image.info["about"]) == dict(drawing.about)


def test_pixels_are_the_flattened_raster() -> None:
    raster = plain.ink(loops(), 150)
    assert np.array_equal(np.asarray(opened(to_png(raster))), plain.flatten(raster))
    yellow = np.asarray(opened(to_png(raster, paper=(1.0, 1.0, 0.0))))
    assert yellow[0, 0].tolist() == [255, 255, 0]


def test_transparent() -> None:
    raster = plain.ink(loops(), 150)
    image = opened(to_png(raster, paper=None))
    assert image.mode == "RGBA"
    alpha = np.asarray(image)[..., 3]
    assert alpha[0, 0] == 0 and np.array_equal(alpha, raster.rgba[..., 3])


def test_ink_covers_what_the_pen_went_over() -> None:
    drawing = loops()
    black = plain.shades((0, 0, 0))[plain.coverage(drawing, 300, width=0.3)]
    dark = 1 - np.asarray(opened(to_png(black, 300))) / 255
    area = dark[..., 0].sum() * (25.4 / 300) ** 2
    written = drawing.pen_down * 0.3 + len(drawing.strokes) * math.pi * 0.15**2
    assert 0.75 * written < area < 1.15 * written  # loops cross themselves, and slow parts are wider


def test_palette_gives_the_same_picture_in_fewer_bytes() -> None:
    cover = plain.coverage(loops(), 300)
    palette = plain.shades((0.1, 0.2, 0.3))
    small = to_png(cover, 300, palette=palette)
    large = to_png(palette[cover], 300)
    assert np.array_equal(np.asarray(opened(small).convert("RGB")), np.asarray(opened(large)))
    assert len(small) < 0.8 * len(large)


@pytest.mark.parametrize("shape", [(1, 1, 3), (600, 5, 4), (513, 7, 3), (300, 9)])
def test_any_number_of_rows_comes_back(shape: tuple[int, ...]) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    data = to_png(pixels, 100, about={"hand": "Zoë"})
    assert np.array_equal(np.asarray(opened(data)), pixels) and opened(data).info["hand"] == "Zoë"


def test_same_bytes() -> None:
    drawing = loops()
    first, second = (to_png(plain.ink(drawing, 150), about=drawing.about) for _ in range(2))
    assert first == second


def test_odd_text_is_kept_out_of_trouble() -> None:
    pixels = np.zeros((2, 2, 3), np.uint8)
    image = opened(to_png(pixels, 100, about={"hand": "漢字 \ud800", "seed": 1}))
    assert image.info["hand"] == "漢字 ?"


@pytest.mark.parametrize("shape, kind", [((2, 2, 2), np.uint8), ((2,), np.uint8), ((2, 2, 3), np.float32)])
def test_refuses_other_pixels(shape: tuple[int, ...], kind: type) -> None:
    with pytest.raises(InputError, match="uint8"):
        to_png(np.zeros(shape, kind), 100)


def test_needs_a_resolution() -> None:
    with pytest.raises(InputError, match="dpi"):
        to_png(np.zeros((2, 2, 3), np.uint8))
    tiny = Raster(np.zeros((2, 2, 4), np.float32), 77)
    assert opened(to_png(tiny)).info["dpi"] == pytest.approx((77, 77), abs=0.02)
