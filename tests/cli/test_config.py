"""Defaults from files and the environment: who wins, what is said, and how what is wrong is refused."""

import json
import os
from pathlib import Path

import click
import pytest

from handout import shipped
from handout.cli import cli, configuration
from handout.cli.options import VerbCommand, switches


@pytest.fixture
def user():
    """The user's file, whose folder is there."""
    file = shipped.user_folder("config.toml")
    file.parent.mkdir(parents=True)
    return file


def shown(call, *words):
    return {
        row["key"]: (row["value"], row["from"])
        for row in json.loads(call("config", "show", "--json", *words)[0])["settings"]
    }


def test_set_and_taken_and_said(call, user):
    call("config", "set", "hand", "house-quick")
    call("config", "set", "page", "A6", "--project")
    out, err = call("write", "hi", "-o", "a.svg", "--seed", 1, "--json")
    facts = json.loads(out)
    assert facts["hand"] == "house-quick"
    assert facts["notes"] == [f"From {Path('handout.toml').resolve()}: page = A6.", f"From {user}: hand = house-quick."]
    assert all(note in err for note in facts["notes"])
    asked = json.loads(call("write", "hi", "-o", "a.svg", "--hand", "house-print", "--page", "A6", "--json")[0])
    assert asked["hand"] == "house-print" and "notes" not in asked
    assert json.loads(call("--config", "none", "write", "hi", "-o", "a.svg", "--json")[0])["hand"] == "house-joined"


def test_an_option_without_a_default_has_none(call):
    every = shown(call, "--all")
    assert every["page"] == every["write.output"] == (None, "built-in") and every["hand"] == (
        "house-joined",
        "built-in",
    )
    assert call("config", "get", "page") == ("\n", "From: built-in.\n")


def test_the_nearer_place_wins_and_is_named(call, user, monkeypatch):
    user.write_text('hand = "house-quick"\ndpi = 100\npage = "A6"\n[plot]\npage = "A4"\n')
    Path("handout.toml").write_text('hand = "house-print"\npage = "A5"\n')
    monkeypatch.setenv("HANDOUT_PLOT_COPIES", "2")
    monkeypatch.setenv("HANDOUT_HAND", "")  # which says nothing
    below = Path("deep/er")
    below.mkdir(parents=True)
    monkeypatch.chdir(below)
    plot = shown(call, "plot", "hi", "--dpi", "72", "--port", "sim:")
    project = f"project file {Path('../../handout.toml').resolve()}"
    assert plot["hand"] == ("house-print", project)
    assert plot["page"] == ("A5", project)  # the place counts before the verb
    assert plot["copies"] == ("2", "environment HANDOUT_PLOT_COPIES")
    assert plot["dpi"] == (72.0, "command line") and plot["port"] == (["sim:"], "command line")
    assert plot["speed"] == ("human", "built-in")
    every = shown(call)
    assert every["hand"][1].endswith("(over user: house-quick)") and every["dpi"] == (100, f"user file {user}")
    assert call("config", "get", "hand") == ("house-print\n", f"From: {project}.\n")
    assert call("config", "get", "speed") == ("human\n", "From: built-in.\n")


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ('hnad = "x"', ["write", "hi", "-o", "a.svg"], "no option is called 'hnad'. Did you mean hand?"),
        ("[write]\nprot = 1", ["write", "hi", "-o", "a.svg"], "no option is called 'write.prot'"),
        ("dpi = 9", ["write", "hi", "-o", "a.svg"], "dpi = 9: 9.0 is not in the range 36<=x<=2400."),
        ("\ufeffseed = 1.5", ["write", "hi", "-o", "a.svg"], "seed = 1.5: '1.5' is not a valid integer"),
        ('x-height = "big"', ["write", "hi", "-o", "a.svg"], "x-height = \"big\": length: 'big' is not a length"),
        ('hand = "nobody"', ["write", "hi", "-o", "a.svg"], "hand = \"nobody\": no hand is called 'nobody'"),
        ("hand = true", ["write", "hi", "-o", "a.svg"], "hand = true: a text or a number is wanted."),
        ('fit = "yes"', ["write", "hi", "-o", "a.svg"], 'fit = "yes": true or false is wanted.'),
        ('page = ["A4", "A5"]', ["write", "hi", "-o", "a.svg"], "one value is wanted, not a list."),
        ("hand = 1979-05-27", ["write", "hi", "-o", "a.svg"], "hand is no text, number"),
        ("dpi = inf", ["write", "hi", "-o", "a.svg"], "dpi = inf is no number that can be used"),
        ("hand = ", ["write", "hi", "-o", "a.svg"], "cannot be read as a configuration"),
    ],
)
def test_what_is_wrong_is_a_sentence_with_file_and_key(call, user, text, words, said):
    user.write_text(text + "\n", encoding="utf-8")
    _, err = call(*words, code=2)
    assert said in err and str(user) in err and not Path("a.svg").exists()
    assert "Usage" in call("write", "--help")[0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["set", "country", "DE"], "Did you mean home-country?"),
        (["set", "copies", "2"], "copies is not the same in every verb: set it for one, such as plot.copies."),
        (["set", "plot.copies", "0"], "copies: 0 is not in the range"),
        (
            ["set", "port", "a", "b"],
            "port takes one value in devices.probe, not 2: set it for one verb, such as plot.port.",
        ),
        (["set", "home-country", "Atlantis"], "no country is called 'Atlantis'"),
        (["set", "language", "klingon!"], "is no language"),
        (["set", "hand", "nobody"], "no hand is called 'nobody'"),
        (["set", "slips", "lots"], "is no number of slips"),
        (["unset", "hand"], "hand is not set there"),
        (["set", "write.output", "\udcff.svg"], "surrogates not allowed"),
        (["show", "wrte"], "Did you mean 'write'?"),
    ],
)
def test_what_cannot_be_set_is_refused(call, words, said):
    _, err = call("config", *words, code=2)
    assert said in err and not shipped.user_folder("config.toml").exists()


def test_a_port_yields_to_files_and_to_kept_plots(call, user):
    user.write_text('port = "sim:"\ndevice = "simulated"\npaper = "laid"\n')
    out, _ = call("plot", "hi", "--dry-run", "a.svg", "--page", "A6", "--json")
    assert "port =" not in out and Path("a.svg").exists()
    err = call("plot", "jobs")[1]
    assert "No plot is kept." in err and "From" not in err  # and not the word "jobs", plotted
    _, err = call("plot", "--resume", code=2)
    assert "From" not in err
    assert (
        "port = sim:" in call("plot", "--resume", "people.csv", "--with-envelopes", code=2)[1]
    )  # a table is made anew
    assert "From" not in call("plot", "--again", "nobody", code=2)[1]  # and it is drawn where it was
    call("write", "hi", "-o", "b.png", "--dpi", 50, "--page", "A6", "--transparent")  # or --paper would be in its way


def test_every_switch_that_is_configured_can_be_turned_off(call, user):
    for verb in configuration.all_verbs(cli).values():
        assert isinstance(verb, VerbCommand)
        there = {name for option in verb.params for name in (*option.opts, *option.secondary_opts)}
        off = dict(switches(verb))
        assert not there & off.keys()
        both = [each for each in configuration.options_of(verb) if each.secondary_opts]
        assert {id(each) for each in [*off.values(), *both]} == {
            id(each) for each in configuration.options_of(verb) if each.is_flag
        }
    user.write_text('fit = true\npaper = "laid"\nplot.no-name = true\nstudio.no-browser = true\n')
    text = shown(call, "write", "hi", "--no-fit", "--no-transparent", "-o", "a.svg")
    assert text["fit"] == (False, "command line") and text["paper"] == ("laid", f"user file {user}")
    assert shown(call, "plot", "hi", "--name")["no-name"][0] is False
    assert shown(call, "studio", "--browser")["no-browser"][0] is False
    assert "fit = true" not in call("write", "hi", "--no-fit", "-o", "a.svg", "--page", "A6")[1]


def test_a_file_beside_the_configuration_is_found_from_below(call, monkeypatch):
    Path("papers").mkdir()
    Path("papers/mine.toml").write_text("", encoding="utf-8")
    call("config", "set", "style", "papers/mine.toml", "--project")
    assert 'style = "papers/mine.toml"' in Path("handout.toml").read_text(encoding="utf-8")
    call("config", "set", "style", "papers/mine.toml")
    assert json.dumps(str(Path("papers/mine.toml").resolve())) in shipped.user_folder("config.toml").read_text("utf-8")
    call("config", "set", "study.make.hand", "papers/mine.toml", "me", "--project")
    monkeypatch.chdir("papers")
    with click.Context(cli):
        (project, *_) = [layer for layer in configuration.layers() if layer.kind == "project"]
        assert Path(project.find(["style"]).value) == Path("mine.toml").resolve()
        assert project.find(["study.make.hand"]).value == [str(Path("mine.toml").resolve()), "me"]


def test_a_key_goes_by_its_other_name_and_a_word_may_have_another_meaning(call):
    call("config", "set", "jitter", "0.5")
    assert "variation is no longer set" in call("config", "unset", "jitter")[1]
    call("config", "set", "calibrate.chart.paper", "cream")  # what the paper is called, and no file or ruling
    assert shown(call)["calibrate.chart.paper"][0] == "cream"


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="who owns a file is not known here")
def test_a_file_of_somebody_else_is_left_aside(call, monkeypatch):
    Path("handout.toml").write_text('hand = "house-quick"\n')
    monkeypatch.setattr(os, "geteuid", lambda: 4711)
    monkeypatch.setattr(configuration, "strangers", lambda file: True)
    assert shown(call) == {} and "belongs to another user" in call("config", "show")[1]


FILE = """# mine
hand = "a"  # the best
columns = [
  "name=A",
  "street=B",
]

[plot]
port = "x"

["hand.prompt"]
page = "A4"
"""


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("hand", "b\\c", FILE.replace('"a"', '"b\\\\c"')),
        ("columns", ["name=Z"], FILE.replace('[\n  "name=A",\n  "street=B",\n]', '["name=Z"]')),
        ("columns", None, FILE.replace('columns = [\n  "name=A",\n  "street=B",\n]\n', "")),
        ("dpi", 150.0, FILE.replace("]\n\n[plot]", "]\ndpi = 150.0\n\n[plot]")),
        ("plot.copies", 2, FILE.replace('port = "x"\n', 'port = "x"\ncopies = 2\n')),
        ("hand.prompt.page", "letter", FILE.replace('"A4"', '"letter"')),
        ("hand.prompt.ruled", False, FILE + "ruled = false\n"),
        ("style.edit.port", 1, FILE + '\n["style.edit"]\nport = 1\n'),
    ],
)
def test_one_key_is_changed_and_all_else_stays(key, value, expected):
    assert configuration.change_text(FILE, key, value) == expected
    assert configuration.change_text("", key, value) == (
        "" if value is None else configuration.change_text("", key, value)
    )


@pytest.mark.parametrize(
    ("before", "key", "after"),
    [
        ('plot = { port = "x" }\n', "plot.port", 'plot = { port = "y" }\n'),
        ('plot.port = "x"', "plot.port", 'plot.port = "y"'),
        ("[hand.prompt]\n", "hand.prompt.page", '[hand.prompt]\npage = "y"\n'),
        ('pen = "x"', "hand", 'pen = "x"\nhand = "y"\n'),
    ],
)
def test_a_key_is_set_however_it_is_written(before, key, after, tmp_path):
    file = tmp_path / "c.toml"
    file.write_bytes(before.encode())
    configuration.write(file, key, "y")
    assert file.read_bytes().decode() == after


def test_no_key_has_two_meanings():
    """Shared options of one name have one type; no verb of the first row is called as a bare key, but groups."""
    verbs, kinds = configuration.all_verbs(cli), {}
    for path, verb in verbs.items():
        for option in configuration.options_of(verb):
            for key in configuration.keys_of(path, option)[1:]:
                kinds.setdefault(key, set()).add(repr(option.type))
                assert key not in verbs
    assert len(kinds) > 30 and {key: found for key, found in kinds.items() if len(found) > 1} == {}
    variables = [configuration.variable(key) for path, verb in verbs.items() for o in configuration.options_of(verb)
                 for key in configuration.keys_of(path, o)[:1]]  # fmt: skip
    assert len(set(variables)) == len(variables)
