"""Meeting an EBB: is it there, which firmware has it, have its motors power, and does it know where it stands?"""

from __future__ import annotations

import msgspec

from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent
from handout.plotting.dialects.ebb.conversation import EbbConversation
from handout.plotting.dialects.ebb.firmware import CURRENT, ENABLED, MOTION, POSITION, SIGNED, UNKNOWN, Version
from handout.plotting.dialects.ebb.protocol import About
from handout.profiles import Plotter

_GLANCE = 0.25  # s
_MOMENT = 0.005  # s between two looks whether it is done
NOTHING = b"SM,1,0,0\r"  # a rest: old boards have to be told one to find out that what came before it is done
_VOLTS = 7.5  # less is no power supply, only what comes through USB
QUEUE = 8  # commands in the queue of firmware 3, which has one unless it is told otherwise


def meet(conversation: EbbConversation, profile: Plotter) -> Plotter:
    """Find out the firmware; the profile with it.

    Raises
    ------
    DeviceSilent
        Nothing answers, or something that is not an EBB.
    """
    about, garbage, waited = None, False, 0.0
    while about is None and waited < profile.port.timeout:
        conversation.port.write(b"V\r")  # ends, and spoils, whatever was begun before a cable was pulled
        for _ in range(4):
            heard = conversation.replies(_GLANCE)
            about = next((reply for reply in heard if isinstance(reply, About)), about)
            garbage |= bool(heard)
            waited += 0.0 if heard else _GLANCE
            if about is not None:
                break
    if about is None:
        raise DeviceSilent(_missing(garbage, profile))
    conversation.uniform = about.uniform
    while conversation.replies(min(_GLANCE, 0.05)):
        pass  # answers to what was sent by whoever spoke to it before
    return msgspec.structs.replace(profile, firmware=str(about.version))


def _missing(garbage: bool, profile: Plotter) -> str:
    if garbage:
        return "Something answers, but not as an EBB does: check the port, and the dialect in the profile."
    return (
        f"The plotter does not answer within {profile.port.timeout:g} s: is this its port, is its cable plugged in, "
        "and is no other program connected to it?"
    )


def settle(conversation: EbbConversation, version: Version) -> None:
    """Wait until it has done what it was told before; a rest is answered when it and one more are left to do.

    Raises
    ------
    DeviceGarbled
        It takes longer than anything that it was told.
    """
    if version < MOTION:
        for _ in range(3):
            conversation.ask(NOTHING)
        return
    waited = 0.0
    while conversation.ask(b"QM\r")[:1] != (0,):
        if waited > conversation.patience:
            raise DeviceGarbled(
                f"The plotter is still busy {waited:.0f} s after its last command, which was to take less: a command "
                "came over wrong. Use a shorter cable, and no hub."
            )
        waited += 0.0 if conversation.port_says(_MOMENT) else _MOMENT


def check_power(numbers: tuple[int, ...]) -> None:
    """Raise DeviceAlarm if the answer to QC says that the motors have no power.

    The second number is the voltage of the power supply behind a diode (0.3 V) and a divider (9.2), 3.3 V being 1023.
    """
    if len(numbers) < 2:
        return
    volts = numbers[1] / 1023 * 3.3 * 9.2 + 0.3
    if volts < _VOLTS:
        raise DeviceAlarm(
            f"The plotter's motors have no power ({volts:.1f} V): plug in its power supply and switch it on; "
            "the USB cable alone does not move it."
        )


def ask_power(conversation: EbbConversation, version: Version) -> None:
    """See that the motors have power."""
    if version >= CURRENT:
        check_power(conversation.ask(b"QC\r"))


def rested(conversation: EbbConversation, version: Version) -> bool:
    """Whether its motors have been off or might have been, so that the carriage may be anywhere.

    Boards that cannot say are taken at the word of their counters: not zero, they have been driven from it.
    """
    if version >= ENABLED:
        return steps_are_others(conversation, version)
    return version < POSITION or conversation.ask(b"QS\r") == (0, 0)


def steps_are_others(conversation: EbbConversation, version: Version) -> bool:
    """Whether its motors do not make steps of a sixteenth, as far as it can tell."""
    return version >= ENABLED and conversation.ask(b"QE\r") != (16, 16)


def lengthen(conversation: EbbConversation, version: Version) -> int:
    """Make the queue longer where that is possible; how many commands it holds."""
    if version < SIGNED or version == UNKNOWN:
        return 1
    conversation.ask(f"CU,4,{QUEUE}\r".encode("ascii"))
    return QUEUE
