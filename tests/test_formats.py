"""Files of the program, read by a reader that knows docs/formats.md and not the program, are what the program reads."""

import importlib.util
import json

import msgspec
import numpy as np
import pytest
from test_readme import ROOT

from handout.hand import file
from handout.hand.corrections import JournalEntry, Remove, apply
from handout.hand.places import PLACES
from handout.inking.brush import brushes
from handout.motion.pose import library
from handout.motion.styles import style_file
from handout.plotting.jobs.journal import PlotJournal
from handout.plotting.jobs.places import DrawnPlace
from handout.sinks.drawing_json import to_json
from handout.values import Drawing, Page, Stroke
from handout_lab.study.design import Item, Key, Person, Snippet, seal

CODE = ROOT / "examples" / "read_files.py"
spec = importlib.util.spec_from_file_location("read_files", CODE)
reader = importlib.util.module_from_spec(spec)
spec.loader.exec_module(reader)
HAND = ROOT / "handout" / "hand" / "house" / "house-print-fountain.hand"


def test_the_reader_stands_alone():
    assert "import handout" not in CODE.read_text("utf-8") and "from handout" not in CODE.read_text("utf-8")


def same_glyphs(found, hand):
    assert found["letters"] == [glyph.letter for glyph in hand.glyphs]
    rows = [(g.page, g.line, g.word, g.at, g.before, g.after, PLACES.index(g.place)) for g in hand.glyphs]
    np.testing.assert_array_equal(found["table"], rows)
    np.testing.assert_array_equal(np.concatenate(found["vertices"]), np.concatenate([g.vertices for g in hand.glyphs]))
    ways = [(number, way.path) for number, glyph in enumerate(hand.glyphs) for way in glyph.ligatures]
    assert [number for number, _ in found["ligatures"]] == [number for number, _ in ways]
    np.testing.assert_array_equal(
        np.concatenate([path for _, path in found["ligatures"]]), np.concatenate([path for _, path in ways])
    )


@pytest.mark.slow
def test_a_hand():
    found, hand = reader.read_hand(HAND), file.load(HAND)
    same_glyphs(found, hand)
    for page, own in zip(found["pages"], hand.pages, strict=True):
        np.testing.assert_array_equal(page["uv"], own.graph.uv)
        np.testing.assert_allclose(page["xy"], own.graph.xy, atol=1e-12)
        np.testing.assert_array_equal(page["edges"], own.graph.edges)
        np.testing.assert_allclose(page["radius"] * 25.4 / page["dpi"], own.graph.radius, atol=1e-12)
        np.testing.assert_array_equal(page["density"], own.graph.density)
        for x in (0.0, 900.0, 2400.0):
            np.testing.assert_allclose(reader.baseline(page, 3, x), float(own.base(3, x)), atol=1e-9)
    np.testing.assert_array_equal(found["pages"][0]["ink"](), hand.pages[0].texture.rgba)


def test_what_was_corrected_of_a_hand(small_hand, tmp_path):
    number = len(small_hand.glyphs) // 2
    graph, glyph = small_hand.pages[0].graph, small_hand.glyphs[number]
    place = graph.uv[glyph.vertices[len(glyph.vertices) // 2]]
    remove = Remove(page=0, at=tuple(place.tolist()))
    corrected, path = apply(small_hand, [remove]), tmp_path / "corrected.hand"
    file.save(small_hand, tmp_path / "small.hand")
    file.record(tmp_path / "small.hand", path, small_hand, corrected, JournalEntry((remove,)))
    found = reader.read_hand(path)
    same_glyphs(found, file.load(path))
    assert len(found["letters"]) == len(small_hand.glyphs) - 1


def test_a_pose_library():
    path = ROOT / "poses" / "firm.pose"
    found, own = reader.read_pose(path), library.load(path)
    assert set(found) == {"path", *own.channels}
    for number, (xy, channels) in enumerate(own.strokes()):
        np.testing.assert_allclose(found["path"][number], xy * own.unit, atol=1e-12)
        for name, values in channels.items():
            np.testing.assert_allclose(found[name][number], values, atol=1e-12)


def test_a_learned_style():
    path = ROOT / "styles" / "learned.style"
    found, (_, own) = reader.read_style(path), style_file.load(path)
    assert own.structure is not None
    for name, model in (("dynamics", own.dynamics), ("structure", own.structure)):
        for mine, layer in zip(found["networks"][name], model.parameters, strict=True):
            np.testing.assert_array_equal(mine, layer)
    scales = (own.dynamics.mean, own.dynamics.spread, own.dynamics.told_mean, own.dynamics.told_spread)
    np.testing.assert_array_equal(np.concatenate(found["scales"]), np.concatenate(scales))
    assert list(found["primers"]) == list(own.primers)
    for rows, primer in zip(found["primers"].values(), own.primers.values(), strict=True):
        np.testing.assert_array_equal(rows[:, :2], primer.targets)
        np.testing.assert_array_equal(rows[1:, 2] > 0, primer.up)
        np.testing.assert_array_equal(rows[1:, 3:], np.column_stack([primer.dt, primer.theta]))


def test_a_brush():
    path = ROOT / "brushes" / "sumi.brush"
    for (pixels, bend), ribbon in zip(reader.read_brush(path), brushes.load(path).ribbons, strict=True):
        np.testing.assert_array_equal(pixels, ribbon.rgba)
        np.testing.assert_array_equal(bend, ribbon.bend)


def test_a_drawing(tmp_path):
    t = np.array([0.1, 0.2, 0.3])
    xy = np.array([[1.0, 2.0], [1 / 3, 2.5], [1.5, 3.0]])
    stroke = Stroke(t, xy, pressure=np.array([0.1, 0.2, 0.3]), word=2, colour="#c01020")
    (tmp_path / "a.json").write_bytes(to_json(Drawing((stroke,), Page(50.0, 60.0, ""), {})))
    (found,) = reader.read_drawing(tmp_path / "a.json")
    np.testing.assert_array_equal(np.column_stack([found["x"], found["y"]]), xy)
    np.testing.assert_array_equal(found["t"], t)
    np.testing.assert_array_equal(found["pressure"], stroke.pressure)
    assert (found["word"], found["colour"], "tilt" in found) == (2, "#c01020", False)


def test_the_key_of_a_study(tmp_path):
    person = Person((Item(0, "made"),), (Item(0, "left", "control", 1),))
    key = Key(7, ("me",), (Snippet(0, 1, 2, "the jam", 3, lent="j", made="b"),), (person,))
    name = seal(key, tmp_path / "study.key")
    assert reader.read_key(tmp_path / "study.key") == (name, json.loads(msgspec.json.encode(key)))


def test_a_journal(tmp_path):
    path = tmp_path / "journal"
    with PlotJournal(path) as journal:
        journal.begin(0)
        journal.note_drawn(DrawnPlace(17, 12.345))
        journal.complete()
        journal.finish()
    lines = reader.read_journal(path)
    assert [line[0] for line in lines] == ["run", "part", "drawn", "complete", "finished"]
    assert lines[2] == ["drawn", "0", "17", "12.345"]
    path.write_bytes(path.read_bytes() + b"torn")
    assert reader.read_journal(path) == lines
    path.write_bytes(b"torn\n" + path.read_bytes())
    with pytest.raises(ValueError, match="damaged"):
        reader.read_journal(path)
