"""Files are written whole or not at all, through links, and nothing is left beside them."""

import os
import threading
from pathlib import Path

import pytest

from handout import atomic
from handout.errors import InputError

_LOOK = Path("/proc/self/fd")  # names of open handles


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_replaced_as_a_whole_or_stays(tmp_path):
    path = tmp_path / "a.txt"
    atomic.write(path, b"one")
    with pytest.raises(KeyboardInterrupt), atomic.open_file(path) as stream:
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


@pytest.fixture
def disk(tmp_path, monkeypatch):
    """What a disk does, in order: puts a file or the names of a folder on itself, and renames."""
    done = []

    def sync(handle):
        done.append(
            ("sync", os.path.relpath(_LOOK.joinpath(str(handle)).readlink(), tmp_path), os.fstat(handle).st_size)
        )

    def renaming(real):
        def rename(self, to):
            done.append(("rename", self.name, to.name))
            return real(self, to)

        return rename

    monkeypatch.setattr("os.fsync", sync)
    monkeypatch.setattr(atomic.Path, "replace", renaming(atomic.Path.replace))
    monkeypatch.setattr(atomic.Path, "rename", renaming(atomic.Path.rename))
    return done


@pytest.mark.skipif(not _LOOK.exists(), reason="handles have no names here")
def test_content_is_on_the_disk_before_its_name_and_then_the_name(tmp_path, disk):
    atomic.write(tmp_path / "a.hand", b"letters")
    (kind, temporary, size), (_, old, new), (last, folder, _) = disk
    assert (kind, size, temporary, new) == ("sync", 7, old, "a.hand") and (last, folder) == ("sync", ".")


@pytest.mark.skipif(not _LOOK.exists(), reason="handles have no names here")
def test_a_folder_is_on_the_disk_with_its_files_before_its_name(tmp_path, disk):
    (tmp_path / "new" / "deep").mkdir(parents=True)
    (tmp_path / "new" / "deep" / "a").write_bytes(b"one")
    (tmp_path / "new" / "deep" / "a").chmod(0o444)
    atomic.move_folder(tmp_path / "new", tmp_path / "kept")
    at = disk.index(("rename", "new", "kept"))
    assert ("sync", "new/deep/a", 3) in disk[:at]
    assert {"new", "new/deep"} <= {name for kind, name, _ in disk[:at]} and [disk[-1][:2]] == [("sync", ".")]
