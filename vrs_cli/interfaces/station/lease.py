"""The lease of a robot: who drives it. Pure: every step takes the time of the day, and returns what is to be told.

One holder drives at a time, and keeps the lease alive by a heartbeat. Others ask for it. The holder gives it, or loses
it when no heartbeat came for a while, and never before.
"""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import LeaseHeld
from vrs_cli.values.tagged import Spoken

USUAL_LENGTH = 10.0  # [s] that a lease lasts after a heartbeat


class Granted(Spoken, frozen=True):
    """`to` drives from now on."""

    to: str


class Requested(Spoken, frozen=True):
    """`by` would like to drive; the holder `of` the lease is told."""

    of: str
    by: str


class Lost(Spoken, frozen=True):
    """`by` has taken the lease `of` a user whose heartbeat did not come; that user is told."""

    of: str
    by: str


Notice = Granted | Requested | Lost


def notice_text(notice: Notice | None, user: str) -> str:
    """Return the text of a notice for a user; empty if that only says who drives."""
    match notice:
        case Requested(of, by) if of == user:
            return f"{by} would like to drive"
        case Requested(of, by):
            return f"{of} is asked to let {'you' if by == user else by} drive"
        case Lost(of, by) if of == user:
            return f"{by} drives, for nothing was heard of you"
    return ""


class RobotLease(Struct, frozen=True):
    """`holder` drives until the time `until` [s], nobody if that is empty; `asking`: who has asked since, in order.

    A holder whose time has passed keeps the lease until another takes it.
    """

    holder: str = ""
    until: float = 0.0
    asking: tuple[str, ...] = ()
    length: float = USUAL_LENGTH

    def drives(self, who: str) -> bool:
        return bool(who) and who == self.holder

    def is_free(self, now: float) -> bool:
        """Return whether another user may take it."""
        return not self.holder or now > self.until

    def check(self, who: str) -> None:
        """Check that a user drives. Raises LeaseHeld."""
        if not self.drives(who):
            raise LeaseHeld(
                self._holder_text(), "ask for the lease; in the shell: /ask", in_python='lease("ask") asks for it'
            )

    def acquire(self, who: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Take the lease if nobody drives, or the time of its holder has passed. Raises LeaseHeld."""
        if self.drives(who):
            return self.beat(who, now), ()
        if not self.is_free(now):
            raise LeaseHeld(
                self._holder_text(), f"ask for the lease; it ends in {self.until - now:.1f} s without a heartbeat"
            )
        lost = (Lost(self.holder, who),) if self.holder else ()
        return self._give(who, now), (*lost, Granted(who))

    def ask(self, who: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Ask for the lease: take it at once if possible, else tell the holder once."""
        if self.is_free(now) or self.drives(who):
            return self.acquire(who, now)
        if who in self.asking:
            return self, ()
        return replace(self, asking=(*self.asking, who)), (Requested(self.holder, who),)

    def give(self, who: str, to: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Give the lease to another user, or to nobody (`to` is empty). Raises LeaseHeld if `who` does not drive."""
        self.check(who)
        if not to:
            return replace(self, holder="", until=now), ()
        return self._give(to, now), (Granted(to),)

    def beat(self, who: str, now: float) -> RobotLease:
        """Prolong the lease: its holder is still there. Raises LeaseHeld if `who` does not drive, or has lost it."""
        self.check(who)
        return replace(self, until=max(now + self.length, self.until))

    def leave(self, who: str, now: float) -> tuple[RobotLease, tuple[Notice, ...]]:
        """Note that a user has gone: a holder gives the lease to the user who asked first."""
        asking = tuple(one for one in self.asking if one != who)
        left = replace(self, asking=asking)
        return left.give(who, asking[0] if asking else "", now) if self.drives(who) else (left, ())

    def _give(self, to: str, now: float) -> RobotLease:
        return replace(self, holder=to, until=now + self.length, asking=tuple(one for one in self.asking if one != to))

    def _holder_text(self) -> str:
        return f"{self.holder} drives" if self.holder else "nobody drives"
