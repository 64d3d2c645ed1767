"""Styles that were learned: kept in a file, given back, refused where they are damaged, and moved in."""

import io
import zipfile

import numpy as np
import pytest
from msgspec.structs import replace

from handout.errors import InputError
from handout.motion.learned import model, training
from handout.motion.styles import asemic, style, style_file
from handout.motion.styles.restyling import restyle
from handout.motion.styles.style import find
from handout.values import Drawing, Page, Stroke

QUICK = model.Lesson(recipe=training.NetworkRecipe(steps=25))
HEAD = '{"format":"handout-style","version":%d,"inputs":"ahead","hidden":[%d],"gaussians":1,"longest":0,"primers":[]}'
TOML = 'title = "t"\n[learned]\nduration = "90ms"\n[brush]\nwidth = 0.06\n'


@pytest.fixture(scope="module")
def learned():
    rng = np.random.default_rng(1)
    tags = {n: [asemic.tag(2, find(n), Page(148.0, 105.0), rng)] for n in ("calm", "chancery")}
    return model.learn(tags, rng, QUICK).movement


@pytest.fixture(scope="module")
def packed(learned):
    return style_file.to_bytes(TOML, learned)


def loop():
    a = np.linspace(0, 5, 90)
    strokes = [
        np.column_stack([20 + 8 * np.cos(a) + 2 * a, 30 + 9 * np.sin(a)]),
        np.array([[44.0, 22.0], [45.0, 38.0]]),
    ]
    strokes.append(np.array([[50.0, 20.0], [50.2, 20.1]]))
    return Drawing(
        tuple(
            Stroke(k + np.arange(len(xy)) / 100, xy, pressure=np.linspace(0.2, 0.8, len(xy)))
            for k, xy in enumerate(strokes)
        ),
        Page(80.0, 60.0),
    )


def test_comes_back_and_moves_the_same(learned, packed, tmp_path):
    (tmp_path / "mine.style").write_bytes(packed)
    mine = find(str(tmp_path / "mine.style"))
    assert mine.name == "mine" and list(mine.model.primers) == ["calm", "chancery"] and mine.learned.duration == 0.09
    for ours, theirs in zip(learned.dynamics.parameters, mine.model.dynamics.parameters, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=2e-3)
    first, again, other, primed = (
        restyle(
            loop(), replace(mine, learned=replace(mine.learned, primer=p, temperature=1.0)), np.random.default_rng(s)
        )
        for s, p in ((1, ""), (1, ""), (2, ""), (1, "chancery"))
    )
    assert all((a.xy == b.xy).all() for a, b in zip(first.strokes, again.strokes, strict=True))
    assert any(
        len(a.xy) != len(b.xy) or np.abs(a.xy - b.xy).max() > 1e-3
        for a, b in zip(first.strokes, other.strokes, strict=True)
    )
    assert any(
        len(a.xy) != len(b.xy) or np.abs(a.xy - b.xy).max() > 1e-3
        for a, b in zip(first.strokes, primed.strokes, strict=True)
    )
    assert all(s.pressure is not None and s.width is not None for s in first.strokes)
    times = np.concatenate([s.t for s in first.strokes])
    assert (np.diff(times) > 0).all() and len(first.strokes[2].t) == 2


def test_held_strokes_pass_the_places_that_were_drawn(packed, tmp_path):
    (tmp_path / "mine.style").write_bytes(packed)
    mine = find(str(tmp_path / "mine.style"))
    drawing = loop()
    own = restyle(drawing, replace(mine, learned=replace(mine.learned, keep=1.0)), np.random.default_rng(1))
    for before, after in zip(drawing.strokes, own.strokes, strict=True):
        away = np.linalg.norm(before.xy[:, None] - after.xy[None], axis=2).min(axis=1)
        assert away.max() < 0.9  # mm, of a letter of 18: all of its own dynamics give the letter again


def changed(packed, name, content):
    old, stream = zipfile.ZipFile(io.BytesIO(packed)), io.BytesIO()
    with zipfile.ZipFile(stream, "w") as new:
        for part in old.namelist():
            if part != name:
                new.writestr(part, old.read(part))
            elif content is not None:
                new.writestr(part, content)
    return stream.getvalue()


def array(values):
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        (None, None, "cut off"),
        ("learned.json", None, "learned.json is missing"),
        ("dynamics/0.npy", array(np.full((75, 256), np.nan, np.float16)), "not finite"),
        ("dynamics/0.npy", array(np.zeros((3, 3), np.float16)), "float16 of"),
        ("dynamics/0.npy", b"\x80\x04]", "not an array"),
        ("dynamics/scales.npy", array(np.zeros(24, np.float32)), "not above 0"),
        ("primers/0.npy", array(np.full((4, 5), 7, np.float32)), "no movement"),
        ("style.toml", 'title = "t"\n[movement]\nsmooth = 0.2\n', "movement is a rule"),
        ("style.toml", 'title = "t"\n[learned]\ntemperature = 90\n', "learned.temperature"),
        ("style.toml", 'title = "t"\nmodel = 1\n', "model cannot be set"),
        ("style.toml", "title = ", "cannot be read as a style"),
        ("learned.json", HEAD % (9, 1), "version 9"),
        ("learned.json", HEAD % (1, 999999), "that size"),
    ],
)  # fmt: skip
def test_what_is_damaged_is_refused(packed, tmp_path, name, content, said):
    path = tmp_path / "bad.style"
    path.write_bytes(packed[:-300] if name is None else changed(packed, name, content))
    with pytest.raises(InputError, match=said) as refused:
        style.read_style(path)
    assert "bad.style" in str(refused.value)


def test_an_archive_s_table_is_not_for_rules(tmp_path):
    (tmp_path / "x.toml").write_text('title = "t"\n[learned]\nhold = 0.5\n')
    with pytest.raises(InputError, match="handout style learn"):
        style.read_style(tmp_path / "x.toml")
