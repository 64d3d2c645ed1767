"""A machine judges motion: recordings of real pens against motion that was made, writers kept apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from handout.errors import InputError
from handout.pipeline.results import SILENT, Facts, Listener, Result
from handout.progress import narrow_reports
from handout.sources import read_drawing, suffixes
from handout.values import Drawing
from handout_lab.score import motion_judge
from handout_lab.score.motion_judge import Judgement, Sample

_SPLIT = 2 * motion_judge.LEAST  # real writers that can be parted in two for the control
_ALONE = "there is one writer of them: files are kept apart instead, and the judge may know the writer's manner"


@dataclass(frozen=True)
class MotionJudged(Result):
    """What the judge says of made motion, and of two controls if asked: real writers against each other (it should not
    tell them apart), and real paths at one steady speed (it should).
    """

    made: Judgement
    real_control: Judgement | None = None
    steady_control: Judgement | None = None

    def facts(self) -> Facts:
        kinds = {"made": self.made, "real_control": self.real_control, "steady_control": self.steady_control}
        told = {name: {**asdict(one), "verdict": one.verdict} for name, one in kinds.items() if one is not None}
        return {**told, **({"notes": list(self.notes)} if self.notes else {})}


def judge_motion(
    real: Path, made: Path, *, controls: bool = False, seed: int = 0, listener: Listener = SILENT
) -> MotionJudged:
    """Hold made motion against real.

    Parameters
    ----------
    real, made : folders of recordings and of files that handout wrote (.inkml .json .svg …); a folder in them is a
        writer, under whose name both kinds may stand, and a file beside such folders is one, too.
    controls : whether the judge is judged as well.

    Raises
    ------
    InputError
        No such folder, a file that cannot be read or has no times, or too little of either kind.
    """
    notes = list[str]()
    found = {kind: _found(folder, what, notes) for kind, folder, what in ((0, real, "real"), (1, made, "made"))}
    truth, rivals = ([(name, drawing) for name, drawing in found[kind]] for kind in (0, 1))
    ours = [motion_judge.sample(drawing, name, False) for name, drawing in truth]
    theirs = [motion_judge.sample(drawing, name, True) for name, drawing in rivals]
    parts = 3 if controls else 1
    judgement = motion_judge.judge(
        [*ours, *theirs], np.random.default_rng(seed), narrow_reports(listener.progress, 0.0, 1 / parts)
    )
    if not controls:
        return MotionJudged(judgement, notes=tuple(notes))
    steady = [motion_judge.sample(motion_judge.steady(drawing), name, True) for name, drawing in truth]
    crude = motion_judge.judge(
        [*ours, *steady], np.random.default_rng(seed), narrow_reports(listener.progress, 1 / 3, 2 / 3)
    )
    writers = sorted({sample.writer for sample in ours if len(sample.windows)})
    if len(writers) < _SPLIT:
        notes.append(
            f"Real writers are not held against each other: there are {len(writers)}, and {_SPLIT} are needed."
        )
        return MotionJudged(judgement, None, crude, notes=tuple(notes))
    half = set(np.random.default_rng(seed).permutation(writers)[: len(writers) // 2].tolist())
    parted = [Sample(sample.writer, sample.writer in half, sample.windows) for sample in ours]
    between = motion_judge.judge(parted, np.random.default_rng(seed), narrow_reports(listener.progress, 2 / 3, 1.0))
    return MotionJudged(judgement, between, crude, notes=tuple(notes))


def _found(folder: Path, what: str, notes: list[str]) -> Sequence[tuple[str, Drawing]]:
    """The drawings of a folder with their writers."""
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder: give one of recordings, with a folder in it for each writer.")
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in suffixes() and path.is_file())
    if not files:
        raise InputError(f"There is no {what} motion in {folder}: it is read from {', '.join(suffixes())} files.")
    names = [path.relative_to(folder).parts[0] if path.parent != folder else path.stem for path in files]
    if len(set(names)) == 1 and len(files) > 1:
        notes.append(f"{folder}: {_ALONE}.")
        names = [path.relative_to(folder).as_posix() for path in files]
    found = []
    for name, path in zip(names, files, strict=True):
        drawing = read_drawing(path)
        if not drawing.timed:
            raise InputError(f"{path} has no times: the judge of motion needs recordings, or what handout wrote.")
        found.append((name, drawing))
    return found
