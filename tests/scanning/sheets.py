"""Sheets of lined paper as scanners and cameras see them, and where their lines truly are."""

from dataclasses import dataclass

import cv2
import numpy as np

BLUE, GREY, RED, VIOLET = (0.62, 0.74, 0.90), (0.78, 0.78, 0.79), (0.93, 0.62, 0.62), (0.66, 0.60, 0.80)


@dataclass
class Sheet:
    """A picture (h, w, 3) uint8 of a sheet of `size` mm, and the corners (4, 2) of the sheet in it, pixels."""

    rgb: np.ndarray
    size: tuple
    to_picture: np.ndarray  # (3, 3) mm of the sheet to mm of the picture

    def seen(self, x, y):
        """Where a place of the sheet, mm, is in the picture, mm."""
        u, v, w = self.to_picture @ (x, y, 1.0)
        return u / w, v / w


def sheet(rules, columns=(), margins=(), size=(148.0, 210.0), dpi=150.0, colour=BLUE, thick=0.2, fine=(), tint=None):
    """A sheet with lines at heights `rules` (and finer ones at `fine`), columns, and red margin lines, mm."""
    unit, over = 25.4 / dpi, 4
    height, width = (round(side / unit) for side in size[::-1])
    rgb = np.ones((height, width, 3)) * (0.97, 0.965, 0.95)

    def drawn(count, at, width_):
        place = (np.arange(count * over) + 0.5) * unit / over
        on = np.zeros(len(place), dtype=bool)
        for one in at:
            on |= np.abs(place - one) < width_ / 2
        return on.reshape(count, over).mean(axis=1)

    def laid(share, how):
        nonlocal rgb
        rgb = rgb * (1 - share[..., None] * (1 - np.array(how)))

    laid(np.broadcast_to(drawn(height, rules, thick)[:, None], (height, width)), tint or colour)
    laid(np.broadcast_to(drawn(height, fine, 0.7 * thick)[:, None], (height, width)), colour)
    laid(np.broadcast_to(drawn(width, columns, thick)[None, :], (height, width)), tint or colour)
    laid(np.broadcast_to(drawn(width, margins, 1.3 * thick)[None, :], (height, width)), RED)
    return Sheet(rgb, size, np.eye(3))


def scanned(made, rng, noise=0.012, skew=0.0):
    """The sheet on a scanner's glass, turned a little; its picture has the sheet's size."""
    height, width = made.rgb.shape[:2]
    turn = cv2.getRotationMatrix2D((width / 2, height / 2), skew, 1.0)
    rgb = cv2.warpAffine(made.rgb, turn, (width, height), borderMode=cv2.BORDER_REPLICATE)
    rgb = cv2.GaussianBlur(rgb, (0, 0), 0.6) + rng.normal(0, noise, rgb.shape)
    unit = made.size[0] / width
    scale = np.diag([unit, unit, 1.0])
    matrix = scale @ np.vstack([turn, (0, 0, 1)]) @ np.linalg.inv(scale)
    return Sheet(np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8), made.size, matrix)


def photographed(made, rng, tilt=0.03, turn=1.0, shade=0.45, noise=0.02, quality=85):
    """The sheet as a camera sees it: at an angle, unevenly lit, grainy, as JPEG."""
    height, width = made.rgb.shape[:2]
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=np.float32)
    inner = corners + rng.uniform(-tilt, tilt, (4, 2)) * width
    a, middle = np.radians(turn), np.array([width, height]) / 2
    inner = (inner - middle) @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) + middle
    warp = cv2.getPerspectiveTransform(corners, inner.astype(np.float32))
    rgb = cv2.warpPerspective(made.rgb, warp, (width, height), borderMode=cv2.BORDER_REPLICATE, flags=cv2.INTER_AREA)
    x, y = np.meshgrid(np.linspace(0, 1, width), np.linspace(0, 1, height))
    light = 1 - shade * np.clip(0.7 * x + 0.5 * y**2 - 0.1, 0, 1)
    rgb = cv2.GaussianBlur(rgb, (0, 0), 0.8) * light[..., None] * (1.0, 0.97, 0.9)
    grain = cv2.GaussianBlur(rng.normal(0, 1, rgb.shape), (0, 0), 0.7) * noise * 1.6
    rgb = np.rint(np.clip(rgb + grain, 0, 1) * 255).astype(np.uint8)
    ok, data = cv2.imencode(".jpg", rgb, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert ok
    unit = made.size[0] / width
    scale = np.diag([unit, unit, 1.0])
    return Sheet(cv2.imdecode(data, cv2.IMREAD_COLOR), made.size, scale @ warp @ np.linalg.inv(scale))


def kinds():
    """Sheets that are sold, by name: how they are made, the rules to write on, the margin line and the columns."""
    narrow, college, wide = np.arange(25, 202, 6.35), np.arange(24, 202, 7.1), np.arange(28, 202, 8.7)
    five, seyes = np.arange(2.5, 209, 5), np.arange(22, 200, 8)
    fine = {"fine": np.arange(16, 206, 2), "columns": np.arange(41, 147, 8), "tint": VIOLET}
    return {
        "narrow": ({"rules": narrow, "margins": (32.0,)}, narrow, 32.0, None),
        "college": ({"rules": college, "margins": (30.0,)}, college, 30.0, None),
        "wide": ({"rules": wide, "colour": GREY}, wide, None, None),
        "squared": ({"rules": five, "columns": five[:29]}, five, None, 5.0),
        "squared with margin": (
            {"rules": five, "columns": five[:29], "margins": (25.0,), "colour": GREY}, five, 25.0, 5.0,
        ),
        "seyes": ({"rules": seyes, "margins": (33.0,), **fine}, seyes, 33.0, 8.0),
    }  # fmt: skip
