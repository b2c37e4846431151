"""Predict the motion of a robot over a slow connection, and keep the times for which viewers saw a wrong motion. Pure.

While a command is on its way, the user's side plans it as the robot will: it applies f (the planner) to the same
timeline, at the expected time of arrival. The planned change is unconfirmed until the robot's own change has arrived. A
viewer shows g (the position at a time of the timeline) at the present time, or `ahead` seconds later.

A change of the timeline becomes known here some time after the robot has applied it. During this delay, viewers see a
wrong motion for all times after the cut (the time from which the change replaces the timeline). `Flags` keeps these
times.
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
from vrs_cli.interfaces.users import need_of
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages
from vrs_cli.net.mirror import Mirror
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.acts import Execute, FollowChunk, Redo, Say, Steer, Undo
from vrs_cli.values.commands import Request
from vrs_cli.values.diagnostics import LineRefused

UNCONFIRMED = 1 << 40  # added to the numbers of previewed motions, so that they differ from the robot's


class Underway(Struct, frozen=True):
    """A command whose change is not in the known timeline yet.

    `issued`: the time of issue by the robot's clock [s]. `request`: None if the command cannot be planned here; then it
    may change the whole timeline after its arrival. `text`: the command as the user gave it. `version`: the version of
    the timeline that contains the change; None until the robot has executed the command.
    """

    request: Request | None
    issued: float
    text: str = ""
    version: int | None = None


class _ArrivalClock(VirtualClock):
    """A clock that shows the robot's time at the expected arrival of a command. It counts as real time, so the planner
    does not change the past."""

    realtime = True


class PreviewPlan(Struct, frozen=True):
    """The predicted timeline of a robot. `known`: the last timeline received; `timeline`: the known timeline changed by
    all commands on their way, that is, by `deltas`. `expected`, `settings`: the expected effect of each command, and
    the settings after it.
    """

    known: Timeline
    timeline: Timeline
    expected: tuple[Expected, ...] = ()
    settings: tuple[Settings, ...] = ()
    deltas: tuple[TimelineDelta, ...] = ()


class Preview:
    """A prediction of a robot's timeline from the known timeline and all commands on their way. `forward`: the expected
    delay D_f of a command [s]. Any thread may call any method.
    """

    def __init__(self, followed: Mirror, forward: float) -> None:
        self.forward, self._followed = forward, followed
        self._engine = Engine(followed.arm.model, clock=_ArrivalClock())
        self._underway: dict[int, Underway] = {}  # commands by id, in the order of sending
        # the last settings received, and the settings after the commands that the robot has carried out since then
        self._received = self._settings = followed.settings
        self._plan = self._planned_after(followed.timeline)
        self._stale, self._lock = False, Lock()

    # --- commands and answers ---

    def send(self, id: int, request: Request | None, issued: float, text: str = "") -> Expected:
        """Add a command that is on its way; return its expected effect. `issued`: the time of issue by the robot's
        clock [s]; `request`: None if the command cannot be planned here.
        """
        with self._lock:
            self._underway[id], self._stale = Underway(request, issued, text), True
            return self._plan_again().expected[-1]

    def begin(self, id: int) -> None:
        """Record that the robot has started a command. Forget a command that cannot be planned here: its changes now
        arrive from the robot, one after another."""
        with self._lock:
            if id in self._underway and self._underway[id].request is None:
                self._forget(id)

    def finish(self, id: int, version: int) -> None:
        """Record that the robot has carried out a command. `version`: the version of the timeline with its change,
        which may arrive later."""
        with self._lock:
            if id in self._underway:
                self._underway[id], self._stale = structs.replace(self._underway[id], version=version), True

    def refuse(self, id: int) -> None:
        """Forget a command that the robot refused."""
        with self._lock:
            self._forget(id)

    def _forget(self, id: int) -> None:
        self._stale |= self._underway.pop(id, None) is not None

    # --- expected motion ---

    @property
    def plan(self) -> PreviewPlan:
        """Return the timeline with all commands on their way, and their expected effects in the order of sending."""
        with self._lock:
            return self._plan_again()

    @property
    def timeline(self) -> Timeline:
        return self.plan.timeline

    @property
    def unconfirmed_from(self) -> float:
        """Return the time [s] after which the timeline is not confirmed by the robot; infinity if all of it is
        confirmed."""
        return min((it.begin for it in self.plan.expected if it.begin is not None), default=inf)

    def _plan_again(self) -> PreviewPlan:
        """Return the plan; make a new one if a command was sent or the robot's timeline has changed."""
        known = self._followed.timeline
        if self._stale or self._plan.known is not known:
            if self._received is not self._followed.settings:
                self._received = self._settings = self._followed.settings
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
        """Plan a command; return the earliest time at which it changes the timeline [s] (None: no change), or the error
        with which the robot will refuse it."""
        engine = self._engine
        count = len(engine.book.deltas)
        try:
            engine.begin(request, program=False, issued=issued)
        except VrsError as error:
            return None, error
        return min((delta.cut for delta in engine.book.deltas[count:]), default=None), None


CHANGING = frozenset(  # monitor commands that may change the timeline, besides all motions
    ("ABORT", "BRANCH", "COMMANDS", "EXECUTE", "LOAD", "MERGE", "NEXT", "PROCEED", "REDO", "RETRY", "UNDO", "XSTEP")
)


def changing_line(request: messages.Request) -> str | None:
    """Return the request as a line, if it may change the timeline; else None."""
    match request:
        case messages.Line(text=text) | messages.At(act=Say(line=text)):
            return text.strip() if _moves(text) else None
        case messages.At(act=Undo()):
            return "UNDO"
        case messages.At(act=Redo()):
            return "REDO"
        case messages.At(act=FollowChunk()):
            return "FOLLOW"
        case messages.At(act=Steer()):
            return "STEER"
        case messages.At(act=Execute(program)):
            return f"EXECUTE {program}"
        case messages.Abort():
            return "ABORT"
    return None


def _moves(text: str) -> bool:
    """Return whether a line, or the first line of pasted text, may move the robot."""
    try:
        statement = parse_prompt(text.strip().partition("\n")[0])
    except LineRefused:
        return False
    if statement is None or isinstance(statement, ProgramHeader):
        return False
    word, role = need_of(statement)
    return role is Role.DESIGNER or word in CHANGING


MAX_TARGET_AGE_S = 1.0  # [s] maximum time, besides a round trip, until the robot has applied or dropped a target


class DragTargets:
    """The issue times, by the robot's clock [s], of the targets of a dragged tool that are on their way to the robot. A
    repeated target does not count. Any thread may call any method.
    """

    def __init__(self) -> None:
        self._last: Transform | None = None
        self._under_way: deque[float] = deque()  # issue times of the targets [s]
        self._lock = Lock()

    def add(self, pose: Transform | None, issued: float) -> None:
        """Add a target (T_world_tool); None: the tool is released, which changes no motion."""
        with self._lock:
            if pose is not None and pose != self._last:
                self._under_way.append(issued)
            self._last = pose

    def drop_until(self, issued: float) -> None:
        """Forget the targets issued up to a time: the robot has applied or dropped them."""
        with self._lock:
            self._forget(issued)

    def _forget(self, issued: float) -> None:
        while self._under_way and self._under_way[0] <= issued:
            self._under_way.popleft()

    def oldest(self, now: float, round_trip: float) -> float | None:
        """Return the issue time [s] of the oldest target on its way; None if there is none."""
        with self._lock:
            self._forget(now - round_trip - MAX_TARGET_AGE_S)
            return self._under_way[0] if self._under_way else None


class FlagWindow(NamedTuple):
    """An interval of the robot's time [s]."""

    begin: float
    end: float


class Flags:
    """The times for which viewers saw a wrong motion, by the robot's clock [s]. `ahead`: how far ahead of the present
    viewers see the robot [s]."""

    def __init__(self, ahead: float = 0.0) -> None:
        self.ahead = ahead
        self.windows: tuple[FlagWindow, ...] = ()  # sorted by time; no two windows touch

    def add_change(self, cut: float, applied: float, at: float) -> FlagWindow | None:
        """Add a change of the timeline. `cut`: the time from which the changed timeline differs; `applied`: when the
        robot applied it; `at`: when it became known here [s]. Return the times that were shown wrongly; None if there
        are none.
        """
        window = FlagWindow(max(cut, applied), at + self.ahead)
        if window.end <= window.begin:
            return None
        windows, first = self.windows, len(self.windows)  # search from the end: usually the new window comes last
        while first and windows[first - 1].end >= window.begin:
            first -= 1
        self.windows = windows[:first] + merge_windows([*windows[first:], window])
        return window

    def forget(self, before: float) -> None:
        """Forget the windows that ended before a time [s]."""
        gone = bisect_left(self.windows, before, key=attrgetter("end"))
        self.windows = self.windows[gone:] if gone else self.windows


def merge_windows(windows: Iterable[FlagWindow]) -> tuple[FlagWindow, ...]:
    """Join windows that touch each other; return them in order."""
    found: list[FlagWindow] = []
    for window in sorted(windows):
        if found and window.begin <= found[-1].end:
            found[-1] = FlagWindow(found[-1].begin, max(found[-1].end, window.end))
        else:
            found.append(window)
    return tuple(found)
