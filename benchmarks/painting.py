"""How many dabs put the ink of a page right, where what is painted moves ink alone, and where its window is segmented.

Pages are read well, which is the truth, and then with a fault: `faint`, the same with the zero of ink put so high that
pale strokes break; and stains, printed rules and writing that shines through, laid over the scan and kept as ink.  A
person is simulated who sees the truth: each dab is a stroke of .4 x-heights along what is most wrong, a pixel beside
its middle, with the studio's usual brush (a wide one for stains), until 90 % of what was wrong is right, or ten dabs.
Pixels within 1.5 of the true edge count for nothing.  Columns: faults; dabs until it is right, mean, and of how many
faults one was enough, before and now; IoU of ink in the window of the fault: at first, after the first dab before, now;
what became wrong elsewhere, as a share of what was wrong, before and now; ms of one dab.

With real pages where HANDOUT_DATA names their folder: pages that the method was not made on; --developed takes the
others.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand.corrections import Paint, apply_and_tell
from handout.hand.page_editor import own_ink
from handout.hand.scanned import KeptScan, ScannedHand, ScannedPage
from handout.scanning.density import find_density
from handout.scanning.mask import find_mask
from handout.scanning.paper import flatten
from handout.scanning.written_page import Inked, PreparedScan, WrittenPage, find_ink, finish, prepare
from handout.tagging.glyph_extraction import scanned_page

DEVELOPED = ("cvl/0001_1.png", "cvl/0015_1.png", "csafe/w0238_s01_pLND_r01.png")
KEPT_OUT = (
    "cvl/0027_1.png", "csafe/w0180_s01_pWOZ_r01.png", "cvl/0012_1.png", "csafe/w0399_s01_pLND_r01.png",
    "cvl/0002_1.png", "csafe/w0122_s01_pLND_r01.png",
)  # fmt: skip
FAULTS = 5  # of a kind a page
_MOST, _ENOUGH, _RIM = 10, 0.1, 1.5  # dabs; share of what was wrong; pixels
_DAB, _BRUSH, _WIDE = 0.4, 0.2, 0.6  # x-heights
_HIGHER = 0.62  # zero of ink that breaks pale strokes

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Fault:
    """A page with something wrong, and where.  wanted : (h, w) what is to change; to : into what."""

    page: ScannedPage
    truth: Bools
    wanted: Bools
    to: Literal["ink", "paper"]


def _grown(mask: Bools, by: float) -> Bools:
    import cv2

    size = 2 * max(1, round(by)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.dilate(mask.astype(np.uint8), kernel) > 0)


def ink_of(page: ScannedPage) -> Bools:
    return own_ink(page, slice(0, page.shape[0]), slice(0, page.shape[1]))


def _kept(page: ScannedPage) -> ScannedPage:
    """The page with its scan as it comes back from a file."""
    import cv2

    assert page.scan is not None
    data = page.scan.packed()
    pixels = np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR))
    return replace(page, scan=KeptScan(page.shape, lambda: pixels, lambda: data))


def _spoilt(written: WrittenPage, rgb: NDArray[np.uint8], more: Bools) -> ScannedPage:
    """The page with another picture, `more` of which was taken for ink."""
    scan = replace(written.scan, rgb=rgb)
    mask = replace(written.mask, ink=written.mask.ink | more)
    prepared = PreparedScan(scan, written.paper, written.inks, written.density.scale)
    density = find_density(flatten(scan, written.paper), written.inks, written.density.scale)
    return _kept(scanned_page(finish(Inked(prepared, density, mask, written.text_lines)), ""))


def faint(written: WrittenPage, rng: np.random.Generator) -> Iterator[Fault]:
    """Pale strokes that a higher zero of ink has broken."""
    import cv2

    inks = replace(written.inks, inks=tuple(replace(ink, zero=_HIGHER) for ink in written.inks.inks))
    level = flatten(written.scan, written.paper)
    density = find_density(level, inks)
    try:
        mask = replace(written.mask, ink=find_mask(level, inks, density, written.mask.pen).ink)
    except InputError:  # nothing is left of a pale pen
        return
    prepared = PreparedScan(written.scan, written.paper, inks, density.scale)
    page = _kept(scanned_page(finish(Inked(prepared, density, mask, written.text_lines)), ""))
    truth = ink_of(scanned_page(written, ""))
    missing = truth & ~_grown(ink_of(page), _RIM)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(missing.astype(np.uint8), connectivity=8)
    large = [k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] >= 1.5 * written.mask.stroke**2]
    for k in rng.permutation(large)[:FAULTS].tolist():
        yield Fault(page, truth, labels == k, "ink")


def _over(
    written: WrittenPage,
    rng: np.random.Generator,
    laid: Callable[[ScannedPage, np.random.Generator], NDArray[np.float32]],
) -> Iterator[Fault]:
    """What lies on the scan beside its ink: `laid` gives what it lets through (h, w, 3), a piece a fault."""
    import cv2

    good = scanned_page(written, "")
    truth, through = ink_of(good), laid(good, rng)
    dx, dy = written.scan.origin
    own = through[dy:, dx:]
    rgb = np.rint(written.scan.rgb * own).astype(np.uint8)
    page = _spoilt(written, rgb, (own.min(axis=2) < 0.9))
    extra = ink_of(page) & (through.min(axis=2) < 0.9) & ~_grown(truth, _RIM)
    thing = cv2.connectedComponentsWithStats((through.min(axis=2) < 0.9).astype(np.uint8), connectivity=8)
    for k in rng.permutation(np.arange(1, thing[0]))[:FAULTS].tolist():
        wanted = extra & (thing[1] == k)
        if wanted.sum() >= 4 * written.mask.stroke**2:
            yield Fault(page, truth, wanted, "paper")


def stain(page: ScannedPage, rng: np.random.Generator) -> NDArray[np.float32]:
    """Brown drops on the writing."""
    import cv2

    cover: NDArray[Any] = np.zeros(page.shape, dtype=np.float32)
    some = page.graph.uv[rng.choice(len(page.graph), FAULTS + 2, replace=False)]
    for x, y in some.tolist():
        size = page.x_height / page.pixel * rng.uniform(0.5, 1.4)
        at = (round(x), round(y))
        cv2.ellipse(cover, at, (round(size), round(size * rng.uniform(0.6, 1))), rng.uniform(0, 180), 0, 360, 1.0, -1)
    cover = np.asarray(cv2.GaussianBlur(cover, (0, 0), 1.2))
    return np.asarray(1 - cover[:, :, None] * np.array([0.28, 0.4, 0.52]), dtype=np.float32)


def rule(page: ScannedPage, rng: np.random.Generator) -> NDArray[np.float32]:
    """Printed rules through the writing, twelve x-heights long."""
    import cv2

    cover: NDArray[Any] = np.zeros(page.shape, dtype=np.float32)
    for line in range(len(page.baselines)):
        size = page.x_height / page.pixel
        x = rng.uniform(0.15, 0.5) * page.shape[1] + np.array([0.0, 12.0 * size])
        y = page.base(line, x) - rng.uniform(0.1, 0.6) * size
        ends = [tuple(np.rint(np.array(end) * 16).astype(int).tolist()) for end in zip(x, y, strict=True)]
        cv2.line(cover, ends[0], ends[1], 1.0, 2, cv2.LINE_AA, 4)
    cover = np.asarray(cv2.GaussianBlur(cover, (0, 0), 0.6))
    return np.asarray(1 - cover[:, :, None] * np.array([0.5, 0.4, 0.3]), dtype=np.float32)


def through(page: ScannedPage, rng: np.random.Generator) -> NDArray[np.float32]:
    """The page's own words, mirrored, pale and soft, as from the back of the sheet."""
    import cv2

    ink = ink_of(page).astype(np.float32)[:, ::-1]
    back = cv2.GaussianBlur(np.roll(ink, round(0.5 * page.unit), axis=0), (0, 0), 1.5)
    return np.repeat(1 - rng.uniform(0.3, 0.45) * back[:, :, None], 3, axis=2).astype(np.float32)


KINDS: dict[str, Callable[[WrittenPage, np.random.Generator], Iterator[Fault]]] = {
    "faint": faint,
    "stain": lambda written, rng: _over(written, rng, stain),
    "rule": lambda written, rng: _over(written, rng, rule),
    "through": lambda written, rng: _over(written, rng, through),
}


def _dab(
    left: Bools, page: ScannedPage, rng: np.random.Generator, wide: bool
) -> tuple[list[tuple[float, float]], float]:
    """A stroke along the thickest part of what is wrong, and its width."""
    import cv2

    size = page.x_height / page.pixel
    inside = cv2.distanceTransform(left.astype(np.uint8), cv2.DIST_L2, 5)
    y, x = np.unravel_index(int(inside.argmax()), left.shape)
    near = np.argwhere(left[max(y - 8, 0) : y + 9, max(x - 8, 0) : x + 9])[:, ::-1].astype(float)
    along = np.linalg.svd(near - near.mean(axis=0), full_matrices=False)[2][0] if len(near) > 2 else np.array([1.0, 0])
    middle = np.array([x, y]) + rng.uniform(-1, 1, 2)
    ends = [middle + along * t * _DAB * size / 2 for t in (-1, 0, 1)]
    low, high = np.zeros(2), np.array(left.shape[::-1]) - 1.0
    width = max(2.0, (_WIDE if wide else _BRUSH) * size)
    return [tuple(np.clip(end, low, high).tolist()) for end in ends], width


@dataclass
class Tally:
    """dabs until it is right; IoU after the first; what became wrong elsewhere; seconds of each."""

    dabs: int
    first: float
    harm: float
    seconds: list[float]


def repaired(fault: Fault, kind: str, seed: int, kept: bool) -> Tally:
    """What it takes to put a fault right."""
    rng = np.random.default_rng(seed)
    page = fault.page if kept else replace(fault.page, scan=None)
    hand = ScannedHand("page", "page", (page,), ())
    y, x = np.nonzero(_grown(fault.wanted, 2 * fault.page.x_height / fault.page.pixel))
    here = slice(int(y.min()), int(y.max()) + 1), slice(int(x.min()), int(x.max()) + 1)
    rim = _grown(fault.truth, _RIM) & ~_eroded(fault.truth)
    before = ink_of(page)
    ever = _wrong(before, fault.truth, rim)
    tally = Tally(_MOST + 1, 0.0, 0.0, [])
    for count in range(1, _MOST + 1):
        ink = ink_of(hand.pages[0])
        left = fault.wanted & (~ink if fault.to == "ink" else ink)
        way, width = _dab(left, page, rng, kind == "stain")
        begin = time.process_time()
        hand = apply_and_tell(hand, [Paint(page=0, to=fault.to, stroke=tuple(way), width=width)]).hand
        tally.seconds.append(time.process_time() - begin)
        ink = ink_of(hand.pages[0])
        if count == 1:
            tally.first = _iou(ink[here], fault.truth[here])
        left = fault.wanted & (~ink if fault.to == "ink" else ink)
        if left.sum() <= _ENOUGH * fault.wanted.sum():
            tally.dabs = count
            break
    worse = _wrong(ink, fault.truth, rim) & ~ever & ~fault.wanted
    tally.harm = float(worse.sum() / fault.wanted.sum())
    return tally


def _eroded(mask: Bools) -> Bools:
    return ~_grown(~mask, _RIM)


def _wrong(ink: Bools, truth: Bools, rim: Bools) -> Bools:
    return np.asarray((ink != truth) & ~rim)


def _iou(a: Bools, b: Bools) -> float:
    return float((a & b).sum() / max(1, (a | b).sum()))


def row(name: str, written: WrittenPage, kind: str) -> None:
    """Print what the faults of a kind take on a page."""
    rng = np.random.default_rng(1)
    tallies, first = [], []
    for number, fault in enumerate(KINDS[kind](written, rng)):
        y, x = np.nonzero(_grown(fault.wanted, 2 * fault.page.x_height / fault.page.pixel))
        here = slice(int(y.min()), int(y.max()) + 1), slice(int(x.min()), int(x.max()) + 1)
        first.append(_iou(ink_of(fault.page)[here], fault.truth[here]))
        tallies.append([repaired(fault, kind, number, kept) for kept in (False, True)])
    if not tallies:
        print(f"{name:<10}{kind:<9}{0:>6}", flush=True)
        return
    was, is_ = zip(*tallies, strict=True)
    ms = [1000 * second for one in is_ for second in one.seconds]
    cells = [f"{name:<10}{kind:<9}{len(is_):>6}"]
    cells += [
        f"{_mean([one.dabs for one in some]):>7.1f}{sum(one.dabs == 1 for one in some):>5}" for some in (was, is_)
    ]
    cells += [f"{_mean(first):>8.3f}"] + [f"{_mean([one.first for one in some]):>7.3f}" for some in (was, is_)]
    cells += [f"{_mean([one.harm for one in some]):>8.3f}" for some in (was, is_)]
    print("".join(cells) + f"{statistics.median(ms):>7.0f}{max(ms):>6.0f}", flush=True)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))


def simulated() -> WrittenPage:
    """A page of the simulated author."""
    from benchmarks.tagger import TEXT
    from handout.hand.library import load
    from handout.inking.pen import usual
    from handout.page_sizes import page
    from handout.writing.layout import Layout
    from handout_lab.author import page_score
    from handout_lab.author.simulate import Desk, simulate

    layout = Layout(page("A6"), x_height=2.2, fit=True)
    desk = Desk(usual("ballpoint"), layout=layout)
    return page_score.read(simulate(TEXT, load("house-joined"), desk, rng=np.random.default_rng(3)))


def _read(path: Path) -> WrittenPage:
    return finish(find_ink(prepare(path, 300.0)))


def main() -> None:
    """Print the table."""
    print(
        f"{'':<19}{'faults':>6}{'before':>7}{'one':>5}{'now':>7}{'one':>5}{'IoU':>8}{'before':>7}{'now':>7}{'harm':>8}"
        f"{'now':>8}{'ms':>7}{'most':>6}"
    )
    pages: list[tuple[str, Callable[[], WrittenPage]]] = [("simulated", simulated)]
    if "HANDOUT_DATA" in os.environ:
        folder = Path(os.environ["HANDOUT_DATA"]) / "scans"
        pages += [
            (name.partition("/")[2][:5], partial(_read, folder / name))
            for name in (DEVELOPED if "--developed" in sys.argv else KEPT_OUT)
        ]
    for name, get in pages:
        written = get()
        for kind in KINDS:
            row(name, written, kind)


if __name__ == "__main__":
    main()
