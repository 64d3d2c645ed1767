"""Finding the heights of a pen, with a person who looks at the simulated one."""

import re

import msgspec
import pytest

from handout import profiles, shipped
from handout.errors import InputError
from handout.plotting import driver, pen_heights
from handout_lab.simulated import FaultyPlotter


def touches(port):
    """Whether the simulated pen leaves ink: a servo half way down, a Z axis near its lower height."""
    pen = port.profile.pen
    if pen.lift != "z":
        return port.pen_is_down
    height = port.paper.place[2] / port.paper.steps[2]
    return (height - pen.down) / (pen.up - pen.down) <= 0.1


NAMES = ["simulated", "grbl-z", "idraw-2", "marlin-servo", "creality-ender-3", "axidraw-v3"]


class Looking:
    """A person who lowers the pen until it touches; `told` replaces an answer to a question."""

    def __init__(self, port, **told):
        self.port, self.told, self.asked = port, told, []

    def do(self, request):
        self.asked.append(request)

    def answer(self, question, answers):
        self.asked.append(question)
        if "t" in answers:
            return "t" if touches(self.port) else "d"
        said = next(value for key, value in [("o", "o"), ("y", "n"), ("s", "s"), ("3", "3")] if key in answers)
        said = self.told.get(said, said)
        assert said in answers
        return said


def met(name):
    profile = profiles.find(name, "plotter")
    port = FaultyPlotter(profile)
    return profile, port, driver.connect(port, profile, lambda _: None)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_both_heights_are_found(name):
    profile, port, controller = met(name)
    pen = profile.pen
    person = Looking(port)
    found = pen_heights.find(pen_heights.begin(controller, port, person, lambda _: None))
    steps = pen_heights.Steps(profile)
    share = 0.1 if pen.lift == "z" else 0.5
    first = pen.down + share * (pen.up - pen.down)  # where the simulated pen touches
    touching = found.down - steps.sign * 2 * steps.row
    assert 0 <= steps.sign * (touching - first) <= steps.sizes[0] + 1e-9
    assert steps.sign * (found.down - found.up) >= 0.9 * abs(pen.up - pen.down)
    assert not port.pen_is_down
    drawn, sheets = port.executed_drawing().strokes, 2 if steps.follows else 1
    assert len(drawn) == sheets * sum(range(2, pen_heights.ROWS + 2))  # a wave and its marks
    deepest = None if found.pressed is None else steps.sign * (found.pressed - found.down)
    assert deepest == (pytest.approx(3 * steps.row) if steps.follows else None)


def test_nothing_moves_before_the_person_says_so():
    for name in NAMES:
        _, port, controller = met(name)
        before = len(port.paper.trace), list(port.paper.power)

        class Away(Looking):
            def do(self, request):
                raise InputError("nobody")

        with pytest.raises(InputError):
            pen_heights.find(pen_heights.begin(controller, port, Away(port), lambda _: None))
        assert (len(port.paper.trace), port.paper.power) == before


@pytest.mark.parametrize("name", ["simulated", "grbl-z", "marlin-servo", "axidraw-v3"])
def test_an_interrupt_lifts_the_pen(name):
    _, port, controller = met(name)

    class Stopping(Looking):
        def answer(self, question, answers):
            if self.port.pen_is_down:
                raise KeyboardInterrupt
            return "d"

    with pytest.raises(KeyboardInterrupt):
        pen_heights.find(pen_heights.begin(controller, port, Stopping(port), lambda _: None))
    port.read(2.0)
    assert not port.pen_is_down


@pytest.mark.parametrize("name", ["simulated", "grbl-z", "marlin-servo", "axidraw-v3"])
def test_an_interrupt_while_a_row_is_drawn_lifts_the_pen(name):
    _, port, controller = met(name)
    bench = pen_heights.begin(controller, port, Looking(port), lambda _: None)
    send, drawing = controller.send, []

    def interrupted(data):
        send(data)
        drawing.append(port.pen_is_down)
        if len(drawing) > 60 and drawing[-1]:
            controller.send = send
            raise KeyboardInterrupt

    controller.send = interrupted
    with pytest.raises(KeyboardInterrupt):
        pen_heights.draw_trial(bench, pen_heights.Heights(bench.pen.up, bench.pen.down))
    port.read(2.0)
    assert drawing[-1] and not port.pen_is_down


def test_the_paper_can_be_called_zero():
    profile, port, controller = met("grbl-z")
    found = pen_heights.find(pen_heights.begin(controller, port, Looking(port, n="y"), lambda _: None))
    assert found.down == pytest.approx(-0.2) and found.up == pytest.approx(profile.pen.up)


def test_a_pen_that_is_clamped_hard_is_not_pressed(tmp_path):
    """And what is found is written, whether the profile had a number for it or not."""
    profile, port, controller = met("grbl-z")
    found = pen_heights.find(pen_heights.begin(controller, port, Looking(port, s="h"), lambda _: None))
    assert found.pressed == found.down
    source = shipped.folder("devices") / "plotter-grbl-z.toml"
    for text in (
        source.read_text(encoding="utf-8"),
        re.sub("(?m)^pressed.*\n", "", source.read_text(encoding="utf-8")),
    ):
        own, path = tmp_path / "own.toml", tmp_path / "plotter-mine.toml"
        own.write_text(text, encoding="utf-8")
        pen_heights.save_copy(own, path, pen_heights.list_changes(found, profile))
        assert profiles.read_profile(path).pen.pressed == found.down


def test_given_heights_are_tried():
    _, port, controller = met("simulated")
    person = Looking(port)
    pen_heights.draw_trial(
        pen_heights.begin(controller, port, person, lambda _: None), pen_heights.Heights(20.0, 100.0)
    )
    values = {value for _, value in port.paper.power if value}
    assert {20.0, 100.0} <= values and len(port.executed_drawing().strokes) == 2
    assert len(person.asked) == 1


def test_the_end_of_the_range_is_not_passed():
    steps = pen_heights.Steps(profiles.find("marlin-servo", "plotter"))
    assert steps.lower_from(178.0, 6.0) is None and steps.lower_from(100.0, 6.0) == 106.0
    assert steps.rows(175.0)[-1] == 180.0


def test_pens_without_heights_are_refused():
    with pytest.raises(InputError, match="lifts and lowers its pen by itself"):
        pen_heights.check(profiles.find("hp-7475a", "plotter"))
    own = profiles.find("simulated", "plotter")
    lines = {"lift": "command", "up_command": ("M5",), "down_command": ("M3",)}
    with pytest.raises(InputError, match="lines of your own"):
        pen_heights.check(msgspec.structs.replace(own, pen=msgspec.structs.replace(own.pen, **lines)))


def test_a_copy_keeps_all_but_the_heights(tmp_path):
    source = shipped.folder("devices") / "plotter-axidraw-v3.toml"
    path = tmp_path / "devices" / "plotter-mine.toml"
    pen_heights.save_copy(source, path, {"up": 20000.0, "down": 15000.5})
    before, after = source.read_text(encoding="utf-8").splitlines(), path.read_text(encoding="utf-8").splitlines()
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert [b.split("#")[0].strip() for _, b in changed] == ["up = 20000", "down = 15000.5"]
    assert "20641 before: pulse in units of 83.3 ns" in changed[0][1]
    assert profiles.read_profile(path).pen.down == 15000.5


def test_what_a_profile_cannot_have_is_not_written(tmp_path):
    source = shipped.folder("devices") / "plotter-grbl-z.toml"
    path = tmp_path / "plotter-mine.toml"
    with pytest.raises(InputError, match=r"plotter-mine.toml: pen.up = 1 must be higher"):
        pen_heights.save_copy(source, path, {"up": 1.0, "down": 2.0})
    odd = tmp_path / "odd.toml"
    text = source.read_text(encoding="utf-8").replace("[pen]\n", "").replace("\nlift", "\npen.lift")
    head, _, rest = text.partition("[bed]")
    odd.write_text('pen = { lift = "z", up = 2, down = 0, up_time = "0ms", down_time = "0ms" }\n' + head + "[bed]" + (
        rest.partition("pen.lift")[0]
    ), encoding="utf-8")  # fmt: skip
    with pytest.raises(InputError, match="write up = 3, down = 1 by hand"):
        pen_heights.save_copy(odd, path, {"up": 3.0, "down": 1.0})
    assert not path.exists()


def test_a_pen_that_follows_pressure_presses_as_deep_as_before():
    own = profiles.find("grbl-z", "plotter")
    own = msgspec.structs.replace(own, pen=msgspec.structs.replace(own.pen, pressed=-0.5))
    assert pen_heights.list_changes(pen_heights.Heights(3.0, 0.2), own) == {"up": 3.0, "down": 0.2, "pressed": -0.3}
