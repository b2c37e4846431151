"""What a robot behind a slow line will do, as its user can know it, and what was shown wrongly. Pure.

The user's side plans a command that is still on its way as the robot will: it applies f to the same timeline, at the
time when the command should arrive. The planned change is unconfirmed until the robot's own change has come.

A viewer shows g at the time of its look, or `ahead` of it. A change of the timeline that arrives a while after it was
applied makes wrong what was shown meanwhile of the times after its cut: `Flags` keeps these times.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Iterable
from math import inf
from operator import attrgetter
from threading import Lock
from typing import NamedTuple

from msgspec import Struct, structs

from vrs_cli.engine.book import Book
from vrs_cli.engine.clock import VirtualClock
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.port.port import Expected
from vrs_cli.interfaces.rights import needed
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages
from vrs_cli.net.messages import Abort, At, Line
from vrs_cli.net.mirror import Mirror
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.acts import Execute, FollowChunk, Redo, Say, Steer, Undo
from vrs_cli.values.commands import Request
from vrs_cli.values.diagnostics import LineRefused

UNCONFIRMED = 1 << 40  # added to the numbers of motions that are previewed: no motion of a robot has such a number


class Underway(Struct, frozen=True):
    """A command that is not in the known timeline yet, issued at that time of the robot's clock [s]. Without a
    `request` it cannot be planned here, and may change everything from its arrival on. `text`: as it was given;
    `version`: of the timeline with its change, once the robot has done it.
    """

    request: Request | None
    issued: float
    text: str = ""
    version: int | None = None


class _ArrivalClock(VirtualClock):
    """The robot's clock at the expected arrival of a command: all before that time has happened."""

    realtime = True


class PreviewPlan(Struct, frozen=True):
    """The `known` timeline, and the `timeline` with all commands on their way, which is the known one after `deltas`;
    `settings`: after each command.
    """

    known: Timeline
    timeline: Timeline
    expected: tuple[Expected, ...] = ()
    settings: tuple[Settings, ...] = ()
    deltas: tuple[TimelineDelta, ...] = ()


class Preview:
    """The known timeline of a robot with all commands on their way to it. `forward`: the expected delay D_f [s]. Any
    thread may call any method.
    """

    def __init__(self, followed: Mirror, forward: float) -> None:
        self.forward = forward
        self._followed = followed
        self._engine = Engine(followed.arm.model, clock=_ArrivalClock())
        self._underway: dict[int, Underway] = {}  # in the order of sending
        self._told = self._settings = followed.settings  # by the robot, and with what it has done since
        self._plan = self._planned_after(followed.timeline)
        self._stale = False
        self._lock = Lock()

    # --- what is sent, and what is answered ---

    def sent(self, id: int, request: Request | None, issued: float, text: str = "") -> Expected:
        """Note a command that is on its way, issued at that time of the robot's clock [s]; return what is expected of
        it. `request` None: it cannot be planned here.
        """
        with self._lock:
            self._underway[id], self._stale = Underway(request, issued, text), True
            return self._planned().expected[-1]

    def begun(self, id: int) -> None:
        """Note that the robot has begun the command. The changes of one that cannot be planned here now come one by
        one.
        """
        with self._lock:
            if id in self._underway and self._underway[id].request is None:
                self._forget(id)

    def done(self, id: int, version: int) -> None:
        """Note that the robot has done the command. Its change made this version of the timeline, and may still
        come.
        """
        with self._lock:
            if id in self._underway:
                self._underway[id], self._stale = structs.replace(self._underway[id], version=version), True

    def refused(self, id: int) -> None:
        """Forget a command that the robot refused."""
        with self._lock:
            self._forget(id)

    def _forget(self, id: int) -> None:
        self._stale |= self._underway.pop(id, None) is not None

    # --- what is expected ---

    @property
    def plan(self) -> PreviewPlan:
        """The timeline with all commands on their way, and what is expected of each, in the order of sending."""
        with self._lock:
            return self._planned()

    @property
    def timeline(self) -> Timeline:
        return self.plan.timeline

    @property
    def unconfirmed(self) -> float:
        """The time [s] from which on the timeline is not confirmed by the robot; infinity if all of it is."""
        return min((it.begin for it in self.plan.expected if it.begin is not None), default=inf)

    def _planned(self) -> PreviewPlan:
        """Plan again if something was sent, or a change of the robot has come."""
        known = self._followed.timeline
        if self._stale or self._plan.known is not known:
            if self._told is not self._followed.settings:
                self._told = self._settings = self._followed.settings
            done = [(id, it.version) for id, it in self._underway.items() if it.version is not None]
            confirmed = {id for id, version in done if version <= known.version}
            for it, settings in zip(self._plan.expected, self._plan.settings, strict=True):
                self._settings = settings if it.id in confirmed else self._settings
            self._underway = {id: it for id, it in self._underway.items() if id not in confirmed}
            self._plan, self._stale = self._planned_after(known), False
        return self._plan

    def _planned_after(self, known: Timeline) -> PreviewPlan:
        engine, expected, settings = self._engine, list[Expected](), list[Settings]()
        if not self._underway:
            return PreviewPlan(known, known)
        engine.take_up(Bookmark(Book(known, known, number=UNCONFIRMED), self._settings, known.start))
        for id, it in self._underway.items():
            engine.clock.advance(it.issued + self.forward)
            begin, refused = (engine.now, None) if it.request is None else self._begin(it.request, it.issued)
            expected.append(Expected(id, it.text, it.issued, begin, refused, it.request is not None))
            settings.append(engine.settings)
        return PreviewPlan(known, engine.timeline, tuple(expected), tuple(settings), tuple(engine.book.deltas))

    def _begin(self, request: Request, issued: float) -> tuple[float | None, VrsError | None]:
        """Plan a command; return the time from which on it changes the timeline, or why the robot will refuse it."""
        engine = self._engine
        count = len(engine.book.deltas)
        try:
            engine.begin(request, program=False, issued=issued)
        except VrsError as error:
            return None, error
        return min((delta.cut for delta in engine.book.deltas[count:]), default=None), None


CHANGING = frozenset(  # words of the monitor, beside all motions
    ("ABORT", "BRANCH", "COMMANDS", "EXECUTE", "LOAD", "MERGE", "NEXT", "PROCEED", "REDO", "RETRY", "UNDO", "XSTEP")
)


def changing(request: messages.Request) -> str | None:
    """The request as it would be typed, if it may change the timeline; else None."""
    match request:
        case Line(text=text) | At(act=Say(line=text)):
            return text.strip() if _moves(text) else None
        case At(act=Undo()):
            return "UNDO"
        case At(act=Redo()):
            return "REDO"
        case At(act=FollowChunk()):
            return "FOLLOW"
        case At(act=Steer()):
            return "STEER"
        case At(act=Execute(program)):
            return f"EXECUTE {program}"
        case Abort():
            return "ABORT"
    return None


def _moves(text: str) -> bool:
    """Whether a line may move the robot; of pasted text, the first line."""
    try:
        statement = parse_prompt(text.strip().partition("\n")[0])
    except LineRefused:
        return False
    if statement is None or isinstance(statement, ProgramHeader):
        return False
    word, role = needed(statement)
    return role is Role.DESIGNER or word in CHANGING


PASSED_OVER = 1.0  # [s] and a round trip, after which nothing is told of a wish any more


class Wishes:
    """The places where a remote user wishes the dragged tool, from their sending until the robot follows them. Times
    are those of the robot's clock [s]. A wish that is repeated does not count. Any thread may call any method.
    """

    def __init__(self) -> None:
        self._last: Transform | None = None
        self._under_way: deque[float] = deque()  # when they were issued
        self._lock = Lock()

    def sent(self, pose: Transform | None, issued: float) -> None:
        """Note a wish; None: the tool is let go, which changes nothing that the robot does."""
        with self._lock:
            if pose is not None and pose != self._last:
                self._under_way.append(issued)
            self._last = pose

    def counted(self, issued: float) -> None:
        """Forget the wishes up to the one issued then: the robot follows it, or has dropped it."""
        with self._lock:
            self._forget(issued)

    def _forget(self, issued: float) -> None:
        while self._under_way and self._under_way[0] <= issued:
            self._under_way.popleft()

    def oldest(self, now: float, round_trip: float) -> float | None:
        """The issue time [s] of the first wish that the robot has not told of; None if there is none."""
        with self._lock:
            self._forget(now - round_trip - PASSED_OVER)
            return self._under_way[0] if self._under_way else None


class FlagWindow(NamedTuple):
    """Times from `begin` on, up to `end` [s]."""

    begin: float
    end: float


class Flags:
    """The times of which something wrong was shown, by the robot's clock [s]. `ahead`: a viewer shows so much more than
    the present [s].
    """

    def __init__(self, ahead: float = 0.0) -> None:
        self.ahead = ahead
        self.windows: tuple[FlagWindow, ...] = ()  # all of them, in order, and none that touches another

    def arrived(self, cut: float, applied: float, at: float) -> FlagWindow | None:
        """Note that a change of what is after `cut`, `applied` at the robot, became known to a viewer `at` that time.
        Return the times of which something wrong was shown; None if nothing was.
        """
        window = FlagWindow(max(cut, applied), at + self.ahead)
        if window.end <= window.begin:
            return None
        windows, first = self.windows, len(self.windows)  # usually it comes last: the search begins at the end
        while first and windows[first - 1].end >= window.begin:
            first -= 1
        self.windows = windows[:first] + merged([*windows[first:], window])
        return window

    def forget(self, before: float) -> None:
        """Forget the windows that ended before that time."""
        gone = bisect_left(self.windows, before, key=attrgetter("end"))
        self.windows = self.windows[gone:] if gone else self.windows


def merged(windows: Iterable[FlagWindow]) -> tuple[FlagWindow, ...]:
    """Return the same times in order, in windows that do not touch each other."""
    found: list[FlagWindow] = []
    for window in sorted(windows):
        if found and window.begin <= found[-1].end:
            found[-1] = FlagWindow(found[-1].begin, max(found[-1].end, window.end))
        else:
            found.append(window)
    return tuple(found)
