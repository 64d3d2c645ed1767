"""The site: no page is left out, every verb and option is there, what troubleshooting quotes is said by the program."""

import re
import shlex

import click
import pytest
from test_readme import COMMANDS, DOCUMENTS, ROOT, site_pages, understood

from handout.cli import cli

SITE = site_pages()
# lines of the documents that take little, to be run as they stand
CHEAP = [
    "devices list",
    "devices probe --port sim:",
    "asemic --letters 5 --seed 3 -o tag.svg",
    'plot --port sim: "Dear Ada, thank you!"',
    'export "Dear Ada" --seed 1 -o job.gcode',
    "pen heights --device simulated --port sim: --up 90 --down 40",
    "calibrate show",
    "hand list",
]


def test_every_page_is_in_the_navigation():
    text = (ROOT / "mkdocs.yml").read_text("utf-8")
    listed = re.findall(r": ([\w-]+\.md)$", text[text.index("\nnav:") :], re.M)
    pages = {path.name for path in (ROOT / "docs").glob("*.md")} | set(SITE.REPOSITORY.values()) | set(SITE.MADE)
    assert sorted(listed) == sorted(pages - {"verbs/index.md"})  # the hook lists the verbs


def test_every_verb_has_its_options_and_an_example():
    used = {line.split()[0] for _, line in COMMANDS}
    for name, verb in SITE.verbs().items():
        page = SITE.verb_page(name, verb)
        options = {
            option for _, leaf in SITE.leaves(name, verb) for p in leaf.params for option in p.opts if "-" in option
        }
        assert [option for option in options if f"`{option}`" not in page] == []
        assert name in used and f"handout {name} " in page


def test_verbs_that_the_text_names_are_there():
    wrong = []
    for path in DOCUMENTS:
        for line in re.findall(r"`handout ([a-z][^`]*)`", path.read_text("utf-8")):
            context, words = click.Context(cli), line.split()
            while isinstance(context.command, click.Group) and words and re.fullmatch(r"[a-z-]+", words[0]):
                verb = context.command.get_command(context, words.pop(0))
                if verb is None:
                    wrong.append((path.name, line))
                    break
                context = click.Context(verb)
    assert wrong == []


def sentences() -> str:
    """All strings of the program, pieces of one sentence joined, what is filled in as …."""
    texts = [path.read_text("utf-8") for path in ROOT.glob("handout*/**/*.py")]
    joined = (re.sub(r'"\s*\n\s*f?"', "", text) for text in texts)
    return "\n".join(re.sub(r"\{[^{}\n]*\}", "…", text) for text in joined)


def test_what_troubleshooting_quotes_is_said():
    text = (ROOT / "docs" / "troubleshooting.md").read_text("utf-8")
    quoted, said = re.findall(r"^> (.*)$", text, re.M), sentences()

    def found(quote: str) -> bool:
        parts = [re.escape(part.strip()) for part in quote.split("…") if part.strip()]
        return re.search(r"[^\n]*?".join(parts), said) is not None

    assert len(quoted) >= 25 and [quote for quote in quoted if not found(quote)] == []
    assert not found("The plotter has … eaten the page")


def test_links_that_lead_nowhere_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<a href="b.html#here">b</a><a href="https://example.org">out</a><img src="c.png">'
    )
    (tmp_path / "b.html").write_text(
        '<p id="there"><a href="a.html">a</a><script src="https://example.org/x.js"></script>'
    )
    assert SITE.broken(tmp_path) == ["a.html: b.html#here", "a.html: c.png", "b.html: fetches https://example.org/x.js"]


def test_rooms_are_drawn():
    drawing = SITE.rooms_drawing(
        "```mermaid\ngraph TD\n    cli --> web\n    web --> hand\n    cli -. sim .-> hand\n```\n"
    )
    assert drawing.count("<rect") == 3 and drawing.count("<path d=") == 4 and drawing.count("stroke-dasharray") == 1


@pytest.mark.slow
@pytest.mark.parametrize("line", CHEAP)
def test_cheap_commands_run(line, tmp_path, monkeypatch, capsys):
    assert any(line == other.split("  #")[0].strip() for _, other in COMMANDS)
    monkeypatch.chdir(tmp_path)
    words = shlex.split(line)
    understood(words)
    assert cli.main(args=words, prog_name="handout", standalone_mode=False) in (None, 0)
    assert "-o" not in words or (tmp_path / words[words.index("-o") + 1]).stat().st_size > 100
