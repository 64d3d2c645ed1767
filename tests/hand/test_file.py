"""The .hand file: what is saved comes back, and what does not fit together is refused with a sentence."""

import io
import json
import struct
import zipfile
import zlib
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from handout.errors import InputError
from handout.hand import file, learnt
from handout.hand.archive import content_bytes, join_bytes, split_bytes
from handout.hand.corrections import Corrections, JournalEntry, Label, Paint, Remove, apply


@pytest.fixture(scope="module")
def whole(small_hand):
    return file.to_bytes(small_hand)


def rewritten(whole, path, changes):
    """The archive with some parts replaced by bytes or arrays, or left out (None)."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(whole)) as old, zipfile.ZipFile(stream, "w") as new:
        for name in old.namelist():
            content = changes.get(name, old.read(name))
            if callable(content):
                content = content(old.read(name))
            if content is not None:
                new.writestr(name, content)
    path.write_bytes(stream.getvalue())
    return path


def array(change):
    """A change of an array: its numbers, changed in place, or what is to stand there instead."""

    def changed(data):
        values = np.load(io.BytesIO(data), allow_pickle=False)
        split = values.dtype == np.uint8 and values.ndim > 1
        values = join_bytes(values) if split else values
        result = change(values)
        return content_bytes(result if result is not None else split_bytes(values) if split else values)

    return changed


def facts(**values):
    return lambda data: json.dumps(json.loads(data) | values).encode()


def put(where, value):
    return array(lambda values: values.__setitem__(where, value))


def test_what_is_saved_comes_back(small_hand, tmp_path):
    path = tmp_path / "a.hand"
    file.save(small_hand, path)
    back = file.load(path)
    assert (back.name, back.title, back.letters) == (small_hand.name, small_hand.title, small_hand.letters)
    for one, two in zip(small_hand.glyphs, back.glyphs, strict=True):
        assert (one.letter, one.place, one.line, one.word, one.at) == (
            two.letter,
            two.place,
            two.line,
            two.word,
            two.at,
        )
        assert (one.before, one.after) == (two.before, two.after)
        assert np.array_equal(one.vertices, two.vertices)
        assert [w.path.tolist() for w in one.ligatures] == [w.path.tolist() for w in two.ligatures]
        assert one.confidence == pytest.approx(two.confidence, abs=1e-6)
    one, two = small_hand.pages[0], back.pages[0]
    assert np.abs(one.graph.uv - two.graph.uv).max() <= 1 / 32
    assert np.abs(one.graph.radius - two.graph.radius).max() <= one.pixel / 512 + 1e-9
    assert np.abs(one.graph.density - two.graph.density).max() <= 0.005 + 1e-9
    assert np.array_equal(one.graph.edges, two.graph.edges)
    assert np.array_equal(one.texture.rgba, two.texture.rgba) and np.array_equal(one.paper, two.paper)
    assert np.array_equal(one.baselines, two.baselines)
    assert (one.transcript, one.dpi, one.pen, one.shape) == (two.transcript, two.dpi, two.pen, two.shape)
    assert file.to_bytes(back) == file.to_bytes(file.load(path)) == path.read_bytes()


def test_a_file_of_the_format_before_is_read_corrected_and_undone(tmp_path):
    """`golden/format-2.hand` was saved by the last program of that format, from the page of `golden/small_scan.png`."""
    old, path = Path(__file__).parents[1] / "golden" / "format-2.hand", tmp_path / "a.hand"
    hand = file.check(old)
    file.save(hand, path, packed=True)
    with zipfile.ZipFile(old) as one, zipfile.ZipFile(path) as two:
        assert b'"format": 2' in one.read("hand.json") and b'"format": 3' in two.read("hand.json")
        assert one.namelist() == two.namelist()
        for name in (name for name in one.namelist() if name.endswith(".npy")):
            kept, split = (np.load(io.BytesIO(archive.read(name))) for archive in (one, two))
            assert np.array_equal(kept, split if split.shape == kept.shape else join_bytes(split)), name
        assert one.read("pages/0/ink.webp") == two.read("pages/0/ink.webp")
    assert path.stat().st_size < old.stat().st_size
    assert file.to_bytes(file.load(path)) == file.to_bytes(hand)
    remove = Remove(page=0, at=spot(hand, "j"))
    file.record(old, path, hand, apply(hand, [remove]), JournalEntry((remove,)))
    assert "j" not in file.load(path).letters
    file.rewind(path, path, 0)
    assert file.to_bytes(file.load(path)) == file.to_bytes(hand)


def test_textures_are_read_when_looked_at(whole, small_hand, tmp_path):
    path = rewritten(whole, tmp_path / "a.hand", {"pages/0/ink.png": b"no picture"})
    page = file.load(path).pages[0]
    assert page.texture.shape == small_hand.pages[0].texture.shape
    with pytest.raises(InputError, match=r"ink\.png is not a picture"):
        _ = page.texture.rgba


def bomb(side, colour):
    """A PNG of some kilobytes that unpacks to side × side pixels: of two kinds of colour, 2 RGB, 6 RGBA."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, colour, 0, 0, 0))
    rows = zlib.compress(bytes(1000))  # the rest is never asked for
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


@pytest.mark.parametrize(("part", "colour"), [("ink.png", 6), ("paper.png", 2), ("scan.webp", 2)])
@pytest.mark.parametrize("side", [4000, 15000])  # under and over what Pillow itself refuses
def test_a_picture_larger_than_it_says_is_never_unpacked(whole, tmp_path, part, colour, side):
    path = rewritten(whole, tmp_path / "a.hand", {f"pages/0/{part}": bomb(side, colour)})
    with pytest.raises(InputError, match=rf"{part} has {side} × {side} pixels, too many"):
        file.check(path)


def test_a_scan_of_another_size_than_its_page_is_refused(whole, tmp_path):
    _, small = cv2.imencode(".webp", np.zeros((8, 9, 3), np.uint8))
    with pytest.raises(InputError, match=r"scan\.webp has another size than it says"):
        file.check(rewritten(whole, tmp_path / "a.hand", {"pages/0/scan.webp": small.tobytes()}))


def spot(hand, letter):
    return tuple(hand.pages[0].graph.uv[hand.glyphs[int(hand.numbers_of_letter(letter)[0])].vertices[5]].tolist())


def test_entries_of_the_journal_are_undone_and_made_again(small_hand, tmp_path):
    path, copy = tmp_path / "a.hand", tmp_path / "b.hand"
    file.save(small_hand, path)
    whole = path.read_bytes()
    steps = [[Remove(page=0, at=spot(small_hand, "j"))], [Paint(0, to="ink", stroke=((3, 4), (60, 4)), width=6.0)]]
    hands = [file.load(path)]
    for number, made in enumerate(steps):
        hands.append(apply(hands[-1], made))
        file.record(path, copy if number else path, hands[-2], hands[-1], JournalEntry(tuple(made)))
    assert "j" not in file.load(copy).letters and len(file.journal(copy).corrections) == 2
    for made, hand in ((1, hands[1]), (0, hands[0]), (2, hands[2])):
        assert file.rewind(copy, copy, made).made == made
        back = file.check(copy)
        assert back.letters == hand.letters and np.array_equal(back.pages[0].texture.rgba, hand.pages[0].texture.rgba)
        assert len(back.pages[0].graph) == len(hand.pages[0].graph)
        assert np.array_equal(back.pages[0].dismissed, hand.pages[0].dismissed)
    with pytest.raises(InputError, match="nothing to be made again"):
        file.rewind(copy, copy, 3)
    file.rewind(copy, copy, 0)
    file.record(copy, copy, file.load(copy), hands[1], JournalEntry(tuple(steps[0])))
    assert len(file.journal(copy).entries) == 1, "what was undone is forgotten"
    assert {name for name in zipfile.ZipFile(copy).namelist() if name.startswith("corrections/2")} == set()
    file.rewind(path, path, 0)
    with zipfile.ZipFile(io.BytesIO(whole)) as one, zipfile.ZipFile(path) as other:
        assert all(one.read(name) == other.read(name) for name in one.namelist() if name != "corrections.json")


def test_corrections_of_an_earlier_program_are_made(whole, small_hand, tmp_path):
    earlier = Corrections((Label(page=0, at=spot(small_hand, "j"), text="J"),))
    path = rewritten(whole, tmp_path / "a.hand", {"corrections.json": msgspec.json.encode(earlier)})
    hand = file.load(path)
    assert "j" not in hand.letters and hand.letters["J"] == 1
    made = JournalEntry((Remove(page=0, at=spot(small_hand, "j")),))
    file.record(path, path, hand, apply(hand, made.corrections), made)
    assert "J" not in file.load(path).letters and len(file.journal(path).corrections) == 2


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"hand.json": None}, "is not a .hand file"),
        ({"hand.json": facts(format=file.FORMAT + 1)}, "newer version"),
        ({"hand.json": facts(format=0)}, "read the pages again"),
        ({"hand.json": facts(format="1")}, "cannot be used"),
        ({"hand.json": facts(more=1)}, "cannot be used"),
        ({"hand.json": facts(letters=["a"])}, r"table\.npy is"),
        ({"hand.json": facts(pages=[])}, "cannot be used"),
        ({"corrections.json": b'{"corrections": [{"do": "explode", "page": 0}]}'}, "corrections"),
        ({"corrections.json": None}, "corrections.json is missing"),
        ({"glyphs/vertices.npy": put(0, -1)}, "do not fit together"),
        ({"glyphs/vertices.npy": put(3, 2**31 - 1)}, "do not fit together"),
        ({"glyphs/counts.npy": put(0, -5)}, "not as long as they say"),
        ({"glyphs/counts.npy": put(0, 2**31 - 1)}, "not as long as they say"),
        ({"glyphs/table.npy": put((0, 0), 7)}, "do not fit together"),
        ({"glyphs/table.npy": put((0, 1), 99)}, "do not fit together"),
        ({"glyphs/table.npy": put((0, 4), 10**6)}, "which there is not"),
        ({"glyphs/table.npy": put((0, 5), -2)}, "which there is not"),
        ({"glyphs/table.npy": put((3, 6), 4)}, "no place in its word"),
        ({"glyphs/confidence.npy": put(0, 3.0)}, "confidence"),
        ({"glyphs/confidence.npy": put(0, np.nan)}, "not finite"),
        ({"ligatures/from.npy": put(0, 10**6)}, "a ligature begins"),
        ({"ligatures/vertices.npy": put(0, 10**8)}, "names a vertex"),
        ({"pages/0/edges.npy": put((0, 0), -1)}, "an edge names a vertex"),
        ({"pages/0/uv.npy": put((0, 0), 2**30)}, "outside its picture"),
        ({"pages/0/uv.npy": array(lambda a: a[:-1])}, "cannot be used"),
        ({"pages/0/radius.npy": array(lambda a: a.astype(object).astype(float))}, "is float64"),
        ({"pages/0/ink.png": None}, "has no ink"),
    ],
)
def test_what_does_not_fit_together_is_refused(whole, tmp_path, changes, says):
    path = rewritten(whole, tmp_path / "a.hand", changes)
    with pytest.raises(InputError, match=says) as error:
        file.load(path)
    assert "\n" not in str(error.value) or "corrections" in str(error.value)


@pytest.mark.parametrize("key", ["dpi", "pitch", "baselines", "corner", "texture", "shape"])
@pytest.mark.parametrize("value", [0, -1, "x", [], [-1, 0], [10**9, 10**9], [[0] * 5], None])
def test_pages_that_are_none_are_refused(whole, tmp_path, key, value):
    def change(data):
        facts = json.loads(data)
        facts["pages"][0][key] = value
        return json.dumps(facts).encode()

    path = rewritten(whole, tmp_path / "a.hand", {"hand.json": change})
    with pytest.raises(InputError):
        file.load(path)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_a_file_that_is_cut_off_is_refused(whole, tmp_path, share):
    path = tmp_path / "a.hand"
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError):
        file.load(path)


@pytest.mark.parametrize("content", [b"", b"x = 1", b"\x89PNG", b"PK"])
def test_another_file_is_refused(tmp_path, content):
    path = tmp_path / "a.hand"
    path.write_bytes(content)
    with pytest.raises(InputError):
        file.load(path)
    with pytest.raises(InputError, match="no such file"):
        file.load(tmp_path / "b.hand")


def test_any_damage_is_refused_or_harmless(whole, tmp_path):
    rng = np.random.default_rng(0)
    path = tmp_path / "a.hand"
    for _ in range(40):
        damaged = bytearray(whole)
        for at in rng.integers(0, len(whole), 3):
            damaged[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(damaged))
        try:
            hand = file.load(path)
            _ = hand.pages[0].texture.rgba
        except InputError as error:
            assert str(path) in str(error)


def test_lines_that_no_pen_has_drawn_are_refused(whole, tmp_path):
    name = "pages/0/radius.npy"

    with pytest.raises(InputError, match="lines that no pen has drawn"):
        file.load(rewritten(whole, tmp_path / "a.hand", {name: put(1, 65535)}))


def never():
    raise AssertionError("worked out again")


def test_what_was_learnt_of_a_hand_comes_back_to_the_last_bit(small_hand, tmp_path):
    path = tmp_path / "a.hand"
    file.save(small_hand, path)
    hand = file.load(path)
    values = [1 / 3, 5e-324, -0.1]
    learnt.learnt(hand, "thirds", 1, 3, lambda: values)
    file.keep_learnt(path, learnt.known_values(hand))
    read = file.load(path)
    assert learnt.learnt(read, "thirds", 1, 3, never).tolist() == values
    assert learnt.learnt(read, "thirds", 2, 3, lambda: [0.0] * 3).tolist() == [0.0] * 3, "another version"
    assert learnt.learnt(file.load(path), "thirds", 1, 2, lambda: [1.0, 2.0]).tolist() == [1.0, 2.0]


def test_what_was_learnt_counts_for_the_letters_that_it_was_learnt_of(small_hand, tmp_path):
    path = tmp_path / "a.hand"

    def asked(work_out):
        return learnt.learnt(file.load(path), "letters", 1, 1, work_out)[0]

    def keep(value):
        hand = file.load(path)
        learnt.learnt(hand, "letters", 1, 1, lambda: [value])
        file.keep_learnt(path, learnt.known_values(hand))

    file.save(small_hand, path)
    keep(1.0)
    before = file.load(path)
    correction = Label(page=0, at=spot(small_hand, "j"), text="J")
    file.record(path, path, before, apply(before, [correction], strict=False), JournalEntry((correction,)))
    assert asked(lambda: [2.0]) == 2.0, "a letter is called otherwise"
    keep(3.0)
    assert asked(never) == 3.0
    keep(3.0)  # again: what the parts at the top are stays
    file.rewind(path, path, 0)
    assert asked(never) == 1.0 and "J" not in file.load(path).letters
    file.rewind(path, path, 1)
    assert asked(never) == 3.0
