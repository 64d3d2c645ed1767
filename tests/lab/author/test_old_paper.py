"""Old sheets: the same for the same seed, each mark of age where it was asked for."""

from dataclasses import replace

import numpy as np

from handout.inking.pen import Pen
from handout.values import Drawing, Page, Stroke
from handout_lab.author.old_paper import Age, old_sheet

PAGE, DPI = Page(60.0, 40.0), 100
CLEAN = Age(uneven=0.0, edge=0.0, foxing=0.0, stains=0, folds=(), through=0.0)
LINE = Drawing((Stroke(np.arange(2.0), np.array([[5.0, 10.0], [20.0, 10.0]])),), PAGE)
PEN = Pen(1.0, "#303030")


def sheet(age, seed=1, **more):
    return old_sheet(PAGE, DPI, np.random.default_rng(seed), age, **more).astype(float)


def test_the_same_seed_gives_the_same_sheet():
    assert np.array_equal(sheet(Age(), back=LINE, back_pen=PEN), sheet(Age(), back=LINE, back_pen=PEN))
    assert not np.array_equal(sheet(Age()), sheet(Age(), seed=2))


def test_every_mark_of_age_takes_light():
    bare = sheet(CLEAN)
    assert bare.shape == (157, 236, 3) and np.abs(bare.mean(axis=(0, 1)) - 255 * np.array(CLEAN.paper)).max() < 2
    for field, value in (("edge", 0.3), ("foxing", 200.0), ("stains", 1), ("folds", (("down", 0.5),))):
        assert (sheet(replace(CLEAN, **{field: value})) - bare).min() < -8, field


def test_the_back_shines_through_mirrored_and_pale_and_marks_do_not():
    bare, age = sheet(CLEAN), replace(CLEAN, through=0.3)
    through = (bare - sheet(age, back=LINE, back_pen=PEN)).sum(axis=2)
    front = (bare - sheet(age, marks=[(LINE, PEN)])).sum(axis=2)
    row = round(10.0 / 25.4 * DPI)
    assert through[row, -round(12.0 / 25.4 * DPI)] > 60 > abs(through[row, round(12.0 / 25.4 * DPI)])
    assert front[row, round(12.0 / 25.4 * DPI)] > 2.5 * through.max()
