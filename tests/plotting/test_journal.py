"""The journal of a job: cut off at any byte it is still true, and damaged anywhere it says no more than is."""

import os
from dataclasses import replace

import pytest

from handout.errors import InputError
from handout.plotting.jobs.journal import JobProgress, PlotJournal, read_progress
from handout.plotting.jobs.places import START, DrawnPlace

PLACES = [DrawnPlace(0, 0.125), DrawnPlace(0, 1 / 3), DrawnPlace(1), DrawnPlace(4, 17.25)]


@pytest.fixture
def written(tmp_path):
    """A journal with everything in it, and what it said after each of its lines."""
    path, standings = tmp_path / "job" / "journal", []
    path.parent.mkdir()
    with PlotJournal(path) as kept:
        standings.append(kept.standing)
        for part in (0, 1):
            kept.begin(part)
            standings.append(kept.standing)
            for place in PLACES:
                kept.note_drawn(place)
                kept.sync()
                standings.append(kept.standing)
            if part == 0:
                kept.complete()
                standings.append(kept.standing)
    return path, [JobProgress(), *standings]


def test_it_says_how_far_a_job_has_come(written):
    path, standings = written
    standing = read_progress(path)
    assert standing == standings[-1]
    assert (standing.part, standing.begun, standing.place) == (1, True, PLACES[-1])
    with PlotJournal(path) as kept:
        assert kept.standing.place == PLACES[-1] and len(kept.standing.runs) == 2
        kept.complete()
        kept.finish()
    assert read_progress(path).finished and read_progress(path).part == 2


@pytest.mark.slow
def test_cut_off_at_every_byte_it_is_still_true(written):
    path, standings = written
    data = path.read_bytes()
    assert len(data.splitlines()) == len(standings) - 1
    for size in range(len(data) + 1):
        path.write_bytes(data[:size])
        standing = read_progress(path)
        lines = (data[:size] + b"\n").count(b"\n", 0, size + 1) - (not data[size:].startswith(b"\n"))
        assert standing == standings[lines]  # all of a line is there where its end alone is not
        with PlotJournal(path) as kept:
            assert (kept.standing.part, kept.standing.place) == (standing.part, standing.place)
        assert read_progress(path).place == standing.place  # what was torn is no part of the next line


@pytest.mark.parametrize("garbage", [b"\0" * 40, b"\xff\n\xff", b"90a1be17 drawn 0 99 1.0\n", b"90a1be", b"\n"])
def test_a_torn_end_is_cut_off_and_what_is_none_is_told(written, garbage):
    path, standings = written
    path.write_bytes(path.read_bytes() + garbage)
    torn = garbage in (b"90a1be", b"\n")
    lines = len(standings)
    assert read_progress(path) == replace(standings[-1], damaged=0 if torn else lines, uncertain=not torn)
    PlotJournal(path).close()
    assert (garbage in path.read_bytes()) == (garbage != b"90a1be")
    assert read_progress(path).place == standings[-1].place and len(read_progress(path).runs) == 2


def test_damage_before_the_end_is_told_and_the_lines_behind_it_say_where_the_job_stands(written):
    path, standings = written
    data = path.read_bytes()
    for at in range(0, data.rindex(b"\n", 0, -1), 7):
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        with PlotJournal(path) as kept:
            standing, line = kept.standing, data[:at].count(b"\n") + 1
        assert standing.damaged == line and not standing.uncertain
        assert (standing.part, standing.place) == (standings[-1].part, standings[-1].place)


def test_a_doubt_that_is_lost_takes_no_ink_with_it(tmp_path):
    path = tmp_path / "journal"
    with PlotJournal(path) as kept:
        kept.begin(0)
        kept.note_drawn(DrawnPlace(2, 1.5))
        kept.sync()
        kept.note_drawn(DrawnPlace(9, 0.5), proven=False)
        kept.sync()
        kept.doubt()
    damaged = path.read_bytes().replace(b" doubtful", b" doubtfuk")
    path.write_bytes(damaged)
    assert read_progress(path).place == DrawnPlace(2, 1.5) and read_progress(path).uncertain
    with PlotJournal(path) as kept:
        kept.note_drawn(DrawnPlace(3, 0.5))
    assert (
        read_progress(path).place == DrawnPlace(3, 0.5)
        and not read_progress(path).uncertain
        and read_progress(path).damaged == 5
    )


def test_what_began_in_a_damaged_line_is_not_taken_for_the_part_before(tmp_path):
    path = tmp_path / "journal"
    with PlotJournal(path) as kept:
        kept.begin(0)
        kept.note_drawn(DrawnPlace(9, 1.5))
        kept.complete()
        kept.begin(1)
        kept.note_drawn(DrawnPlace(2, 0.5))
    *before, complete, part, drawn = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*before, b"x" + complete[1:], b"x" + part[1:], drawn]))
    assert (read_progress(path).part, read_progress(path).begun, read_progress(path).place) == (
        1,
        True,
        DrawnPlace(2, 0.5),
    )


def test_two_programs_cannot_plot_one_job(written):
    path, _ = written
    with PlotJournal(path), pytest.raises(InputError, match="job is being plotted by another program"):
        PlotJournal(path)
    PlotJournal(path).close()


def test_only_what_is_synced_is_certain(written, monkeypatch):
    path, _ = written
    synced = []
    monkeypatch.setattr(os, "fsync", lambda handle: synced.append(path.read_bytes()))
    with PlotJournal(path) as kept:
        kept.begin(2)
        kept.note_drawn(DrawnPlace(3, 1.0))
        assert kept.standing.place == DrawnPlace(3, 1.0) and kept.certain.place == START
        count = len(synced)
        kept.sync()
        kept.sync()
        assert kept.certain == kept.standing and len(synced) == count + 1 and b"drawn 2 3 1.0\n" in synced[-1]


def test_why_it_ended_is_one_line(tmp_path):
    path = tmp_path / "journal"
    with pytest.raises(ValueError), PlotJournal(path):
        raise ValueError("one\n12345678 finished\nthree")
    assert read_progress(path).stopped == "one 12345678 finished three" and not read_progress(path).finished


def test_a_full_disk_is_named(tmp_path, monkeypatch):
    def full(handle):
        raise OSError(28, "No space left on device")

    with PlotJournal(tmp_path / "journal") as kept:
        monkeypatch.setattr("os.fsync", full)
        with pytest.raises(InputError, match=r"Cannot write the journal .*: No space left on device"):
            kept.begin(0)
        monkeypatch.undo()
