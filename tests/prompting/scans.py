"""Scans for tests: what a PDF page holds, drawn without any PDF reader, and laid on a scanner in known ways."""

import io

import cv2
import numpy as np
import pikepdf

FINE = 300.0  # dpi of the drawn page; a bound of a cell lies on no pixel, and the worst error allows for that


def drawn(pdf: bytes, number: int) -> np.ndarray:
    """Grey page at 300 dpi: filled rectangles black, lines pale; letters are left out."""
    with pikepdf.open(io.BytesIO(pdf)) as document:
        page = document.pages[number]
        width, height = (float(side) for side in page.MediaBox[2:])
        scale = FINE / 72
        image = np.full((round(height * scale), round(width * scale)), 255, dtype=np.uint8)
        start, cells = (0.0, 0.0), np.zeros(6)
        for operands, operator in pikepdf.parse_content_stream(page):
            numbers = [float(x) for x in operands if not isinstance(x, pikepdf.Name | pikepdf.Array | pikepdf.String)]
            if str(operator) == "cm":
                cells = np.array(numbers)
            elif str(operator) == "re":
                x, y, w, h = numbers  # in cells, y down
                left, right = (round((cells[4] + cells[0] * at) * scale) for at in (x, x + w))
                top, foot = (round((height - cells[5] - cells[3] * at) * scale) for at in (y, y + h))
                image[top:foot, left:right] = 0
            elif str(operator) == "m":
                start = tuple(numbers)
            elif str(operator) == "l":
                y = round((height - start[1]) * scale)
                image[y - 1 : y + 2, round(start[0] * scale) : round(numbers[0] * scale)] = 225
    return image


def scanned(page, dpi, *, angle=0.0, perspective=0.0, blur=0.5, noise=4.0, shadow=0.0, stretch=1.0, seed=0):
    """A scan of a drawn page, turned by some degrees, and the true matrix from mm to its pixels."""
    turn, scale = np.deg2rad(angle), dpi / 25.4
    cos, sin = np.cos(turn), np.sin(turn)
    truth = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ np.diag([scale, scale * stretch, 1.0])
    truth = truth @ np.array([[1, 0, 0], [0, 1, 0], [0.7 * perspective / 300, perspective / 300, 1]])
    fine = 25.4 / FINE
    corners = np.array([[x, y] for x in (0, page.shape[1] * fine) for y in (0, page.shape[0] * fine)])
    at = corners @ truth[:, :2].T + truth[:, 2]
    at = at[:, :2] / at[:, 2:]
    low, high = at.min(axis=0) - 4 * scale, at.max(axis=0) + 4 * scale
    truth = np.array([[1, 0, -low[0]], [0, 1, -low[1]], [0, 0, 1]]) @ truth
    to_mm = np.array([[fine, 0, fine / 2], [0, fine, fine / 2], [0, 0, 1]])
    smooth = cv2.GaussianBlur(page, (0, 0), 0.5 * FINE / dpi) if dpi < FINE else page
    size = tuple(np.ceil(high - low).astype(int).tolist())
    image = cv2.warpPerspective(smooth, truth @ to_mm, size, flags=cv2.INTER_LINEAR, borderValue=190)
    image = cv2.GaussianBlur(image, (0, 0), blur)
    if shadow:
        fall = np.linspace(0, 1, size[0], dtype=np.float32) + np.linspace(0, 1, size[1], dtype=np.float32)[:, None]
        image = (image * (1 - shadow * np.clip(1.6 * fall - 1, 0, 1))).astype(np.uint8)
    cv2.setRNGSeed(seed)
    grain = cv2.randn(np.empty(image.shape, dtype=np.int16), 0, noise)
    return cv2.add(image, grain, dtype=cv2.CV_8U), truth


def carried(matrix, points):
    """Points (n, 2) under a homography."""
    at = points @ matrix[:, :2].T + matrix[:, 2]
    return at[:, :2] / at[:, 2:]
