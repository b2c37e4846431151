"""Handle Ctrl-C, Ctrl-X, and the signals that end a process (SIGTERM, SIGHUP) during a piece of work, and set timers
that send a signal."""

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
    """The exception for a signal that ends the process (not Ctrl-C). It stops the same work as Ctrl-C; then no new work
    begins. `status`: the exit status, 128 + the signal's number as in shells."""

    def __init__(self, number: int) -> None:
        super().__init__(SAID[number])
        self.number, self.status = number, 128 + number


class Stoppable:
    """The signal handler for a piece of work. At the first signal it calls `stop`, which returns whether the work will
    now end by itself. If not, or at a second signal, or while the work is `waiting` for something outside this process,
    it raises KeyboardInterrupt (or Ended) in the work.

    `number`: the first signal that arrived, None before; a later signal that ends the process replaces it. Signals that
    the process ignores stay ignored.
    """

    def __init__(self, stop: Callable[[], bool]) -> None:
        self.number: int | None = None
        self.waiting = False
        self._stop = stop
        self._handling = _handle_signals(SAID, self._on_signal)

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
        """Let a signal end the block, which waits for something outside this process, at once and without an error."""
        self.waiting = True
        try:
            yield
        except KeyboardInterrupt:
            pass
        finally:
            self.waiting = False

    def end(self, *numbers: int) -> None:
        """Call this method after everything has stopped. Raises Ended if the signal was one that ends the process, or
        one of `numbers`."""
        if self.number is not None and self.number in (*ENDINGS, *numbers):
            raise Ended(self.number)


@contextmanager
def stoppable(interrupt: Callable[[], bool]) -> Iterator[None]:
    """Let Ctrl-C stop the running program. A second Ctrl-C, or one without a running program, interrupts the current
    work. A signal that ends the process takes effect after the work has stopped.

    `interrupt` stops a program, and returns whether one was running.
    """
    with Stoppable(interrupt) as heard:
        yield
    heard.end()


@contextmanager
def _handle_signals(
    numbers: Iterable[int], handler: Callable[[int, FrameType | None], None], *, ignored_too: bool = False
) -> Iterator[None]:
    """During the block, call `handler` when one of the signals `numbers` arrives. Do nothing outside the main thread.
    `ignored_too`: also handle signals that the process ignores so far."""
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
    """During the block, raise Ended as soon as a signal arrives that ends the process (SIGTERM, SIGHUP)."""

    def end(number: int, _frame: FrameType | None) -> None:
        raise Ended(number)

    return _handle_signals(ENDINGS, end)


async def signal_comes() -> int:
    """Wait for Ctrl-C, or another signal that ends the process, and return its number. Ignored signals stay ignored.

    The event loop handles the signals, because a signal handler of Python may not run until something else wakes the
    loop.
    """
    import asyncio

    loop, came = asyncio.get_running_loop(), asyncio.Queue[int]()
    heard = [number for number in SAID if signal.getsignal(number) is not signal.SIG_IGN]
    try:
        for number in heard:
            loop.add_signal_handler(number, came.put_nowait, number)
    except NotImplementedError:  # on Windows Ctrl-C raises KeyboardInterrupt
        heard = []
    try:
        return await came.get()
    finally:
        for number in heard:
            loop.remove_signal_handler(number)


def abort_on_quit(abort: Callable[[], None]) -> AbstractContextManager[None]:
    """Call `abort` on SIGQUIT, which Ctrl-X sends while a line is being executed (see `without_echo`). Windows has no
    SIGQUIT."""
    quit = [signal.SIGQUIT] if hasattr(signal, "SIGQUIT") else []
    return _handle_signals(quit, lambda _number, _frame: abort(), ignored_too=True)


@contextmanager
def alarm(
    number: int, timer: int, seconds: float, handler: Callable[[int, FrameType | None], None], interval: float = 0.0
) -> Iterator[None]:
    """Call `handler` when the system's timer `timer` sends the signal `number`: after `seconds` [s], and then every
    `interval` [s] (0: only once). Stop the timer at the end of the block. Windows has no such timers."""
    before = signal.signal(number, handler)
    signal.setitimer(timer, seconds, interval)
    try:
        yield
    finally:
        signal.setitimer(timer, 0.0)
        signal.signal(number, before)
