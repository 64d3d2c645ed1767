"""A pose library: strokes of one writer with how the pen was held, as a ``.pose`` file.

A ``.pose`` file is an archive of ``pose.json`` (`LibraryHead`), ``lengths.npy`` (samples of each stroke), ``path.npy``
(places as differences, 1/64 hand unit) and one array a channel, as differences of whole numbers: small, and nothing but
numbers.

Source: seed 001, §3 and §3.2.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand import archive
from handout.motion.pose.features import UNITS, resample_path
from handout.motion.styles.targets import letter_height
from handout.summary import one_line
from handout.units import count
from handout.values import POSE, TURNS, Array, Drawing, Indices, Stroke, readonly

_FORMAT, _VERSION = "handout-pose", 1
_FINE = 64  # parts of a hand unit that places are kept in
_STEPS = {"pressure": 2048, "tilt": 1024, "azimuth": 1024, "rotation": 1024}  # parts of 1 or of a radian that are kept
_RIGHT = np.pi / 2
_STILL = 1e-3  # rad, or share of full pressure: what varies by no more was not measured
_LARGEST = 10_000.0  # mm, of a stroke, as of drawings
_MOST = 2_000_000  # samples that a file may hold


class LibraryHead(msgspec.Struct, forbid_unknown_fields=True):
    """What a file says of itself.

    unit : mm of a hand unit as it was written.
    channels : of `POSE`, those that there are.
    notices : copyright notices of the recordings.
    """

    format: str
    version: int
    title: str
    unit: float
    channels: list[str]
    notices: list[str] = msgspec.field(default_factory=list)


@dataclass(frozen=True, eq=False)
class PoseLibrary:
    """Strokes of a writer, evenly sampled, with how the pen was held.

    xy : (n, 2) float, hand units, y down; all strokes one after the other.
    channels : by the names of `POSE`, (n,) each: pressure 0–1, angles in rad, those that turn unwrapped in a stroke.
    lengths : (s,) int, samples of each stroke.
    unit : mm of a hand unit as it was written.
    """

    xy: Array
    channels: Mapping[str, Array]
    lengths: Indices
    unit: float
    title: str = ""
    notices: tuple[str, ...] = ()

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "xy", readonly(self.xy, None, 2))
        object.__setattr__(self, "channels", {name: readonly(v, len(self.xy)) for name, v in self.channels.items()})

    @cached_property
    def first_samples(self) -> Indices:
        """(s,) int: the first sample of each stroke."""
        return np.asarray(np.cumsum(self.lengths) - self.lengths)

    @cached_property
    def place(self) -> Indices:
        """(n,) int: how many samples of its stroke lie before each."""
        return np.arange(len(self.xy)) - np.repeat(self.first_samples, self.lengths)

    @cached_property
    def samples_left(self) -> Indices:
        """(n,) int: how many samples of its stroke follow each."""
        return np.repeat(self.lengths, self.lengths) - 1 - self.place

    @cached_property
    def pose(self) -> Array:
        """(n, c): the channels as a point, see `embed_channels`."""
        return embed_channels(self.channels)

    @property
    def letter_height(self) -> float:
        """mm, as it was written."""
        return self.unit * UNITS

    def strokes(self) -> list[tuple[Array, dict[str, Array]]]:
        """Each stroke: places (m, 2) in hand units, and its channels."""
        parts = [slice(a, a + m) for a, m in zip(self.first_samples.tolist(), self.lengths.tolist(), strict=True)]
        return [(self.xy[p], {name: values[p] for name, values in self.channels.items()}) for p in parts]


def join_strokes(parts: Sequence[tuple[Array, Mapping[str, Array]]], like: PoseLibrary) -> PoseLibrary:
    """A library of strokes, with the unit, the title and the notices of another."""
    channels = {name: np.concatenate([part[name] for _, part in parts]) for name in like.channels}
    xy, lengths = np.concatenate([xy for xy, _ in parts]), np.array([len(xy) for xy, _ in parts], dtype=np.intp)
    return replace(like, xy=xy, channels=channels, lengths=lengths)


def embed_channels(channels: Mapping[str, Array]) -> Array:
    """(n, c): channels as a point whose distances say how unlike two poses are, angles on the circle.

    Pressure as it is; tilt and azimuth as the way the pen leans, 1 for flat on the paper; azimuth without tilt, and
    rotation, as points of a circle of diameter 1.
    """
    columns = []
    if "pressure" in channels:
        columns.append(channels["pressure"])
    if "azimuth" in channels:
        columns += _on_circle(channels["azimuth"], channels["tilt"] / _RIGHT if "tilt" in channels else 0.5)
    elif "tilt" in channels:
        columns.append(channels["tilt"] / _RIGHT)
    if "rotation" in channels:
        columns += _on_circle(channels["rotation"], 0.5)
    return np.column_stack(columns)


def _on_circle(angle: Array, radius: Array | float) -> list[Array]:
    return [radius * np.cos(angle), radius * np.sin(angle)]


def extract_channels(pose: Array, names: Iterable[str]) -> dict[str, Array]:
    """The channels of those names at points (n, c) such as `embed_channels` makes."""
    columns = iter(pose.T)
    known = set(names)
    channels: dict[str, Array] = {}
    if "pressure" in known:
        channels["pressure"] = np.clip(next(columns), 0.0, 1.0)
    if "azimuth" in known:
        x, y = next(columns), next(columns)
        channels["azimuth"] = np.unwrap(np.arctan2(y, x))
        if "tilt" in known:
            channels["tilt"] = np.minimum(np.hypot(x, y), 1.0) * _RIGHT
    elif "tilt" in known:
        channels["tilt"] = np.clip(next(columns), 0.0, 1.0) * _RIGHT
    if "rotation" in known:
        x, y = next(columns), next(columns)
        channels["rotation"] = np.unwrap(np.arctan2(y, x))
    return channels


@dataclass(frozen=True)
class LearnedLibrary:
    """A library, and sentences on what of the recordings was left out."""

    library: PoseLibrary
    notes: tuple[str, ...]


def learn(drawings: Sequence[Drawing], title: str = "", notices: Sequence[str] = ()) -> LearnedLibrary:
    """A pose library of recorded drawings of one writer.

    The size of the writing is found in each, so that a library serves writing of any size.  A channel that fewer than
    half of the samples have, or that never changes, is left out; so are strokes without one of the others, and strokes
    that were recorded already.

    Raises InputError: no stroke, or no channel.
    """
    recorded = [(stroke, letter_height(d) / UNITS) for d in drawings if d.strokes for stroke in d.strokes]
    if not recorded:
        raise InputError("These recordings hold no stroke: there is nothing to learn.")
    names, notes = _measured_channels([stroke for stroke, _ in recorded])
    # two recordings of one movement share their places, wherever they lie on the page
    once = {
        bytes(np.rint((stroke.xy - stroke.xy[0]) * 1e3).astype(np.int64)): (stroke, unit)
        for stroke, unit in reversed(recorded)
    }
    kept = [(s, unit) for s, unit in reversed(once.values()) if all(getattr(s, name) is not None for name in names)]
    if len(once) < len(recorded):
        notes.append(f"{count(len(recorded) - len(once), 'stroke')} recorded twice: kept once.")
    if len(kept) < len(once):
        notes.append(f"{count(len(once) - len(kept), 'stroke')} without {' or '.join(names)}: left out.")
    units = float(np.median([unit for _, unit in kept]))
    parts = [_sample_stroke(stroke, unit, names) for stroke, unit in kept]
    empty = PoseLibrary(np.zeros((0, 2)), dict.fromkeys(names, np.zeros(0)), np.zeros(0, np.intp), units)
    return LearnedLibrary(join_strokes(parts, replace(empty, title=title, notices=tuple(notices))), tuple(notes))


def _measured_channels(strokes: Sequence[Stroke]) -> tuple[list[str], list[str]]:
    """The channels that were measured, and notes on the others."""
    whole = sum(len(stroke.t) for stroke in strokes)
    names, notes = [], []
    for name in POSE:
        values = [v for stroke in strokes if (v := getattr(stroke, name)) is not None]
        have = sum(map(len, values))
        if not have:
            continue
        if 2 * have < whole:
            notes.append(f"Only {have} of {whole} samples have a {name}: it is left out.")
        elif float(np.ptp(np.concatenate(values))) <= _STILL:
            notes.append(f"The {name} never changes, as that of a device that does not measure it: it is left out.")
        else:
            names.append(name)
    if not names:
        said = " ".join(notes) or "They have neither pressure nor tilt, azimuth or rotation."
        raise InputError(f"There is no pose to learn from these recordings. {said}")
    return names, notes


def _sample_stroke(stroke: Stroke, unit: float, names: Sequence[str]) -> tuple[Array, dict[str, Array]]:
    xy, at = resample_path(stroke.xy, unit)
    recorded = {name: np.asarray(getattr(stroke, name)) for name in names}
    turned = {name: np.unwrap(values) if name in TURNS else values for name, values in recorded.items()}
    return xy, {name: np.interp(at, np.arange(len(stroke.t)), values) for name, values in turned.items()}


def level_pose(library: PoseLibrary) -> PoseLibrary:
    """The library without what the place on the page does to the pose: a quadratic polynomial, its mean put back.

    Angles that turn are taken relative to their mean direction.  Fewer than a hundred samples stay as they are.

    Source: seed 001, §3.2.
    """
    if len(library.xy) < 100:
        return library
    place = (library.xy - library.xy.mean(axis=0)) / np.maximum(library.xy.std(axis=0), 1e-9)
    x, y = place.T
    terms = np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y])
    channels = {}
    for name, values in library.channels.items():
        mean = np.angle(np.exp(1j * values).mean()) if name in TURNS else values.mean()
        away = np.angle(np.exp(1j * (values - mean))) if name in TURNS else values - mean
        trend = terms @ np.linalg.lstsq(terms, away, rcond=None)[0]
        channels[name] = values - trend
        if name == "pressure":
            channels[name] = np.clip(channels[name], 0.0, 1.0)
        elif name == "tilt":
            channels[name] = np.clip(channels[name], 0.0, _RIGHT)
    return replace(library, channels=channels)


def to_bytes(library: PoseLibrary) -> bytes:
    """A ``.pose`` file."""
    head = LibraryHead(_FORMAT, _VERSION, library.title, library.unit, list(library.channels), list(library.notices))
    members: dict[str, archive.Content] = {"pose.json": head, "lengths.npy": library.lengths.astype(np.int32)}
    members["path.npy"] = _differences(library.xy * _FINE)
    for name, values in library.channels.items():
        members[f"{name}.npy"] = _differences(values * _STEPS[name])
    return archive.pack(members)


def _differences(values: Array) -> NDArray[np.int32]:
    return np.diff(np.rint(values).astype(np.int64), axis=0, prepend=0).astype(np.int32)


def load(path: Path, data: bytes | None = None) -> PoseLibrary:
    """Read a ``.pose`` file. Raises InputError: it cannot be read, is damaged, or is of a later version."""
    with archive.Archive(path, data) as file:
        head = file.json("pose.json", LibraryHead)
        archive.check_version(path, (head.format, head.version), (_FORMAT, _VERSION))
        lengths = file.array("lengths.npy", "int32", None).astype(np.intp)
        n = int(lengths.sum())
        bad = not len(lengths) or lengths.min() < 1 or n > _MOST or not 0 < head.unit <= _LARGEST
        if bad or not head.channels or not set(head.channels) <= set(POSE):
            raise InputError(f"{path} cannot be used: it holds no strokes with a pose; learn it again.")
        xy = np.cumsum(file.array("path.npy", "int32", n, 2), axis=0) / _FINE
        if n and np.ptp(xy, axis=0).max() * head.unit > _LARGEST:
            raise InputError(f"{path} cannot be used: its strokes are longer than any page; learn it again.")
        names = [name for name in POSE if name in head.channels]
        channels = {name: np.cumsum(file.array(f"{name}.npy", "int32", n)) / _STEPS[name] for name in names}
    return PoseLibrary(xy, channels, lengths, head.unit, head.title, tuple(head.notices))
