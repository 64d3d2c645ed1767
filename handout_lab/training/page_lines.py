"""Pictures of lines that people wrote, to train readers on: pages with ALTO files of what stands on them.

``python -m handout_lab.training.page_lines FOLDER --kept KEPT.npz -o LINES.npz`` makes a set of them.  Pages are read
as the product reads them, and a line is seen as the product sees it: drawn as it was traced, with its page's x-height,
slant and baselines.  It comes a second time with another pen's width, and a third time as its ink lies on the paper.

Left out: lines with words that were struck out or not read; printed and typewritten ones; text that several writers
share (a reader would learn its words); what the product's own lines do not find.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import regex

from handout import alphabet, markup
from handout.errors import InputError
from handout.reading import word_space
from handout.reading.word_space import ABOVE, HEIGHT, X_HEIGHT
from handout.scanning.checks import check_writing_size
from handout.scanning.line_graph import find_line_graph
from handout.scanning.picture_files import read_scan
from handout.scanning.scan import Scan
from handout.scanning.text_lines import line_owners
from handout.scanning.written_page import find_ink, prepare
from handout.tagging import line_space
from handout.tagging.line_space import LineFrame
from handout.values import Array, LineGraph
from handout_lab.training.word_pictures import WordPicture, save

_DPI = 300.0  # of pages whose files do not say
_WRITER = regex.compile(r"\d{4}")  # in the names of files: whose page it is
_LABEL = regex.compile(r"wikitexte")  # in lines that say which text was copied
_SHARED, _PHRASE = 4, 4  # writers who share so many words in a row were given them
_NEAR = 0.5  # x-heights between a line of the ALTO file and one that was found
_SHORT = 3  # letters: shorter lines are numbers of pages, and marks
_ROOM = 10  # columns of paper left and right of a line
_THINNER, _THICKER = 0.5, 1.7  # factors of the pen's width
_NOT_BY_HAND = ("Print", "Typewritten")  # ends of labels of lines
_DARK = 40  # grey levels under the paper: a printed rule is no paler
_RULE, _GAP, _THICK = 161, 9, 9  # pixels at 300 dpi: how long a rule is at least, its gaps, more than its thickness
_CROSSED = 6  # pixels over and under a rule where a stroke that crosses it is seen


@dataclass(frozen=True, eq=False)
class Transcribed:
    """A line as its ALTO file has it: its text, and its baseline (n, 2) in pixels of the file's picture."""

    text: str
    baseline: Array


def read_alto(path: Path) -> list[Transcribed]:
    """The lines of a page that were written by hand.

    Raises
    ------
    InputError
        The file is no XML.
    """
    root = markup.parse(path.read_bytes(), "an ALTO file")
    printed = {
        tag.get("ID") for tag in root.iter("OtherTag") if str(tag.get("LABEL")).rpartition(":")[2] in _NOT_BY_HAND
    }
    lines = []
    for line in root.iter("TextLine"):
        text = " ".join(str(part.get("CONTENT")) for part in line.iter("String")).strip()
        places = np.array(line.get("BASELINE", "").replace(",", " ").split(), dtype=np.float64)
        if text and not _LABEL.search(text) and len(places) >= 4 and not printed & set(line.get("TAGREFS", "").split()):
            lines.append(Transcribed(text, places.reshape(-1, 2)))
    return lines


def writer_of(path: Path) -> str:
    """Who wrote a page: the number in its name, or the name."""
    found = _WRITER.search(path.stem)
    return found.group() if found else path.stem


def kept_apart(writers: Sequence[str]) -> set[str]:
    """Every fourth of some writers, by name: what is trained on the others is judged by these."""
    return set(sorted(set(writers))[3::4])


def shared_phrases(pages: dict[Path, list[Transcribed]]) -> set[str]:
    """Words in a row that several writers wrote."""
    of_phrase = defaultdict[str, set[str]](set)
    for path, lines in pages.items():
        for line in lines:
            for phrase in _phrases(line.text):
                of_phrase[phrase].add(writer_of(path))
    return {phrase for phrase, writers in of_phrase.items() if len(writers) >= _SHARED}


def _phrases(text: str) -> list[str]:
    words = regex.findall(r"\w+", text.lower())
    return [" ".join(words[k : k + _PHRASE]) for k in range(len(words) - _PHRASE + 1)]


def usable(text: str, shared: set[str]) -> bool:
    """Whether a line may be learned from: all of it is read, and most of it is its writer's own."""
    phrases = _phrases(text)
    own = not phrases or sum(phrase in shared for phrase in phrases) < len(phrases) / 2
    known = all(alphabet.fold(letter) != alphabet.JUNK for letter in text)
    return own and known and not set(text) & set("<>⋎#") and sum(map(str.isalnum, text)) >= _SHORT


def line_pictures(
    path: Path, lines: Sequence[Transcribed], shared: set[str], rng: np.random.Generator
) -> Iterator[WordPicture]:
    """Of each usable line of a page that is found: as traced, with another pen, and as its ink lies on the paper.

    Raises
    ------
    InputError
        The page is not read.
    """
    page = find_ink(prepare(without_print(read_scan(path, _DPI), lines)), lines=len(lines))
    scan = page.prepared.scan
    check_writing_size(page.text_lines, scan)
    graph = find_line_graph(scan, page.mask, page.density)
    frames = line_space.frames_of(page.text_lines, scan.pixel)
    owners = line_owners(page.mask.ink, frames)
    of_vertex = line_space.lines_at(owners, graph.uv)
    for line in (line for line in lines if usable(line.text, shared)):
        places = line.baseline - np.array(scan.origin)
        x = np.linspace(places[0, 0], places[-1, 0], 20)
        y = np.interp(x, *places.T)
        off = [float(np.abs(frame.base(x) - y).mean()) / frame.x_height for frame in frames]
        number = int(np.argmin(off)) if off else -1
        if number < 0 or off[number] > _NEAR:
            continue
        frame = frames[number]
        ends = float(x[0]) - frame.x_height, float(x[-1]) + frame.x_height
        text = "".join(map(alphabet.fold, " ".join(line.text.split())))
        another = float(np.exp(rng.uniform(np.log(_THINNER), np.log(_THICKER))))
        pictures = [_traced(graph, scan.pixel, frame, of_vertex == number, ends, pen) for pen in (1.0, another)]
        for picture in [*pictures, _inked(np.asarray(page.density.values, np.float64), frame, owners == number, ends)]:
            if picture is not None and picture.any():
                even = np.rint(word_space.normalised(picture) * 255).astype(np.uint8)
                yield WordPicture(even, text, f"{writer_of(path)} {path.stem}")


def without_print(scan: Scan, lines: Sequence[Transcribed]) -> Scan:
    """A page without what is printed in the colour of its ink: rules, and all that stands above and under its lines."""
    grey = scan.rgb.min(axis=2)
    dark = (grey < int(np.median(grey)) - _DARK).astype(np.uint8)
    whole = cv2.morphologyEx(dark, cv2.MORPH_CLOSE, np.ones((1, _GAP), np.uint8))
    long = cv2.morphologyEx(whole, cv2.MORPH_OPEN, np.ones((1, _RULE), np.uint8))
    rules = cv2.bitwise_and(long, 1 - cv2.morphologyEx(long, cv2.MORPH_OPEN, np.ones((_THICK, 1), np.uint8)))
    crossed = np.roll(dark, _CROSSED, axis=0) & np.roll(dark, -_CROSSED, axis=0)
    crossed = cv2.dilate(crossed, np.ones((1, 3), np.uint8))
    gone = (cv2.dilate(rules, np.ones((5, 5), np.uint8)) > 0) & (crossed == 0)
    heights = np.array([float(line.baseline[:, 1].mean()) for line in lines])
    pitch = float(np.median(np.diff(np.sort(heights)))) if len(heights) > 1 else float(scan.shape[0])
    gone[: max(int(heights.min() - pitch), 0)] = gone[int(heights.max() + pitch) :] = True
    rgb = scan.rgb.copy()
    rgb[gone] = np.median(scan.rgb.reshape(-1, 3)[::97], axis=0).astype(np.uint8)
    return Scan(rgb, scan.dpi, scan.source)


def _traced(
    graph: LineGraph, pixel: float, frame: LineFrame, own: Array, ends: tuple[float, float], pen: float
) -> Array | None:
    """(HEIGHT, w): the lines of a line, drawn by a pen so many times as wide."""
    x, y = graph.uv.T
    up = frame.base(x) - y
    foot = x - frame.slant * up
    vertices = np.flatnonzero(own & (foot > ends[0]) & (foot < ends[1]))
    if not len(vertices):
        return None
    scale = X_HEIGHT / frame.x_height
    places = np.column_stack([foot[vertices], up[vertices]]) * scale
    radius = graph.radius[vertices] / pixel * scale * pen
    return word_space.drawn(places, radius, graph.edges_between(vertices))


def _inked(values: Array, frame: LineFrame, own: Array, ends: tuple[float, float]) -> Array:
    """(HEIGHT, w): the ink of a line as it lies on the paper, and a pixel around it."""
    scale = frame.x_height / X_HEIGHT  # pixels of the page one of word space
    near = cv2.dilate(own.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    density = np.where(near, values, 0.0)
    if scale > 1:
        density = np.asarray(cv2.GaussianBlur(density, (0, 0), 0.45 * scale), np.float64)
    width = int((ends[1] - ends[0]) / scale)
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(HEIGHT))
    up = (ABOVE - v) * scale
    x = ends[0] + u * scale + frame.slant * up
    y = frame.base(x) - up
    picture = cv2.remap(density, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR)
    inked = np.flatnonzero(picture.max(axis=0) > 0.2)
    if not len(inked):
        return np.zeros((HEIGHT, 1))
    return np.asarray(picture[:, max(inked[0] - _ROOM, 0) : inked[-1] + _ROOM], np.float64)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make a set and write it, and another of the writers that are kept apart."""
    parser = argparse.ArgumentParser(
        prog="python -m handout_lab.training.page_lines", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("folder", type=Path, help="of pages, .jpg, and beside each an ALTO file, .xml")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the .npz to write")
    parser.add_argument("--kept", type=Path, help="the .npz of every fourth writer; without it all go into one")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    pages = {path.with_suffix(".jpg"): read_alto(path) for path in sorted(options.folder.glob("*.xml"))}
    apart = kept_apart([writer_of(path) for path in pages]) if options.kept else set()
    shared = shared_phrases(pages)
    sets: dict[Path, list[WordPicture]] = {options.output: []} | ({options.kept: []} if options.kept else {})
    for number, (path, lines) in enumerate(pages.items()):
        into = options.kept if writer_of(path) in apart else options.output
        rng = np.random.default_rng((options.seed, number))
        try:
            found = list(line_pictures(path, lines, shared, rng)) if lines else []
        except InputError as error:
            found = []
            print(error, file=sys.stderr)
        sets[into] += found
        print(f"{path.name}: {len(found) // 3} of {len(lines)} lines", file=sys.stderr, flush=True)
    for into, pictures in sets.items():
        save(pictures, into)
        print(f"{into}: {len(pictures)} pictures", file=sys.stderr)


if __name__ == "__main__":
    main()
