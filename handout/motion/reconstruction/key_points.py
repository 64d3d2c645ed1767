"""Finds the key points of a trace, where one stroke of the movement passes into the next; and compares traces.

Source: seed 002, §3.2; own additions: cusps, whose turning of ±π cancels in the smoothed signal, and a cut through
segments that nearly close on themselves or retrace their way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.motion.timing import arc_length
from handout.peaks import peaks
from handout.values import Array

SAMPLES = 200  # of a trace: its extent is divided into so many
WINDOW = 40  # samples over which turning is summed
_PROMINENCE, _APART = 0.02, 10
_CUSP = np.radians(100)  # turning within a few samples that makes a cusp
_NEAR = 6  # samples on either side of a cusp
_BENT = 2.2  # path over chord beyond which a segment is cut at its farthest point

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class KeyPoints:
    """index : (m,) into the trace, ends included; turning : (n,) float, 0–2: 1 − cos of the smoothed turning."""

    index: Index
    turning: Array


def find(xy: Array, *, cusps: bool = True) -> KeyPoints:
    """Key points of an evenly sampled trace (n, 2), about `SAMPLES` samples in its extent.

    cusps : also at cusps, and where a segment nearly closes on itself.
    """
    direction = np.diff(xy @ np.array([1.0, 1j]))
    angle = np.angle(direction[1:] * np.conj(direction[:-1]))
    padded = np.pad(np.pad(angle, 1), WINDOW // 2)
    summed = np.convolve(padded, np.hanning(WINDOW), "same")[WINDOW // 2 : -(WINDOW // 2)]
    turning = 1 - np.cos(np.clip(summed, -np.pi, np.pi))
    edge = WINDOW // 4
    turns = peaks(turning, prominence=_PROMINENCE, apart=_APART)
    turns = turns[(turns > edge) & (turns < len(xy) - edge)]
    if not cusps:
        return KeyPoints(np.concatenate([[0], turns, [len(xy) - 1]]).astype(np.intp), turning)
    more = list[int]()
    if len(xy) >= 3 * _NEAR:  # samples at which the chords before and after differ in direction by more than `_CUSP`
        chord = (xy[_NEAR:] - xy[:-_NEAR]) @ np.array([1.0, 1j])
        turn = 1 - np.cos(np.angle(chord[_NEAR:] * np.conj(chord[:-_NEAR])))
        sharp = peaks(turn, prominence=0.0, apart=8)
        sharp = sharp[turn[sharp] >= 1 - np.cos(_CUSP)] + _NEAR
        more = [cusp for cusp in sharp if not (np.abs(turns - cusp) <= 8).any() and 3 < cusp < len(xy) - 4]
    index = np.unique(np.concatenate([[0], turns, more, [len(xy) - 1]])).astype(np.intp)
    # the key points; a segment much longer than its chord also gets the point farthest from both its ends
    out = [int(index[0])]
    for a, b in zip(index[:-1].tolist(), index[1:].tolist(), strict=True):
        piece = xy[a : b + 1]
        step = np.diff(piece, axis=0)
        length, chord = np.hypot(step[:, 0], step[:, 1]).sum(), np.hypot(*(piece[-1] - piece[0]))
        if b - a > 12 and length > _BENT * chord:
            away = np.hypot(*(piece - piece[0]).T) + np.hypot(*(piece - piece[-1]).T)
            far = a + int(np.argmax(away))
            if min(far - a, b - far) > 3:
                out.append(far)
        out.append(b)
    return KeyPoints(np.array(out, dtype=np.intp), turning)


def resample_path(xy: Array, count: int) -> Array:
    """(count, 2): points at equal distances along a path (n, 2); repeated points are dropped."""
    arc = arc_length(xy)
    keep = np.append(True, np.diff(arc) > 0)
    arc, xy = arc[keep], xy[keep]
    at = np.linspace(0.0, arc[-1], count)
    return np.column_stack([np.interp(at, arc, xy[:, 0]), np.interp(at, arc, xy[:, 1])])


def extent(xy: Array) -> float:
    """The larger side of the bounding box of points (n, 2)."""
    return float(np.ptp(xy, axis=0).max())


def snr(wanted: Array, had: Array, *, about_mean: bool = True) -> float:
    """Signal-to-noise ratio, dB, of wanted values (n, 2), about their mean or 0, and a difference (n, 2)."""
    noise = float(((wanted - had) ** 2).sum())
    signal = float(((wanted - (wanted.mean(axis=0) if about_mean else 0.0)) ** 2).sum())
    return float(10 * np.log10(max(signal, 1e-300) / max(noise, 1e-12 * signal, 1e-300)))
