"""Who sees what: snippets dealt to people, balanced and in an order of chance; and the key, sealed by the study's name.

Questionnaire A asks of single snippets whether each is real or made, B which of two of the same words is made, E the
same of envelopes.  Over all people every snippet is real in A, made in A, made on the left of B and made on the right
as often as any other of its fold, but for one at most; or everybody's are drawn by chance from all.  Nobody meets a
snippet twice.

The key says what is true of every row of every sheet.  It is a file of its own, packed so that nobody reads it by
accident, but under no password: who makes a study has to be able to open it, and a password would guard it against
nobody else.  What guards it is that the study is *named* by the key: the name printed on each sheet and kept with each
answer is the beginning of the SHA-256 of the file, so a key that was changed after printing is of no study any more.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np

from handout import atomic
from handout.errors import InputError
from handout.values import Array, Indices

SINGLES, PAIRS, ENVELOPES = "A", "B", "E"
REAL, MADE, LEFT, RIGHT = "real", "made", "left", "right"
ROLES = ((SINGLES, REAL), (SINGLES, MADE), (PAIRS, LEFT), (PAIRS, RIGHT))
# how the made snippet of an item came to be: in the hand, in another person's, or of letters taken by chance
OURS, CONTROL, RANDOM = "made", "control", "random"
BALANCED, DRAWN = "balanced", "random"  # how snippets are dealt
SAMPLINGS = (BALANCED, DRAWN)
ID = 12  # hexadecimal digits of the hash that name a study
_MAGIC = b"handout study key 1\n"
_MOST = 50_000_000  # bytes of an unpacked key: what is longer is none of ours
_UNEVEN, _OFTEN = 1000.0, 10.0  # what a snippet costs for each time it had a role, and any role; ties fall by chance


class Snippet(msgspec.Struct, frozen=True):
    """Some words that are there real and made.

    hand : its number; page, line : where the real ones stand in it, from 0; pages that are not the hand's come after
        its own.
    lent : letters that the hand lacked; doubtful : words of the made one that read as others.
    made : which of its two pictures is the made one, "a" or "b".
    """

    hand: int
    page: int
    line: int
    text: str
    fold: int
    lent: str = ""
    doubtful: tuple[str, ...] = ()
    made: str = "a"


class Item(msgspec.Struct, frozen=True):
    """A row of somebody's questionnaire.

    snippet : its number, or that of an envelope; truth : `REAL` or `MADE`, or of a pair where the made one is.
    reference : of a pair, the number of the reference that stands above it.
    """

    snippet: int
    truth: str
    condition: str = OURS
    reference: int = 0


class Person(msgspec.Struct, frozen=True):
    """What one person is asked, row by row."""

    singles: tuple[Item, ...]
    pairs: tuple[Item, ...]
    envelopes: tuple[Item, ...] = ()

    def items(self, questionnaire: str) -> tuple[Item, ...]:
        """Those of a questionnaire, by its letter."""
        return {SINGLES: self.singles, PAIRS: self.pairs, ENVELOPES: self.envelopes}[questionnaire]


class Key(msgspec.Struct, frozen=True):
    """What is true of every row of every sheet; `sampling`: how snippets were dealt, one of `SAMPLINGS`."""

    seed: int
    hands: tuple[str, ...]
    snippets: tuple[Snippet, ...]
    people: tuple[Person, ...]
    sampling: str = BALANCED

    def sealed(self) -> bytes:
        """The file."""
        return _MAGIC + zlib.compress(msgspec.json.encode(self), 9)


def name_of(sealed: bytes) -> str:
    """The study that a key belongs to."""
    return sha256(sealed).hexdigest()[:ID]


def opened(path: Path, study: str | None = None) -> Key:
    """The key in a file.

    study : the name of the study that it has to be of.

    Raises
    ------
    InputError
        No key, or that of another study, or one that was changed.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror or error}.") from error
    if not data.startswith(_MAGIC):
        raise InputError(f"{path} is not the key of a study: give the .key file that `handout study make` wrote.")
    if study is not None and name_of(data) != study:
        raise InputError(
            f"{path} is the key of study {name_of(data)}, and the answers are of study {study}: it is the key of "
            "another study, or it was changed after the sheets were printed."
        )
    try:
        return msgspec.json.decode(zlib.decompressobj().decompress(data[len(_MAGIC) :], _MOST), type=Key)
    except (zlib.error, msgspec.MsgspecError) as error:
        raise InputError(f"{path} is damaged: {error}.") from error


def seal(key: Key, path: Path) -> str:
    """Write a key, and tell the study's name."""
    data = key.sealed()
    atomic.write(path, data)
    return name_of(data)


def roles_of(singles: int, pairs: int) -> Indices:
    """(n,) roles of the snippets that one person sees, as places in `ROLES`.

    Raises
    ------
    InputError
        A number is odd, or there are none.
    """
    if singles % 2 or pairs % 2 or singles + pairs == 0:
        raise InputError(f"{singles} singles and {pairs} pairs: half of each are of either kind, so use even numbers.")
    return np.repeat(np.arange(len(ROLES)), [singles // 2, singles // 2, pairs // 2, pairs // 2])


def dealt(
    folds: Sequence[Sequence[int]],
    people: int,
    singles: int,
    pairs: int,
    rng: np.random.Generator,
    sampling: str = BALANCED,
) -> list[tuple[tuple[Item, ...], tuple[Item, ...]]]:
    """Snippets for everybody: those of A and of B, references yet to be chosen.

    Parameters
    ----------
    folds : numbers of snippets; one person sees those of one fold only, since the hand of a fold is made without the
        lines of its snippets and may have letters from those of another.
    singles, pairs : even numbers.
    sampling : `BALANCED`, or `DRAWN`: for each person by chance, without replacement, as in seed 000, §8.2.

    Raises
    ------
    InputError
        A fold has too few snippets, or a number is odd.
    """
    roles = roles_of(singles, pairs)
    least = min(map(len, folds))
    if least < len(roles):
        raise InputError(f"{least} snippets are too few for {singles} singles and {pairs} pairs, which are all others.")
    often = [np.zeros((len(fold), len(ROLES))) for fold in folds]
    plans = []
    for person in range(people):
        fold, count = folds[person % len(folds)], often[person % len(folds)]
        at, slots = _assigned(count, roles, rng)
        count[at, roles[slots]] += sampling == BALANCED
        rows = [(ROLES[roles[slot]], fold[snippet]) for snippet, slot in zip(at, slots, strict=True)]
        rows = [rows[k] for k in rng.permutation(len(rows))]
        a, b = (tuple(Item(n, truth) for (kind, truth), n in rows if kind == which) for which in (SINGLES, PAIRS))
        plans.append((a, b))
    return plans


def _assigned(count: Array, roles: Indices, rng: np.random.Generator) -> tuple[list[int], list[int]]:
    """Which snippet takes which role of a person: those that had it least, so that all have it equally often."""
    from scipy.optimize import linear_sum_assignment

    chance = rng.random((len(count), len(roles)))
    cost = _UNEVEN * count[:, roles] ** 2 + _OFTEN * count.sum(axis=1, keepdims=True) + chance
    at, slots = linear_sum_assignment(cost)
    return at.tolist(), slots.tolist()


def envelopes(count: int, made: int, people: int, rng: np.random.Generator) -> list[tuple[Item, ...]]:
    """Envelopes, of which some are made, for everybody in another order; numbered from 0."""
    truths = rng.permutation(np.arange(count) < made)
    items = [Item(number, MADE if is_made else REAL) for number, is_made in enumerate(truths.tolist())]
    return [tuple(items[k] for k in rng.permutation(count)) for _ in range(people)]
