"""From the ink of a hand as its own scan shows it to the same pen's ink as the scan of a chart shows it.

Two scans of one pen's ink differ by the scanner's settings and by the paper.  Light passes through ink as through a
filter, so the colour counts as a share of the bare paper's, v.  Settings change it in three ways: exposure, gamma and
white balance are a power of each channel; a black point, flare or a conversion of colours is a share of light that each
channel gains or loses; a contrast curve is an S in all channels alike.

    s = v + 2 c v (1 − v) (2 v − 1)      contrast c, of v as scanned
    l = s^2.2 + b (1 − s^2.2)            light, and the gain b of it
    w = l^(a / 2.2)                      power a

How dark a pixel is depends on the settings.  How far it lies from the edge of its line does not, and neither does
which pixels are the darker ones among those that lie equally far: so lines can be compared though one scan's pen was
pressed harder.  Power and gain are fitted to the ranks of such pixels in both scans (`strokes_in`).  A power leaves
the edges where they are; an S moves them, so the lines of the hand's scan are found again in the tones that the S
makes.  The lines tell the strength of an S badly, because a thinner line looks much like one with more contrast.  So
it comes from the patches of the chart (`chart_contrast`): a tone of one ink is a mixture of paper and full ink, and
light of all three channels moves along a straight line between both, or along one that is straight in a power of the
light (Yule and Nielsen 1951), however dots grow.  A scanner's gamma is such a power as well; an S is none, and bends
the ramps of inks.  The hand's scan may have the chart's S or none.  Of these explanations the one is taken that needs
neither power nor gain; where both do, the one that explains the lines better.

Source: own method, on the model of Yule, Nielsen and Neugebauer; robust to the pen's pressure as far as lines of some
words are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.colour import conversions
from handout.libraries import cv2, optimize
from handout.values import Array, Raster, readonly

_DENSEST = 3.0  # density of what shows as 0, of which nothing is known but that it is dark
_SOFT = 0.06  # mm, standard deviation of the smoothing before lines are looked for
_HALF = 0.5  # of the core's density: there a line ends
_NOISE = 4.0  # standard deviations of bare paper by which ink is denser
_FAINTEST = 0.05  # density under which nothing is taken for ink
_RING = 0.085  # mm, a pixel of 300 dpi
_ENDS = (-1.5, -0.5, 0.5, 1.5, 2.5)  # where rings about the edge end, in units of their width
_THICK = 0.6  # mm from its edge: no line has that, but what was filled in
LEAST = 40  # pixels of a ring; fewer tell nothing

Density = NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class LineDensities:
    """Densities, −ln(pixel / paper), in and about lines of ink.

    rings : of each ring about the edges of lines, from the core outwards, (n, 3); n differs.
    length : of all lines, mm, about.
    """

    rings: tuple[Array, ...]
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "rings", tuple(readonly(ring, None, 3) for ring in self.rings))

    @property
    def densest(self) -> Array:
        """(3,) density of the lines' cores, nearly all of which are paler."""
        return np.asarray(np.quantile(np.concatenate(self.rings[:2]), 0.9, axis=0))


def density_of(picture: NDArray[Any], paper: Array) -> NDArray[np.float32]:
    """(…, 3) densities of a picture (…, 3), 0–1, on bare paper (3,) or (…, 3)."""
    ratio = np.asarray(picture, dtype=np.float32) / np.maximum(np.asarray(paper, dtype=np.float32), 1e-3)
    return np.asarray(-np.log(np.maximum(ratio, math.exp(-_DENSEST))), dtype=np.float32)


def strokes_in(density: Density, dpi: float, tone: Callable[[Density], Density] | None = None) -> LineDensities | None:
    """The lines in a picture of writing; None where there is no ink.

    density : (h, w, 3), of its pixels.
    dpi : pixels an inch.
    tone : (n, 3) → (n, 3), optional: densities as another scan shows them; edges are looked for in that.
    """
    pixel = 25.4 / dpi
    shown = density if tone is None else tone(density.reshape(-1, 3)).reshape(density.shape)
    dark = cv2.GaussianBlur(shown.mean(axis=2).astype(np.float32), (0, 0), max(0.4, _SOFT / pixel))
    core = _core_density(np.asarray(dark))
    if core is None:
        return None
    lines = (dark > _HALF * core).astype(np.uint8)
    depth = np.asarray(cv2.distanceTransform(lines, cv2.DIST_L2, 5)) * pixel
    away = np.asarray(cv2.distanceTransform(1 - lines, cv2.DIST_L2, 5)) * pixel
    beyond = np.where(lines > 0, pixel / 2 - depth, away - pixel / 2)
    # where something was filled in that is no line, with its edges
    reach = 2 * math.ceil(_THICK / pixel) + 5
    beyond[cv2.dilate((depth > _THICK).astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0] = np.inf
    bounds = (-np.inf, *(max(_RING, pixel) * end for end in _ENDS))
    rings = tuple(density[(beyond > low) & (beyond <= high)].astype(np.float64) for low, high in pairwise(bounds))
    if not (beyond <= 0).any() or sum(map(len, rings[:2])) < LEAST:
        return None
    width = 2 * max(float(np.quantile(depth[beyond <= 0], 0.9)), pixel)
    return LineDensities(rings, float((beyond <= 0).sum()) * pixel**2 / width)


def _core_density(dark: NDArray[Any]) -> float | None:
    """Density of the middle of lines; None where nothing is denser than paper is uneven."""
    middle = float(np.median(dark))
    bare = dark[dark <= middle]
    noise = 1.4826 * float(np.median(np.abs(bare - np.median(bare))))
    inked = dark[dark > middle + max(_NOISE * noise, _FAINTEST)]
    if len(inked) < LEAST:
        return None
    # most of what is inked at all is edge: the core is found among the denser half
    return float(np.median(inked[inked > _HALF * np.quantile(inked, 0.95)]))


_STRENGTHS = np.linspace(-0.3, 0.45, 26)  # beyond ±.5 a curve turns back
_RAMP_POWERS = np.geomspace(0.3, 60.0, 48)  # of gamma × Yule and Nielsen's factor; beyond them nothing changes any more
_LEAST_TONES = 5  # of a ramp
_LEAST_RAMPS = 4
_SEEN = 1.1  # of the error without an S: printers whose drivers mix all inks into a ramp have 1.05 at most
_WEAKEST = 0.08  # of what makes a difference; sRGB's own curve looks like .06 at most
_DARKEST = 1e-3
_SHARES = np.linspace(0, 1, 1001)
_FULL = 255  # of a level of 8 bits


def apply_curve(share: Any, strength: float) -> NDArray[np.float64]:
    """What an S of some strength, −.5 to .5, makes of colours as shares of the paper's, 0–1."""
    v = np.asarray(share, dtype=np.float64)
    return np.asarray(v + 2 * strength * v * (1 - v) * (2 * v - 1))


def undo_curve(shown: Any, strength: float) -> NDArray[np.float64]:
    """The colours, 0–1, of which `apply_curve` makes `shown`."""
    if not strength:
        return np.asarray(shown, dtype=np.float64)
    return np.asarray(np.interp(shown, apply_curve(_SHARES, strength), _SHARES))


def chart_contrast(device: ArrayLike, scanned: ArrayLike) -> float:
    """Strength of the S that lies on the scan of a chart; 0 where none is seen, or where the chart cannot tell.

    device : (n, 3) RGB that was sent, 0–1.
    scanned : (n, 3) RGB that was seen of it, 0–1.
    """
    levels = np.rint(np.asarray(device) * _FULL).astype(int)
    white = (levels == _FULL).all(axis=1)
    if not white.any():
        return 0.0
    shown = np.asarray(scanned, dtype=np.float64)
    ramps = list(_ramps(levels, np.clip(shown / shown[white].mean(axis=0), _DARKEST, 1)))
    if len(ramps) < _LEAST_RAMPS:
        return 0.0
    errors = np.sqrt([sum(_bend_error(ramp, leading, c) for ramp, leading in ramps) for c in _STRENGTHS])
    if np.interp(0, _STRENGTHS, errors) < _SEEN * errors.min():
        return 0.0
    strength = float(_STRENGTHS[errors.argmin()])
    return strength if abs(strength) >= _WEAKEST else 0.0


def _ramps(levels: NDArray[np.int_], shares: Array) -> Iterable[tuple[Array, int]]:
    """Tones (k, 3) of one ink from none to full, over bare paper or one other full ink, and the ink's channel."""
    for leading in range(3):
        others = [channel for channel in range(3) if channel != leading]
        for under in ((_FULL, _FULL), (0, _FULL), (_FULL, 0)):
            rows = np.flatnonzero((levels[:, others] == under).all(axis=1))
            rows = rows[np.argsort(-levels[rows, leading])]
            if len(rows) >= _LEAST_TONES and levels[rows[0], leading] == _FULL and levels[rows[-1], leading] == 0:
                yield shares[rows], leading


def _bend_error(ramp: Array, leading: int, strength: float) -> float:
    """Sum of squares by which a ramp is off a straight line without an S, in the power that makes it straightest."""
    straight = np.maximum(undo_curve(ramp, strength), _DARKEST) ** (1 / _RAMP_POWERS[:, None, None])
    paper, full = straight[:, :1], straight[:, -1:]
    ink = (straight - paper)[..., leading] / (full - paper)[..., leading]
    line = paper + ink[..., None] * (full - paper)
    back = apply_curve(np.maximum(line, 1e-6) ** _RAMP_POWERS[:, None, None], strength)
    return float(np.square(back - ramp).sum(axis=(1, 2)).min())


SAME = 1.5  # ΔE00 on the mean up to which two scans were made alike: lines of one pen on two days differ by as much
_GAMMA = 2.2  # what light is counted in; that of most scanners
_RANKS = np.linspace(0.04, 0.96, 24)
_TIGHT = 0.02  # how much each part is held back, of 1
_HELD = (0.1, 0.5)  # the power's differences between channels, what is gained
_POWERS = (0.35, 3.0)  # that settings have; anything else is another ink
_APART = 2.5  # how much they may differ between channels
_MOST = 20_000  # pixels of lines that differences are averaged over
_WEAK = 0.15  # density of the core under which a channel tells nothing about that


@dataclass(frozen=True, eq=False)
class Tone:
    """What settings make of a pen's lines.

    powers, gains : (3,) of each channel.
    papers : (2, 3) scanned RGB of the bare paper in the hand's scan and in the chart's.
    contrasts : strength of the S in the hand's scan and in the chart's.
    """

    powers: Array
    gains: Array
    papers: Array
    contrasts: tuple[float, float] = (0.0, 0.0)

    def __call__(self, share: Any) -> NDArray[np.float64]:
        """(n, 3) colours as shares of the paper's, of such (n, 3)."""
        (hand, chart), (before, after) = self.papers, self.contrasts
        v = undo_curve(hand * np.asarray(share, dtype=np.float64), before) / undo_curve(hand, before)
        light = np.maximum(v, 1e-3) ** _GAMMA
        light = light + self.gains * (1 - light)
        shown = np.maximum(light, 1e-5) ** (self.powers / _GAMMA)
        return np.asarray(apply_curve(undo_curve(chart, after) * shown, after) / chart)

    def density(self, density: Density) -> Density:
        """(n, 3) densities that densities (n, 3) become."""
        return np.asarray(-np.log(self(np.exp(-density))))


def _of_contrasts(papers: Array, contrasts: tuple[float, float]) -> Tone:
    """The tone of scans that differ in nothing but contrast."""
    return Tone(np.ones(3), np.zeros(3), papers, contrasts)


@dataclass(frozen=True, eq=False)
class _Explanation:
    """tone : the best one with some contrasts; error : of shares, that it leaves; left : ΔE00 of power and gain."""

    tone: Tone
    error: float
    left: float


@dataclass(frozen=True, eq=False)
class InkMatch:
    """What becomes of the ink of a hand in the scan of a chart.

    tone : what the settings make of it.
    from_paper, to_paper : (3,) scanned RGB of the bare paper in the hand's scan and in the chart's.
    difference : ΔE00, mean over the pen's lines, that the settings make.
    lighter : L* by which they make lines lighter, on the mean; below 0: darker.
    same_ink : whether settings of a scanner can explain all of it.
    """

    tone: Tone
    from_paper: Array
    to_paper: Array
    difference: float
    lighter: float
    same_ink: bool

    def __post_init__(self) -> None:
        for name in ("from_paper", "to_paper"):
            object.__setattr__(self, name, readonly(getattr(self, name), 3))

    @property
    def scans_alike(self) -> bool:
        """Whether both scans were made with the same settings, as far as can be seen."""
        return self.difference <= SAME and not self.contrast_differs

    @property
    def contrast_differs(self) -> bool:
        """Whether an S-shaped curve lies on one of both scans only."""
        before, after = self.tone.contrasts
        return before != after

    def colours(self, rgb: Array) -> Array:
        """(n, 3) RGB in the chart's scan, of ink on paper that shows as (n, 3) RGB in the hand's."""
        share = np.clip(rgb / self.from_paper, 0, 1)
        return np.asarray(np.clip(self.to_paper * self.tone(share), 0, 1))

    def raster(self, raster: Raster) -> Raster:
        """A page in the hand's ink, as the chart's scan would show it on the chart's paper.

        The cover grows only where ink of the given cover cannot be dark enough.
        """
        inked, out = np.flatnonzero(raster.inked), raster.rgba.copy()
        if len(inked):
            out.reshape(-1, 4)[inked] = np.rint(self.inks(out.reshape(-1, 4).take(inked, axis=0) / 255) * 255)
        return Raster(out, raster.dpi, raster.origin)

    def inks(self, rgba: Array) -> NDArray[np.float32]:
        """(n, 4) colour and cover in the chart's scan of (n, 4) colour and cover, above 0, in the hand's."""
        cover = rgba[:, 3:]
        shown = self.colours(cover * rgba[:, :3] + (1 - cover) * self.from_paper)
        covers = np.maximum(cover, (1 - shown / self.to_paper).max(axis=1, keepdims=True))
        ink = (shown - (1 - covers) * self.to_paper) / covers
        return np.hstack([np.clip(ink, 0, 1), np.minimum(covers, 1)]).astype(np.float32)


def match(
    hand: Density, from_paper: Array, chart: Density, to_paper: Array, dpi: float, contrast: float = 0.0
) -> InkMatch | None:
    """Compare lines of one pen in two scans; None where one of them has no lines.

    hand, chart : (h, w, 3) densities of writing in the hand's scan and in the chart's, both at `dpi`.
    from_paper, to_paper : (3,) scanned RGB of the bare papers, 0–1.
    contrast : strength of the S that the chart's patches show in its scan; 0: none.
    """
    first, other = strokes_in(hand, dpi), strokes_in(chart, dpi)
    if first is None or other is None:
        return None
    inked = np.concatenate(first.rings[:3])
    shares = np.clip(np.exp(-inked[:: max(1, len(inked) // _MOST)]), 0, 1)
    papers = np.stack([from_paper, to_paper])

    def explain(contrasts: tuple[float, float]) -> _Explanation:
        plain = _of_contrasts(papers, contrasts)
        lines = strokes_in(hand, dpi, plain.density) if any(contrasts) else first
        if lines is None:
            return _Explanation(plain, np.inf, np.inf)
        tone, error = _fit_tone(lines, other, plain)
        return _Explanation(tone, error, _mean_difference(plain, tone, shares, to_paper))

    # a contrast that only the hand's scan has cannot be told from another power
    pairs = [(0.0, contrast), (contrast, contrast)] if contrast else [(0.0, 0.0)]
    explanations = [explain(pair) for pair in pairs]
    plainest = min(explanations, key=lambda explanation: explanation.left)
    if plainest.left <= SAME:  # neither power nor gain is needed
        tone = _of_contrasts(plainest.tone.papers, plainest.tone.contrasts)
    else:
        tone = min(explanations, key=lambda explanation: explanation.error).tone
    return _judge_match(tone, first, shares)


def _fit_tone(hand: LineDensities, chart: LineDensities, plain: Tone) -> tuple[Tone, float]:
    """The tone with the contrasts of `plain` that explains the one by the other best; and the error that it leaves."""
    pairs = [
        (np.quantile(hand_ring, _RANKS, axis=0), np.quantile(chart_ring, _RANKS, axis=0))
        for hand_ring, chart_ring in zip(hand.rings, chart.rings, strict=True)
        if min(len(hand_ring), len(chart_ring)) >= LEAST
    ]
    shares, goals = (np.exp(-np.concatenate(part)) for part in zip(*pairs, strict=True))
    held = _TIGHT * np.sqrt(len(shares))

    def tone(x: Array) -> Tone:
        return Tone(np.exp(x[:3]), x[3:], plain.papers, plain.contrasts)

    def residuals(x: Array) -> Array:
        pull = held * np.concatenate([_HELD[0] * (x[:3] - x[:3].mean()), _HELD[1] * x[3:]])
        return np.concatenate([(tone(x)(shares) - goals).ravel(), pull])

    fitted = tone(optimize.least_squares(residuals, np.zeros(6)).x)
    return fitted, float(np.sqrt(np.mean((fitted(shares) - goals) ** 2)))


def _mean_difference(first: Tone, second: Tone, shares: Array, paper: Array) -> float:
    """ΔE00, mean, between what two tones make of colours (n, 3) as shares of the paper's."""
    views = (conversions.lab(np.clip(paper * tone(shares), 0, 1)) for tone in (first, second))
    return float(conversions.delta_e(*views).mean())


def _judge_match(tone: Tone, hand: LineDensities, shares: Array) -> InkMatch:
    from_paper, to_paper = tone.papers
    same = _of_contrasts(tone.papers, (tone.contrasts[0], tone.contrasts[0]))
    plain, shown = (conversions.lab(np.clip(to_paper * tone_(shares), 0, 1)) for tone_ in (same, tone))
    lighter = float((shown - plain)[:, 0].mean())
    strong = hand.densest >= _WEAK
    powers = (tone.density(hand.densest[None])[0] / np.maximum(hand.densest, 1e-3))[strong]
    within = not len(powers) or bool(
        powers.min() >= _POWERS[0] and powers.max() <= _POWERS[1] and powers.max() <= _APART * powers.min()
    )
    return InkMatch(tone, from_paper, to_paper, _mean_difference(same, tone, shares, to_paper), lighter, within)
