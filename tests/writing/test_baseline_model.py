"""How an author's lines lie: found again on pages whose manner is known, and written so."""

from dataclasses import replace

import numpy as np
import pytest

from handout.hand.scanned import ScannedGlyph, ScannedHand
from handout.page_sizes import page
from handout.values import LineGraph
from handout.writing.compose import compose
from handout.writing.layout import USUAL_BASELINES, BaselineModel, Layout, author_baselines, line_geometries

SIZE, PITCH, REACH, LEFT, TOP = 30.0, 4.0, 25.0, 10.0, 8.0  # pixels an x-height, and x-heights


def sheet(like, manner, count, seed, turned=0.0, indents=()):
    """A page of empty lines that lie as a manner has it, each begun by one letter; turned by a small angle."""
    rng = np.random.default_rng(seed)
    rows, starts = [], []
    for number, lie in enumerate(line_geometries(manner, count, 1.0, REACH, rng)):
        y, x = TOP + PITCH * number - lie.above, LEFT + lie.edge + (4.0 if number in indents else 0.0)
        middle = LEFT + REACH
        left, high = x - turned * y, y + turned * middle
        rows.append([high * SIZE, turned - lie.slope, -lie.sag / REACH**2 / SIZE, middle * SIZE, REACH * SIZE])
        starts.append((left * SIZE, high * SIZE))
    uv = np.array([(x + dx, y) for x, y in starts for dx in (0.0, 9.0)])
    edges = np.arange(len(uv)).reshape(-1, 2)
    graph = LineGraph(uv / 10, np.full(len(uv), 0.2), np.ones(len(uv)), uv, edges)
    return replace(
        like, dpi=254.0, shape=(6000, 3000), graph=graph, baselines=np.array(rows), pitch=PITCH * SIZE / 10,
        x_height=SIZE / 10, transcript="l\n" * count, scan=None,
    )  # fmt: skip


@pytest.fixture
def hand(small_hand):
    def make(manner, pages=8, count=14, **options):
        sheets = [sheet(small_hand.pages[0], manner, count, seed, **options) for seed in range(pages)]
        glyphs = [
            ScannedGlyph("l", "alone", number, line, line, line, np.array([2 * line, 2 * line + 1]))
            for number in range(pages)
            for line in range(count)
        ]
        return ScannedHand("known", "known", tuple(sheets), tuple(glyphs))

    return make


MANNERS = (
    USUAL_BASELINES,
    BaselineModel(edge=0.6, edge_memory=0.1, tilt=0.002, bend=0.1, pitch=0.2, pitch_memory=0.0),
    BaselineModel(
        edge=0.08,
        edge_memory=0.8,
        edge_drift=0.09,
        tilt=0.015,
        tilt_memory=0.8,
        most_rise=1.3,
        bend_mean=0.4,
        pitch_memory=0.8,
    ),
)


@pytest.mark.parametrize("turned", [0.0, 0.03])
@pytest.mark.parametrize("manner", MANNERS)
def test_a_known_manner_is_found_again_however_the_page_lay(hand, manner, turned):
    found = author_baselines(hand(manner, turned=turned))
    for name in ("edge", "tilt", "bend", "pitch"):
        assert getattr(found, name) == pytest.approx(getattr(manner, name), rel=0.4), name
    assert found.edge_memory == pytest.approx(manner.edge_memory, abs=0.3)
    assert found.tilt_memory == pytest.approx(manner.tilt_memory, abs=0.3)
    assert found.pitch_memory == pytest.approx(manner.pitch_memory, abs=0.3)
    assert found.edge_drift == pytest.approx(manner.edge_drift, abs=0.03)
    assert found.bend_mean == pytest.approx(manner.bend_mean, abs=0.12)
    assert found.reach == pytest.approx(REACH)


def test_how_a_page_lay_in_the_scanner_makes_no_difference(hand):
    straight, crooked = author_baselines(hand(MANNERS[1])), author_baselines(hand(MANNERS[1], turned=-0.05))
    for name in ("edge", "edge_drift", "tilt", "bend", "pitch"):
        assert getattr(crooked, name) == pytest.approx(getattr(straight, name), rel=0.05, abs=0.01), name


def test_indented_lines_are_not_the_edge(hand):
    plain, indented = author_baselines(hand(MANNERS[1])), author_baselines(hand(MANNERS[1], indents=(0, 5, 9)))
    assert indented.edge == pytest.approx(plain.edge, rel=0.35) and abs(indented.edge_drift) < 0.05


def test_few_lines_tell_nothing_and_wild_ones_not_everything(hand):
    assert author_baselines(hand(MANNERS[2], pages=3, count=4)) == USUAL_BASELINES
    wild = author_baselines(hand(BaselineModel(edge=3.0, tilt=0.2, most_rise=9.0, bend=4.0, pitch=1.0), pages=2))
    assert wild.edge <= 0.8 and wild.tilt <= 0.025 and wild.bend <= 0.6 and wild.pitch <= 0.6 and wild.most_rise <= 1.3


def test_one_page_counts_for_what_it_shows(hand):
    usual, own = (
        USUAL_BASELINES.edge,
        [author_baselines(hand(BaselineModel(edge=0.6), pages=1, count=n)).edge for n in (5, 30)],
    )
    assert all(usual < edge for edge in own) and own[1] == pytest.approx(0.6, rel=0.35)


@pytest.mark.parametrize("manner", MANNERS)
def test_lines_lie_as_the_manner_says(manner):
    pages = [line_geometries(manner, 12, 1.0, REACH, np.random.default_rng(seed)) for seed in range(250)]
    each = {
        name: np.array([[getattr(lie, name) for lie in page] for page in pages]) for name in ("edge", "sag", "above")
    }
    drift = np.polyfit(np.arange(12), each["edge"].mean(axis=0), 1)[0]
    assert drift == pytest.approx(manner.edge_drift, abs=0.02)
    assert (each["edge"] - drift * np.arange(12)).std() == pytest.approx(manner.edge, rel=0.12)
    assert each["sag"].std() == pytest.approx(manner.bend, rel=0.1)
    assert each["sag"].mean() == pytest.approx(manner.bend_mean, abs=0.05)
    assert each["above"].std() == pytest.approx(manner.pitch, rel=0.1)
    heights = each["above"]
    memory = (heights[:, 1:] * heights[:, :-1]).mean() / np.square(heights).mean()
    assert memory == pytest.approx(manner.pitch_memory, abs=0.06)
    assert all(abs(lie.slope) * REACH <= manner.most_rise + 1e-9 for page in pages for lie in page)


def test_no_lines_come_nearer_than_the_authors(hand):
    uneven = author_baselines(hand(BaselineModel(pitch=0.2, closer=0.25)))
    assert uneven.closer == pytest.approx(0.25, abs=0.12)
    for seed in range(20):
        above = [lie.above for lie in line_geometries(uneven, 30, 1.0, REACH, np.random.default_rng(seed))]
        assert np.diff(above).max() <= uneven.closer + 1e-9


def test_without_variation_lines_are_ruled():
    ruled = line_geometries(MANNERS[2], 9, 0.0, REACH, np.random.default_rng(1))
    assert not any((lie.above, lie.edge, lie.slope, lie.sag) != (0.0, 0.0, 0.0, 0.0) for lie in ruled)


TEXT = "the ten even hens jumped on the line and it did jump " * 5


@pytest.mark.slow
def test_a_scanned_hand_writes_as_its_pages_lie_and_inside_the_margins(small_hand, monkeypatch):
    from handout.writing import scanned_words

    layout = Layout(page("100x110mm"), (12.0, 10.0, 12.0, 10.0), x_height=2.5)
    slopes = {}
    for manner in (USUAL_BASELINES, BaselineModel(tilt=0.025, most_rise=1.3, bend=0.6, pitch=0.3)):
        monkeypatch.setattr(scanned_words, "author_baselines", lambda hand, manner=manner: manner)
        sheets = [s for k in (1, 2) for s in compose(TEXT, small_hand, layout, np.random.default_rng(k))]
        slopes[manner] = np.std([line.rise[0] for one in sheets for line in one.lines])
        for one in sheets:
            inks = [p.ink.graph for line in one.lines for p in line.placed]
            assert min(float((g.xy[:, 1] - g.radius).min()) for g in inks) >= 12.0 - 1e-9
            assert max(float((g.xy[:, 1] + g.radius).max()) for g in inks) <= 98.0 + 1e-9
    few, many = slopes.values()
    assert many > 3 * few
