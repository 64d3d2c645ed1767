"""What is worked out of a scanned hand once and kept with it, since it takes longer than writing a sentence.

A value is an array under a name; with the name goes a digest of the files of the program that worked it out, so that
what another version of the program worked out is not found, and worked out anew.  A hand that was changed is another
value of `ScannedHand` and knows nothing.  `hand.file` keeps values in .hand files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from weakref import WeakKeyDictionary

from handout.hand.scanned import ScannedHand
from handout.values import Array, readonly

_PACKAGE = Path(__file__).resolve().parent.parent
_kept: WeakKeyDictionary[ScannedHand, Mapping[str, Sequence[float] | Array]] = WeakKeyDictionary()
_known: WeakKeyDictionary[ScannedHand, dict[str, Array]] = WeakKeyDictionary()


def learnt(
    hand: ScannedHand,
    name: str,
    makers: Sequence[str],
    count: int | None,
    work_out: Callable[[], Sequence[float] | Array],
) -> Array:
    """(count,) float, of any length where `count` is None: what is kept of a hand under a name, or worked out now.

    makers : the files that say how, from the package's folder.
    """
    known = _known.setdefault(hand, {})
    key = f"{name} {_digest(tuple(makers))}"
    if key not in known:
        kept = _kept.get(hand, {}).get(key)
        known[key] = readonly(work_out() if kept is None or count not in (None, len(kept)) else kept, count)
    return known[key]


def remember(hand: ScannedHand, values: Mapping[str, Sequence[float] | Array]) -> None:
    """Take what is known of a hand, as `known` has it, or as a file keeps it."""
    _kept[hand] = values


def known(hand: ScannedHand) -> Mapping[str, Array]:
    """All that was asked of a hand so far, by names and digests."""
    return _known.get(hand, {})


@lru_cache
def _digest(files: tuple[str, ...]) -> str:
    digest = sha256()
    for file in files:
        digest.update((_PACKAGE / file).read_bytes())
    return digest.hexdigest()[:16]
