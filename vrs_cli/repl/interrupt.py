"""Ctrl-C, Ctrl-X, and the signals that end a process (SIGTERM, SIGHUP), while something is carried out."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Any, Self

NAMED = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "the terminal is gone"}  # Windows has no SIGHUP
SAID: dict[int, str] = {getattr(signal, name): said for name, said in NAMED.items() if hasattr(signal, name)}
ENDINGS = tuple(number for number in SAID if number != signal.SIGINT)


class Ended(KeyboardInterrupt):
    """A signal ends the process: it stops what Ctrl-C stops, and nothing goes on after it. `status` is what shells
    report of it.
    """

    def __init__(self, number: int) -> None:
        super().__init__(SAID[number])
        self.number, self.status = number, 128 + number


class Stoppable:
    """Hears signals for as long as something is done. The first lets it come to a stop of its own, if `stop` says that
    it will; another, or one while it is `waiting` for something outside, breaks it off with KeyboardInterrupt.

    `number` is the signal that came, one that ends the process before Ctrl-C. Signals that are ignored stay ignored.
    """

    def __init__(self, stop: Callable[[], bool]) -> None:
        self.number: int | None = None
        self.waiting = False
        self._stop = stop
        self._handling = _handling(SAID, self._on_signal)

    def __enter__(self) -> Self:
        self._handling.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._handling.__exit__(*error)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        again = self.number is not None
        if number in ENDINGS or not again:
            self.number = number
        if again or self.waiting or not self._stop():
            raise Ended(number) if number in ENDINGS else KeyboardInterrupt

    @contextmanager
    def broken_off(self) -> Iterator[None]:
        """Enter while something outside is waited for: a signal ends the wait at once, and is no error."""
        self.waiting = True
        try:
            yield
        except KeyboardInterrupt:
            pass
        finally:
            self.waiting = False

    def end(self, *numbers: int) -> None:
        """Call when everything has stopped: the process ends now, if a signal said so, or one of `numbers`. Raises
        Ended.
        """
        if self.number is not None and self.number in (*ENDINGS, *numbers):
            raise Ended(self.number)


@contextmanager
def stoppable(interrupt: Callable[[], bool]) -> Iterator[None]:
    """Ctrl-C stops the program that runs; a second one, or one while none does, stops whatever is being done. A signal
    that ends the process does so once that has stopped.

    `interrupt` stops a program, and says whether one was running.
    """
    with Stoppable(interrupt) as heard:
        yield
    heard.end()


@contextmanager
def _handling(
    numbers: Iterable[int], handler: Callable[[int, FrameType | None], None], *, ignored_too: bool = False
) -> Iterator[None]:
    """Handle signals, in the main thread. `ignored_too`: also signals that are ignored."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        heard = [number for number in numbers if ignored_too or signal.getsignal(number) is not signal.SIG_IGN]
        before = {number: signal.signal(number, handler) for number in heard}
    try:
        yield
    finally:
        for number, handled in before.items():
            signal.signal(number, handled)


def ending() -> AbstractContextManager[None]:
    """Signals that end the process raise Ended, wherever it is."""

    def end(number: int, _frame: FrameType | None) -> None:
        raise Ended(number)

    return _handling(ENDINGS, end)


def aborting(abort: Callable[[], None]) -> AbstractContextManager[None]:
    """Call `abort` at SIGQUIT, the signal of Ctrl-X (`without_echo`), while a line is carried out. Windows has none."""
    quit = [signal.SIGQUIT] if hasattr(signal, "SIGQUIT") else []
    return _handling(quit, lambda _number, _frame: abort(), ignored_too=True)
