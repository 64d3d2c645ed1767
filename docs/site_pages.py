"""What of the site is made when it is built: pages from the program itself, and a check of every link of the result.

A hook of MkDocs (`mkdocs.yml`).  A page is a name and its Markdown; `pages` has all that no file in docs/ holds.
"""

from __future__ import annotations

import dataclasses
import html
import importlib
import inspect
import json
import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import click

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
REPOSITORY = {"README.md": "index.md", "CHANGELOG.md": "changelog.md"} | {
    f"{folder}/README.md": f"{folder}.md" for folder in ("devices", "brushes", "calibration")
}
MADE = ("api.md", "examples.md", "figures.md", "verbs/index.md")  # pages that no file holds, beside one a verb
LINK = re.compile(r"\]\(([^)#\s]*)(#[^)\s]*)?\)")
COMMAND = re.compile(r"^    (?:echo .* \| )?(handout .*)$", re.M)


# ---- pages from the program


def pages() -> dict[str, str]:
    """Name → Markdown of every page that is made of the program or of files outside docs/."""
    made = {f"verbs/{name}.md": verb_page(name, verb) for name, verb in verbs().items()}
    made["verbs/index.md"] = verbs_page()
    made["api.md"] = api_page()
    made["figures.md"] = figures_page(json.loads((DOCS / "figures.json").read_text("utf-8")))
    made["examples.md"] = examples_page()
    for source, name in REPOSITORY.items():
        if source != "README.md":
            made[name] = (ROOT / source).read_text("utf-8")
    return made


def verbs() -> dict[str, click.Command]:
    """Every verb of `handout`, in the order of its help."""
    context = program()
    cli = context.command
    assert isinstance(cli, click.Group)
    return {name: verb for name in cli.list_commands(context) if (verb := cli.get_command(context, name)) is not None}


def program() -> click.Context:
    from handout.cli import cli

    return click.Context(cli, info_name="handout")


def leaves(name: str, verb: click.Command) -> Iterator[tuple[str, click.Command]]:
    """A verb and what stands below it, with all its words."""
    yield name, verb
    if isinstance(verb, click.Group):
        context = click.Context(verb, info_name=name)
        for word in verb.list_commands(context):
            below = verb.get_command(context, word)
            assert below is not None
            yield from leaves(f"{name} {word}", below)


def verbs_page() -> str:
    top, lines = program(), ["# Every command", ""]
    lines += ["Made from the program itself. `handout VERB --help` says the same in the terminal.", ""]
    for name, verb in verbs().items():
        said = (verb.get_short_help_str(200) if not verb.help else verb.help.partition("\n\n")[0]).replace("\n", " ")
        below = [word for word, leaf in leaves(name, verb) if word != name and not isinstance(leaf, click.Group)]
        more = (
            ": " + ", ".join(f"[{word.partition(' ')[2]}]({name}.md#{anchor(word)})" for word in below) if below else ""
        )
        lines += [f"- [`handout {name}`]({name}.md){more}. {said}"]
    lines += ["", "## Options of handout itself", "", "Before the verb, as in `handout --config none write …`:", ""]
    lines += ["\n\n".join(parameter(given, top) for given in top.command.get_params(top))]
    lines += ["", "## Exit codes", "", "| code | meaning |", "|---|---|", "| 0 | done |"]
    lines += ["| 1 | `doctor`: something fails |", "| 2 | bad input |"]
    lines += ["| 3 | device fault |"]
    lines += ["| 4 | some rows of a batch failed, or pages of a study could not be read; they are named |"]
    lines += ["| 130, 143, 129 | ended by Ctrl-C, SIGTERM, SIGHUP: no half file, the pen lifted, the job kept |"]
    return "\n".join(lines) + "\n"


def anchor(words: str) -> str:
    return "handout-" + words.replace(" ", "-").replace("_", "-")


def verb_page(name: str, verb: click.Command) -> str:
    """Usage, worked examples, and every option of a verb and of those below it."""
    from handout.cli.options import OWN, group_options

    parts = [f"# handout {name}", said(verb.help or "")]
    shown = worked().get(name, "")
    parts += [f"## Worked example\n\n{shown}"] if shown else []
    for words, command in leaves(name, verb):
        if isinstance(command, click.Group):
            continue
        context = click.Context(command, info_name=f"handout {words}")
        usage = "    " + " ".join(command.get_usage(context).removeprefix("Usage: ").split())
        parts += (
            ["## Arguments and options", usage]
            if words == name
            else [f"## handout {words} {{#{anchor(words)}}}", usage]
        )
        parts += [said(command.help or "")] if words != name else []
        parts += [parameter(p, context) for p in command.get_params(context) if isinstance(p, click.Argument)]
        for heading, options in group_options(command, context).items():
            parts += [] if heading == OWN else [f"### {heading}"]
            parts += [parameter(option, context) for option in options]
    parts += used(name)
    return "\n\n".join(parts) + "\n"


def said(text: str) -> str:
    """A help text as Markdown: paragraphs flow, blocks that begin with \\b keep their lines, commands are code."""
    parts = []
    for part in inspect.cleandoc(text).split("\n\n"):
        if part.startswith("\b"):
            parts.append("\n".join("    " + line for line in part.lstrip("\b\n").splitlines()))
        else:
            parts.append(plain(" ".join(part.split())))
    return "\n\n".join(parts)


def plain(text: str) -> str:
    """Words of the program as Markdown that shows them as they are; what it puts in backticks stays code."""
    pieces = re.split(r"(`+[^`]+`+)", text)
    return "".join(
        p
        if p.startswith("`")
        else re.sub(r"([\\*_\[\]<>{}|#])", r"\\\1", p).replace("\\{", "&#123;").replace("\\}", "&#125;")
        for p in pieces
    )


def parameter(given: click.Parameter, context: click.Context) -> str:
    """One argument or option as an entry of a definition list."""
    if isinstance(given, click.Argument):
        optional = "" if given.required else ", may be left out"
        return f"`{given.make_metavar(context)}`\n:   argument{optional}."
    assert isinstance(given, click.Option)
    names = ", ".join(f"`{name}`" for name in (*given.opts, *given.secondary_opts))
    value = "" if given.is_flag or given.count else f" {given.make_metavar(context)}"
    if given.is_flag and given.help is None and "help" in given.opts[-1]:
        return f"{names}\n:   this text."
    facts = [plain(given.help or "")] if given.help else []
    if isinstance(given.type, click.Choice):
        facts.append("One of " + ", ".join(f"`{choice}`" for choice in given.type.choices) + ".")
    elif value.strip():
        names += f" `{value.strip()}`"
    usual = given.get_default(context, call=False)
    if given.show_default and usual not in (None, "", ()) and type(usual) in (str, int, float):
        facts.append(f"Default: `{usual}`.")
    facts += ["May be repeated."] if given.multiple and "repeated" not in (given.help or "") else []
    facts += ["Required."] if given.required else []
    return f"{names}\n:   " + (" ".join(facts) or "a switch.")


def worked() -> dict[str, str]:
    """Verb → its sections of the gallery; those of `write` have no other verb."""
    found: dict[str, str] = {}
    for section in (DOCS / "gallery.md").read_text("utf-8").split("\n## ")[1:]:
        title, _, text = section.partition("\n")
        named = {line.split()[1] for line in COMMAND.findall(text)}
        text = re.sub(r"\]\((?=[\w-]+(?:/|\.md))", "](../", text.strip("\n"))
        for verb in named - {"write"} or named:
            found[verb] = found.get(verb, "") + f"**{title.strip()}**\n\n{text}\n\n"
    return found


def used(name: str) -> list[str]:
    """Where the documents use a verb, with the lines."""
    parts = []
    for path in sorted(DOCS.glob("*.md")):
        text = path.read_text("utf-8")
        lines = [line.strip() for line in COMMAND.findall(text) if line.split()[1] == name]
        if lines and path.name != "gallery.md":
            title = re.sub(r"[`*]", "", text.partition("\n")[0].lstrip("# "))
            block = "\n".join("    " + line for line in dict.fromkeys(lines))
            parts += [f"**[{title}](../{path.name})**", block]
    return ["## As used in these pages", *parts] if parts else []


# ---- the package


def api_page() -> str:
    """The public functions and values of the package, from their signatures and docstrings."""
    import handout

    lines = ["# Python", "", (inspect.cleandoc(handout.__doc__ or "")).replace("::\n", ":\n"), ""]
    lines += ["Every name below is `handout.NAME`, imported when it is first used.", ""]
    functions, values = [], []
    for name, home in handout._PUBLIC.items():
        thing = getattr(importlib.import_module(home), name)
        (values if inspect.isclass(thing) else functions).append((name, home, thing))
    for title, some in (("Functions", functions), ("Values and options", values)):
        lines += [f"## {title}", ""]
        for name, home, thing in some:
            lines += [f"### {name} {{#{name}}}", "", signature(name, thing), "", docstring(inspect.getdoc(thing) or "")]
            lines += ["", f"In `{home}`.", ""]
    return "\n".join(lines)


def signature(name: str, thing: Any) -> str:
    if dataclasses.is_dataclass(thing):
        fields = [f"    {f.name}: {f.type}{default(f)}," for f in dataclasses.fields(thing) if f.init]
        body = "\n".join(fields)
        return f"```python\nhandout.{name}(\n{body}\n)\n```"
    try:
        shape = inspect.signature(thing)
    except (TypeError, ValueError):
        return f"```python\nhandout.{name}\n```"
    parts = [f"    {part}," for part in shape.parameters.values()]
    parts = [re.sub(r": '([^']*)'", r": \1", part) for part in parts]  # annotations are kept as texts
    back = "" if shape.return_annotation is inspect.Signature.empty else f" -> {shape.return_annotation}"
    return re.sub(
        r"<[\w.]+ object at 0x[0-9a-f]+>", "…", f"```python\nhandout.{name}(\n" + "\n".join(parts) + f"\n){back}\n```"
    )


def default(field: dataclasses.Field[Any]) -> str:
    if field.default is not dataclasses.MISSING:
        return f" = {field.default!r}"
    return "" if field.default_factory is dataclasses.MISSING else " = …"


def docstring(text: str) -> str:
    """A docstring in numpy's style as Markdown: its sections bold, `name : meaning` as a definition list."""
    text = re.sub(r"^(.+)\n-{3,}$", r"\n**\1**\n", text, flags=re.M)
    out, lines = [], text.splitlines()
    while lines:
        line = lines.pop(0)
        more = []
        while lines and lines[0].startswith("    ") and line.strip() and not line.rstrip().endswith("::"):
            more.append(lines.pop(0).strip())
        if (entry := re.fullmatch(r"(\*{0,2}[\w.]+(?:, \*{0,2}[\w.]+)*) : (.*)", line)) is not None:
            kind = more and more[0][:1].isupper() and not entry[2].endswith((".", ",", ";"))
            meaning = f"*{plain(entry[2])}*: {plain(' '.join(more))}" if kind else plain(" ".join([entry[2], *more]))
            out += ["", f"`{entry[1]}`", f":   {meaning}"]
        elif re.fullmatch(r"[A-Z]\w+(?:, [A-Z]\w+)*", line) and more:
            out += ["", f"`{line}`", f":   {plain(' '.join(more))}"]
        elif line.startswith(("**", "    ")):
            out.append(line)
        else:
            out.append(plain(" ".join([line, *more])).replace("::", ":"))
    return "\n".join(out)


# ---- figures and examples


def figures_page(kept: dict[str, Any]) -> str:
    """What the benchmarks printed when they were last run, as they printed it, with date and machine."""
    from benchmarks.__main__ import names

    lines = [
        "# Figures",
        "",
        "What the [benchmarks](measuring.md#the-program) printed when each was last run, unchanged.",
    ]
    lines += ["From `docs/figures.json`, which `python -m benchmarks NAME --keep docs/figures.json` writes. Figures of"]
    lines += ["different runs may be of different versions and machines.", ""]
    lines += ["| benchmark | what it measures | last run |", "|---|---|---|"]
    for name, about in names().items():
        run = kept.get(name)
        when = "not run for this page" if run is None else f"[{run['date']}](#{name.replace('_', '-')})"
        lines.append(f"| `{name}` | {plain(about)} | {when} |")
    for name, run in kept.items():
        lines += ["", f"## {name} {{#{name.replace('_', '-')}}}", "", plain(names().get(name, "")), ""]
        took = f"; {run['cpu_seconds']:.0f} s of CPU" if "cpu_seconds" in run else ""
        told = f"{run['date']}, version {run['version']}, {run['machine']}{took}."
        lines += [" ".join([told, run.get("note", "")]).strip(), ""]
        lines += ["```text", run["printed"].rstrip(), "```"]
    return "\n".join(lines) + "\n"


TOLD = {".txt": "text", ".md": "markdown", ".csv": "text", ".json": "json", ".py": "python"}


def examples_page() -> str:
    """Every file of examples/, text as it is, the others as pictures."""
    lines = [
        "# Example files",
        "",
        "The files of the folder `examples/` of the checkout, which the commands of these pages name.",
        "",
    ]
    for path in sorted((ROOT / "examples").iterdir()):
        if path.suffix not in TOLD and path.suffix not in (".png", ".jpg"):
            continue
        lines += [f"## {path.name} {{#{path.name.replace('.', '-')}}}", ""]
        if path.suffix in TOLD:
            lines += [f"~~~~{TOLD[path.suffix]}", path.read_text("utf-8").rstrip(), "~~~~", ""]
        else:
            lines += [f"![{path.name}](examples/{path.name})", ""]
    return "\n".join(lines)


# ---- Markdown on its way to the site


def fitted(text: str, name: str) -> str:
    """A document's Markdown as the site needs it: links out of docs/, drawings, lists that Python-Markdown sees."""

    def link(found: re.Match[str]) -> str:
        target, at = found[1], found[2] or ""
        if not target or "://" in target or target.startswith("mailto:"):
            return found[0]
        home = next((Path(s).parent for s, n in REPOSITORY.items() if n == name and s != "README.md"), Path("docs"))
        path = (ROOT / home / target).resolve()
        inside = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else target
        if inside in REPOSITORY:
            return f"]({'../' * name.count('/')}{REPOSITORY[inside]}{at})"
        if inside.startswith("examples/"):
            return f"]({'../' * name.count('/')}examples.md#{path.name.replace('.', '-')})"
        return f"]({inside.removeprefix('docs/')}{at})" if home != Path("docs") else found[0]

    pieces = re.split(r"(^(?:```|~~~~).*?^(?:```|~~~~)\s*$)", text, flags=re.M | re.S)
    for number, piece in enumerate(pieces):
        if piece.startswith("```mermaid"):
            pieces[number] = rooms_drawing(piece)
        elif not piece.startswith(("```", "~~~~")):
            pieces[number] = spaced(piece if name in ("examples.md",) else LINK.sub(link, piece))
    return re.sub(r"(?:^    \S.*\n)+", remarked, "".join(pieces), flags=re.M)


def remarked(block: re.Match[str]) -> str:
    """Lines of code whose remarks make them wider than a page, with these above them."""
    if max(map(len, block[0].splitlines())) < 88:
        return block[0]
    return re.sub(r"^    (.*\S) {2,}(# .*)$", r"    \2\n    \1", block[0], flags=re.M)


def spaced(text: str) -> str:
    """With an empty line before each list, which CommonMark does not need; drawings in boxes keep their lines."""
    item, out = re.compile(r"(?:[-*+]|\d+[.)]) "), []
    for line in text.splitlines(keepends=True):
        before = out[-1] if out else "\n"
        if item.match(line) and before.strip() and not item.match(before) and not before.startswith((" ", "\t")):
            out.append("\n")
        out.append(line)
    return "".join(out)


def rooms_drawing(block: str) -> str:
    """The graph of a Mermaid block, `a --> b` and `a -. word .-> b`, as SVG: rows by the longest way from the top."""
    arrows = re.findall(r"^\s*(\w+) (-->|-\. \w+ \.->) (\w+)$", block, re.M)
    above: dict[str, list[str]] = {}
    for a, kind, b in arrows:
        above.setdefault(a, [])
        above.setdefault(b, []).extend([a] if kind == "-->" else [])
    level: dict[str, int] = {}

    def depth(room: str) -> int:
        if room not in level:
            level[room] = 1 + max((depth(other) for other in above[room]), default=-1)
        return level[room]

    rows: dict[int, list[str]] = {}
    for room in above:
        rows.setdefault(depth(room), []).append(room)
    place: dict[str, tuple[float, float]] = {}
    for row in sorted(rows):
        rows[row].sort(key=lambda room: sum(place[o][0] for o in above[room]) / len(above[room]) if above[room] else 0)
        gap = 900 / len(rows[row])
        place |= {room: (gap * (i + 0.5), 24 + row * 62) for i, room in enumerate(rows[row])}
    lines = []
    for a, kind, b in arrows:
        (x, y), (u, v) = place[a], place[b]
        y, v = (y + 14, v - 14) if v > y else (y - 14, v + 14)
        dash, middle = ' stroke-dasharray="4 4"' if kind != "-->" else "", f"{(y + v) / 2:.0f}"
        way = f"M{x:.0f} {y:.0f}C{x:.0f} {middle} {u:.0f} {middle} {u:.0f} {v:.0f}"
        lines.append(f'<path d="{way}"{dash} marker-end="url(#tip)"/>')
    for room, (x, y) in place.items():
        lines.append(f'<rect x="{x - 46:.0f}" y="{y - 14:.0f}" width="92" height="28" rx="5"/>')
        lines.append(f'<text x="{x:.0f}" y="{y + 5:.0f}">{html.escape(room)}</text>')
    tip = '<marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
    tip += '<path d="M0 0L8 4L0 8z"/></marker>'
    size = f'viewBox="0 0 900 {24 + max(rows) * 62 + 30}"'
    return f'<svg class="rooms" {size} role="img" aria-label="Which room imports which">{tip}{"".join(lines)}</svg>\n'


# ---- hooks of MkDocs


def on_config(config: Any) -> Any:
    """The navigation takes in every verb that there is."""
    sys.path.insert(0, str(ROOT))  # what is told is this checkout, whatever is installed
    for section in config["nav"]:
        if "Commands" in section:
            section["Commands"] = ["verbs/index.md", *({name: f"verbs/{name}.md"} for name in verbs())]
    return config


def on_files(files: Any, config: Any) -> Any:
    from mkdocs.structure.files import File

    for name, text in pages().items():
        files.append(File.generated(config, name, content=text))
    for path in sorted((ROOT / "examples").iterdir()):
        if path.suffix in (".png", ".jpg"):
            files.append(File.generated(config, f"examples/{path.name}", abs_src_path=str(path)))
    icon = ROOT / "handout" / "web" / "static" / "icon.svg"
    files.append(File.generated(config, "pictures/icon.svg", abs_src_path=str(icon)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    return fitted(markdown, page.file.src_uri)


def on_page_content(content: str, page: Any, config: Any, files: Any) -> str:
    """Drawings made of characters are not to be wrapped."""
    return re.sub(r"<pre>(?=[^<]*(?:<[^>]*>[^<]*)*?[─│┌└├])(?=(?:(?!</pre>)[\s\S])*─►)", '<pre class="drawn">', content)


def on_post_build(config: Any) -> None:
    """Every link and picture of the built site leads somewhere, and nothing is fetched from elsewhere."""
    (Path(config["site_dir"]) / "404.html").unlink(missing_ok=True)  # it works on a server's top folder alone
    wrong = broken(Path(config["site_dir"]))
    if wrong:
        from mkdocs.exceptions import PluginError

        raise PluginError("Links of the site that lead nowhere or outside:\n" + "\n".join(wrong))


class _Links(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[tuple[str, str]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.ids |= {value for name in ("id", "name") if (value := given.get(name))}
        fetched = tag in ("img", "script", "source", "iframe") or (tag == "link" and given.get("rel") != "canonical")
        for name in ("src", "href"):
            if given.get(name) and (tag == "a" or fetched):
                self.links.append((tag, str(given[name])))


def broken(site: Path) -> list[str]:
    """Links of a built site that lead to no file or no place in it, and what a page would fetch from elsewhere."""
    read: dict[Path, _Links] = {}
    for path in sorted(site.rglob("*.html")):
        read[path] = _Links()
        read[path].feed(path.read_text("utf-8"))
    wrong = []
    for path, page in read.items():
        for tag, link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                wrong += [f"{path.relative_to(site)}: fetches {link}"] if tag != "a" else []
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            if not target.is_file() or (
                parts.fragment and target in read and unquote(parts.fragment) not in read[target].ids
            ):
                wrong.append(f"{path.relative_to(site)}: {link}")
    return list(dict.fromkeys(wrong))
