"""`handout pen test` and `handout pen heights` as they are called."""

import io
import json

import pytest

from handout import profiles


@pytest.mark.slow
def test_the_sheet_is_written(call, tmp_path):
    out, err = call("pen", "test", "--device", "axidraw-minikit", "--dry-run", "a.svg", "--dry-run", "a.ebb", "--json")
    told = json.loads(out)
    assert told["device"] == "plotter-axidraw-minikit" and told["planned_s"] > 60
    assert (tmp_path / "a.svg").stat().st_size > 10_000 and (tmp_path / "a.ebb").read_bytes().startswith(
        b"SC,4,20641\r"
    )
    assert "pen.down_time" in err and "limits.draw_speed" in err


@pytest.mark.slow
def test_the_sheet_is_plotted_and_kept_as_a_job(call):
    told = json.loads(call("pen", "test", "--device", "hp-7475a", "--port", "sim:", "--json", "--quiet")[0])
    assert told["executed_s"] == pytest.approx(told["planned_s"], rel=0.05)
    assert json.loads(call("plot", "show", told["job"], "--json")[0])["finished"]
    _, err = call("pen", "test", "--port", "sim:?fault=alarm&after=60", "--page", "105x100mm", code=3)
    assert "handout plot --resume" in err


@pytest.mark.slow
def test_heights_are_found_and_saved(call, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("d\nf\nd\nu\nd\nt\no\n0\n2\n"))
    out, err = call("pen", "heights", "--port", "sim:", "--save", "mine")
    assert out.startswith("[pen]\nup = ") and "steps of 2" in err and "--device mine" in err
    pen = profiles.find("mine", "plotter").pen
    assert out == f"[pen]\nup = {pen.up:g}\ndown = {pen.down:g}\n"
    assert "is there already" in call("pen", "heights", "--port", "sim:", "--save", "mine", code=2)[1]
    again = ("--save", "mine", "--again", "--up", 35, "--down", 95)
    assert json.loads(call("pen", "heights", "--port", "sim:", *again, "--json")[0])["down"] == 95
    assert profiles.find("mine", "plotter").pen.up == 35


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch):
    monkeypatch.setattr("os.fsync", lambda _: None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["test"], "Where to? Give --port"),
        (["test", "--port", "sim:", "--device", "hp-envy"], "hp-envy is a printer, not a plotter"),
        (["test", "--port", "sim:", "--page", "50x50mm"], "use a larger --page"),
        (["test", "--dry-run", "a.gcode", "--device", "axidraw-v3"], "speaks ebb, whose files end in .ebb"),
        (["heights"], "Where is the plotter?"),
        (["heights", "--port", "sim:", "--device", "hp-7475a"], "lifts and lowers its pen by itself"),
        (["heights", "--port", "sim:", "--up", "3"], "give both"),
        (["heights", "--port", "sim:", "--up", "3", "--down", "3"], "the pen would never leave the paper"),
        (["heights", "--port", "sim:", "--again"], "give it with --save"),
        (["heights", "--port", "sim:", "--save", "a/b"], "cannot name a profile"),
    ],
)
def test_bad_input_is_one_sentence(call, words, said):
    _, err = call("pen", *words, code=2)
    assert said in err and len(err.strip().splitlines()) == 1


def test_leaving_the_questions_is_an_interrupt(call, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("click.termui.visible_prompt_func", interrupted)
    _, err = call("pen", "heights", "--port", "sim:", code=130)
    assert "Interrupted." in err


@pytest.mark.parametrize("device", ["simulated", "axidraw-v3", "marlin-servo", "hp-7475a"])
def test_the_pen_is_moved_by_hand(call, device):
    where = ("--port", "sim:", "--device", device)
    assert "the pen is down" in call("pen", "down", *where)[1] and "the pen is up" in call("pen", "up", *where)[1]
    told = json.loads(call("pen", "jog", "5", "1.5cm", *where, "--json", "-q")[0])
    assert told["done"] == "moved by 5, 15 mm" and told["position"] in (None, [pytest.approx(5, abs=0.02), 15.0])
    code = 2 if device == "hp-7475a" else 0
    assert "motors" in call("pen", "motors-off", *where, code=code)[1]
    assert "Where is the plotter?" in call("pen", "home", code=2)[1]
    assert "jog x" in call("pen", "jog", "far", "0", *where, code=2)[1]


def test_home_is_found_or_the_reason_told(call):
    assert "above its zero, at 0, 0 mm" in call("pen", "home", "--port", "sim:", "--device", "midtbot")[1]
    _, err = call("pen", "home", "--port", "sim:", code=3)
    assert "does not know where it stands" in err and "lower left corner" in err
    assert "moved by -3, 4 mm" in call("pen", "jog", "-3", "4", "--port", "sim:")[1]


def test_heights_at_the_end_of_the_input(call, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("d\n"))
    _, err = call("pen", "heights", "--port", "sim:", code=2)
    assert "the input has ended: it needs d, u, f, c, t, x typed at a terminal, or --up and --down" in err


def test_plotting_with_other_heights(call):
    out, _ = call("plot", "--port", "sim:", "hi", "--pen-up", "30", "--pen-down", "80", "--seed", 1, "--json", "-q")
    job = json.loads(out)["job"]
    assert json.loads(call("plot", "show", job, "--json")[0])["finished"]
    for given, says in ((("--pen-up", "5000"), "outside S1 to S1000"), (("--pen-down", "low"), "is not a number")):
        assert says in call("plot", "--port", "sim:", "hi", *given, code=2)[1]
    assert "no heights" in call("plot", "--dry-run", "a.svg", "--device", "hp-7475a", "hi", "--pen-up", "3", code=2)[1]
    assert "not less" not in call("plot", "--port", "sim:", "--device", "grbl-z", "hi", "--pen-down", "-.3mm", "-q")[1]


def test_the_button_pauses_a_plot(call):
    _, err = call("plot", "--port", "sim:?fault=button&after=60", "--device", "axidraw-v3", "all is well", "--seed", 1)
    assert "Paused, the pen is lifted: press the plotter's button again to go on" in err
    assert err.index("Paused") < err.index("It goes on.") < err.index("Plotted 1 sheet")
