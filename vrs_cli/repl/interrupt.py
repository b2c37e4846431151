"""Ctrl-C while a line is carried out: a signal handler for as long as that takes."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def stoppable(interrupt: Callable[[], bool]) -> Iterator[None]:
    """Ctrl-C stops the program that runs; a second one, or one while none does, stops whatever is being done.

    `interrupt` stops a program, and says whether one was running.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed = False

    def stop(_signal: int, _frame: FrameType | None) -> None:
        nonlocal pressed
        if pressed or not interrupt():
            raise KeyboardInterrupt
        pressed = True

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
