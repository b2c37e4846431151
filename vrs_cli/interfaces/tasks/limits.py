"""Limits of a run of programs. They end programs that do not stop by themselves, and deny programs of other people
access to the network and to other processes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from math import inf, isnan

from msgspec import Struct, structs

from vrs_cli.errors import LimitReached

GO_ON = "SIGNAL sets an input that is waited for; RETRY lets a program go on"
# returns the hint to show when the named limit is reached ("signals": a program would wait forever for an input)
Advice = Callable[[str], str]


def at_prompt(_option: str) -> str:
    """Return the hint for a user at a prompt; it is the same for every limit."""
    return GO_ON


class Limits(Struct, frozen=True, kw_only=True):
    """The limits of a run of programs; None: no limit. `max_time`: time of the robot's clock [s]; `max_steps`: steps of
    all programs together; `max_elements`: elements of arrays and characters of strings; `max_output`: bytes printed
    with TYPE; `max_disk`: bytes written to files. All are counted in the same way on every machine. The defaults are
    for programs that nobody watches: they end an endless program soon. Raises ValueError for an invalid limit."""

    max_time: float | None = 3600.0
    max_steps: int | None = 10_000_000
    max_elements: int | None = 10_000_000
    max_output: int | None = 1_000_000
    max_disk: int | None = 10_000_000

    def __post_init__(self) -> None:
        for name, most in structs.asdict(self).items():
            number = most is None or (isinstance(most, int | float) and not isinstance(most, bool))
            if not number or (most is not None and (isnan(most) or most <= 0)):
                raise ValueError(f"{name}: a number above 0 is wanted, or None for any amount, not {most!r}")

    @property
    def last(self) -> float:
        """The maximum duration of a run, in seconds of the robot's clock; infinity if there is no limit."""
        return inf if self.max_time is None else self.max_time


ATTENDED = Limits(max_time=86_400.0, max_steps=None, max_output=100_000_000, max_disk=1_000_000_000)
"""Limits for a user's own programs while the user is present and can stop them: at a prompt, and in real time."""

OWN = structs.replace(ATTENDED, max_steps=100_000_000)
"""Limits for a user's own program while no user is present who could stop it."""


class Spent(Struct):
    """A counter of the bytes of one kind of output. `option`: the name of its limit in `Limits`; `done`: what the
    program does with the bytes (a verb for the error message); `advice`: returns the hint shown at the limit."""

    option: str
    done: str
    advice: Advice
    limits: Limits = ATTENDED
    count: int = 0

    def begin(self, limits: Limits) -> None:
        self.limits, self.count = limits, 0

    def add(self, size: int) -> None:
        """Add `size` bytes. Raises LimitReached if the total exceeds the limit."""
        most: int | None = getattr(self.limits, self.option)
        if most is not None and self.count + size > most:
            raise LimitReached(f"the program wanted to {self.done} more than {most} bytes", self.advice(self.option))
        self.count += size


REFUSED = ("socket.", "subprocess.", "os.exec", "os.fork", "os.posix_spawn", "os.spawn", "os.startfile", "os.system")


class Isolation:
    """A context in which this process can open no connection and start no other process: before either of these, Python
    calls an audit hook (`sys.audit`), which raises an error. A hook cannot be removed, so all contexts share one."""

    hooked = entered = False

    def __enter__(self) -> None:
        if not Isolation.hooked:
            sys.addaudithook(self._check)
        Isolation.hooked = Isolation.entered = True

    def __exit__(self, *_error: object) -> None:
        Isolation.entered = False

    @staticmethod
    def _check(event: str, _arguments: object) -> None:
        if Isolation.entered and event.startswith(REFUSED):
            raise PermissionError(f"a program of somebody else: {event} is not for this run")
