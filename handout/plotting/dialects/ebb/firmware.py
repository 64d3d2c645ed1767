"""Which firmware an EBB has, and what that understands."""

from __future__ import annotations

import re
from typing import NamedTuple


class Version(NamedTuple):
    """Of the firmware of an EBB; (0, 0, 0): unknown."""

    major: int
    minor: int
    patch: int

    @classmethod
    def of(cls, text: str) -> Version:
        """From "2.8.1"; unknown from anything else."""
        match = re.fullmatch(r"(\d+)\.(\d+)(?:\.(\d+))?", text)
        return cls(*(int(part or 0) for part in match.groups())) if match else UNKNOWN

    @classmethod
    def from_answer(cls, text: str) -> Version | None:
        """From what the board answers to V, such as "EBBv13_and_above EB Firmware Version 2.8.1"."""
        match = re.search(r"Firmware Version (\d+\.\d+(?:\.\d+)?)", text)
        return cls.of(match.group(1)) if match else None

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.patch}"


UNKNOWN = Version(0, 0, 0)

# since when there is what
CURRENT = Version(2, 2, 3)  # QC: the voltage of the motors' power
STOP = Version(2, 2, 7)  # ES
POSITION = Version(2, 4, 3)  # QS, CS
MOTION = Version(2, 4, 4)  # QM
BUTTON = POSITION  # QB is older, but who pauses must find its place again
STEPS = Version(2, 5, 3)  # LM
FLAGS = Version(2, 6, 2)  # QG: what it is doing, its pen and its button, in one byte
HOME = Version(2, 6, 2)  # HM; and EM sets the position to zero
TIME = Version(2, 7, 0)  # LT
ENABLED = Version(2, 8, 0)  # QE: which motors are on
SIGNED = Version(3, 0, 0)  # a rate may change its sign under way, and the queue be longer (CU,4)
