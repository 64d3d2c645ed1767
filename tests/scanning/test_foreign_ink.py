"""Ink of another colour is told by its colour, whatever its darkness; pale marks are told from ink and from paper."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from handout.hand.page_editor import line_alone
from handout.scanning.paper import find_paper
from handout.scanning.scan import Scan
from handout.scanning.written_page import find_ink, foreign_ink, prepare
from handout.values import LineGraph

PAPER = np.array([226, 214, 185])
BROWN, VIOLET = np.array([0.42, 0.30, 0.19]), np.array([0.54, 0.35, 0.60])  # light that ink lets pass
DPI = 300.0


def sheet(*lines, shape=(240, 400), step=0):
    """A sheet with lines: each has its height, light, and width, pixels.

    step : they are rows of slanted strokes, as far apart and as tall as that; 0: they are level.
    """
    light = np.ones((*shape, 3))
    for y, ink, width in lines:
        cover = np.zeros(shape, dtype=np.uint8)
        for x in range(40, shape[1] - 60, step or shape[1]):
            cv2.line(cover, (x, y), (x + step // 2 if step else shape[1] - 40, y - step), 255, width, cv2.LINE_AA)
        light *= 1 - cover[:, :, None] / 255 * (1 - ink)
    return Scan(np.rint(PAPER * light).astype(np.uint8), DPI, "sheet.png")


def level(*heights, width=400):
    """The graph of level lines at some heights."""
    uv = np.array([(x, y) for y in heights for x in range(40, width - 40)], dtype=float)
    n = len(uv) // len(heights)
    first = np.arange(len(uv) - 1)
    edges = np.column_stack([first, first + 1])[(first + 1) % n != 0]
    return LineGraph((uv + 0.5) * 25.4 / DPI, np.full(len(uv), 0.15), np.ones(len(uv)), uv, edges)


@pytest.mark.parametrize("shadow", [0.0, 0.7])
@pytest.mark.parametrize("strength", [0.6, 1.0])
def test_another_ink_is_told_by_its_colour_in_a_shadow_too(strength, shadow):
    pale = 1 - strength * (1 - BROWN)
    scan = sheet((40, BROWN, 5), (90, pale, 3), (140, BROWN, 4), (190, VIOLET, 4))
    light = 1 - shadow / (1 + np.exp(-(np.arange(400) - 250) / 12))
    scan = replace(scan, rgb=np.rint(scan.rgb * light[:, None]).astype(np.uint8))
    foreign = foreign_ink(level(40, 90, 140, 190), scan, find_paper(scan))
    assert foreign.reshape(4, -1).mean(axis=1).round(2).tolist() == [0, 0, 0, 1]


def test_a_line_goes_and_what_crosses_it_stays():
    graph = level(40, 43, 140)
    alone = line_alone(graph, np.repeat([True, False, False], len(graph) // 3), (240, 400), 25.4 / DPI)
    assert alone[38, 200] and not alone[44, 200] and not alone[140, 200]


@pytest.mark.parametrize(("through", "least", "most"), [(0.0, 0.0, 0.01), (0.22, 0.3, 1.5)])
def test_what_shines_through_is_no_ink_and_is_said(through, least, most):
    lines = [(y, BROWN, 5) for y in range(80, 500, 120)]
    behind = [(y, 1 - through * (1 - BROWN), 5) for y in range(140, 500, 120)] if through else []
    inked = find_ink(prepare(sheet(*lines, *behind, shape=(540, 600), step=40)), "fountain")
    assert least <= inked.pale <= most
    assert not inked.mask.ink[95:155].any() and inked.mask.ink[60].any()
