"""The shell without a terminal: commands from a pipe, plain answers in order, nothing asked, nothing echoed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TextIO

from vrs_cli.repl.interrupt import stoppable
from vrs_cli.repl.piped import piped
from vrs_cli.repl.place import Place
from vrs_cli.repl.terminal import PlainTerminal

OK, FAILED = 0, 1
BYTE_ORDER_MARK = "\ufeff"


def run(place: Place, source: Iterable[str], sink: TextIO) -> int:
    """Carry out the lines of `source`. Returns 1 when any of them could not be, 0 otherwise.

    A wrong line does not stop the lines after it; EXIT does, and so do Ctrl-C and a connection that is cut. Raises
    KeyboardInterrupt for a Ctrl-C while the next line is waited for.
    """
    lines = piped(source) if place.lives and not place.remote else None
    terminal = PlainTerminal(sink, _unmarked(lines or source))
    front_end = place.front_end(terminal)
    if lines is not None:
        lines.robot = front_end.driven

        def after() -> None:
            front_end.keep_up()
            sink.flush()

        lines.after = after
    with stoppable(front_end.interrupt):
        front_end.opening()
    for line in terminal.lines:
        with stoppable(front_end.interrupt):
            front_end.take(line.rstrip("\r\n"))
        sink.flush()
        if front_end.was_cut():
            front_end.drop("the lines after this one")
            break
        if terminal.leaving or front_end.interrupted:
            break
    with stoppable(front_end.interrupt):
        front_end.leave_entry("the input ended: ")
    front_end.closing()
    return FAILED if terminal.failed or front_end.failed or front_end.interrupted else OK


def _unmarked(source: Iterable[str]) -> Iterator[str]:
    """Yield the lines without the byte order mark that some systems put before the first."""
    for number, line in enumerate(source):
        yield line if number else line.removeprefix(BYTE_ORDER_MARK)
