"""Strokes that a person gave for one letter, carried over to another of its name: as its ink is like, so is its order.

The ink of the one is laid over that of the other by the affine map which brings them nearest, and the strokes follow
the other's line; at their ends they are extended over what ink is left.  They are one candidate beside those that were
searched for, unless they leave ink out or lie far from it; the candidate that costs a hand least is taken.

Source: own method; iterated closest points, Besl and McKay 1992.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handout.branching import branches
from handout.hand.page_editor import vertices_along
from handout.libraries import spatial
from handout.motion.recovery.letter_forms import frame_of
from handout.motion.recovery.network import WEIGHTS
from handout.values import Array, Indices, LineGraph


@dataclass(frozen=True)
class CarrySettings:
    """When strokes are carried over; by hand, on three simulated pages and replays of two real ones.

    Of 56 wrong letters told one by one, 19 others became right and 1 wrong.
    """

    rounds: int = 3  # of laying over
    reach: float = 0.25  # of a letter's size: ink farther apart has little weight in it
    apart: float = 0.12  # of a letter's size, mean: ink farther apart is not alike
    covered: float = 0.08  # of a letter's size: ink so near a stroke is its
    speck: float = 0.15  # of a letter's size: ink left out that is no longer than this
    end: float = 0.2  # of a letter's size: strokes go on over ink that begins so near their ends
    unlike: float = 30.0  # costs, for ink that is a letter's size apart
    places: int = 40  # of a stroke that are followed
    step: float = 0.15  # x-heights of a stroke, between which it turns


_SETTINGS = CarrySettings()


class Carried(NamedTuple):
    """Strokes on another letter: its vertices in order, and how far both letters' ink is apart, of their size."""

    ways: tuple[Indices, ...]
    apart: float


def carry_strokes(graph: LineGraph, own: Indices, ways: Sequence[Array], ink: Array) -> Carried | None:
    """The strokes `ways`, (n, 2), of a letter with `ink`, (m, 2), along the vertices `own`; None where they do not fit.

    All places are pixels of a page.
    """
    if min(len(own), len(ink)) < 3:
        return None
    size = _size(graph.uv[own])
    matrix, apart = _lay_over(ink, graph.uv[own])
    if apart > _SETTINGS.apart:
        return None
    found = []
    for way in ways:
        places = np.column_stack([way, np.ones(len(way))]) @ matrix
        found.append(vertices_along(graph, own, places[:: max(1, len(places) // _SETTINGS.places)]))
    whole = _extend_strokes(graph, own, found, size)
    return None if whole is None else Carried(tuple(whole), apart)


def carried_cost(strokes: Sequence[Array], others: Sequence[Array], apart: float, x_height: float) -> float:
    """What carried strokes cost more than others of the same letter, (n, 2) each, y up, in the unit of `x_height`."""
    return _effort(strokes, x_height) - _effort(others, x_height) + _SETTINGS.unlike * apart


def _size(places: Array) -> float:
    return max(float(np.sqrt((places.std(axis=0) ** 2).sum())), 1e-9)


def _lay_over(ink: Array, over: Array) -> tuple[Array, float]:
    """(3, 2): the affine map of places (x, y, 1) that lays ink over other ink, and how far apart they are then."""
    middles, size = (ink.mean(axis=0), over.mean(axis=0)), _size(over)
    turned = np.linalg.inv(frame_of(ink - middles[0])).T @ frame_of(over - middles[1]).T
    matrix = np.vstack([turned, middles[1] - middles[0] @ turned])
    places, tree = np.column_stack([ink, np.ones(len(ink))]), spatial.cKDTree(over)
    for _ in range(_SETTINGS.rounds):
        (there, nearest), (back, ours) = tree.query(places @ matrix), spatial.cKDTree(places @ matrix).query(over)
        weight = np.exp(-0.5 * (np.concatenate([there, back]) / (_SETTINGS.reach * size)) ** 2)[:, None]
        matrix = np.linalg.lstsq(
            np.concatenate([places, places[ours]]) * weight, np.concatenate([over[nearest], over]) * weight, rcond=None
        )[0]
    there, back = tree.query(places @ matrix)[0], spatial.cKDTree(places @ matrix).query(over)[0]
    return matrix, max(float(there.mean()), float(back.mean())) / size


def _extend_strokes(graph: LineGraph, own: Indices, ways: Sequence[Indices], size: float) -> list[Indices] | None:
    """Extend strokes over the ink left out at their ends; None where they leave out more."""
    uv, whole = graph.uv, [way for way in ways if len(way)]
    if not whole:
        return None
    left = own[spatial.cKDTree(uv[np.concatenate(whole)]).query(uv[own])[0] > _SETTINGS.covered * size]
    for branch in branches(graph.edges_between(left), len(left)):
        path = left[branch]
        tips = [(i, end, tip) for i in range(len(whole)) for end in (0, -1) for tip in (0, -1)]
        away = [float(np.linalg.norm(uv[whole[i][end]] - uv[path[tip]])) for i, end, tip in tips]
        i, end, tip = tips[int(np.argmin(away))]
        if min(away) > _SETTINGS.end * size:
            if np.linalg.norm(np.diff(uv[path], axis=0), axis=1).sum() > _SETTINGS.speck * size:
                return None
            continue
        outwards = path if tip == 0 else path[::-1]
        whole[i] = np.concatenate([whole[i], outwards] if end else [outwards[::-1], whole[i]])
    return whole


def _effort(strokes: Sequence[Array], x_height: float) -> float:
    """What strokes cost a hand as far as their places tell: lifts, turns, their length, and what goes up and left."""
    cost = WEIGHTS.lift * (len(strokes) - 1)
    for xy in strokes:
        run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
        count = 1 + max(1, round(float(run[-1]) / (_SETTINGS.step * x_height)))
        places = np.column_stack([np.interp(np.linspace(0, run[-1], count), run, xy[:, k]) for k in (0, 1)])
        step = np.diff(places, axis=0) / x_height
        size = np.maximum(np.hypot(*step.T), 1e-9)
        cosine = np.minimum((step[1:] * step[:-1]).sum(axis=1) / (size[1:] * size[:-1]), 1.0)
        cost += WEIGHTS.turn * float((((1 - cosine) / 2) ** 1.5).sum()) + WEIGHTS.retraced * float(size.sum())
        cost += WEIGHTS.against * float((size - step @ (0.5, -0.866)).sum()) / 2
    return cost
