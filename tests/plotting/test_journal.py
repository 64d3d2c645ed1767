"""The journal of a job: cut off at any byte it is still true, damaged before its end it is refused."""

import os

import pytest

from handout.errors import InputError
from handout.plotting.jobs import journal
from handout.plotting.jobs.journal import JobProgress, Journal, read
from handout.plotting.jobs.places import START, Place

PLACES = [Place(0, 0.125), Place(0, 1 / 3), Place(1), Place(4, 17.25)]


@pytest.fixture
def written(tmp_path):
    """A journal with everything in it, and what it said after each of its lines."""
    path, standings = tmp_path / "job" / "journal", []
    path.parent.mkdir()
    with Journal(path) as kept:
        standings.append(kept.standing)
        for part in (0, 1):
            kept.begin(part)
            standings.append(kept.standing)
            for place in PLACES:
                kept.drawn(place)
                kept.sync()
                standings.append(kept.standing)
            if part == 0:
                kept.complete()
                standings.append(kept.standing)
    return path, [JobProgress(), *standings]


def test_it_says_how_far_a_job_has_come(written):
    path, standings = written
    standing, whole = read(path)
    assert standing == standings[-1] and whole == path.stat().st_size
    assert (standing.part, standing.begun, standing.place) == (1, True, PLACES[-1])
    with Journal(path) as kept:
        assert kept.standing.place == PLACES[-1] and len(kept.standing.runs) == 2
        kept.complete()
        kept.finish()
    assert read(path)[0].finished and read(path)[0].part == 2


def test_cut_off_at_every_byte_it_is_still_true(written):
    path, standings = written
    data = path.read_bytes()
    assert len(data.splitlines()) == len(standings) - 1
    for size in range(len(data) + 1):
        path.write_bytes(data[:size])
        standing, whole = read(path)
        lines = data[:size].count(b"\n")
        assert standing == standings[lines] and whole == len(b"".join(data.splitlines(keepends=True)[:lines]))
        with Journal(path) as kept:
            assert (kept.standing.part, kept.standing.place) == (standing.part, standing.place)
        assert read(path)[0].place == standing.place  # what was torn is no part of the next line


@pytest.mark.parametrize("garbage", [b"\0" * 40, b"\xff\n\xff", b"90a1be17 drawn 0 99 1.0\n", b"\n"])
def test_a_torn_end_is_left_out(written, garbage):
    path, standings = written
    path.write_bytes(path.read_bytes() + garbage)
    assert read(path)[0] == standings[-1]
    Journal(path).close()
    assert garbage not in path.read_bytes() or garbage == b"\n"


def test_damage_before_the_end_is_refused(written):
    path, _ = written
    data = path.read_bytes()
    for at in range(0, data.rindex(b"\n", 0, -1), 7):
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        with pytest.raises(InputError, match=r"damaged before line \d+: what is drawn is not certain"):
            Journal(path)
    path.write_bytes(data)
    Journal(path).close()  # none of these held it


def test_two_programs_cannot_plot_one_job(written):
    path, _ = written
    with Journal(path), pytest.raises(InputError, match="job is being plotted by another program"):
        Journal(path)
    Journal(path).close()


def test_only_what_is_synced_is_certain(written, monkeypatch):
    path, _ = written
    synced = []
    monkeypatch.setattr(os, "fsync", lambda handle: synced.append(path.read_bytes()))
    with Journal(path) as kept:
        kept.begin(2)
        kept.drawn(Place(3, 1.0))
        assert kept.standing.place == Place(3, 1.0) and kept.certain.place == START
        count = len(synced)
        kept.sync()
        kept.sync()
        assert kept.certain == kept.standing and len(synced) == count + 1 and b"drawn 2 3 1.0\n" in synced[-1]


def test_why_it_ended_is_one_line(tmp_path):
    path = tmp_path / "journal"
    with pytest.raises(ValueError), Journal(path):
        raise ValueError("one\n12345678 finished\nthree")
    assert read(path)[0].stopped == "one 12345678 finished three" and not read(path)[0].finished


def test_a_full_disk_is_named(tmp_path, monkeypatch):
    def full(handle):
        raise OSError(28, "No space left on device")

    with Journal(tmp_path / "journal") as kept:
        monkeypatch.setattr(journal.os, "fsync", full)
        with pytest.raises(InputError, match=r"Cannot write the journal .*: No space left on device"):
            kept.begin(0)
        monkeypatch.undo()
