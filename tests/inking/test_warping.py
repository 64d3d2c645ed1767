"""Ink that is bent on its way to the page."""

import numpy as np

from handout.inking.warping import _specks


def test_ink_that_touches_no_line_is_dropped() -> None:
    rgba, on = np.zeros((20, 20, 4), np.uint16), np.zeros((20, 20), bool)
    rgba[4:7, 2:18], rgba[14:16, 5:7], on[5, 2:18] = 65025, 65025, True
    rgba[7, 2:18] = 3250  # the soft edge of the stroke
    specks = _specks(rgba[:, :, 3], np.flatnonzero(on))
    assert not specks[4:8, 2:18].any() and specks[9:].all()
