"""Signals that end what serves others until then."""

from __future__ import annotations

import asyncio
import signal

from vrs_cli.repl.interrupt import ENDINGS, SAID, Ended


async def signal_comes() -> int:
    """Wait for Ctrl-C, or a signal that ends the process; its number. Signals that are ignored stay ignored.

    The event loop hears them: a handler of Python's own may not run before something else wakes the loop.
    """
    loop, came = asyncio.get_running_loop(), asyncio.Queue[int]()
    heard = [number for number in SAID if signal.getsignal(number) is not signal.SIG_IGN]
    try:
        for number in heard:
            loop.add_signal_handler(number, came.put_nowait, number)
    except NotImplementedError:  # Windows: Ctrl-C raises KeyboardInterrupt
        heard = []
    try:
        return await came.get()
    finally:
        for number in heard:
            loop.remove_signal_handler(number)


def end_by(number: int) -> None:
    """All has stopped: Ctrl-C was the way to stop it, any other signal ends the process. Raises Ended."""
    if number in ENDINGS:
        raise Ended(number)
