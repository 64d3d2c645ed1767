"""Clocks and disks for tests: time that passes when it is told to, a disk that takes its time by that clock."""

from collections import deque
from concurrent.futures import Future


class Clock:
    """A real clock, as a simulated plotter takes it, that goes on only while somebody sleeps."""

    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


class LateDisk:
    """The thread that writes a journal, by such a clock: whatever is to be kept takes `seconds`; an Executor.

    With `dead` nothing is kept any more.  kept : what was on the disk when it was waited for last.
    """

    def __init__(self, clock, seconds):
        self.clock, self.seconds, self.dead, self.longest = clock, seconds, False, 0
        self.waiting, self.free = deque(), 0.0

    def submit(self, call, *arguments):
        self.free = max(self.free, self.clock.now) + (self.seconds if arguments == (True,) else 0.0)
        one = Late(self, call, arguments, self.free)
        self.waiting.append(one)
        self.longest = max(self.longest, len(self.waiting))
        return one

    def work(self):
        while self.waiting and self.waiting[0].due <= self.clock.now:
            one, now = self.waiting.popleft(), self.clock.now
            self.clock.now = one.due
            one.carry_out()
            self.clock.now = now

    def shutdown(self):
        self.clock.now = max(self.clock.now, self.free)
        self.work()


class Late(Future):
    """Something that such a disk will have done by and by."""

    def __init__(self, disk, call, arguments, due):
        super().__init__()
        self.disk, self.call, self.arguments, self.due = disk, call, arguments, due

    def carry_out(self):
        try:
            self.set_result(self.call(*self.arguments))
        except Exception as error:
            self.set_exception(error)

    def done(self):
        self.disk.work()
        return super().done()

    def result(self, timeout=None):
        self._wait(timeout)
        return super().result(0.0)

    def exception(self, timeout=None):
        self._wait(timeout)
        return super().exception(0.0)

    def _wait(self, timeout):
        clock = self.disk.clock
        until = self.due if timeout is None else min(self.due, clock.now + timeout)
        clock.now = max(clock.now, until)
        self.disk.work()
