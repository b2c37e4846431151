"""The keys that are typed while a line is carried out: the terminal keeps them for the next prompt, unshown.

The key that aborts is a signal then (SIGQUIT), as Ctrl-C is one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from prompt_toolkit.input import Input
from prompt_toolkit.input.typeahead import get_typeahead
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

ABORT_KEY = b"\x18"  # Ctrl-X: on the keyboards of all countries, and no other program has to be left by it


@contextmanager
def unechoed(*, signals: bool) -> Iterator[None]:
    """Switch the echo off, where standard input is a terminal that has one. `signals`: Ctrl-C, Ctrl-X and the like are
    signals; they are keys otherwise, that wait for the next prompt.
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
    quiet[6] = [*before[6]]
    quiet[6][termios.VQUIT] = ABORT_KEY
    quiet[3] &= ~(termios.ECHO | termios.ISIG)
    quiet[3] |= termios.ISIG * signals
    termios.tcsetattr(sys.stdin, termios.TCSANOW, quiet)
    try:
        yield
    finally:
        with suppress(termios.error):  # the terminal may have gone
            termios.tcsetattr(sys.stdin, termios.TCSANOW, before)


def typed_ahead(source: Input) -> list[str]:
    """Take all that was typed for the next prompt: the lines that are not blank, the last one perhaps not ended."""
    keys = get_typeahead(source)
    with source.raw_mode():
        while more := source.read_keys():
            keys += more
        keys += source.flush_keys()
    return [line for line in "".join(map(_text, keys)).splitlines() if line.strip()]


def _text(pressed: KeyPress) -> str:
    """Return the text that a key adds to a line."""
    if pressed.key in (Keys.ControlM, Keys.ControlJ):
        return "\n"
    return pressed.data if pressed.key is Keys.BracketedPaste or len(pressed.key) == 1 else ""
