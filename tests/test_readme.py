"""The tour's examples of the library run as they are printed; what the documents tell people to type is understood."""

import importlib.util
import json
import re
import shlex
from functools import cache
from pathlib import Path
from types import ModuleType

import click
import pytest

from handout.cli import cli as handout

ROOT = Path(__file__).resolve().parent.parent
README, TOUR = ROOT / "README.md", ROOT / "docs" / "tour.md"
DOCUMENTS = [README, *sorted((ROOT / "docs").glob("*.md"))]
COMMANDS = [
    (path.name, line)
    for path in DOCUMENTS
    for line in re.findall(r"^    (?:echo .* \| )?handout (.*)$", path.read_text(encoding="utf-8"), re.M)
]


@cache
def site_pages() -> ModuleType:
    """The hook that makes pages of the site from the program."""
    spec = importlib.util.spec_from_file_location("site_pages", ROOT / "docs" / "site_pages.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_script_runs(tmp_path, monkeypatch):
    _, code = re.findall(r"```python\n(.*?)```", TOUR.read_text(encoding="utf-8"), re.S)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "tour.md", "exec"), {})
    assert Path("card.svg").stat().st_size > 1000 and Path("card.png").stat().st_size > 1000


@pytest.mark.slow
def test_the_script_with_a_hand_of_ones_own_runs(small_scan, small_page, tmp_path, monkeypatch, capsys):
    code, _ = re.findall(r"```python\n(.*?)```", TOUR.read_text(encoding="utf-8"), re.S)
    assert (ROOT / "examples" / "own_hand.py").read_text(encoding="utf-8").endswith(code)
    monkeypatch.chdir(tmp_path)
    # a smaller page, whose letters were found already, and what they can write
    monkeypatch.setattr("handout.pipeline.hands.tagged_pages", lambda *_, **__: [small_page.made])
    for path, other in (("examples/page.jpg", small_scan.scan), ("examples/page.txt", small_scan.text)):
        code = code.replace(path, str(other))
    word = max(small_scan.written.split(), key=lambda word: len(word) if word.isalpha() else 0)
    exec(compile(code.replace("the jam is finished", word), "own_hand.py", "exec"), {})
    assert Path("letter.svg").stat().st_size > 1000 and Path("letter.png").stat().st_size > 1000
    assert capsys.readouterr().out.startswith("Wrote letter.svg letter.png")


def test_both_commands_are_there():
    commands = re.findall(r"^    (python3 -m venv .*)$", README.read_text(encoding="utf-8"), re.M)
    assert len(commands) == 2
    assert "handout write" in commands[0] and commands[1].endswith("-m pytest -n auto")


def test_it_fits_on_a_screen():
    text = README.read_text(encoding="utf-8")
    assert text.count("\n") <= 60 and text.count("](docs/pictures/") == 3


def understood(words: list[str]) -> None:
    """Raise click's error for words that the command would not take; nothing is run."""
    context, rest = click.Context(handout), words[2:] if words[0] == "--config" else words
    while isinstance(context.command, click.Group):
        name, verb, rest = context.command.resolve_command(context, rest)
        assert verb is not None
        context = (
            verb.make_context(name, list(rest), parent=context)
            if not isinstance(verb, click.Group)
            else (click.Context(verb, parent=context, info_name=name))
        )


@pytest.mark.parametrize(("document", "line"), COMMANDS)
def test_commands_are_understood(document, line, monkeypatch):
    monkeypatch.chdir(ROOT)
    words = shlex.split(line, comments=True)
    understood(words[: words.index(">")] if ">" in words else words)


def test_a_wrong_command_would_be_noticed():
    with pytest.raises(click.UsageError):
        understood(["write", "a", "-o", "a.svg", "--hnad", "house-quick"])
    with pytest.raises(click.UsageError):
        understood(["hand", "raed", "me"])


def unknown_options(words: list[str]) -> list[str]:
    """The words that look like options, and that the command they name does not have."""
    context, rest = click.Context(handout), words
    while isinstance(context.command, click.Group):
        name, verb, rest = context.command.resolve_command(context, rest)
        assert verb is not None
        context = click.Context(verb, parent=context, info_name=name)
    known = {text for parameter in context.command.params for text in parameter.opts}
    return [word for word in rest if re.match(r"--?[a-z]", word) and word.partition("=")[0] not in known]


def test_the_script_that_makes_the_pictures_names_what_there_is():
    """It is run by hand alone, so that a renamed option would break it unseen."""
    script = (ROOT / "docs" / "pictures" / "make.sh").read_text("utf-8").replace("\\\n", " ")
    commands = [shlex.split(line, comments=True) for line in re.findall(r"(?m)^ *handout (.+)$", script)]
    commands += [re.findall(r'"([^"]*)"', line) for line in re.findall(r'(?s)\["handout", (.*?)\]', script)]
    assert len(commands) >= 20
    assert [wrong for words in commands for wrong in unknown_options(words)] == []
    named = set(re.findall(r"examples/[\w.-]+", script))
    assert len(named) >= 5 and [name for name in sorted(named) if not (ROOT / name).is_file()] == []
    assert unknown_options(["write", "a", "--hnad", "x", "-o", "y"]) == ["--hnad"]


def test_files_that_commands_name_are_there():
    named = {name for document in DOCUMENTS for name in re.findall(r"examples/[\w.-]+", document.read_text("utf-8"))}
    assert len(named) >= 5 and all((ROOT / name).is_file() for name in named)
    linked = {
        (document.parent / name).resolve()
        for document in DOCUMENTS
        for name in re.findall(r"\]\(([\w./-]+)\)", document.read_text("utf-8"))
    }
    made = {ROOT / "docs" / name for name in site_pages().MADE}
    assert len(linked) >= 8 and [path for path in linked - made if not path.is_file()] == []


def test_the_image_gets_every_folder_that_a_wheel_has():
    import tomllib

    targets = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"]["wheel"]
    recipe = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    for name in [*targets["packages"], *targets["force-include"]]:
        assert f"COPY {name} /src/{name}\n" in recipe


def test_the_worked_corrections_are_those_of_the_file():
    text = (ROOT / "docs" / "hands.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r'^    (\{"corrections".*?^    \]\})', text, re.M | re.S)
    assert json.loads(shown) == json.loads((ROOT / "examples" / "corrections.json").read_text("utf-8"))
