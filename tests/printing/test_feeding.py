import msgspec
import numpy as np
import pytest

from handout import page_sizes
from handout.errors import InputError
from handout.inking.device_pixels import DevicePixels
from handout.printing.media import Feeding
from handout.profiles import Length, Nudge, Printer
from handout.values import Page

PLAIN = Printer(kind="printer", title="P", dpi=100)
DL, A5 = page_sizes.page("dl"), page_sizes.page("a5")


def fed(page, **changed):
    return Feeding.for_page(page, msgspec.structs.replace(PLAIN, **changed))


def mark(feeding):
    """Where a dot near the upper left corner of the page as it is read comes to lie on the sheet."""
    pixels = feeding.pixels(DevicePixels(np.zeros((4, 8, 3), np.uint8), 100, (10.0, 5.0)))
    bounds = feeding.bounds((10.0, 5.0, 10 + 8 * 0.254, 5 + 4 * 0.254))
    height, width = pixels.rgb.shape[:2]
    x, y = pixels.origin
    # pixels and bounds have to agree: the one is printed, the other is checked against the margins
    assert bounds == pytest.approx((x, y, x + width * 0.254, y + height * 0.254))
    return bounds


@pytest.mark.parametrize(
    ("page", "changed", "edges"),
    [
        # the flap is the upper edge: the dot is 5 mm from it, and 10 mm from the left end of the writing
        (DL, {"flap": "left"}, {"left": 5, "trailing": 10}),
        (DL, {"flap": "right"}, {"right": 5, "leading": 10}),
        (DL, {"feed": "long", "flap": "leading"}, {"leading": 5, "left": 10}),
        (DL, {"feed": "long", "flap": "trailing"}, {"trailing": 5, "right": 10}),
        (DL, {}, {"left": 5, "trailing": 10}),
        (DL, {"turn": "right"}, {"right": 5, "leading": 10}),
        (DL, {"feed": "long"}, {"leading": 5, "left": 10}),
        (A5, {}, {"leading": 5, "left": 10}),
        (A5, {"flap": "trailing"}, {"trailing": 5, "right": 10}),
        (A5, {"feed": "long", "flap": "right"}, {"right": 5, "leading": 10}),
    ],
)
def test_where_the_upper_edge_lies(page, changed, edges):
    feeding = fed(page, **changed)
    x0, y0, x1, y1 = mark(feeding)
    sheet = feeding.sheet
    short = changed.get("feed", "short") == "short"
    assert (sheet.width < sheet.height) == short and {sheet.width, sheet.height} == {page.width, page.height}
    room = {"leading": y0, "trailing": sheet.height - y1, "left": x0, "right": sheet.width - x1}
    assert {edge: room[edge] for edge in edges} == pytest.approx(edges)


@pytest.mark.parametrize("flap", ["left", "right"])
def test_a_nudge_moves_what_is_read(flap):
    nudge = Nudge(x=Length(2.0), y=Length(-1.0))
    still, moved = mark(fed(DL, flap=flap)), mark(fed(DL, flap=flap, nudge=nudge))
    sign = 1 if flap == "left" else -1
    # 2 mm to the right as it is read is 2 mm towards the leading edge if the flap is left; 1 mm up is towards the flap
    assert np.subtract(moved, still) == pytest.approx([-sign, -2 * sign] * 2)


@pytest.mark.parametrize(
    ("page", "changed", "words"),
    [
        (DL, {"flap": "leading"}, "DL, fed with its short edge first, .* left or right, not leading; .*--feed long"),
        (DL, {"flap": "left", "feed": "long"}, "leading or trailing, not left; .*--feed short"),
        (Page(100, 200), {"flap": "left"}, "leading or trailing"),
    ],
)
def test_a_flap_where_it_cannot_be(page, changed, words):
    with pytest.raises(InputError, match=words):
        fed(page, **changed)
