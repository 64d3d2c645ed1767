"""Prints and scans of the chart for tests: made of it in known ways, so that what must be read is known."""

from functools import lru_cache

import cv2
import numpy as np

FINE = 300.0
DARK, LIGHT = np.array([0.045, 0.05, 0.052]), np.array([0.925, 0.935, 0.945])


def printed(device):
    """What a printer makes of device RGB (…, 3) in 0–1, as a scanner sees it: dot gain, and unclean inks."""
    ink = (1 - np.asarray(device, dtype=np.float64)) ** 0.85
    mixed = ink @ np.array([[0.86, 0.10, 0.03], [0.07, 0.84, 0.10], [0.03, 0.09, 0.85]])
    return DARK + (LIGHT - DARK) * (1 - mixed / np.array([0.96, 1.03, 0.98])).clip(0, 1) ** 1.25


def inked(page_pixels):
    """The different colours (n, 3) uint8 of a page, and which of them each pixel (h, w) has."""
    red, green, blue = (page_pixels[..., part].astype(np.uint32) for part in range(3))
    packed = red << 16 | green << 8 | blue
    seen = np.zeros(1 << 24, dtype=bool)
    seen[packed] = True
    codes = np.flatnonzero(seen)
    number = np.zeros(len(seen), dtype=np.intp)
    number[codes] = np.arange(len(codes))
    return np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=-1).astype(np.uint8), number[packed]


def paper(page_pixels):
    """The printed page as the scanner sees it, (h, w, 3) float32, from the printer's pixels."""
    colours, back = inked(page_pixels)
    return np.take(printed(colours / 255).astype(np.float32), back, axis=0)


_sheets = {}  # one at a time, by its number


@lru_cache(maxsize=4)
def _blurred(number, sigma):
    return cv2.GaussianBlur(_sheets[number], (0, 0), sigma)


def blurred(sheet, sigma):
    """The sheet as the openings of a coarse scanner see it; kept for the next scan of the same sheet."""
    if id(sheet) not in _sheets:
        _sheets.clear()
        _blurred.cache_clear()
        _sheets[id(sheet)] = sheet
    return _blurred(id(sheet), sigma)


def scanned(
    sheet, dpi=150.0, *, angle=0.0, warp=0.0, blur=0.6, noise=1.0, size=1.0, stretch=1.0, shade=0.0, bits=8, seed=0,
    border=6.0, lid=0.97, fine=FINE,
):  # fmt: skip
    """A scan of a page (h, w, 3) float32: its pixels, and the function from mm on the page to them."""
    rng = np.random.default_rng(seed)
    height, width = (side / fine * 25.4 for side in sheet.shape[:2])
    turn, scale = np.deg2rad(angle), dpi / 25.4
    linear = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) * scale * size
    linear = linear @ np.diag([stretch, 1.0])

    def bend(mm):
        x, y = mm[..., 0] / width, mm[..., 1] / height
        return warp * np.stack([np.sin(np.pi * x) * np.cos(2 * y), np.sin(np.pi * (0.8 * y + 0.3 * x))], axis=-1)

    box = np.array([[0, 0], [width, 0], [0, height], [width, height]]) @ linear.T
    low, high = box.min(axis=0) - border * scale, box.max(axis=0) + border * scale
    w, h = np.ceil(high - low).astype(int)
    back = np.linalg.inv(linear).T

    def places(x, y):
        """mm on a flat page, of pixels in these columns (c,) and rows (r,)."""
        return (x + low[0])[:, None] * back[0] + ((y + low[1])[:, None] * back[1])[:, None]

    mm = places(np.arange(w), np.arange(h)).astype(np.float32)
    if warp:  # the inverse of the bend, by iteration, in the middle of every 8 × 8 pixels: it is smooth
        flat = places(8 * np.arange(-(-w // 8)) + 3.5, 8 * np.arange(-(-h // 8)) + 3.5)
        moved = np.zeros_like(flat)
        for _ in range(6):
            moved = bend(flat - moved)
        whole = (8 * flat.shape[1], 8 * flat.shape[0])
        mm -= cv2.resize(moved.astype(np.float32), whole, interpolation=cv2.INTER_LINEAR)[:h, :w]
    source = mm * np.float32(fine / 25.4) - np.float32(0.5)
    smooth = blurred(sheet, max(0.3, 0.45 * fine / dpi)) if dpi < fine else sheet
    image = cv2.remap(smooth, source[..., 0], source[..., 1], cv2.INTER_LINEAR, borderValue=(lid,) * 3)
    image = cv2.GaussianBlur(image, (0, 0), blur) if blur else image
    if shade:
        image = image * (1 - shade * np.arange(w) / (high - low)[0]).astype(np.float32)[:, None]
    grain = rng.standard_normal(image.shape, dtype=np.float32) * np.float32(noise / 255) if noise else 0.0
    full = 255 if bits == 8 else 65535
    pixels = np.clip(np.rint((image + grain) * full), 0, full).astype(np.uint8 if bits == 8 else np.uint16)
    return pixels, lambda points: (np.asarray(points) + bend(np.asarray(points))) @ linear.T - low
