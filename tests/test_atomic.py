"""Files are written whole or not at all, through links, and nothing is left beside them."""

import os
import threading

import pytest

from handout import atomic
from handout.errors import InputError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_replaced_as_a_whole_or_stays(tmp_path):
    path = tmp_path / "a.txt"
    atomic.write(path, b"one")
    with pytest.raises(KeyboardInterrupt), atomic.opened(path) as stream:
        stream.write(b"ha")
        raise KeyboardInterrupt
    assert path.read_bytes() == b"one" and names(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_its_target_is_written(tmp_path, there):
    folder = tmp_path / "deep"
    folder.mkdir()
    target, middle, link = folder / "target.svg", tmp_path / "middle.svg", tmp_path / "link.svg"
    if there:
        target.write_bytes(b"old")
    middle.symlink_to("deep/target.svg")
    link.symlink_to(middle)
    atomic.check_writable(link)
    atomic.write(link, b"new")
    assert link.is_symlink() and middle.is_symlink() and target.read_bytes() == b"new"
    assert names(tmp_path) == ["deep", "link.svg", "middle.svg"] and names(folder) == ["target.svg"]


@pytest.mark.parametrize("do", [atomic.check_writable, lambda path: atomic.write(path, b"x")])
def test_a_link_that_leads_nowhere_is_refused_and_stays(tmp_path, do):
    lost, ring = tmp_path / "lost.svg", tmp_path / "ring.svg"
    lost.symlink_to(tmp_path / "no-folder" / "a.svg")
    ring.symlink_to(ring)
    with pytest.raises(InputError, match=r"no-folder"):
        do(lost)
    with pytest.raises(InputError, match="a link that leads to itself"):
        do(ring)
    with pytest.raises(InputError, match="it is a folder"):
        do(tmp_path)
    assert lost.is_symlink() and ring.is_symlink()


def test_a_pipe_is_written_to_and_stays_one(tmp_path):
    pipe, heard = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: heard.append(pipe.read_bytes()))
    reader.start()
    atomic.write(pipe, b"through")
    reader.join()
    assert heard == [b"through"] and pipe.is_fifo()


def test_several_files_are_replaced_together_or_stay(tmp_path):
    first, second, gone = tmp_path / "a.svg", tmp_path / "b.svg", tmp_path / "none" / "c.svg"
    first.write_bytes(b"old")
    with pytest.raises(InputError, match=r"c\.svg"):
        atomic.write_all([(first, b"new"), (second, b"new"), (gone, b"new")])
    assert first.read_bytes() == b"old" and names(tmp_path) == ["a.svg"]
    atomic.write_all([(first, b"new"), (second, b"newer")])
    assert (first.read_bytes(), second.read_bytes()) == (b"new", b"newer") and names(tmp_path) == ["a.svg", "b.svg"]
