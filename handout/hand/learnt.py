"""What is worked out of a scanned hand once and kept with it, since it takes longer than writing a sentence.

A value is an array under a name; with the name goes the version of what worked it out, a constant beside it, so that
what an earlier program worked out otherwise is not found, and is worked out anew.  A hand that was changed is another
value of `ScannedHand` and knows nothing.  `hand.file` keeps values in .hand files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from weakref import WeakKeyDictionary

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.values import Array, readonly

_MOST = 2.0**53  # of a value: above it not every whole number is a float of its own
_kept: WeakKeyDictionary[ScannedHand, dict[str, Sequence[float] | Array]] = WeakKeyDictionary()
_known: WeakKeyDictionary[ScannedHand, dict[str, Array]] = WeakKeyDictionary()


def learnt(
    hand: ScannedHand,
    name: str,
    version: int,
    count: int | None,
    work_out: Callable[[], Sequence[float] | Array],
) -> Array:
    """(count,) float, of any length where `count` is None: what is kept of a hand under a name, or worked out now.

    version : of what works it out.
    """
    found = recall(hand, name, version)
    if found is None or count not in (None, len(found)):
        found = _known.setdefault(hand, {})[f"{name} {version}"] = readonly(work_out(), count)
    return found


def recall(hand: ScannedHand, name: str, version: int) -> Array | None:
    """What is kept of a hand under a name, or was worked out before; None where nothing is."""
    known, kept, key = _known.setdefault(hand, {}), _kept.get(hand, {}), f"{name} {version}"
    if key not in known and key in kept:
        if np.abs(np.asarray(kept[key])).max(initial=0.0) <= _MOST:
            known[key] = readonly(kept[key], None)
        else:  # a file beside the hand that somebody wrote into
            del kept[key]
    return known.get(key)


def remember(hand: ScannedHand, values: Mapping[str, Sequence[float] | Array]) -> None:
    """Take what is known of a hand, as `known_values` has it, or as a file keeps it."""
    _kept[hand] = dict(values)


def share_learnt(hand: ScannedHand, other: ScannedHand) -> None:
    """Have another value of the same pages and glyphs know what a hand knows, from now on too."""
    _kept[other], _known[other] = _kept.get(hand, {}), _known.setdefault(hand, {})


def is_kept(hand: ScannedHand) -> bool:
    """Whether all that was asked of a hand so far is kept."""
    return _known.get(hand, {}).keys() <= _kept.get(hand, {}).keys()


def known_values(hand: ScannedHand) -> Mapping[str, Array]:
    """All that was asked of a hand so far, by names and versions."""
    return _known.get(hand, {})
