"""The last sentences of a prompt: those that hold the characters that none of the others has."""

from __future__ import annotations

from collections.abc import Collection, Sequence


class Closing:
    """Finds few words with all of some characters."""

    def __init__(self, sentences: Sequence[str]) -> None:
        self._held = [(sentence, frozenset(sentence), len(sentence.split())) for sentence in sentences]

    def sentences(self, missing: Collection[str], taken: Collection[str] = ()) -> list[str]:
        """Sentences that hold every missing character, greedily those with most of them a word.

        What no sentence has stands alone at the end (see `bare`).
        """
        left, found = set(missing), list[str]()
        while left:
            worth = [
                (len(left & held) / (words + 1), -i)
                for i, (sentence, held, words) in enumerate(self._held)
                if sentence not in taken and not left.isdisjoint(held)
            ]
            if not worth:
                return found + self.bare(left)
            sentence, held, _ = self._held[-max(worth)[1]]
            found.append(sentence)
            left -= held
        return found

    @staticmethod
    def bare(missing: Collection[str]) -> list[str]:
        """The characters alone, letters twice, so that one of them begins and one ends a word; nothing for none."""
        return [" ".join(char * 2 if char.isalpha() else char for char in sorted(missing))] if missing else []
