"""Every dialect of the table is whole: nothing of it has to be known anywhere else."""

import dataclasses
import typing

import pytest

from handout import profiles
from handout.pipeline import programs
from handout.plotting.dialects import DIALECTS, dialect, usual_devices
from handout.simulated.plotter.firmware import firmware_of


@pytest.fixture(params=DIALECTS)
def name(request):
    return request.param


def usual(name):
    return profiles.find(dialect(name).usual_device, "plotter")


def test_profiles_take_the_dialects_of_the_table():
    assert set(typing.get_args(typing.get_type_hints(profiles.Plotter)["dialect"])) == set(DIALECTS)


def test_every_part_is_there(name):
    language = dialect(name)
    optional = {"pen_values", "steps_setting", "usb", "curves", "lowering_bytes", "in_hand", "clues", "line_end"}
    missing = [field.name for field in dataclasses.fields(language) if not getattr(language, field.name)]
    assert set(missing) <= optional
    assert all(suffix.startswith(".") for suffix in language.suffixes)
    assert usual(name).dialect == name


def test_servos_have_values_unless_the_pen_is_the_machine_s_own(name):
    values, profile = dialect(name).pen_values, usual(name)
    assert (values is None) == (profile.pen.lift == "own")
    if values is not None:
        assert values.least < profile.pen.up < values.greatest and values.written(profile.pen.up)


def test_there_is_a_simulated_controller_that_shares_nothing(name):
    controller = firmware_of(usual(name))
    assert controller.framing() is not None
    assert dialect(name).simulator == f"{controller.__module__}:{controller.__name__}"


def test_the_simulated_controller_answers_the_question(name):
    from handout.plotting import connections

    port = connections.open_port("sim:", usual(name))
    answer = connections.ask(port, list(DIALECTS), wakes=3.0)
    assert answer is not None and answer.dialect == name


def test_the_command_knows_the_files_of_all_dialects():
    assert set(usual_devices()) == set(programs.SUFFIXES)
