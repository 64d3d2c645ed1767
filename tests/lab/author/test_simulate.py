"""Pages of the simulated author: what is told of them must be what is seen on them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import regex

from handout.errors import DoesNotFit, InputError
from handout.hand.library import load
from handout.inking.papers import Paper
from handout.inking.pen import usual
from handout.motion.trace import STEPS, letters_of_samples, trace
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.layout import Layout
from handout_lab.author import page_score
from handout_lab.author.simulate import Desk, scan, simulate, simulate_pages
from handout_lab.author.worn_flatbed import WornFlatbed

TEXT = "Minimum jumps, été of it."
SMALL = Layout(page("70x40mm"), (6.0, 6.0, 6.0, 6.0), x_height=2.2)


def made(seed=1, **options):
    options = {"pen": usual("ballpoint"), "layout": SMALL, "dpi": 300.0} | options
    text, hand = options.pop("text", TEXT), options.pop("hand", load("house-joined"))
    return simulate(text, hand, Desk(**options), rng=np.random.default_rng(seed))


@pytest.fixture(scope="module")
def usual_page():
    return made()


@pytest.fixture(scope="module")
def ideal_page():
    return made(flatbed=WornFlatbed.exact())


@pytest.mark.parametrize("engine", ["optimal-control", "sigma-lognormal"])
@pytest.mark.parametrize("name", ["house-joined", "house-print", "house-quick"])
def test_every_sample_is_known_by_its_letter(name, engine):
    hand = load(name)
    (sheet,) = compose(TEXT, hand, SMALL, np.random.default_rng(2))
    drawing = trace(sheet, hand, np.random.default_rng(3), engine)
    of = letters_of_samples(sheet, hand)
    assert [len(o) for o in of] == [len(s.t) for s in drawing.strokes]
    if engine != "optimal-control":
        return
    # a sample near the middle of a point's time lies near the point of the letter that it is said to write
    points = {p.at: np.vstack(p.strokes) for line in sheet.lines for p in line.placed}
    for stroke, at in zip(drawing.strokes, of, strict=True):
        if len(at) <= STEPS * 2:
            continue
        for i in range(STEPS // 2, len(at), STEPS):
            away = np.linalg.norm(points[int(at[i])] - stroke.xy[i], axis=1).min()
            assert away < 0.45 * sheet.x_height, (name, int(at[i]), away)


def test_joined_letters_part_between_their_points():
    hand = load("house-joined")
    (sheet,) = compose("minimum", hand, SMALL, np.random.default_rng(2))
    of = letters_of_samples(sheet, hand)
    changes = [(int(a), int(b)) for o in of for a, b in pairwise(o) if a != b]
    joined = [(a.at, b.at) for a, b in pairwise(sheet.lines[0].placed) if b.joined]
    assert changes == joined
    assert len(joined) >= 4


def test_the_truth_has_every_letter_once(usual_page):
    assert page_score.transcript(usual_page).split() == TEXT.split()
    graphemes = regex.findall(r"\X", TEXT)
    letters = usual_page.truth.letters
    assert {letter.at: letter.text for letter in letters} == {i: g for i, g in enumerate(graphemes) if not g.isspace()}
    assert all(letter.box for letter in letters)
    labels = usual_page.truth.labels
    assert set(np.unique(labels)) == {0} | {letter.at + 1 for letter in letters}
    for letter in letters:
        left, top, right, bottom = letter.box
        own = np.argwhere(labels == letter.at + 1)
        assert own.min(axis=0).tolist() == [top, left]
        assert own.max(axis=0).tolist() == [bottom - 1, right - 1]


def test_labels_are_the_nearest_path(usual_page):
    from scipy.spatial import cKDTree

    truth = usual_page.truth
    places, letters = [], []
    for path in truth.paths:
        for k in np.linspace(0, 1, 20, endpoint=False):
            places.append(path.xy[:-1] * (1 - k) + path.xy[1:] * k)
            letters.append(path.of[:-1])
    rows, columns = np.nonzero(truth.mask)
    away, index = cKDTree(np.concatenate(places)).query(np.column_stack([columns, rows]))
    nearest = np.concatenate(letters)[index] + 1
    # paths are drawn in whole pixels, so that a pixel half way between two letters may go to either
    assert (truth.labels[rows, columns] == nearest).mean() > 0.97
    assert away.max() < 0.5 * truth.line + 3


def test_paths_run_through_the_middle_of_the_ink(ideal_page):
    truth = ideal_page.truth
    middles = np.rint([path.xy[len(path.xy) // 2] for path in truth.paths]).astype(int)
    inked = truth.alpha[middles[:, 1], middles[:, 0]]
    # a ballpoint skips now and then
    assert inked.min() > 0.03
    assert (inked > 0.15).mean() > 0.85
    places = np.concatenate([path.xy for path in truth.paths])
    column, row = np.rint(places).astype(int).T
    assert truth.mask[row, column].mean() > 0.9
    # and nowhere else is as much of it
    assert truth.density[row, column].mean() > 2 * truth.density[truth.density > 0].mean() * 0.6


def test_an_ideal_scan_is_paper_times_ink(ideal_page):
    truth = ideal_page.truth
    bare = truth.density == 0
    assert np.array_equal(ideal_page.image[bare], truth.paper[bare])
    assert (ideal_page.image.astype(int) <= truth.paper.astype(int) + 1).all()
    # the matte puts the picture together again from clean paper and an ink with one channel at zero
    alpha = truth.alpha[..., None]
    ink = (ideal_page.image / 255 - (1 - alpha) * (truth.paper / 255)) / np.maximum(alpha, 1e-6)
    inked = truth.alpha > 0.05
    assert ink[inked].min() > -0.05
    assert np.abs(ink[inked].min(axis=1)).max() < 0.06


def test_density_is_that_of_the_ink(ideal_page):
    truth = ideal_page.truth
    colour = np.array([0x6D, 0x6B, 0xB2]) / 255
    inside = truth.density > 0.3
    shown = ideal_page.image[inside] / truth.paper[inside]
    again = np.exp(truth.density[inside] * np.log(colour[1]))
    assert np.abs(shown[:, 1] - again).max() < 0.02


@pytest.mark.slow
def test_the_same_page_at_any_resolution_and_scanner():
    coarse, fine = made(dpi=150.0), made(dpi=600.0)
    assert fine.image.shape[0] == pytest.approx(4 * coarse.image.shape[0], abs=2)
    for a, b in zip(coarse.truth.paths, fine.truth.paths, strict=True):
        assert (a.xy + 0.5) * 4 == pytest.approx(b.xy + 0.5)
    assert coarse.truth.mask.mean() == pytest.approx(fine.truth.mask.mean(), rel=0.05)
    other = made(flatbed=replace(WornFlatbed.make_worn(), border=0.0, skew=0.0, slack=0.0))
    still = made(flatbed=WornFlatbed.exact())
    for a, b in zip(other.truth.paths, still.truth.paths, strict=True):
        assert a.xy == pytest.approx(b.xy)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(usual_page):
    again, other = made(), made(seed=2)
    assert np.array_equal(again.image, usual_page.image)
    assert np.array_equal(again.truth.labels, usual_page.truth.labels)
    assert not np.array_equal(other.image, usual_page.image)


@pytest.mark.slow
def test_rotation_and_offset_turn_paper_and_truth_together():
    page_, rng = SMALL.page, np.random.default_rng(0)
    scanner = replace(WornFlatbed.exact(), rotation=0.05, offset=(1.0, 2.0), border=3.0)
    place = scanner.lay(page_, 254.0, rng)
    middle = np.array([[page_.width / 2, page_.height / 2]])
    # 10 pixels a mm; the middle of a sheet stays where it is but for border and offset
    assert place.pixels(middle) == pytest.approx((middle + np.array([4.0, 5.0])) * 10 - 0.5)
    right = place.pixels(middle + np.array([10.0, 0.0])) - place.pixels(middle)
    assert right == pytest.approx(100 * np.array([[np.cos(0.05), np.sin(0.05)]]))
    turned = made(flatbed=scanner, paper=Paper("ruled"))
    flat = made(flatbed=WornFlatbed.exact(), paper=Paper("ruled"))
    assert turned.image.shape != flat.image.shape
    column, row = np.rint(np.concatenate([p.xy for p in turned.truth.paths])).astype(int).T
    assert turned.truth.mask[row, column].mean() > 0.9
    # a printed line goes down to the right as the sheet does
    blue = turned.truth.paper[..., 0].astype(float)
    x = np.array([200, 600])
    rows = [blue[60:-60, i - 3 : i + 4].mean(axis=1) for i in x]
    # of several lines any may be the darkest: the one sought is where this line must come out
    start = int(rows[0][:-40].argmin())
    end = start + round(400 * np.tan(0.05))
    assert rows[1][end - 4 : end + 5].min() < rows[0].min() + 0.3 * (np.median(rows[0]) - rows[0].min())


def test_baselines_lie_under_the_letters(usual_page):
    truth = usual_page.truth
    feet = [letter for letter in truth.letters if letter.text in "nmiuéto"]
    assert len(truth.baselines) == len(usual_page.manuscript.lines)
    for letter in feet:
        line = truth.baselines[letter.line]
        level = np.interp((letter.box[0] + letter.box[2]) / 2, line[:, 0], line[:, 1])
        assert abs(letter.box[3] - level) < 0.45 * truth.x_height, letter


@pytest.mark.slow
def test_what_the_scanner_does_is_seen():
    still = {"rotation": 0.0, "offset": (0.0, 0.0)}
    sharp = made(dpi=150.0, flatbed=replace(WornFlatbed.exact(), **still))
    soft = made(dpi=150.0, flatbed=replace(WornFlatbed.exact(), blur=0.1))
    # blur moves light but loses none
    assert soft.image.mean() == pytest.approx(sharp.image.mean(), abs=0.15)
    assert soft.image.std() < 0.95 * sharp.image.std()
    noisy = made(dpi=150.0, flatbed=replace(WornFlatbed.exact(), noise=0.02))
    bare = sharp.truth.density == 0
    assert (noisy.image[bare].astype(float) - sharp.image[bare]).std() == pytest.approx(0.02 * 255, rel=0.15)
    assert np.array_equal(noisy.truth.paper, sharp.truth.paper)
    dim = made(dpi=150.0, flatbed=replace(WornFlatbed.exact(), shading=0.3))
    assert dim.truth.paper.min() < 0.75 * sharp.truth.paper.max()
    dusty = made(dpi=150.0, flatbed=replace(WornFlatbed.exact(), dust=900.0))
    assert (dusty.image[bare] < sharp.image[bare].astype(int) - 20).mean() > 0.0005
    assert np.array_equal(dusty.truth.paper, sharp.truth.paper)
    grey = made(dpi=150.0, flatbed=replace(WornFlatbed.exact(), grey=True))
    assert (np.ptp(grey.image, axis=2) == 0).all()
    # what is shown as white is white
    bright = made(dpi=150.0, flatbed=replace(WornFlatbed.exact(), white=0.9))
    assert bright.truth.paper.min() == 255


def test_red_lies_where_it_is_said_to():
    shift = 4 / 300 * 25.4
    scanner = replace(WornFlatbed.exact(), misregistration=((shift, 0.0), (0.0, -shift)))
    moved, still = made(flatbed=scanner).image, made(flatbed=WornFlatbed.exact()).image
    assert np.array_equal(moved[..., 1], still[..., 1])
    assert np.array_equal(moved[:, 4:, 0], still[:, :-4, 0])
    assert np.array_equal(moved[:-4, :, 2], still[4:, :, 2])


def test_lid_and_shadow_lie_beside_the_sheet():
    scanner = replace(WornFlatbed.exact(), border=5.0, lid=0.2, shadow=0.5)
    image = made(flatbed=scanner, paper=Paper("none")).image
    assert image[2, 2].tolist() == [51, 51, 51]
    edge = round(5.0 / 25.4 * 300)
    assert image[edge - 1, 400, 0] < 35
    assert image[edge + 1, 400, 0] == 255


def test_pages_run_on():
    hand, narrow = load("house-print"), Layout(page("60x30mm"), (4.0, 4.0, 4.0, 4.0), x_height=2.2)
    text = "one two three four five six seven eight nine ten eleven twelve thirteen"
    pages = list(simulate_pages(text, hand, Desk(layout=narrow, dpi=120.0), rng=np.random.default_rng(4)))
    assert len(pages) > 1
    said = {letter.at: letter.text for one in pages for letter in one.truth.letters}
    assert said == {i: c for i, c in enumerate(text) if c != " "}
    with pytest.raises(DoesNotFit):
        simulate(text, hand, Desk(layout=narrow, dpi=120.0), rng=np.random.default_rng(4))


@pytest.mark.slow
def test_sixteen_bits_are_finer():
    eight, sixteen = made(), made(bits=16)
    assert sixteen.image.dtype == np.uint16
    assert sixteen.truth.paper.dtype == np.uint16
    assert np.abs(sixteen.image / 257 - eight.image).max() <= 0.5 + 0.5 / 257 + 1e-6  # both are rounded


@pytest.mark.slow
@pytest.mark.parametrize("pen", ["plain", "ballpoint", "fineliner", "fountain", "pencil"])
@pytest.mark.parametrize("hand", ["house-joined", "house-print"])
def test_every_pen_leaves_a_line_that_is_seen(pen, hand):
    truth = made(pen=usual(pen), hand=load(hand), dpi=200.0, text="Jump it!").truth
    places = np.rint(np.concatenate([path.xy for path in truth.paths])).astype(int)
    assert truth.mask[places[:, 1], places[:, 0]].mean() > (0.7 if pen == "pencil" else 0.85)


def test_a_traced_page_can_be_scanned_with_several_pens():
    hand = load("house-joined")
    (sheet,) = compose(TEXT, hand, SMALL, np.random.default_rng(2))
    drawing = trace(sheet, hand, np.random.default_rng(3))
    one, two = (
        scan(sheet, drawing, hand, Desk(usual(name), dpi=120.0), rng=np.random.default_rng(1))
        for name in ("fountain", "pencil")
    )
    assert all(np.array_equal(a.xy, b.xy) for a, b in zip(one.truth.paths, two.truth.paths, strict=True))
    assert not np.array_equal(one.image, two.image)


@pytest.mark.parametrize(
    ("field", "value"),
    [("blur", -0.1), ("noise", 0.5), ("white", 0.1), ("rotation", np.inf), ("dust", -1.0), ("offset", (500.0, 0.0)),
     ("misregistration", ((3.0, 0.0), (0.0, 0.0)))],
)  # fmt: skip
def test_scanners_have_bounds(field, value):
    with pytest.raises(InputError, match=field):
        WornFlatbed(**{field: value})


@pytest.mark.parametrize(
    ("options", "said"), [({"dpi": 20.0}, "dpi"), ({"bits": 12}, "bits"), ({"dpi": 1200.0, "layout": None}, None)]
)
def test_what_cannot_be_scanned_is_refused(options, said):
    if said is None:
        options["layout"] = Layout(page("500x500mm"))
        said = "megapixels"
    with pytest.raises(InputError, match=said):
        made(**options)


def test_arrays_are_readonly(usual_page):
    for pixels in (usual_page.image, usual_page.truth.labels, usual_page.truth.alpha, usual_page.truth.paths[0].xy):
        with pytest.raises(ValueError, match="read-only"):
            pixels[0] = 0
