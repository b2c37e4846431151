"""The fence of the system round a run: time on the wall, and memory. What a program does is counted: `Limits`."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType

from vrs_cli.cli.command_line import CommandLineError
from vrs_cli.errors import LimitReached

GRACE = 2.0  # [s] to come to the end of a step; then it is broken off
LEAST_MEMORY = 256_000_000  # bytes of address space, in which the interpreter and numpy have room


@contextmanager
def wall(seconds: float | None, end_by: Callable[[LimitReached], None]) -> Iterator[None]:
    """`end_by` is told when so many seconds have passed, once; some seconds later that is raised wherever the program
    is. Raises CommandLineError where the system has no such alarm."""
    if seconds is None:
        yield
        return
    if not hasattr(signal, "setitimer"):
        raise CommandLineError("--max-wall: this system has no alarm", "--max-steps counts steps everywhere")
    reached = LimitReached(f"the run took longer than {seconds:g} s", "give it more with --max-wall")
    told: list[LimitReached] = []

    def ring(_number: int, _frame: FrameType | None) -> None:
        if told:
            raise reached
        told.append(reached)
        end_by(reached)
        signal.setitimer(signal.ITIMER_REAL, GRACE)

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def memory(most: int | None) -> Iterator[Callable[[], None]]:
    """Let the system give no more than so many bytes, until that is lifted; raises LimitReached where more is needed.

    Raises CommandLineError where the system has no such limit.
    """
    if most is None:
        yield lambda: None
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
        yield lift
    except MemoryError:
        lift()
        raise out_of_memory(most) from None
    finally:
        lift()


def out_of_memory(most: int | None) -> LimitReached:
    what = "there is" if most is None else f"--max-memory {most}"
    return LimitReached(f"the run needs more memory than {what}", "give it more with --max-memory")
