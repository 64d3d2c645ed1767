"""A learned style in one file: its TOML, the weights of its networks, and the examples that prime them.

A ``.style`` file is an archive of ``style.toml``, ``learned.json`` (`NetworkHead`), the arrays of the networks in half
precision, and of each primer the targets, the ways in the air and the dynamics: nothing but numbers and text.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from handout.errors import InputError
from handout.hand import archive
from handout.hand.archive import Archive
from handout.motion.learned import sequences
from handout.motion.learned.dynamics import DynamicsModel
from handout.motion.learned.model import PRIMERS, LearnedMovement
from handout.motion.learned.sequences import Inputs, MovementSequence
from handout.motion.learned.structure import StructureModel
from handout.networks import Floats
from handout.tables import parse_table

_FORMAT, _VERSION = "handout-style", 1
_MOST_LAYERS, _MOST_UNITS, _MOST_GAUSSIANS = 4, 1024, 64  # of a network: more are not used
_MOST_WAYS = 4096  # of a primer, and of what is invented


class NetworkHead(msgspec.Struct, forbid_unknown_fields=True):
    """What a file says of its networks.

    inputs : what the dynamics are told; hidden, gaussians : of both networks; longest : ways of the longest example, 0
    where no structure was learned; primers : their names, the usual one first.
    """

    format: str
    version: int
    inputs: Inputs
    hidden: list[int]
    gaussians: int
    longest: int
    primers: list[str]


def to_bytes(toml: str, movement: LearnedMovement) -> bytes:
    """A ``.style`` file of a TOML text and what was learned."""
    dynamics, structure = movement.dynamics, movement.structure
    hidden = [layer.shape[1] // 4 for layer in dynamics.parameters[:-1]]
    longest = 0 if structure is None else structure.longest
    head = NetworkHead(_FORMAT, _VERSION, dynamics.inputs, hidden, dynamics.gaussians, longest, list(movement.primers))
    members: dict[str, archive.Content] = {"style.toml": toml.encode(), "learned.json": head}
    scales = np.concatenate([dynamics.mean, dynamics.spread, dynamics.told_mean, dynamics.told_spread])
    members |= _pack_layers("dynamics", dynamics.parameters) | {"dynamics/scales.npy": scales.astype(np.float32)}
    if structure is not None:
        members |= _pack_layers("structure", structure.parameters) | {"structure/scales.npy": structure.spread}
    for k, primer in enumerate(movement.primers.values()):
        rows = np.column_stack([primer.targets[1:], primer.up, primer.dt, primer.theta])
        members[f"primers/{k}.npy"] = np.concatenate([[[*primer.targets[0], 0, 0, 0]], rows]).astype(np.float32)
    return archive.pack(members)


def to_toml(tables: Mapping[str, Any]) -> str:
    """Tables of numbers, words and lists, and what stands before them, as the text of a TOML file."""
    loose = [_row(name, value) for name, value in tables.items() if not isinstance(value, Mapping)]
    parts = [
        "\n".join([f"[{name}]", *(_row(key, value) for key, value in table.items())])
        for name, table in tables.items()
        if isinstance(table, Mapping)
    ]
    return "\n\n".join(["\n".join(loose), *parts]) + "\n"


def _row(name: str, value: Any) -> str:
    # TOML writes words and lists as JSON does, but for one character, which it wants escaped
    return f"{name} = {json.dumps(value, ensure_ascii=False)}".replace("\x7f", "\\u007f")


def _pack_layers(name: str, parameters: Sequence[Floats]) -> dict[str, archive.Content]:
    return {f"{name}/{k}.npy": layer.astype(np.float16) for k, layer in enumerate(parameters)}


def load(path: Path, data: bytes | None = None) -> tuple[dict[str, Any], LearnedMovement]:
    """Read a ``.style`` file: the tables of its TOML, unchecked, and what was learned.

    Raises InputError: it cannot be read, is damaged, holds something else, or is of a later version.
    """
    with Archive(path, data) as file:
        head = file.json("learned.json", NetworkHead)
        archive.check_version(path, (head.format, head.version), (_FORMAT, _VERSION))
        sizes = 1 <= len(head.hidden) <= _MOST_LAYERS and all(1 <= units <= _MOST_UNITS for units in head.hidden)
        names = len(set(head.primers)) == len(head.primers) <= PRIMERS
        if not (sizes and names and 1 <= head.gaussians <= _MOST_GAUSSIANS and 0 <= head.longest <= _MOST_WAYS):
            raise InputError(f"{path} cannot be used: networks of that size are not learned here; learn it again.")
        n = sequences.columns(head.inputs)
        parameters = _parameters(file, "dynamics", n, head, 6 * head.gaussians)
        scales = file.array("dynamics/scales.npy", "float32", 2 * n + 4)
        mean, spread, told_mean, told_spread = np.split(scales, np.cumsum([n, n, 2]))
        _check_above(0.0, (spread, told_spread), path)
        structure = None
        if head.longest:
            weights = _parameters(file, "structure", 3, head, 6 * head.gaussians + 2)
            ways_spread = file.array("structure/scales.npy", "float32", 2)
            _check_above(0.0, (ways_spread,), path)
            structure = StructureModel(weights, ways_spread, head.longest)
        primers = {}
        for k, name in enumerate(head.primers):
            rows = file.array(f"primers/{k}.npy", "float32", None, 5).astype(np.float64)
            if not 2 <= len(rows) <= _MOST_WAYS or not np.isin(rows[:, 2], (0, 1)).all():
                raise InputError(f"{path} cannot be used: its primer {name!r} is no movement; learn it again.")
            primers[name] = MovementSequence(rows[:, :2], rows[1:, 2] > 0, rows[1:, 3], rows[1:, 4])
        moves = DynamicsModel(parameters, head.inputs, mean, spread, told_mean, told_spread)
        model = LearnedMovement(moves, structure, primers)
        text = file.read_part("style.toml")
        try:
            return parse_table(text.decode()), model
        except ValueError as error:
            raise InputError(f"{path}: cannot be read as a style: {error}.") from error


def _parameters(file: Archive, name: str, inputs: int, head: NetworkHead, outputs: int) -> tuple[Floats, ...]:
    before, layers = inputs, []
    for k, units in enumerate(head.hidden):
        layers.append(file.array(f"{name}/{k}.npy", "float16", before + units + 1, 4 * units).astype(np.float32))
        before = units
    last = file.array(f"{name}/{len(head.hidden)}.npy", "float16", before + 1, outputs).astype(np.float32)
    return (*layers, last)


def _check_above(least: float, each: Sequence[Floats], path: Path) -> None:
    if any((values <= least).any() for values in each):
        raise InputError(f"{path} cannot be used: a spread in it is not above {least:g}; learn it again.")
