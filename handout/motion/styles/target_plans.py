"""Targets alone, with their ellipses, as a person throws them on a page; several references in frames of their own.

Source: seed 003, §3.3 (a Gaussian a target), fig. 1 and 8, and §3.7, eq. 18–19 (several references); seed 002, §4.1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from handout.motion import covariance
from handout.motion.styles import movement, targets
from handout.motion.styles.restyling import TargetSequence, draw_sequences
from handout.motion.styles.style import Style
from handout.values import Array, Drawing, Page, Stroke

_LOOSE = 0.05  # of the extent: standard deviation of targets that have no ellipses


@dataclass(frozen=True, eq=False)
class TargetReference:
    """Where targets are wanted, and how exactly, in a frame of its own.

    targets : (m, 2) float.
    covariances : (m, 2, 2) float, their ellipses; None: circles, all alike.
    axes : (2, 2) float, whose columns are the frame's axes on the page, mm; origin : (2,) float, mm.
    """

    targets: Array
    covariances: Array | None = None
    axes: Array | None = None
    origin: Array | None = None

    def on_page(self) -> tuple[Array, Array]:
        """Targets (m, 2) and covariances (m, 2, 2) on the page, mm and mm².

        Raises ValueError: covariances of another number than targets, or that are none.
        """
        axes = np.eye(2) if self.axes is None else self.axes
        origin = np.zeros(2) if self.origin is None else self.origin
        if self.covariances is None:
            extent = float(np.ptp(self.targets, axis=0).max()) or 1.0
            spreads = np.broadcast_to((_LOOSE * extent) ** 2 * np.eye(2), (len(self.targets), 2, 2))
        else:
            spreads = covariance.settle_covariances(self.covariances, self.targets)
        return self.targets @ axes.T + origin, axes @ spreads @ axes.T


def fuse_references(references: Sequence[TargetReference]) -> tuple[Array, Array]:
    """Targets (m, 2) and covariances (m, 2, 2) that several references want together: their product as Gaussians.

    Tracking each with a cost of its own, added up, is tracking their product: the costs are quadratic in the places.

    Raises ValueError: no references, or of different numbers of targets.

    Source: seed 003, §3.7, eq. 18–19.
    """
    if not references or len({len(reference.targets) for reference in references}) != 1:
        raise ValueError("all references must have the same number of targets")
    places, spreads = zip(*(reference.on_page() for reference in references), strict=True)
    precisions = np.linalg.inv(np.stack(spreads))
    together = np.linalg.inv(precisions.sum(axis=0))
    pulled = (precisions @ np.stack(places)[..., None]).sum(axis=0)
    return (together @ pulled)[..., 0], together


@dataclass(frozen=True, eq=False)
class TargetPlan:
    """Targets of some movements, one after the other.

    references : of all targets; lifted : numbers of the targets after which the pen is lifted, from 0.
    """

    references: tuple[TargetReference, ...]
    page: Page
    lifted: tuple[int, ...] = ()

    @property
    def has_ellipses(self) -> bool:
        """Whether any reference says how exactly its targets are meant."""
        return len(self.references) > 1 or self.references[0].covariances is not None

    def parts(self) -> list[tuple[Array, Array]]:
        """Targets and covariances of each movement."""
        places, spreads = fuse_references(self.references)
        cuts = sorted({at + 1 for at in self.lifted if 0 <= at < len(places) - 1})
        return list(zip(np.split(places, cuts), np.split(spreads, cuts), strict=True))


def draw_plan(plan: TargetPlan, style: Style, rng: np.random.Generator) -> Drawing:
    """The plan, moved through in a style: by optimal control near its Gaussians, or in a learned manner.

    A learned manner takes the targets as virtual ones, and has no use for their ellipses.
    """
    return draw_with_ellipses(plan, style, rng)[0]


def draw_with_ellipses(plan: TargetPlan, style: Style, rng: np.random.Generator) -> tuple[Drawing, Array]:
    """`draw_plan`, and the covariances (m, 2, 2) that the movement was held to: the plan's, mm², or the style's.

    Only the relative sizes of the style's matter; those of a learned style are empty (0, 2, 2).
    """
    parts = plan.parts()
    lines = tuple(Stroke(np.arange(len(xy), dtype=np.float64) + 1000 * k, xy) for k, (xy, _) in enumerate(parts))
    height = targets.letter_height(Drawing(lines, plan.page))
    followed = list[Array]()
    if style.model is not None:
        from handout.motion.styles.learned_movement import through_targets

        strokes = through_targets([xy for xy, _ in parts], style, rng, height)
    else:
        near = replace(style, form=replace(style.form, overshoot=0.0))

        def sequences() -> Iterator[TargetSequence]:
            # one after the other, so that the sizes of each come before its own noise
            for xy, spreads in parts:
                corner = np.zeros(len(xy), dtype=bool)
                chance = rng if len(xy) > 1 else np.random.default_rng(0)  # a dot is no movement, and takes no chance
                held = spreads if plan.has_ellipses else movement.covariances(corner, near, chance)
                followed.append(held)
                yield TargetSequence(xy, corner, spreads=held)

        strokes = draw_sequences(sequences(), near, height, rng)
    drawing = Drawing(strokes, plan.page, {"style": style.name})
    return drawing, np.concatenate(followed) if followed else np.zeros((0, 2, 2))
