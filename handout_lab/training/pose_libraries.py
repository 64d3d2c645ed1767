"""Makes the pose libraries that ship: ``python -m handout_lab.training.pose_libraries FOLDER -o poses``.

FOLDER holds the recordings: ``bda_svc/HC-female`` and ``HC-male`` (`*.svc`), ``wacom_uim/value-of-ink.uim``.  Each
becomes a library of at most so many samples, the first of the recording; what is learned twice is kept once.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handout import atomic
from handout.motion.pose.library import PoseLibrary, join_strokes, learn, to_bytes
from handout.sources import read_drawing

_MOST = 12_000  # samples of a library: about 70 kB
_LEAST = 5  # samples of a stroke: shorter ones are dots, of which a few suffice
_DOTS = 40
_BDA = "Copyright (c) 2025 Brain Diseases Analysis Laboratory. MIT licence; see docs/notices.md."
_WACOM = "Copyright Wacom. Apache License 2.0; sampled evenly and cut from 'The Value of Ink'; see docs/notices.md."


@dataclass(frozen=True)
class Recording:
    """Files of one writer, as a glob, and the name, the title and the notice of the library."""

    files: str
    name: str
    title: str
    notice: str


RECORDINGS = (
    Recording("bda_svc/HC-female/*.svc", "firm", "a firm cursive", _BDA),
    Recording("bda_svc/HC-male/*.svc", "light", "a light cursive", _BDA),
    Recording("wacom_uim/value-of-ink.uim", "stylus", "quick notes with a stylus", _WACOM),
)


def shortened(library: PoseLibrary) -> PoseLibrary:
    """The first strokes of a library, with few of its dots."""
    dot = library.lengths < _LEAST
    wanted = ~dot | (np.cumsum(dot) <= _DOTS)
    wanted &= np.cumsum(library.lengths * wanted) <= _MOST
    parts = [part for part, kept in zip(library.strokes(), wanted.tolist(), strict=True) if kept]
    return join_strokes(parts, library)


def main(arguments: list[str] | None = None) -> None:
    """Make all libraries and say how large they are."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    given = parser.parse_args(arguments)
    given.output.mkdir(parents=True, exist_ok=True)
    for recording in RECORDINGS:
        drawings = [read_drawing(path) for path in sorted(given.folder.glob(recording.files))]
        learned = learn(drawings, recording.title, [recording.notice])
        library = shortened(learned.library)
        data = to_bytes(library)
        atomic.write(given.output / f"{recording.name}.pose", data)
        print(f"{recording.name}: {len(library.lengths)} strokes, {len(library.xy)} samples, {len(data) // 1000} kB")
        print(*learned.notes, sep="\n")


if __name__ == "__main__":
    main()
