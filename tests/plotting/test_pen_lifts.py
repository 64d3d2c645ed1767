"""Pens of all kinds: slowly lowered, following pressure, lifted by commands of one's own; in words and on paper."""

import dataclasses

import msgspec
import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import ProfileError
from handout.plotting import observation, open_port, pen_lift, plan, run
from handout.plotting.dialects import MoveBlock, PenBlock, Timed
from handout.plotting.dialects.grbl import protocol
from handout.values import Drawing, Stroke

SERVO, ON_Z = profiles.find("simulated", "plotter"), profiles.find("grbl-z", "plotter")


def with_pen(profile, **values):
    return msgspec.structs.replace(profile, pen=msgspec.structs.replace(profile.pen, **values))


def with_pressure(drawing, rng):
    strokes = []
    for stroke in drawing.strokes:
        share = np.linspace(0, 1, len(stroke.t))
        strokes.append(dataclasses.replace(stroke, pressure=np.sin(np.pi * share) ** 2 * rng.uniform(0.5, 1)))
    return Drawing(tuple(strokes), drawing.page)


def drawn(drawing, profile):
    port = open_port("sim:", profile)
    made = plan(drawing, profile)
    report = run(made, port, profile)
    assert report.executed_s == pytest.approx(made.duration, rel=0.05)
    return port, made


def test_a_servo_comes_down_in_steps_of_a_fiftieth_of_a_second():
    pen = with_pen(SERVO, ramp=profiles.Time(0.1)).pen
    lines = protocol.pen(True, pen)
    assert lines[::2] == [b"M3S50\n", b"M3S60\n", b"M3S70\n", b"M3S80\n", b"M3S90\n"]
    assert lines[1::2] == [b"G4P0.02\n"] * 4 + [b"G4P0.15\n"]
    assert protocol.pen(False, pen) == [b"M3S40\n", b"G4P0.12\n"]


def test_a_z_axis_comes_down_slowly_and_goes_up_fast():
    pen = with_pen(ON_Z, ramp=profiles.Time(0.5)).pen
    assert protocol.pen(True, pen) == [b"G1Z0F300\n"] and protocol.pen(False, pen) == [b"G1Z2.5F900\n"]
    assert pen_lift.lowering_speed(with_pen(ON_Z, ramp=profiles.Time(0.01)).pen) == 15


@pytest.mark.slow
@pytest.mark.parametrize("profile", [SERVO, ON_Z], ids=lambda p: p.name)
def test_a_ramp_is_announced_and_draws_the_same(profile):
    drawing, ramped = page(words=3), with_pen(profile, ramp=profiles.Time(0.3))
    port, made = drawn(drawing, ramped)
    assert observation.compare_strokes(drawing, port.executed_drawing()).deviation < 0.1
    assert made.duration > plan(drawing, profile).duration + 0.1 * len(drawing.strokes)


def test_a_z_axis_follows_the_pressure():
    drawing = with_pressure(page(words=3), np.random.default_rng(3))
    profile = with_pen(ON_Z, pressed=-0.8)
    port, made = drawn(drawing, profile)
    assert observation.compare_strokes(drawing, port.executed_drawing()).deviation < 0.1
    pairs = [pair for pair in zip(drawing.strokes, port.executed_drawing().strokes, strict=True) if pair[0].length > 1]
    assert len(pairs) >= 3
    for meant, got in pairs:
        along = [np.append(0, np.cumsum(np.hypot(*np.diff(s.xy, axis=0).T))) for s in (meant, got)]
        shares = [length / length[-1] for length in along]
        pressure = np.interp(shares[0], shares[1], got.pressure)
        assert np.abs(pressure - meant.pressure).max() < 0.12
    lowest = min(block.z for block in made.blocks if isinstance(block, MoveBlock) and block.z is not None)
    assert -0.8 <= lowest < -0.4


def test_a_z_axis_may_count_downwards():
    drawing = with_pressure(page(words=2), np.random.default_rng(3))
    profile = with_pen(ON_Z, z="down", up=0.0, down=5.0, pressed=6.0)
    port, made = drawn(drawing, profile)
    assert observation.compare_strokes(drawing, port.executed_drawing()).deviation < 0.1 and not port.pen_is_down
    assert 5.3 < max(block.z for block in made.blocks if isinstance(block, MoveBlock) and block.z is not None) <= 6


@pytest.mark.parametrize("firmware", ["2.4.4", "2.6.2", "2.8.1", "3.0.2"])
def test_the_servo_of_an_ebb_follows_the_pressure_in_small_steps(firmware):
    drawing = with_pressure(page(words=2), np.random.default_rng(3))
    board = profiles.find("axidraw-v3", "plotter")
    profile = msgspec.structs.replace(with_pen(board, pressed=board.pen.down - 2000), firmware=firmware)
    port = open_port(f"sim:?firmware={firmware}", profile)
    made = plan(drawing, profile)
    run(made, port, profile)
    got = port.executed_drawing()
    assert observation.compare_strokes(drawing, got).deviation < 0.1 and not port.pen_is_down
    told = [block.servo for block in made.blocks if isinstance(block, Timed) and block.servo is not None]
    assert len(set(told)) > 6 and board.pen.down - 2000 <= min(told) and max(told) <= board.pen.down
    pairs = [pair for pair in zip(drawing.strokes, got.strokes, strict=True) if pair[0].length > 5]
    same = []
    for pair in pairs:
        shares = [(s.t - s.t[0]) / (s.t[-1] - s.t[0]) for s in pair]
        pressures = [np.interp(np.linspace(0, 1, 50), at, s.pressure) for at, s in zip(shares, pair, strict=True)]
        same.append(np.corrcoef(*pressures)[0, 1])
    assert len(same) >= 2 and np.median(same) > 0.9


def test_what_does_not_follow_says_nothing_of_heights():
    drawing = with_pressure(page(words=1), np.random.default_rng(3))
    stiff = plan(drawing, with_pen(ON_Z, pressed=None))
    assert all(block.z is None for block in stiff.blocks if isinstance(block, MoveBlock))
    flat = plan(page(words=1), with_pen(ON_Z, pressed=-0.8))
    assert all(block.z is None for block in flat.blocks if isinstance(block, MoveBlock))


def test_pressure_keeps_its_place_at_every_speed():
    stroke = Stroke(np.linspace(0, 2, 101), np.stack([np.linspace(20, 60, 101), np.full(101, 50)], 1))
    stroke = dataclasses.replace(stroke, pressure=np.linspace(0, 1, 101))
    profile = with_pen(ON_Z, pressed=-1.0)
    for speed in (0.5, 1.0, 2.0, "fast"):
        moves = [
            b for b in plan(Drawing((stroke,), page().page), profile, speed=speed).blocks if isinstance(b, MoveBlock)
        ]
        for move in moves:
            if move.z is not None:
                assert -move.z == pytest.approx((move.x - 20) / 40, abs=0.02)


def own_commands():
    down, up = ("M8", "G4 P0.05"), ("M9",)
    return with_pen(SERVO, lift="command", up=1.0, down=2.0, up_command=up, down_command=down)


def test_commands_of_ones_own_are_sent_as_they_are_once():
    profile = own_commands()
    blocks = [
        PenBlock(False),
        MoveBlock(10, 10, 6000),
        PenBlock(True),
        MoveBlock(11, 10, 600),
        PenBlock(True),
        MoveBlock(12, 10, 600),
        PenBlock(False),
    ]
    lines = [command.data for command in protocol.program(blocks, profile, absolute=True)]
    assert lines[3:] == [
        b"G4P0\n", b"M9\n", b"G4P0.12\n", b"G1X10Y10F6000\n", b"G4P0\n", b"M8\n", b"G4 P0.05\n", b"G4P0.15\n",
        b"G1X11Y10F600\n", b"X12\n", b"G4P0\n", b"M9\n", b"G4P0.12\n", b"G4P0\n",
    ]  # fmt: skip


def test_commands_of_ones_own_draw():
    profile, drawing = own_commands(), page(words=2)
    port, _ = drawn(drawing, profile)
    assert observation.compare_strokes(drawing, port.executed_drawing()).deviation < 0.1 and not port.pen_is_down


SERVO_PEN = 'lift = "servo"\nup = 40\ndown = 90\n'
COMMAND = 'lift = "command"\nup_command = ["M9"]\ndown_command = ["{}"]\n'


@pytest.mark.parametrize(
    ("pen", "said"),
    [
        (COMMAND.format("M8?"), r"pen\.down_command has 'M8\?', which is not a line of 1 to 70 printable"),
        (COMMAND.format("M" + "8" * 70), "not a line of 1 to 70"),
        (COMMAND.format("M8\\nG0X500"), "not a line of 1 to 70"),
        (COMMAND.format("Mé"), "not a line of 1 to 70"),
        (COMMAND.format(" "), "not a line of 1 to 70"),
        ('lift = "command"\ndown_command = ["M8"]\n', r"pen\.up_command and lift = \"command\" belong together"),
        (SERVO_PEN + 'up_command = ["M9"]\n', "belong together"),
        (SERVO_PEN + "pressed = -1\n", r'pressed = -1 needs lift = "z"'),
        ('lift = "z"\nup = 3\ndown = 0\npressed = 1\n', "must not be higher than pen.down = 0"),
        ('lift = "z"\nup = 3\ndown = 0\nz = "down"\n', "must be higher .* counts downwards"),
        (SERVO_PEN + 'ramp = "3s"\n', r"pen\.ramp = 3 is outside 0 to 2"),
        ('lift = "servo"\ndown = 90\n', r"pen\.up is missing"),
    ],
)
def test_pens_that_cannot_be_are_refused(tmp_path, pen, said):
    text = profiles.locate("plotter-grbl-servo").read_text(encoding="utf-8")
    head, _, rest = text.partition("[pen]")
    _, _, tail = rest.partition("up_time")
    path = tmp_path / "plotter-x.toml"
    path.write_text(f"{head}[pen]\n{pen}up_time{tail}", encoding="utf-8")
    with pytest.raises(ProfileError, match=said):
        profiles.read_profile(path)
