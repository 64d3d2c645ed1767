"""Character counting: nothing is ever lost, whatever the buffer; silence and loss are told apart."""

from collections import deque

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.errors import DeviceAlarm, DeviceGarbled, DeviceSilent
from handout.plotting import open_port
from handout.plotting.dialects.grbl.conversation import GrblConversation, Sent

PROFILE = profiles.find("simulated", "plotter")


class Scripted:
    """A port that answers what it was told to."""

    def __init__(self, *answers):
        self.answers, self.sent = deque(answers), b""

    def write(self, data):
        self.sent += data

    def read(self, timeout):
        return self.answers.popleft() if self.answers else b""

    def close(self):
        pass


def link(port, buffer=128, timeout=1.0, log=lambda _: None):
    return GrblConversation(port, buffer, timeout, log)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    st.integers(32, 128), st.integers(2, 15), st.floats(0, 0.03), st.randoms(), st.sampled_from([9600, 115200])
)  # fmt: skip
def test_a_buffer_never_overflows(buffer, queue, latency, random, baud):
    profile = msgspec.structs.replace(PROFILE, port=msgspec.structs.replace(PROFILE.port, baud=baud))
    port = open_port(f"sim:?buffer={buffer}&queue={queue}&latency={latency:.4f}s", profile)
    while port.read(0.5):
        pass
    lines = [
        f"G1X{random.uniform(0, 99):.{random.randint(0, 3)}f}Y{random.randint(0, 99)}F{random.randint(2000, 9000)}\n"
        for _ in range(60)
    ]
    conversation, done = link(port, buffer, timeout=30), []
    for number, line in enumerate(lines):
        conversation.send(Sent(number, line.encode()), done.append)
        under_way = sum(len(text) for text in lines[len(done) : number + 1])
        assert under_way <= buffer - 1
    conversation.drain(done.append)
    assert port.lost_bytes == 0
    assert [sent.number for sent in done] == list(range(60))


def test_more_than_the_buffer_would_be_lost():
    """The same program without counting: the property above can fail."""
    port = open_port("sim:?buffer=64", PROFILE)
    while port.read(0.5):
        pass
    port.write(b"".join(b"G1X%dF600\n" % (index % 50) for index in range(60)))
    while port.read(1):
        pass
    assert port.lost_bytes > 0


def test_replies_may_come_in_pieces():
    port = Scripted(b"o", b"k\r", b"\nok", b"\r\n")
    conversation, done = link(port), []
    conversation.send(Sent(0, b"G21\n"), done.append)
    conversation.send(Sent(1, b"G90\n"), done.append)
    conversation.drain(done.append)
    assert [sent.line for sent in done] == [b"G21\n", b"G90\n"] and port.sent.replace(b"?", b"") == b"G21\nG90\n"


def test_silence_is_noticed_after_asking():
    port = Scripted()
    with pytest.raises(DeviceSilent, match="has not answered for 1 s"):
        link(port).attend()
    assert port.sent.count(b"?") >= 3


def test_a_refused_line_is_named():
    conversation = link(Scripted(b"ok\r\nerror:33\r\n"))
    conversation.send(Sent(0, b"G21\n"), lambda _: None)
    conversation.send(Sent(1, b"X1e9\n"), lambda _: None)
    with pytest.raises(DeviceAlarm, match=r"refused line 2, 'X1e9': error:33"):
        conversation.drain(lambda _: None)


def test_alarm_restart_and_lock_are_told_in_plain_words():
    for answer, said in (
        (b"ALARM:2\r\n", "ALARM:2: a move would have left its travel"),
        (b"Grbl 1.1h ['$' for help]\r\n", "restarted by itself"),
        (b"<Alarm|MPos:0,0,0>\r\n", "locked after an alarm"),
    ):
        conversation = link(Scripted(answer))
        conversation.send(Sent(0, b"X1\n"), lambda _: None)
        with pytest.raises(DeviceAlarm, match=said):
            conversation.drain(lambda _: None)


def test_rest_with_lines_unanswered_means_loss():
    conversation = link(Scripted(*[b"", b"<Idle|MPos:0,0,0>\r\n"] * 20))
    conversation.send(Sent(0, b"X1\n"), lambda _: None)
    with pytest.raises(DeviceGarbled, match="something was lost on the way"):
        conversation.drain(lambda _: None)


def test_a_hold_is_waited_for_and_said_once():
    said = []
    conversation = link(Scripted(*[b"<Hold:0|MPos:0,0,0>\r\n"] * 40, b"ok\r\n"), log=said.append)
    conversation.send(Sent(0, b"X1\n"), lambda _: None)
    conversation.drain(lambda _: None)
    assert len(said) == 1 and "on hold" in said[0]


def test_ask_waits_alone():
    assert len(link(Scripted(b"$110=600\r\n$111=600\r\nok\r\n")).ask(b"$$\n")) == 3
    with pytest.raises(DeviceAlarm, match=r"refused.*error:5"):
        link(Scripted(b"error:5\r\n")).ask(b"$H\n")
    with pytest.raises(DeviceSilent, match="did not finish within 2 s"):
        link(Scripted()).ask(b"$H\n", patience=2)
