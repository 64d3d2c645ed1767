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


def printed(made, at=(60.0, 12.0, 40.0, 9.0), holes=(), dark=(0.25, 0.3, 0.45)):
    """The sheet with bars like words in an area (left, top, width, height), mm, and round holes at places, mm."""
    rgb, unit = made.rgb.copy(), made.size[0] / made.rgb.shape[1]
    left, top, width, height = at
    for row in np.arange(top, top + height - 1.4, 2.8):
        for word in np.arange(left, left + width - 5, 6.0):
            rgb[round(row / unit) : round((row + 1.4) / unit), round(word / unit) : round((word + 4.6) / unit)] = dark
    for x, y in holes:
        cv2.circle(rgb, (round(x / unit), round(y / unit)), round(2.9 / unit), (0.12, 0.09, 0.07), -1, cv2.LINE_AA)
    return Sheet(rgb, made.size, made.to_picture)


def on_a_desk(made, rng, tilt=0.05, turn=4.0, around=0.18):
    """The sheet photographed on dark wood, at an angle, with a shadow: the picture, and its corners there, pixels."""
    height, width = made.rgb.shape[:2]
    size = (round(width * (1 + 2 * around)), round(height * (1 + 2 * around)))
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)])
    a, middle = np.radians(turn), np.array([width, height]) / 2
    seen = corners + rng.uniform(-tilt, tilt, (4, 2)) * width - middle
    seen = seen @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) + np.array(size) / 2
    warp = cv2.getPerspectiveTransform(corners.astype(np.float32), seen.astype(np.float32))
    mask = cv2.warpPerspective(np.ones((height, width)), warp, size, flags=cv2.INTER_AREA)[..., None]
    grain = cv2.GaussianBlur(rng.normal(0, 1, size[::-1]), (0, 0), sigmaX=30, sigmaY=1.2)[..., None]
    shadow = cv2.GaussianBlur(np.roll(mask[..., 0], (8, 8), (0, 1)), (0, 0), 8)[..., None]
    wood = np.array([0.42, 0.28, 0.17]) * (1 + 0.9 * grain) * (1 - 0.5 * shadow)
    rgb = wood * (1 - mask) + cv2.warpPerspective(made.rgb, warp, size, flags=cv2.INTER_AREA) * mask
    x, y = np.meshgrid(np.linspace(0, 1, size[0]), np.linspace(0, 1, size[1]))
    light = 1 - 0.5 * np.clip(0.7 * x + 0.5 * y**2 - 0.1, 0, 1)
    rgb = cv2.GaussianBlur(rgb, (0, 0), 0.9) * light[..., None] + rng.normal(0, 0.015, rgb.shape)
    return np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8), seen
