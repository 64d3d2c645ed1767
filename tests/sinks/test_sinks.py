from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pikepdf
import pytest
from PIL import Image
from sample_drawings import loops, same

from handout.errors import HandoutError, InputError
from handout.sinks import Look, Paper, Pen, check_outputs, suffixes, write_drawings
from handout.sources.drawing_json import from_json
from handout.sources.inkml import from_inkml
from handout.values import Drawing


def gcode(page: Drawing) -> bytes:
    return f"G0 ; {len(page.strokes)} strokes\n".encode()


def test_one_page_to_every_format(tmp_path: Path) -> None:
    paths = [tmp_path / f"letter{suffix}" for suffix in (".svg", ".png", ".pdf", ".inkml", ".JSON", ".gcode")]
    assert write_drawings([loops()], paths, extra={".gcode": gcode}) == paths
    assert same(from_json(paths[4].read_bytes()), loops())
    assert same(from_inkml(paths[3].read_bytes()), loops(), 1e-6)
    assert paths[0].read_bytes().startswith(b"<?xml") and paths[2].read_bytes().startswith(b"%PDF")
    assert paths[5].read_bytes() == b"G0 ; 9 strokes\n"
    assert Image.open(paths[1]).size == (1063, 472)


def test_several_pages(tmp_path: Path) -> None:
    pages = [loops(1), loops(2), loops(3)]
    files = write_drawings(pages, [tmp_path / "letter.json", tmp_path / "letter.pdf"])
    assert [f.name for f in files] == ["letter-1.json", "letter-2.json", "letter-3.json", "letter.pdf"]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(f.name for f in files)
    for page, file in zip(pages, files[:3], strict=True):
        assert same(from_json(file.read_bytes()), page)
    with pikepdf.open(files[3]) as pdf:
        assert len(pdf.pages) == 3


def test_pen_and_resolution_are_used(tmp_path: Path) -> None:
    pen = Pen(1.0, "#ff0000")
    write_drawings([loops()], [tmp_path / "a.svg", tmp_path / "a.png"], Look(pen, 100))
    svg = (tmp_path / "a.svg").read_text()
    assert 'stroke="#ff0000"' in svg and 'stroke-width="1"' in svg
    image = Image.open(tmp_path / "a.png")
    assert image.size == (354, 157) and (255, 0, 0) in {c for _, c in image.convert("RGB").getcolors(1 << 16) or []}


def test_same_bytes(tmp_path: Path) -> None:
    for suffix in (".svg", ".png", ".pdf", ".eps", ".dxf", ".inkml", ".json"):
        (first,) = write_drawings([loops()], [tmp_path / f"a{suffix}"])
        (second,) = write_drawings([loops()], [tmp_path / f"b{suffix}"])
        assert first.read_bytes() == second.read_bytes()


@pytest.mark.parametrize("name", ["letter.doc", "letter", "letter.gcode"])
def test_unknown_formats(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError) as caught:
        write_drawings([loops()], [tmp_path / name])
    assert all(suffix in str(caught.value) for suffix in (".svg", ".png", ".pdf", ".eps", ".dxf", ".inkml", ".json"))
    assert not list(tmp_path.iterdir())


def test_nothing_is_made_if_a_place_cannot_be_written(tmp_path: Path) -> None:
    calls: list[Drawing] = []

    def count(page: Drawing) -> bytes:
        calls.append(page)
        return b""

    with pytest.raises(InputError, match="does not exist"):
        write_drawings([loops()], [tmp_path / "a.gcode", tmp_path / "none" / "b.svg"], extra={".gcode": count})
    assert calls == [] and not list(tmp_path.iterdir())


def test_nothing_is_written_if_a_format_fails(tmp_path: Path) -> None:
    def refuse(page: Drawing) -> bytes:
        raise InputError("x = 412 mm is outside the bed.")

    (tmp_path / "a.svg").write_bytes(b"before")
    with pytest.raises(HandoutError, match="bed"):
        write_drawings([loops()], [tmp_path / "a.svg", tmp_path / "a.gcode"], extra={".gcode": refuse})
    assert [p.name for p in tmp_path.iterdir()] == ["a.svg"] and (tmp_path / "a.svg").read_bytes() == b"before"


def test_two_outputs_of_one_name(tmp_path: Path) -> None:
    same_name = [tmp_path / "a.svg", tmp_path / "b" / ".." / "a.svg"]
    (tmp_path / "b").mkdir()
    with pytest.raises(InputError, match="Two outputs"):
        check_outputs(same_name)
    with pytest.raises(InputError, match="Two outputs"):
        write_drawings([loops(), loops()], [tmp_path / "a.svg", tmp_path / "a-2.svg", tmp_path / "a.svg"])


def test_check_outputs_names_the_files(tmp_path: Path) -> None:
    assert check_outputs([tmp_path / "a.svg"]) == [tmp_path / "a.svg"]
    assert check_outputs([tmp_path / "a.svg"], pages=2) == [tmp_path / "a-1.svg", tmp_path / "a-2.svg"]
    assert suffixes({".gcode": gcode}) == [".dxf", ".eps", ".gcode", ".inkml", ".json", ".pdf", ".png", ".svg"]


def test_no_page(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no page"):
        write_drawings([], [tmp_path / "a.svg"])


@pytest.mark.parametrize("width, colour", [(0.0, "#000000"), (0.4, "blue")])
def test_pens_are_checked(width: float, colour: str) -> None:
    with pytest.raises(InputError):
        Pen(width, colour)


def test_imports_are_lazy() -> None:
    code = "import sys, handout.sinks; print([m for m in ('PIL', 'reportlab', 'cv2', 'scipy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.slow
def test_pictures_on_paper_and_without(tmp_path: Path) -> None:
    files = [tmp_path / f"{name}.png" for name in ("white", "laid", "clear", "again")]
    pen = Pen(0.4, "#303060", "ballpoint")
    for file, given in zip(files, ({}, {"paper": Paper("laid")}, {"transparent": True}, {}), strict=True):
        write_drawings([loops()], [file], Look(pen, 150, **given))
    white, laid, clear, _ = (np.asarray(Image.open(file)).astype(float) for file in files)
    assert files[0].read_bytes() == files[3].read_bytes()
    assert white.shape == laid.shape == (*clear.shape[:2], 3) and clear.shape[2] == 4
    bare = (white == 255).all(axis=2)
    assert (clear[bare][:, 3] <= 1).all() and (clear[~bare][:, 3] > 0).mean() > 0.9
    alpha = clear[..., 3:] / 255
    assert np.abs(255 * (1 - alpha) + clear[..., :3] * alpha - white).max() <= 2
    assert 220 < laid[bare].mean() < 250 and laid[~bare].mean() < white[~bare].mean()
    with pytest.raises(InputError, match="either transparent or on paper"):
        write_drawings([loops()], [tmp_path / "x.png"], Look(paper=Paper("laid"), transparent=True))
    assert not (tmp_path / "x.png").exists()
