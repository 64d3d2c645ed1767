"""What a caller wants written: a text as words, in a file or on standard input, or a file that holds a drawing."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from handout import atomic
from handout.errors import InputError, reported
from handout.pipeline.results import SILENT, Listener

if TYPE_CHECKING:
    from handout.letters import LetterFile
    from handout.values import Drawing

_MOST_TEXT = 2_000_000  # bytes; a longer file is surely not meant to be written by hand
_MOST_PIXELS = 50_000_000  # of a picture in a letter that was sent: more than any camera's print on a page shows
_LONGEST_NAME = 255  # bytes, of a file on the usual file systems
# of the files of drawings that `sources` reads, which is imported only where there is one
_DRAWINGS = (".svg", ".json", ".inkml", ".svc", ".gml")
LETTERS = (".md", ".markdown")
_NEARLY = 0.85  # likeness of names, as difflib has it: one letter of seven is wrong


@dataclass(frozen=True)
class Source:
    """What is to be written: a text, or the drawing or the letter file that it named.

    text : the text; of a drawing the name of its file.
    given : options that win over the head of a letter, see `pipeline.letters.prepare_letter`.
    """

    text: str
    drawing: Drawing | None = None
    letter: LetterFile | None = None
    given: frozenset[str] | None = None


def read_source(
    words: Sequence[str],
    file: str | None,
    listener: Listener = SILENT,
    given: frozenset[str] | None = None,
    *,
    svg_text: str = "leave",
) -> Source:
    """The text, the letter or the drawing that some words, or --file, mean.

    The listener hears what was left out of a drawing; `given` as in `Source`; `svg_text` : whether the texts of an SVG
    are kept to "write" them, or left out.

    Raises InputError: nothing to write, or a file that is missing or cannot be read.
    """
    drawing = _drawing(words, file, listener, texts=svg_text == "write")
    if drawing is not None:
        return Source(Path(file or words[0]).name, drawing)
    word = words[0] if len(words) == 1 and file is None else ""
    if word not in ("", "-") and is_file(word):
        listener.say(f"Reading the file {word}.")
        words, file = (), word
    return written_source(words, file, listener, given)


def written_source(
    words: Sequence[str], file: str | None, listener: Listener = SILENT, given: frozenset[str] | None = None
) -> Source:
    """The text or the letter that some words, or --file, mean; errors and the rest are those of `text_of`."""
    name = _single_name(words, file, LETTERS)
    if name is None or (file is None and not Path(name).is_file()):
        return Source(text_of(words, file, listener))
    from handout.letters import load

    letter = load(text_of((), name, listener), Path(name).name, Path(name).parent)
    return Source(letter.text, letter=letter, given=given)


def sent_source(text: str, letter: bool, pictures: Path | None = None) -> Source:
    """A text, or what a letter file says, that was sent from elsewhere: it leads to no file, and its head is heard.

    pictures : a folder with those that were sent with it.
    """
    if not letter:
        return Source(text)
    from handout.letters import load

    if pictures is not None:
        check_pictures(pictures)
    read = load(text, "The letter", pictures, alone=True)
    return Source(read.text, letter=read, given=frozenset())


def check_pictures(folder: Path) -> None:
    """Refuse what is no picture, whatever it is called, or takes more memory than a picture in a letter may."""
    from PIL import Image

    for path in folder.iterdir():
        try:
            with Image.open(path, formats=("PNG", "JPEG", "WEBP")) as picture:
                pixels = picture.width * picture.height
        except (OSError, ValueError, Image.DecompressionBombError) as error:
            raise InputError(f"{path.name} cannot be read: a letter takes pictures in PNG, JPEG and WebP.") from error
        if pixels > _MOST_PIXELS:
            most = _MOST_PIXELS / 1e6
            raise InputError(
                f"{path.name} has {pixels / 1e6:.0f} megapixels, {most:.0f} are the most: make it smaller."
            )


def _single_name(words: Sequence[str], file: str | None, suffixes: Sequence[str]) -> str | None:
    """What a single word, or --file, says, if it ends as names of such files do."""
    name = words[0] if len(words) == 1 and file is None else file if not words else None
    return name if name and len(name) <= _LONGEST_NAME and Path(name).suffix.lower() in suffixes else None


def text_of(words: Sequence[str], file: str | None, listener: Listener = SILENT) -> str:
    """The text to write: the words, a file, or standard input for ``-``; a single word may be the name of a file.

    Raises InputError: neither or both were given; a file that is missing, too long, a drawing, or not text; a single
    word that looks like the name of a file and is none: it would be written out.
    """
    if bool(words) == (file is not None):
        both = "Both a text and --file are given; give one of them."
        nothing = 'Nothing to write: give a text, --file letter.txt, or "-" to read standard input.'
        raise InputError(both if words else nothing)
    if file is None and len(words) == 1 and is_file(words[0]):
        file = words[0]
    if file is None and list(words) != ["-"]:
        _refuse_missing_file(" ".join(words))
        return " ".join(words)
    name = "standard input" if file in (None, "-") else str(file)
    if Path(name).suffix.lower() in _DRAWINGS:
        raise InputError(f"{name} is a drawing and no text: `handout plot {name}` draws it, `handout restyle` too.")
    with reported(f"read {name}"):
        data = sys.stdin.buffer.read(_MOST_TEXT + 1) if file in (None, "-") else Path(str(file)).read_bytes()
    return decode_text(data, name, listener)


def _refuse_missing_file(word: str) -> None:
    """Raise InputError if a word must mean a file, by suffix, folder or a file nearly so called, and is none."""
    path, near = Path(word), list[str]()
    if " " in word or len(word) > _LONGEST_NAME:
        return
    if path.suffix and path.parent.is_dir():
        near = difflib.get_close_matches(path.name, [file.name for file in path.parent.iterdir()], 1, _NEARLY)
    inside = path.parent != Path() and path.name and path.parent.is_dir()
    if near or inside or path.suffix.lower() in (*LETTERS, *_DRAWINGS, ".txt"):
        meant = f" (there is {path.parent / near[0]})" if near else ""
        raise InputError(f"There is no file {path}{meant}; to write these very words, give them through --file -.")


def decode_text(data: bytes, name: str, listener: Listener = SILENT) -> str:
    """The text in some bytes, whatever its encoding (see `handout.encodings`), without empty lines at its end.

    The listener hears of a guess at the encoding.

    Raises InputError: they are too many, or no text; `name` says where they come from.
    """
    if len(data) > _MOST_TEXT:
        raise InputError(f"{name} is longer than {_MOST_TEXT} bytes: write it in parts.")
    from handout import encodings

    try:
        reading = encodings.decode(data)
    except encodings.NoText as error:
        at = f" (line {error.line})" if error.line else ""
        raise InputError(f"{name} is not text{at}: {error}; save it as plain text, in UTF-8.") from error
    if reading.guessed:
        listener.note(f"{name} is not UTF-8 and was read as {reading.encoding}: check {reading.example!r}.")
    return reading.text.rstrip("\n")


def output_path(output: str | Path, suffix: str, what: str) -> Path:
    """The path of a file that is to be written and has to end so.

    Raises InputError: it ends otherwise, of which the message says `what` (is kept as, is shown as …), or cannot be
    written.
    """
    path = Path(output)
    if path.suffix.lower() != suffix:
        raise InputError(f"{path}: {what} {suffix}: use {path.stem}{suffix}.")
    atomic.check_writable(path)
    return path


def hand_path(output: str | Path) -> Path:
    """The path of a .hand file that is to be written."""
    return output_path(output, ".hand", "hands are kept as")


def read_bytes(path: str | Path) -> bytes:
    """What is in a file; InputError where it cannot be read."""
    with reported(f"read {path}"):
        return Path(path).read_bytes()


def is_file(word: str) -> bool:
    """Whether a text is the name of a file; most texts could not even be one."""
    try:
        return Path(word).is_file()
    except (OSError, ValueError):
        return False


def _drawing(words: Sequence[str], file: str | None, listener: Listener, *, texts: bool) -> Drawing | None:
    """The drawing that a single word (or --file) names, by a suffix of drawings; None where it is a text."""
    name = _single_name(words, file, _DRAWINGS)
    if name is None or (file is None and not Path(name).is_file()):
        return None
    from handout.sources import read_drawing

    drawing = read_drawing(name, texts=texts)
    if drawing.about.get("left_out"):
        listener.note(f"Left out of {name}: {', '.join(drawing.about['left_out'])}.")
    return drawing
