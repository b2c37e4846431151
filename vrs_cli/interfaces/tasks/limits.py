"""When a run of a program is stopped that does not stop by itself."""

from __future__ import annotations

from collections.abc import Callable

from msgspec import Struct

from vrs_cli.errors import LimitReached

GO_ON = "SIGNAL sets an input that is waited for; RETRY lets a program go on"  # what helps at a prompt
LONGEST = 86_400.0  # [s] of virtual time that a program may take unless told otherwise: a day


class Limits(Struct, frozen=True):
    """When a program is stopped that does not stop by itself: counted alike on every machine. None: no limit.

    Robot's time [s], steps of all programs together, what their arrays and strings hold (elements and characters),
    bytes that are typed, and bytes that are written to files. `told_by`: what is said to help where one is reached.
    """

    max_time: float = LONGEST
    max_steps: int | None = None
    max_elements: int | None = 10_000_000
    max_output: int | None = 100_000_000
    max_disk: int | None = 1_000_000_000
    told_by: Callable[[str], str] = lambda _option: GO_ON

    def reached(self, option: str, what: str) -> LimitReached:
        """The error for `what` has come to the limit that an option sets."""
        return LimitReached(what, self.told_by(option))


USUAL = Limits()


class Spent(Struct):
    """Bytes of one kind that a run has put out: typed, or written to files."""

    option: str
    done: str
    limits: Limits = USUAL
    count: int = 0

    def begin(self, limits: Limits) -> None:
        self.limits, self.count = limits, 0

    def add(self, size: int) -> None:
        """Raises LimitReached instead of more than there may be."""
        most: int | None = getattr(self.limits, self.option)
        if most is not None and self.count + size > most:
            raise self.limits.reached(self.option, f"the program wanted to {self.done} more than {most} bytes")
        self.count += size
