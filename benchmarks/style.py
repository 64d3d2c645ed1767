"""Learned styles: what is predicted of kept-out strokes, whether styles are told apart, whether words still read.

Examples are pages of built-in hands and tags in styles of rules, other ones for learning than for judging; real tags
and pages are read from the folder in HANDOUT_DATA (``pen``), if it is there, and nothing of them is kept.  Pictures
after the figures of seed 002 go into the folder ``style-pictures``.
"""

from __future__ import annotations

import os
import runpy
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace as replaced

from handout.motion.learned import dynamics, sequences, structure, training
from handout.motion.learned.dynamics import DynamicsModel
from handout.motion.learned.model import LearnedMovement, learn, taken_apart
from handout.motion.learned.sequences import INPUTS, MovementSequence
from handout.motion.reconstruction import planned_page
from handout.motion.styles.asemic import glyph, tag
from handout.motion.styles.learned_movement import through_targets
from handout.motion.styles.restyling import restyle
from handout.motion.styles.style import Style, find
from handout.motion.styles.targets import letter_height
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.writing import drawings
from handout.sinks import write_drawings
from handout.sources import read_drawing
from handout.values import Array, Drawing, Page, Stroke
from handout_lab.reading import pen_paths
from handout_lab.training.styles import tags, written

_TAGS = ("fast-tag", "blackletter", "calm")
_WORDS = 60  # that are restyled and read
_BINS = ((0.0, 0.3, 0.45, 0.6, 0.8, 1.1, 9.0), (-3.0, -1.2, -0.6, -0.2, 0.2, 0.6, 1.2, 3.0))  # Δt, θ: of histograms
_SIX = "the old harbour bell rings twice"
_CELL = 420, 250  # pixels of a picture on a sheet
_RULE = np.array([[0, 30], [8, 0], [16, 30], [24, 0], [32, 30], [42, 8], [38, 30], [54, 30], [60, 6]], dtype=float)


def folder() -> Path:
    return Path(os.environ.get("HANDOUT_DATA", "data")) / "pen"


def sequence(drawing: Drawing) -> MovementSequence:
    return sequences.of_plans(taken_apart(drawing, letter_height(drawing)))


@cache
def pages() -> tuple[MovementSequence, MovementSequence]:
    """Two pages of a joined hand, of other sentences, as one learns from and is judged on."""
    learned, judged = (written("house-joined", n, np.random.default_rng(s)) for n, s in ((140, 7), (80, 8)))
    return sequence(learned), sequence(judged)


@cache
def tagged(name: str) -> tuple[tuple[MovementSequence, ...], tuple[MovementSequence, ...]]:
    """Twenty tags of a style to learn from, and ten others."""
    rng = np.random.default_rng(sum(map(ord, name)))
    every = tuple(sequence(drawing) for drawing in tags(name, 30, rng))
    return every[:20], every[20:]


def on_paper(each: Sequence[MovementSequence]) -> tuple[Array, Array]:
    """Δt and θ: (n, 2) of the strokes that have both, and (m,) θ of those that begin a movement."""
    both = [np.column_stack([s.dt, s.theta])[~s.up & ~s.starts] for s in each]
    return np.concatenate(both), np.concatenate([s.theta[s.starts] for s in each])


def agreement(model: DynamicsModel, judged: Sequence[MovementSequence]) -> tuple[float, float]:
    """r of θ and Δt with what the model expects."""
    found = [model.predict_means(s) for s in judged]
    bend = [(e[~s.up, 1], s.theta[~s.up]) for e, s in zip(found, judged, strict=True)]
    late = [(e[~s.up & ~s.starts, 0], s.dt[~s.up & ~s.starts]) for e, s in zip(found, judged, strict=True)]
    theta, dt = (np.concatenate([np.column_stack(pair) for pair in each]) for each in (bend, late))
    return float(np.corrcoef(theta.T)[0, 1]), float(np.corrcoef(dt.T)[0, 1])


def surprise(model: DynamicsModel, judged: Sequence[MovementSequence]) -> float:
    """−log density, nat a stroke."""
    return -float(np.concatenate([model.log_densities(s) for s in judged]).mean())


def of_one_gaussian(learned: Sequence[MovementSequence], judged: Sequence[MovementSequence]) -> float:
    """The same of one Gaussian."""
    (known, first), (new, begun) = on_paper(learned), on_paper(judged)
    mean, shape = known.mean(axis=0), np.cov(known.T)
    off = new - mean
    log = -0.5 * np.einsum("ni,ij,nj->n", off, np.linalg.inv(shape), off) - 0.5 * np.log(
        np.linalg.det(2 * np.pi * shape)
    )
    other = -0.5 * (begun - first.mean()) ** 2 / first.var() - 0.5 * np.log(2 * np.pi * first.var())
    return -float(np.concatenate([log, other]).mean())


def _learn(examples: Sequence[MovementSequence], **more: Any) -> DynamicsModel:
    return dynamics.learn([sequences.join_sequences(examples)], np.random.default_rng(0), **more)


def prediction() -> None:
    """From one page to another; the paper's inputs beside."""
    (one, other), real = pages(), folder() / "unipen" / "data" / "1a" / "art"
    print(f"from {int((~one.up).sum())} strokes of a page to {int((~other.up).sum())} of another:")
    for inputs in INPUTS:
        began = time.process_time()
        model = _learn([one], inputs=inputs)
        theta, dt = agreement(model, [other])
        more = surprise(model, [other]) - of_one_gaussian([one], [other])
        took = time.process_time() - began
        print(f"  {inputs:22} θ r {theta:.2f}  Δt r {dt:.2f}  nat against one Gaussian {more:+.2f}  in {took:.0f} s")
    if real.is_dir():
        a, b = (sequence(read_drawing(real / f"art01{part}.dat")) for part in ("trn", "tst"))
        model = _learn([a])
        theta, dt = agreement(model, [b])
        more = surprise(model, [b]) - of_one_gaussian([a], [b])
        print(f"  a real page (UNIPEN), {int((~a.up).sum())} strokes: θ r {theta:.2f}  Δt r {dt:.2f}  {more:+.2f} nat")


def telling_apart() -> None:
    """From twenty tags each: kept-out tags under their own style's model and under the others'."""
    models = {name: _learn(tagged(name)[0]) for name in _TAGS}
    for name in _TAGS:
        own = surprise(models[name], tagged(name)[1])
        others = [f"{other} {surprise(models[other], tagged(name)[1]) - own:+.2f}" for other in _TAGS if other != name]
        plain = of_one_gaussian(*tagged(name))
        print(f"  {name:9} own {own:+.2f} nat a stroke, one Gaussian {plain - own:+.2f}; {', '.join(others)}")


def recognition() -> None:
    """Targets that nobody has written, moved through primed with each of four manners: whose histogram the result has.

    Told from the histograms of the manners' examples, and from those of other targets moved through primed alike.
    """
    manner = find("learned").model
    assert isinstance(manner, LearnedMovement)
    names = (*_TAGS, "house-joined")
    thrown = [
        sequences.of_targets([np.concatenate([glyph(5, r) + np.array([k, 0.0]) for k in range(5)])])
        for r in _generators(40)
    ]
    made = {name: [_moved(manner, name, targets) for targets in thrown] for name in names}
    examples = {name: _histogram(tagged(name)[0] if name in _TAGS else pages()[:1]) for name in names}
    alike = {name: _histogram(each[20:]) for name, each in made.items()}
    for title, known in (("their examples", examples), ("other targets primed alike", alike)):
        right = 0
        for name in names:
            for one in made[name][:20]:
                counts = _histogram([one], smooth=0.0)
                scores = {other: float((counts * np.log(shares)).sum()) for other, shares in known.items()}
                right += max(scores, key=scores.__getitem__) == name
        print(f"primed manner of four told by its histogram, from those of {title}: {right / 80:.0%}")


def _generators(count: int) -> list[np.random.Generator]:
    return [np.random.default_rng(seed) for seed in range(count)]


def _moved(manner: LearnedMovement, name: str, targets: MovementSequence) -> MovementSequence:
    return manner.dynamics.predict(targets, np.random.default_rng(5), 1.0, manner.state(manner.primers[name]))


def _histogram(each: Sequence[MovementSequence], smooth: float = 1.0) -> Array:
    dt, theta = on_paper(each)[0].T
    counts = np.histogram2d(dt, theta, bins=[np.array(edges) for edges in _BINS])[0] + smooth
    return np.asarray(counts / counts.sum() if smooth else counts)


def words(drawing: Drawing) -> list[list[Array]]:
    return [[s.xy for s in each] for _, each in groupby(drawing.strokes, key=lambda stroke: stroke.word)]


def legibility() -> None:
    """Words restyled at temperature .5 against the same words before, both by this project's reader of paths."""
    text = (Path(__file__).parent / "three-hundred-words.txt").read_text(encoding="utf-8").split()[:_WORDS]
    for hand in ("house-print", "house-joined"):
        given = drawings(" ".join(text), WritingOptions(hand=hand, seed=3), SheetOptions("A4"))[0]
        line = [f"words in {hand} that read: {_read(given, text)} before"]
        rules = {f"in {name} by rules": find(name) for name in ("fast-tag", "calm")}
        manners = {f"primed with {p}": _primed(find("learned"), p, temperature=0.5) for p in ("fast-tag", "calm", hand)}
        for manner, style in (rules | manners).items():
            now = _read(restyle(given, style, np.random.default_rng(1)), text)
            line.append(f"{now} {manner}")
        print("; ".join(line) + f"; of {len(text)}")


def _read(drawing: Drawing, text: Sequence[str]) -> int:
    read = [pen_paths.read(word).text.casefold() for word in words(drawing)]
    return sum(a == b.casefold() for a, b in zip(read, text, strict=True))


def _primed(style: Style, primer: str, **changed: float) -> Style:
    return replaced(style, learned=replaced(style.learned, primer=primer, **changed))


def speed() -> None:
    """One-shot training, and a step of inference with its draw."""
    one = tagged("fast-tag")[0][0]
    began = time.process_time()
    rng = np.random.default_rng(0)
    model = dynamics.learn([one], rng)
    middle = time.process_time()
    structure.learn([one], rng)
    print(f"one tag: dynamics in {middle - began:.1f} s, structure in {time.process_time() - middle:.1f} s of CPU")
    row = np.zeros(sequences.columns("ahead"), np.float32)
    steps = sequences.join_sequences(tagged("fast-tag")[0])
    alone, whole = (_fastest(work) for work in (lambda: model.runner.step(row), lambda: model.predict(steps, rng)))
    print(f"inference: {1e6 * alone:.0f} µs a step, {1e6 * whole / len(steps.up):.0f} µs with its features and draw")


def _fastest(work: Callable[[], object]) -> float:
    """s of CPU: the least mean of ten runs of a hundred, or of one where one is long."""
    times = []
    for _ in range(10):
        began, count = time.process_time(), 0
        while time.process_time() - began < 0.02:
            work()
            count += 1
        times.append((time.process_time() - began) / count)
    return min(times)


Panel = tuple[str, Drawing]


def figures() -> None:
    """Sheets after figures 1, 2, 6, 7 and 9 to 14 of seed 002."""
    rng, here = np.random.default_rng(4), Path("style-pictures")
    here.mkdir(exist_ok=True)
    learned = find("learned")
    given = drawings("Graffiti", WritingOptions(hand="house-joined", seed=3), SheetOptions("90x40mm"))[0]
    line = drawings(_SIX, WritingOptions(hand="house-print", seed=3), SheetOptions("A6"))[0]
    example, complex_tag = (next(tags(name, 1, np.random.default_rng(9))) for name in ("scrawl", "fast-tag"))
    names, fitted = learned_names(learned), planned_page.fit(given, timed=False)
    one_shot = [
        (name, _one_shot(next(tags(name, 1, np.random.default_rng(k))))) for k, name in enumerate(("scrawl", "calm"))
    ]
    page = Page(130.0, 100.0)
    rows: list[list[Panel]] = [
        [("1: as written", given)]
        + [(f"1: primed with {name}", _on(given, _primed(learned, name, keep=0.3), rng)) for name in names],
        [("2, 6: reconstruction, virtual targets", _with_targets(planned_page.drawing(fitted), fitted))]
        + [
            ("7: varied", planned_page.drawing(planned_page.vary_page(fitted, training.PlanVariation(), rng)))
            for _ in range(3)
        ],
        [
            (f"9: one {name} tag learned", Drawing(through_targets([_RULE + 30], style, rng, 30.0), page))
            for name, style in one_shot
        ]
        + [
            (f"10: primed with {name}", Drawing(through_targets([_RULE + 30], _primed(learned, name), rng, 30.0), page))
            for name in names[:4]
        ],
        [
            (
                f"11: seed {k}",
                Drawing(
                    through_targets([_RULE + 30], _warm(one_shot[0][1], 1.0), np.random.default_rng(k), 30.0), page
                ),
            )
            for k in range(5)
        ],
        [
            ("12: a complex tag", complex_tag),
            ("12: the example", example),
            ("12: as the paper has it", _on(complex_tag, _warm(one_shot[0][1], 1.0, hold=0.0, keep=0.0), rng)),
            ("12: with places and bends kept", _on(complex_tag, one_shot[0][1], rng)),
        ],
        [
            ("13: a line", line),
            ("13: primed with calm", _on(line, _primed(learned, "calm", keep=0.3), rng)),
            ("13: one scrawl tag learned", _on(line, _warm(one_shot[0][1], 0.5, keep=0.3), rng)),
        ],
        [
            (f"14: structure of {built}, movement of {moved}", _mixed(learned, built, moved, k))
            for k, (built, moved) in enumerate((a, b) for a in _TAGS[:2] for b in ("blackletter", "calm", "fast-tag"))
        ],
    ]
    gml = folder() / "gml" / "nothub"
    if gml.is_dir():
        real = [read_drawing(path) for path in sorted(gml.glob("temptTag-2010_6*.gml"))[:2]]
        rows.append([("a real tag", d) for d in real])
        rows[-1] += [("learned from it: a word", _on(given, _one_shot(d), rng)) for d in real]
    _sheet(rows, here / "sheet.png")
    _sheet([rows[0], rows[2], rows[3], rows[6]], here / "learned-styles.png")
    print(f"wrote {here / 'sheet.png'}")


def manners() -> None:
    """A sheet of four unlike drawings, of which one style is learned, and of what it makes when each of them primes."""
    example = runpy.run_path(str(Path(__file__).parents[1] / "tests/motion/styles/manners.py"))
    kinds = example["KINDS"]
    each = {kind: [example["draw_example"](kind)] for kind in kinds}
    style = Style(title="four", model=learn(each, np.random.default_rng(1)).movement, brush=find("learned").brush)
    rows: list[list[Panel]] = []
    for kind, following in zip(kinds, [*kinds[1:], kinds[0]], strict=True):
        primed = _primed(style, kind)
        tags_ = [(f"prime {kind}, temperature {warm}", _primed(style, kind, temperature=warm)) for warm in (0.1, 1.0)]
        rows.append([(f"example: {kind}", each[kind][0])])
        rows[-1] += [(name, tag(5, warm, Page(148.0, 105.0), np.random.default_rng(2), warm)) for name, warm in tags_]
        mixed = tag(5, primed, Page(148.0, 105.0), np.random.default_rng(2), _primed(style, following))
        rows[-1] += [(f"{kind}, built like {following}", mixed)]
    Path("style-pictures").mkdir(exist_ok=True)
    _sheet(rows, Path("style-pictures") / "four-manners.png")


def learned_names(style: Style) -> list[str]:
    assert style.model is not None
    return list(style.model.primers)


def _one_shot(drawing: Drawing) -> Style:
    """A style learned from one drawing."""
    seen, rng = sequence(drawing), np.random.default_rng(0)
    model = LearnedMovement(dynamics.learn([seen], rng), None, {"it": seen})
    return replaced(find("learned"), model=model, name="one")


def _warm(style: Style, temperature: float, **changed: float) -> Style:
    return replaced(style, learned=replaced(style.learned, temperature=temperature, **changed))


def _on(drawing: Drawing, style: Style, rng: np.random.Generator) -> Drawing:
    return restyle(drawing, style, rng)


def _mixed(style: Style, built: str, moved: str, seed: int) -> Drawing:
    return tag(5, _primed(style, moved), Page(148.0, 105.0), np.random.default_rng(seed), _primed(style, built))


def _with_targets(drawing: Drawing, page: planned_page.PlannedPage) -> Drawing:
    """A drawing and the virtual targets of its plans, as polygons."""
    lines, clock = list(drawing.strokes), drawing.duration
    for fit in page.fits:
        clock += 1.0
        targets = fit.plan.targets
        lines.append(
            Stroke(np.asarray(clock + 0.01 * np.arange(len(targets))), targets, width=np.full(len(targets), 0.15))
        )
    return Drawing(tuple(lines), drawing.page)


def _sheet(rows: Sequence[Sequence[Panel]], path: Path) -> None:
    from PIL import Image, ImageDraw, ImageFont, ImageOps

    wide, high = _CELL
    sheet = Image.new("RGB", (wide * max(map(len, rows)), high * len(rows)), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=15)
    look = replace(PictureOptions(pen="plain", pen_width=0.3).look(), dpi=250)
    with tempfile.TemporaryDirectory() as place:
        for j, row in enumerate(rows):
            for i, (caption, drawing) in enumerate(row):
                (file,) = write_drawings([drawing], [Path(place) / "one.png"], look)
                with Image.open(file) as picture:
                    seen = picture.convert("RGB")
                ink = np.argwhere(np.asarray(seen.convert("L")) < 200)
                (top, left), (foot, right) = ink.min(axis=0), ink.max(axis=0) + 1
                seen = seen.crop((left - 9, top - 9, right + 9, foot + 9))
                seen = ImageOps.contain(seen, (wide - 20, high - 40))
                sheet.paste(seen, (i * wide + 10, j * high + 26))
                pen.text((i * wide + 8, j * high + 6), caption, fill="black", font=font)
    sheet.save(path)


def main() -> None:
    prediction()
    print("from twenty tags of each style, on ten others; of other models, how much more a stroke surprises:")
    telling_apart()
    recognition()
    legibility()
    speed()
    figures()
    manners()


if __name__ == "__main__":
    main()
