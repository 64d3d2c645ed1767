"""What strangers misread: words that were made in people's hands, as strangers read them, and the weights they teach.

``python -m handout_lab.training.misread_words`` fits the weights of `handout.reading.misreading` to the table of this
folder and writes them.  A row is a word: hand, word, what a stranger read, and, letter by letter, in thousandths, how
often its glyph and its letter are misread in that hand, and how probably it is another to the first reader and to the
second.  With ``--hand FILE --read LINES --seed N`` rows of one more hand are printed: LINES has a word and its reading
a line, of the words that ``handout write --fallback --seed N`` made of the first column, a paragraph each; it needs
both readers.

The table's words were made in the hands of eleven writers of Copiste (CC BY 4.0; docs/notices.md), each by a page, and
read, shuffled with words cut from those pages, by a language model that saw pictures alone and was told to spell: 83 of
1,120 otherwise than they were meant.  Letters that are quite wrong are rare among them; so some words come again under
a text with one letter changed, read as what they are (their hand has a star), and count a tenth.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path

import msgspec
import numpy as np

from handout import atomic
from handout.completion.completed_hand import complete_hand
from handout.pipeline import rereading
from handout.pipeline.options import WritingOptions
from handout.pipeline.texts import prepare
from handout.reading.misreading import WEIGHTS, MisreadWeights, odds, shares_seen
from handout.reading.pictures import PictureReading
from handout.values import Array
from handout.writing.compose import each_page
from handout.writing.legibility import misread_shares

TABLE = Path(__file__).parent / "misread_words.tsv"
_CHANGED = 0.1  # what a word under a changed text counts; from .1 to .3 nothing changes
_RIVALS = 5  # letters that are the likeliest in a letter's place, one of which it is changed to
_FALSE = 0.02  # of words that are read right, how many are told of
_AGAIN = 0.1  # of all words, how many are written again
_STRENGTH = 0.3  # a variance: how far from 0 weights may be
_DIGITS = 3


@dataclass(frozen=True, eq=False)
class LabelledWord:
    """A word and what a stranger read. hand : with a star, of a changed text; shares : (4, letters)."""

    hand: str
    word: str
    read: str
    shares: Array

    def row(self) -> str:
        """As the table has it."""
        figures = (",".join(f"{1000 * share:.0f}" for share in line) for line in self.shares.tolist())
        return "\t".join((self.hand, self.word, self.read, *figures))

    def missed(self) -> Array:
        """(letters,) bool: which were read as something else; of one too many the letter before it."""
        missed = np.zeros(len(self.word), dtype=bool)
        for _, first, last, begin, end in SequenceMatcher(None, self.word, self.read, False).get_opcodes():
            if self.word[first:last] != self.read[begin:end]:
                missed[max(min(first, len(missed) - 1) - (first == last), 0) : max(last, 1)] = True
        return missed


def read_table(path: Path) -> list[LabelledWord]:
    """The words of a table."""
    words = []
    for line in path.read_text(encoding="utf-8").splitlines():
        hand, word, read, *shares = line.split("\t")
        thousandths = np.array([[float(x) for x in row.split(",")] for row in shares])
        words.append(LabelledWord(hand, word, read, thousandths / 1000))
    return words


def written_words(path: Path, read: Sequence[tuple[str, str]], seed: int) -> Iterator[LabelledWord]:
    """The words of a hand with what was read, as they are written with a seed."""
    task = prepare(WritingOptions(hand=str(path), seed=seed, fallback=True))
    author, text = task.hand, "\n\n".join(word for word, _ in read)
    hand, _ = complete_hand(author, text, fallback=True, seed=seed)
    assert author.pages is not None and hand.pages is not None, "a drawn hand is misread by nobody"
    rereader = rereading.Rereader(hand, author, rereading.SETTINGS.tries)
    list(each_page(text, hand, task.layout, np.random.default_rng([seed]), fallback=True, proofread=rereader))
    of_glyph, of_letter = misread_shares(author)
    rng = np.random.default_rng(seed)

    def shares_of(readings: Sequence[PictureReading], text: str) -> Array:
        return np.array([shares_seen([reading], [text])[0] for reading in readings])

    pictures = rereading.read([word.picture for word in rereader.words])
    for count, (word, readings, (_, seen)) in enumerate(zip(rereader.words, pictures, read, strict=True)):
        lent = word.numbers >= len(of_glyph)
        own = np.where(lent, 0, word.numbers)
        known = [np.where(lent, of_glyph.mean(), shares[own]) for shares in (of_glyph, of_letter)]
        text, at = word.text, int(rng.integers(len(word.text)))
        yield LabelledWord(path.stem, text, seen, np.vstack([*known, shares_of(readings, text)]))
        rivals = list(filter(str.islower, readings[0].rivals(text, _RIVALS)[at]))
        if count % 2 == 0 and rivals:
            changed = text[:at] + str(rng.choice(rivals)) + text[at + 1 :]
            yield LabelledWord(f"{path.stem}*", changed, text, np.vstack([*known, shares_of(readings, changed)]))


def fit(words: Sequence[LabelledWord], readers: int) -> MisreadWeights:
    """The weights for so many readers."""
    from sklearn.linear_model import LogisticRegression

    rows = [odds(word.shares[: 2 + readers]).T for word in words]
    missed = [word.missed() for word in words]
    changed = np.array([word.hand.endswith("*") for word in words])
    counts = np.repeat(np.where(changed, _CHANGED, 1.0), [len(row) for row in rows])
    model = LogisticRegression(C=_STRENGTH, max_iter=1000)
    model.fit(np.vstack(rows), np.concatenate(missed), sample_weight=counts)
    wrong = np.array([1 - np.prod(1 - model.predict_proba(row)[:, 1]) for row in rows])[~changed]
    right = np.array([not each.any() for each in missed])[~changed]
    told, again = np.quantile(wrong[right], 1 - _FALSE), np.quantile(wrong, 1 - _AGAIN)
    constant, (glyph, letter, *seen) = model.intercept_.item(), model.coef_[0].round(_DIGITS).tolist()
    figures = (round(float(x), _DIGITS) for x in (told, min(again, told)))
    return MisreadWeights(round(constant, _DIGITS), glyph, letter, tuple(seen), *figures)


def main() -> None:
    """Fit the weights, or print rows of a hand."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hand", type=Path)
    parser.add_argument("--read", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    if given.hand:
        read = [tuple(line.split()) for line in given.read.read_text(encoding="utf-8").splitlines()]
        for word in written_words(given.hand, [(word, seen) for word, seen in read], given.seed):
            print(word.row())
        return
    words = read_table(TABLE)
    lines = ["# Made by `python -m handout_lab.training.misread_words`; `handout.reading.misreading` says what it is."]
    for name, readers in (("one", 1), ("two", 2)):
        figures = msgspec.structs.asdict(fit(words, readers)).items()
        lines += ["", f"[{name}]", *(f"{key} = {msgspec.json.encode(value).decode()}" for key, value in figures)]
    atomic.write(WEIGHTS, ("\n".join(lines) + "\n").encode())


if __name__ == "__main__":
    main()
