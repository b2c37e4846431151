"""What is typed while a line is carried out: the terminal keeps it for the next prompt, and does not show it before."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def unechoed(*, signals: bool) -> Iterator[None]:
    """Without echo, where standard input is a terminal that has one. `signals`: Ctrl-C and the like are signals; they
    are keys otherwise, that wait for the next prompt.
    """
    try:
        import termios
    except ImportError:  # Windows echoes nothing that is not read
        yield
        return
    try:
        before = termios.tcgetattr(sys.stdin)
    except (termios.error, OSError, ValueError):
        yield
        return
    quiet = [*before]
    quiet[3] &= ~(termios.ECHO | termios.ISIG)
    quiet[3] |= termios.ISIG * signals
    termios.tcsetattr(sys.stdin, termios.TCSANOW, quiet)
    try:
        yield
    finally:
        with suppress(termios.error):  # the terminal may have gone
            termios.tcsetattr(sys.stdin, termios.TCSANOW, before)
