"""Limits for the clients and the robots of a server. Each limit has its own error message. Pure: times are arguments. A
limit of one robot stops only the programs and lines of its users; users of other robots are not delayed."""

from __future__ import annotations

from math import inf

from msgspec import Struct, structs

from vrs_cli.errors import LimitReached, RequestRefused
from vrs_cli.interfaces.tasks.limits import ATTENDED, Limits

OURS = "the server sets this limit"
TO_MAKE_ROOM = "KILL, then ZERO, or DELETEP, DELETER, DELETES and DELETEL, make room"
HELP = {"max_elements": f"{TO_MAKE_ROOM}; {OURS}", "max_disk": f"FDELETE makes room; {OURS}"}
WRONG_TOKENS = 10  # maximum number of wrong tokens per minute from one address


def advice(option: str) -> str:
    """Return the hint for an exceeded limit of a program run; `option`: the field of `Limits`."""
    return HELP.get(option, OURS)


class Allowance(Struct, frozen=True):
    """The limits of a server.

    For one connection: `message`: bytes of one message; `rate`, `burst`: messages per second, and messages in one
    burst. `connections_each`, `connections`: connections of one token, and of all. For one robot: `names`: variables
    and programs; `elements`: elements of arrays and characters of strings; `segments` of its timeline; `folder`,
    `files`: bytes and files in its folder; `steps` of one program; `cpu`: the fraction of a core for its programs,
    averaged over `cpu_window` [s]. `looking`: the fraction of a core for a user who only views while another user
    drives, averaged over `looking_window` [s]; `all_looking`: the fraction for all these users together.
    """

    message: int = 2_000_000
    rate: float = 300.0
    burst: int = 1000
    connections_each: int = 64
    connections: int = 4000
    names: int = 50_000
    elements: int = 1_000_000
    segments: int = 2_000_000
    folder: int = 100_000_000
    files: int = 10_000
    cpu: float = 0.5
    cpu_window: float = 20.0
    looking: float = 0.1
    all_looking: float = 0.4
    looking_window: float = 2.0
    steps: int | None = None

    def of_run(self, *, realtime: bool) -> Limits:
        """Return the limits of one program run; in real time the duration is unlimited."""
        return structs.replace(
            ATTENDED,
            max_time=None if realtime else ATTENDED.max_time,
            max_steps=self.steps,
            max_elements=self.elements,
            max_disk=self.folder,
        )

    def of_looking(self, share: float, now: float) -> Bucket:
        """Return a budget of this fraction of a core, averaged over `looking_window`."""
        return Bucket(share, share * self.looking_window, now)


USUAL = Allowance()
UNMEASURED = 2**62  # [bytes] size limit for a user's own folder: too large to matter, so the folder is not measured


class Bucket:
    """A budget of messages or of CPU seconds, which grows by `rate` per second up to `most`. It may be overdrawn. Any
    thread may call `spend`."""

    def __init__(self, rate: float, most: float, now: float) -> None:
        self._rate, self.most = rate, most
        self._left, self._since = most, now

    def remaining(self, now: float) -> float:
        """Return the remaining budget; below 0 if it is overdrawn."""
        self._left = min(self.most, self._left + (now - self._since) * self._rate)
        self._since = now
        return self._left

    def spend(self, amount: float, now: float) -> None:
        self._left = self.remaining(now) - amount

    def take(self, now: float) -> bool:
        """Spend one unit if the budget has one; return whether it was spent."""
        there = self.remaining(now) >= 1.0
        self.spend(there, now)
        return there

    def wait(self, now: float) -> float:
        """Return the time until the budget is no longer overdrawn [s]."""
        return max(0.0, -self.remaining(now) / self._rate)


class Share:
    """The CPU budgets of a user who only views while another user drives.

    Requests made while the user types a line (completion, checks) have their own budget, so that these requests do not
    delay the line. `all`: the common budget of all viewing users; it delays only users who have used more than an equal
    share.
    """

    def __init__(self, allowance: Allowance, all: Bucket, now: float) -> None:
        self._lines = allowance.of_looking(allowance.looking, now)
        self._typing = allowance.of_looking(allowance.looking, now)
        self._all = all

    def spend(self, seconds: float, now: float, *, typing: bool) -> None:
        """Charge the user CPU time [s]. Any thread may call this method."""
        (self._typing if typing else self._lines).spend(seconds, now)
        self._all.spend(seconds, now)

    def wait(self, now: float, holders: int, *, typing: bool) -> float:
        """Return how long the next request must wait [s]; `holders`: number of users who share the common budget."""
        own = self._typing if typing else self._lines
        fair = own.most - own.remaining(now) <= self._all.most / holders
        return own.wait(now) if fair else max(own.wait(now), self._all.wait(now))


class Crowd:
    """The number of connections of each token name, and the addresses from which wrong tokens came recently."""

    def __init__(self, allowance: Allowance) -> None:
        self._allowance = allowance
        self._there: dict[str, int] = {}
        self._wrong: dict[str, Bucket] = {}

    def __len__(self) -> int:
        return sum(self._there.values())

    def enter(self, name: str) -> None:
        """Add a connection of a token name; connections without a name count only in the total. Raises
        RequestRefused."""
        allowance, there = self._allowance, self._there.get(name, 0)
        if len(self) >= allowance.connections:
            raise RequestRefused(f"this server has {allowance.connections} connections", "try again later")
        if name and there >= allowance.connections_each:
            raise RequestRefused(f"{name} has {there} connections", "close one of them")
        self._there[name] = there + 1

    def leave(self, name: str) -> None:
        self._there[name] -= 1
        if not self._there[name]:
            del self._there[name]

    def guess(self, address: str, now: float) -> None:
        """Count a wrong token from an address."""
        if len(self._wrong) >= self._allowance.connections:
            self._wrong.clear()  # there are too many addresses to remember, so forget all of them
        self._wrong.setdefault(address, Bucket(WRONG_TOKENS / 60.0, WRONG_TOKENS, now)).take(now)

    def guesses(self, address: str, now: float) -> bool:
        """Return whether too many wrong tokens came from an address recently."""
        bucket = self._wrong.get(address)
        return bucket is not None and bucket.remaining(now) < 1.0


class Meter:
    """The limit of the CPU time of one robot's programs: a fraction of a core, averaged over a window."""

    def __init__(self, allowance: Allowance, now: float) -> None:
        self._allowance, self._used, self._looked = allowance, 0.0, now
        self._bucket = Bucket(allowance.cpu, allowance.cpu * allowance.cpu_window, now)

    def look(self, used: float, now: float) -> LimitReached | None:
        """Return the reason why the programs must stop; None if they may continue. `used`: their total CPU time [s]."""
        self._bucket.spend(used - self._used, self._looked)  # count this CPU time as used at the time of the last call
        self._used, self._looked = used, now
        if self._bucket.remaining(now) >= 0.0:
            return None
        allowance = self._allowance
        self._bucket = Bucket(allowance.cpu, allowance.cpu * allowance.cpu_window, now)
        return LimitReached(
            f"programs took more than {allowance.cpu:.0%} of a core for {allowance.cpu_window:g} s",
            "let it wait now and then: DELAY, WAIT, a motion; the server sets this limit",
        )


def check_growth(allowance: Allowance, names: int) -> None:
    """Check that a robot has at most the allowed number of variables and programs. Raises LimitReached."""
    if names > allowance.names:
        raise LimitReached(f"it has {names} variables and programs, {allowance.names} at most", TO_MAKE_ROOM)


HIGH_WATER_BYTES = 256 * 1024  # the robot starts to wait for a user when more bytes than this are unsent
LOW_WATER_BYTES = 64 * 1024  # the robot stops waiting when no more bytes than this are unsent
MIN_PROGRESS_BYTES = 32 * 1024  # the robot gives up waiting if the user takes fewer bytes than this in SEND_TIMEOUT_S
SEND_TIMEOUT_S = (
    5.0  # [s] not shorter: TCP takes hundreds of KB at once for a slow reader, then nothing for a long time
)


class SendPace:
    """The decision whether a robot waits until a user has received the output of TYPE. In virtual time, a program
    writes as fast as it computes. `waiting`: unsent bytes for the user. If the user takes fewer than MIN_PROGRESS_BYTES
    in SEND_TIMEOUT_S, the robot does not wait again until only LOW_WATER_BYTES are unsent.
    """

    def __init__(self) -> None:
        self.waiting = 0
        self._least, self._until = (
            inf,
            0.0,
        )  # while the robot waits: unsent bytes at the last progress, and the time limit for the next progress [s]
        self._stuck = False

    def lags(self, now: float) -> bool:
        """Return whether the robot has to wait for the user. Call it in the robot's thread."""
        waiting, waited = self.waiting, self._least < inf
        if waiting <= (LOW_WATER_BYTES if waited or self._stuck else HIGH_WATER_BYTES):
            self._least, self._stuck = inf, False
        elif not self._stuck:
            if waiting <= self._least - MIN_PROGRESS_BYTES:
                self._least, self._until = waiting, now + SEND_TIMEOUT_S
            elif now > self._until:
                self._least, self._stuck = inf, True
        return self._least < inf
