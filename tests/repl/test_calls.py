"""How many calls of Python functions a line takes, and how deep the stack is under a motion command.

Calls are counted, not seconds: they are the same on every machine. A limit is lowered to what was reached.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from types import FrameType

from tests.net.serving import serving
from vrs_cli.net.client import Client, hello_of
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.repl.connection import Remote
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.loop import PlainTerminal
from vrs_cli.repl.shell import Local
from vrs_cli.values.replies import Reply

MOST_TO_APPLY, MOST_FRAMES = 1_150, 15  # from the line to `Timeline.apply`
MOST_OF_WHERE = 330  # from the line until its reply is shown
MOST_OF_REMOTE_WHERE = 660  # of this package, in the threads of the client and of the server
PACKAGE = f"{os.sep}vrs_cli{os.sep}"
WARM = ("READY", "MOVE #PPOINT(10, -80, 120, 0, 20, 0)", "MOVE #PPOINT(20, -80, 120, 0, 20, 0)", "WHERE AT 2")


class Counter:
    """Counts the calls of Python functions, those of this package alone with `ours`."""

    def __init__(self, ours: bool = False) -> None:
        self.calls, self.counts, self._ours = 0, False, ours
        self.stacks: list[tuple[int, int]] = []  # calls and frames at each call of `Timeline.apply`

    def __call__(self, frame: FrameType, event: str, _argument: object) -> None:
        if not self.counts or event != "call" or (self._ours and PACKAGE not in frame.f_code.co_filename):
            return
        self.calls += 1
        if frame.f_code.co_qualname == "Timeline.apply":
            depth, at = 1, frame
            while at.f_code.co_qualname != "Exchange.take" and at.f_back is not None:
                depth, at = depth + 1, at.f_back
            self.stacks.append((self.calls, depth))

    def of(self, act: Callable[[], object]) -> int:
        """The calls during an act, in this thread too."""
        self.calls, self.counts, before = 0, True, sys.getprofile()
        sys.setprofile(self)
        try:
            act()
        finally:
            self.counts = False
            sys.setprofile(before)
        return self.calls


class Shown(PlainTerminal):
    """A terminal that prints nothing; `shown` is called with what it is to show."""

    def __init__(self) -> None:
        super().__init__(StringIO(), ())
        self.shown: Callable[[Reply], None] = lambda _reply: None

    def show(self, reply: Reply) -> None:
        self.shown(reply)


def warm(front_end: FrontEnd) -> FrontEnd:
    """The front end after lines that fill what is remembered of such lines."""
    for line in WARM:
        front_end.take(line)
    return front_end


def test_a_motion_comes_to_the_timeline_in_few_calls() -> None:
    front_end, counter = warm(Local().front_end(Shown())), Counter()
    counter.of(lambda: front_end.take("MOVE #PPOINT(30, -80, 120, 0, 20, 0)"))
    ((calls, frames),) = counter.stacks
    assert calls <= MOST_TO_APPLY
    assert frames <= MOST_FRAMES


def test_a_look_is_shown_after_few_calls() -> None:
    terminal, counter = Shown(), Counter()
    front_end, seen = warm(Local().front_end(terminal)), list[int]()
    terminal.shown = lambda _reply: seen.append(counter.calls)
    counter.of(lambda: front_end.take("WHERE AT 1"))
    assert seen[0] <= MOST_OF_WHERE


def test_a_remote_look_takes_few_calls_at_both_ends(tmp_path: Path) -> None:
    counter = Counter(ours=True)  # what asyncio and websockets do depends on how the threads meet
    threading.setprofile(counter)
    try:
        with serving(tmp_path) as it:
            port = SocketPort(Client(it.address, hello_of()))
            front_end = warm(Remote(port, lambda _text: None).front_end(Shown()))
            counts = [counter.of(lambda: front_end.take("WHERE")) for _ in range(7)]
            port.close()
    finally:
        threading.setprofile(None)  # type: ignore[arg-type]
    assert min(counts) <= MOST_OF_REMOTE_WHERE, "the least, for pings may come between"
