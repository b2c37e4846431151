"""Limit the time and the memory of a run by means of the operating system. `Limits` in `interfaces/tasks/` counts the
steps of programs."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from types import FrameType

from vrs_cli.cli.command_line import CommandLineError
from vrs_cli.errors import LimitReached
from vrs_cli.repl.interrupt import alarm

GRACE = 2.0  # [s] time that the current step gets to finish before it is interrupted
LEAST_MEMORY = 256_000_000  # bytes of address space that the interpreter and numpy need

# bytes that must stay free, because without memory CPython 3.11 may loop endlessly in an exception handler
LAST_BYTES = 16_000_000
CHECK_EVERY = 0.02  # [s] CPU time between two checks of the memory; a program takes less than LAST_BYTES in this time
STATM = "/proc/self/statm"  # on Linux: the memory size of this process

# takes `end_by`, which ends the running program, and returns a context for code that may need too much memory
MemoryGuard = Callable[[Callable[[LimitReached], bool]], AbstractContextManager[None]]


@contextmanager
def limited_time(seconds: float | None, end_by: Callable[[LimitReached], bool]) -> Iterator[None]:
    """Let `end_by` end the running program after this many seconds.

    If no program runs, or it has not ended GRACE seconds later, LimitReached is raised in the main thread. Raises
    CommandLineError if the system has no such alarm.
    """
    if seconds is None:
        yield
        return
    if not hasattr(signal, "setitimer"):
        raise CommandLineError("--max-wall: this system has no alarm", "--max-steps counts steps everywhere")
    reached = LimitReached(f"the run took longer than {seconds:g} s", "give it more with --max-wall")
    signalled: list[LimitReached] = []

    def ring(_number: int, _frame: FrameType | None) -> None:
        if signalled or not end_by(reached):
            raise reached
        signalled.append(reached)
        signal.setitimer(signal.ITIMER_REAL, GRACE)

    with alarm(signal.SIGALRM, signal.ITIMER_REAL, seconds, ring):
        yield


@contextmanager
def limited_memory(most: int | None) -> Iterator[MemoryGuard]:
    """Limit the address space of the process.

    Yield a function that takes `end_by` and returns a context for code that may need too much memory. If memory runs
    out in that context, the limit is lifted and `end_by` ends the program; if no program runs, LimitReached is raised.
    Raises CommandLineError if the system has no such limit.
    """
    if most is None:
        yield partial(_guard_memory, 0, lambda: None)
        return
    try:
        import resource
    except ImportError:
        raise CommandLineError(
            "--max-memory: this system has no such limit", "--max-elements counts everywhere"
        ) from None
    if most < LEAST_MEMORY:
        raise CommandLineError(f"--max-memory {most} is too little", f"at least {LEAST_MEMORY // 1_000_000}M")
    before = resource.getrlimit(resource.RLIMIT_AS)
    try:
        resource.setrlimit(resource.RLIMIT_AS, (most, before[1]))
    except (ValueError, OSError) as error:
        raise CommandLineError(f"--max-memory: the system refuses {most} bytes: {error}", "give less") from None
    lift = partial(resource.setrlimit, resource.RLIMIT_AS, before)
    try:
        yield partial(_guard_memory, most, lift)
    finally:
        lift()


@contextmanager
def _guard_memory(most: int, lift: Callable[[], None], end_by: Callable[[LimitReached], bool]) -> Iterator[None]:
    what = f"--max-memory {most}" if most else "there is"
    reached = LimitReached(f"the run needs more memory than {what}", "give it more with --max-memory")

    def check(_number: int, _frame: FrameType | None) -> None:
        with open(STATM, "rb") as stream:
            address_space = int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")  # of this process [bytes]
        if most - address_space < LAST_BYTES:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            lift()
            if not end_by(reached):
                raise reached

    def tell(unraisable: sys.UnraisableHookArgs) -> None:  # ignore MemoryError in destructors
        if not isinstance(unraisable.exc_value, MemoryError):
            previous(unraisable)

    previous, sys.unraisablehook = sys.unraisablehook, tell
    try:
        checks = most and os.path.exists(STATM)
        with alarm(signal.SIGPROF, signal.ITIMER_PROF, CHECK_EVERY, check, CHECK_EVERY) if checks else nullcontext():
            try:
                yield
            except MemoryError:
                lift()
                raise reached from None
    finally:
        sys.unraisablehook = previous
