"""A second reader of pictures, where it is installed: the network in the package ``rapidocr`` (the extra "reader").

It learnt from print and handwriting of other people than the first, and is wrong elsewhere: two surprises together say
more than one.  Its network is found in the installed package and run by OpenCV; of the package's code nothing runs.

Source: PP-OCRv6 (PaddleOCR), Apache License 2.0; how pictures are shown to it and its texts grouped: own method.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handout.alphabet import JUNK, LETTERS, fold
from handout.libraries import cv2
from handout.reading.pictures import PictureReading
from handout.reading.word_space import ABOVE, X_HEIGHT, normalised
from handout.values import Array, Indices

if TYPE_CHECKING:
    import cv2

_NETWORK = Path("models") / "PP-OCRv6_rec_small.onnx"  # in the package
_HEIGHT = 48  # rows that the network is shown
_ROOM = 3, 12  # rows and columns of word space around the ink
_FLOOR = 1e-9  # probability of what it does not see at all: it gives some classes none
_ALPHABET = b"\n\tcharacter\x12"  # what stands before the names of its classes in the file, and their length


@dataclass(frozen=True, eq=False)
class SecondReader:
    """A network that reads pictures of writing, and what its classes are called here.

    letters : that it may read; the last, `JUNK`, stands for all others.
    order, starts : the network's classes, those of one letter together, and where each letter's begin; 0 is none.
    """

    network: cv2.dnn.Net
    letters: str
    order: Indices
    starts: Indices

    def read_all(self, pictures: Sequence[Array]) -> list[PictureReading]:
        """What stands in density pictures (`word_space.HEIGHT`, w) in word space."""
        return [self._read(picture) for picture in pictures]

    def _read(self, picture: Array) -> PictureReading:
        # the rows with ink, at least those of small letters, and some paper around
        ink = normalised(picture)
        inked = np.flatnonzero(ink.max(axis=1) > 0)
        top = min(inked[0] if len(inked) else ABOVE, ABOVE - X_HEIGHT) - _ROOM[0]
        bottom = max(inked[-1] + 1 if len(inked) else ABOVE, ABOVE) + _ROOM[0]
        around = np.pad(ink, ((_ROOM[0], _ROOM[0]), (_ROOM[1], _ROOM[1])))[top + _ROOM[0] : bottom + _ROOM[0]]
        width = max(round(around.shape[1] * _HEIGHT / around.shape[0]), 1)
        shown = np.asarray(cv2.resize(around, (width, _HEIGHT), interpolation=cv2.INTER_LINEAR))
        self.network.setInput(np.broadcast_to(2 * (1 - shown) - 1, (1, 3, *shown.shape)).astype(np.float32))
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)  # sums depend on how they are parted
        try:
            seen = self.network.forward()[0].astype(np.float64)
        finally:
            cv2.setNumThreads(threads)
        likely = np.add.reduceat(seen[:, self.order], self.starts, axis=1)
        return PictureReading(np.log(likely + _FLOOR), self.letters, 1.0)


def find() -> Path | None:
    """The file of the network, where its package is installed."""
    found = importlib.util.find_spec("rapidocr")
    path = Path(found.submodule_search_locations[0]) / _NETWORK if found and found.submodule_search_locations else None
    return path if path is not None and path.is_file() else None


@lru_cache(maxsize=1)
def load() -> SecondReader | None:
    """The reader, or None where it is not installed, or OpenCV does not know its network."""
    path = find()
    if path is None:
        return None
    data = path.read_bytes()
    try:
        network = cv2.dnn.readNetFromONNX(np.frombuffer(data, dtype=np.uint8))
    except cv2.error:
        return None
    at = data.rindex(_ALPHABET) + len(_ALPHABET)
    length, shift = 0, 0
    while True:  # a number of protocol buffers: seven bits a byte, the highest says that more follow
        length |= (data[at] & 127) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 128:
            break
    names = [*data[at : at + length].decode().split("\n"), " "]
    letters = "".join(letter for letter in LETTERS if letter != JUNK) + JUNK
    of = np.array([0, *(letters.index(fold(name) if len(name) == 1 else JUNK) + 1 for name in names)])
    order = np.argsort(of, kind="stable")
    return SecondReader(network, letters, order, np.searchsorted(of[order], np.arange(len(letters) + 1)))
