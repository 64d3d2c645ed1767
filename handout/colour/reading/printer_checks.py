"""What is wrong with a printer, seen in all colours that were read: it prints badly, or its driver interferes."""

from __future__ import annotations

from typing import Any

import numpy as np

from handout.colour.reading.findings import Finding
from handout.values import Array

_RANK, _FLAT_STEPS = 0.97, 0.12  # a real inkjet (Canon PRO-1000 on an Epson V850) has 0.9996 and 0.002
_STEP = 1.0 / 255
_INK = 0.12  # least that a full ink darkens its own channel
_RAMP, _RUN = 3.0 / 255, 40  # least error of a ramp that falls, and longest run of greys that look alike
_CHANCE = 6.0  # standard errors of a grey that are no fault
_MANY = 0.05  # of the colours
_ALIKE, _UNLIKE = 0.5 / 255, 20.0 / 255  # scans that are the same, of colours that are not


def of_printer(device: Array, scanned: Array, deviation: Array, source: str = "") -> list[Finding]:
    """Findings about the printer, from all colours: device (n, 3), what was read (n, 3) and its standard error (n,)."""
    return [
        *_of_rank(device, scanned, source),
        *_of_ramps(device, scanned, deviation, source),
        *_of_twins(device, scanned, source),
    ]


def _of_rank(device: Array, scanned: Array, source: str) -> list[Finding]:
    """Whether more of a channel always gives more of it."""
    levels = np.rint(np.linspace(0, 255, 8)) / 255
    cube = np.full((8, 8, 8, 3), np.nan)
    place = np.abs(device[:, :, None] - levels).argmin(axis=2)
    exact = (np.abs(levels[place] - device) < 1e-6).all(axis=1)
    cube[tuple(place[exact].T)] = scanned[exact]
    ranks, flats = [], []
    for channel in range(3):
        lines = np.moveaxis(cube[..., channel], channel, -1).reshape(-1, 8)
        lines = lines[np.isfinite(lines).all(axis=1)]
        if len(lines) < 8:
            return []
        order = lines.argsort(axis=1).argsort(axis=1)
        ranks.append(float((1 - 6 * ((order - np.arange(8)) ** 2).sum(axis=1) / (8 * 63)).mean()))
        flats.append(float((np.diff(lines, axis=1) < _STEP).mean()))
    worst = int(np.argmin(ranks))
    if min(ranks) >= _RANK and max(flats) <= _FLAT_STEPS:
        return []
    return [
        Finding(
            "managed",
            "refuse",
            f"What was printed does not follow what was sent (rank correlation "
            f"{min(ranks):.2f} in {('red', 'green', 'blue')[worst]}, {max(flats):.0%} of the steps without effect): "
            "the printer's driver manages colours, or this is not the print of the chart. Switch colour management and "
            "all enhancements off in the print dialogue, and print the chart again.",
            source,
        )
    ]


def _of_ramps(device: Array, scanned: Array, deviation: Array, source: str) -> list[Finding]:
    found = []
    for channel, ink in enumerate(("cyan", "magenta", "yellow")):
        others = [k for k in range(3) if k != channel]
        mine = (device[:, others] == 1).all(axis=1)
        ramp = scanned[mine][device[mine, channel].argsort(), channel]
        if len(ramp) > 2 and ramp[-1] - ramp[0] < _INK:
            found.append(
                Finding(
                    "clogged",
                    "refuse",
                    f"The ramp of {ink} is flat ({ramp[-1] - ramp[0]:.0%} of the scale "
                    "from paper to full ink): a nozzle is clogged or the cartridge is empty. Print a nozzle check, "
                    "clean the head, and print the chart again.",
                    source,
                )
            )
    neutral = np.ptp(device, axis=1) == 0
    order = device[neutral, 0].argsort()
    grey, level = scanned[neutral].mean(axis=1)[order], np.rint(device[neutral, 0][order] * 255)
    if len(grey) < 32:
        return found
    # the greatest of many errors, and both of the greys have one
    chance = _CHANCE * deviation[neutral][order]
    fall = np.maximum(np.maximum.accumulate(grey) - grey - chance, 0.0)
    if float(fall.max()) > _RAMP:
        found.append(
            Finding(
                "ramp",
                "warn",
                f"The greys do not get lighter steadily (by up to {fall.max() * 255:.1f} of 255 "
                f"wrong, at grey {level[int(fall.argmax())]:.0f}): the print is banded, or the paper takes the ink "
                "unevenly. Print the chart again in the best quality.",
                source,
            )
        )
    run, at = _longest_run(grey, level)
    if run >= _RUN:
        found.append(
            Finding(
                "ramp",
                "warn",
                f"Greys {at:.0f} to {at + run:.0f} look alike: the printer's or the scanner's "
                "driver cuts tones off. Switch its corrections off, and choose the paper that is in the printer.",
                source,
            )
        )
    return found


def _longest_run(grey: Array, level: Array) -> tuple[float, float]:
    """The widest range of device greys that differ by less than a step and a half, and where it begins."""
    smooth = np.convolve(np.pad(grey, 3, mode="edge"), np.ones(7) / 7, mode="valid")
    best, at, start = 0.0, 0.0, 0
    for end in range(len(smooth)):
        while smooth[end] - smooth[start] > 1.5 * _STEP:
            start += 1
        if level[end] - level[start] > best:
            best, at = float(level[end] - level[start]), float(level[start])
    return best, at


def _of_twins(device: Array, scanned: Array, source: str) -> list[Finding]:
    """Different colours that look the same: no table can tell them apart again."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(scanned).query_pairs(_ALIKE, output_type="ndarray")
    pairs = pairs[np.abs(device[pairs[:, 0]] - device[pairs[:, 1]]).max(axis=1) > _UNLIKE]
    if not len(pairs):
        return []
    share = len(np.unique(pairs)) / len(device)
    severity: Any = "refuse" if share > _MANY else "warn"
    shown = "; ".join(
        " and ".join(",".join(f"{v * 255:.0f}" for v in device[i]) for i in pair) for pair in pairs[:3].tolist()
    )
    return [
        Finding(
            "identical",
            severity,
            f"{len(pairs)} pairs of different colours look the same on paper (RGB {shown}"
            f"{' …' if len(pairs) > 3 else ''}): the driver cuts colours off, or the scan is too coarse. Switch colour "
            "management off and choose the right paper.",
            source,
        )
    ]
