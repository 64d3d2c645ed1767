"""`handout studio` before it serves: what it lacks, what it is given, where it listens."""

import os
import socket
import sys
import tempfile

import pytest

from handout.cli import main
from handout.web.workers import bare


def said(capsys, *arguments):
    with pytest.raises(SystemExit) as leave:
        main(["studio", *arguments])
    return leave.value.code, capsys.readouterr().err


@pytest.mark.parametrize("package", ["starlette.applications", "uvicorn"])
def test_without_the_extra_it_says_how_to_get_it(capsys, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(sys.modules, "handout.web.server", raising=False)
    code, sentence = said(capsys, "--no-browser")
    assert code == 2 and "pip install 'handout-driver[web]'" in sentence and sentence.count("\n") == 1


def test_hands_that_are_none_are_refused(capsys, tmp_path):
    (tmp_path / "a.b.hand").write_bytes(b"PK")
    assert "no such .hand file" in said(capsys, str(tmp_path / "none.hand"))[1]
    assert "letters, digits" in said(capsys, str(tmp_path / "a.b.hand"))[1]


def test_a_port_that_is_taken_is_refused_and_the_usual_one_is_not_insisted_on(capsys):
    server = pytest.importorskip("handout.web.server")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        code, sentence = said(capsys, "--no-browser", "--port", str(port))
        assert code == 2 and str(port) in sentence
    with server.listening(None) as one, server.listening(None) as two:  # that start at once
        assert one.getsockname()[0] == "127.0.0.1" and one.getsockname() != two.getsockname()


def test_sentences_do_not_tell_the_server_s_folders(monkeypatch):
    monkeypatch.setattr("tempfile.gettempdir", lambda: "/tmp")
    assert bare("/tmp/handout-studio-x_1/tmp9/page.png: no picture.") == "page.png: no picture."
    assert bare("/home/me/page.png: no picture.") == "/home/me/page.png: no picture."


def test_pages_that_the_commands_open_refuse_what_is_none(capsys, tmp_path):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("title = 3\n", encoding="utf-8")
    for arguments, said_ in (
        (["style", "edit", str(wrong), "--no-browser"], "title"),
        (["style", "edit", "blackleter", "--no-browser"], "blackletter"),
        (["style", "edit", str(tmp_path / "a b.toml"), "--no-browser"], "letters, digits"),
        (["calibrate", "wizard", "--printer", "a/b", "--web"], "by its name"),
        (["calibrate", "wizard", "--printer", "nothing-like-it", "--web"], "No printer is called"),
        (["calibrate", "wizard", "--printer", "sim", "--web", "--accept"], "the page asks"),
    ):
        with pytest.raises(SystemExit) as leave:
            main(arguments)
        assert leave.value.code == 2 and said_ in capsys.readouterr().err, arguments


def test_what_a_killed_studio_left_is_deleted_and_what_runs_stays(tmp_path, monkeypatch):
    pytest.importorskip("starlette")
    from handout.web.studio import Studio

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    left = tmp_path / "handout-studio-left"
    left.mkdir()
    for name in ("scan.png", "alive"):
        (left / name).touch()
    studio = Studio()
    for alive in (left / "alive", studio.folder().parent / "alive"):
        os.utime(alive, (0, 0))
    other = Studio()
    assert studio.folder().is_dir() and other.folder().is_dir() and not left.exists()
