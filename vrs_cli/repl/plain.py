"""The shell without a terminal: commands from a pipe, plain answers in order, nothing asked, nothing echoed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TextIO

from vrs_cli.engine.clock import Clock
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.repl.interrupt import stoppable
from vrs_cli.repl.recorder import Recorder
from vrs_cli.repl.terminal import PlainTerminal

OK, FAILED = 0, 1
BYTE_ORDER_MARK = "\ufeff"


def run(
    model: RobotModel | None,
    file: str | None,
    source: Iterable[str],
    sink: TextIO,
    recorder: Recorder | None = None,
    clock: Clock | None = None,
) -> int:
    """Carry out the lines of `source`. Returns 1 when any of them could not be, 0 otherwise.

    A wrong line does not stop the lines after it; EXIT does, and so does Ctrl-C. Raises KeyboardInterrupt for a Ctrl-C
    while the next line is waited for.
    """
    terminal = PlainTerminal(sink, _unmarked(source))
    session = Session(terminal, model, clock=clock)
    conversation = Conversation(session)
    if recorder is not None:
        terminal.show(recorder.begin(session))
    if file is not None:
        with stoppable(session.interrupt):
            conversation.perform(conversation.load(file))
    for line in terminal.lines:
        with stoppable(session.interrupt):
            conversation.take(line.rstrip("\r\n"))
        sink.flush()
        if terminal.leaving or session.desk.interrupted:
            break
    with stoppable(session.interrupt):
        conversation.perform(conversation.leave_entry("the input ended: "))
    return FAILED if terminal.failed or session.desk.interrupted else OK


def _unmarked(source: Iterable[str]) -> Iterator[str]:
    """The lines without the byte order mark that some systems put before the first."""
    for number, line in enumerate(source):
        yield line if number else line.removeprefix(BYTE_ORDER_MARK)
