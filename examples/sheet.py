"""A sheet on a desk: makes sheet.jpg, a photograph of a punched, ruled sheet with a heading, as a telephone takes it.

python examples/sheet.py
handout write --file examples/letter.txt --paper sheet.jpg --page A5 -o letter.png
"""

import sys

import cv2
import numpy as np

UNIT = 25.4 / 180  # mm a pixel


def main(path: str) -> None:
    """Draw the sheet flat, and take its picture."""
    cv2.imwrite(path, photograph(sheet()), [cv2.IMWRITE_JPEG_QUALITY, 82])


def sheet() -> np.ndarray:
    """A5 paper as it is bought, (h, w, 3) in 0 to 1, blue first."""
    height, width = round(210 / UNIT), round(148 / UNIT)
    paper = np.ones((height, width, 3)) * (0.93, 0.955, 0.965)
    for rule in np.arange(38, 200, 8.0):
        paper[round(rule / UNIT) : round((rule + 0.25) / UNIT)] *= (0.9, 0.76, 0.63)
    paper[:, round(27 / UNIT) : round(27.3 / UNIT)] *= (0.62, 0.62, 0.93)
    picture = np.ascontiguousarray(np.rint(paper * 255).astype(np.uint8))
    place = (round(60 / UNIT), round(20 / UNIT))
    cv2.putText(picture, "Rowing club on the lake", place, cv2.FONT_HERSHEY_DUPLEX, 1.1, (110, 60, 30), 2, cv2.LINE_AA)
    cv2.circle(picture, (round(44 / UNIT), round(17 / UNIT)), round(7 / UNIT), (60, 60, 170), -1, cv2.LINE_AA)
    for hole in (65, 145):
        cv2.circle(picture, (round(10 / UNIT), round(hole / UNIT)), round(2.8 / UNIT), (24, 36, 48), -1, cv2.LINE_AA)
    return picture / 255.0


def photograph(flat: np.ndarray) -> np.ndarray:
    """The sheet on wood, at an angle, unevenly lit, (h, w, 3) uint8."""
    rng, (height, width) = np.random.default_rng(5), flat.shape[:2]
    size = (round(1.35 * width), round(1.3 * height))
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=np.float32)
    seen = np.array([(0.15, 0.14), (0.83, 0.09), (0.9, 0.89), (0.09, 0.92)], dtype=np.float32) * size
    warp = cv2.getPerspectiveTransform(corners, seen.astype(np.float32))
    mask = cv2.warpPerspective(np.ones((height, width)), warp, size, flags=cv2.INTER_AREA)[..., None]
    shadow = cv2.GaussianBlur(np.roll(mask[..., 0], (9, 9), (0, 1)), (0, 0), 9)[..., None]
    grain = cv2.GaussianBlur(rng.normal(0, 1, size[::-1]), (0, 0), sigmaX=40, sigmaY=1.3)[..., None]
    wood = np.array([0.2, 0.31, 0.45]) * (1 + 1.2 * grain) * (1 - 0.5 * shadow)
    picture = wood * (1 - mask) + cv2.warpPerspective(flat, warp, size, flags=cv2.INTER_AREA) * mask
    x, y = np.meshgrid(np.linspace(0, 1, size[0]), np.linspace(0, 1, size[1]))
    light = 1 - 0.45 * np.clip(0.7 * x + 0.5 * y**2 - 0.1, 0, 1)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.9) * light[..., None] + rng.normal(0, 0.012, picture.shape)
    return np.rint(np.clip(picture, 0, 1) * 255).astype(np.uint8)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "sheet.jpg")
