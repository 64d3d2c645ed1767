"""How a pen is held: learned of recordings, kept as a .pose file, shown, and given to what is written or drawn."""

from __future__ import annotations

import difflib
import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handout import atomic, shipped
from handout.errors import InputError
from handout.motion.pose import library
from handout.motion.pose.library import PoseLibrary
from handout.motion.pose.posing import Passes, pose_drawing
from handout.motion.pose.synthesis import PoseModel
from handout.pipeline.inputs import output_path
from handout.pipeline.options import PoseOptions
from handout.pipeline.results import Facts, Result
from handout.sources import read_drawing
from handout.values import Array, Drawing

if TYPE_CHECKING:
    from PIL import Image

_SHEET = 1600  # pixels: width of a panel of `show`
_LINE = 26.0  # pixels of its text
_THIN, _BOLD = 1.0, 9.0  # pixels of a stroke at no pressure and at full
_RANGE = (5.0, 95.0)  # percentiles of a channel that its colours range over
# these colours, dark enough on white
_BLUE, _GREY, _RED = np.array([30, 70, 220]), np.array([150, 150, 140]), np.array([215, 30, 30])


@dataclass(frozen=True, kw_only=True)
class PoseSheet(Result):
    """A pose library, as it was learned or loaded, and files made of it."""

    library: PoseLibrary
    files: tuple[Path, ...]

    def facts(self) -> Facts:
        pose = self.library
        # the least, the median and the greatest
        told = {name: np.percentile(values, (0, 50, 100)).tolist() for name, values in pose.channels.items()}
        return {
            "title": pose.title,
            "strokes": len(pose.lengths),
            "samples": len(pose.xy),
            "letter_height_mm": round(pose.letter_height, 3),
            "channels": {name: [round(value, 4) for value in values] for name, values in told.items()},
            "notices": list(pose.notices),
            "notes": list(self.notes),
            "files": [str(path) for path in self.files],
        }


def learn_pose(
    recordings: Sequence[str | Path], output: str | Path, title: str | None = None, *, level: bool = False
) -> PoseSheet:
    """Learn how a writer holds the pen, from recordings (.cyn .svc .inkml .uim .json …), and keep it as a .pose file.

    title : for people; None: the name of the file.
    level : take out what the place on the page does to the pose.

    Raises InputError: a recording that cannot be read or has no pose, or a file of another name.
    """
    path = output_path(output, ".pose", "a pose library is kept as")
    learned = library.learn([read_drawing(recording) for recording in recordings], title or path.stem)
    pose = library.level_pose(learned.library) if level else learned.library
    atomic.write(path, library.to_bytes(pose))
    return PoseSheet(library=pose, files=(path,), notes=learned.notes)


def pose_path(name: str) -> Path:
    """The file of the pose library of a name, one that comes with the program or the user's own, or a .pose file.

    Raises InputError: there is none; the message lists the nearest.
    """
    if name.endswith(".pose"):
        return Path(name)
    known = shipped.files("poses", "*.pose")
    if name not in known:
        near = difflib.get_close_matches(name, known, 3, 0.5) or sorted(known)
        raise InputError(f"No pose library is called {name!r}: use {', '.join([*near, 'the path of a .pose file'])}.")
    return known[name]


@lru_cache(maxsize=2)
def _model(path: Path, _changed: float) -> PoseModel:
    return PoseModel(library.load(path))


def pose_model(name: str) -> PoseModel:
    """A pose library, ready for giving poses; errors of `pose_path` and `library.load`."""
    path = pose_path(name)
    return _model(path, path.stat().st_mtime if path.is_file() else 0.0)


def with_pose(drawing: Drawing, options: PoseOptions) -> Drawing:
    """A drawing held, and where that is asked for drawn, as a pose library suggests; as it is if none is named.

    Raises InputError: no such library or method, a trajectory without a library, or a drawing without strokes.
    """
    if options.pose is None:
        if options.trajectory:
            raise InputError("--trajectory draws strokes like those of a library: name it with --pose.")
        return drawing
    passes: Passes = (1 if options.one_pass else 2) if options.trajectory else 0
    return pose_drawing(drawing, pose_model(options.pose), options.method, passes=passes)


def show_pose(name: str, output: str | Path) -> PoseSheet:
    """A picture (PNG) of a pose library: its strokes, as bold as they were pressed, once for each channel.

    Raises InputError: no such library, or a file of another name.
    """
    path = output_path(output, ".png", "a pose library is shown as")
    pose = library.load(pose_path(name))
    picture, stream = _sheet(pose), io.BytesIO()
    picture.save(stream, "PNG")
    atomic.write(path, stream.getvalue())
    return PoseSheet(library=pose, files=(path,))


def _sheet(pose: PoseLibrary) -> Image.Image:
    from PIL import Image, ImageDraw, ImageFont

    low, high = pose.xy.min(axis=0), pose.xy.max(axis=0)
    scale = (_SHEET - 80) / max(float(high[0] - low[0]), 1.0)
    tall = round(float(high[1] - low[1]) * scale) + 120
    image = Image.new("RGB", (_SHEET, tall * len(pose.channels) + 80), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(_LINE)
    head = f"{pose.title}: {len(pose.lengths)} strokes, {len(pose.xy)} samples, letters of {pose.letter_height:.1f} mm"
    draw.text((40, 24), head, "black", font)
    for number, (channel, values) in enumerate(pose.channels.items()):
        least, most = (float(v) for v in np.percentile(values, _RANGE))
        angle = channel != "pressure"
        ends = [f"{np.degrees(v):.0f}°" if angle else f"{v:.2f}" for v in (least, most)]
        draw.text((40, number * tall + 80), f"{channel}: blue {ends[0]}, red {ends[1]}", "black", font)
        place = (pose.xy - low) * scale + [40, number * tall + 140]
        share = _share(values)
        below, above = np.clip(2 * share, 0, 1)[:, None], np.clip(2 * share - 1, 0, 1)[:, None]
        mixed = _BLUE + (_GREY - _BLUE) * below + (_RED - _GREY) * above
        _strokes(draw, pose, place, [(int(r), int(g), int(b)) for r, g, b in mixed.tolist()])
    return image


def _share(values: Array) -> Array:
    """0–1 of the range that most values lie in."""
    least, most = np.percentile(values, _RANGE)
    return np.asarray(np.clip((values - least) / max(most - least, 1e-9), 0.0, 1.0))


def _strokes(draw: object, pose: PoseLibrary, place: Array, colours: Sequence[tuple[int, int, int]]) -> None:
    from PIL import ImageDraw

    assert isinstance(draw, ImageDraw.ImageDraw)
    width = _THIN + (_BOLD - _THIN) * _share(pose.channels.get("pressure", np.zeros(len(place))))
    for first, count in zip(pose.first_samples.tolist(), pose.lengths.tolist(), strict=True):
        for i in range(first, first + count):
            x, y = place[i].tolist()
            half = float(width[i]) / 2
            draw.ellipse((x - half, y - half, x + half, y + half), colours[i])
            if i > first:
                draw.line(
                    [(float(place[i - 1, 0]), float(place[i - 1, 1])), (x, y)], colours[i], max(round(2 * half), 1)
                )
