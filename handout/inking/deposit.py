"""Ink laid down piece by piece: a disc drawn along each piece leaves at a point as much as it stays there; a flat nib
is a rectangle, as long as its edge, that is drawn along without turning.

What a pixel gets is added up over all pieces.  A line that is drawn twice or crosses another holds more ink there,
the inside of a turn more than its outside, and an end less than the middle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.inking.flow import LANES, Pieces
from handout.values import NIB_THICKNESS

_CHUNK = 1 << 15  # pixels worked on at a time: what fits a processor's cache


class Ground:
    """The pieces of a page at a number of pixels to the mm, ready to be laid down some rows at a time.

    columns : of a page of `width` columns those that may have ink, in whole steps of `step` columns.
    """

    def __init__(self, pieces: Pieces, scale: float, width: int, step: int = 1) -> None:
        a, b, radius = pieces.a * scale, pieces.b * scale, pieces.radius * scale
        nib = pieces.nib * scale
        flat = np.abs(nib)
        reach = np.where(flat > 0, flat * np.hypot(1, NIB_THICKNESS), radius) + 0.5
        middle, along = (a + b) / 2, b - a
        half_length = np.abs(along) / 2
        box = np.abs(along.real) / 2 + reach, np.abs(along.imag) / 2 + reach
        self._left = np.floor(np.clip(middle.real - box[0], -1e6, 1e6)).astype(np.int64)
        self._top = np.floor(np.clip(middle.imag - box[1], -1e6, 1e6)).astype(np.int64)
        right, below = np.ceil(middle.real + box[0]), np.ceil(middle.imag + box[1])
        self._side = np.maximum(right - self._left, below - self._top)
        self._seen = (right > 0) & (self._left < width)
        first = int(np.clip(self._left[self._seen].min(initial=width), 0, width)) // step * step
        last = -int(-np.clip((self._left + self._side)[self._seen].max(initial=first), first, width) // step) * step
        self.columns = slice(first, last)
        unit = along / np.maximum(2 * half_length, 1e-12) + (half_length == 0)
        edge = nib / np.maximum(flat, 1e-12)
        turned = unit * edge.conj()
        # how far the nib goes before its whole length or thickness has passed
        ways = np.maximum(np.abs(turned.real), np.abs(turned.imag) / NIB_THICKNESS)
        inside = 2 * flat / np.maximum(ways, 1e-12)
        load = pieces.load / np.where(flat > 0, inside, 2 * radius)
        columns = (middle.real - self._left, middle.imag - self._top, unit.real, unit.imag, half_length, radius, load)
        self._columns = np.stack(columns).astype(np.float32)
        self._nib = np.stack([flat, edge.real, edge.imag]).astype(np.float32)
        self._lanes = pieces.lanes

    def rows(self, top: int, count: int) -> NDArray[np.float32]:
        """Ink in the `columns` of some rows of the page, 1 for the middle of a usual line; no rows if there is none."""
        width = self.columns.stop - self.columns.start
        near = self._seen & (self._top < top + count) & (self._top + self._side > top)
        if not near.any():
            return np.zeros((0, width), dtype=np.float32)
        margin = int(self._side[near].max())
        # with a margin no window has to be cut at the edge
        mass = np.zeros((count + 2 * margin, width + 2 * margin), dtype=np.float32)
        corner = (self._top - top + margin) * mass.shape[1] + self._left - self.columns.start + margin
        for n in np.unique(self._side[near]).astype(int).tolist():
            group = np.flatnonzero(near & (self._side == n))
            window = (np.arange(n)[:, None] * mass.shape[1] + np.arange(n))[None]
            step = max(1, _CHUNK // (n * n))
            for begin in range(0, len(group), step):
                some = group[begin : begin + step]
                amount = self._amount(some, n)
                inked = amount > 0
                np.add.at(mass.reshape(-1), (window + corner[some, None, None])[inked], amount[inked])
        return mass[margin : margin + count, margin : margin + width]

    def _amount(self, some: NDArray[np.intp], n: int) -> NDArray[np.float32]:
        """(m, n, n) ink that m pieces leave on the pixels of their windows of n rows and columns."""
        x0, y0, ux, uy, half_length, radius, load = self._columns[:, some, None, None]
        grid = np.arange(n, dtype=np.float32) + np.float32(0.5)
        dx, dy = grid[None, None, :] - x0, grid[None, :, None] - y0
        u, v = dx * ux + dy * uy, dy * ux - dx * uy
        chord = np.sqrt(np.maximum(radius * radius - v * v, 0))
        stay = np.minimum(half_length, u + chord) - np.maximum(-half_length, u - chord)
        if (flat := self._nib[0, some] > 0).any():
            stay[flat] = self._under_nib(some[flat], dx[flat], dy[flat])
        np.maximum(stay, 0, out=stay)
        lane = ((v / radius + np.float32(1)) * np.float32(LANES / 2)).astype(np.int32)
        np.clip(lane, 0, LANES - 1, out=lane)
        lane += (np.asarray(some, dtype=np.int32) * LANES)[:, None, None]
        stay *= load
        stay *= self._lanes.reshape(-1).take(lane)
        return np.asarray(stay)

    def _under_nib(
        self, some: NDArray[np.intp], dx: NDArray[np.float32], dy: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """(m, n, n) how much of each piece's way passes while a flat nib lies on pixels so far from its middle."""
        _, _, ux, uy, half_length, _, _ = self._columns[:, some, None, None]
        reach, ex, ey = self._nib[:, some, None, None]
        begin, end = -half_length, half_length
        for x, y, size in ((ex, ey, reach), (-ey, ex, reach * np.float32(NIB_THICKNESS))):
            away, speed = dx * x + dy * y, ux * x + uy * y
            speed = np.where(np.abs(speed) < 1e-6, np.float32(1e-6), speed)
            entry, leave = (away - size) / speed, (away + size) / speed
            begin, end = np.maximum(begin, np.minimum(entry, leave)), np.minimum(end, np.maximum(entry, leave))
        return np.asarray(end - begin)
