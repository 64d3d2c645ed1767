"""Connecting to a Marlin controller: is it there, does it check what it receives, and what are its own limits?"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from handout.plotting.dialect import Log
from handout.plotting.dialects.base import GLANCE, never_answered, with_limits
from handout.plotting.dialects.marlin import protocol
from handout.plotting.dialects.marlin.conversation import WINDOW, MarlinConversation
from handout.plotting.dialects.marlin.protocol import Ok, Reply, Resend
from handout.profiles import Acceleration, Length, Plotter, Speed

# Numbers begin where no command has its own: a damaged N before 112 must not make M112.
_FIRST = 10_000
_TRY = 1.0  # s to wait for the answer to one attempt
_LONGER = 15  # bytes by which a line that draws is longer than one that asks
_QUICK = 0.6  # share of the time of a segment in which a line has to be answered if lines are to be sent one by one
_SLOW = 2.5  # times of a segment in which even several lines under way are too few


def meet(conversation: MarlinConversation, profile: Plotter, log: Log) -> tuple[Plotter, set[str]]:
    """Wake the controller, number the lines, read its settings; it does not move.

    Returns the profile with the machine's own limits, where `log` is told that they differ; and what the controller can
    do besides, by the names of ``M115``: EMERGENCY_PARSER …

    Raises DeviceSilent if nothing answers, or something that is not Marlin.
    """
    replies = _hear_greeting(conversation, profile.port.start_up)
    replies += number(conversation, profile.port.start_up + profile.port.timeout, replies)
    _check_numbers(conversation, log)
    answers = conversation.ask(protocol.WHO)
    name = next((reply.name for reply in answers if isinstance(reply, protocol.Identity)), "")
    if name and "marlin" not in name.lower() and "prusa" not in name.lower():
        log(f"The plotter says that it runs {name!r}, which is not Marlin; it is spoken to as if it were.")
    answers += conversation.ask(protocol.SETTINGS)
    answers += conversation.ask(protocol.STANDING)
    able = {reply.name for reply in answers if isinstance(reply, protocol.Capability) and reply.able}
    profile = with_settings(profile, answers, log)
    room = [reply.commands + 1 for reply in answers if isinstance(reply, Ok) and reply.commands is not None]
    beat = _round_trip(conversation, profile)
    if beat * profile.segment_rate > _QUICK:
        conversation.window = max(room, default=WINDOW)
    if beat * profile.segment_rate > _SLOW:
        log(
            f"The plotter answers only after {beat * 1000:.0f} ms: it may pause in the middle of strokes; set the "
            "latency of its USB adapter to 1 ms, or lower segment_rate in the profile."
        )
    return profile, able


def _hear_greeting(conversation: MarlinConversation, start_up: float) -> list[Reply]:
    """What it says when its port is opened: a board may start anew then, and is deaf until it has greeted."""
    greeting = list[Reply]()
    for replies in conversation.listen(start_up):
        if not replies and any(isinstance(reply, protocol.Start) for reply in greeting):
            break
        greeting += replies
    return greeting


def number(conversation: MarlinConversation, patience: float, before: Sequence[Reply] = ()) -> list[Reply]:
    """Set the number of the next line; returns all replies."""
    end, replies = conversation.time + patience, list[Reply]()
    while conversation.time < end:
        conversation.port.write(b"\n" + protocol.frame_line(_FIRST, protocol.NUMBER))
        answer = _answer(conversation, _TRY)
        replies += answer
        if any(isinstance(reply, Ok) for reply in answer) and not _is_damaged(answer):
            conversation.start(_FIRST)
            return replies
    garbage = any(isinstance(reply, protocol.Note | protocol.Error) for reply in [*before, *replies])
    raise never_answered("Marlin", patience, garbage)


def _is_damaged(answer: list[Reply]) -> bool:
    return any(isinstance(reply, Resend | protocol.Fault | protocol.Unknown | protocol.Error) for reply in answer)


def _answer(conversation: MarlinConversation, patience: float) -> list[Reply]:
    """All replies from the first, within `patience` s, to a silence."""
    answer = conversation.replies(patience)
    end = conversation.time + patience
    while replies := conversation.replies(GLANCE) if answer and conversation.time < end else []:
        answer += replies
    return answer


def _check_numbers(conversation: MarlinConversation, log: Log) -> None:
    """See that a line out of order is refused, and learn whether an ``ok`` follows the refusal.

    Some versions send an ``ok`` after their request for a line and some do not, and only a test can tell.
    """
    for _ in range(3):
        conversation.port.write(b"\n" + protocol.frame_line(_FIRST + 2, protocol.STANDING))
        answer = _answer(conversation, _TRY)
        asked = [at for at, reply in enumerate(answer) if isinstance(reply, Resend)]
        if asked:
            conversation.echoes = any(isinstance(reply, Ok) for reply in answer[asked[-1] :])
            return
        if any(isinstance(reply, Ok) for reply in answer) and not _is_damaged(answer):
            break
    log("The plotter does not check the numbers of its lines: what is damaged on the way to it will not be noticed.")


def _round_trip(conversation: MarlinConversation, profile: Plotter) -> float:
    """How long it takes from a line to the answer to it, s by the port's clock."""
    least = _TRY
    for _ in range(3):
        begun = conversation.time
        conversation.send(protocol.STANDING, 0)
        while conversation.under_way and conversation.time < begun + _TRY:
            for reply in conversation.replies(_TRY):
                conversation.take(reply)
        least = min(least, conversation.time - begun)
        conversation.drain()
    return least + _LONGER * 10 / profile.port.baud


def with_settings(profile: Plotter, replies: list[Reply], log: Log) -> Plotter:
    """The profile with what ``M503`` said; `log` is told about every difference that changes the motion.

    Speeds are the lesser of the two, all else is the machine's.  Moves without filament are Marlin's travel moves:
    their acceleration is the T of ``M204``, at most that of ``M201``.
    """
    settings: dict[str, float] = {}
    for reply in replies:
        if isinstance(reply, protocol.SettingsLine):
            settings |= {reply.code + letter: value for letter, value in reply.values.items()}
    limits = with_limits(profile, _own_limits(profile, settings), log)
    pen, port = profile.pen, profile.port
    if pen.lift == "z" and {"M203Z", "M201Z"} <= settings.keys():
        own_z = Acceleration(min(settings["M201Z"], settings.get("M204T", settings["M201Z"])))
        pen = msgspec.structs.replace(pen, z_speed=Speed(min(pen.z_speed, settings["M203Z"])), z_acceleration=own_z)
    room = [reply.moves for reply in replies if isinstance(reply, Ok) and reply.moves is not None]
    if room:
        port = msgspec.structs.replace(port, queue=max(room))
    return msgspec.structs.replace(profile, limits=limits, pen=pen, port=port)


def _own_limits(profile: Plotter, settings: dict[str, float]) -> dict[str, float]:
    """The machine's own values of keys of the profile's `limits`."""
    limits = profile.limits
    values: dict[str, float] = {}
    if {"M203X", "M203Y"} <= settings.keys():
        fastest = min(settings["M203X"], settings["M203Y"])
        values["draw_speed"] = Speed(min(limits.draw_speed, fastest))
        values["travel_speed"] = Speed(min(limits.travel_speed, fastest))
    if {"M201X", "M201Y"} <= settings.keys():
        travel = settings.get("M204T", settings.get("M204S", limits.acceleration))
        values["acceleration"] = Acceleration(min(settings["M201X"], settings["M201Y"], travel))
    if "M205J" in settings:
        values["junction_deviation"], values["jerk"] = Length(settings["M205J"]), Speed(0.0)
    elif {"M205X", "M205Y"} <= settings.keys():
        values["jerk"] = Speed(min(settings["M205X"], settings["M205Y"]))
    if "M92X" in settings:
        values["steps_per_mm"] = settings["M92X"]
    return values
