"""How human the speeds of drawn and of scanned hands are, beside those of recorded pens.

Columns: characters a second; the exponent of speed by curvature (two thirds law: −⅓; goal −.20 to −.45); of the pieces
between two neighbouring bends, the share with one peak of speed, and the shares with none and with more; the usual time
between two minima of speed; how slow the pen is at minima, as a share of the peak between; peaks a second while the
pen is down; the share of the time that it is up.

With HANDOUT_DATA, the recorded pens: UNIPEN's joined German sentences (`pen/unipen/data/8/atu`), and two healthy
writers on paper (`pose/bda_svc`).  The shapes of the former are also timed as ink is, against the recorded times:
correlation of the logarithms of speed along the path, median of the sentences.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

import handout
from handout.errors import InputError
from handout.hand import library
from handout.motion.timing import curvature, sample_paths, time_paths
from handout.sources import read_drawing
from handout.values import Array, Drawing, Stroke

TEXT = (
    "Dear Max, the parcel came on Tuesday, quite dry in spite of the rain. Both jars were whole! We have put six of "
    "them by for winter and given the rest to Vera and her boys. Your father fixed the gate again."
)
_STEP, _BLUR = 0.005, 0.010  # s: of samples, and what they are smoothed by
_BRIEF = 0.15  # s: shorter movements have no profile
_PEAK, _BEND = 0.05, 0.4  # of the greatest speed; 1 / x-height: what stands out less is none
_SWING = 0.5  # mm: lower ups and downs are no strokes
_BENT, _MOVING = 0.3, 0.5  # 1 / x-height, x-heights a second: where the exponent is taken
_WRITERS = ("HC-female/00026", "HC-male/00027")


@dataclass(frozen=True, eq=False)
class Movement:
    """Even times (n,), s, and places (n,) complex, x-heights."""

    t: Array
    place: np.ndarray[tuple[int], np.dtype[np.complex128]]


@dataclass
class Profile:
    """What is measured on some writing, see the columns above."""

    characters: float
    exponent: float
    one: float
    none: float
    more: float
    stroke: float
    minimum: float
    peaks: float
    up: float

    def __str__(self) -> str:
        shares = f"{self.one:6.2f}{self.none:6.2f}{self.more:6.2f}"
        return (
            f"{self.characters:7.2f}{self.exponent:9.3f}{shares}{1000 * self.stroke:8.0f}"
            f"{self.minimum:8.2f}{self.peaks:8.1f}{self.up:7.2f}"
        )


def main() -> None:
    """Print the table."""
    print(f"{'':<34}char/s exponent   one  none  more  stroke minimum peaks/s     up")
    for hand in library.names():
        print(f"{hand + ', drawn':<34}{_written(hand)}")
    for hand in sorted(library.scanned_files()):
        print(f"{hand + ', scanned':<34}{_written(hand)}")
    folder = os.environ.get("HANDOUT_DATA")
    if folder is None:
        print("HANDOUT_DATA names no folder with recorded pens.")
        return
    _recorded(Path(folder))


def _written(name: str) -> Profile:
    rng = np.random.default_rng(1)
    hand = library.find(name)
    layout = handout.Layout(handout.page("A5"), margin=(15, 12, 15, 12), x_height=2.5)
    sheet = handout.compose(TEXT, hand, layout, rng)[0]
    drawing = handout.trace(sheet, hand, rng)
    return profile(drawing.strokes, len(TEXT), 2.5)


def _recorded(folder: Path) -> None:
    sentences = list(_sentences(folder / "pen" / "unipen" / "data" / "8" / "atu"))
    every = [(profile(drawing.strokes, count), drawing) for drawing, count in sentences]
    print(f"{f'{len(every)} sentences on a tablet':<34}{_middle([found for found, _ in every])}")
    for writer in _WRITERS:
        path = folder / "pose" / "bda_svc" / f"{writer}_w.cz.fnusa.9_1.svc"
        drawing = read_drawing(path)
        found = profile(drawing.strokes, len("Tramvaj dnes uz nepojede"))
        agreeing = _paced_again(drawing, len("Tramvaj dnes uz nepojede"))[1]
        print(f"{writer + ', on paper':<34}{found}  timed as ink is, correlation {agreeing:.3f}")
    again, correlations = zip(*(_paced_again(drawing, count) for drawing, count in sentences), strict=True)
    print(f"{'the sentences, timed as ink is':<34}{_middle(again)}")
    print(f"  speeds agree with those recorded: correlation of logarithms {np.median(correlations):.3f}")


def _sentences(folder: Path) -> Iterator[tuple[Drawing, int]]:
    for path in sorted(folder.rglob("*.dat")):
        try:
            drawing = read_drawing(path)
        except InputError:
            continue
        yield drawing, len(drawing.about["segments"][0]["label"])


def _middle(profiles: Sequence[Profile]) -> Profile:
    return Profile(*np.median([list(vars(one).values()) for one in profiles], axis=0).tolist())


def profile(strokes: Sequence[Stroke], characters: int, x_height: float | None = None) -> Profile:
    """What is measured on some strokes.

    x_height : mm; where it is not known, the usual height of an up or down stroke.
    """
    small = _small(strokes) if x_height is None else x_height
    movements = [_even(stroke, small) for stroke in strokes if stroke.t[-1] - stroke.t[0] >= _BRIEF]
    counts, strokes_, minima, bends, speeds = list[int](), list[float](), list[float](), list[Array](), list[Array]()
    peaks, moving = 0, 0.0
    for movement in movements:
        speed, bend = _speed(movement)
        high, low = (find_peaks(way, prominence=_PEAK * speed.max())[0] for way in (speed, -speed))
        strokes_ += np.diff(movement.t[low]).tolist()
        minima += [float((speed[a] + speed[b]) / 2 / speed[a:b].max()) for a, b in pairwise(low)]
        use = (bend > _BENT) & (speed > _MOVING)
        bends.append(np.log(bend[use]))
        speeds.append(np.log(speed[use]))
        edges = np.searchsorted(movement.t[high], _times_of_bends(movement))
        counts += np.diff(edges).tolist()
        peaks, moving = peaks + len(high), moving + float(np.ptp(movement.t))
    exponent = float(np.polyfit(np.concatenate(bends), np.concatenate(speeds), 1)[0])
    lasted = float(strokes[-1].t[-1] - strokes[0].t[0])
    number = np.array(counts)
    down = sum(float(np.ptp(stroke.t)) for stroke in strokes)
    one, none, more = (float(np.mean(which)) for which in (number == 1, number == 0, number > 1))
    stroke, minimum = float(np.median(strokes_)), float(np.median(minima))
    moves = peaks / moving
    return Profile(characters / lasted, exponent, one, none, more, stroke, minimum, moves, 1 - down / lasted)


def _even(stroke: Stroke, small: float) -> Movement:
    t = np.linspace(stroke.t[0], stroke.t[-1], max(round(float(np.ptp(stroke.t)) / _STEP) + 1, 2))
    place = np.interp(t, stroke.t, stroke.xy[:, 0]) + 1j * np.interp(t, stroke.t, stroke.xy[:, 1])
    width = _BLUR / (t[1] - t[0])
    pad = min(len(t) - 1, round(4 * width))
    longer = np.concatenate([2 * place[0] - place[pad:0:-1], place, 2 * place[-1] - place[-2 : -pad - 2 : -1]])
    smooth = gaussian_filter1d(longer.real, width) + 1j * gaussian_filter1d(longer.imag, width)
    return Movement(t, smooth[pad : pad + len(t)] / small)


def _speed(movement: Movement) -> tuple[Array, Array]:
    """Speed, x-heights a second, and curvature, 1 / x-height."""
    velocity = np.gradient(movement.place, movement.t)
    pull = np.gradient(velocity, movement.t)
    speed = np.abs(velocity)
    return speed, np.abs((np.conj(velocity) * pull).imag) / np.maximum(speed, 1e-6) ** 3


def _times_of_bends(movement: Movement) -> Array:
    way = sample_paths([np.column_stack([movement.place.real, movement.place.imag])])
    bends, _ = find_peaks(np.abs(curvature(way)), prominence=_BEND)
    run = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(movement.place)))])
    return np.asarray(np.interp(bends * way.step[0], run, movement.t))


def _small(strokes: Sequence[Stroke]) -> float:
    """The usual height of an up or down stroke, mm."""
    heights = list[float]()
    for stroke in strokes:
        if len(stroke.t) >= 10:
            y = _even(stroke, 1.0).place.imag
            turns = np.sort(np.concatenate([find_peaks(way, prominence=0.6 * _SWING)[0] for way in (y, -y)]))
            heights += np.abs(np.diff(y[[0, *turns, len(y) - 1]])).tolist()
    return float(np.median([height for height in heights if height > _SWING]))


def _paced_again(drawing: Drawing, characters: int) -> tuple[Profile, float]:
    """Recorded movements timed from their shapes alone; and how well the speeds along the paths agree."""
    small = _small(drawing.strokes)
    movements = [_even(stroke, small) for stroke in drawing.strokes if np.ptp(stroke.t) >= _BRIEF]
    movements = [one for one in movements if np.abs(np.diff(one.place)).sum() > 0.8]
    again, ours, theirs = list[Stroke](), list[Array](), list[Array]()
    for one in movements:
        xy = np.column_stack([one.place.real, one.place.imag])
        found = time_paths(sample_paths([xy]))
        run = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(one.place)))])
        t = np.arange(0.0, found.t[-1], _STEP)
        at = np.interp(t, found.t, found.along)
        begin = one.t[0] if not again else max(one.t[0], again[-1].t[-1] + 0.1)
        again.append(Stroke(begin + t, small * np.column_stack([np.interp(at, run, xy[:, k]) for k in (0, 1)])))
        places = np.linspace(0.03 * run[-1], 0.97 * run[-1], max(20, int(run[-1] / 0.05)))
        ours.append(np.interp(places, at, np.gradient(at, t)))
        theirs.append(np.interp(places, run, _speed(one)[0]))
    made, recorded = (np.log(np.maximum(np.concatenate(each), 0.3)) for each in (ours, theirs))
    return profile(again, characters, small), float(np.corrcoef(made, recorded)[0, 1])


if __name__ == "__main__":
    main()
